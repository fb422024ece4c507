"""`idlc gen --ament PREFIX`: a prefix that packages share, whatever happens to a run."""

import errno
import os
import shutil
import signal
import subprocess
import sys

import pytest

from idlc.cli.main import main
from idlc.diagnostics.codes import CANNOT_WRITE
from idlc.project.prefixes import Distribution
from tests.support.machine import running, tree
from tests.support.waiting import LIMIT

OLD = {"msg/A.msg": "int8 a\n", "srv/Gone.srv": "---\n"}
NEW = {"msg/A.msg": "int16 a\n", "msg/B.msg": "A a\nbuiltin_interfaces/Time time\n"}
WORDS = ["gen", "pkg", "--ament", "out"]
LIBRARY = "lib/lib{}__rosidl_typesupport_cpp.so"
INDEX = "share/ament_index/resource_index"


@pytest.fixture
def idlc(tmp_path, monkeypatch, capsys):
    """Return a function that runs idlc in an empty folder: it returns status and output."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".git").mkdir()

    def idlc(*words):
        status = main(list(words))
        return status, "".join(capsys.readouterr())

    return idlc


def write(folder, **files):
    """Write the messages of a package."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "msg").mkdir(parents=True)
    for name, text in files.items():
        (folder / "msg" / f"{name}.msg").write_text(text)


def test_it_holds_what_rosidl_installs(idlc, tmp_path):
    write(tmp_path / "arm", Reach="float64 metres\nstd_msgs/Header header\n")
    assert idlc("gen", "arm", "--ament", "out")[0] == 0
    found = tree(tmp_path / "out")
    modules = {path for path in found if "/site-packages/arm/" in path}
    assert any(path.endswith("/msg/_reach.py") for path in modules)
    assert found.keys() - modules == {
        *("lib/libarm__rosidl_typesupport_cpp.so",),
        *("lib/libarm__rosidl_typesupport_introspection_cpp.so",),
        *(f"share/arm/msg/Reach.{kind}" for kind in ("msg", "idl", "json")),
        *("share/arm/package.xml", "share/arm/idlc.lock"),
        *(f"{INDEX}/{name}/arm" for name in ("packages", "package_run_dependencies")),
        f"{INDEX}/rosidl_interfaces/arm",
        *(f"{name}setup.{shell}" for name in ("", "local_") for shell in ("sh", "bash", "zsh")),
    }
    assert found[f"{INDEX}/rosidl_interfaces/arm"].split() == [b"msg/Reach.idl", b"msg/Reach.msg"]
    assert found[f"{INDEX}/package_run_dependencies/arm"] == b"builtin_interfaces;std_msgs"
    assert b"<depend>std_msgs</depend>" in found["share/arm/package.xml"]


def test_packages_share_it_in_any_order(idlc, tmp_path):
    write(tmp_path / "arm", Reach="float64 metres\n")
    write(tmp_path / "leg", Step="arm/Reach reach\n")
    (tmp_path / "leg" / "package.xml").write_text(
        "<package><name>leg</name><!-- mine --></package>"
    )
    assert idlc("gen", "arm", "--ament", "first")[0] == 0
    assert idlc("gen", "leg", "-I", "arm", "--ament", "first")[0] == 0
    assert idlc("gen", "arm", "leg", "--ament", "second")[0] == 0
    assert idlc("gen", "leg", "-I", ".", "--ament", "third", "--vendor-deps")[0] == 0
    first, second, third = ({**tree(tmp_path / name)} for name in ("first", "second", "third"))
    assert b"<!-- mine -->" in first["share/leg/package.xml"]
    for found, name in ((first, b"first"), (second, b"second"), (third, b"third")):
        for path in ("setup.sh", "local_setup.sh"):
            found[path] = found[path].replace(name, b"")
        for package in ("arm", "leg"):
            del found[f"share/{package}/idlc.lock"]
    assert first == second == third


