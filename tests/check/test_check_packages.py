"""`idlc check`: what package.xml and CMakeLists.txt declare, and its repair."""

import re
import runpy
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support.files import write_all

pytestmark = pytest.mark.usefixtures("here")

HEAD = '<package format="3">\n  <name>demo</name>\n'
TAIL = "  <export>\n    <build_type>ament_python</build_type>\n  </export>\n</package>\n"


def check(capsys, *words):
    main(["check", *words])
    return "".join(capsys.readouterr())


def test_a_package_that_is_not_known_is_not_declared(capsys):
    write_all({"package.xml": HEAD + TAIL, "msg/A.msg": "std_msg/Header h\nacme_msgs/X x\n"})
    said = check(capsys, "--fix")
    assert "did you mean `std_msgs`?" in said
    assert "IDL451" not in said
    assert Path("package.xml").read_text() == HEAD + TAIL


def test_a_misspelt_declaration_is_named(capsys):
    manifest = HEAD + "  <depend>geometry_msg</depend>\n" + TAIL
    write_all({"package.xml": manifest, "msg/A.msg": "geometry_msgs/Pose pose\n"})
    said = check(capsys, "--fix")
    assert "write `<depend>geometry_msgs</depend>` instead of `geometry_msg`" in said
    assert Path("package.xml").read_text() == manifest


def test_a_package_of_interfaces_and_nodes_is_declared_once(capsys):
    manifest = HEAD + "  <test_depend>python3-pytest</test_depend>\n" + TAIL
    write_all(
        {
            "package.xml": manifest,
            "msg/A.msg": "std_msgs/Header h\n",
            "demo/__init__.py": "import std_msgs.msg\nimport rclpy\n",
        }
    )
    said = check(capsys)
    assert said.count("hint: add `<depend>std_msgs</depend>`") == 2
    check(capsys, "--fix")
    assert Path("package.xml").read_text() == (
        f"{HEAD}  <depend>std_msgs</depend>\n  <exec_depend>rclpy</exec_depend>\n"
        f"  <test_depend>python3-pytest</test_depend>\n{TAIL}"
    )


FIND = "find_package(base_msgs REQUIRED)\n"
CALL = "rosidl_generate_interfaces(demo msg/A.msg"
LINES = "rosidl_generate_interfaces(demo\n  msg/A.msg\n  DEPENDENCIES base_msgs"
#: A CMakeLists.txt, and what it becomes when the interfaces use std_msgs; `None`: not judged.
CMAKE = {
    f"{CALL})\n": f"{CALL} DEPENDENCIES std_msgs)\n",
    f"{FIND}{LINES} # ours\n)\n": FIND
    + f"find_package(std_msgs REQUIRED)\n{LINES} std_msgs # ours\n)\n",
    "set(deps base_msgs)\nrosidl_generate_interfaces(demo ${x} DEPENDENCIES ${deps} "
    "ADD_LINTER_TESTS)\n": "set(deps base_msgs std_msgs)\nrosidl_generate_interfaces(demo ${x} "
    "DEPENDENCIES ${deps} ADD_LINTER_TESTS)\n",
    f"{CALL} DEPENDENCIES base_msgs ADD_LINTER_TESTS)\n": f"{CALL} DEPENDENCIES base_msgs std_msgs "
    "ADD_LINTER_TESTS)\n",
    "set(deps\r\n)\r\n" + CALL + " DEPENDENCIES ${deps})\r\n": "set(deps\r\n  std_msgs\r\n)\r\n"
    + CALL
    + " DEPENDENCIES ${deps})\r\n",
    f'{CALL} "b (c)" DEPENDENCIES d)\n': f'{CALL} "b (c)" DEPENDENCIES d std_msgs)\n',
    CALL + " DEPENDENCIES ${computed})\n": None,
    "set(d x)\nlist(APPEND d ${y})\n" + CALL + " DEPENDENCIES ${d})\n": None,
    CALL + " DEPENDENCIES std_msgs)\n": None,
    CALL + " DEPENDENCIES ${X}_msgs)\n": None,
}


@pytest.mark.parametrize("text", CMAKE)
def test_cmake_is_told_what_the_interfaces_use(text, capsys):
    write_all({"package.xml": HEAD + "</package>\n", "msg/A.msg": "std_msgs/Header h\n"})
    Path("CMakeLists.txt").write_bytes(text.encode())
    assert ("IDL463" in check(capsys)) == (CMAKE[text] is not None)
    check(capsys, "--fix")
    assert Path("CMakeLists.txt").read_bytes().decode() == (CMAKE[text] or text)
    assert not re.findall("IDL4[56]", check(capsys))


def package_xml(name, *depends, build_type="ament_python"):
    lines = "".join(f"  <exec_depend>{each}</exec_depend>\n" for each in depends)
    head = f'<package format="3">\n  <name>{name}</name>\n{lines}'
    return f"{head}  <export><build_type>{build_type}</build_type></export>\n</package>\n"


