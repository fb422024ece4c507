"""Syntax tree → the same file in canonical layout.

Changes whitespace and line ends only: no word, value or comment is added, lost or moved to
another line, so the meaning stays. Formatting twice is formatting once.
"""

from __future__ import annotations

import re
from bisect import bisect
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby, takewhile
from typing import TypeAlias

from idlc.language import tree
from idlc.language.definition import parse_definition

#: A tab reaches to the next multiple of one of these, whichever makes more sense of a section.
TAB_WIDTHS = (8, 4)
#: Kinds of words in their order on a line, and the narrow gaps before them, usual first.
NARROW = {
    "type": (" ", ""),
    "name": (" ",),
    "default": (" ",),
    "sign": (" ", ""),
    "value": (" ", ""),
    "comment": ("  ", " "),
}

#: An edge that words can share in a column: the start of a word, or the end of a number.
_Edge: TypeAlias = tuple[str, int]


class _Word:
    """A word and the gap before it, which reaches from column `after` to column `start`."""

    def __init__(self, kind: str, gap: str, text: str) -> None:
        self.kind = kind
        self.gap = gap
        self.text = text
        self.after = self.start = self.end = 0
        self.keeps_column = False

    @property
    def is_wide(self) -> bool:
        return bool(self.gap) and self.gap not in NARROW[self.kind]

    @property
    def edges(self) -> tuple[_Edge, ...]:
        start = ("start", self.start)
        return (start, ("end", self.end)) if self.kind in ("default", "value") else (start,)


class _Row:
    """A line as words; `block` is the number of its run of definitions."""

    def __init__(self, line: tree.Line, block: int, tab: int) -> None:
        self.block = block
        self._words = list(_words(line))
        self._tab = tab
        self._measure()

    @property
    def text(self) -> str:
        return "".join(word.gap + word.text for word in self._words)

    @property
    def is_comment(self) -> bool:
        """True for a line that holds only a comment."""
        return len(self._words) == 1 and bool(self._words[0].gap)

    def find(self, kind: str) -> _Word | None:
        """Return the row's word of a kind."""
        return next((word for word in self._words if word.kind == kind), None)

    def change(self, word: _Word, gap: str) -> None:
        """Change the gap before a word; later words that keep their columns get new gaps too."""
        columns = [earlier.start for earlier in self._words]
        word.gap = gap
        self._measure()
        for later, column in zip(self._words, columns, strict=True):
            if later.keeps_column and later is not word and later.start != column:
                later.gap = " " * max(column - later.after, 1)
                self._measure()

    def _measure(self) -> None:
        text = ""
        for word in self._words:
            word.after = len(text.expandtabs(self._tab))
            text += word.gap
            word.start = len(text.expandtabs(self._tab))
            text += word.text
            word.end = len(text.expandtabs(self._tab))


_Column: TypeAlias = "list[tuple[_Row, _Word]]"


def _texts(section: tree.Section) -> list[str]:
    """Return the texts of a section's lines, without trailing whitespace but at its head."""
    # ROS 2 keeps trailing whitespace of the comment lines that head a section
    heading = takewhile(lambda line: line.comment and not line.code, section.lines)
    head = [line.comment for line in heading]
    lines = section.lines[len(head) :]
    old = [(line.code + line.comment).rstrip() for line in lines]
    tabs = TAB_WIDTHS if any("\t" in line.code for line in lines) else TAB_WIDTHS[:1]
    layouts = [_laid_out(lines, old, tab) for tab in tabs]
    return [*head, *min(layouts, key=lambda new: sum(map(str.__ne__, old, new)))]


def _laid_out(lines: Sequence[tree.Line], old: Sequence[str], tab: int) -> list[str]:
    rows: dict[int, _Row] = {}
    block = 0
    for number, line in enumerate(lines):
        if line.definition or line.is_indented_comment:
            rows[number] = _Row(line, block, tab)
        else:
            block += 1
    kinds = [[(row, word) for row in rows.values() if (word := row.find(kind))] for kind in NARROW]
    for column in kinds:
        columns = _columns(column)
        for _, word in column:
            in_column = bool(word.gap) and not columns.isdisjoint(word.edges)
            word.keeps_column = word.is_wide or in_column
    for row in rows.values():
        # a space on both sides of `=` if there is one on either side
        sign, value = row.find("sign"), row.find("value")
        if sign is not None and value is not None and bool(sign.gap) != bool(value.gap):
            row.change(value if sign.gap else sign, " ")
    for column in kinds:
        _place(column)
    return [rows[number].text if number in rows else text for number, text in enumerate(old)]