def test_what_others_wrote_stays(idlc, tmp_path):
    write(tmp_path / "arm", Reach="float64 metres\n", Wave="")
    write(tmp_path / "leg", Step="float64 metres\n")
    out = tmp_path / "out"
    assert idlc("gen", "arm", "leg", "--ament", "out")[0] == 0
    mine = {".hidden": "1", "lib/libmine.so": "2", "share/arm/mine.txt": "3", "setup.bash": "4"}
    for path, text in mine.items():
        (out / path).write_text(text)
    write(tmp_path / "arm", Reach="float64 metres\n")
    leg = {path: data for path, data in tree(out).items() if "leg" in path}
    status, said = idlc("gen", "arm", "--ament", "out")
    assert status == 0
    assert "`out/setup.bash` was not written by idlc" in said
    found = tree(out)
    assert not [path for path in found if "wave" in path.lower()]
    assert {path: found[path].decode() for path in mine} == mine
    assert {path: data for path, data in found.items() if "leg" in path} == leg
    (out / "lib/libarm__rosidl_typesupport_cpp.so").write_text("mine")
    status, said = idlc("gen", "arm", "--ament", "out")
    assert (status, "IDL613" in said) == (1, True)
    assert (out / "lib/libarm__rosidl_typesupport_cpp.so").read_text() == "mine"


def test_check_tells_what_is_out_of_date(idlc, tmp_path):
    write(tmp_path / "arm", Reach="float64 metres\n")
    assert idlc("gen", "arm", "--ament", "out", "--check")[0] == 1
    assert idlc("gen", "arm", "--ament", "out")[0] == 0
    assert idlc("gen", "arm", "--ament", "out", "--check")[0] == 0
    write(tmp_path / "arm", Reach="float32 metres\n")
    before = tree(tmp_path / "out")
    status, said = idlc("gen", "arm", "--ament", "out", "--check")
    assert status == 1
    assert "`out/lib/libarm__rosidl_typesupport_cpp.so` is out of date" in said
    assert tree(tmp_path / "out") == before


def test_what_has_the_library_open_goes_on_with_it(idlc, tmp_path):
    write(tmp_path / "arm", Reach="float64 metres\n")
    library = tmp_path / "out" / LIBRARY.format("arm")
    idlc("gen", "arm", "--ament", "out")
    with library.open("rb") as opened:
        old = library.read_bytes()
        write(tmp_path / "arm", Reach="float32 metres\n")
        idlc("gen", "arm", "--ament", "out")
        assert library.read_bytes() != old == opened.read()


def test_a_named_type_brings_its_whole_package(idlc, tmp_path):
    """The prefix hides others: a library without the other types would stop recorders there."""
    assert idlc("gen", "std_msgs/msg/Empty", "--ament", "out")[0] == 0
    library = (tmp_path / "out" / LIBRARY.format("std_msgs")).read_bytes()
    assert b"__std_msgs__msg__String\0" in library


def test_both_an_out_and_a_prefix(idlc, tmp_path):
    write(tmp_path / "interfaces", Reach="float64 metres\n")
    assert idlc("gen", "interfaces", "--ament", "out", "-o", "code/arm")[0] == 0
    assert (tmp_path / "out" / LIBRARY.format("arm")).is_file()
    assert (tmp_path / "code" / "arm" / "msg" / "_reach.py").is_file()


@pytest.mark.parametrize("missing", ["processor", "distribution"])
def test_without_a_library_it_is_not_in_the_index(missing, idlc, tmp_path, monkeypatch):
    write(tmp_path / "arm", Reach="float64 metres\n")
    assert idlc("gen", "arm", "--ament", "out")[0] == 0
    assert (tmp_path / "out" / INDEX / "packages" / "arm").is_file()
    if missing == "processor":
        monkeypatch.setattr("idlc.project.prefixes.machine", lambda: "riscv64")
    else:
        strange = Distribution("", "rosidl 9.9 in /opt/ros/zazzy")
        monkeypatch.setattr("idlc.generate.prefix.distribution", lambda _: strange)
    status, said = idlc("gen", "arm", "--ament", "out")
    assert status == 0
    assert "idlc does not add `arm` to ROS 2's index" in said
    assert "zazzy" in said or "Linux on x86_64 and aarch64" in said
    for kind in ("packages", "rosidl_interfaces"):
        assert not (tmp_path / "out" / INDEX / kind / "arm").exists()
    assert not (tmp_path / "out" / LIBRARY.format("arm")).exists()


