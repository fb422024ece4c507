"""CMakeLists.txt as CMake itself reads it, and what is left alone."""

import subprocess
import time
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.diagnostics.source import Source
from idlc.packaging.cmake import Script, calls
from tests.support.tools import tool

pytestmark = pytest.mark.usefixtures("here")

#: What a script gives to rosidl, in words; "?" where it is not read off.
LISTS = {
    'rosidl_generate_interfaces(demo "msg/A.msg" msg/B.msg)': "msg/A.msg msg/B.msg",
    "ROSIDL_GENERATE_INTERFACES (demo # one )\n msg/A.msg #[[ two ) ]] msg/B.msg\n)": (
        "msg/A.msg msg/B.msg"
    ),
    "#[==[\nrosidl_generate_interfaces(no msg/No.msg)\n]]\n]==]\n"
    "rosidl_generate_interfaces(demo [[msg/A.msg]] [=[msg/B.msg]=])": "msg/A.msg msg/B.msg",
    'message("a ) # b")\nrosidl_generate_interfaces(demo msg/A.msg;msg/B.msg)': (
        "msg/A.msg msg/B.msg"
    ),
    'message("\\")")\nset(files "msg/A.msg;msg/B.msg")\n'
    'rosidl_generate_interfaces(demo ${files} "${files}")': (
        "msg/A.msg msg/B.msg msg/A.msg msg/B.msg"
    ),
    "set(a msg/A.msg)\nlist(APPEND a msg/B.msg)\nset(b ${a} msg/C.msg)\n"
    "rosidl_generate_interfaces(demo ${b})": "msg/A.msg msg/B.msg msg/C.msg",
    "set(d msg)\nset(a ${d}/A.msg)\nset(a)\nset(a ${d}/B.msg)\n"
    "rosidl_generate_interfaces(demo ${a})": "msg/B.msg",
    "foreach(name IN ITEMS A B)\n  list(APPEND a ${name}.msg)\nendforeach()\n"
    "rosidl_generate_interfaces(demo ${a})": "?",
    "set(b msg/A.msg msg/B.msg)\nforeach(f IN LISTS b)\n  list(APPEND a ${f})\nendforeach()\n"
    "rosidl_generate_interfaces(demo ${a})": "msg/A.msg msg/B.msg",
    "if(a STREQUAL (b))\nendif()\nrosidl_generate_interfaces(demo msg/A.msg LIBRARY_NAME x "
    "DEPENDENCIES y z ADD_LINTER_TESTS)": "msg/A.msg",
    "rosidl_generate_interfaces(demo ${CMAKE_CURRENT_SOURCE_DIR}:msg/A.msg)": "msg/A.msg",
    "set(a msg/A.msg)\nstring(TOUPPER a a)\nrosidl_generate_interfaces(demo ${a})": "?",
    "set(a msg/A.msg)\nlist(REMOVE_ITEM a msg/A.msg)\nrosidl_generate_interfaces(demo m ${a})": "?",
    'string(REPLACE x A a "msg/x.msg")\nlist(APPEND a msg/B.msg)\n'
    "rosidl_generate_interfaces(demo ${a})": "?",
    "file(STRINGS names.txt a)\nlist(APPEND a msg/B.msg)\nrosidl_generate_interfaces(demo ${a})": (
        "?"
    ),
    "set(a msg/A.msg)\nset(b m m)\nlist(SUBLIST b 0 1 a)\nrosidl_generate_interfaces(demo ${a})": (
        "?"
    ),
    "macro(more)\n  list(APPEND a msg/B.msg)\nendmacro()\nset(a msg/A.msg)\nmore()\n"
    "rosidl_generate_interfaces(demo ${a})": "?",
    "function(gen)\n  rosidl_generate_interfaces(demo ${ARGN})\nendfunction()\ngen(msg/A.msg)": "?",
    "rosidl_generate_interfaces(demo msg/A\\.msg)": "?",
    "rosidl_generate_interfaces(demo $ENV{FILES} msg/A.msg)": "?",
    "set(a msg/A.msg CACHE STRING text)\nrosidl_generate_interfaces(demo ${a})": "?",
}
STUB = """
macro(rosidl_generate_interfaces target)
  cmake_parse_arguments(_ARG "ADD_LINTER_TESTS;SKIP_INSTALL" "LIBRARY_NAME" "DEPENDENCIES" ${ARGN})
  foreach(file ${_ARG_UNPARSED_ARGUMENTS})
    string(REPLACE "${CMAKE_CURRENT_SOURCE_DIR}:" "" file "${file}")
    file(APPEND "files.txt" "${file}\\n")
  endforeach()
endmacro()
"""


