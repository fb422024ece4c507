"""`idlc check`: what is shown, in which format, and what is fixed."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import msgspec
import pytest

from idlc.cli.main import main
from idlc.cli.options import REPORT_FORMATS
from tests.support.files import write_all
from tests.support.sarif_schema import path_of, run_of

#: Ten mistakes of ten kinds in five files.
MISTAKES = {
    "package.xml": '<package format="3">\n  <name>demo</name>\n</package>\n',
    "msg/One.msg": "flot64 a\nint8 b 300\n  int8 c\n",
    "msg/Two.msg": "wstring name\nfloat64 angle  # [deg]\n",
    "msg/ThreeStamped.msg": "geometry_msgs/Pose pose\n",
    "srv/Four.srv": "int32 a\nint32 a\n",
    "action/Five.action": "bool lambda\n---\n---\n",
}
EXPECTED = [
    ("action/Five.action", 1, "IDL220"),
    ("msg/One.msg", 1, "IDL201"),
    ("msg/One.msg", 2, "IDL305"),
    ("msg/One.msg", 3, "IDL102"),
    ("msg/ThreeStamped.msg", 1, "IDL401"),
    ("msg/ThreeStamped.msg", 1, "IDL451"),
    ("msg/Two.msg", 1, "IDL421"),
    ("msg/Two.msg", 2, "IDL405"),
    ("srv/Four.srv", 2, "IDL208"),
    ("srv/Four.srv", 2, "IDL104"),
]


pytestmark = pytest.mark.usefixtures("here")


def check(capsys, *words):
    status = main(["check", *words])
    return status, capsys.readouterr().out


def codes(capsys, *words):
    _, out = check(capsys, *words, "--format", "json")
    return [line["code"] for line in map(json.loads, out.splitlines()) if "code" in line]


def from_text(out):
    found = re.findall(r"\[(IDL\d+)\].*\n +--> ([^:\n]+):(\d+)", out)
    return [(path, int(line), code) for code, path, line in found]


def from_json(out):
    found = [line for line in map(json.loads, out.splitlines()) if line["type"] == "diagnostic"]
    return [(one["path"], one["line"], one["code"]) for one in found]


def from_github(out):
    pattern = r"::(?:error|warning) file=([^,]+),line=(\d+),.*title=(IDL\d+) [^:]*::.+"
    found = [re.fullmatch(pattern, line) for line in out.splitlines()]
    return [(one[1], int(one[2]), one[3]) for one in found]


def from_gitlab(out):
    found = msgspec.json.decode(out, type=list[GitlabIssue])
    assert len({one.fingerprint for one in found}) == len(found)
    return [(one.location.path, one.location.lines.begin, one.check_name) for one in found]


def from_junit(out):
    suite = ElementTree.fromstring(out)  # noqa: S314 - our own
    assert suite.tag == "testsuite"
    assert int(suite.get("tests")) == len(suite)
    assert int(suite.get("failures")) == len(suite.findall("testcase/failure"))
    told = [case for case in suite if len(case)]
    found = [re.fullmatch(r"(IDL\d+) \S+:(\d+):\d+", case.get("name")) for case in told]
    return [
        (case.get("classname"), int(one[2]), one[1]) for case, one in zip(told, found, strict=True)
    ]


def from_sarif(out):
    found = []
    for result in run_of(out)["results"]:
        (location,) = result["locations"]
        region = location["physicalLocation"]["region"]
        start = (region["startLine"], region["startColumn"])
        assert (region["endLine"], region["endColumn"]) >= start
        found.append((path_of(location), region["startLine"], result["ruleId"]))
    return found


READERS = {
    "text": from_text,
    "json": from_json,
    "github": from_github,
    "gitlab": from_gitlab,
    "junit": from_junit,
    "sarif": from_sarif,
}


def test_every_format_is_read():
    assert set(READERS) == set(REPORT_FORMATS)


@pytest.mark.parametrize("style", READERS)
def test_ten_mistakes_are_ten_findings_in_each_format(style, capsys):
    write_all(MISTAKES)
    status, out = check(capsys, "--format", style)
    assert status == 1
    assert READERS[style](out) == EXPECTED


@pytest.mark.parametrize("style", READERS)
def test_text_of_unknown_origin_does_no_harm_in_any_format(style, capsys):
    write_all({"demo/msg/A.msg": "int8 a%0A::error::x <&>\"'\x1b[31m \u202e\nint8 \x01]]>\n"})
    status, out = check(capsys, "demo", "--format", style)
    assert status == 1
    assert READERS[style](out)
    assert "\x1b" not in out
    assert "\x01" not in out


@pytest.mark.parametrize("style", ["github", "gitlab", "junit", "sarif"])
def test_a_problem_without_a_place_has_one_in_each_format(style, capsys):
    write_all({"demo/msg/DriveMsg.msg": "int8 a\n"})
    status, out = check(capsys, "demo", "--format", style, "--select", "redundant-suffix")
    assert status == 0
    assert "IDL407" in out
    assert "demo/msg/DriveMsg.msg" in out


def test_nothing_found_is_a_whole_document_too(capsys):
    write_all({"demo/msg/Drive.msg": "int8 a\n"})
    assert json.loads(check(capsys, "demo", "--format", "gitlab")[1]) == []
    assert json.loads(check(capsys, "demo", "--format", "sarif")[1])["runs"][0]["results"] == []
    suite = ElementTree.fromstring(check(capsys, "demo", "--format", "junit")[1])  # noqa: S314
    assert (suite.get("tests"), suite.get("failures")) == ("1", "0")
    assert check(capsys, "demo", "--format", "github")[1] == ""


#: How formats say that something fails a build.
FAILS = {
    "json": '"severity": "error"',
    "github": "::error",
    "gitlab": '"severity": "major"',
    "junit": "<failure",
    "sarif": '"level": "error"',
}


@pytest.mark.parametrize("style", FAILS)
@pytest.mark.parametrize("text", ["wstring a\n", "wstring a\nint9 b\n"])
def test_a_format_fails_a_build_when_the_status_does(style, text, capsys):
    write_all({"demo/msg/Wide.msg": text})
    status, out = check(capsys, "demo", "--format", style)
    assert (FAILS[style] in out) == (status == 1) == ("int9" in text)
    assert "IDL421" in out
    assert check(capsys, "demo", "--strict", "--format", "junit")[1].count("<failure") == 1 + status


@pytest.mark.parametrize(("options", "failures"), [((), 5), (["--strict"], 10)])
def test_colcon_reads_the_junit_file(options, failures, capsys):
    write_all(MISTAKES)
    _, out = check(capsys, "--format", "junit", *options)
    write_all({"build/demo/idlc.xunit.xml": out})
    code = "import sys; from colcon_core.command import main; sys.exit(main(argv=sys.argv[1:]))"
    words = ["--log-base", "/dev/null", "test-result", "--test-result-base", "build", "--verbose"]
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False
    )
    assert f"10 tests, 0 errors, {failures} failures, 0 skipped" in done.stdout, done.stderr
    assert "unknown type `flot64`" in done.stdout
    assert done.returncode == 1


class Strict(msgspec.Struct, forbid_unknown_fields=True):
    pass


class GitlabLines(Strict):
    begin: int


class GitlabLocation(Strict):
    path: str
    lines: GitlabLines


class GitlabIssue(Strict):
    type: Literal["issue"]
    check_name: str
    description: str
    severity: Literal["info", "minor", "major", "critical", "blocker"]
    fingerprint: str
    location: GitlabLocation


PACKAGE_XML = """<?xml version="1.0"?>
<package format="3">
  <name>demo</name>  <!-- ours -->
  <depend>std_msgs</depend>

  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""