#: Files, and the package that IDL459 names and adds: "" if none is reported, "-" if none is added.
IMPORTS = {
    "another name": ({"a/node.py": "from tf2_ros import Buffer\n"}, "tf2_ros_py"),
    "another name, declared": (
        {"package.xml": package_xml("a", "tf2_ros_py"), "a/node.py": "import tf2_ros\n"},
        "",
    ),
    "another name in the workspace": (
        {
            "b_py/package.xml": package_xml("b_py"),
            "b_py/b/__init__.py": "",
            "a/node.py": "import b",
        },
        "b_py",
    ),
    "the package's own": (
        {
            "b/package.xml": package_xml("b"),
            "b/b/__init__.py": "",
            "a/b.py": "",
            "x/y.py": "import b",
        },
        "",
    ),
    "the package's own, below src": (
        {"b/package.xml": package_xml("b"), "b/b.py": "", "src/b/c.py": "import b"},
        "",
    ),
    "of C++": ({"serial/package.xml": package_xml("serial"), "a/node.py": "import serial"}, ""),
    "of pip": (
        {
            "package.xml": package_xml("a", "python3-serial"),
            "serial/package.xml": package_xml("serial"),
            "serial/serial/__init__.py": "",
            "a/node.py": "import serial",
        },
        "",
    ),
    "of two packages": (
        {
            "b/package.xml": package_xml("b"),
            "b/tools/__init__.py": "",
            "c/package.xml": package_xml("c"),
            "c/tools/__init__.py": "",
            "a/node.py": "import tools",
        },
        "",
    ),
    "a circle": (
        {"b/package.xml": package_xml("b", "a"), "b/b/__init__.py": "", "a/node.py": "import b"},
        "-",
    ),
    "a larger circle": (
        {
            "b/package.xml": package_xml("b", "c"),
            "b/src/b/__init__.py": "",
            "c/package.xml": package_xml("c", "a"),
            "a/node.py": "import b.parts",
        },
        "-",
    ),
    "a nested test": ({"a/parts/test/x.py": "import rclpy\n", "a_test/y.py": "import rclpy"}, ""),
    "a sample": ({"samples/x.py": "import rclpy\n", "a/launch/a.launch.py": "import launch"}, ""),
    "a node": ({"a/node.py": "import rclpy.node\n"}, "rclpy"),
}


@pytest.mark.parametrize("case", IMPORTS)
def test_only_what_is_a_missing_package_is_added(case, capsys):
    files, package = IMPORTS[case]
    own = {path for path in files if path.count("/package.xml")}
    beside = {path.partition("/")[0] for path in own}
    at = {path: path if path.partition("/")[0] in beside else f"a/{path}" for path in files}
    write_all({"a/package.xml": package_xml("a"), "a/msg/A.msg": "int8 a\n"})
    write_all({at[path]: text for path, text in files.items()})
    before = Path("a/package.xml").read_text()
    said = check(capsys, "--fix", "--select", "IDL459")
    assert ("IDL459" in said) == (package == "-"), said
    line = f"  <exec_depend>{package}</exec_depend>\n"
    after = Path("a/package.xml").read_text()
    assert after.replace(line, "", package not in ("", "-")) == before
    assert (line in after) == (package not in ("", "-"))


SETUP = """\
from setuptools import find_packages, setup

p = 'rover'
setup(name=p, packages={}, data_files=[])
"""
#: What a setup.py installs, beside what it lacks.
LISTED = {
    "a parent without __init__.py": "[p, p + '.plugins.lidar']",
    "a folder of data": "[p, f'{p}.config']",
    "an empty submodule": "[p, p + '.absent']",
    "a test": "[p, 'test', 'test.unit']",
    "a name": "[*['rover'], 'other']",
    "a search": "find_packages(include=[p])",
    "a search below a name": "find_packages(exclude=['*.msg', '*._idlc'])",
    "a sum": "[p] + find_packages(include=['other'])",
}


@pytest.mark.parametrize("case", LISTED)
def test_a_fix_keeps_every_package_that_setup_py_installs(case, capsys, monkeypatch):
    files = ("", "parts/", "plugins/lidar/", "msg/", "_idlc/")
    write_all({f"rover/{path}__init__.py": "" for path in files})
    write_all({"rover/config/a.yaml": "", "test/unit/__init__.py": "", "other/__init__.py": ""})
    write_all({"package.xml": package_xml("rover"), "msg/A.msg": "int8 a\n", "resource/rover": ""})
    write_all({"test/__init__.py": "", "setup.py": SETUP.format(LISTED[case])})
    installed = []
    monkeypatch.setattr("setuptools.setup", lambda **passed: installed.append(passed["packages"]))
    runpy.run_path("setup.py")
    check(capsys, "--fix")
    runpy.run_path("setup.py")
    before, after = map(set, installed)
    assert before | {"rover.msg", "rover._idlc"} <= after
    assert after - before <= {"rover", "rover.parts", "rover.msg", "rover._idlc"}