@pytest.mark.parametrize("text", LISTS)
def test_lists_are_what_cmake_makes_of_them(text):
    files = Script(Source("CMakeLists.txt", text)).files
    expected = LISTS[text]
    assert files is None if expected == "?" else [item.text for item in files] == expected.split()
    if expected != "?":
        Path("script.cmake").write_text(STUB + text + "\n", encoding="utf-8")
        subprocess.run([tool("cmake"), "-P", "script.cmake"], check=True, capture_output=True)
        assert Path("files.txt").read_text().split() == expected.split()


HEAD = (
    '<package format="3">\n  <name>demo</name>\n'
    "  <buildtool_depend>rosidl_default_generators</buildtool_depend>\n"
    "  <exec_depend>rosidl_default_runtime</exec_depend>\n"
    "  <member_of_group>rosidl_interface_packages</member_of_group>\n{}"
    "  <export><build_type>ament_cmake</build_type></export>\n</package>\n"
)
GEN = "rosidl_generate_interfaces(demo msg/A.msg"


def check(cmake, capsys, *words, depends=("std_msgs",), **files):
    """Return the codes that a package gets, sorted; its files are msg/A.msg and others."""
    for path, text in {"A": "std_msgs/Header h\n", **files}.items():
        Path("demo/msg").mkdir(parents=True, exist_ok=True)
        Path(f"demo/msg/{path}.msg").write_text(text, encoding="utf-8")
    depends = "".join(f"  <depend>{name}</depend>\n" for name in depends)
    Path("demo/package.xml").write_text(HEAD.format(depends), encoding="utf-8")
    Path("demo/CMakeLists.txt").write_bytes(cmake.encode())
    main(["check", "demo", "--select", "package", *words])
    return capsys.readouterr()


def codes(captured):
    return sorted(line[8:14] for line in captured.out.splitlines() if line.startswith("warning["))


#: Scripts for a package with msg/A.msg, which uses std_msgs, and msg/B.msg -> what they lack.
FINDINGS = {
    f"{GEN} DEPENDENCIES std_msgs)": ["IDL464"],
    f"{GEN} msg/B.msg DEPENDENCIES std_msgs)": [],
    f"{GEN} ./msg//B.msg DEPENDENCIES std_msgs)": [],
    f"{GEN} SKIP_INSTALL DEPENDENCIES std_msgs)\nrosidl_generate_interfaces(t msg/B.msg "
    "SKIP_INSTALL)": [],
    f"{GEN} DEPENDENCIES std_msgs)\nif(TESTS)\n"
    "  rosidl_generate_interfaces(t msg/B.msg)\nendif()": [],
    'file(GLOB a RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" "msg/*.msg")\n'
    "rosidl_generate_interfaces(demo ${a} DEPENDENCIES std_msgs)": [],
    "file(GLOB a RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS msg/[A].msg)\n"
    "rosidl_generate_interfaces(demo ${a} DEPENDENCIES std_msgs)": ["IDL464"],
    "set(d ${CMAKE_CURRENT_SOURCE_DIR}/msg)\n"
    "file(GLOB a RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} ${d}/A*.msg)\n"
    "rosidl_generate_interfaces(demo ${a} DEPENDENCIES std_msgs)": ["IDL464"],
    "file(GLOB a msg/A.msg)\nrosidl_generate_interfaces(demo ${a} DEPENDENCIES std_msgs)": [],
    "set(a x)\ninclude(cmake/more.cmake)\nlist(APPEND a std_msgs)\n"
    + GEN
    + " DEPENDENCIES ${a})": [],
    "include(CTest)\n" + GEN + " DEPENDENCIES std_msgs)": ["IDL464"],
    f"{GEN} msg/B.msg msg/C.msg DEPENDENCIES std_msgs)": ["IDL465"],
    f"configure_file(a msg/C.msg)\n{GEN} msg/B.msg msg/C.msg DEPENDENCIES std_msgs)": [],
    "if(EXISTS msg/C.msg)\n  set(a msg/C.msg)\nendif()\n" + GEN + " msg/B.msg ${a} DEPENDENCIES "
    "std_msgs)": [],
    f"{GEN} msg/B.msg ../other/msg/C.msg /tmp/x:msg/C.msg DEPENDENCIES std_msgs)": [],
    f"find_package(ament_cmake)\n{GEN} msg/B.msg DEPENDENCIES std_msgs)": ["IDL466"],
    f"find_package(geometry_msgs)\n{GEN} msg/B.msg DEPENDENCIES std_msgs)": ["IDL467"],
    f"find_package(geometry_msgs)\nuse(geometry_msgs)\n{GEN} msg/B.msg DEPENDENCIES std_msgs)": [],
    f"find_package(my_msgs)\n{GEN} msg/B.msg DEPENDENCIES std_msgs)": [],
    f"ament_auto_find_build_dependencies()\n{GEN} msg/B.msg DEPENDENCIES std_msgs)": [],
    f"{GEN} msg/B.msg DEPENDENCIES std_msgs)\nament_package()": ["IDL468"],
    f"{GEN} msg/B.msg DEPENDENCIES std_msgs)\nament_export_dependencies(rosidl_core_runtime)\n"
    "ament_package()": [],
    f"{GEN} msg/B.msg DEPENDENCIES std_msgs)\nament_auto_package()\nament_package()": [],
    f"{GEN} msg/B.msg DEPENDENCIES std_msgs)\nament_export_dependencies(${{x}})\n"
    "ament_package()": [],
}


