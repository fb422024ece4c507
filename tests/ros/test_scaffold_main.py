"""What every robust `main` shares: how a node ends, whatever ends it."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support import programs
from tests.support.nodes import nodes

#: How `main` goes on before it creates the node, and the status that the process ends with.
ENDINGS = {
    "Ctrl-C": ("raise KeyboardInterrupt", 0),
    "rclpy is shut down": ("rclpy.shutdown()", 0),
    "rclpy notices a shutdown": ("raise ExternalShutdownException", 0),
    "SIGTERM": ("terminated()", 0),
    "Ctrl-C after SIGTERM": ("terminated(); interrupted()", 0),
    "Ctrl-C while it fails after SIGTERM": ("overtaken()", 0),
    "it fails": ("raise ValueError('broken')", 1),
    "it exits": ("raise SystemExit(3)", 3),
}
HELPERS = """

def terminated():
    import os, signal
    os.kill(os.getpid(), signal.SIGTERM)
    while ok():
        pass


def interrupted():
    try:
        rclpy.create_node('late')
    finally:
        raise KeyboardInterrupt


def overtaken():
    global ok

    def ok():
        raise KeyboardInterrupt

    raise RuntimeError('the context is invalid')


def main("""
CREATED = "            node = Stays()\n"


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """Return a package with a node of each kind of main."""
    folder = tmp_path_factory.mktemp("mains")
    here = Path.cwd()
    try:
        os.chdir(folder)
        assert main(["scaffold", "package", "demo"]) == 0
        os.chdir("demo")
        assert main(["scaffold", "node", "stays", "--timer", "0.1", "--robust"]) == 0
        once = ["scaffold", "node", "once", "--client", "std_srvs/Empty:reset", "--robust"]
        assert main(once) == 0
    finally:
        os.chdir(here)
    return folder / "demo"


@pytest.mark.parametrize("how", ENDINGS)
def test_a_main_ends_quietly_unless_it_fails(package, ros_environment, how):
    ending, expected = ENDINGS[how]
    text = (package / "demo/stays.py").read_text()
    assert CREATED in text
    text = text.replace(CREATED, f"            {ending}\n{CREATED}").replace(
        "\n\ndef main(", HELPERS
    )
    (package / "demo/stays_not.py").write_text(text)
    command = [sys.executable, "-m", "demo.stays_not"]
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
        assert not once.fails, once.output


@pytest.mark.parametrize("moment", [0.0, 0.05, 0.1, 0.15, 0.2, 0.3])
def test_a_signal_while_it_starts_ends_it(moment, package, tmp_path, ros_environment):
    """rclpy shuts down under a node that is half made, or misses the signal in its first wait."""
    text = (package / "demo/stays.py").read_text()
    begun = "rclpy.init(args=args)\n"
    assert begun in text
    says = f"{begun}    print('it runs', flush=True)\n"
    (package / "demo/stays_says.py").write_text(text.replace(begun, says))
    with nodes(package, tmp_path, ros_environment) as start:
        for how in (signal.SIGINT, signal.SIGTERM):
            node = start("demo.stays_says")
            node.says("it runs")
            time.sleep(moment)
            node.process.send_signal(how)
            status = node.ends()
            # after Ctrl-C in `exec` of a text, which some imports use, Python ends by the signal
            statuses = (0, -signal.SIGINT) if how is signal.SIGINT else (0,)
            assert status in statuses, (how, status, node.output)
            assert not node.fails, node.output


@pytest.mark.parametrize("name", ["stays", "once"])
def test_signals_while_it_ends_leave_no_traceback(name, package, tmp_path, ros_environment):
    """A second Ctrl-C may kill it, once there is nothing left to do."""
    words = ["--server-timeout", "1000"] if name == "once" else []
    line = "await self.pause(0.05)" if name == "once" else "self.get_logger().info('tick')"
    text = (package / "demo" / f"{name}.py").read_text()
    assert line in text
    text = text.replace(line, f"print('it runs', flush=True); {line}")
    (package / "demo" / f"{name}_says.py").write_text(text)
    with nodes(package, tmp_path, ros_environment) as start:
        for pause in (0.05, 0.1, 0.15, 0.2, 0.3):
            node = start(f"demo.{name}_says", *words)
            node.says("it runs")
            while node.process.poll() is None:
                node.process.send_signal(signal.SIGINT)
                time.sleep(pause)
            expected = 0 if name == "stays" else 130
            assert node.process.returncode in (expected, -signal.SIGINT), node.output
            assert not node.fails, node.output


def test_more_signals_change_nothing(package, tmp_path, ros_environment):
    with nodes(package, tmp_path, ros_environment) as start:
        node = start("demo.stays")
        node.says("tick")
        for _ in range(3):
            node.process.send_signal(signal.SIGTERM)
        assert node.ends() == 0
        assert not node.fails, node.output