def test_what_can_be_fixed_is_fixed_once_and_nothing_else_changes(capsys):
    write_all(
        {
            "package.xml": PACKAGE_XML,
            "CMakeLists.txt": "rosidl_generate_interfaces(demo msg/A.msg)\n",
            "msg/A.msg": "# char is a word\nchar[3]   a\nchar  B=5  # a char\n"
            "std_msgs/Header h\ngeometry_msgs/Pose p # idlc: ignore[IDL401] no longer true\n",
        }
    )
    status, out = check(capsys, "--fix", "--select", "correctness,portability,package,IDL401")
    assert status == 0
    assert out == "9 fixed, no problems in 1 file\n"
    assert Path("msg/A.msg").read_text() == (
        "# char is a word\nuint8[3]  a\nuint8 B=5  # a char\n"
        "std_msgs/Header h\ngeometry_msgs/Pose p\n"
    )
    assert Path("package.xml").read_text() == PACKAGE_XML.replace(
        "  <depend>std_msgs</depend>\n",
        "  <buildtool_depend>rosidl_default_generators</buildtool_depend>\n"
        "  <exec_depend>rosidl_default_runtime</exec_depend>\n"
        "  <depend>std_msgs</depend>\n"
        "  <depend>geometry_msgs</depend>\n"
        "  <member_of_group>rosidl_interface_packages</member_of_group>\n",
    )
    assert check(capsys, "--fix")[1] == "no problems in 1 file\n"


