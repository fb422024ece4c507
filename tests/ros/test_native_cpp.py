"""A C++ program does with idlc's libraries what rclcpp and rosbag2 do, on either machine."""

import signal
import subprocess

import pytest

from idlc.generate.native.library import OWN
from tests.support.installed import SHARE, interfaces_in, names_in
from tests.support.native import built, install, model_of
from tests.support.paths import EVERY_KIND, EXAMPLE
from tests.support.tools import MACHINES, emulator, run, tool

FOLDERS = (EXAMPLE, EVERY_KIND, SHARE / "sensor_msgs", SHARE / "action_msgs")
#: How the program is started: on 64 KiB pages too, and where code checks where it is jumped to.
WAYS = {"x86_64": [[]], "aarch64": [[], ["-p", "65536"], ["-cpu", "max"]]}

BTI_C, NOP = bytes.fromhex("5f2403d5"), bytes.fromhex("1f2003d5")


@pytest.fixture(scope="module")
def models():
    return [model_of(folder) for folder in FOLDERS]


@pytest.fixture(scope="module")
def names():
    found = interfaces_in(FOLDERS)
    return names_in(found, found)


@pytest.fixture(scope="module")
def prefixes(models, tmp_path_factory):
    """Return the prefixes of each machine, as AMENT_PREFIX_PATH has them."""
    found = {}
    for machine in MACHINES:
        folders = [tmp_path_factory.mktemp(f"{machine}-{model.package}") for model in models]
        for model, folder in zip(models, folders, strict=True):
            install(model, folder, machine)
        found[machine] = ":".join(map(str, folders))
    return found


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Return a function that builds the program for a machine, with ROS 2's own headers."""
    found = {}

    def build(machine):
        if machine not in found:
            found[machine] = built(tmp_path_factory.mktemp(machine), machine)
        return found[machine]

    return build


@pytest.fixture
def ask(program, prefixes, names, ros_environment):
    def ask(machine, *before):
        environment = {**ros_environment, "AMENT_PREFIX_PATH": prefixes[machine]}
        return run(*before, program(machine), *names, env=environment).splitlines()

    return ask


@pytest.mark.parametrize(
    ("machine", "way"), [(machine, way) for machine in MACHINES for way in WAYS[machine]]
)
def test_every_message_is_found_and_asked(ask, models, names, machine, way):
    lines = ask(machine, *emulator(machine, *way))
    assert lines[-1] == f"asked for {len(names)}"
    describers = {model.package: model.describer for model in models}
    for name in names:
        package, kind, short = name.split("/")
        told = f"{name} {package}::{kind}::{short} "
        digest = describers[package].hash(name).removeprefix("RIHS01_")
        assert any(line.startswith(f"{told}{digest} {name} ") for line in lines), name


def test_code_that_is_entered_elsewhere_ends_the_program(
    models, program, ros_environment, tmp_path
):
    """So it is where a processor checks; the tests above would not pass with other code."""
    model, *_ = models
    for path in install(model, tmp_path, "aarch64"):
        path.write_bytes(path.read_bytes().replace(BTI_C, NOP))
    command = [*emulator("aarch64", "-cpu", "max"), program("aarch64")]
    done = subprocess.run(
        [*command, f"{model.package}/msg/RobotCommand"],
        env={**ros_environment, "AMENT_PREFIX_PATH": str(tmp_path)},
        capture_output=True,
        check=False,
    )
    assert done.returncode == -signal.SIGILL


def test_all_machines_say_the_same(ask):
    assert ask("x86_64") == ask("aarch64", *emulator("aarch64"))


def test_loading_and_asking_touches_nothing_else(ask):
    command = [tool("valgrind"), "--quiet", "--error-exitcode=9", "--leak-check=full"]
    assert ask("x86_64", *command)


def test_every_message_of_a_package_has_a_symbol_and_nothing_else(models, tmp_path):
    """A type that is missing stops a recorder; half a service would end the process."""
    for model in models:
        for path in install(model, tmp_path):
            identifier = path.name.partition("__")[2].removesuffix(".so")
            start = f"{identifier}__get_message_type_support_handle__"
            lines = run(tool("nm"), "--dynamic", "--defined-only", path).splitlines()
            found = interfaces_in(one for one in FOLDERS if one.name == model.package)
            expected = [start + name.replace("/", "__") for name in names_in(found, found)]
            assert sorted(line.split()[2] for line in lines) == sorted(expected)
            undefined = run(tool("nm"), "--dynamic", "--undefined-only", path).split()
            assert undefined == (
                [] if identifier == OWN else ["U", "_ZSt21__throw_runtime_errorPKc"]
            )
