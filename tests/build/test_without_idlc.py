"""Builds in environments without idlc install today's classes, or stop and say why."""

import importlib.util
import runpy
import shutil
import sys
from pathlib import Path

import pytest
from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.plugin.utils import load_plugin_from_script

from idlc.cli.main import main
from idlc.project.settings import toml
from idlc.scaffold.proof import Proof
from tests.support.files import write_all
from tests.support.programs import clean_environment, ended

SCAFFOLD = ["scaffold", "package", "demo", "--maintainer", "A <a@example.com>"]
FILES = {
    "msg/Drive.msg": "float64 speed\n",
    "msg/Stop.msg": "bool now\n",
    "srv/Ask.srv": "int8 a\n---\nint8 b\n",
}


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """Return a package as a user commits it, and a folder with setuptools alone."""
    folder = tmp_path_factory.mktemp("template")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(SCAFFOLD) == 0
        patch.chdir("demo")
        write_all(FILES)
        assert main(["gen"]) == 0
    borrowed = folder / "borrowed"
    borrowed.mkdir()
    setuptools = Path(importlib.util.find_spec("setuptools").origin).parents[1]
    for pattern in ("setuptools*", "pkg_resources", "_distutils_hack"):
        for path in setuptools.glob(pattern):
            (borrowed / path.name).symlink_to(path)
    return folder


@pytest.fixture
def package(template, tmp_path, monkeypatch):
    shutil.copytree(template / "demo", tmp_path / "demo")
    monkeypatch.chdir(tmp_path / "demo")
    return template


def build(template, *words):
    """Return the status and the output of a build without idlc."""
    environment = {**clean_environment(), "PYTHONPATH": str(template / "borrowed")}
    words = words or ("-q", "build", "--build-base", "build")
    return ended(sys.executable, "-S", "setup.py", *words, environment=environment, cwd=Path.cwd())


def rename(old, new):
    Path(new).parent.mkdir(parents=True, exist_ok=True)
    Path(old).rename(new)


def damage_lock():
    Path("demo/idlc.lock").write_text('{"inputs": [}')


def delete_all():
    Path(".git").mkdir()
    for folder in ("msg", "srv"):
        shutil.rmtree(folder)


def delete_all_of_a_workspace():
    Path("../.git").write_text("gitdir: elsewhere\n")  # as in a worktree or a submodule
    for path in FILES:
        Path(path).unlink()


def list_again(*lines):
    write_all({"resource/rosidl_interfaces/demo": "".join(f"{line}\n" for line in lines)})


def nothing():
    pass


#: Changes after `idlc gen`, and what the build says of each.
OUTDATED = {
    "edited": (lambda: Path("msg/Drive.msg").write_text("float32 speed\n"), "Drive.msg` changed"),
    "comment": (
        lambda: Path("srv/Ask.srv").write_text("# a\n" + FILES["srv/Ask.srv"]),
        "Ask.srv` changed",
    ),
    "deleted": (lambda: Path("msg/Stop.msg").unlink(), "`msg/Stop.msg` was removed"),
    "renamed": (lambda: rename("msg/Stop.msg", "msg/Halt.msg"), "`msg/Stop.msg` was removed"),
    "added": (lambda: write_all({"action/Go.action": "---\n---\n"}), "Go.action` was added"),
    "moved and edited": (
        lambda: write_all({"msg/more/Stop.msg": "bool soon\n", "msg/Stop.msg": "bool soon\n"}),
        "`msg/Stop.msg` changed",
    ),
    "all renamed": (
        lambda: [rename(path, f"{Path(path).parent}/X{Path(path).name}") for path in FILES],
        "`msg/Drive.msg` was removed",
    ),
    "all deleted": (delete_all, "`msg/Drive.msg` was removed"),
    "all deleted in a workspace": (delete_all_of_a_workspace, "`msg/Drive.msg` was removed"),
    "list emptied": (list_again, "`rosidl_interfaces/demo` omits `msg/Drive.msg`"),
    "list too short": (lambda: list_again(*sorted(FILES)[1:]), "/demo` omits `msg/Drive.msg`"),
    "list too long": (lambda: list_again(*FILES, "msg/Old.msg"), "/demo` lists `msg/Old.msg`"),
    "lock damaged": (damage_lock, "`demo/idlc.lock` is damaged"),
    "lock lost": (lambda: Path("demo/idlc.lock").unlink(), "`msg/Drive.msg` has no classes"),
    "classes lost": (lambda: shutil.rmtree("demo/srv"), "`srv/__init__.py` is missing"),
}


