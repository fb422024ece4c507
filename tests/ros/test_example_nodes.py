"""Every node of the example, each in a process of its own, does what the tutorial says."""

import signal
import sys
from functools import partial
from pathlib import Path

import pytest

from tests.support import programs
from tests.support.nodes import next_without_drop, nodes
from tests.support.paths import EXAMPLE


@pytest.fixture
def start(tmp_path, ros_environment):
    with nodes(EXAMPLE, tmp_path, ros_environment) as start:
        yield lambda name, *words: start(f"my_robot_controller.{name}", *words)


@pytest.fixture(autouse=True)
def no_tracebacks(tmp_path):
    yield
    for log in tmp_path.glob("*.log"):
        assert "Traceback" not in log.read_text()


def test_the_command_publisher_toggles(start):
    node = start("command_publisher")
    node.until(lambda: len(node.said()) >= 4)
    lines = [f"Publishing: linear_velocity_x={speed}" for speed in (0.0, 0.5, 0.0, 0.5)]
    assert node.said()[:4] == lines
    assert node.end() == 0


def test_the_subscriber_hears_the_temperature(start):
    subscriber = start("sensor_subscriber")
    publisher = start("sensor_publisher")
    subscriber.until(lambda: subscriber.output.count("Temperature: 25.5C") >= 2)
    assert publisher.end(signal.SIGTERM) == 0
    assert subscriber.end() == 0


@pytest.mark.parametrize(
    ("words", "said"), [([], "Result: 5 = 2 + 3"), (["40", "2"], "Result: 42 = 40 + 2")]
)
def test_two_numbers_are_added(start, words, said):
    server = start("add_two_ints_server")
    client = start("add_two_ints_client", *words)
    assert client.ends() == 0
    assert client.said()[-1] == said
    assert server.end() == 0


def test_the_countdown_counts_down(start):
    server = start("countdown_action_server")
    client = start("countdown_action_client")
    assert client.ends() == 0
    counts = [f"countdown: feedback.current_count={count}" for count in (5, 4, 3, 2, 1)]
    assert [line for line in client.said() if "waiting" not in line][:-1] == counts
    assert client.said()[-1].endswith("(final_count=0, success=True)")
    assert server.end() == 0


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_short_client_can_be_ended(start, how):
    waiting = [start(name) for name in ("add_two_ints_client", "countdown_action_client")]
    for client in waiting:
        client.says("waiting for a server")
        assert client.end(how) == 0
    server = start("countdown_action_server")
    client = start("countdown_action_client", "50")
    client.says("current_count=49")
    assert client.end(how) == 0
    assert server.end(how) == 0


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_client_that_is_ended_cancels_its_goal(start, how):
    server = start("execute_task_server")
    client = start("execute_task_client", "--server-timeout", "30")
    client.says("starting")
    assert client.end(how) == 130
    server.says("execute_task: cancelled")
    assert server.end() == 0


def test_a_goal_without_a_name_is_rejected(start):
    start("execute_task_server")
    client = start("execute_task_client", "--server-timeout", "30", "")
    assert client.ends() == 1
    assert "the goal was rejected" in client.output


def test_a_task_is_executed(start):
    server = start("execute_task_server")
    client = start("execute_task_client", "--server-timeout", "30", "paint")
    assert client.ends() == 0
    steps = [
        f"feedback.current_status='{step}: paint'" for step in ("starting", "working", "finishing")
    ]
    assert client.said() == [
        *(f"execute_task: {s}" for s in steps),
        "execute_task: result.success=True",
    ]
    assert server.end() == 0


def test_a_goal_whose_server_dies_is_given_up(start):
    server = start("execute_task_server")
    client = start("execute_task_client", "--server-timeout", "30")
    client.says("working")
    server.end()
    assert client.ends() == 1
    assert "the server has gone" in client.output


def test_a_client_without_a_server_says_so(start):
    client = start("execute_task_client", "--server-timeout", "0.5")
    assert client.ends() == 1
    assert "gave up waiting for a server" in client.output


def test_a_waiting_client_ends_quietly(start):
    client = start("execute_task_client", "--server-timeout", "1000")
    client.until(partial(_waits, client))
    assert client.end() == 130


def _waits(client) -> bool:
    """Whether the process has opened its sockets, which rclpy does as its last preparation."""
    descriptors = Path(f"/proc/{client.process.pid}/fd")
    try:
        return sum("socket" in str(one.readlink()) for one in descriptors.iterdir()) >= 4
    except OSError:
        return False


@pytest.mark.long
def test_the_example_passes_its_own_tests(ros_environment):
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test"]
    attempts = (
        programs.ended(*command, cwd=EXAMPLE, environment=ros_environment) for _ in range(3)
    )
    status, output = next_without_drop(attempts)
    assert status == 0, output
