"""`fmt`'s layout: what it changes, what it leaves, and that the meaning stays."""

import json
import re
from random import Random

import pytest

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.format import format_file
from idlc.language.parse import parse
from idlc.model import ir
from idlc.model.ir import meaning
from idlc.model.lowering.lower import lower
from tests.support import rosidl_view
from tests.support.examples import example, given, settings, st
from tests.support.inventions import Inventor
from tests.support.paths import VERDICTS

CASES = [
    case
    for case in map(json.loads, VERDICTS.read_text("utf-8").splitlines())
    if case["build_verdict"] == "accept"
]


def formatted(text):
    return format_file(parse(Source("X.msg", text)))


def text_of(case):
    return bytes.fromhex(case["bytes_hex"]).decode() if "bytes_hex" in case else case["text"]


def content(text, kind):
    """What a file means, each word that it is made of, and the codes of its problems."""
    report = Report()
    file = parse(Source(f"X.{kind}", text))
    interface = lower(file, ir.TypeName("pkg", kind, "X"), report)
    lines = [
        ("".join(line.code.split()), line.comment.rstrip())
        for section in file.sections
        for line in section.lines
        if line.code.strip() or line.comment
    ]
    # unusual line ends become usual ones, and nothing else may go
    problems = [found.code for found in report if found.code != "IDL110"]
    return meaning(interface), lines, problems, len(file.sections), report.had_errors


def assert_only_the_layout_changes(text, kind):
    once = format_file(parse(Source(f"X.{kind}", text)))
    before, after = content(text, kind), content(once, kind)
    assert after == before
    assert format_file(parse(Source(f"X.{kind}", once))) == once
    assert not once or once.endswith("\n") or once == text


UNCHANGED = [
    "",
    "int8 a\n---",
    "int8 a  \n# remark \t\nint8 b\n\n\n",
    "int8 a\n",
    "# Head, with blanks at the end that ROS 2 keeps.  \n\n# about a\nint8 a\n",
    "\n# about a, not about the message\nint8 a\n",
    "int8 A=1\nint8 LONGER = 2\n",
    "int8 A      = 1\nint8 LONGER = 2\n",
    "int8 a # one blank is a gap\n\nint8 bcd      # a wide one too\n",
    "int8 a # one blank\nint8 bcd # in each line\n",
    "int8 a    # four blanks\nint8 bcd    # in each line\n",
    "int8    a\nuint16  b\nfloat32 c\n",
    "int8    a\n\n# apart\nuint16  b\n",
    "int8  a\nint8 longest_of_all\nint8  b\n",
    "int8 A =  1\nint8 B = 10\nint8 C = -3\n",
    "int8 A =  -1\nint8 BCD = 2\nint8 CD =  3\n",
    "int8 a\t\t# x\nint16 bcd\t# y\n",
    "int8 a\t\t\t# x\nint16 bcd\t\t# of four\n",
    "int8    AB  = 1\nuint16  C   = 2\n",
    "float32 x            # [m] east\n                     # of here\nfloat32 y_north  # [m]\n",
    "int8 a\n\t# more\n",
    "\nint8 a\n",
    "float32 x   # [m] east\n            # of here\nfloat32 yz  # [m] north\n",
    "float32 x\n    # indented, with its own place\nfloat32 y\n",
    "int8 a\n---\n\nint8 b\n\n---\nint8 c\n",
    "int8 a\r\n\r\n---\r\nint8 b\r\n",
    "string A=x  y = z\n",
    'string a "two  blanks"\n',
    "int8[] a [1,2,  3]\n",
    "string A=\n",
    "#comment\nint8 a  #comment\n",
]


