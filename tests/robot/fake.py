"""A robot on the transport alone: endpoints, the type description service, and a service."""

import copy
import time
from collections import deque
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Timer

from idlc.api.sources import load
from idlc.diagnostics.report import Report
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.robot.keys import Entity, EntityKind, pack_attachment
from idlc.robot.names import action_names
from idlc.robot.qos import QoSProfile
from idlc.robot.session import open_session
from idlc.tasks.show import requested_models

FILES = {
    "msg/Wheel.msg": "# one of them\nfloat64 speed 0.5  # [m/s]\nuint8[3] code\n",
    "msg/Drive.msg": (
        "std_msgs/Header header\nWheel[] wheels\nstring<=10 mode\nint8 gear\nint8 BACK=-1\n"
    ),
    "msg/Nothing.msg": "",
    "srv/Gear.srv": "int8 gear\nWheel wheel\n---\nbool done\nstring reason\n",
    "action/Move.action": "float64 distance\n---\nbool arrived\n---\nfloat64 left\n",
}
DESCRIBE = "type_description_interfaces/srv/GetTypeDescription"


def damaged(text):
    """Return a text as rosidl puts it into nodes; a default value has one line."""
    return "\n".join(repr(line.encode())[2:-1] for line in text.splitlines())[: len(text)]


def with_damaged_defaults(description):
    """Return a description as nodes of ROS 2 send it."""
    description = copy.deepcopy(description)
    for part in (description["type_description"], *description["referenced_type_descriptions"]):
        for field in part["fields"]:
            field["default_value"] = damaged(field["default_value"])
    return description


