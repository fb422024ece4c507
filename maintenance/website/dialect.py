"""GitHub's Markdown, in which documents are written → that of the generator.

It wants four columns of indentation in every list, an empty line before one, and a word that it
knows after the beginning of a block of code, where ours may have the name of a file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

_FENCE = re.compile(r"( *)(`{3,})(.*)$")
_ITEM = re.compile(r"( *)(?:[*+-]|\d+[.)]) +(?=\S)")
_LANGUAGES = {"py": "python", "xml": "xml", "toml": "toml", "jinja": "jinja"}
_DEPTH = 4


def translated(text: str) -> str:
    """Return a document as the generator reads it."""
    return "\n".join(_lines(text.split("\n")))


def _lines(lines: list[str]) -> Iterator[str]:
    inside: list[int] = []  # where the text of each list around begins
    fence = ""
    before = ""
    for line in lines:
        indent = len(line) - len(line.lstrip(" "))
        if not fence and line.strip():
            while inside and indent < inside[-1]:
                inside.pop()
        start = inside[-1] if inside else 0
        margin = " " * (_DEPTH * len(inside))
        found = _FENCE.match(line)
        if found and not fence:
            fence = found[2]
            line = f"{found[1]}{fence}{_info(found[3])}"
        elif found and found[2] == fence and not found[3]:
            fence = ""
        elif not fence and (item := _ITEM.match(line)) and indent - start < _DEPTH:
            if not inside and before.strip() and not _ITEM.match(before) and before[:1] != " ":
                yield ""
            inside.append(item.end())
        before = line
        yield margin + line[min(start, indent) :] if line.strip() else ""


def _info(words: str) -> str:
    """Return what follows the beginning of a block of code."""
    word, *_ = words.split() or [""]
    if "/" not in word and "." not in word:
        return word
    return f' {_LANGUAGES.get(word.rpartition(".")[2], "text")} title="{word}"'