def test_a_diff_shows_what_fix_would_write_and_writes_nothing(capsys):
    files = {
        "package.xml": PACKAGE_XML,
        "CMakeLists.txt": "rosidl_generate_interfaces(demo msg/A.msg)\n",
        "msg/A.msg": "  char a\ngeometry_msgs/Pose p\nflot64 b",
    }
    write_all(files)
    status, diff = check(capsys, "--fix", "--diff", "--select", "all")
    assert status == 1
    assert {path: Path(path).read_text() for path in files} == files
    Path("fix.diff").write_text(diff)
    subprocess.run(["/usr/bin/env", "git", "apply", "fix.diff"], check=True)
    applied = {path: Path(path).read_text() for path in files}
    assert applied["msg/A.msg"] == "uint8 a\ngeometry_msgs/Pose p\nflot64 b"
    write_all(files)
    check(capsys, "--fix", "--select", "all")
    assert {path: Path(path).read_text() for path in files} == applied
    assert check(capsys, "--diff", "--format", "json")[0] == 2


def test_a_diff_of_nothing_is_a_success(capsys):
    write_all({"demo/msg/A.msg": "wstring a\n"})
    assert check(capsys, "demo", "--diff") == (0, "")


def test_the_first_dependency_is_a_group_after_the_head(capsys):
    head = '<package format="3">\n  <name>demo</name>\n  <license>MIT</license>\n'
    end = "\n  <export>\n    <build_type>ament_cmake</build_type>\n  </export>\n</package>\n"
    write_all({"package.xml": head + end, "msg/A.msg": "std_msgs/Header header\n"})
    assert check(capsys, "--fix")[0] == 0
    assert Path("package.xml").read_text() == f"{head}\n  <depend>std_msgs</depend>\n{end}"


@pytest.mark.parametrize(
    ("settings", "words", "expected"),
    [
        ("", [], ["IDL421"]),
        ("", ["--select", "all"], ["IDL402", "IDL403", "IDL404", "IDL421", "IDL403"]),
        ("", ["--select", "style"], ["IDL402", "IDL403", "IDL404", "IDL403"]),
        ("", ["--select", "IDL404,portability"], ["IDL404", "IDL421"]),
        ("", ["--select", "IDL40", "--ignore", "IDL403"], ["IDL402", "IDL404"]),
        ("", ["--ignore", "wide-string"], []),
        ('select = ["missing-unit"]', [], ["IDL404"]),
        ('select = ["missing-unit"]', ["--select", "IDL402"], ["IDL402"]),
        ('ignore = ["portability"]', [], []),
        ('[tool.idlc.check.per-path]\n"msg/A*.msg" = ["IDL421"]', [], []),
        ('[tool.idlc.check.per-path]\n"other/*" = ["IDL421"]', [], ["IDL421"]),
    ],
)
def test_settings_and_options_choose_the_rules(settings, words, expected, capsys):
    write_all(
        {
            "pyproject.toml": f"[tool.idlc.check]\n{settings}\n",
            "demo/msg/A.msg": "float64 speed\nwstring name\n",
        }
    )
    assert codes(capsys, "demo", *words) == expected