@pytest.mark.parametrize("cmake", FINDINGS)
def test_a_script_is_judged_where_it_is_literal(cmake, capsys):
    assert codes(check(f"{cmake}\n", capsys, B="uint8 b\n")) == FINDINGS[cmake]


def test_what_is_computed_is_noted(capsys):
    captured = check(
        "file(GLOB_RECURSE a *.msg)\nrosidl_generate_interfaces(demo ${a} DEPENDENCIES std_msgs)\n",
        capsys,
    )
    assert codes(captured) == []
    assert captured.err == (
        "note: `demo/CMakeLists.txt` computes the interfaces for `rosidl_generate_interfaces`, "
        "so idlc does not compare them with the package's files\n"
    )


@pytest.mark.parametrize("other", ["node.cpp", "msg/Written.idl"])
def test_other_files_of_a_package_may_use_what_it_finds(other, capsys):
    cmake = f"find_package(nav_msgs)\nfind_package(std_msgs)\n{GEN} DEPENDENCIES std_msgs)\n"
    assert codes(check(cmake, capsys)) == ["IDL467"]
    before = Path("demo/CMakeLists.txt").read_text()
    main(["check", "demo", "--fix"])
    assert Path("demo/CMakeLists.txt").read_text() == before, "the package exports what it names"
    capsys.readouterr()
    Path("demo", other).write_text("", encoding="utf-8")
    assert codes(check(cmake, capsys)) == []


#: A script, and what `--fix` makes of it.
FIXES = {
    'find_package(std_msgs)\nrosidl_generate_interfaces(demo\n  "msg/A.msg"  # the first\n  '
    "DEPENDENCIES std_msgs\n)\n": "find_package(std_msgs)\nrosidl_generate_interfaces(demo\n  "
    '"msg/A.msg"  # the first\n  "msg/B.msg"\n  DEPENDENCIES std_msgs\n)\n',
    "find_package(ament_cmake)  # first\nrosidl_generate_interfaces(demo\n  msg/A.msg # one )\n"
    ")\n": (
        "find_package(ament_cmake)  # first\nfind_package(std_msgs REQUIRED)\n"
        "rosidl_generate_interfaces(demo\n  msg/A.msg # one )\n  msg/B.msg\n"
        "  DEPENDENCIES std_msgs\n)\n"
    ),
    "find_package(std_msgs)\nrosidl_generate_interfaces(demo\n\tmsg/A.msg\n\tmsg/B.msg\n"
    "\tDEPENDENCIES\n)\n": (
        "find_package(std_msgs)\nrosidl_generate_interfaces(demo\n\tmsg/A.msg\n\tmsg/B.msg\n"
        "\tDEPENDENCIES\n\tstd_msgs\n)\n"
    ),
    "find_package(std_msgs)\r\nset(a\r\n  msg/A.msg\r\n  msg/Gone.msg\r\n)\r\n"
    "rosidl_generate_interfaces(demo ${a} msg/B.msg DEPENDENCIES std_msgs)\r\n": (
        "find_package(std_msgs)\r\nset(a\r\n  msg/A.msg\r\n)\r\n"
        "rosidl_generate_interfaces(demo ${a} msg/B.msg DEPENDENCIES std_msgs)\r\n"
    ),
    "find_package(rosidl_default_generators)\nif(X)\n  rosidl_generate_interfaces(demo msg/A.msg "
    "msg/B.msg\n    DEPENDENCIES std_msgs)\nendif()\nif(BUILD_TESTING)\n"
    "  find_package(ament_lint_auto REQUIRED)\nendif()\nament_package()\n": (
        "find_package(rosidl_default_generators)\nfind_package(std_msgs REQUIRED)\nif(X)\n"
        "  rosidl_generate_interfaces(demo msg/A.msg msg/B.msg\n    DEPENDENCIES std_msgs)\n"
        "  ament_export_dependencies(rosidl_default_runtime)\nendif()\nif(BUILD_TESTING)\n"
        "  find_package(ament_lint_auto REQUIRED)\nendif()\nament_package()\n"
    ),
}


