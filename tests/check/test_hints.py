"""Hints lead on: what a hint says to write is right, whatever language its reader thinks of."""

import ast
import re

import pytest

from idlc.compiler import verdicts
from idlc.diagnostics.report import Report, Severity
from idlc.diagnostics.source import Source
from idlc.diagnostics.text import closest, package_hint
from idlc.language.parse import parse
from idlc.model import catalog, ir
from idlc.model.link import link
from idlc.model.lowering.lower import lower
from tests.support.paths import ROOT


def errors(text, kind="msg"):
    report = Report()
    files = {"A": (kind, text), "Other": ("msg", "int8 a\n"), "Do": ("srv", "---\n")}
    files["plantStatus"] = ("msg", "int8 a\n")
    own = [
        lower(parse(Source(f"{name}.{one}", text)), ir.TypeName("pkg", one, name), report)
        for name, (one, text) in files.items()
    ]
    verdicts.check(link("pkg", own, catalog, report), report)
    return [
        one
        for one in report
        if one.severity is Severity.ERROR and one.span and one.span.source.path == f"A.{kind}"
    ]


def followed(line, found):
    """Return what a line becomes when its reader does what the hint says."""
    quoted = re.findall("`([^`]+)`", found.hint.partition(";")[0])
    lines = [text for text in quoted if " " in text]
    if lines:
        return "\n".join(lines) + "\n"
    return line[: found.span.start] + quoted[0] + line[found.span.end :] + "\n"


#: Lines of one mistake whose hint is a replacement, and what it must be.
REPLACED = {
    "double a": "float64 a",
    "Double a": "float64 a",
    "float a": "float32 a",
    "Float a": "float32 a",
    "long a": "int64 a",
    "int a": "int32 a",
    "Int a": "int32 a",
    "Integer a": "int32 a",
    "short a": "int16 a",
    "unsigned a": "uint32 a",
    "unsigned int a": "uint32 a",
    "unsigned char a": "uint8 a",
    "long long int a": "int64 a",
    "signed long a": "int64 a",
    "long double a 5": "float64 a 5",
    "int16_t a": "int16 a",
    "std::uint8_t a": "uint8 a",
    "size_t a": "uint64 a",
    "u8 a": "uint8 a",
    "i64[] a": "int64[] a",
    "f32[3] a": "float32[3] a",
    "boolean a": "bool a",
    "Bool a": "bool a",
    "str a": "string a",
    "String a": "string a",
    "std::string a": "string a",
    "bytes a": "uint8[] a",
    "Float32 a": "float32 a",
    "UInt8 a": "uint8 a",
    "timestamp a": "builtin_interfaces/Time a",
    "flot32 a": "float32 a",
    "flot a": "float32 a",
    "doubel a": "float64 a",
    "std_msgs/Header.msg a": "std_msgs/Header a",
    "std_msgs/msg/Header.msg a": "std_msgs/Header a",
    "std_msgs.msg.String a": "std_msgs/String a",
    "std_msgs::msg::String a": "std_msgs/String a",
    "Other.msg a": "Other a",
    "Header a": "std_msgs/Header a",
    "Othr a": "Other a",
    "std_msg/Header a": "std_msgs/Header a",
    "sensr_msgs/Imu a": "sensor_msgs/Imu a",
    "std_msgs/msg/Header a": "std_msgs/Header a",
    "std_msgs.msg.Header a": "std_msgs/Header a",
    "std_msgs::msg::Header a": "std_msgs/Header a",
    "float32 humidity = 0.5": "float32 humidity 0.5",
    "string name='x y'": "string name 'x y'",
    "int32[] a = [1, 2]": "int32[] a [1, 2]",
    "float32 x, y": "float32 x\nfloat32 y",
    "float32 x,y, z": "float32 x\nfloat32 y\nfloat32 z",
    "float64 a[3]": "float64[3] a",
    "float64 a[]": "float64[] a",
    "const int32 MAX=5": "int32 MAX=5",
    "optional string a": "string a",
    "speed: float32": "float32 speed",
    "int32 =5": "int32 NAME=5",
    "int8 maxSpeed": "int8 max_speed",
    "time a": "builtin_interfaces/Time a",
}


@pytest.mark.parametrize(("line", "right"), REPLACED.items())
def test_what_a_hint_says_to_write_is_right(line, right):
    found = errors(line + "\n")
    assert len(found) == 1, found
    assert followed(line, found[0]) == right + "\n"
    assert not errors(right + "\n")


