"""One folder, two builds: the wheel of idlc.backend, and what rosidl made of the same files.

The packages of ROS 2 are in the wheels as CMake built them, with the sources that they were built
from.
"""

import json
import shutil
import zipfile
from pathlib import Path

import pytest

from idlc import backend
from tests.build.test_hooks import BUILD
from tests.build.test_installs import PIP, run, site
from tests.support.installed import SHARE, interfaces, names_in
from tests.support.native import FAR, both_ways
from tests.support.paths import PROGRAMS
from tests.support.sides import Side
from tests.support.waiting import LIMIT

INDEX = "share/ament_index/resource_index/rosidl_interfaces"


def wheel_of(package, folder, monkeypatch):
    """Build a package of the wheels from the sources in them."""
    source = folder / package
    ignore = shutil.ignore_patterns(
        "*.idl", "*.json", "cmake", "environment", "local_setup*", "*.dsv"
    )
    shutil.copytree(SHARE / package, source, ignore=ignore)
    (source / "pyproject.toml").write_text(BUILD)
    monkeypatch.chdir(source)
    return folder / backend.build_wheel(str(folder))


def has_source(package, path):
    """Return whether an installed file is a .msg or so, or made of one; Kilted has others."""
    beside = SHARE / package / path
    return beside.with_suffix(f".{beside.parent.name}").exists()


def test_both_builds_install_the_same_interfaces_with_the_same_hashes(tmp_path, monkeypatch):
    compared = 0
    for package in interfaces():
        with zipfile.ZipFile(wheel_of(package, tmp_path, monkeypatch)) as wheel:
            files = {name.partition(".data/data/")[2]: name for name in wheel.namelist()}
            listed = wheel.read(files[f"{INDEX}/{package}"]).decode().split()
            installed = (SHARE.parent / INDEX / package).read_text().split()
            assert listed == [path for path in installed if has_source(package, path)]
            for path in (f"share/{package}/{name}" for name in listed):
                described = f"{path.rpartition('.')[0]}.json"
                assert wheel.read(files[described]) == (SHARE.parent / described).read_bytes(), path
                if not path.endswith(".idl"):
                    assert wheel.read(files[path]) == (SHARE.parent / path).read_bytes(), path
                compared += 1
    assert compared > 200


@pytest.fixture
def sides():
    """Return a list of processes that end with the test."""
    started = []
    yield started
    for side in started:
        if side.process.poll() is None:
            side.process.kill()
            side.process.wait(LIMIT)


def test_nodes_with_either_build_talk(ros_environment, shapes, sides, tmp_path, monkeypatch):
    """Through a third, which knows of the messages what the wheels' libraries tell C++ tools."""
    packages = ("diagnostic_msgs", "std_msgs", "std_srvs")
    wheels = [wheel_of(package, tmp_path, monkeypatch) for package in packages]
    prefix = tmp_path / "prefix"
    run(*PIP, "--ignore-installed", "--prefix", prefix, *wheels, cwd=tmp_path)
    names = names_in(packages, interfaces())
    file = tmp_path / "known.json"
    known = {"names": names, "shapes": shapes[0], "topics": both_ways(names)}
    file.write_text(json.dumps(known), encoding="utf-8")
    environment = {
        **ros_environment,
        "FASTDDS_DEFAULT_PROFILES_FILE": str(PROGRAMS / "no_type_lookup.xml"),
        "AMENT_PREFIX_PATH": str(prefix),
    }
    peer, far = (PROGRAMS / "peer.py", "messages"), ("--ros-args", "--remap", f"__ns:={FAR}")
    sides.append(Side((*peer, "one", "two", file), environment, f"{PROGRAMS}:{site(prefix)}"))
    sides.append(Side((*peer, "two", "one", file, *far), environment, str(PROGRAMS)))
    sides.append(Side((PROGRAMS / "native_bridge.py", file), environment, str(PROGRAMS)))
    assert [side.ready() for side in sides] == [[f"looked at {len(names)}"]] * 3
    assert [side.finish() for side in reversed(sides)] == [[], [], []]
    assert Path(site(prefix) / "diagnostic_msgs" / "idlc.lock").is_file()