def write_files(folder, files=FILES):
    """Write the package demo_msgs and return its folder."""
    for name, text in files.items():
        path = Path(folder, "demo_msgs", name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return Path(folder, "demo_msgs")


@cache
def described(name, files):
    """Return the hash of a type and its description, from the files or the catalogue."""
    with TemporaryDirectory() as folder:
        write_files(folder, dict(files))
        root = Root.at(Path(folder))
        subject = "demo_msgs" if name.startswith("demo_msgs/") else name
        for model, _ in requested_models((subject,), Scope(root), Report()):
            interface = next(own for own in model.own if name.startswith(str(own.name)))
            description = model.describer.description(name)
            return model.describer.hash(name), description, str(interface.name)
    raise AssertionError(name)


@cache
def demo_classes():
    with TemporaryDirectory() as folder:
        return load(str(write_files(folder)))


def standard(name):
    return load(name, distro="jazzy")[name]


class Robot:
    """A node `/driver` in a session of its own; `close` ends it."""

    def __init__(self, address, node="driver", files=FILES, domain=None):
        self.address = address
        self.session = open_session(address, domain=domain, environ={})
        self.transport = self.session.transport
        # another session, so that a test begins when the router knows what the robot announced
        self.observer = open_session(address, domain=domain, environ={})
        self.files = files
        self.node = node
        self.requests = []
        self.like_rosidl = False
        self.node_id = self.session.next_id()
        self.declared = []
        self.announce(EntityKind.NODE)

    def announce(self, kind, name="", type_="", hash_=None, qos=None, wait=True, declare=None):
        """Show an entity; `declare` declares its end, without which DDS shows nothing."""
        if hash_ is None:
            hash_ = described(type_, tuple(self.files.items()))[0] if type_ else ""
        entity = Entity(
            domain=self.session.domain,
            session=self.session.id,
            node_id=self.node_id,
            id=self.node_id if kind is EntityKind.NODE else self.session.next_id(),
            kind=kind,
            node=self.node,
            name=name,
            type=type_,
            hash=hash_,
            qos=qos or QoSProfile(depth=10),
        )
        if declare is None and self.address.startswith("dds") and kind is not EntityKind.NODE:
            declare = self.declare_idle
        if declare is not None:
            self.declared.append(declare(entity))
        self.declared.append(self.transport.announce(entity))
        if wait:
            self.await_count(kind, name, 1)
        return entity

    def declare_idle(self, entity):
        """Declare an end that neither sends nor answers."""
        if entity.kind is EntityKind.PUBLISHER:
            return self.transport.publisher(entity)
        if entity.kind is EntityKind.SERVICE:
            return self.transport.service(entity, lambda request: request.drop())
        return self.transport.subscriber(entity, lambda _: None)

    def await_count(self, kind, name, count):
        """Wait until the router knows this many entities of the robot's, of any name if empty."""
        mine = self.session.id

        def seen(graph):
            entities = graph.entities(kind, name=name or None)
            return sum(entity.session == mine for entity in entities) >= count

        assert self.observer.graph.wait_for(seen, 60)

    def describe_types(self, answer=None, like_rosidl=False):
        """Offer the type description service, with other bytes if `answer` returns some.

        `like_rosidl`: texts and default values are damaged, and only ten requests wait.
        """
        self.like_rosidl = like_rosidl
        waiting = deque(maxlen=10)
        service = standard(DESCRIBE)

        def receive(request):
            waiting.append(request)  # what is dropped for it ends without a reply
            Timer(0.02, lambda: reply(waiting.popleft()) if waiting else None).start()

        def reply(request):
            asked = service.Request.deserialize(request.payload)
            self.requests.append(asked.type_name)
            data = answer(asked) if answer else None
            data = self.description(service, asked) if data is None else data
            if data:
                request.reply(data, request.attachment)
            else:
                request.drop()

        name, callback = f"/{self.node}/get_type_description", receive if like_rosidl else reply
        declare = partial(self.transport.service, callback=callback)
        self.announce(EntityKind.SERVICE, name, DESCRIBE, declare=declare)

    def description(self, service, asked):
        hash_, description, interface = described(asked.type_name, tuple(self.files.items()))
        if hash_ != asked.type_hash:
            return service.Response(failure_reason="unknown hash").serialize()
        names = [part["type_name"] for part in description["referenced_type_descriptions"]]
        sources = []
        for name in (asked.type_name, *names):
            package, kind, own = name.split("/")
            text = self.files.get(f"{kind}/{own}.{kind}") if package == "demo_msgs" else None
            # what is derived from other files comes without a text
            encoding, text = ("implicit", "") if text is None else (kind, text)
            if package == "demo_msgs" and kind != "action":
                text = damaged(text) if self.like_rosidl else text
                sources.append({"type_name": name, "encoding": encoding, "raw_file_contents": text})
        if self.like_rosidl:
            description = with_damaged_defaults(description)
        response = service.Response.from_dict(
            {"successful": True, "type_description": description, "type_sources": sources}
        )
        assert interface
        return response.serialize()

    def publisher(self, name, type_, qos=None, hash_=None):
        """Return a function that publishes a message or bytes."""
        declare = self.transport.publisher
        entity = self.announce(EntityKind.PUBLISHER, name, type_, hash_, qos, declare=declare)
        sender = self.declared[-2]
        count = iter(range(1, 1 << 30))

        def publish(message, attachment=None):
            data = message if isinstance(message, bytes) else message.serialize()
            if attachment is None:
                attachment = pack_attachment(next(count), time.time_ns(), entity.gid)
            sender.put(data, attachment=attachment)

        return publish

    def service(self, name, type_, kind, answer):
        """Serve requests of class `kind.Request`; `answer` returns a response or bytes."""

        def reply(request):
            made = answer(kind.Request.deserialize(request.payload))
            if made is None:
                request.drop()
            else:
                data = made if isinstance(made, bytes) else made.serialize()
                request.reply(data, request.attachment)

        declare = partial(self.transport.service, callback=reply)
        self.announce(EntityKind.SERVICE, name, type_, declare=declare)

    def action(self, name, type_):
        """Announce the five parts of an action server."""
        types = (
            f"{type_}_SendGoal",
            "action_msgs/srv/CancelGoal",
            f"{type_}_GetResult",
            f"{type_}_FeedbackMessage",
            "action_msgs/msg/GoalStatusArray",
        )
        for place, part in zip(action_names(name), types, strict=True):
            is_topic = place.endswith(("feedback", "status"))
            self.announce(EntityKind.PUBLISHER if is_topic else EntityKind.SERVICE, place, part)

    def close(self):
        self.observer.close()
        self.session.close()
