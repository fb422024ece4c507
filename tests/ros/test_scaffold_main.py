"""What every scaffolded `main` shares: how a node ends, whatever ends it."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support import programs
from tests.support.nodes import nodes

#: How `main` goes on after rclpy has started, and the status that the process ends with.
ENDINGS = {
    "it returns": ("pass", 0),
    "Ctrl-C": ("raise KeyboardInterrupt", 0),
    "rclpy is shut down": ("rclpy.shutdown()", 0),
    "rclpy notices a shutdown": ("raise ExternalShutdownException", 0),
    "it fails because of SIGTERM": ("terminated(); rclpy.create_node('late')", 0),
    "Ctrl-C while it fails for that": ("terminated(); interrupted()", 0),
    "it fails": ("raise ValueError('broken')", 1),
    "it exits": ("sys.exit(3)", 3),
}
SCRIPT = """
import os
import signal
import sys
import rclpy
from rclpy.executors import ExternalShutdownException
from demo.node_main import until_shutdown

def terminated():
    os.kill(os.getpid(), signal.SIGTERM)
    while rclpy.ok():
        pass

def interrupted():
    try:
        rclpy.create_node('late')
    finally:
        raise KeyboardInterrupt

@until_shutdown
def main(args=None):
    rclpy.init(args=args)
    {ending}

main()
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """Return a package with a node of each kind of main."""
    folder = tmp_path_factory.mktemp("mains")
    here = Path.cwd()
    try:
        os.chdir(folder)
        assert main(["scaffold", "package", "demo"]) == 0
        os.chdir("demo")
        assert main(["scaffold", "node", "stays", "--timer", "0.1"]) == 0
        assert main(["scaffold", "node", "once", "--client", "std_srvs/Empty:reset"]) == 0
    finally:
        os.chdir(here)
    return folder / "demo"


@pytest.mark.parametrize("how", ENDINGS)
def test_a_main_ends_quietly_unless_it_fails(package, ros_environment, how):
    ending, expected = ENDINGS[how]
    script = SCRIPT.format(ending=ending)
    command = [sys.executable, "-c", script]
    status, printed = programs.ended(*command, cwd=package, environment=ros_environment)
    assert status == expected, printed
    assert ("ValueError: broken" in printed) == (how == "it fails")
    assert ("Traceback" in printed) == (how == "it fails")


def test_a_wrong_argument_of_ros_is_not_kept_quiet(package, ros_environment):
    for node in ("stays", "once"):
        command = [sys.executable, "-m", f"demo.{node}", "--ros-args", "--bogus"]
        status, printed = programs.ended(*command, cwd=package, environment=ros_environment)
        assert status == 1
        assert "--bogus" in printed


def test_a_node_that_shuts_rclpy_down_itself_ends(package, tmp_path, ros_environment):
    for name, line, ending in (
        ("stays", "self.get_logger().info('tick')", "rclpy.shutdown()"),
        ("once", "await self.pause(0.05)", "__import__('rclpy').shutdown(); await Future()"),
    ):
        text = (package / "demo" / f"{name}.py").read_text()
        assert line in text
        (package / "demo" / f"{name}_ends.py").write_text(text.replace(line, ending))
    with nodes(package, tmp_path, ros_environment) as start:
        assert start("demo.stays_ends").ends() == 0
        once = start("demo.once_ends", "--server-timeout", "1000")
        assert once.ends() == 1
        assert "Traceback" not in once.output


@pytest.mark.parametrize("name", ["stays", "once"])
def test_signals_while_it_ends_change_nothing(name, package, tmp_path, ros_environment):
    """A launch file that is ended by a script gets two: one for its group, one of its own."""
    words = ["--server-timeout", "1000"] if name == "once" else []
    line = "await self.pause(0.05)" if name == "once" else "self.get_logger().info('tick')"
    text = (package / "demo" / f"{name}.py").read_text()
    assert line in text
    text = text.replace(line, f"print('it runs', flush=True); {line}")
    (package / "demo" / f"{name}_says.py").write_text(text)
    with nodes(package, tmp_path, ros_environment) as start:
        statuses = []
        for pause in (0.05, 0.1, 0.15, 0.2, 0.3):
            node = start(f"demo.{name}_says", *words)
            node.says("it runs")
            while node.process.poll() is None:
                node.process.send_signal(signal.SIGINT)
                time.sleep(pause)
            statuses.append((node.process.returncode, "Traceback" in node.output))
        assert set(statuses) == {(0 if name == "stays" else 130, False)}


def test_a_second_signal_changes_nothing(package, tmp_path, ros_environment):
    with nodes(package, tmp_path, ros_environment) as start:
        node = start("demo.stays")
        node.says("tick")
        for _ in range(3):
            node.process.send_signal(signal.SIGTERM)
        assert node.ends() == 0
        assert "Traceback" not in node.output
