"""Addresses of DDS: where idlc searches, and that nothing leaves this machine by itself."""

import os
import re
import socket
import subprocess
import sys

import pytest

from idlc.project.words import is_address
from idlc.robot.dds.address import (
    PARTICIPANTS,
    _is_used,
    open_sockets,
    own_hosts,
    parse_place,
    searched,
    silence,
)
from idlc.robot.errors import RobotError
from idlc.robot.session import open_session
from tests.support.domains import held_domain

RANGE, PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"
ONLY = "ROS_LOCALHOST_ONLY"
LOCAL = "127.0.0.1"


@pytest.mark.parametrize(
    ("address", "environ", "domain", "hosts", "subnet"),
    [
        ("dds", {}, 0, (LOCAL,), False),
        ("dds", {"ROS_DOMAIN_ID": "7"}, 7, (LOCAL,), False),
        ("dds:8", {"ROS_DOMAIN_ID": "7"}, 8, (LOCAL,), False),
        ("dds", {RANGE: "LOCALHOST"}, 0, (LOCAL,), False),
        ("dds", {RANGE: "SUBNET"}, 0, (LOCAL,), True),
        ("dds", {RANGE: "subnet"}, 0, (LOCAL,), True),
        ("dds", {RANGE: "OFF"}, 0, (), False),
        ("dds/192.0.2.1", {}, 0, (LOCAL, "192.0.2.1"), False),
        ("dds:3/192.0.2.1", {RANGE: "OFF"}, 3, ("192.0.2.1",), False),
        ("dds", {PEERS: "192.0.2.1", RANGE: "OFF"}, 0, (), False),
        ("dds", {PEERS: "192.0.2.1; 192.0.2.2;"}, 0, (LOCAL, "192.0.2.1", "192.0.2.2"), False),
        ("dds", {ONLY: "1", RANGE: "SUBNET", PEERS: "192.0.2.1"}, 0, (LOCAL,), False),
    ],
)  # fmt: skip
def test_a_place_follows_the_address_and_the_variables_of_ros(
    address, environ, domain, hosts, subnet
):
    place = parse_place(address, None, environ)
    assert place[:3] == (domain, hosts, subnet)
    assert place.is_local == (hosts in ((LOCAL,), ()) and not subnet)
    targets = searched(place)
    assert len(targets) == len(hosts) * PARTICIPANTS + subnet
    first = 7400 + 250 * domain
    assert {port for host, port in targets if host in hosts} <= {*range(first + 10, first + 250)}
    if place.is_local:
        assert own_hosts(place) == [LOCAL]
        assert {host for host, _ in targets} <= {LOCAL}


@pytest.mark.parametrize(
    ("address", "environ", "message"),
    [
        ("dds:", {}, "`dds:` is not an address of DDS (write `dds`"),
        ("dds/", {}, "`dds/` is not an address of DDS"),
        ("dds/a b", {}, "`dds/a b` is not an address of DDS"),
        ("dds:7x", {}, "`dds:7x` is not an address of DDS"),
        ("dds:233", {}, "`233` is not a domain (write a number up to 232, such as `dds:7`)"),
        ("dds", {"ROS_DOMAIN_ID": "-1"}, "`-1` is not a domain (set ROS_DOMAIN_ID to 0)"),
        ("dds", {RANGE: "all"}, "ROS_AUTOMATIC_DISCOVERY_RANGE is `all` (write SUBNET"),
        (
            "dds",
            {"ROS_SECURITY_STRATEGY": "Enforce"},
            "idlc does not support DDS-Security (unset ROS_SECURITY_STRATEGY",
        ),
        ("dds", {RANGE: "ALL"}, "ROS_AUTOMATIC_DISCOVERY_RANGE is `ALL` (write SUBNET"),
    ],
)
def test_what_is_no_address_is_one_sentence(address, environ, message):
    assert is_address(address)
    with pytest.raises(RobotError) as caught:
        open_session(address, environ=environ)
    assert str(caught.value).startswith(message)


def test_variables_that_idlc_does_not_use_are_noted():
    environ = {"CYCLONEDDS_URI": "x", "ROS_DISCOVERY_SERVER": "", "ROS_SECURITY_ENABLE": "true"}
    place = parse_place("dds", None, environ)
    assert place.notes == (
        "idlc does not use CYCLONEDDS_URI",
        "idlc does not use ROS_SECURITY_ENABLE",
    )
    assert "; ".join(place.notes) in nodes_stderr(environ)


@pytest.mark.parametrize(
    ("address", "environ", "sentence"),
    [
        ("dds", {}, "idlc searched this machine only; `dds/HOST` also searches another one"),
        ("dds", {RANGE: "OFF"}, f"{RANGE} is OFF, so idlc searched nothing"),
        (
            "dds/192.0.2.1",
            {RANGE: "SUBNET"},
            "idlc searched 127.0.0.1, 192.0.2.1, the subnet; no participant answered",
        ),
    ],
)
def test_a_place_without_participants_is_one_sentence(address, environ, sentence, monkeypatch):
    used = {0}
    monkeypatch.setattr("idlc.robot.dds.address._is_used", used.__contains__)
    assert silence(parse_place(address, None, environ)) == sentence
    used |= {5, 7}
    if environ.get(RANGE) != "OFF":
        sentence = "this machine has participants in other domains: `dds:5`, `dds:7`"
    assert silence(parse_place(address, None, environ)) == sentence


def test_the_domains_of_this_machine_are_known():
    domain = next(domain for domain in range(101, 0, -1) if not _is_used(domain))
    with socket.socket(type=socket.SOCK_DGRAM) as participant:
        participant.bind(("", 7410 + 250 * domain))
        assert _is_used(domain)
    assert not _is_used(domain)


def nodes_stderr(environ):
    """Return what a program prints that creates a node."""
    program = "from idlc.robot import Node, init\nwith init(): Node('a').destroy_node()"
    with held_domain() as domain:
        environ = {**os.environ, **environ, "ROS_DOMAIN_ID": str(domain)}
        done = subprocess.run(
            [sys.executable, "-c", program], env=environ, capture_output=True, text=True, check=True
        )
    warnings = re.findall(r"\[WARN\] \[[\d.]+\] \[idlc\]: (.*)", done.stderr)
    return "; ".join(warnings)


def test_a_participant_listens_on_loopback_and_each_on_a_port_of_its_own():
    place = parse_place("dds:231", None, {})
    first, second = (open_sockets(place) for _ in range(2))
    try:
        addresses = [each.getsockname() for each in (*first, *second)]
        assert {host for host, _ in addresses} == {LOCAL}
        assert len({port for _, port in addresses}) == 2
    finally:
        for each in (*first, *second):
            each.close()


def test_a_full_domain_is_one_sentence(monkeypatch):
    class Full(socket.socket):
        def bind(self, _address):
            raise OSError

    monkeypatch.setattr("idlc.robot.dds.address.socket.socket", Full)
    with pytest.raises(RobotError, match="all ports of 120 participants of domain 0 are in use"):
        open_sockets(parse_place("dds", None, {}))
