"""`idlc doctor`, in environments that are made good and bad."""

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.project import prefixes

HERE = Path(sys.executable).parent
MODULES = prefixes.modules_folder()


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path, monkeypatch):
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")


def findings(words=(), **environment):
    """Return what is good and what has a hint, each as pairs of subject and text or hint."""
    path = os.pathsep.join((str(HERE), os.environ["PATH"]))
    result = subprocess.run(
        [sys.executable, "-m", "idlc", "doctor", *words, "--format", "json"],
        env={**os.environ, "PATH": path, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert all(line["good"] == (not line["hint"]) for line in lines)
    good = [(line["type"], line["text"]) for line in lines if line["good"]]
    return good, [(line["type"], line["text"], line["hint"]) for line in lines if not line["good"]]


def test_a_good_environment_has_no_hint():
    good, bad = findings(ROS_DISTRO="", RMW_IMPLEMENTATION="", AMENT_PREFIX_PATH="")
    assert bad == []
    assert {"idlc", "command", "editors", "python", "ros"} <= {subject for subject, _ in good}


def test_another_program_of_the_name_comes_first():
    other = Path("other/idlc")
    other.parent.mkdir()
    other.write_text("#!/bin/sh\n")
    other.chmod(0o755)
    path = os.pathsep.join((str(other.parent.resolve()), str(HERE), "/usr/bin", "/bin"))
    _, bad = findings(PATH=path)
    ((text, hint),) = [(text, hint) for subject, text, hint in bad if subject == "command"]
    assert str(other) in text
    assert hint == "run this idlc as `rosidlc`"


def test_neither_name_is_on_path():
    _, bad = findings(PATH="/usr/bin:/bin")
    assert [subject for subject, _, _ in bad[:2]] == ["command", "editors"]
    assert "-m idlc" in bad[0][2]


def test_ros_is_not_what_the_environment_says():
    installed = prefixes.distribution(()).name
    other = "humble" if installed != "humble" else "jazzy"
    nowhere = str(Path("nowhere").resolve())
    _, bad = findings(ROS_DISTRO=other, AMENT_PREFIX_PATH=nowhere)
    subjects = [subject for subject, _, _ in bad]
    assert "prefix" in subjects
    # without ROS 2, ROS_DISTRO decides
    assert ("ros" in subjects) == prefixes.runs_nodes()


@pytest.mark.skipif(not prefixes.runs_nodes(), reason="needs rclpy")
def test_the_middleware_is_not_installed():
    _, bad = findings(RMW_IMPLEMENTATION="rmw_nonesuch_cpp", ROS_DISTRO="")
    ((_, text, hint),) = bad
    assert text == "rmw_nonesuch_cpp, which is not installed"
    assert "export RMW_IMPLEMENTATION=rmw_" in hint


def package(name="demo", text="float64 speed\n"):
    Path(name, "msg").mkdir(parents=True, exist_ok=True)
    Path(name, "package.xml").write_text(f"<package><name>{name}</name></package>\n")
    Path(name, "msg", "A.msg").write_text(text)


def test_packages_that_are_stale_or_installed_from_other_files(capsys):
    package()
    assert main(["gen", "demo", "-o", "demo/demo"]) == 0
    site = Path("../site").resolve()
    assert main(["gen", "demo", "-o", str(site / "demo")]) == 0
    _, bad = findings(PYTHONPATH=str(site))
    assert bad == []
    package(text="float64 speed\nfloat64 more\n")
    _, bad = findings(PYTHONPATH=str(site))
    assert [subject for subject, _, _ in bad] == ["package", "package"]
    assert "out of date" in bad[0][1]
    assert bad[1][2] == "build and install it again"
    words = bad[0][2].removeprefix("run `idlc ").removesuffix("`").split()
    assert main(words) == 0
    capsys.readouterr()
    _, bad = findings(PYTHONPATH=str(site))
    assert [subject for subject, _, _ in bad] == ["package"]


def test_a_package_that_colcon_installed_from_other_files():
    package()
    assert main(["gen", "demo", "--ament", "install/demo"]) == 0
    (lock,) = Path("install").rglob("idlc.lock")
    lock.unlink()  # setuptools installs none
    prefix = str(Path("install/demo").resolve())
    python = str(next(Path("install").resolve().glob("*/lib/*/*-packages")))
    good, bad = findings(AMENT_PREFIX_PATH=prefix, PYTHONPATH=python)
    assert bad == []
    assert ("package", f"demo in {prefix}/share/demo has these interfaces") in good
    assert ("prefix", f"{prefix}: 1 package with interfaces") in good
    package(text="float64 speed\nfloat64 more\n")
    _, bad = findings(AMENT_PREFIX_PATH=prefix, PYTHONPATH=python)
    text = f"demo in {prefix}/share/demo was built from different interface files"
    assert bad == [("package", text, "build and install it again")]


def test_prefixes_that_hide_one_another_or_are_incomplete():
    package()
    names = ("../first", "../the second")
    for prefix in names:
        assert main(["gen", "demo", "--ament", prefix]) == 0
    both = os.pathsep.join(str(Path(name).resolve()) for name in names)
    python = os.pathsep.join(str(Path(name, MODULES).resolve()) for name in names)
    good, bad = findings(AMENT_PREFIX_PATH=both, PYTHONPATH=python)
    assert bad == []
    assert any("demo in" in text and "hides" in text for _, text in good)
    for library in Path("../the second/lib").glob("*.so"):
        library.write_bytes(b"")
    _, bad = findings(AMENT_PREFIX_PATH=both, PYTHONPATH=python)
    assert prefixes.machine() == "" or [subject for subject, _, _ in bad] == ["prefix"]
    for _, _, hint in bad:
        assert main(shlex.split(hint.split("`")[1])[1:]) == 1


def colcon_package(path="ws/src/demo", *, is_python=True):
    """Write a package into a workspace, and return its folder."""
    name = Path(path).name
    package(path)
    built = "<export><build_type>ament_python</build_type></export>" if is_python else ""
    text = f"<package format='3'><name>{name}</name>{built}</package>\n"
    Path(path, "package.xml").write_text(text)
    if is_python:
        Path(path, "setup.py").write_text("from setuptools import setup\n")
    return Path(path).resolve()


def install(prefix, name="demo", modules=MODULES):
    """Install a package as colcon does, and return what Python searches."""
    folder = Path(prefix, modules, name, "msg")
    folder.mkdir(parents=True)
    for place in (folder, folder.parent):
        (place / "__init__.py").write_text("raise SystemExit('it ran')\n")
    Path(prefix, "share", name, "msg").mkdir(parents=True)
    shutil.copy(f"ws/src/{name}/msg/A.msg", f"{prefix}/share/{name}/msg/A.msg")
    if Path("ws/install").is_dir():
        Path("ws/install/setup.bash").write_text("")
    return str(Path(prefix, modules).resolve())


def of_packages(**environment):
    _, bad = findings(**environment)
    return [(text, hint) for subject, text, hint in bad if subject == "package"]


def test_packages_that_python_does_not_find(monkeypatch):
    home = colcon_package()
    [(ungenerated, hint), (unbuilt, advice)] = of_packages()
    assert ungenerated == "demo has no classes for its .msg files"
    assert hint == "`idlc gen ws/src/demo` writes them"
    assert main(shlex.split(hint.split("`")[1])[1:]) == 0
    assert of_packages() == [(unbuilt, advice)]
    assert unbuilt == "demo is not built, so Python cannot import it"
    assert "`colcon build --packages-select demo`" in advice
    assert "`pip install -e ws/src/demo`" in advice
    path = install("ws/install/demo")
    prefix = Path("ws/install/demo").resolve()
    ((unsourced, source),) = of_packages()
    assert unsourced == f"demo is built in {prefix}, but not sourced, so Python cannot import it"
    assert source == f"`source {prefix.parent}/setup.bash`"
    ((half, _),) = of_packages(AMENT_PREFIX_PATH=str(prefix))
    assert half == f"demo is in {prefix}, which is on AMENT_PREFIX_PATH, but not on PYTHONPATH"
    assert of_packages(AMENT_PREFIX_PATH=str(prefix), PYTHONPATH=path) == []
    # a merged installation, and a working folder that only `python -m` searches
    monkeypatch.chdir(home)
    shutil.move("../../install/demo/share", "../../install/share")
    shutil.move("../../install/demo/lib", "../../install/lib")
    ((unsourced, _),) = of_packages()
    assert f"demo is built in {prefix.parent}, but not sourced" in unsourced


@pytest.mark.parametrize("is_python", [True, False])
def test_packages_that_another_copy_hides(is_python):
    home = colcon_package(is_python=is_python)
    if is_python:
        assert main(["gen", str(home)]) == 0
    own = install("ws/install/demo")
    other = install("../elsewhere")
    assert of_packages(PYTHONPATH=own) == []
    assert of_packages(PYTHONPATH=os.pathsep.join((own, other))) == []
    ((text, hint),) = of_packages(PYTHONPATH=os.pathsep.join((other, own)))
    assert text == f"demo in {other}/demo hides the package in {own}/demo"
    assert hint == f"uninstall the other copy, or put {own} before it on PYTHONPATH"
    shutil.rmtree(f"{own}/demo/msg")
    ((text, hint),) = of_packages(PYTHONPATH=own)
    assert text == f"Python finds demo in {own}/demo, which has no `demo.msg`"


def test_packages_of_another_python():
    colcon_package(is_python=False)
    install("ws/install/demo", modules="lib/python3.2/site-packages")
    ((text, _),) = of_packages()
    python = f"python{sys.version_info.major}.{sys.version_info.minor}"
    prefix = Path("ws/install/demo").resolve()
    assert text == f"demo in {prefix} is for python3.2, and this is {python}"
    shutil.rmtree(prefix)
    path = install("ws/install/demo")
    Path(path, "demo/demo_s__rosidl_typesupport_c.cpython-32-x86_64-linux-gnu.so").write_text("")
    ((text, _),) = of_packages(PYTHONPATH=path)
    assert text.startswith(f"demo in {path}/demo was built with cpython-32, and this is cpython-3")


def test_people_read_one_line_for_each(capsys):
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(line.startswith(("ok    ", "warn  ", "      ")) for line in lines)


@pytest.mark.parametrize("text", ["[tool.idlc\n", "[tool.idlc]\npaths = 3\n"])
def test_broken_settings_do_not_hide_the_rest(text, capsys):
    Path("pyproject.toml").write_text(text)
    assert main(["doctor"]) == 2
    printed = capsys.readouterr()
    assert "error[IDL611]: " in printed.err
    assert "\nok    python " in printed.out
