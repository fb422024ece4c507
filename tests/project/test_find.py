"""Which files paths mean, which package they belong to, and where other packages are found."""

import os
import shutil
from contextlib import suppress
from pathlib import Path

import pytest

from idlc.compiler.requests import requested_packages
from idlc.diagnostics.report import Report, ReportedError
from idlc.model.ir import TypeName
from idlc.project.files import near_path
from idlc.project.find import find
from idlc.project.library import Library
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.project.step import meaning
from tests.support.files import write

MSG = "float64 speed\n"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", lambda: ())
    return tmp_path


def make(*paths: str, text: str = MSG) -> None:
    for path in paths:
        write(path, text)


def manifest(path: str, name: str) -> None:
    make(path, text=f"<?xml version='1.0'?>\n<package><name>{name}</name></package>\n")


def found(*paths: str) -> list[str]:
    report = Report()
    files = find(paths, Root.here(), report)
    assert not report.had_errors, [one.message for one in report]
    return [file.shown for file in files]


@pytest.mark.parametrize(
    ("path", "near"),
    [
        ("pgk", "pkg"),
        ("pgk/msg", "pkg/msg"),
        ("pkg/msg/AB.mgs", "pkg/msg/AC.msg"),
        ("pgk/./mgs//AC.msg", "pkg/msg/AC.msg"),
        ("pkg/../pgk", "pkg/../pkg"),
        ("{here}/pgk/msg/AC.msg", "{here}/pkg/msg/AC.msg"),
        ("pgk/nothing", None),
        ("nothing/msg", None),
        ("-", None),
        ("x/" * 2000, None),
    ],
)
def test_the_closest_path_is_one_that_exists(path, near, here):
    make("pkg/msg/AC.msg", "r/x.msg")
    path = path.format(here=here.as_posix())
    expected = near and f"did you mean `{near.format(here=here.as_posix())}`?"
    assert near_path(path, Path(Root.here().path(path))) == expected


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (["pkg"], ["pkg/action/C.action", "pkg/msg/A.msg", "pkg/srv/B.srv"]),
        (["pkg/"], ["pkg/action/C.action", "pkg/msg/A.msg", "pkg/srv/B.srv"]),
        (["pkg/msg"], ["pkg/msg/A.msg"]),
        (["pkg/msg/A.msg"], ["pkg/msg/A.msg"]),
        (["pkg/srv", "pkg/msg", "pkg/msg/A.msg"], ["pkg/msg/A.msg", "pkg/srv/B.srv"]),
        (["./pkg/msg", "pkg/../pkg/msg/A.msg"], ["pkg/msg/A.msg"]),
    ],
)
def test_paths_mean_files_each_once_in_order(given, expected):
    make("pkg/msg/A.msg", "pkg/srv/B.srv", "pkg/action/C.action", "pkg/msg/README.md", "pkg/x.py")
    assert found(*given) == expected


def test_folders_that_are_no_sources_are_left_out_unless_they_are_asked_for():
    make("src/msg/A.msg", "src/build/msg/B.msg", "src/install/share/p/msg/B.msg", "src/log/B.msg")
    make("src/.git/B.msg", "src/venv/share/p/msg/B.msg", "src/old/msg/B.msg", "src/msg/.B.msg")
    make("src/venv/pyvenv.cfg", "src/old/COLCON_IGNORE")
    assert found("src") == ["src/msg/A.msg"]
    assert found("src/build") == ["src/build/msg/B.msg"]
    assert found("src/old") == ["src/old/msg/B.msg"]


def test_links_to_folders_are_followed_and_circles_end():
    make("common/A.msg")
    Path("pkg").mkdir()
    Path("pkg/msg").symlink_to("../common")
    Path("common/again").symlink_to("../pkg")
    assert found("pkg") == ["pkg/msg/A.msg"]


def test_a_folder_that_is_too_deep_to_be_opened_is_reported(here, monkeypatch):
    for _ in range(200):  # longer than a path may be
        Path("d" * 40).mkdir()
        monkeypatch.chdir("d" * 40)
    monkeypatch.chdir(here)
    make("msg/A.msg")
    report = Report()
    files = find(["."], Root.here(), report)
    shutil.rmtree("d" * 40)  # other tests may search the folders of all tests
    assert [file.shown for file in files] == ["msg/A.msg"]
    assert [problem.code for problem in report] == ["IDL601"]


def one(paths: list[str], package: str | None = None, out: str = "out") -> tuple[str, list[str]]:
    report = Report()
    name = ""
    with suppress(ReportedError):
        name = requested_packages(paths, (), out, Scope(Root.here(), package), report)[0].package
    return name, [problem.code for problem in report]


def test_the_package_name_comes_from_the_option_then_package_xml_then_the_folder():
    make("ws/my_pkg/msg/A.msg", "ws/my_pkg/interfaces/B.srv")
    assert one(["ws/my_pkg"], out="gen/from_out") == ("", ["IDL608"])
    assert one(["ws/my_pkg/msg"], out="gen/from_out") == ("from_out", [])
    manifest("ws/my_pkg/package.xml", "from_xml")
    assert one(["ws/my_pkg"], out="gen/from_out") == ("from_xml", [])
    assert one(["ws/my_pkg/interfaces/B.srv"]) == ("from_xml", [])
    assert one(["ws/my_pkg"], "from_option") == ("from_option", [])


def test_a_package_xml_beyond_the_repository_does_not_count():
    manifest("package.xml", "outer")
    make("repo/.git/HEAD", "repo/pkg/msg/A.msg")
    assert one(["repo/pkg"], out="inner") == ("inner", [])


