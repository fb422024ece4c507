"""Nodes on DDS on two machines: network namespaces of Linux, joined by cables that tests make."""

import os
import shutil
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support.waiting import LIMIT, wait_for

IP = shutil.which("ip")
PROGRAM = """
import sys
import threading

import idlc
from idlc.robot import ExternalShutdownException, Node, init, shutdown, spin

String = idlc.load("std_msgs/msg/String").String
name, other, address = sys.argv[1:]
threading.Thread(target=lambda: (sys.stdin.read(), shutdown()), daemon=True).start()
try:
    with init(args=[], address=address):
        node = Node(name)
        publisher = node.create_publisher(String, name, 10)
        node.create_timer(0.1, lambda: publisher.publish(String(data=name * 2000)))
        hear = lambda message: print(message.data == other * 2000, flush=True)
        node.create_subscription(String, other, hear, 10)
        spin(node)
except ExternalShutdownException:
    pass
"""


def ip(*words):
    subprocess.run([IP, *words], check=True, capture_output=True)


class Machine:
    """A network namespace; `start` runs a node in it, and `heard` counts what the node heard."""

    def __init__(self, name, folder, ends):
        self.name = f"idlc{os.getpid()}{name}"
        self.log = Path(folder, name)
        self.ends = ends
        ip("netns", "add", self.name)
        ends.callback(ip, "netns", "del", self.name)
        self.run("sysctl", "-qw", "net.ipv6.conf.all.disable_ipv6=1")
        self.ip("link", "set", "lo", "up")

    def run(self, *words):
        ip("netns", "exec", self.name, *words)

    def ip(self, *words):
        ip("-n", self.name, *words)

    def plug(self, cable, host):
        self.ip("addr", "add", f"{host}/24", "dev", cable)
        self.ip("link", "set", cable, "mtu", "1280", "up")

    def sent(self, cable):
        """Return how many packets left through a cable."""
        command = [IP, "netns", "exec", self.name, "cat"]
        command.append(f"/sys/class/net/{cable}/statistics/tx_packets")
        return int(subprocess.run(command, check=True, capture_output=True).stdout)

    def start(self, name, other, address="", **variables):
        command = [IP, "netns", "exec", self.name, sys.executable, "-c", PROGRAM]
        log = self.ends.enter_context(self.log.open("w"))
        process = subprocess.Popen(
            [*command, name, other, address],
            env={**os.environ, "ROS_DOMAIN_ID": "3", **variables},
            stdin=subprocess.PIPE,
            stdout=log,
        )
        self.ends.callback(process.wait, LIMIT)
        self.ends.callback(process.stdin.close)

    def heard(self):
        lines = self.log.read_text(encoding="ascii").split()
        assert {*lines} <= {"True"}
        return len(lines)


@pytest.fixture
def machines(tmp_path):
    if not (IP and hasattr(os, "geteuid") and os.geteuid() == 0):
        pytest.skip("network namespaces need the command `ip` and the rights of root")
    with ExitStack() as ends:
        try:
            pair = [Machine(name, tmp_path, ends) for name in ("left", "right")]
            for cable, network in (("first", "10.99.1"), ("second", "10.99.2")):
                names = ("netns", pair[0].name, "type", "veth", "peer", "name", cable)
                ip("link", "add", cable, *names, "netns", pair[1].name)
                for number, machine in enumerate(pair, 1):
                    machine.plug(cable, f"{network}.{number}")
        except subprocess.CalledProcessError as error:
            pytest.skip(f"network namespaces are not allowed here: {error}")
        yield pair


def await_both(*machines):
    counts = {machine: machine.heard() for machine in machines}
    wait_for(lambda: all(machine.heard() > count + 2 for machine, count in counts.items()))


@pytest.mark.parametrize("variables", [{}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}])
def test_nothing_leaves_the_machine_unasked(machines, variables):
    left, right = machines
    left.start("a", "b", **variables)
    left.log, log = left.log.with_suffix(".b"), left.log
    left.start("b", "a", **variables)
    wait_for(lambda: left.heard() > 5 and log.read_text(encoding="ascii"))
    assert [left.sent(cable) for cable in ("first", "second")] == [0, 0]
    assert right.sent("first") == 0


def test_machines_meet_by_multicast_and_after_a_change_of_address(machines):
    left, right = machines
    for machine in machines:
        machine.ip("link", "set", "second", "down")
    left.start("left", "right", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
    right.start("right", "left", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
    await_both(*machines)
    left.ip("addr", "del", "10.99.1.1/24", "dev", "first")
    left.ip("addr", "add", "10.99.1.9/24", "dev", "first")
    await_both(*machines)


def test_machines_meet_on_the_second_of_two_interfaces(machines):
    left, right = machines
    left.ip("link", "set", "first", "down")
    left.start("left", "right", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
    right.start("right", "left", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
    await_both(*machines)


def test_a_machine_that_is_named_is_enough(machines):
    left, right = machines
    # the other one admits its subnet, but without multicast
    left.start("left", "right", "dds/10.99.2.2")
    right.start("right", "left", ROS_STATIC_PEERS="10.99.2.1")
    await_both(*machines)
