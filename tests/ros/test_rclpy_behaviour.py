"""idlc's classes on the real rclpy: what its users, and their mistakes, do to it.

Each behaviour runs in a process of its own, because it might crash it.
"""

import json
import os
import shutil
import signal
import sys
import sysconfig
import time
from pathlib import Path

import pytest

from tests.support import generated
from tests.support.installed import SHARE, generate
from tests.support.paths import ROOT
from tests.support.waiting import WORK, read_line

QUIET = [
    "nothing_is_loaded_before_rclpy_asks",
    "rclpy_accepts_the_classes",
    "raw_latched_and_waited_for",
    "readers_take_raw_messages",
    "wrong_values_raise_where_they_are_published",
    "garbage_is_dropped",
    "received_garbage_is_dropped",
    "many_threads",
    "large_arrays_of_every_type",
    "arrays_that_another_thread_changes",
    "ends_with_messages_pending",
]


@pytest.fixture(scope="module")
def classes(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("classes")
    for package in ("std_msgs", "std_srvs"):
        generate(SHARE / package, folder / package)
    return folder


@pytest.fixture
def start(classes, program):
    """Start a behaviour."""

    def begin(*words, path=classes):
        return program("behaviour.py", *words, path=path)

    return begin


def finish(process):
    """Return what a behaviour printed; fail with what it complained about."""
    out, complaints = process.communicate(timeout=WORK)  # some send many messages
    assert process.returncode == 0, f"{process.returncode}: {complaints}"
    return out, complaints


@pytest.mark.parametrize("behaviour", QUIET)
def test_behaviour(behaviour, start):
    assert finish(start(behaviour)) == ("", "")


@pytest.fixture(scope="module")
def light(tmp_path_factory) -> str:
    """The same packages with `runtime = "installed"`, and a folder that has the runtime."""
    folder = tmp_path_factory.mktemp("light")
    (folder / "pyproject.toml").write_text('[tool.idlc]\nruntime = "installed"\n', encoding="utf-8")
    for package in ("std_msgs", "std_srvs"):
        generate(SHARE / package, folder / package, cwd=folder)
    return f"{folder}{os.pathsep}{ROOT / 'maintenance/runtime'}"


@pytest.mark.parametrize(
    "behaviour",
    [
        "rclpy_accepts_the_classes",
        "raw_latched_and_waited_for",
        "readers_take_raw_messages",
        "many_threads",
    ],
)
def test_behaviour_with_an_installed_runtime(behaviour, start, light):
    assert finish(start(behaviour, path=light)) == ("", "")


def test_the_type_description_with_an_installed_runtime(start, light):
    response = json.loads(finish(start("tells_its_type_description", path=light))[0])
    assert response["successful"], response


@pytest.mark.parametrize(
    "behaviour",
    ["wrong_values_raise_where_they_are_published", "garbage_is_dropped", "many_threads"],
)
def test_behaviour_without_machine_code(behaviour, start):
    assert finish(start("without_machine_code", behaviour)) == ("", "")


@pytest.mark.long
def test_memory_stays_flat(start):
    assert finish(start("memory_stays_flat", "200000")) == ("", "")


@pytest.mark.long
def test_memory_stays_flat_in_services(start):
    assert finish(start("memory_stays_flat_in_services", "40000")) == ("", "")


def test_one_interrupt_ends_a_busy_node(start):
    process = start("spins_until_interrupted")
    assert read_line(process.stdout) == "ready\n"
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    assert finish(process)[0] == "ended\n"


def test_a_flood_of_interrupts_is_survived_and_seen(start):
    process = start("survives_a_flood_of_interrupts", "6")
    assert read_line(process.stdout) == "ready\n"
    time.sleep(0.5)
    end = time.monotonic() + 5
    while time.monotonic() < end:
        process.send_signal(signal.SIGINT)
        time.sleep(0.003)
    out, complaints = finish(process)
    # Python 3.10 also looks for signals where a handler of exceptions begins
    assert sys.version_info < (3, 11) or "ctypes" not in complaints
    seen, received, *_ = out.split()
    assert int(seen) > 100
    assert int(received) > 100
    assert "AssertionError" not in out


def test_the_type_description_is_the_installed_one(start):
    response = json.loads(finish(start("tells_its_type_description"))[0])
    installed = json.loads((SHARE / "std_msgs" / "msg" / "Header.json").read_text("utf-8"))
    assert response["successful"], response
    assert response["type_description"] == installed["type_description_msg"]
    assert response["type_sources"] == [
        {
            "type_name": f"{package}/msg/{name}",
            "encoding": "msg",
            "raw_file_contents": (SHARE / package / "msg" / f"{name}.msg").read_text("utf-8"),
        }
        for package, name in (("std_msgs", "Header"), ("builtin_interfaces", "Time"))
    ]


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("middleware", ["rmw_connextdds", "RMW_IMPLEMENTATION", "colcon"]),
        ("layout", ["Fast CDR", "unknown", "RMW_IMPLEMENTATION"]),
        ("symbol", ["Fast CDR", "no_such_symbol", "colcon"]),
        ("fast cdr", ["libfastcdr.so.1", "RMW_IMPLEMENTATION"]),
        ("tables", ["does not know this version of ROS 2", "newer idlc", "colcon"]),
        ("machine", ["machine code", "there is none for", "rmw_fastrtps_cpp", "colcon"]),
        ("memory", ["machine code", "does not allow", "rmw_fastrtps_cpp", "colcon"]),
        ("library", ["librosidl_typesupport_elsewhere_c.so", "source your ROS 2"]),
    ],
)
def test_an_error_says_what_to_do(case, words, start):
    out, _ = finish(start("says_what_to_do", case))
    assert [word for word in words if word not in out] == [], out