@pytest.mark.parametrize("change", OUTDATED)
def test_a_build_stops_at_classes_that_are_out_of_date(change, package):
    make, reason = OUTDATED[change]
    make()
    status, said = build(package)
    assert status == 1
    assert "error: the classes in `demo` are out of date: " in said
    assert reason in said
    assert "hint: run `idlc gen` and `idlc check --fix`" in said
    assert "Traceback" not in said
    assert not Path("build").exists()


#: What is no reason to stop.
CURRENT = {
    "nothing": nothing,
    "a list with other files": lambda: list_again(*FILES, "msg/Drive.idl", ""),
    "other line ends": lambda: Path("msg/Drive.msg").write_bytes(b"float64 speed\r\n"),
    "interfaces left out": lambda: [shutil.rmtree(folder) for folder in ("msg", "srv")],
    "interfaces of another package": lambda: write_all(
        {"nested/package.xml": "<package/>", "nested/msg/Other.msg": "bool a\n"}
    ),
    "interfaces moved": lambda: rename("srv/Ask.srv", "interfaces/srv/Ask.srv"),
    "an excluded interface": lambda: write_all(
        {"msg/Old.msg": "bad", "pyproject.toml": '[tool.idlc]\nexclude = ["Old.msg"]\n'}
    ),
    "interfaces beside the package": lambda: (
        write_all({"pyproject.toml": '[tool.idlc]\npaths = ["../all"]\n', ".git": ""}),
        [rename(path, f"../all/{path}") for path in FILES],
    ),
    "results of a build": lambda: write_all({"build/x/msg/Drive.msg": "int8 a\n"}),
}


@pytest.mark.parametrize("change", CURRENT)
def test_a_build_installs_current_classes(change, package):
    CURRENT[change]()
    status, said = build(package)
    assert status == 0, said
    assert "Unknown distribution option" not in said
    assert Path("build/lib/demo/msg/_drive.py").is_file()


def test_what_is_gone_is_not_built_again(package):
    assert build(package)[0] == 0
    assert Path("build/lib/demo/srv/_ask.py").is_file()
    Path("build/lib/demo/of_users.py").write_text("")
    Path("srv/Ask.srv").unlink()
    Path("msg/Stop.msg").unlink()
    assert main(["gen"]) == 0
    assert build(package)[0] == 0
    assert not Path("build/lib/demo/srv").exists()
    assert not Path("build/lib/demo/msg/_stop.py").exists()
    assert Path("build/lib/demo/msg/_drive.py").is_file()
    assert Path("build/lib/demo/of_users.py").is_file()


def test_interfaces_that_are_gone_are_not_installed_again(package, tmp_path):
    prefix = tmp_path / "prefix"
    words = ("-q", "install_data", "--install-dir", str(prefix))
    assert build(package, *words)[0] == 0
    rename("msg/Stop.msg", "msg/Halt.msg")
    Path("srv/Ask.srv").unlink()
    (prefix / "share/demo/msg/of_users.txt").write_text("")
    assert main(["gen"]) == 0
    Path("msg/Stop.msg").symlink_to("nowhere")  # as `colcon build --symlink-install` leaves it
    status, said = build(package, *words)
    assert status == 0, said
    names = {path.name for path in (prefix / "share/demo").rglob("*") if path.is_file()}
    installed = {"package.xml", "demo_launch.py", "Drive.msg", "Halt.msg", "of_users.txt"}
    assert names == installed
    for folder in ("msg", "srv"):  # as on a robot
        shutil.rmtree(folder)
    assert build(package, *words)[0] == 0
    assert (prefix / "share/demo/msg/Drive.msg").is_file()


def test_questions_about_a_package_are_answered(package):
    Path("msg/Drive.msg").write_text("float32 speed\n")
    status, said = build(package, "--version")
    assert (status, said.strip()) == (0, "0.1.0")
    assert build(package, "--help-commands")[0] == 0


