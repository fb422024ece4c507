"""A package written by hand gets an interface and a node, is built in every way, and runs."""

import os
import re
import shlex
import signal
import subprocess
import sys
import time
import venv
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support.paths import DOCS
from tests.support.programs import run_with
from tests.support.waiting import LIMIT

pytestmark = pytest.mark.long

PAGE = DOCS / "existing-package.md"
SETUP = """\
from setuptools import setup

package_name = 'py_pubsub'

setup(
    name=package_name,
    version='0.0.0',
    packages=[package_name],
    data_files=[
        ('share/ament_index/resource_index/packages',
            ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
        ('share/' + package_name + '/launch', ['launch/pubsub_launch.py']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='You',
    maintainer_email='you@youremail.com',
    description='Examples of minimal publisher/subscriber using rclpy',
    license='Apache License 2.0',
    tests_require=['pytest'],
    entry_points={
        'console_scripts': [
                'talker = py_pubsub.publisher_member_function:main',
        ],
    },
)
"""
FILES = {
    "setup.py": SETUP,
    "setup.cfg": "[develop]\nscript_dir=$base/lib/py_pubsub\n"
    "[install]\ninstall_scripts=$base/lib/py_pubsub\n",
    "package.xml": """\
<?xml version="1.0"?>
<package format="3">
  <name>py_pubsub</name>
  <version>0.0.0</version>
  <description>Examples of minimal publisher/subscriber using rclpy</description>
  <maintainer email="you@youremail.com">You</maintainer>
  <license>Apache License 2.0</license>
  <exec_depend>rclpy</exec_depend>
  <exec_depend>std_msgs</exec_depend>
  <export>
    <build_type>ament_python</build_type>
  </export>
</package>
""",
    "resource/py_pubsub": "",
    "py_pubsub/__init__.py": "",
    "py_pubsub/publisher_member_function.py": "def main():\n    print('talking')\n",
    "launch/pubsub_launch.py": """\
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    ld = LaunchDescription()
    talker = Node(package="py_pubsub", executable="talker")
    ld.add_action(talker)
    return ld
""",
}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory) -> Path:
    """Return a workspace with the package, after what the page says."""
    workspace = tmp_path_factory.mktemp("existing")
    package = workspace / "src" / "py_pubsub"
    for path, text in FILES.items():
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).write_text(text)
    (commands,) = re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    here = Path.cwd()
    try:
        os.chdir(workspace)
        for line in commands.splitlines():
            program, *words = shlex.split(line)
            if program == "cd":
                os.chdir(words[0])
            else:
                assert (program, main(words)) == ("idlc", 0)
    finally:
        os.chdir(here)
    added = "        ld.add_action(Node(package='py_pubsub', executable='weather'"
    assert added.strip().replace("'", '"') in (package / "launch/pubsub_launch.py").read_text()
    return workspace


def works(program: Path, tmp_path: Path, environment: dict[str, str]) -> None:
    """Start the installed node; it publishes until it is asked to end."""
    log = tmp_path / f"{time.monotonic_ns()}.log"
    with log.open("w") as output:
        node = subprocess.Popen(
            [program], cwd=tmp_path, env=environment, stdout=output, stderr=output
        )
    code = """if True:
        import rclpy, sys
        from rclpy.wait_for_message import wait_for_message
        from py_pubsub.msg import Weather
        rclpy.init()
        node = rclpy.create_node('observer')
        found, message = wait_for_message(Weather, node, 'weather', time_to_wait=30)
        print(found, message)
        node.destroy_node()
        rclpy.shutdown()
    """
    try:
        said = run_with(sys.executable, "-c", code, cwd=tmp_path, **environment)
        assert "True" in said, said + log.read_text()
        node.send_signal(signal.SIGINT)
        assert node.wait(LIMIT) == 0, log.read_text()
        assert "Traceback" not in log.read_text()
    finally:
        node.kill()
        node.wait(LIMIT)


def test_colcon_builds_it_whatever_was_built_before(workspace, tmp_path, ros_environment):
    colcon = [Path(sys.executable).parent / "colcon", "--log-base", "log", "build"]
    for options in (["--symlink-install"], ["--symlink-install"], [], ["--symlink-install"], []):
        run_with(*colcon, *options, cwd=workspace)
        prefix = workspace / "install" / "py_pubsub"
        setup = f". {prefix}/share/py_pubsub/package.sh && echo $PYTHONPATH"
        command = f"COLCON_CURRENT_PREFIX={prefix}; {setup}"
        path = run_with("sh", "-c", command, cwd=workspace, PYTHONPATH="").split()[-1]
        assert str(workspace) in path
        environment = {**ros_environment, "PYTHONPATH": path}
        works(prefix / "lib" / "py_pubsub" / "weather", tmp_path, environment)


@pytest.mark.parametrize("options", [[], ["-e"]], ids=["installed", "editable"])
def test_pip_installs_it(workspace, tmp_path, ros_environment, options):
    folder = tmp_path / "venv"
    venv.create(folder, with_pip=True, system_site_packages=True)
    import rclpy

    ros = str(Path(rclpy.__file__).parents[1])
    environment = {**ros_environment, "PYTHONPATH": ros}
    words = ["-m", "pip", "install", "-q", "--no-deps", *options]
    run_with(
        folder / "bin/python", *words, workspace / "src/py_pubsub", cwd=tmp_path, **environment
    )
    (program,) = [p for p in folder.rglob("weather") if p.is_file() and os.access(p, os.X_OK)]
    code = "import py_pubsub; print(py_pubsub.__path__[0])"
    path = run_with(folder / "bin/python", "-c", code, cwd=tmp_path, **environment).split()[-1]
    environment["PYTHONPATH"] = os.pathsep.join([str(Path(path).parent), ros])
    works(program, tmp_path, environment)


@pytest.mark.jazzy  # the linters are in its environment alone
@pytest.mark.parametrize("linter", ["ament_flake8", "ament_pep257"])
def test_generated_modules_pass_the_tests_of_a_new_package(linter, workspace, tmp_path):
    """`ros2 pkg create` writes tests that run these on all that is in the package."""
    for path, text in (
        ("msg/Odd.msg", '# asks: a "thing", and so on\n#\n# more\nint32 a  # no period\n'),
        ("srv/Ask.srv", f"# {'long words ' * 12}\nstring a\n---\n"),
        ("action/Go.action", "---\nint32 a\n---\n"),
    ):
        (tmp_path / "odd" / path).parent.mkdir(parents=True)
        (tmp_path / "odd" / path).write_text(text)
    assert main(["gen", str(tmp_path / "odd"), "-o", str(tmp_path / "odd_msgs")]) == 0
    program = Path(sys.executable).parent / linter
    run_with(program, tmp_path / "odd_msgs", workspace / "src/py_pubsub/py_pubsub", cwd=tmp_path)
