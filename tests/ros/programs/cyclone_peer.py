"""An endpoint of Cyclone DDS, without ROS 2, that echoes a topic; it ends with its input."""

import os
import sys
import threading
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
LATCHED = Qos(
    RELIABLE,
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(3),
    # what late readers get, as rmw_cyclonedds_cpp sets it
    Policy.DurabilityService(0, Policy.History.KeepLast(3), -1, -1, -1),
)
ALL = Qos(RELIABLE, Policy.History.KeepAll)


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


def end(kind, name, qos):
    return kind(participant, Topic(participant, name, String, qos=qos), qos=qos)


def wait():
    sys.stdin.read()
    os._exit(0)


threading.Thread(target=wait, daemon=True).start()
participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
latched = end(DataWriter, "rt/latched", LATCHED)
for number in range(5):
    latched.write(String(data=str(number)))
back, words = end(DataWriter, "rt/back", ALL), end(DataReader, "rt/words", ALL)
while True:
    for word in words.take(1000):
        if isinstance(word, String):  # else it says that the other side left
            back.write(word)
    time.sleep(0.001)
