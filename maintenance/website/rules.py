"""The pages of rules: one for each code, from idlc itself, and one that lists them."""

from __future__ import annotations

import re
from collections.abc import Iterator

from idlc.diagnostics import explain
from idlc.diagnostics.codes import CODES
from idlc.diagnostics.explain import page

_SECTION = re.compile(r"### (IDL\d+) (\S+) \((.*)\)\n\n((?:.+\n)+)")


def pages() -> dict[str, bytes]:
    """Return the text of each page by its place."""
    texts = {code: _page(code) for code in CODES}
    texts["index"] = "\n".join(_overview())
    return {f"rules/{name}.md": text.encode("utf-8") for name, text in texts.items()}


def _page(code: str) -> str:
    title, _, text = (page(code) or "").partition("\n")
    text = re.sub(r"(?m)^## (.*)$", r"**\1**", text)
    kind = CODES[code].kind.capitalize()
    line = f"{kind} · `idlc explain {code}` prints this page · [All rules](index.md)"
    return f"{title}\n\n{line}\n{text}"


def _overview() -> Iterator[str]:
    head, *sections = re.split(r"(?m)^## ", explain.document())
    yield head
    for section in sections:
        heading, _, text = section.partition("\n")
        yield f"## {heading}\n\n| code | name | severity | meaning |\n|---|---|---|---|"
        for code, slug, kind, first in _SECTION.findall(text):
            yield f"| [{code}]({code}.md) | `{slug}` | {kind} | {' '.join(first.split())} |"
        yield ""
