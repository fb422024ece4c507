"""All codes: their pages as one Markdown document, which is docs/rules.md, and their names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import groupby

from idlc.diagnostics.code_pages import page
from idlc.diagnostics.codes import CODES
from idlc.diagnostics.report import Severity

_GROUPS = {
    "1": "Syntax",
    "2": "Names and references",
    "3": "Types, bounds and values",
    "40": "Style",
    "41": "Surprises of ROS 2's pipeline",
    "42": "Portability",
    "45": "The package around",
    "49": "Remarks that silence others",
    "5": "Breaking changes",
    "6": "Files and projects",
    "9": "idlc itself",
}

_HEAD = """\
# Rules

What idlc can say, and what to do about it. This file is what `idlc explain --all` prints.

Errors are what ROS 2 itself refuses, and cannot be switched off. Warnings are advice:

```toml
[tool.idlc.check]
select = ["all"]            # instead of what is on by default: categories, codes, `IDL40`, slugs
ignore = ["wide-string"]

[tool.idlc.check.per-path]
"msg/legacy/*" = ["style"]
```

The categories are correctness, portability, style and package. In a file,
`# idlc: ignore[IDL405] why` silences one warning: after a definition on that line, on a line of
its own for the next definition, at the head for the whole file. The reason is mandatory. Beside a
unit write `ignore(IDL405)`, because ROS 2 takes text in square brackets for the unit.
"""


def document() -> str:
    """Return the document."""
    return "\n".join(_parts())


def _parts() -> Iterator[str]:
    yield _HEAD
    for group, ids in groupby(sorted(CODES), _group):
        yield f"## {group}\n"
        yield from map(_section, ids)


def overview() -> Iterator[str]:
    """Yield the lines of a list of all codes, by group."""
    width = max(len(code.slug) for code in CODES.values())
    for group, ids in groupby(sorted(CODES), _group):
        yield f"{group}"
        for code in map(CODES.__getitem__, ids):
            yield f"  {code.id}  {code.slug:{width}}  {code.severity.name.lower()}"
        yield ""
    yield "`idlc explain IDL201` or `idlc explain unknown-type` shows a page."


def _group(code: str) -> str:
    digits = code.removeprefix("IDL")
    return _GROUPS.get(digits[:2]) or _GROUPS.get(digits[:1]) or _GROUPS["45"]


def _section(code: str) -> str:
    """Return a page with its headings two levels down, and how bad it is."""
    kind = "error" if CODES[code].severity is Severity.ERROR else "warning"
    title, _, body = (page(code) or f"# {code} {CODES[code].slug}\n").partition("\n")
    body = re.sub(r"(?m)^## (.*)$", r"**\1**", body)
    return f"##{title} ({kind})\n{body}"