@pytest.mark.parametrize(
    "settings",
    ['selct = ["all"]', 'select = "all"', 'select = ["IDL9999"]', "per-path = 3", "ignore = [1]"],
)
def test_a_wrong_choice_of_rules_is_an_error_of_usage(settings, capsys):
    write_all({"pyproject.toml": f"[tool.idlc.check]\n{settings}\n", "demo/msg/A.msg": "int8 a\n"})
    assert main(["check", "demo"]) == 2
    assert "[IDL611]" in capsys.readouterr().out
    assert main(["check", "demo", "--select", "nothing"]) == 2


def test_errors_cannot_be_switched_off(capsys):
    write_all({"demo/msg/A.msg": "int7 a  # idlc: ignore[IDL201] really\n"})
    assert codes(capsys, "demo", "--ignore", "IDL201,IDL490") == ["IDL201"]
    assert codes(capsys, "demo") == ["IDL201", "IDL490"]


def test_warnings_fail_only_when_asked(capsys):
    write_all({"demo/msg/A.msg": "wstring a\n"})
    assert check(capsys, "demo")[0] == 0
    assert check(capsys, "demo", "--strict")[0] == 1


def test_one_file_is_not_blamed_for_what_the_others_need(capsys):
    write_all(
        {
            "package.xml": '<package format="3">\n  <name>demo</name>\n'
            "  <depend>geometry_msgs</depend>\n</package>\n",
            "msg/A.msg": "int8 a\n",
            "msg/B.msg": "geometry_msgs/Pose p\n",
        }
    )
    assert main(["gen", ".", "-o", "demo"]) == 0
    capsys.readouterr()
    assert codes(capsys, "msg/A.msg") == []
    assert codes(capsys) == []
    write_all({"msg/B.msg": "int8 b\n"})
    assert codes(capsys) == ["IDL460", "IDL452"]
    assert codes(capsys, "msg/A.msg") == []


#: Projects whose generated code is not in the package, and the commands that generate it.
_OUTPUTS = {
    "library with settings": (
        {"pyproject.toml": '[tool.idlc]\npaths = ["m"]\nout = "src/kit/ros"\nvendor-deps = true\n'},
        "gen",
    ),
    "library without settings": (
        {"pyproject.toml": "[project]\nname = 'kit'\n"},
        "gen m --package kit_msgs -o src/kit/ros --vendor-deps",
    ),
    "setup.py alone": ({"setup.py": ""}, "gen m -o kit"),
    "out of a workspace": (
        {
            "pyproject.toml": "[tool.idlc]\npaths = ['m', 'n']\nout = 'lib'\n",
            "m/package.xml": "<package format='3'><name>m_msgs</name></package>\n",
            "n/package.xml": "<package format='3'><name>n_msgs</name></package>\n",
            "n/msg/C.msg": "int8 c\n",
        },
        "gen",
    ),
}


@pytest.mark.parametrize("project", _OUTPUTS)
def test_outdated_code_is_found_wherever_it_is_kept(project, capsys):
    files, command = _OUTPUTS[project]
    write_all({"m/msg/A.msg": "int8 a\n", "m/msg/B.msg": "std_msgs/Header b\n", **files})
    assert main(shlex.split(command)) == 0
    capsys.readouterr()
    for change in (
        lambda: write_all({"m/msg/A.msg": "int16 a\n"}),
        lambda: Path("m/msg/B.msg").rename("m/msg/D.msg"),
        lambda: write_all({"m/srv/E.srv": "---\n"}),
        lambda: Path("m/srv/E.srv").unlink(),
    ):
        change()
        said = check(capsys, "m", "--select", "IDL460")[1]
        assert said.count("[IDL460]") == 1
        (hint,) = re.findall(r"hint: run `idlc (.*)`", said)
        assert main(shlex.split(hint)) == 0
        capsys.readouterr()
        assert "IDL460" not in check(capsys, "m", "--select", "IDL460")[1]
    assert len([*Path().rglob("idlc.lock")]) == (2 if "n/msg/C.msg" in files else 1)


