"""The patterns that stand in for lark on ordinary lines say what lark says."""

import json
import re
import subprocess
import sys

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from idlc.language import lalr, parse
from idlc.language.grammar import LINE_ENDS, grammar, terminals
from tests.support.paths import VERDICTS

TEXTS = [
    case["text"]
    for case in map(json.loads, VERDICTS.read_text("utf-8").splitlines())
    if "text" in case
]
PIECES = ["int8", "a", "B", " ", "  ", "=", "<=", "[", "]", "3", "/", "x y", '"', ",", "-", "\t"]


def whole(text):
    return text if text and text[-1] in LINE_ENDS else text + "\n"


def assert_same(text):
    text = whole(text)
    found = parse.quick_lines(text)
    assert found in (None, lalr.lines(text))
    for line in text.splitlines():
        code = line.partition("#")[0].replace("\t", " ").rstrip()
        if code:
            assert parse.quick_definition(code) in (None, lalr.definition(code)), code


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
def test_any_text_is_read_as_lark_reads_it_or_left_to_it(text):
    assert_same(text)


def test_nearly_all_lines_are_ordinary():
    lines = [line for text in TEXTS for line in text.split("\n") if line[:1].isalpha()]
    codes = [code for line in lines if (code := line.partition("#")[0].rstrip())]
    ordinary = sum(parse.quick_definition(code) is not None for code in codes)
    assert ordinary > 0.8 * len(codes)


def test_terminals_are_those_that_lark_reads():
    read = {one.name: one.pattern.to_regexp() for one in lalr._lark().terminals}
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
