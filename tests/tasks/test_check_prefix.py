"""`idlc check --ament`: what stops recorders is found, whatever lies in the files."""

import random
import re
import shutil

import pytest

from idlc.cli.main import main
from idlc.compiler.compiler import models_of
from idlc.diagnostics.report import Report
from idlc.generate.native.library import MACHINES, inspect, libraries
from idlc.generate.native.platforms import LAYOUTS
from idlc.project.find import list_files
from idlc.project.inputs import load
from idlc.project.prefixes import Distribution
from idlc.project.root import Root
from idlc.project.settings import Scope

LIBRARY = "lib/libarm__rosidl_typesupport_cpp.so"
FIELDS = "lib/libarm__rosidl_typesupport_introspection_cpp.so"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch, capsys):
    """Work in a folder with a prefix that holds one package."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".git").mkdir()
    for path, text in {
        "arm/msg/Reach.msg": "float64 metres\nstd_msgs/Header header\n",
        "arm/srv/Wave.srv": "bool twice\n---\n",
    }.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    assert main(["gen", "arm", "--ament", "prefix"]) == 0
    capsys.readouterr()
    return tmp_path / "prefix"


@pytest.fixture
def said(capsys):
    """Return a function that checks a folder: its status, and what is wrong with each library."""

    def said(folder="prefix"):
        status = main(["check", "--ament", folder])
        lines = capsys.readouterr().out
        found = re.findall(r"\nerror\[IDL632\]: `(\w+\.so)` (.*), so C\+\+ tools", f"\n{lines}")
        return status, found

    return said


def made(machine="x86_64", layout="jazzy"):
    """Return the content of the package's library for other machines and distributions."""
    scope = Scope(Root.here())
    files = list_files(("arm",), scope.root, Report()).files
    given = load("arm", files, files[0].root, scope.root, Report())
    ((_, model),) = models_of((given,), scope, Report())
    return libraries(model, MACHINES[machine], LAYOUTS[layout])[LIBRARY.removeprefix("lib/")]


NAME = LIBRARY.removeprefix("lib/")


def test_what_is_right_is_right(said):
    assert said() == (0, [])


def test_what_is_not_in_the_index_is_not_looked_for(here, said):
    for kind in ("packages", "rosidl_interfaces"):
        (here / "share/ament_index/resource_index" / kind / "arm").unlink()
    (here / LIBRARY).unlink()
    assert said() == (2, [])


def test_the_index_is_compared_with_what_is_installed(here, capsys):
    index = here / "share/ament_index/resource_index"
    for change, expected in (
        (
            lambda: (here / "share/arm/srv/Wave.srv").unlink(),
            "lacks files that ROS 2's index lists: `srv/Wave.srv`",
        ),
        (lambda: (index / "rosidl_interfaces/arm").write_bytes(b"\xff\n/etc\n" * 99), "`/etc`"),
        (lambda: (index / "rosidl_interfaces/arm").unlink(), "`ros2 interface` cannot find them"),
        (lambda: (index / "rosidl_interfaces/only").write_text("msg/X.msg\n"), "list` fails"),
        (lambda: (index / "rosidl_interfaces/only").rename(index / "packages/nodes"), ""),
    ):
        change()
        assert main(["check", "--ament", "prefix"]) == 1
        printed = capsys.readouterr().out
        assert "error[IDL633]" in printed
        assert expected in printed


def test_a_missing_library(here, said):
    (here / LIBRARY).unlink()
    assert said() == (1, [(NAME, "is missing")])


def test_plotting_tools_alone_can_do_without(here, said):
    (here / FIELDS).unlink()
    assert said() == (0, [])


def test_a_library_that_is_out_of_date(here, said):
    (here / "share/arm/msg/Reach.msg").write_text("float32 metres\n")
    status, found = said()
    assert status == 1
    assert {why for _, why in found} == {"is out of date: `arm/msg/Reach` changed since"}


def test_a_dependency_that_changed(here, said):
    """The hash of a type has those of all that it holds in it."""
    folder = here / "share/std_msgs/msg"
    folder.mkdir(parents=True)
    (folder / "Header.msg").write_text("int8 other\n")
    assert said()[0] == 1