@pytest.mark.parametrize("name", [*ir.PRIMITIVES, "string", "wstring", "float", "double"])
def test_a_letter_left_out_doubled_or_swapped_leads_to_a_basic_type(name):
    for at in range(1, len(name)):
        for typo in (
            name[:at] + name[at + 1 :],
            name[:at] + name[at] + name[at:],
            name[: at - 1] + name[at] + name[at - 1] + name[at + 1 :],
        ):
            if typo == name or not typo[0].isalpha():
                continue
            for found in errors(f"{typo} a\n"):
                assert found.hint, typo
                assert not found.hint.startswith("write `"), (typo, found.hint)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("// a comment", "a comment begins with `#`"),
        ("//comment", "a comment begins with `#`"),
        ("/* a", "a comment begins with `#`"),
        ("float32 a // metres", "a comment begins with `#`"),
        ("float32 a 5 // metres", "a comment begins with `#`"),
        ("int32 A=5 // five", "a comment begins with `#`"),
        ("list a", "`TYPE[]`"),
        ("list[int] a", "`TYPE[]`"),
        ("vector<float> a", "`TYPE[]`"),
        ("std::vector<float> a", "`TYPE[]`"),
        ("dict a", "no maps"),
        ("Cfg_Block a", "write `CfgBlock`"),
        ("enum a", "no enums"),
        ("any a", "a field has exactly one type"),
        ("Do a", "`Do` is a service"),
        ("std_srvs/SetBool a", "`SetBool` is a service"),
        ("std_srvs/srv/SetBool a", "only messages"),
        ("PlantStatus a", "rename `plantStatus.msg`"),
        ("----", "`# ----`"),
        ("float32", "write `TYPE name`"),
        ("sensor_msgs/Lidar a", "the built-in `sensor_msgs` of ROS 2 Jazzy"),
        ("nav2_msgs/Path a", "`nav2_msgs` is not built in; add `include=['DIR']`"),
    ],
)
def test_one_error_with_advice(text, hint):
    found = errors(text + "\n")
    assert len(found) == 1, found
    assert hint in found[0].hint


@pytest.mark.parametrize("kind", ["srv", "action"])
def test_dashes_in_a_service_are_a_separator(kind):
    (found,) = errors("int8 a\n----\nint8 b\n", kind)[:1]
    assert "exactly three dashes" in found.hint


def test_a_word_for_what_is_missing():
    assert [found.message for found in errors("---\n", "msg")] == ["a .msg file has no `---` line"]
    (found,) = errors("int8 a\n", "srv")
    assert found.message == "a .srv file has one `---` line; this file has none"
    assert [found.message for found in errors("int32 A=\n")] == ["the value is missing"]


@pytest.mark.parametrize(
    "name",
    ["udp_msgs", "nav2_msgs", "geographic_msgs", "bosdyn_api_msgs", "gps_msgs", "my_msgs", "ab"],
)
def test_other_packages_are_not_misspelt_ones(name):
    known = [*catalog.packages(), "dwb_msgs", "rosapi_msgs"]
    assert package_hint(name, known).startswith(f"`{name}` is not built in")


@pytest.mark.parametrize("package", catalog.packages())
def test_a_letter_too_few_is_noticed(package):
    stem = package.rpartition("_")[0]
    for at in range(len(stem)):
        wrong = package[:at] + package[at + 1 :]
        if len(stem) > 3 and wrong not in catalog.packages() and not package[at].isdigit():
            assert package_hint(wrong, catalog.packages()) == f"did you mean `{package}`?"


def test_short_names_are_near_only_by_one_letter():
    assert closest("abc", ["abd", "xyz"]) == "abd"
    assert closest("abc", ["axy"]) is None
    assert closest("temperature", ["tempreture", "humidity"]) == "tempreture"


#: The rooms that a program in Python and commands both use.
BOTH = ("api", "recordings", "versions", "robot", "model", "wire", "language")
OPTION = re.compile(r"(?<![\w-])--[a-z]|`-I\b")
ARGUMENT = re.compile(r"\b(as_|include|distro|index|fields|check|strict|rules|listen)=")
#: Whole commands are right for both, and those of others are not hints.
COMMAND = re.compile(r"`(idlc|git|pip|rosbags-convert) [^`]*`")
#: Words for git, for `--ros-args` and for `idlc upgrade` alone.
OWN = {
    "versions/revision.py",
    "robot/nodes/arguments.py",
    "robot/nodes/node.py",
    "robot/__main__.py",
}


def worded_for_one(module):
    """Yield the texts of a module that name an option or an argument, and for whom they are."""
    tree = ast.parse(module)
    readers = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):  # a docstring
            readers[id(node.value)] = "nobody"
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "worded":
            for argument, reader in zip(node.args, ("command", "python"), strict=True):
                readers |= dict.fromkeys(map(id, ast.walk(argument)), reader)
    for node in ast.walk(tree):
        parts = node.values if isinstance(node, ast.JoinedStr) else [node]
        text = "".join(getattr(part, "value", "") for part in parts
                       if isinstance(getattr(part, "value", ""), str))  # fmt: skip
        text = COMMAND.sub("", text) if isinstance(node, ast.JoinedStr | ast.Constant) else ""
        if isinstance(node, ast.JoinedStr):
            readers |= dict.fromkeys(map(id, node.values), "nobody")
        for pattern, reader in ((OPTION, "command"), (ARGUMENT, "python")):
            if pattern.search(text) and readers.get(id(node)) not in ("nobody", reader):
                yield text


def test_words_for_the_command_line_and_for_python_do_not_mix():
    found = {}
    for room in BOTH:
        for path in ROOT.joinpath("idlc", room).rglob("*.py"):
            name = path.relative_to(ROOT / "idlc").as_posix()
            texts = [*worded_for_one(path.read_text(encoding="utf-8"))]
            if texts and name not in OWN:
                found[name] = texts
    assert found == {"recordings/types.py": ["the type of `--from`"]}


@pytest.mark.parametrize("text", ["hint = 'add --distro'", "hint = f'add `-I {x}`'",
                                  "worded('as_=x', '')", "worded('', '--type')"])  # fmt: skip
def test_mixed_words_are_found(text):
    assert [*worded_for_one(text)]
    assert not [*worded_for_one("worded('--type `-I {x}`', 'as_=x') + '`idlc check --strict`'")]