@pytest.mark.parametrize("manifest", ["", "kit/package.xml"])
@pytest.mark.parametrize(
    ("backend", "tool"),
    [
        ("build-backend = 'flit_core.buildapi'", "flit"),
        ("build-backend = 'uv_build'", "uv"),
        ("[tool.poetry]", "poetry"),
        ("build-backend = 'hatchling.build'", None),
        ("build-backend = 7", None),
    ],
)
def test_tools_that_build_wheels_of_outdated_classes_are_named(backend, tool, manifest, capsys):
    xml = f"{_NAMED.format('kit')}".replace("</p", f"{_PYTHON}</p")
    files = {manifest: xml} if manifest else {}
    write_all({"kit/pyproject.toml": f"[build-system]\n{backend}\n", **files})
    write_all({"kit/msg/A.msg": "int8 a\n"})
    assert main(["gen", "kit", "-o", "kit/src/kit", "--package", "kit"]) == 0
    write_all({"kit/msg/A.msg": "int16 a\n"})
    capsys.readouterr()
    said = check(capsys, "kit", "--select", "IDL460")[1]
    assert said.count("hint: run `idlc gen kit -o kit/src/kit") == 1
    assert f"`; until then, {tool} builds wheels with the old classes\n" in said or not tool
    assert ("until then" in said) == bool(tool)


_PYTHON = "<export><build_type>ament_python</build_type></export>"
_NAMED = "<package format='3'><name>{}</name></package>\n"
#: Packages that use types of another, and the commands that generate and check their classes, the
#: second in a folder.
_USERS = {
    "library": (
        "[tool.idlc]\npaths = ['m']\nout = 'kit/ros'\nvendor-deps = true\ninclude = ['far']\n",
        "gen",
        ".",
        "m",
    ),
    "package": ("", "gen m -o m/m_msgs -I far", ".", "."),
    "out of a package": (
        "[tool.idlc]\npaths = ['m']\nout = 'lib'\ninclude = ['.']\n",
        "gen",
        ".",
        "m",
    ),
    "inside of it": ("", "gen m -o m/m_msgs -I far", "m", ". -I .."),
    "deeper inside": ("", "gen m -o m/m_msgs -I far", "m/msg", ".. -I ../../far"),
    "another library": (
        "[project]\n",
        "gen m --package m_msgs -o kit/ros -I far --vendor-deps",
        "m",
        ". -I ../m/../far",
    ),
}


@pytest.mark.parametrize("user", _USERS)
def test_outdated_types_of_other_packages_are_found(user, capsys, monkeypatch):
    settings, command, folder, path = _USERS[user]
    words = (*shlex.split(path), "--select", "IDL460")
    files = {} if user.endswith("library") else {"m/package.xml": _NAMED.format("m_msgs")}
    far = {"far/msg/Near.msg": "Deep deep\n", "far/msg/Deep.msg": "int8 a\n", **files}
    far |= {"far/package.xml": _NAMED.format("far_msgs"), "m/msg/A.msg": "far_msgs/Near a\n"}
    write_all({**far, "pyproject.toml": settings})
    top = Path.cwd()
    assert main(shlex.split(command)) == 0
    write_all({"far/msg/Deep.msg": "# more words\nint8 a\n", "far/msg/Unused.msg": "int8 a\n"})
    monkeypatch.chdir(folder)
    top = os.path.relpath(top, Path.cwd())
    assert "IDL460" not in check(capsys, *words)[1]
    for change in ({"far/msg/Deep.msg": "int16 a\n"}, {"far/msg/Near.msg": "Deep other\n"}):
        write_all({f"{top}/{file}": text for file, text in change.items()})
        said = check(capsys, *words)[1]
        (name,) = (file.split("/")[2].removesuffix(".msg") for file in change)
        assert f"the generated code is out of date: `far_msgs/msg/{name}` changed\n" in said
        (hint,) = re.findall("run `idlc (.*)`", said)
        assert main(shlex.split(hint)) == 0
        capsys.readouterr()
        assert "IDL460" not in check(capsys, *words)[1]


