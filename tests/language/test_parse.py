"""Files are read as lark reads them by the grammar."""

import json
import re
import subprocess
import sys

import pytest
from lark import Lark, Transformer, v_args
from lark.exceptions import UnexpectedInput

from idlc.diagnostics import codes
from idlc.diagnostics.source import Source
from idlc.language import tree
from idlc.language.parse import LINE_ENDS, grammar, parse, parse_definition, terminals
from tests.support.examples import example, given, settings, st
from tests.support.paths import VERDICTS

TEXTS = [
    case["text"]
    for case in map(json.loads, VERDICTS.read_text("utf-8").splitlines())
    if "text" in case
]
PIECES = ["int8", "a", "B", " ", "  ", "=", "<=", "[", "]", "3", "/", "x y", '"', ",", "-", "\t"]


def piece(token):
    return tree.Piece(str(token), token.start_pos)


@v_args(inline=True)
class Builder(Transformer):
    """Builds what is read; the method names are the grammar's rules."""

    def line(self, *tokens):
        return tree.Line(tokens[0].start_pos, **{token.type.lower(): token for token in tokens})

    def separator(self, token):
        return token.start_pos

    def section(self, *lines):
        return lines

    def file(self, *parts):
        return parts[::2], parts[1::2]

    def string_bound(self, _, size):
        return {"bound": piece(size)}

    def array(self, *tokens):
        return {"at_most": len(tokens) == 2, "size": piece(tokens[-1]) if tokens else None}

    def type(self, name, *parts):
        known = {"name": piece(name)}
        for part in parts:
            known |= part
        return known

    def field(self, name, default=None):
        return piece(name), None if default is None else piece(default)

    def constant(self, *tokens):
        return {token.type: str(token) for token in tokens}

    def definition(self, type_, body):
        return type_, body


LARK = Lark(
    grammar(),
    parser="lalr",
    start=["file", "definition", "literal"],
    transformer=Builder(),
    maybe_placeholders=False,
)


def assert_same_definition(text):
    """Compare a definition with lark's, which does not know where brackets are."""
    body = parse_definition(text)
    try:
        type_, expected = LARK.parse(text, start="definition")
    except UnexpectedInput as error:
        end = error.pos_in_stream
        type_ = None
    if isinstance(body, tree.Fault):
        assert type_ is None or text[0].isspace(), text
        if body.code is codes.MALFORMED_TYPE:
            assert body.start == min(end, body.end - 1)
        return
    assert {name: getattr(body.type, name) for name in type_} == type_, text
    assert "bound" in type_ or body.type.bound is None
    assert ("size" in type_) == (body.type.brackets is not None)
    if isinstance(body, tree.Field):
        assert (body.name, body.default) == expected
    else:
        assert body.name.text == expected.get("CONSTANT_NAME", "").rstrip()
        assert body.value.text == expected.get("VALUE", "").lstrip()
    parts = [body.type.name, body.type.bound, body.type.brackets, body.type.size, body.name]
    parts += [body.type.whole, body.default if isinstance(body, tree.Field) else body.value]
    for part in filter(None, parts):
        assert text[part.start : part.end] == part.text


def assert_same(text):
    file = parse(Source("A.msg", text))
    sections, separators = LARK.parse(
        text if text[-1:] in tuple(LINE_ENDS) else f"{text}\n", "file"
    )
    assert tuple(section.lines for section in file.sections) == sections
    assert file.separators == separators
    for lines in sections:
        for line in filter(None, (line.definition for line in lines)):
            assert_same_definition(line)


def test_every_recorded_case_is_read_as_lark_reads_it():
    for text in TEXTS:
        assert_same(text)


@settings(max_examples=400)
@given(st.lists(st.sampled_from([*PIECES, "\n", "#", "---\n"]) | st.text(max_size=2)).map("".join))
@example("int8  =5")
@example("int8[<=3] a 1")
@example("string<=3<=4 a")
@example("int8[<=] a")
@example("---\n---")
@example("")
def test_any_text_is_read_as_lark_reads_it(text):
    assert_same(text)


def test_terminals_are_those_that_lark_reads():
    read = {one.name: one.pattern.to_regexp() for one in LARK.terminals}
    # lark spells control characters out
    plain = {name for name in read if re.search(rf"(?m)^{name}(\.\d)?: /[^\n]*$", grammar())}
    plain -= {"CODE", "COMMENT", "NEWLINE", "SEPARATOR"}
    assert len(plain) > 10
    assert {name: terminals()[name] for name in plain} == {name: read[name] for name in plain}


@pytest.mark.parametrize(("line", "needs_lark"), [("int8 a 5  # x", False), ("int8[][] a", True)])
def test_ordinary_files_do_without_lark(line, needs_lark, tmp_path):
    (tmp_path / "demo/msg").mkdir(parents=True)
    (tmp_path / "demo/msg/A.msg").write_text(f"{line}\n")
    code = (
        "import sys\nfrom idlc.cli.main import main\n"
        "main(['check', 'demo'])\nprint('lark' in sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == str(needs_lark)