@pytest.mark.parametrize(
    "cmake",
    [
        f'{GEN} "msg/B.msg;msg/Gone.msg" DEPENDENCIES std_msgs)\n',
        f'{GEN} msg/B.msg DEPENDENCIES "std_msgs;nav_msgs")\n',
        f'find_package(rosidl_x)\n{GEN} msg/B.msg DEPENDENCIES std_msgs "x)\nmessage(no)\n")\n',
    ],
)
def test_fixes_take_no_list_apart_and_write_no_commands(cmake, capsys):
    captured = check(cmake, capsys, "--fix", B="uint8 b\n")
    assert codes(captured)
    text = Path("demo/CMakeLists.txt").read_text()
    assert text.replace("find_package(std_msgs REQUIRED)\n", "") == cmake


@pytest.mark.parametrize("cmake", FIXES)
def test_fixes_keep_the_layout(cmake, capsys):
    assert codes(check(cmake, capsys, "--fix", B="uint8 b\n")) == []
    assert Path("demo/CMakeLists.txt").read_bytes().decode() == FIXES[cmake]


@pytest.mark.parametrize(
    "text",
    [
        "[" * 30_000,
        "f([[" * 8_000,
        "#[[" + "#[=[" * 8_000,
        'f("' + '\\"' * 30_000,
        "f(" * 30_000,
        "if(a)\n" * 40_000,
        "function(a)\n" * 40_000,
        "set(a x)\n" + "set(a ${a}${a})\n" * 8_000,
        "set(a x)\n" + "set(a ${a} ${a})\n" * 8_000,
        "list(APPEND a x)\n" * 8_000,
        "set(a " + "x " * 20_000 + ")\n" + "set(b ${a})\n" * 8_000,
        f"find_package(ament_cmake)\n{GEN} DEPENDENCIES" + " nav_msgs" * 10_000 + ")",
        f"find_package(ament_cmake){' ' * 200_000}\n{GEN} DEPENDENCIES"
        + "".join(f" p{n}" for n in range(8_000))
        + ")",
        GEN + "".join(f" msg/A{n}.msg" for n in range(8_000)) + ")",
        "file(GLOB a RELATIVE ${PROJECT_SOURCE_DIR} " + "msg/" + "*a" * 2000 + "b.msg)\n"
        "rosidl_generate_interfaces(demo ${a})",
    ],
    ids=range(15),
)
def test_hostile_scripts_take_linear_time(text, capsys):
    start = time.process_time()
    check(text, capsys, B="uint8 b\n")
    assert time.process_time() - start < 10


@pytest.mark.parametrize(
    "text", ["", ")", "f(", 'f("', "f([[", "#[[", "(", "a b (c)", "\ufefff(x)\\"]
)
def test_damaged_scripts_are_read_as_far_as_they_go(text):
    assert next(calls(Source("CMakeLists.txt", f"g(y)\n{text}"))).name == "g"


@pytest.mark.parametrize("name", ["package.xml", "CMakeLists.txt", "setup.cfg", "pyproject.toml"])
def test_a_file_that_describes_a_package_stands_for_it(name, capsys):
    expected = check(f"{GEN} msg/Gone.msg DEPENDENCIES std_msgs)\n", capsys, B="uint8 b\n").out
    Path("demo/other").mkdir()
    for path in (f"demo/{name}", "demo/other/setup.py", "pyproject.toml"):
        Path(path).touch()
    words = [f"demo/{name}", "demo/msg/B.msg", "demo/package.xml", "demo/other/setup.py"]
    assert main(["check", *words, "pyproject.toml", "--select", "package"]) == 0
    assert codes(captured := capsys.readouterr()) == ["IDL464", "IDL465"]
    assert captured.out == expected
    assert main(["check", "pyproject.toml", "demo/other/setup.py"]) == 0
    assert capsys.readouterr().out == "no problems in 0 files\n"


def test_a_name_of_a_file_does_not_become_cmake(capsys):
    cmake = f"{GEN} msg/B.msg DEPENDENCIES std_msgs)\n"
    captured = check(cmake, capsys, "--fix", **{"B": "uint8 b\n", 'B")message("${x}': "uint8 b\n"})
    assert "IDL464" not in captured.out
    assert Path("demo/CMakeLists.txt").read_text() == cmake


def test_a_package_without_interfaces_may_change(capsys):
    Path("nodes").mkdir()
    Path("nodes/package.xml").write_text("<package><name>nodes</name></package>", encoding="utf-8")
    assert main(["check", "nodes/package.xml"]) == 0
    assert capsys.readouterr().out == "no problems in 1 package without interfaces\n"
