"""Source → syntax tree. Never raises on a user's text: a line without meaning becomes a `Fault`.

`grammar.lark` is the reference, and no construct of it is hard to find in a text. So this reads
files without lark, which takes longer to load than all other work on a file; lark says where a
type goes wrong. `tests/language/test_parse.py::test_any_text_is_read_as_lark_reads_it`
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from idlc.diagnostics import codes
from idlc.diagnostics.source import Source
from idlc.language import tree

if TYPE_CHECKING:
    from lark import Lark

    from idlc.language import idl

#: The characters that end a line, as `str.splitlines` has it (language 1.1).
LINE_ENDS = "\n\r\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029"
#: Types of at most so many characters are parsed once: most files share a few.
COMMON = 200


@lru_cache(maxsize=1)
def grammar() -> str:
    """Return the content of grammar.lark."""
    return Path(__file__).with_name("grammar.lark").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def terminals() -> dict[str, str]:
    """Return the regular expressions of the grammar's terminals by their names."""
    definitions = re.findall(r"(?m)^(\w+)(?:\.\d+)?: /(.*)/([a-z]*)$", grammar())
    return {
        name: f"(?{flags}:{pattern})" if flags else pattern for name, pattern, flags in definitions
    }


def parse(source: Source) -> tree.File:
    """Return the sections and lines of a file; always succeeds."""
    sections: list[tree.Section] = []
    separators: list[int] = []
    lines: list[tree.Line] = []
    first = start = 0
    for line in source.text.splitlines(keepends=True) or ("",):
        text = line.rstrip(LINE_ENDS)
        end = start + len(line)
        if text == "---":
            sections.append(tree.Section(first, tuple(lines)))
            separators.append(start)
            lines = []
            first = end
        else:
            code, sign, comment = text.partition("#")
            lines.append(tree.Line(start, code, sign + comment, line[len(text) :] or "\n"))
        start = end
    return tree.File(source, (*sections, tree.Section(first, tuple(lines))), tuple(separators))


def parse_any(source: Source) -> tree.File | idl.IdlFile:
    """Return the syntax of a file of either language; always succeeds."""
    if not source.is_idl:
        return parse(source)
    from idlc.language.idl import parse_idl  # only recordings hold IDL

    return parse_idl(source)


def parse_definition(text: str) -> tree.Body:
    """Return the definition on one line; `text` is a `Line.definition` and not empty."""
    word, space, rest = text.partition(" ")
    type_ = (_type if len(word) > COMMON else _common_type)(word) if space else None
    if type_ is None:
        return _fault(text, word)
    rest = rest.lstrip()
    at = len(text) - len(rest)
    name, equals, value = rest.partition("=")
    if equals:
        value = value.lstrip()
        pieces = tree.Piece(name.rstrip(), at), tree.Piece(value, len(text) - len(value))
        return tree.Constant(type_, *pieces)
    name, _, value = rest.partition(" ")
    value = value.lstrip()
    default = tree.Piece(value, len(text) - len(value)) if value else None
    return tree.Field(type_, tree.Piece(name, at), default)


@lru_cache(maxsize=1)
def _type_pattern() -> re.Pattern[str]:
    name, size = terminals()["TYPE_NAME"], terminals()["SIZE"]
    return re.compile(rf"{name}(?:<={size})?(?:\[(?:(?:<=)?{size})?\])?")


def _type(text: str) -> tree.Type | None:
    if not _type_pattern().fullmatch(text):
        return None
    element, _, size = text.partition("[")
    name, _, bound = element.partition("<=")
    at_most = size.startswith("<=")
    size = size.removeprefix("<=").removesuffix("]")
    at = len(element)
    return tree.Type(
        tree.Piece(text, 0),
        tree.Piece(name, 0),
        tree.Piece(bound, at - len(bound)) if bound else None,
        tree.Piece(text[at:], at) if at < len(text) else None,
        at_most,
        tree.Piece(size, len(text) - 1 - len(size)) if size else None,
    )


_common_type = lru_cache(maxsize=512)(_type)


def _fault(text: str, type_: str) -> tree.Fault:
    """Return the problem of a `text` that is no definition; `type_` is its first word."""
    start, end = 0, len(type_)
    if text[0].isspace():
        code, end = codes.INDENTED_DEFINITION, len(text) - len(text.lstrip())
        message = "a definition must begin in the first column"
        hint = "remove the whitespace before it"
    elif text == "---":
        code, message = codes.MALFORMED_SEPARATOR, "a separator must be alone on its line"
        hint = "remove the whitespace or comment after it"
    elif not text.strip("-"):
        code, message = codes.MALFORMED_SEPARATOR, f"`{text}` is not a separator"
        hint = "a separator is a line of exactly three dashes, `---`"
    elif text == type_:
        code, message = codes.MISSING_NAME, f"missing name after `{type_}`"
        hint = "write `TYPE name`; a comment begins with `#`"
    else:
        code, message = codes.MALFORMED_TYPE, f"malformed type `{type_}`"
        hint = "write `T`, `T[]`, `T[3]`, `T[<=3]`, `string<=10` or `package/Name`"
        if type_.count("[") > 1:
            hint = "arrays cannot be nested; move the inner array into a message"
        elif "<" in type_ and "<=" not in type_:
            hint = "an upper bound is written `<=`, as in `string<=10` or `int32[<=10]`"
        start = _error(text, end - 1)
    return tree.Fault(code, message, start, end, hint)


def _error(text: str, last: int) -> int:
    """Return the offset at which lark gives up on a definition, or `last` if that is before."""
    from lark.exceptions import UnexpectedInput

    try:
        lark().parse(text, start="definition")
    except UnexpectedInput as error:
        return min(getattr(error, "pos_in_stream", None) or 0, last)
    return 0


@lru_cache(maxsize=1)
def lark() -> Lark:
    """Return the parser that lark makes of the grammar."""
    from lark import Lark

    return Lark(grammar(), parser="lalr", start=["file", "definition", "literal"])
