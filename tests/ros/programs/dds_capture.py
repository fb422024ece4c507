"""Packets that another implementation of DDS sends to idlc, one of each shape, in hexadecimal.

  Usage: python dds_capture.py PROGRAM > golden/dds/NAME.txt

PROGRAM is `dds_peer.py`, also with another rmw in the place of Fast DDS, or `cyclone_peer.py`.
Then `IDLC_REFRESH=1` with pytest adds what idlc reads in them. One packet of idlc gets lost, so
that its reader asks for it. The names of the machine and of its user become letters.
"""

import getpass
import os
import re
import socket
import subprocess
import sys
import time
from pathlib import Path

import idlc
from idlc.robot import Node, QoSProfile, open_session
from idlc.robot.dds import wire

HERE = Path(__file__).parent
MACHINE = Path("/etc/machine-id")
ALL = QoSProfile(history=2)
String = idlc.load("std_msgs/msg/String").String
SetBool = idlc.load("std_srvs/srv/SetBool").SetBool


def shape(packet):
    """Return what makes packets alike: the kinds of their parts, and the parameters."""
    parsed = wire.parse_packet(packet)
    parts = (
        (type(part).__name__, part.writer[-1], *getattr(part, "parameters", ()))
        for _, part in parsed.parts
    )
    first = next((part.writer[2] for _, part in parsed.parts), 0)
    return first < 4, tuple(parts)


def main(program):
    environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    command = [sys.executable, HERE / program]
    packets = {}
    with (
        subprocess.Popen(command, env=environment, stdin=-1, stdout=subprocess.DEVNULL) as peer,
        open_session("dds", environ=environment) as session,
    ):
        participant = session.transport._connection.participant
        receive = participant.receive

        def note(packet, source, now):
            if len(packet) < 3000:
                packets.setdefault(shape(packet), packet)
            return receive(packet, source, now)

        send, large = session.transport._connection._send, []

        def lose(packet, target):
            if len(packet) > 50_000 and not large:
                large.append(packet)
                return
            send(packet, target)

        participant.receive, session.transport._connection._send = note, lose
        node = Node("ours", session=session)
        words, client = (
            node.create_publisher(String, "words", ALL),
            node.create_client(SetBool, "theirs"),
        )
        node.create_subscription(String, "back", lambda _: None, ALL)
        time.sleep(2)  # so that the next one comes late
        node.create_subscription(String, "latched", lambda _: None, ALL)
        end = time.monotonic() + 4
        while time.monotonic() < end:
            words.publish(String(data="x" * 10))
            words.publish(String(data="y" * 2500))
            words.publish(String(data="z" * 100_000))
            client.call_async(SetBool.Request(data=True))
            time.sleep(0.5)
        peer.stdin.close()
        peer.wait(30)
        time.sleep(0.5)
    secrets = {socket.gethostname(), getpass.getuser(), *MACHINE.read_text("ascii").split()}
    for packet in packets.values():
        for secret in secrets:
            packet = packet.replace(secret.encode(), b"x" * len(secret))
        packet = re.sub(rb"\d{16,}", lambda number: b"1" * len(number[0]), packet)
        sys.stdout.write(packet.hex() + "\n")


main(sys.argv[1])