def test_an_entry_point_that_leads_nowhere_is_found(capsys):
    setup = "from setuptools import setup\nname = 'demo'\nsetup(name=name, entry_points={})\n"
    scripts = [
        "good = demo.node:main",
        "method = demo.node:Node.run",
        "imported = demo:start",
        "nowhere",
        "other = nodes.node:main",
        "missing = demo.noode:main",
        "absent = demo.node:run",
    ]
    write_all(
        {
            "package.xml": "<package>\n  <name>demo</name>\n</package>\n",
            "setup.py": setup.replace("{}", f"{{'console_scripts': {scripts!r}}}"),
            "demo/__init__.py": "from demo.node import main as start\n",
            "demo/node.py": "class Node:\n    pass\n\n\ndef main():\n    pass\n",
            "msg/A.msg": "int8 a\n",
        }
    )
    _, out = check(capsys)
    assert re.findall(r"IDL457\]: (.*)", out) == [
        "`nowhere` is not an entry point",
        "there is no Python package `nodes` here",
        "there is no module `demo.noode`",
        "`demo/node.py` does not define `run`",
    ]


def test_entry_points_of_modules_that_setup_py_places_elsewhere_are_not_judged(capsys):
    scripts = ["a = demo.node:main", "b = tool:main", "nowhere"]
    for placed in ("package_dir={'': 'src'}", "package_dir=where", "py_modules=['tool']"):
        write_all(
            {
                "package.xml": "<package>\n  <name>demo</name>\n</package>\n",
                "setup.py": "from setuptools import setup\n"
                f"setup({placed}, entry_points={{'console_scripts': {scripts!r}}})\n",
                "src/demo/node.py": "def main():\n    pass\n",
                "tool.py": "def main():\n    pass\n",
                "msg/A.msg": "int8 a\n",
            }
        )
        _, out = check(capsys)
        assert re.findall(r"IDL457\]: (.*)", out) == ["`nowhere` is not an entry point"]


def test_a_hint_calls_find_packages_as_setup_py_can(capsys):
    write_all(
        {
            "package.xml": "<package>\n  <name>demo</name>\n"
            "  <export><build_type>ament_python</build_type></export>\n</package>\n",
            "setup.py": "import setuptools as tools\ntools.setup(packages=['demo'])\n",
            "demo/__init__.py": "",
            "msg/A.msg": "int8 a\n",
        }
    )
    _, out = check(capsys)
    assert "add `*tools.find_packages(include=['demo.*'])` to `packages`, or run" in out


def test_files_that_are_not_python_or_xml_are_not_judged(capsys):
    write_all(
        {
            "package.xml": "<package>\n  <name>demo</name>\n</package>\n",
            "setup.py": "setup(\n",
            "demo/node.py": "def (:\n",
            "demo/other.py": "x = '\udcff'\n".encode("utf-8", "replace").decode(),
            "msg/A.msg": "int8 a\n",
        }
    )
    assert codes(capsys) == []


def test_what_is_sure_of_a_broken_file_is_fixed(capsys):
    write_all(
        {
            "demo/msg/A.msg": "\ufeff# head\n  float64 a\n\tint8 b # c\n",
            "demo/srv/B.srv": "int8 a\n-----\nint8 b\n",
            "demo/action/C.action": "---\nint8 a\n--  \n",
        }
    )
    status, out = check(capsys, "demo", "--fix")
    assert (status, out) == (0, "5 fixed, no problems in 3 files\n")
    assert Path("demo/msg/A.msg").read_text("utf-8") == "# head\nfloat64 a\nint8 b # c\n"
    assert Path("demo/srv/B.srv").read_text() == "int8 a\n---\nint8 b\n"
    assert Path("demo/action/C.action").read_text() == "---\nint8 a\n---\n"


def test_what_might_be_meant_otherwise_is_not_fixed(capsys):
    files = {
        "demo/msg/A.msg": "int8 a\n----\n",
        "demo/srv/B.srv": "int8 a\n----\nint8 b\n---\nint8 c\n",
        "demo/srv/C.srv": "int8 a\n--- # the answer\nint8 b\n",
    }
    write_all(files)
    assert check(capsys, "demo", "--fix")[0] == 1
    assert {path: Path(path).read_text() for path in files} == files


