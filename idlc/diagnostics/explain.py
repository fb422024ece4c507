"""All codes: their pages as one Markdown document, and their names."""

from __future__ import annotations

import re
from bisect import bisect
from collections.abc import Iterator
from importlib.resources import files
from itertools import groupby
from operator import attrgetter

from idlc.diagnostics.codes import CATEGORIES, CODES, DiagnosticCode, find
from idlc.diagnostics.text import closest

SECTIONS = ("## Why", "## Bad", "## Good")


def page(word: str) -> str | None:
    """Return the Markdown page of a code, given by id or name; `None` if there is none."""
    code = find(word)
    if code is None:
        return None
    path = files("idlc.diagnostics") / "explain" / f"{code.id}.md"
    return path.read_text(encoding="utf-8") if path.is_file() else None


def close_name(word: str) -> str | None:
    """Return the id or name of a code that is nearest to a word, `None` if none is near."""
    return closest(word.upper(), CODES) or closest(word, (code.slug for code in CODES.values()))


#: Headings of the list of codes, each from its number on.
_HEADINGS = {
    100: "Syntax",
    200: "Names and references",
    300: "Types, bounds and values",
    400: "Style",
    410: "Pitfalls of ROS 2's tools",
    420: "Portability",
    450: "Packages",
    490: "Comments for idlc",
    500: "Breaking changes",
    600: "Files and projects",
    900: "idlc itself",
}

_HEAD = f"""\
# Rules

This page lists every rule of idlc.

An error marks a file that ROS 2 rejects. You cannot disable errors, but you can select warnings:

```toml
[tool.idlc.check]
select = ["all"]            # replaces the default: categories, codes, `IDL40`, names
ignore = ["wide-string"]

[tool.idlc.check.per-path]
"msg/legacy/*" = ["style"]
```

The categories are {", ".join(CATEGORIES[:-1])} and {CATEGORIES[-1]}.

To ignore one warning in a file, write a comment such as `# idlc: ignore[IDL405] why`. The reason is
mandatory. After a definition, the comment applies to that line. On a line of its own, it applies to
the next definition. At the top of the file, it applies to the whole file. Next to a unit, write
`ignore(IDL405)`, because ROS 2 reads text in square brackets as the unit.
"""


def document() -> str:
    """Return the document."""
    parts = [_HEAD]
    for heading, codes in _by_heading():
        parts += [f"## {heading}\n", *map(_section, codes)]
    return "\n".join(parts)


def overview() -> Iterator[str]:
    """Yield the lines of a list of all codes, by group."""
    width = max(len(code.slug) for code in CODES.values())
    for heading, codes in _by_heading():
        yield heading
        yield from (f"  {code.id}  {code.slug:{width}}  {code.kind}" for code in codes)
        yield ""
    yield "Run `idlc explain IDL201` or `idlc explain unknown-type` to read about a rule."


def _by_heading() -> Iterator[tuple[str, Iterator[DiagnosticCode]]]:
    starts = [*_HEADINGS]
    codes = sorted(CODES.values(), key=attrgetter("id"))
    return groupby(codes, lambda code: _HEADINGS[starts[bisect(starts, int(code.id[3:])) - 1]])


def _section(code: DiagnosticCode) -> str:
    """Return a page with its headings two levels down, and how bad it is."""
    title, _, body = (page(code.id) or f"# {code.id} {code.slug}\n").partition("\n")
    body = re.sub(r"(?m)^## (.*)$", r"**\1**", body)
    return f"##{title} ({code.kind})\n{body}"
