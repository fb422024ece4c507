"""Syntax tree → the same file in canonical layout.

Changes blanks, line ends and nothing else: no word, value or comment is added, lost or moved to
another line, so the meaning stays. Conservative: what is laid out with care stays as it is, such
as comments that stand in one column, or `=` signs that do. Formatting twice is formatting once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

from idlc.syntax import tree
from idlc.syntax.parse import parse_definition

TAB_WIDTH = 8
#: Definitions that are longer have their comments behind them, not in the block's column.
WIDEST = 200
#: Between a definition and its comment, where the comments of a block are not in one column yet.
COMMENT_GAP = 2
#: More blank lines than these in a row say nothing.
BLANK_LINES = 2


class _Row(NamedTuple):
    """One line on its way to the output; `column` is where its comment stood, if it has one."""

    code: str = ""
    comment: str = ""
    column: int = 0
    body: tree.Body | None = None

    @property
    def is_blank(self) -> bool:
        return not self.code and not self.comment

    @property
    def is_comment_line(self) -> bool:
        """Whether the line is a comment that begins in the first column."""
        return not self.code and bool(self.comment) and not self.column

    @property
    def text(self) -> str:
        if not self.comment:
            return self.code
        return self.code.ljust(self.column) + self.comment


def format_file(file: tree.File) -> str:
    """Return the text of a file in canonical layout; lines that are no definitions stay."""
    newline = _newline(file)
    out: list[str] = []
    for number, section in enumerate(file.sections):
        if number:
            out.append("---")
        rows = _trimmed(_laid_out(_rows(section)), first=number == 0)
        out += [row.text for row in rows]
    while out and not out[-1]:
        del out[-1]
    return "".join(line + newline for line in out)


def _newline(file: tree.File) -> str:
    """Return the file's first usual line end, which all lines get."""
    ends = (line.newline for section in file.sections for line in section.lines)
    found = next((end for end in ends if end in ("\n", "\r\n")), "\n")
    if file.separators and file.source.text.startswith("---\r\n", file.separators[0]):
        return "\r\n"
    return found


def _rows(section: tree.Section) -> list[_Row]:
    rows: list[_Row] = []
    in_head = True
    for line in section.lines:
        in_head = in_head and bool(line.comment) and not line.code
        # ROS 2 keeps blanks at the ends of the comment lines that head a section
        comment = line.comment if in_head else line.comment.rstrip()
        column = len(line.code.expandtabs(TAB_WIDTH))
        text = line.definition
        body = parse_definition(text) if text.strip() else None
        rows.append(_Row("" if body is None else text, comment, column if comment else 0, body))
    return rows


def _trimmed(rows: Iterable[_Row], *, first: bool) -> Iterator[_Row]:
    """Yield rows without needless blank lines; those that divide comments stay."""
    blanks = 0
    begun = False
    for row in rows:
        if row.is_blank:
            blanks += 1
            continue
        # a blank line before the first comment says that it is not about the whole structure
        limit = BLANK_LINES if begun else int(row.is_comment_line or not first)
        yield from [_Row()] * min(blanks, limit)
        yield row
        blanks, begun = 0, True
    if not first or begun:
        yield from [_Row()] * min(blanks, BLANK_LINES)


def _laid_out(rows: Sequence[_Row]) -> Iterator[_Row]:
    """Yield rows with their code and comments laid out, block by block.

    A block is a run of definitions and of the indented comments behind them.
    """
    for apart, run in groupby(rows, key=lambda row: row.is_blank or row.is_comment_line):
        block = list(run)
        yield from block if apart else _with_comments(block, list(_with_code(block)))


def _with_code(block: Iterable[_Row]) -> Iterator[_Row]:
    for is_constant, run in groupby(block, key=lambda row: isinstance(row.body, tree.Constant)):
        rows = list(run)
        if is_constant:
            yield from _constants(rows)
        else:
            yield from (row._replace(code=_code(row)) for row in rows)


def _code(row: _Row) -> str:
    body = row.body
    if isinstance(body, tree.Field):
        default = [body.default.text] if body.default else ()
        return " ".join([body.type.whole.text, body.name.text, *default])
    return row.code


def _constants(rows: Sequence[_Row]) -> Iterator[_Row]:
    """Yield constants with `=` or ` = `, as they had it; `=` signs in one column stay in one."""
    found = [(row, row.body) for row in rows if isinstance(row.body, tree.Constant)]
    signs = [row.code.index("=", body.type.whole.end) for row, body in found]
    gaps = [sign - body.name.end for sign, (_, body) in zip(signs, found, strict=True)]
    in_column = len(set(signs)) == 1 and min(gaps) >= 1 and max(gaps) > 1
    heads = [f"{body.type.whole.text} {body.name.text}" for _, body in found]
    width = max(map(len, heads)) if in_column else 0
    for (row, body), sign, gap, head in zip(found, signs, gaps, heads, strict=True):
        tight = not gap and (body.value.start == sign + 1 or not body.value.text)
        between = "=" if tight else " = "
        yield row._replace(code=f"{head.ljust(width)}{between}{body.value.text}".rstrip())


def _with_comments(old: Sequence[_Row], new: Sequence[_Row]) -> Iterator[_Row]:
    """Yield a block's rows with the comments behind definitions in one column.

    They keep their column if they have one already. An indented comment that stood below the
    comment of its definition stays below it; any other keeps its place.
    """
    columns = {row.column for row in old if row.code and row.comment}
    lengths = [len(row.code) for row in new if row.code and row.comment]
    width = max((length for length in lengths if length <= WIDEST), default=0)
    column = max(columns, default=0)
    if len(columns) > 1 or column <= width:
        column = width + COMMENT_GAP
    above: int | None = None
    place = column
    for row in new:
        if row.code:
            above = row.column if row.comment else None
            place = column if column > len(row.code) else len(row.code) + COMMENT_GAP
        if row.comment and (row.code or row.column == above):
            yield row._replace(column=place)
        else:
            yield row
