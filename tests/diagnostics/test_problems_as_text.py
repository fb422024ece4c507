"""Problems as text: carets stand under what is meant, and nothing hostile reaches a terminal."""

import json
import re
import unicodedata

import pytest

from idlc.diagnostics import codes, terminal
from idlc.diagnostics.report import Label, Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import display_width, one_line, visible
from tests.support.examples import given, st


def shown(text: str, start: int, end: int, **options) -> list[str]:
    report = Report()
    span = Span(Source("a.msg", text), start, end)
    report.add(codes.UNKNOWN_TYPE.at(span, "unknown", hint="do this", **options))
    (block,) = terminal.text(report)
    return block.splitlines()


@pytest.mark.parametrize(
    ("text", "start", "end", "line", "caret"),
    [
        ("int8 a", 5, 6, "1 | int8 a", "  |      ^"),
        ("x\nint8 ab\ny", 7, 9, "2 | int8 ab", "  |      ^^"),
        ("int8\ta", 5, 6, "1 | int8    a", "  |         ^"),
        ("\tint8 a", 1, 5, "1 |     int8 a", "  |     ^^^^"),
        ("漢字 a", 3, 4, "1 | 漢字 a", "  |      ^"),
        ("a 漢字", 2, 4, "1 | a 漢字", "  |   ^^^^"),
        ("e\u0301e\u0301 a", 5, 6, "1 | e\u0301e\u0301 a", "  |    ^"),
        ("\x1b[31m a", 6, 7, "1 | ␛[31m a", "  |       ^"),
        ("a\u202eb", 1, 2, "1 | a<U+202E>b", "  |  ^^^^^^^^"),
        ("a\ufeff\x9b", 1, 3, "1 | a<U+FEFF><U+009B>", "  |  ^^^^^^^^^^^^^^^^"),
        ("int8 a\n", 7, 7, "1 | int8 a", "  |       ^"),
        ("", 0, 0, "1 |", "  | ^"),
        ("int8 a\r\nint8 b", 5, 14, "1 | int8 a", "  |      ^"),
        ("a\x00b", 1, 2, "1 | a␀b", "  |  ^"),
    ],
)
def test_the_caret_stands_under_the_span(text, start, end, line, caret):
    block = shown(text, start, end)
    assert block[3] == line
    assert block[4] == caret
    assert block[-1] == "  = hint: do this"


def test_carets_have_the_colour_of_their_level():
    span = Span(Source("a.msg", "flot64 a"), 0, 6)
    for code, colour in ((codes.UNKNOWN_TYPE, "1;31"), (codes.WIDE_STRING, "1;33")):
        (block,) = terminal.text([code.at(span, "wrong")], colour=True)
        assert f"\x1b[{colour}m^^^^^^\x1b[0m" in block


def test_labels_in_the_same_file_and_in_another():
    source, other = (
        Source("a.msg", "".join(f"int8 f{n}\n" for n in range(12))),
        Source("b.msg", "x"),
    )
    labels = (Label(Span(source, 0, 4), "first"), Label(Span(other, 0, 1), "also"))
    report = Report()
    report.add(codes.DUPLICATE_FIELD.at(Span(source, 85, 88), "again", labels=labels))
    (block,) = terminal.text(report)
    assert block.splitlines() == [
        "error[IDL208]: again",
        "  --> a.msg:11:6",
        "   |",
        " 1 | int8 f0",
        "   | ---- first",
        "...",
        "11 | int8 f10",
        "   |      ^^^",
        "  ::: b.msg:1:1",
        "   |",
        " 1 | x",
        "   | - also",
    ]


def test_long_lines_are_cut_around_the_caret():
    text = "a" * 5000 + " here " + "b" * 5000
    block = shown(text, 5001, 5005)
    line, caret = block[3].partition("| ")[2], block[4].partition("| ")[2]
    assert len(line) <= terminal.LINE_WIDTH + 2
    assert line.startswith("…a")
    assert line.endswith("b…")
    assert line[caret.index("^") : caret.rindex("^") + 1] == "here"


def test_a_hundred_problems_are_shown_and_the_rest_counted():
    report = Report()
    source = Source("a.msg", "x" * 200)
    for number in range(150):
        report.add(codes.UNKNOWN_TYPE.at(Span(source, number, number + 1), f"number {number}"))
    *blocks, rest = terminal.text(report)
    assert len(blocks) == terminal.LIMIT
    assert "50 more" in rest
    assert terminal.summary(report) == "150 errors in 1 file"
    assert len(list(terminal.json_lines(report))) == 150


def test_colour_is_an_argument_and_changes_no_letter():
    report = Report()
    source = Source("a.msg", "flot64 a\n")
    report.add(codes.UNKNOWN_TYPE.at(Span(source, 0, 6), "unknown", hint="do"))
    plain, colourful = "".join(terminal.text(report)), "".join(terminal.text(report, colour=True))
    assert "\x1b" not in plain
    assert re.sub(r"\x1b\[[0-9;]*m", "", colourful) == plain


def test_the_summary_counts():
    report = Report()
    assert terminal.summary(report) == "no problems"
    source = Source("a.msg", "xyz")
    report.add(codes.UNKNOWN_TYPE.at(Span(source, 0, 1), "m"))
    report.add(codes.UNKNOWN_TYPE.at(Span(source, 1, 2), "m"))
    report.add(codes.FLOAT32_RANGE.at(Span(Source("b.msg", "x"), 0, 1), "m"))
    assert terminal.summary(report) == "2 errors, 1 warning in 2 files"


@given(st.text(max_size=300), st.data())
def test_any_text_is_shown_harmlessly_and_aligned(text, data):
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, len(text)))
    block = shown(text, start, end)
    assert all(unicodedata.category(c) not in ("Cc", "Cf", "Cs") for line in block for c in line)
    frame = [line for line in block if line.startswith("  | ")]
    assert any("^" in line for line in frame)


@given(st.text(max_size=50))
def test_visible_text_has_the_width_that_is_claimed(text):
    assert one_line(text).isprintable() or " " in text or "\u3000" in text or not text.isprintable()
    assert display_width(visible(text)) >= 0
    assert "\n" not in one_line(text)


def test_no_error_is_left_out_for_a_warning():
    report = Report()
    source = Source("a.msg", "x" * 300)
    for at in range(200):
        report.add(codes.UNUSUAL_LINE_END.at(Span(source, at, at + 1), "a warning"))
    report.add(codes.BAD_VALUE.at(Span(source, 250, 251), "an error"))
    first, *_, rest = terminal.text(report)
    assert "an error" in first
    assert rest.startswith("… and 101 more")


@given(st.text(), st.text())
def test_json_lines_are_lines_of_ascii(path, message):
    report = Report()
    report.add(codes.UNREADABLE.of(path, message))
    (line,) = terminal.json_lines(report)
    assert line.isascii()
    assert line.count("\n") == 1
    facts = json.loads(line)
    assert (facts["path"], facts["message"]) == (path, message)
