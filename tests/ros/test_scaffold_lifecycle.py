"""A scaffolded lifecycle node does in each state what that state allows, and no more.

Whatever way leads out of a state, nothing of it stays: no endpoint, no timer, no goal.
"""

import os
import signal
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from lifecycle_msgs.msg import Transition
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

from idlc.cli.main import main
from tests.support.nodes import nodes

WORDS = (
    *("--publisher", "std_msgs/Empty:out@20", "--subscriber", "std_msgs/Empty:in"),
    *("--service", "std_srvs/SetBool:served", "--client", "std_srvs/SetBool:called"),
    *("--action-server", "test_msgs/Fibonacci:work", "--action-client", "test_msgs/Fibonacci:sent"),
    *("--timer", "0.1", "--lifecycle"),
)
CONFIGURED = {"/out", "/called", "/work/_action/send_goal", "/sent/_action/send_goal"}
ACTIVE = {*CONFIGURED, "/in", "/served"}
T = Transition
#: Ways out of the active state, and the state at their end.
WAYS = {
    "deactivated": ([T.TRANSITION_DEACTIVATE], "inactive"),
    "cleaned up": ([T.TRANSITION_DEACTIVATE, T.TRANSITION_CLEANUP], "unconfigured"),
    "shut down": ([T.TRANSITION_ACTIVE_SHUTDOWN], "finalized"),
    "shut down when inactive": (
        [T.TRANSITION_DEACTIVATE, T.TRANSITION_INACTIVE_SHUTDOWN],
        "finalized",
    ),
    "shut down when unconfigured": (
        [T.TRANSITION_DEACTIVATE, T.TRANSITION_CLEANUP, T.TRANSITION_UNCONFIGURED_SHUTDOWN],
        "finalized",
    ),
}


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """Return a package with a lifecycle node that has every role."""
    folder = tmp_path_factory.mktemp("lifecycle")
    here = Path.cwd()
    try:
        os.chdir(folder)
        assert main(["scaffold", "package", "demo"]) == 0
        os.chdir("demo")
        assert main(["scaffold", "node", "worker", *WORDS]) == 0
    finally:
        os.chdir(here)
    module = folder / "demo" / "demo" / "worker.py"
    for name in ("on_configure", "on_activate", "on_deactivate"):
        whole = module.read_text(encoding="utf-8")
        head, call, tail = whole.partition(f"        return super().{name}(state)\n")
        assert call
        broken = f"{head}        raise RuntimeError('broken')\n{tail}"
        (module.parent / f"broken_{name}.py").write_text(broken, encoding="utf-8")
    return folder / "demo"


@pytest.fixture
def peer(ros_environment, monkeypatch):
    import rclpy
    from rclpy.context import Context

    from tests.ros.lifecycle_peer import Peer

    for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_DOMAIN_ID"):
        monkeypatch.setenv(name, ros_environment[name])
    context = Context()
    rclpy.init(context=context)
    peer = Peer(context, ACTIVE)
    yield peer
    peer.server.destroy()
    peer.client.destroy()
    peer.node.destroy_node()
    context.destroy()


@pytest.fixture
def start(package, tmp_path, ros_environment):
    with nodes(package, tmp_path, ros_environment) as start:
        yield start


def worker_is_silent(peer, worker):
    """Whether neither a message nor a line comes while ten would."""
    peer.spin(0.2)
    before, printed = peer.messages, worker.output.count("tick")
    peer.spin(0.6)
    return (peer.messages, worker.output.count("tick")) == (before, printed)


@pytest.mark.parametrize("way", WAYS)
def test_nothing_goes_on_after_the_active_state(start, peer, way):
    transitions, state = WAYS[way]
    worker = start("demo.worker", "--server-timeout", "1000")
    assert peer.step(T.TRANSITION_CONFIGURE)
    peer.until(lambda: peer.offered() == CONFIGURED)
    assert worker_is_silent(peer, worker)
    assert peer.messages == 0
    peer.until(peer.client.server_is_ready)
    early = peer.result(peer.client.send_goal_async(Fibonacci.Goal()))
    assert not early.accepted  # an inactive node takes no goals
    assert peer.step(T.TRANSITION_ACTIVATE)
    peer.until(lambda: peer.messages > 2 and "tick" in worker.output)
    peer.until(lambda: peer.offered() == ACTIVE)
    goal = peer.result(peer.client.send_goal_async(Fibonacci.Goal()))
    assert goal.accepted
    ending = goal.get_result_async()
    peer.until(lambda: "work: goal.order=0" in worker.output)
    assert peer.step(*transitions)
    assert peer.state_of_worker() == state
    assert peer.result(ending).status == GoalStatus.STATUS_ABORTED
    peer.until(lambda: peer.cancelled)
    peer.until(lambda: peer.offered() == (CONFIGURED if state == "inactive" else set()))
    assert worker_is_silent(peer, worker)
    assert worker.end() == 0
    assert not worker.fails, worker.output


@pytest.mark.parametrize(
    ("broken", "transitions"),
    [
        ("on_configure", [T.TRANSITION_CONFIGURE]),
        ("on_activate", [T.TRANSITION_CONFIGURE, T.TRANSITION_ACTIVATE]),
        (
            "on_deactivate",
            [T.TRANSITION_CONFIGURE, T.TRANSITION_ACTIVATE, T.TRANSITION_DEACTIVATE],
        ),
    ],
)
def test_nothing_is_left_after_a_transition_that_failed(start, peer, broken, transitions):
    worker = start(f"demo.broken_{broken}", "--server-timeout", "1000")
    for _ in range(2):  # also the second time: the node can be used again
        assert not peer.step(*transitions)
        assert peer.state_of_worker() == "unconfigured"
        peer.until(lambda: peer.offered() == set())
        assert worker_is_silent(peer, worker)
    assert "failed" in worker.output
    assert worker.end(signal.SIGTERM) == 0
    assert not worker.fails, worker.output


def test_a_node_works_again_after_it_was_cleaned_up(start, peer):
    worker = start("demo.worker", "--server-timeout", "1000")
    up = (T.TRANSITION_CONFIGURE, T.TRANSITION_ACTIVATE)
    for _ in range(5):
        assert peer.step(*up, T.TRANSITION_DEACTIVATE, T.TRANSITION_CLEANUP)
    assert peer.step(*up)
    peer.until(lambda: peer.messages > 2)
    peer.until(lambda: peer.offered() == ACTIVE)
    requests = []

    def answer(request, response):
        requests.append(request)
        return response

    peer.node.create_service(SetBool, "called", answer)
    peer.until(lambda: "called: response=" in worker.output)
    peer.spin(0.5)
    assert len(requests) == 1  # what was started before the clean-up has ended
    assert worker.end() == 0
    assert not worker.fails, worker.output