@pytest.mark.parametrize("text", UNCHANGED)
def test_a_tidy_file_stays_as_it_is(text):
    assert formatted(text) == text


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("int8   a", "int8 a\n"),
        ("int8\ta\t1\t# x", "int8 a 1                # x\n"),
        ("int8 a   5  \n", "int8 a 5\n"),
        ("int8 A= 1\nint8 B =2\nint8 C  =  3\n", "int8 A = 1\nint8 B = 2\nint8 C = 3\n"),
        ("int8  A   = 1\nint16 LONG= 2\n", "int8  A = 1\nint16 LONG = 2\n"),
        ("int8 a# x\n", "int8 a  # x\n"),
        ("int8 a# x\nint8 bcd # y\n", "int8 a # x\nint8 bcd # y\n"),
        # out of the column of its neighbours, and where there is none
        (
            "int8 a    # x\nint8 b   # y\nint8 c    # z\n",
            "int8 a    # x\nint8 b    # y\nint8 c    # z\n",
        ),
        (
            "int8    a\nint16   b\nfloat32  c  # x\n",
            "int8    a\nint16   b\nfloat32 c  # x\n",
        ),
        ("int8   a\nint16 b\nint32 c\n", "int8 a\nint16 b\nint32 c\n"),
        ("int8 a   # x\nint16 b     # y\n", "int8 a  # x\nint16 b  # y\n"),
        # what was in a column stays there
        ("int8   a  # x\nint16 b   # y\n", "int8 a    # x\nint16 b   # y\n"),
        ("int8 A= 1  # x\nint8 BC =2 # y\n", "int8 A = 1  # x\nint8 BC = 2 # y\n"),
        (
            "# head \n\n# about a   \nint8 a\n\n\n\n\nint8 b\n",
            "# head \n\n# about a\nint8 a\n\n\nint8 b\n",
        ),
        ("\n\n\nint8 a\n\n\n\n\nint8 b\n\n\n", "\nint8 a\n\n\nint8 b\n"),
        ("\n\n\n# about a\nint8 a\n", "\n# about a\nint8 a\n"),
        ("int8 a\r\nint8  b\n", "int8 a\r\nint8 b\r\n"),
        ("int8 a\rint8 b\x0bint8 c", "int8 a\nint8 b\nint8 c\n"),
        ("int8 a\n\n\n\n\nint8 b\n---", "int8 a\n\n\nint8 b\n---\n"),
        ("---\r\nint8 a\r\n\r\n\r\n\r\nint8 b", "---\r\nint8 a\r\n\r\n\r\nint8 b\r\n"),
        ("   \n\t\nint8 a\n   \n", "\nint8 a\n"),
    ],
)
def test_a_loose_file_becomes_this_and_then_stays(before, after):
    assert formatted(before) == after
    assert formatted(after) == after


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case['id']}-{case['label']}")
def test_every_valid_recorded_case_keeps_its_content(case):
    text = text_of(case)
    assert_only_the_layout_changes(text, case["kind"])
    once = format_file(parse(Source("X", text)))
    assert rosidl_view.view({**case, "bytes_hex": once.encode().hex()}) == rosidl_view.view(case)


def test_invented_files_keep_their_content():
    known = {kind: [text_of(c) for c in CASES if c["kind"] == kind] for kind in ir.KINDS}
    valid = 0
    for case in Inventor(5, known).cases(3000):
        try:
            text = text_of(case)
        except UnicodeDecodeError:
            continue
        if not content(text, case["kind"])[-1]:
            valid += 1
            assert_only_the_layout_changes(text, case["kind"])
    assert valid > 1000


BLANKS = st.sampled_from([" ", "  ", "\t", " \t ", "      "])
GAP = st.sampled_from(["", " ", "  ", "\t", "\u00a0", "          "])
COMMENT = st.sampled_from(["", "", "#", "# [m] x", "#x  ", "##  y", "# a\tb"])
END = st.sampled_from(["\n", "\n", "\n", "\r\n", "\r", "\x0b", "\u2028"])


@st.composite
def laid_out_lines(draw):
    number = draw(st.integers(0, 999))
    shape = draw(st.sampled_from(["blank", "comment", "field", "default", "constant"]))
    blank, wide = draw(GAP), draw(BLANKS)
    comment = draw(COMMENT)
    match shape:
        case "blank":
            text = blank
        case "comment":
            text = blank + (comment or "#")
        case "field":
            text = f"int8[]{wide}f{number}{blank}{comment}"
        case "default":
            text = f"string<=9 {wide}f{number}{wide}'v  {number}'{blank}{comment}"
        case _:
            value = draw(st.sampled_from(["1", '" a = b"', "a  b", "''", ""]))
            text = f"string{wide}C{number}{blank}={draw(GAP)}{value}{blank}{comment}"
    return text + draw(END)


@settings(max_examples=300)
@given(st.lists(laid_out_lines(), max_size=12).map("".join), st.booleans())
@example("AB=1\n", False)
@example("int8 AB=1\nint8 A = 1\n", False)
@example("# head\x0b  # more\n", True)
@example("string A=1\nstring B=\t1\nstring C\t=1\n", False)
def test_layout_invented_by_chance_keeps_the_content(text, is_service):
    if is_service:
        text += "---\n" + text
    if not content(text, "srv" if is_service else "msg")[-1]:
        assert_only_the_layout_changes(text, "srv" if is_service else "msg")


