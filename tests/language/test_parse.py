"""Files are divided into lines, and lines are parsed into trees."""

import json

import pytest

from idlc.diagnostics.source import Source
from idlc.language import definition, tree
from idlc.language.definition import parse_definition
from idlc.language.parse import parse
from tests.support.examples import example, given, st
from tests.support.paths import GOLDEN
from tests.support.refresh import refreshed, wanted

#: Lines of invented and mutated files in JSON, and below each its tree: a field or constant with
#: the offsets of its pieces, `-` for each that is not there, or a fault. A type has its whole, its
#: name, the bound of the string, the brackets, `<=` in brackets, and the size.
TREES = GOLDEN / "definitions.txt"
PIECES = ["int8", "a", "B", " ", "  ", "=", "<=", "[", "]", "3", "/", "x y", '"', ",", "-", "\xa0"]


def shown(text, node):
    """Return a node of a line's tree; a piece must have the text at its offsets."""
    match node:
        case tree.Piece(start=start, end=end):
            assert text[start:end] == node.text
            return f"{start}:{end}"
        case tree.Fault(start=start, end=end):
            return f"{node.code.id} {start}:{end} {json.dumps([node.message, node.hint])}"
        case bool():
            return "<=" if node else "-"
        case None:
            return "-"
    parts = (shown(text, getattr(node, name)) for name in node.__struct_fields__)
    return f"{type(node).__name__}({' '.join(parts)})"


def test_lines_have_the_trees_of_the_golden_file():
    lines = TREES.read_text(encoding="ascii").splitlines()[::2]
    texts = [json.loads(line) for line in lines]
    trees = [shown(text, parse_definition(text)) for text in texts]
    pairs = zip(lines, trees, strict=True)
    expected = "".join(f"{line}\n    {tree}\n" for line, tree in pairs)
    if wanted("definitions"):
        TREES.write_text(expected, encoding="ascii")
        refreshed()
    assert TREES.read_text(encoding="ascii").splitlines() == expected.splitlines()
    assert len(set(lines)) >= 2000


@given(st.lists(st.sampled_from(PIECES) | st.text(max_size=2)).map("".join))
@example("int8  =5")
@example("int8 A  =  ")
@example("string<=3<=4 a")
def test_pieces_are_parts_of_the_line(text):
    for section in parse(Source("A.msg", text)).sections:
        for line in filter(None, (line.definition for line in section.lines)):
            body = parse_definition(line)
            shown(line, body)
            if isinstance(body, tree.Fault):
                assert 0 <= body.start < body.end <= len(line)


def test_lines_are_divided_at_every_line_end_and_at_the_first_number_sign():
    file = parse(Source("A.srv", 'int8 a # "#"\r\n---\n#\u2028\n ---\r\tint8 b'))
    assert [(section.start, section.lines) for section in file.sections] == [
        (0, (tree.Line(0, "int8 a ", '# "#"', "\r\n"),)),
        (
            18,
            (
                tree.Line(18, "", "#", "\u2028"),
                tree.Line(20, "", "", "\n"),
                tree.Line(21, " ---", "", "\r"),
                tree.Line(26, "\tint8 b", "", "\n"),
            ),
        ),
    ]
    assert file.separators == (14,)


HOSTILE = {
    "a long name": "int8 " + "a" * 400_000,
    "spaces in a name": "int8 a" + " " * 400_000 + "b",
    "spaces before a sign": "int8 A" + " " * 400_000 + "=5",
    "words before a sign": "int8 " + "A " * 200_000 + "=5",
    "words": "int8 " + "a " * 200_000 + "b",
    "signs": "int8 A" + "=" * 400_000,
    "digits": "int8 a " + "1" * 400_000,
    "a large size": "int8[" + "1" * 400_000 + "] a",
    "a long type": "a" * 400_000 + " a",
    "no name": "a" * 400_000,
    "brackets": "int8" + "[" * 400_000 + "] a",
    "pairs of brackets": "int8" + "[]" * 200_000 + " a",
    "bounds": "string" + "<=" * 200_000 + " a",
    "angles": "<" * 400_000 + " a",
    "dashes": "-" * 400_000,
    "spaces": " " * 400_000 + "a",
}


@pytest.mark.timeout(60)
@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_line_takes_no_more_than_linear_time(text):
    """It would take hours if time grew with the square of the length."""
    shown(text, parse_definition(text))


def test_only_some_short_lines_are_kept():
    definition._parse_common.cache_clear()
    for number in range(definition._parse_common.cache_info().maxsize + 10):
        parse_definition(f"int8 a{number}")
    before = definition._parse_common.cache_info()
    parse_definition("int8 " + "a" * definition.COMMON)
    assert definition._parse_common.cache_info() == before
    assert before.currsize == before.maxsize
