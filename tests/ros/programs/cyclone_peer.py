"""Endpoints of Cyclone DDS, without ROS 2, that echo a topic; they end with the input.

One serves, and one calls, as rmw_cyclonedds_cpp does: the messages begin with two numbers.
"""

import json
import os
import sys
import threading
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int64, uint64
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


@dataclass
class Request(IdlStruct, typename="std_srvs::srv::dds_::SetBool_Request_"):
    client: uint64
    number: int64
    data: bool


@dataclass
class Response(IdlStruct, typename="std_srvs::srv::dds_::SetBool_Response_"):
    client: uint64
    number: int64
    success: bool
    message: str


def end(kind, name, qos, type_=String):
    return kind(participant, Topic(participant, name, type_, qos=qos), qos=qos)


def wait():
    sys.stdin.read()
    os._exit(0)


threading.Thread(target=wait, daemon=True).start()
participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
latched = end(DataWriter, "rt/latched", LATCHED)
for number in range(5):
    latched.write(String(data=str(number)))
back, words = end(DataWriter, "rt/back", ALL), end(DataReader, "rt/words", ALL)
asked, answers = (
    end(DataReader, "rq/theirsRequest", ALL, Request),
    end(DataWriter, "rr/theirsReply", ALL, Response),
)
ask, answered = (
    end(DataWriter, "rq/oursRequest", ALL, Request),
    end(DataReader, "rr/oursReply", ALL, Response),
)
CLIENT, NUMBER = 2**63 + 5, 2**33 + 7
is_asked = False
while True:
    # each may say that the other side left, and is no message then
    for word in words.take(1000):
        if isinstance(word, String):
            back.write(word)
    for each in asked.take(1000):
        if isinstance(each, Request):
            answers.write(Response(each.client, each.number, each.data, "theirs"))
    for each in answered.take(1000):
        if isinstance(each, Response) and (each.client, each.number) == (CLIENT, NUMBER):
            print(json.dumps(["service", each.message]), flush=True)
    is_known = ask.get_matched_subscriptions() and answered.get_matched_publications()
    if is_known and not is_asked:
        ask.write(Request(CLIENT, NUMBER, True))
        is_asked = True
    time.sleep(0.001)
