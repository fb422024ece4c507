"""`idlc check`: what package.xml and CMakeLists.txt declare, and its repair."""

import re
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
