"""The .idl files that ROS 2 makes of interface files mean what those mean; no other IDL is read."""

import sys
from pathlib import Path
from time import process_time

import pytest

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.parse import parse, parse_any
from idlc.model import catalog, ir
from idlc.model.distros import DISTROS
from idlc.model.idl_text import idl
from idlc.model.lowering.lower import lower
from tests.support import idl_view
from tests.support.examples import given, st

SHARE = Path(sys.prefix) / "share"
INSTALLED = sorted(SHARE.glob("*/*/*.idl"))
NAME = ir.TypeName("demo", "msg", "Example")
HEAD = "module demo {\n  module msg {\n"
TAIL = "  };\n};\n"


@pytest.mark.ros
def test_every_installed_interface_means_the_same():
    assert len(INSTALLED) > 150
    for path in INSTALLED:
        package, kind, _ = path.parts[-3:]
        name = ir.TypeName(package, kind, path.stem)
        texts = [one.read_text(encoding="utf-8") for one in (path, path.with_suffix(f".{kind}"))]
        assert idl_view.read(texts[0], name) == idl_view.read(texts[1], name), path


@pytest.mark.parametrize("distro", DISTROS, ids=lambda distro: distro.name)
def test_what_idlc_itself_writes_is_read_back(distro):
    for name in catalog.interfaces(distro):
        text = catalog.source(name, distro).text
        made = idl(lower(parse(Source("", text)), name, Report(), distro))
        assert idl_view.read(made, name) == idl_view.read(text, name), name


def read(inside):
    """Return the interface in a module and what is wrong with it, as code and guilty text."""
    report = Report()
    source = Source("demo.idl", HEAD + inside + TAIL)
    found = lower(parse_any(source), NAME, report)
    return found, [(one.code, one.span.text) for one in report]


@pytest.mark.parametrize(
    ("inside", "guilty"),
    [
        ("enum Colour { RED = 1 };", "="),
        ("enum Colour { };", "}"),
        ("union U switch (long) { case 1: long a; };", "union"),
        ("struct Example { unsigned a; };", "unsigned"),
        ("struct Example { long double a; };", "a"),
        ("struct Example { int32 a, b; };", ","),
        ("struct Example { int32 a[3][3]; };", "["),
        ("typedef int32 a__2[2]; struct Example { a__2 a[3]; };", "a"),
        ("struct Example { @default(value=1 + 2) int32 a; };", "+"),
        ("struct Example { sequence<sequence<int32> > a; };", "int32"),
        ("struct Example { map<string, int32> a; };", "string"),
        ("struct Example { other::Thing a; };", "other::Thing"),
        ("struct Example { Thing a; };", "Thing"),
        ("struct Example : Base { int32 a; };", ":"),
        ("struct Example { int32 a; }; struct Other { int32 a; };", "Other"),
        ("struct Example { int32 a; }; struct Example { int32 a; };", "Example"),
        ("struct Other { int32 a; };", "Other"),
        ("typedef int32 a__2[2]; typedef a__2 b__2[2]; struct Example { b__2 c; };", "b__2"),
        ("typedef int32 a__2[2]; struct Example { sequence<a__2> c; };", "int32"),
        ("typedef a b; typedef b a; struct Example { a c; };", "a"),
        ("const int32 A = 1; struct Example { int32 a; };", "const"),
        ("struct Example { int32 a; }", "}"),
        ("struct Example { int32 a;", ""),
        ("#define A 1\nstruct Example { int32 a; };", "#"),
    ],
)
def test_other_idl_is_refused_at_its_first_place(inside, guilty):
    _, problems = read(inside)
    assert problems[0][0] == "IDL114"
    assert problems[0][1] == guilty


@pytest.mark.parametrize(
    ("inside", "expected"),
    [
        ("struct Example { string<0> a; };", ("IDL301", "0")),
        ("typedef int32 a__0[0]; struct Example { a__0 a; };", ("IDL301", "0")),
        ("struct Example { sequence<int32, 0> a; };", ("IDL301", "0")),
        ("struct Example { int32 _a; };", ("IDL203", "_a")),
        ("struct Example { int32 class_; };", ("IDL203", "class_")),
        ("module Example_Constants { const int32 _a = 1; }; struct Example { int8 a; };", None),
        ("struct Example { @default (value=300) uint8 a; };", ("IDL305", "300")),
        ("struct Example { @default (value=x) uint8 a; };", ("IDL304", "x")),
        ('struct Example { @default (value="1") uint8 a; };', ("IDL304", '"1"')),
        ('struct Example { @default (value="(1, 2)") sequence<bool> a; };', ("IDL114", "bool")),
        ('struct Example { @default (value="(1, 2)") sequence<boolean> a; };', ("IDL304", None)),
        ('struct Example { @default (value="(1, 2") sequence<int8> a; };', ("IDL304", None)),
        (
            'struct Example { @default (value="(1, 2)") sequence<int8, 1> a; };',
            ("IDL309", '"(1, 2)"'),
        ),
        ('struct Example { @default (value="a" "b") string<1> a; };', ("IDL304", '"a" "b"')),
        ('struct Example { @default (value="x") b_msgs::msg::A a; };', ("IDL114", '"x"')),
        ('struct Example { @default (value="f()") sequence<int8> a; };', ("IDL304", None)),
        ('struct Example { @default (value="abc") string<2> a; };', ("IDL304", None)),
        ("struct Example { @default (value=1) other_msgs::msg::A a; };", ("IDL114", "1")),
    ],
)
def test_wrong_values_and_names_have_their_own_codes(inside, expected):
    _, problems = read(inside)
    code, text = expected or ("IDL204", "_a")
    assert problems[0][0] == code
    assert text is None or problems[0][1] == text