def _words(line: tree.Line) -> Iterator[_Word]:
    rest = line.after_optional or line
    before = len(line.code) - len(rest.code)
    text = rest.definition
    end = 0
    if rest is not line:
        yield _Word("annotation", "", tree.OPTIONAL)
        end = len(tree.OPTIONAL)
    for kind, piece in _pieces(text) if text else ():
        if piece.text:
            start = before + piece.start
            # other whitespace between words, such as a no-break space, becomes a space
            gap = re.sub(r"[^ \t]", " ", line.code[end:start])
            end = before + piece.end
            yield _Word(kind, gap, line.code[start:end])
    if line.comment:
        yield _Word("comment", re.sub(r"[^ \t]", " ", line.code[end:]), line.comment.rstrip())


def _pieces(text: str) -> Iterator[tuple[str, tree.Piece]]:
    body = parse_definition(text)
    if isinstance(body, tree.Fault):
        yield "type", tree.Piece(text, 0)
        return
    yield "type", body.type.whole
    yield "name", body.name
    if isinstance(body, tree.Constant):
        yield "sign", tree.Piece("=", text.index("=", body.type.whole.end))
        yield "value", body.value
    elif body.default is not None:
        yield "default", body.default


def _columns(words: _Column) -> set[_Edge]:
    """Return the edges that several words share, at least one of them after a wide gap."""
    placed = [word for _, word in words if word.gap]
    shared = Counter(edge for word in placed for edge in word.edges)
    wide = {edge for word in placed if word.is_wide for edge in word.edges}
    return {edge for edge in wide if shared[edge] > 1}


def _place(words: _Column) -> None:
    """Close the stray gaps before the words of one kind in a section."""
    columns = _columns(words)
    usual = _common_gap(words)
    for _, group in groupby(words, lambda pair: pair[0].block):
        block = list(group)
        gaps = {word.gap for row, word in block if not row.is_comment}
        alone = len(block) == 1 and block[0][1].kind != "comment"
        if len(gaps) == 1 and "" not in gaps and not alone:
            continue  # they are the same; a single comment may be anywhere
        starts = ((at, word.start) for at, (_, word) in enumerate(block))
        anchors = [(at, start) for at, start in starts if ("start", start) in columns]
        for at, (row, word) in enumerate(block):
            is_loose = word.is_wide or (not word.gap and "" not in NARROW[word.kind])
            if is_loose and not row.is_comment and columns.isdisjoint(word.edges):
                width = _nearest(anchors, at) - word.after
                row.change(word, " " * width if width > 0 else usual)


def _nearest(anchors: Sequence[tuple[int, int]], at: int) -> int:
    """Return the column of the nearest anchor, the one above first; 0 if there is none."""
    after = bisect(anchors, (at, 0))
    close = anchors[max(after - 1, 0) : after + 1]
    return min(close, key=lambda anchor: abs(anchor[0] - at), default=(0, 0))[1]


def _common_gap(words: _Column) -> str:
    """Return the narrow gap before words of a kind: of those before comments the most common."""
    if not words or words[0][1].kind != "comment":
        return " "  # where `=` has a stray gap, it has one on either side
    counts = Counter(word.gap for _, word in words)
    return max(NARROW["comment"], key=lambda gap: counts[gap])


#: Trailing whitespace.
_INVISIBLE = re.compile(r"[ \t]+$", re.MULTILINE)
#: More blank lines than these in a row have no meaning.
BLANK_LINES = 2


def format_file(file: tree.File) -> str:
    """Return the text of a file in canonical layout; lines that are no definitions stay.

    A file that differs only in trailing whitespace, of lines and of the file, is in order.
    """
    ends = (line.newline for section in file.sections for line in section.lines)
    # the first usual line end, which all lines get
    newline = next((end for end in ends if end in ("\n", "\r\n")), "\n")
    if file.separators and file.source.text.startswith("---\r\n", file.separators[0]):
        newline = "\r\n"
    out: list[str] = []
    for number, section in enumerate(file.sections):
        if number:
            out.append("---")
        out += _trimmed(_texts(section), first=number == 0)
    while out and not out[-1]:
        del out[-1]
    text = "".join(line + newline for line in out)
    bare, own = (_INVISIBLE.sub("", words).rstrip() for words in (text, file.source.text))
    return file.source.text if bare == own else text


def _trimmed(texts: Iterable[str], *, first: bool) -> Iterator[str]:
    """Yield lines without needless blank ones; blank lines between comments stay."""
    blanks = 0
    begun = False
    for text in texts:
        if not text:
            blanks += 1
            continue
        # a blank line before the first comment separates it from the whole structure
        yield from [""] * min(blanks, BLANK_LINES if begun else 1)
        yield text
        blanks, begun = 0, True
    if not first or begun:
        yield from [""] * min(blanks, BLANK_LINES)