GAPS = ["", " ", " ", "  ", "   ", "\t", " \t", "      "]


def untidy_line(random):
    """Return a line of no more words than a line has, with any gaps between them."""
    gap, blank = lambda: random.choice(GAPS), lambda: random.choice(GAPS[1:])
    name = random.choice(["a", "bc", "def_g", "long_name"])
    comment = random.choice(["", "", f"{gap()}# x"])
    match random.randrange(10):
        case 0:
            return random.choice(["", "# comment"])
        case 1:
            return f"{blank()}# more"
        case 2 | 3 | 4:
            return f"{random.choice(['int8', 'uint16[]'])}{blank()}{name}{comment}"
        case 5:
            return f"int8{blank()}{name}{blank()}{random.choice(['1', '-30'])}{comment}"
    value = random.choice(["1", "20", "-300"])
    type_ = random.choice(["int8", "float32"])
    return f"{type_}{blank()}{name.upper()}{gap()}={gap()}{value}{comment}"


def test_laying_out_twice_is_laying_out_once():
    random = Random(5)
    for _ in range(1000):
        text = "".join(f"{untidy_line(random)}\n" for _ in range(random.randint(1, 9)))
        once = formatted(text)
        assert formatted(once) == once, text
        assert "".join(once.split()) == "".join(text.split())


WORDS = st.sampled_from(["a", "speed", "x_of_the_robot", "temperature"])
TYPES = st.sampled_from(["int8", "float32", "string<=10", "std_msgs/Header", "uint8[]"])


def in_columns(rows, gap, tab):
    """Return rows of words as text in which the words of each column begin in one column."""
    lines = [""] * len(rows)
    for column in zip(*rows, strict=True):
        if lines[0]:
            width = max(len(line.expandtabs(tab)) for line in lines) + gap
            width += -width % tab
            lines = [filled(line, width, tab) for line in lines]
        lines = [line + word for line, word in zip(lines, column, strict=True)]
    return lines


def filled(line, width, tab):
    missing = width - len(line.expandtabs(tab))
    return line + ("\t" * -(-missing // tab) if tab > 1 else " " * missing)


@st.composite
def aligned_blocks(draw, tabs=(1, 1, 4, 8), least=2):
    """Draw a block of fields or constants with comments, all of it in columns."""
    tab, count = draw(st.sampled_from(tabs)), draw(st.integers(least, 6))
    constants = draw(st.booleans())
    rows = []
    for number in range(count):
        name = f"{draw(WORDS)}_{number}"
        if constants:
            row = ["int32", name.upper(), "=", str(draw(st.integers(-99, 999)))]
        else:
            row = [draw(TYPES), name]
        rows.append([*row, "# [m] why"])
    lines = in_columns(rows, draw(st.integers(1, 4)), tab)
    continued = draw(st.integers(0, count - 1))
    column = lines[continued].index("#")
    indent = re.sub("[^\\t]", " ", lines[continued][:column])
    if len(indent.expandtabs(tab)) == len(lines[continued][:column].expandtabs(tab)):
        lines.insert(continued + 1, f"{indent}# and because")
    return lines


@given(aligned_blocks())
def test_what_stands_in_columns_is_not_touched(lines):
    text = "".join(f"{line}\n" for line in lines)
    assert formatted(text) == text


@given(aligned_blocks(tabs=[1], least=3), st.data())
def test_a_comment_out_of_its_column_goes_back_to_it(lines, data):
    alone = [at for at in range(len(lines)) if "and because" not in "".join(lines[at : at + 2])]
    at = data.draw(st.sampled_from(alone))

    def moved(more):
        return "\n".join([*lines[:at], lines[at].replace("#", " " * more + "#"), *lines[at + 1 :]])

    more = data.draw(st.integers(2, 5))
    text = moved(more)
    if len(set(re.findall(r"\S( +)#", text))) == 1:
        text = moved(more + 1)  # gaps that are all the same are in order
    assert formatted(text) == "".join(f"{line}\n" for line in lines)


@given(st.text("a1 =#\t\n\r\x0b[]<-\"'A", max_size=40))
def test_any_text_can_be_laid_out(text):
    once = formatted(text)
    assert formatted(once) == once
    assert "".join(once.split()) == "".join(text.split())