@pytest.mark.parametrize(
    ("inside", "field"),
    [
        ("enum Colour { RED, GREEN }; struct Example { Colour a; };", "uint32 a"),
        ("enum Colour { RED, }; struct Example { demo::msg::Colour a; };", "uint32 a"),
        ("struct Example { Of a; }; typedef Colour Of; enum Colour { RED };", "uint32 a"),
        ("struct Example { sequence<Colour, 2> a; }; enum Colour { RED };", "uint32[<=2] a"),
        ("@mutable struct Example { long a; };", "int32 a"),
        ("struct Example { unsigned  long\nlong longs; };", "uint64 longs"),
        ("struct Example { short unsigned_; };", "int16 unsigned_"),
        ("struct Example { double a[3]; };", "float64[3] a"),
        ("struct Example { @key @range(min=1, max=2) int32 camelCase; };", "int32 camelCase"),
    ],
)
def test_idl_that_people_write_for_ros_2_is_read(inside, field):
    message, problems = read(inside)
    assert not problems
    assert [f"{ir.spell(own.type)} {own.name}" for own in message.fields] == [field]


def test_the_text_must_define_what_it_is_said_to():
    report = Report()
    text = HEAD.replace("demo", "other") + "struct Example { int32 a; };" + TAIL
    lower(parse_any(Source("x.idl", text)), NAME, report)
    assert [(one.code, one.span.text) for one in report] == [("IDL114", "other")]


def test_a_module_of_another_package_is_not_reported_as_missing_as_well():
    report = Report()
    text = "module other { module srv { struct A_Request { int32 a; }; }; };"
    lower(parse_any(Source("x.idl", text)), ir.TypeName("demo", "srv", "A"), report)
    assert [(problem.code, problem.span.text) for problem in report] == [("IDL114", "other")]


def test_a_name_of_a_type_may_be_defined_after_its_uses():
    found, problems = read("struct Example { a__2 b; }; typedef int32 a__2[2];")
    assert problems == []
    assert found.fields[0].type == ir.Array(ir.Primitive("int32"), 2)


def test_definitions_of_one_name_agree():
    same, other = "typedef int32 a__2[2]; ", "typedef string a__2[2]; "
    structure = "struct Example { a__2 b; };"
    assert read(same + same + structure)[1] == []
    assert read(same + other + structure)[1] == [("IDL114", "a__2")]


def test_a_missing_part_is_reported_with_wrong_types_of_another_one():
    report = Report()
    text = "module demo { module srv { struct A_Request { Thing a; }; }; };"
    lower(parse_any(Source("x.idl", text)), ir.TypeName("demo", "srv", "A"), report)
    messages = [problem.message for problem in report]
    assert any("the type `Thing`" in message for message in messages)
    assert any("a module without `A_Response`" in message for message in messages)


def test_an_escaped_line_end_is_no_end_of_a_comment_line():
    literals = '"one \\n two" "\\n" "three"'
    comment = f'@verbatim (language="comment", text={literals})'
    found, problems = read(f"{comment} struct Example {{ int8 a; }};")
    assert problems == []
    assert found.comment == ("one \n two", "three")


@pytest.mark.long
def test_many_modules_of_constants_take_less_time_than_their_syntax():
    modules = "module Example_Constants { const int8 A = 1; };\n" * 40_000
    start = process_time()
    file = parse_any(Source("x.idl", HEAD + modules + "struct Example { int8 a; };" + TAIL))
    parsed = process_time()
    assert len(lower(file, NAME, Report()).constants) == 40_000
    assert process_time() - parsed < parsed - start


def test_words_of_idl_may_be_names():
    words = ["module", "struct", "sequence", "string", "const", "typedef", "boolean", "int32"]
    found, problems = read(
        "struct Example {" + "".join(f"int32 {word};\n" for word in words) + "};"
    )
    assert problems == []
    assert [field.name for field in found.fields] == words


def test_nothing_in_it_takes_for_ever_or_all_memory():
    for text in (
        "struct Example {" + "sequence<" * 100_000,
        "@a " * 100_000,
        "/*" * 100_000,
        '"\\' * 100_000,
        'struct Example { @default (value="' + "(" * 100_000 + '") sequence<int8> a; };',
        "struct Example { @default (value=" + "9" * 100_000 + ") int8 a; };",
        "typedef int8 a[" + "9" * 100_000 + "]; struct Example { a b; };",
    ):
        assert read(text)[1]


PIECES = (
    'module struct typedef const sequence string int32 Example a A { } < > ( ) [ ] ; , = :: @ "" '
    '"\\n" "x" 1 -1.5e3 TRUE @default @verbatim value text // /* */ #include demo::msg::B'
).split()


@given(st.lists(st.sampled_from(PIECES) | st.text(max_size=3), max_size=30).map(" ".join))
def test_any_text_ends_in_a_meaning_or_a_problem(inside):
    for text in (inside, HEAD + inside + TAIL, f"{HEAD}struct Example {{ {inside} }};{TAIL}"):
        report = Report()
        source = Source("x.idl", text)
        found = lower(parse_any(source), NAME, report)
        assert isinstance(found, ir.Message)
        for one in report:
            assert one.span is None or 0 <= one.span.start <= one.span.end <= len(text)