def test_a_new_package_is_built_before_it_has_interfaces(package):
    for folder in ("msg", "srv", "demo/msg", "demo/srv", "demo/_idlc"):
        shutil.rmtree(folder)
    Path("demo/idlc.lock").unlink()
    assert build(package)[0] == 0
    write_all({"msg/First.msg": "bool a\n"})
    status, said = build(package)
    assert status == 1
    assert "`msg/First.msg` has no classes" in said


PROJECT = """
[project]
name = "trackkit"
version = "1.0"
{settings}
[build-system]
requires = ["{requires}"]
build-backend = "{backend}"

[tool.idlc]
paths = {paths}
out = "src/trackkit/ros"
package = "track_msgs"
"""
#: What runs in a build: setup.py, and the hooks that other tools' settings name.
BACKENDS = {
    "setuptools": "setuptools.build_meta",
    "hatchling": "hatchling.build",
    "pdm-backend": "pdm.backend",
}
#: Where a library has its interfaces, and a change of them.
LIBRARIES = {
    "nothing": ("interfaces", nothing, ""),
    "edited": (
        "interfaces",
        lambda: Path("interfaces/msg/Track.msg").write_text("int8 a\n"),
        "`msg/Track.msg` changed",
    ),
    "added": (
        "interfaces",
        lambda: write_all({"interfaces/msg/More.msg": "int8 a\n"}),
        "`msg/More.msg` was added",
    ),
    "deleted": (
        "interfaces",
        lambda: (Path(".git").mkdir(), Path("interfaces/msg/Track.msg").unlink()),
        "`msg/Track.msg` was removed",
    ),
    "not cloned": (
        "interfaces",
        lambda: (
            write_all({".gitmodules": "", ".git": ""}),
            Path("interfaces/msg/Track.msg").unlink(),
        ),
        "",
    ),
    "edited in another package": (
        "../track_msgs",
        lambda: Path("../track_msgs/msg/Track.msg").write_text("int8 a\n"),
        "`msg/Track.msg` changed",
    ),
    "another project around the classes": (
        "interfaces",
        lambda: write_all({"src/pyproject.toml": "", ".git": ""}),
        "",
    ),
    "another package beside it": (
        "interfaces/msg/Track.msg",
        lambda: write_all({"track_msgs/package.xml": "", "track_msgs/msg/Track.msg": "int8 a\n"}),
        "",
    ),
}


@pytest.fixture(scope="module", params=BACKENDS)
def library(request, template, tmp_path_factory):
    """Return the tool that builds a library as `idlc init` sets it up, and where that is."""
    folder, tool = tmp_path_factory.mktemp("library") / "trackkit", request.param
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("idlc.cli.run.init.prove", lambda *_: Proof(""))
        patch.setattr("idlc.cli.run.init.installed_files", lambda *_: frozenset())
        folder.mkdir()
        patch.chdir(folder)
        settings = "" if tool == "setuptools" else "[tool.hatch.build]\n[tool.pdm.build]\n"
        names = {"requires": tool, "backend": BACKENDS[tool], "settings": settings}
        project = PROJECT.format(**names, paths='["interfaces"]')
        files = {"src/trackkit/__init__.py": "", "interfaces/msg/Track.msg": "int8 b\n"}
        write_all({**files, "pyproject.toml": project})
        assert main(["init", "--yes"]) == 0
    return tool, folder


def run_hook(tool, template):
    """Run in a process what a build of the library runs; return the error."""
    settings = toml(Path("pyproject.toml").read_text())["tool"]
    if tool == "setuptools":
        return build(template)[1]
    try:
        if tool == "hatchling":
            path = settings["hatch"]["build"]["hooks"]["custom"]["path"]
            hook = load_plugin_from_script(path, path, BuildHookInterface, "build_hook")
            hook("", {}, None, None, "", "wheel").initialize("standard", {})
        else:
            path = settings["pdm"]["build"]["custom-hook"]
            runpy.run_path(path, run_name="_local")["pdm_build_initialize"](None)
    except SystemExit as error:
        return str(error)
    return ""


@pytest.mark.parametrize("change", LIBRARIES)
def test_a_library_stops_builds_of_classes_that_are_out_of_date(
    change, library, template, tmp_path, monkeypatch
):
    tool, folder = library
    paths, make, reason = LIBRARIES[change]
    shutil.copytree(folder, tmp_path / "trackkit")
    monkeypatch.chdir(tmp_path / "trackkit")
    if paths.startswith(".."):
        shutil.move("interfaces", paths)
        write_all({f"{paths}/package.xml": ""})
    settings = Path("pyproject.toml").read_text().replace('["interfaces"]', f"['{paths}']")
    Path("pyproject.toml").write_text(settings)
    make()
    said = run_hook(tool, template)
    assert reason in said
    assert ("the classes in `src/trackkit/ros` are out of date" in said) == bool(reason)