def test_services_work_where_nobody_knows_events(start):
    assert finish(start("serves_without_events")) == ("", "")


@pytest.fixture
def mixed(classes, tmp_path) -> Path:
    """Return a folder where std_msgs has rosidl's extension modules beside idlc's classes."""
    shutil.copytree(classes / "std_msgs", tmp_path / "std_msgs")
    for file in Path(sysconfig.get_path("purelib"), "std_msgs").glob("std_msgs_s__*"):
        shutil.copy(file, tmp_path / "std_msgs")
    return tmp_path


def test_the_packages_own_extension_is_preferred(start, mixed):
    out, _ = finish(start("uses_the_extension", path=mixed))
    assert out == "string True\nheader True\n"


def test_an_outdated_extension_is_not_used(start, mixed):
    known = generated.type_data(mixed / "std_msgs")
    known["hashes"]["std_msgs/msg/String"] = "RIHS01_" + 64 * "0"
    types = mixed / "std_msgs" / "_type_data.py"
    types.write_text(f"JSON = {json.dumps(known)!r}\n", "utf-8")
    out, _ = finish(start("uses_the_extension", path=mixed))
    assert out == "string False\nheader True\n"


def test_what_rcl_reads_itself_may_be_idlcs(start, classes, tmp_path):
    """As after --vendor-deps=beside: idlc's action_msgs hides the one that rclpy came with."""
    (tmp_path / "files/trip/action").mkdir(parents=True)
    go = tmp_path / "files/trip/action/Go.action"
    go.write_text("bool far\n---\nbool done\n---\nint32 at\n", "utf-8")
    out = tmp_path / "out"
    for package in ("lifecycle_msgs", "type_description_interfaces", "rcl_interfaces"):
        generate(SHARE / package, out / package)
    shutil.copytree(classes, out, dirs_exist_ok=True)
    generate(tmp_path / "files/trip", out / "trip", "--vendor-deps=beside")
    _, complaints = finish(start("acts_without_a_class_of_rosidls", path=out))
    assert "_idlc" not in complaints  # rclpy has some of its own about an executor that ends
    described = json.loads(finish(start("tells_its_type_description", path=out))[0])
    assert described["successful"]