@pytest.mark.parametrize(
    ("xml", "name"),
    [
        ("<package><name>a_b</name></package>", "a_b"),
        ("<package><name>\n  a_b\n</name></package>", "a_b"),
        ("<package><name>a<!-- c -->_b</name></package>", "a_b"),
        ("<package><author><name>x</name></author><name>a_b</name></package>", "a_b"),
        ("<package><name>a_b</name><export><name>x</name></export></package>", "a_b"),
        ("<?xml version='1.0' encoding='ISO-8859-1'?><package><name>a_b</name></package>", "a_b"),
    ],
)
def test_names_in_package_xml(xml, name):
    make("pkg/msg/A.msg")
    make("pkg/package.xml", text=xml)
    assert one(["pkg"]) == (name, [])


def test_entities_in_package_xml_are_not_expanded_without_bound():
    bomb = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 20}">' for n in range(1, 20))
    text = f'<!DOCTYPE p [<!ENTITY e0 "x">{bomb}]><package><name>&e19;</name></package>'
    make("pkg/msg/A.msg")
    make("pkg/package.xml", text=text)
    assert one(["pkg"])[1] == ["IDL610"]


def library(*folders: str, **own: str) -> Library:
    return Library(
        folders, Root.here(), Report(), own={name: [Path(root)] for name, root in own.items()}
    )


def path_of(places: Library, name: str) -> str | None:
    path = places.path(TypeName.parse(name))
    return path and Path(os.path.relpath(path)).as_posix()


@pytest.mark.parametrize(
    ("folder", "file"),
    [
        ("src", "src/dep_msgs/msg/A.msg"),
        ("src/dep_msgs", "src/dep_msgs/msg/A.msg"),
        ("prefix", "prefix/share/dep_msgs/msg/A.msg"),
        ("ws", "ws/src/group/dep_msgs/msg/A.msg"),
        ("flat/dep_msgs", "flat/dep_msgs/A.msg"),
    ],
)
def test_include_folders_may_be_of_any_common_shape(folder, file):
    make(file)
    assert path_of(library(folder), "dep_msgs/msg/A") == file
    assert list(library(folder).names("dep_msgs")) == ["A"]
    assert "dep_msgs" in library(folder).packages()


def test_package_xml_names_packages_in_include_folders():
    make("src/folder/msg/A.msg")
    manifest("src/folder/package.xml", "dep_msgs")
    assert path_of(library("src"), "dep_msgs/msg/A") == "src/folder/msg/A.msg"


def test_the_first_include_folder_wins_then_prefixes_then_the_catalogue(monkeypatch):
    prefix = Path("ros").absolute()
    monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", lambda: (prefix,))
    name = TypeName.parse("std_msgs/msg/Bool")
    assert library().source(name).path.startswith("<")
    make("ros/share/std_msgs/msg/Bool.msg")
    assert library().source(name).path == "ros/share/std_msgs/msg/Bool.msg"
    make("b/std_msgs/msg/Bool.msg")
    Path("a").mkdir()
    assert library("a", "b").source(name).path == "b/std_msgs/msg/Bool.msg"
    make("a/std_msgs/msg/Bool.msg")
    assert library("a", "b").source(name).path == "a/std_msgs/msg/Bool.msg"
    assert library("a").source(TypeName.parse("std_msgs/msg/Nope")) is None


def test_an_include_folder_that_is_missing_is_reported():
    report = Report()
    Library(["missing"], Root.here(), report)
    assert [found.code for found in report] == ["IDL602"]


@pytest.mark.parametrize("name", ["../etc/msg/A", "std_msgs/msg/..", "a.b/msg/A", "-/msg/-"])
def test_names_that_would_leave_the_folder_are_not_looked_for(name):
    package, _, rest = name.rpartition("/msg/")
    make("etc/msg/A.msg", "src/etc/msg/A.msg")
    assert library("src").path(TypeName(package, "msg", rest)) is None


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("int8 a\n", "# c\n\nint8  a   # [m]\r\n", True),
        ("int8 A=1\n", "int8 A = 1  # one\n", True),
        ("int8 a 1\n", "int8 a   1\n", True),
        ("int8\ta\n", "int8 a\n", True),
        ("pkg/A a\n", "A a\n", True),
        ("pkg/A[<=3] a\n", "A[<=3] a\n", True),
        ("float32 a 0\n", "float32 a 0.0\n", True),
        ("float32 A=1e3\n", "float32 A=1000\n", True),
        ("float32 a 0\n", "float32 a 1\n", False),
        ("other/A a\n", "A a\n", False),
        ("int8 a\nint8 B=1\n", "int8 B=1\nint8 a\n", True),
        ("int8 A=1\n---\n", "---\nint8 A=1\n", False),
        ("int8 a\n---\n", "---\nint8 a\n", False),
        ("bool a true\n", "bool a True\n", True),
        ("int8 a 0\n", "int8 a=0\n", False),
        ("int8 a\n", "int16 a\n", False),
        ("string A=x  y\n", "string A=x y\n", False),
        ("int8 a\nint8 b\n", "int8 b\nint8 a\n", False),
        ("---\n", "---\n---\n", False),
        ("int8 a\n", " int8 a\n", False),
    ],
)
def test_dependencies_are_compared_by_what_they_mean(one, other, same):
    assert (meaning(one, "pkg") == meaning(other, "pkg")) is same