def test_fix_leaves_columns_in_order(capsys):
    write_all({"demo/msg/A.msg": "char    key   # x\nfloat32 value # y\nchar    CD = 1  # z\n"})
    assert main(["fmt", "--check", "demo"]) == 0
    check(capsys, "demo", "--fix", "--select", "char-type")
    assert main(["fmt", "--check", "demo"]) == 0
    assert Path("demo/msg/A.msg").read_text() == (
        "uint8   key   # x\nfloat32 value # y\nuint8   CD = 1  # z\n"
    )


@pytest.mark.parametrize(
    "word", ["IDL421", "idl421", "421", "wide-string", "wide_string", "IDL42", "portability"]
)
def test_rules_are_named_by_code_name_and_category(word, capsys):
    write_all({"demo/msg/A.msg": "wstring a\n"})
    assert codes(capsys, "demo", "--select", word) == ["IDL421"]
    assert codes(capsys, "demo", "--ignore", word) == []


def test_a_remark_may_name_the_rule(capsys):
    write_all({"demo/msg/A.msg": "wstring a  # idlc: ignore[wide-string] for Windows\n"})
    assert codes(capsys, "demo") == []
    write_all({"demo/msg/A.msg": "int8 a  # idlc: ignore[wide-string] for Windows\n"})
    assert codes(capsys, "demo") == ["IDL490"]
    assert codes(capsys, "demo", "--select", "IDL405") == []


def test_a_misspelt_rule_is_guessed(capsys):
    assert main(["check", "--ignore", "wide-sting"]) == 2
    assert "did you mean `wide-string`?" in capsys.readouterr().err


def test_many_problems_end_with_numbers(capsys):
    lines = "".join(f"wstring w{number}\n" for number in range(12))
    write_all({"demo/msg/A.msg": lines, "demo/msg/B.msg": "wstring w\nint7 a\n"})
    status, out = check(capsys, "demo")
    assert status == 1
    assert out.count("warning[IDL421]") == 3
    assert "more of these warnings:\n  demo/msg/A.msg:4:1: IDL421 " in out
    assert "  demo/msg/B.msg:1:1: IDL421 " in out
    assert out.endswith(
        "\n13  IDL421 wide-string\n 1  IDL201 unknown-type\n1 error, 13 warnings in 2 files\n"
    )


#: What nothing should be said about, although it looks like what something is said about.
CALM = {
    "msg/PoseStamped.msg": "builtin_interfaces/Time stamp\nint8 pose\n",
    "msg/Odd.msg": "string inches 5\"\nstring url http://example.com\nstring a '//'\n"
    'string b "a // b"\nstring[] c ["x"]\n',
    "msg/Fix.msg": "float64 latitude  # [deg]\nfloat64 lon  # [degrees]\n"
    "float32 dwell_time_ms  # [ms]\nfloat32 timing_deg  # [deg]\nfloat32 v_km_h  # [km/h]\n",
    "msg/Frames.msg": "float32 x  # [m] [@frame NED]\nfloat32 v  # [m/s] [@invalid NaN] [0, 5]\n",
    "msg/Text.msg": "char[20] name\n",
    "srv/ApiService.srv": "---\n",
}


@pytest.mark.parametrize("path", CALM)
def test_nothing_is_said_about_what_is_usual(path, capsys):
    write_all({f"demo/{path}": CALM[path]})
    assert check(capsys, "demo")[1] == "no problems in 1 file\n"


@pytest.mark.parametrize(
    ("path", "text", "code"),
    [
        ("msg/PoseStamped.msg", "int8 pose\nbuiltin_interfaces/Time stamp\n", "IDL401"),
        ("msg/PoseStamped.msg", "std_msgs/Header head\n", "IDL401"),
        ("msg/A.msg", 'string a "b\n', "IDL315"),
        ("msg/A.msg", "string a 'b\"\n", "IDL315"),
        ("msg/A.msg", "string a // b\n", "IDL315"),
        ("msg/A.msg", "string a /* b */\n", "IDL315"),
        ("msg/A.msg", "string A='b\n", "IDL315"),
        ("msg/A.msg", 'string a "#"\n', "IDL109"),
        ("msg/A.msg", "float32 turn  # [deg]\n", "IDL405"),
        ("msg/A.msg", "float32 v  # [m/s] or [km/h]\n", "IDL411"),
    ],
)
def test_this_line_gets_this_one_warning(path, text, code, capsys):
    write_all({f"demo/{path}": text})
    assert codes(capsys, "demo") == [code]


