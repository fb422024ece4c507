"""Nodes as programs: they meet, and signals end them without a trace."""

import signal
import subprocess
import sys

import pytest

from idlc.robot.keys import EntityKind
from tests.robot.nodes import LONG, SetBool, String, node_at, spin_until

PROGRAM = """
import sys

import idlc
from idlc.robot import ExternalShutdownException, Node, init, spin

String = idlc.load("std_msgs/msg/String").String
SetBool = idlc.load("std_srvs/srv/SetBool").SetBool


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.service = self.create_service(SetBool, "set", self.answer)
        self.timer = self.create_timer(0.01, self.talk)

    def talk(self):
        self.publisher.publish(String(data="hello"))

    def answer(self, request, response):
        response.message = "on" if request.data else "off"
        return response


def main():
    try:
        with init(address=sys.argv[1]):
            spin(Talker())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
"""


@pytest.fixture
def program(address, tmp_path):
    """A started program, of which the node's name is replaced."""
    file = tmp_path / "talker.py"
    file.write_text(PROGRAM, encoding="utf-8")
    command = [sys.executable, file, address, "--ros-args", "-r", "__ns:=/robot", "--"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        yield process
        process.kill()


def test_two_programs_meet_at_a_router(address, program):
    with node_at(address, "listener") as node:
        received = []
        node.create_subscription(String, "/robot/chatter", received.append, 10)
        client = node.create_client(SetBool, "/robot/set")
        spin_until(lambda: received or program.poll() is not None, node)
        assert received[0].data == "hello"
        assert client.wait_for_service(timeout_sec=LONG)
        assert client.call(SetBool.Request(data=True), LONG).message == "on"


def talkers(graph):
    return [entity for entity in graph.entities() if entity.node == "talker"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_program_without_a_trace(address, program, number):
    with node_at(address, "listener") as node:
        names = {"/robot/chatter"}
        graph = node.graph
        assert graph.wait_for(lambda _: names <= {*graph.types(EntityKind.PUBLISHER)}, LONG)
        program.send_signal(number)
        _, errors = program.communicate(timeout=LONG)
        assert (program.returncode, errors) == (0, "")
        assert graph.wait_for(lambda _: not talkers(graph), LONG)


#: Clients that wait, each with the name of its last endpoint.
WAITING = {
    "service": ('node.create_client(load("std_srvs/srv/SetBool"), "a").wait_for_service()', "/a"),
    "action": (
        'ActionClient(node, load("tf2_msgs/action/LookupTransform"), "a").wait_for_server()',
        "/a/_action/get_result",
    ),
}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("kind", WAITING)
def test_a_blocked_call_ends_with_the_program(address, tmp_path, kind, number):
    wait, name = WAITING[kind]
    file = tmp_path / "waiting.py"
    file.write_text(
        "import sys\n"
        "import idlc\n"
        "from idlc.robot import ActionClient, Node, init\n"
        "load = lambda name: getattr(idlc.load(name), name.split('/')[-1])\n"
        "try:\n"
        "    with init(address=sys.argv[1]):\n"
        '        node = Node("waiting")\n'
        f"        {wait}\n"
        "except KeyboardInterrupt:\n"
        "    pass\n"
    )
    with node_at(address, "listener") as node:
        command = [sys.executable, file, address]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            try:
                assert node.graph.wait_for(lambda graph: graph.count(EntityKind.CLIENT, name), LONG)
                process.send_signal(number)
                _, errors = process.communicate(timeout=LONG)
                assert (process.returncode, errors) == (0, "")
            finally:
                process.kill()
        assert node.graph.wait_for(lambda graph: not graph.count(EntityKind.CLIENT, name), LONG)


def test_an_exception_of_a_callback_ends_a_program(address, tmp_path):
    file = tmp_path / "failing.py"
    file.write_text(
        "import sys\n"
        "from idlc.robot import Node, init, spin\n"
        "init(address=sys.argv[1])\n"
        'node = Node("failing")\n'
        "node.create_timer(0.0, lambda: 1 / 0)\n"
        "spin(node)\n"
    )
    done = subprocess.run(
        [sys.executable, file, address], capture_output=True, text=True, timeout=LONG, check=False
    )
    assert done.returncode == 1
    assert "ZeroDivisionError" in done.stderr


def test_a_program_without_init_is_one_sentence():
    code = "from idlc.robot import Node; Node('x')"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=LONG, check=False
    )
    assert done.stderr.endswith(
        "RobotError: the context is not initialized (call `idlc.robot.init()` first)\n"
    )