@pytest.fixture(scope="module")
def siblings(template, tmp_path_factory):
    """Return a workspace of a package and one that uses its types, as `idlc init` sets them up."""
    folder = tmp_path_factory.mktemp("siblings")
    files = {
        "poses/msg/Unit.msg": "uint8 METRES=1\nuint8 unit\n",
        "poses/msg/Pose.msg": "float64 x\nUnit unit\n",
        "tracks/msg/Track.msg": "poses/Pose p\n",
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("idlc.cli.run.init.prove", lambda *_: Proof(""))
        patch.setattr("idlc.cli.run.init.installed_files", lambda *_: frozenset())
        patch.chdir(folder)
        for name in ("poses", "tracks"):
            assert main(["scaffold", "package", name, "--maintainer", "A <a@example.com>"]) == 0
        write_all(files)
        for name in ("poses", "tracks"):
            patch.chdir(folder / name)
            assert main(["init", "--yes"]) == 0
    assert 'include = ["../poses"]' in (folder / "tracks/pyproject.toml").read_text()
    return folder


def include(path):
    settings = Path("pyproject.toml").read_text().replace('"../poses"', path)
    Path("pyproject.toml").write_text(settings)


def link_sibling():
    rename("../poses", "../../elsewhere/poses")
    Path("../poses").symlink_to("../elsewhere/poses")


def edit_sibling():
    Path("../poses/msg/Pose.msg").write_text("float32 x\nUnit unit\n")


#: Changes of a package beside, and what a build of one that uses its types says.
SIBLINGS = {
    "nothing": (nothing, ""),
    "edited": (edit_sibling, "`poses/msg/Pose.msg` changed"),
    "edited, used through another": (
        lambda: Path("../poses/msg/Unit.msg").write_text("uint16 unit\n"),
        "`poses/msg/Unit.msg` changed",
    ),
    "a comment": (
        lambda: Path("../poses/msg/Pose.msg").write_text("# a\nfloat64   x\nposes/Unit unit\n"),
        "",
    ),
    "one that is not used": (lambda: write_all({"../poses/msg/Other.msg": "int8 a\n"}), ""),
    "renamed": (
        lambda: rename("../poses/msg/Pose.msg", "../poses/msg/Place.msg"),
        "`poses/msg/Pose.msg` was removed",
    ),
    "absent": (lambda: shutil.rmtree("../poses"), ""),
    "its interfaces left out": (lambda: shutil.rmtree("../poses/msg"), ""),
    "a folder around it": (lambda: (include('".."'), edit_sibling()), "Pose.msg` changed"),
    "a link to it": (lambda: (link_sibling(), edit_sibling()), "Pose.msg` changed"),
    "a link in a folder around it": (
        lambda: (link_sibling(), include('".."'), edit_sibling()),
        "Pose.msg` changed",
    ),
    "in a folder of another name": (
        lambda: (rename("../poses", "../p"), include('"../p"'), rename("../p/msg", "../p/all")),
        "",
    ),
    "without a package.xml": (
        lambda: (Path("../poses/package.xml").unlink(), edit_sibling()),
        "Pose.msg` changed",
    ),
    "another version beside it": (
        lambda: (shutil.copytree("../poses", "../old"), edit_sibling(), include('"../old", ".."')),
        "",
    ),
}


@pytest.mark.parametrize("change", SIBLINGS)
def test_a_build_stops_at_classes_that_use_earlier_types_of_a_sibling(
    change, siblings, template, tmp_path, monkeypatch
):
    make, reason = SIBLINGS[change]
    shutil.copytree(siblings, tmp_path / "src")
    monkeypatch.chdir(tmp_path / "src/tracks")
    make()
    status, said = build(template)
    assert (status == 1) == bool(reason), said
    assert reason in said
    assert "Traceback" not in said
    if reason.endswith("changed"):
        assert main(["gen"]) == 0
        assert build(template)[0] == 0