@pytest.mark.parametrize("shell", ["sh", "bash", "zsh"])
def test_a_shell_only_ever_sees_a_path(shell, idlc, tmp_path):
    if not shutil.which(shell):
        pytest.skip(f"no {shell}")
    name = "a '$(touch x)`touch y`\"{{ z }}}"
    write(tmp_path / "arm", Reach="float64 metres\n")
    assert idlc("gen", "arm", "--ament", name)[0] == 0
    line = '. "$1" && printf "%s\\n" "$AMENT_PREFIX_PATH" "$PYTHONPATH"'
    for before in ("", "/opt/ros/jazzy"):
        environment = {**os.environ, "AMENT_PREFIX_PATH": before, "PYTHONPATH": before}
        command = [shell, "-euc", f"{line}; {line}", shell, f"{tmp_path}/{name}/setup.{shell}"]
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=True, cwd=tmp_path
        )
        rest = f":{before}" if before else ""
        prefix, modules, *again = done.stdout.splitlines()
        assert prefix == f"{tmp_path}/{name}{rest}"
        assert modules.startswith(f"{tmp_path}/{name}/lib/python3")
        assert modules.endswith(f"/site-packages{rest}")
        assert again == [prefix, modules]
        assert not done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {".git", "arm", name}


@pytest.fixture(scope="module")
def machine():
    with running() as found:
        yield found


@pytest.fixture(scope="module")
def versions(machine, tmp_path_factory):
    """Return the folders of the old and the new output as they should be."""
    folder = tmp_path_factory.mktemp("versions")
    for name, files in (("old", OLD), ("new", NEW)):
        machine.reset(None)
        machine.write(files)
        assert machine.run(WORDS)["status"] == 0
        shutil.copytree(machine.folder / "out", folder / name)
    return folder / "old", folder / "new"


def test_killed_at_any_write(machine, versions):
    old, new = map(tree, versions)
    machine.reset(versions[0])
    points = machine.run(WORDS)["points"]
    assert points > 30
    for point in sorted({*range(1, points + 1, 7), *range(points - 5, points + 1)}):
        machine.reset(versions[0])
        assert machine.run(WORDS, point=point, torn=True)["status"] == -signal.SIGKILL
        for path, data in machine.tree.items():
            known = (old.get(path), new.get(path))
            assert data in known or path.endswith("idlc.lock"), f"{path} at write {point}"
        assert machine.run(WORDS)["status"] == 0
        assert machine.tree == new
        assert not list((machine.folder / "out").rglob(".idlc-stage-*"))


def test_a_full_disk_changes_nothing(machine, versions):
    old, new = map(tree, versions)
    machine.reset(versions[0])
    points = machine.run(WORDS)["points"]
    for point in range(1, points + 1, 7):
        machine.reset(versions[0])
        found = machine.run(WORDS, point=point, error=errno.ENOSPC)
        if found["status"]:
            assert CANNOT_WRITE.id in found["said"]
            left = machine.tree
            assert left == old or "restoring the old files failed, too" in found["said"]
            for path, data in left.items():
                known = (old.get(path), new.get(path))
                assert data in known or path.endswith("idlc.lock")
        assert machine.run(WORDS)["status"] == 0
        assert machine.tree == new
    machine.reset(versions[0])
    assert machine.run(WORDS, size=3000)["status"] == 2
    assert machine.tree == old


def test_runs_at_the_same_time(tmp_path):
    names = [f"part{number}" for number in range(4)]
    for name in names:
        write(tmp_path / name, Reach="float64 metres\n")
    command = [sys.executable, "-m", "idlc", "gen", "--ament", "out"]
    runs = [subprocess.Popen([*command, name], cwd=tmp_path, env=os.environ) for name in names]
    assert [run.wait(LIMIT) for run in runs] == [0] * len(names)
    found = tree(tmp_path / "out")
    for name in names:
        assert LIBRARY.format(name) in found
        assert f"share/{name}/idlc.lock" in found