def test_a_type_that_is_missing(here, said):
    (here / "share/arm/srv/New.srv").write_text("---\n")
    names = "`arm/srv/New_Request`, `arm/srv/New_Response`, `arm/srv/New_Event`"
    assert (NAME, f"lacks {names}") in said()[1]


def test_another_processor(here, said, monkeypatch):
    monkeypatch.setattr("idlc.project.prefixes.machine", lambda: "x86_64")
    (here / LIBRARY).write_bytes(made(machine="aarch64"))
    assert said() == (1, [(NAME, "is for a different processor than x86_64")])


def test_another_distribution(here, said, monkeypatch):
    monkeypatch.setattr("idlc.project.prefixes.machine", lambda: "x86_64")
    for name, fits in (("jazzy", True), ("kilted", True), ("humble", False), ("lyrical", False)):
        (here / LIBRARY).write_bytes(made(layout=name))
        there = Distribution("jazzy", "for this test")
        monkeypatch.setattr("idlc.project.prefixes.distribution", lambda _, found=there: found)
        status, found = said()
        assert (status, found) == (
            (0, [])
            if fits
            else (1, [(NAME, "is for a different ROS 2 distribution than jazzy (for this test)")])
        )


def test_the_distribution_that_is_named_is_noticed(here, said, capsys, monkeypatch):
    monkeypatch.setattr("idlc.project.prefixes.machine", lambda: "x86_64")
    monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", tuple)
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    generate = ["gen", "arm", "--ament", "prefix"]
    for words, fits in ((["--distro", "humble"], False), (["--distro", "jazzy"], True)):
        assert main([*generate, *words]) == 0
        noted = "prefix` gets libraries for humble, not for jazzy" in capsys.readouterr().err
        status, found = said()
        assert (noted, status, bool(found)) == (not fits, int(not fits), not fits)
    assert main([*generate, "--distro", "lyrical"]) == 0
    capsys.readouterr()
    assert main([*generate, "--check"]) == 1
    printed = "".join(capsys.readouterr())
    for line in printed.splitlines():
        if ".so`" in line:
            assert line.endswith(".so` is out of date: it is for a different ROS 2 distribution")
    assert printed.count(".so` is out of date") == 2


def test_colcon_makes_a_prefix_for_each_package(here, said):
    install = here.parent / "install"
    install.mkdir()
    shutil.copytree(here, install / "one")
    shutil.copytree(here, install / "two")
    (install / "two" / LIBRARY).unlink()
    assert said("install") == (1, [(NAME, "is missing")])


@pytest.mark.parametrize("content", [b"", b"\x7fELF", b"\x7fELF\2\1\1" + bytes(100), b"text\n"])
def test_a_file_that_is_no_library(content, here, said):
    (here / LIBRARY).write_bytes(content)
    assert said() == (1, [(NAME, "is not a complete shared library")])


def test_a_part_of_a_library_is_no_library(here):
    whole = (here / LIBRARY).read_bytes()
    assert inspect(whole) is not None
    for size in range(0, len(whole), 61):
        assert inspect(whole[:size]) is None, size


def test_hostile_files_are_read_without_harm(here):
    whole = (here / LIBRARY).read_bytes()
    chance = random.Random(1)
    table = int.from_bytes(whole[40:48], "little")
    for _ in range(3000):
        data = bytearray(whole)
        for _ in range(chance.choice((1, 2, 8))):
            at = chance.choice((chance.randrange(64), chance.randrange(table, len(data))))
            data[at] = chance.choice((0, 1, 0x7F, 0xFF, chance.randrange(256)))
        inspect(bytes(data))


def test_a_prefix_without_interfaces_is_not_a_success(here, capsys):
    bare = here.parent / "install/bare/share/ament_index/resource_index/packages"
    bare.mkdir(parents=True)
    (bare / "bare").touch()
    for folder in ("install", "install/bare"):
        assert main(["check", "--ament", folder]) != 0
        assert f"no package with interfaces is registered in `{folder}`" in capsys.readouterr().out
    shutil.copytree(here, here.parent / "install/arm")
    assert main(["check", "--ament", "install"]) == 0
