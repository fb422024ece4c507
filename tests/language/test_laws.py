"""Laws of the front end, on text that nobody wrote."""

import math

import pytest

from idlc.compiler import verdicts
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.parse import parse
from idlc.model import catalog, ir
from idlc.model.link import link
from idlc.model.lowering.lower import lower
from idlc.model.lowering.lower_types import Fault
from idlc.model.lowering.lower_values import scalar
from tests.support.examples import example, given, st

WORDS = [
    "int32",
    "string<=3",
    "Pose[]",
    "a",
    "B",
    "=",
    "[",
    "]",
    "<=",
    "---",
    "#",
    '"',
    "'",
    "\\",
    " ",
    "\t",
    "1",
    ",",
]
LINE_ENDS = ["\n", "\r\n", "\r", "\x0b", "\x85", "\u2028"]
TEXT = st.lists(st.sampled_from(WORDS + LINE_ENDS) | st.text(max_size=3), max_size=30).map("".join)


@given(TEXT, st.sampled_from(["msg", "srv", "action"]))
@example("", "action")
@example("---\n---\n---\n---\n---", "msg")
def test_any_text_is_read_without_loss_and_judged_without_a_crash(text, kind):
    source = Source("X." + kind, text)
    file = parse(source)
    lines = [line for section in file.sections for line in section.lines]
    again = {line.start: line.code + line.comment + line.newline for line in lines}
    for start, piece in again.items():
        assert (text + "\n")[start : start + len(piece)] == piece
    covered = sum(map(len, again.values())) + 3 * len(file.separators)
    ends = sum(len(line) - len(line.rstrip("\r\n\x0b\x85\u2028")) for line in source.lines)
    assert covered <= len(text) + 1
    assert covered >= len(text) - ends

    report = Report()
    interface = lower(file, ir.TypeName("pkg", kind, "X"), report)
    verdicts.check(link("pkg", [interface], catalog, report), report)
    for problem in report:
        if problem.span is not None and problem.span.source is source:
            assert 0 <= problem.span.start <= problem.span.end <= len(text)
            line, column = source.position(problem.span.start)
            assert line >= 1
            assert column >= 1


def python_int(text):
    for base in (10, 0):
        try:
            return int(text, base)
        except ValueError:
            pass
    return None


@given(
    st.from_regex(r"[+-]?(0[xXoObB])?[0-9a-fA-F_]{1,8}", fullmatch=True)
    | st.text("0123456789_+-xXoObB٣eE.", max_size=8)
)
@example("0_0")
@example("0x_1f")
@example("00")
@example("٣")
def test_integers_are_what_python_reads(text):
    text = text.strip()
    expected = python_int(text)
    found = scalar(ir.Primitive("int64"), text)
    if expected is None or not -(2**63) <= expected < 2**63:
        assert isinstance(found, Fault)
    else:
        assert found == expected


@given(st.text("0123456789._+-eEinfatyNINF٣", max_size=10))
@example("1_0.5")
@example(".5")
@example("5.")
@example("1e1_0")
@example("-Infinity")
def test_floats_are_what_python_reads(text):
    text = text.strip()
    try:
        expected = float(text)
    except ValueError:
        expected = None
    found = scalar(ir.Primitive("float64"), text)
    if expected is None:
        assert isinstance(found, Fault)
    else:
        assert found == expected or (math.isnan(expected) and math.isnan(found))


def problems(kind="msg", package="demo", **texts):
    report = Report()
    own = [
        lower(parse(Source(f"{name}.{kind}", text)), ir.TypeName(package, kind, name), report)
        for name, text in texts.items()
    ]
    verdicts.check(link(package, own, catalog, report), report)
    return [(p.code, p.span.source.position(p.span.start) if p.span else None) for p in report]


def test_one_bad_line_does_not_hide_the_next():
    text = "flot32 a\nint8 b 300\n  int8 c\nint8[0] d\nint8\nint8 b\nstd_msgs/Heder h\n"
    assert problems(A=text) == [
        ("IDL201", (1, 1)),
        ("IDL305", (2, 8)),
        ("IDL102", (3, 1)),
        ("IDL301", (4, 6)),
        ("IDL101", (5, 1)),
        ("IDL208", (6, 6)),
        ("IDL201", (7, 10)),
    ]


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        ({"A": "B b\n", "B": "A a\n"}, [("IDL210", (1, 1))]),
        ({"A": "B b\n", "B": "C[] c\n", "C": "A[<=2] a\n"}, [("IDL210", (1, 1))]),
        ({"A": "B b\nB c\n", "B": "int8 x\n"}, []),
        ({"A": "Missing[] m\nMissing n\n"}, [("IDL201", (1, 1)), ("IDL201", (2, 1))]),
    ],
)
def test_a_circle_or_a_missing_type_is_reported_where_it_is_named(texts, expected):
    assert problems(**texts) == expected


def test_a_chain_of_a_thousand_messages_has_no_problem():
    texts = {f"M{i}": f"M{i + 1} next\n" for i in range(1000)}
    assert problems(**texts, M1000="int8 end\n") == []


def test_an_unqualified_name_of_another_package_is_suggested():
    report = Report()
    source = Source("A.msg", "Header header\n")
    link("demo", [lower(parse(source), ir.TypeName("demo", "msg", "A"), report)], catalog, report)
    assert [p.hint for p in report] == ["did you mean `std_msgs/Header`?"]