CMAKE = {
    "rosidl_generate_interfaces(demo msg/A.msg)": True,
    "rosidl_generate_interfaces(${PROJECT_NAME}\n  ${files}\n  DEPENDENCIES std_msgs\n)": True,
    "rosidl_generate_interfaces(demo msg/A.msg SKIP_INSTALL)": False,
    "if(BUILD_TESTING)\n  rosidl_generate_interfaces(demo\n    msg/A.msg\n    SKIP_INSTALL)": False,
    "# rosidl_generate_interfaces(demo msg/A.msg)": False,
    "rosidl_generate_interfaces(demo msg/A.msg # SKIP_INSTALL\n)": True,
}


@pytest.mark.parametrize("cmake", CMAKE)
def test_interfaces_for_tests_alone_need_no_group(cmake, capsys):
    write_all(
        {
            "demo/package.xml": '<package format="3">\n  <name>demo</name>\n'
            "  <test_depend>std_msgs</test_depend>\n</package>\n",
            "demo/CMakeLists.txt": cmake + "\n",
            "demo/msg/A.msg": "std_msgs/Header header\n",
        }
    )
    expected = ["IDL451", "IDL453", "IDL454"] if CMAKE[cmake] else []
    expected += ["IDL463"] if CMAKE[cmake] and "DEPENDENCIES" not in cmake else []
    expected += ["IDL470"] if cmake.startswith("#") else []  # CMake would install nothing
    assert sorted(codes(capsys, "demo")) == expected


def test_the_core_generators_will_do(capsys):
    write_all(
        {
            "demo/package.xml": '<package format="3">\n  <name>demo</name>\n'
            "  <buildtool_depend>rosidl_core_generators</buildtool_depend>\n"
            "  <exec_depend>rosidl_core_runtime</exec_depend>\n"
            "  <member_of_group>rosidl_interface_packages</member_of_group>\n</package>\n",
            "demo/CMakeLists.txt": "rosidl_generate_interfaces(demo msg/A.msg)\n",
            "demo/msg/A.msg": "int8 a\n",
        }
    )
    assert codes(capsys, "demo") == []


def test_generators_that_everybody_gets_bring_their_runtime(capsys):
    manifest = (
        '<package format="3">\n  <name>demo</name>\n  <depend>rosidl_default_generators</depend>\n'
        "  <member_of_group>rosidl_interface_packages</member_of_group>\n</package>\n"
    )
    write_all(
        {
            "demo/package.xml": manifest,
            "demo/CMakeLists.txt": "rosidl_generate_interfaces(demo msg/A.msg)\n",
            "demo/msg/A.msg": "int8 a\n",
        }
    )
    assert codes(capsys, "demo") == []
    write_all({"demo/package.xml": manifest.replace("depend>", "build_depend>")})
    assert codes(capsys, "demo") == ["IDL454"]


def test_nothing_is_unused_where_not_all_is_known(capsys):
    write_all(
        {
            "demo/package.xml": '<package format="3">\n  <name>demo</name>\n'
            "  <depend>std_msgs</depend>\n</package>\n",
            "demo/msg/A.msg": "int8 a\n",
        }
    )
    assert codes(capsys, "demo") == ["IDL452"]
    write_all({"demo/msg/A.msg": "Header a\n"})
    assert codes(capsys, "demo") == ["IDL201"]


def test_a_file_with_capitals_in_its_extension_is_named(capsys):
    write_all({"demo/msg/A.msg": "int8 a\n", "demo/msg/B.MSG": "int8 b\n"})
    assert codes(capsys, "demo") == ["IDL622"]
    assert main(["check", "demo/msg/B.MSG"]) == 2
