"""Scaffolded packages and the example build with colcon and install with pip, and then run."""

import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package

from tests.support.paths import EXAMPLE, ROOT
from tests.support.programs import ended, run_with

pytestmark = pytest.mark.long

GENERATED = ("msg", "srv", "action", "_idlc", "idlc.lock", "py.typed")


@pytest.fixture(scope="module")
def scaffolded(tmp_path_factory) -> Path:
    """Return a new package with an interface and a node, not compiled yet."""
    folder = tmp_path_factory.mktemp("scaffolded")
    idlc = [sys.executable, "-m", "idlc", "scaffold"]
    run_with(*idlc, "package", "demo", cwd=folder, PYTHONPATH=str(ROOT))
    package = folder / "demo"
    for words in (
        ["interface", "msg", "Drive", "float32 speed"],
        ["node", "driver", "--publisher", "Drive:drive", "--client", "std_srvs/Empty:stop"],
    ):
        run_with(*idlc, *words, cwd=package, PYTHONPATH=str(ROOT))
    return package


def copied(package: Path, folder: Path, *, compiled: bool) -> Path:
    """Return a copy of a package, without its generated classes unless they are wanted."""
    ignore = shutil.ignore_patterns("__pycache__", ".*_cache")
    copy = shutil.copytree(package, folder / package.name, ignore=ignore)
    for name in () if compiled else GENERATED:
        path = copy / package.name / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
    return copy


@pytest.mark.parametrize("name", ["demo", "my_robot_controller"])
def test_colcon_builds_it_and_compiles_its_interfaces(name, scaffolded, tmp_path):
    package = copied(scaffolded if name == "demo" else EXAMPLE, tmp_path / "src", compiled=False)
    parse_package(package).validate()
    colcon = Path(sys.executable).parent / "colcon"
    said = run_with(colcon, "--log-base", "log", "build", cwd=tmp_path, PYTHONPATH=str(ROOT))
    assert "1 package finished" in said
    prefix = tmp_path / "install" / name
    share = prefix / "share"
    index = share / "ament_index" / "resource_index"
    assert (index / "packages" / name).is_file()
    listed = (index / "rosidl_interfaces" / name).read_text().split()
    interfaces = [path for path in listed if not path.endswith(".idl")]
    assert interfaces == sorted(
        f"{path.parent.name}/{path.name}"
        for path in package.glob("[msa]*/*.*")
        if is_interface(path)
    )
    for interface in interfaces:
        installed = share / name / interface
        assert installed.read_text() == (package / interface).read_text()
        assert installed.with_suffix(".json").is_file()
    assert list((share / name / "launch").glob("*_launch.py"))
    (site,) = prefix.glob("lib/python*/site-packages")
    code = f"import {name}.msg as m; print(*dir(m))"
    said = run_with(sys.executable, "-c", code, cwd=tmp_path, PYTHONPATH=str(site))
    assert ("Drive" if name == "demo" else "RobotCommand") in said
    commands = {path.name for path in (prefix / "lib" / name).iterdir()}
    tests = {path.stem.removeprefix("test_") for path in package.glob("test/**/test_*")}
    assert commands == tests - {"interfaces", "style"}


def is_interface(path: Path) -> bool:
    return path.suffix[1:] == path.parent.name


@pytest.fixture(scope="module")
def environment(tmp_path_factory) -> Path:
    """Return a clean virtual environment: neither idlc nor ROS 2."""
    folder = tmp_path_factory.mktemp("clean") / "venv"
    venv.create(folder, with_pip=True)
    return folder


@pytest.mark.parametrize("options", [[], ["-e"]], ids=["installed", "editable"])
def test_pip_installs_the_committed_classes(options, environment, tmp_path):
    package = copied(EXAMPLE, tmp_path, compiled=True)
    python = environment / "bin" / "python"
    pip = [python, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    clean = {"PYTHONPATH": "", "AMENT_PREFIX_PATH": ""}
    run_with(*pip, "--force-reinstall", *options, package, cwd=tmp_path, **clean)
    code = (
        "import importlib.util as u; assert not u.find_spec('idlc')\n"
        "from my_robot_controller.msg import RobotCommand\n"
        "print(RobotCommand.deserialize(RobotCommand('stop').serialize()))"
    )
    assert "command_type='stop'" in run_with(python, "-c", code, cwd=environment, **clean)
    if not options:
        share = environment / "share"
        assert (share / "my_robot_controller" / "msg" / "RobotCommand.msg").is_file()
        # `ros2 run` and launch files need it
        assert (share / "ament_index/resource_index/packages" / package.name).is_file()
    # the wheels of ROS 2 are large: they are borrowed for the rest
    import rclpy

    borrowed = {**clean, "PYTHONPATH": str(Path(rclpy.__file__).parents[1])}
    said = run_with(environment / "bin" / "execute_task_client", "--help", cwd=tmp_path, **borrowed)
    assert "The task to execute" in said


def test_an_interface_that_is_wrong_ends_the_build_with_a_report(scaffolded, tmp_path):
    package = copied(scaffolded, tmp_path, compiled=False)
    (package / "msg" / "Drive.msg").write_text("flot32 speed\n")
    done = subprocess.run(
        [sys.executable, "setup.py", "build"],
        cwd=package,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "error[IDL201]: unknown type `flot32`" in done.stderr
    assert "Traceback" not in done.stderr


def colcon_tested(*command: object, cwd: Path) -> tuple[int, str]:
    """Return the status of a run of tests, and what it says."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return ended(*command, cwd=cwd, environment=environment)


def test_colcon_tests_the_interfaces(scaffolded, tmp_path):
    package = copied(scaffolded, tmp_path / "src", compiled=False)
    colcon = [Path(sys.executable).parent / "colcon", "--log-base", "log"]
    run_with(*colcon, "build", cwd=tmp_path, PYTHONPATH=str(ROOT))
    test = [*colcon, "test", "--event-handlers", "console_direct+", "--return-code-on-test-failure"]
    test += ["--pytest-args", "test/test_interfaces.py", "-p", "no:cacheprovider"]
    status, said = colcon_tested(*test, cwd=tmp_path)
    assert (status, "2 passed" in said) == (0, True), said
    # neither compiled since nor, then, valid
    (package / "msg" / "Drive.msg").write_text("float64 speed\n")
    status, said = colcon_tested(*test, cwd=tmp_path)
    assert (status, "1 failed, 1 passed" in said) == (1, True), said
    assert "idlc gen --check" in said
    assert "msg/Drive.msg" in said
    (package / "msg" / "Drive.msg").write_text("flot32 speed\n")
    plain = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "test/test_interfaces.py"]
    status, said = colcon_tested(*plain, cwd=package)
    assert (status, "2 failed" in said) == (1, True), said
    assert "error[IDL201]: unknown type `flot32`" in said
    assert "Traceback" not in said


def test_the_interfaces_are_not_tested_where_idlc_is_not_installed(scaffolded, tmp_path):
    package = copied(scaffolded, tmp_path / "src", compiled=False)
    hidden = tmp_path / "hidden" / "idlc"
    hidden.mkdir(parents=True)
    (hidden / "__init__.py").write_text("raise ModuleNotFoundError('idlc', name='idlc')\n")
    command = [sys.executable, "-m", "pytest", "-rs", "-p", "no:cacheprovider"]
    clean = {"PYTHONPATH": str(hidden.parent), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run(
        [*command, "test/test_interfaces.py"],
        cwd=package,
        env={**os.environ, **clean},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "1 skipped" in done.stdout
    assert "idlc is not installed, so nothing can check the committed classes" in done.stdout
