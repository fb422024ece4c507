"""What each endpoint of a node adds to its module: lines of `__init__`, methods, imports."""

from __future__ import annotations

from typing import NamedTuple

from idlc.emit import pynames
from idlc.model import derive, ir
from idlc.scaffold.line_breaks import call, logged, signature
from idlc.scaffold.samples import Page, assigned, constructed
from idlc.scaffold.spec import Endpoint

#: How often a publisher publishes unless it is said, in Hz.
DEFAULT_RATE = 1.0
#: Fields that are named in a line of the log.
LOGGED = 6
#: As much of a line of the log as tests look for.
HEAD = 50
#: Longer names of topics are shown shortened.
SHOWN = 40

#: What roles import from rclpy, beside what every node does.
IMPORTS: dict[str, dict[str, tuple[str, ...]]] = {
    "action_server": {
        "rclpy.action.server": (
            "ActionServer",
            "CancelResponse",
            "GoalResponse",
            "ServerGoalHandle",
        ),
    },
    "action_client": {
        "action_msgs.msg": ("GoalStatus",),
        "rclpy.action.client": ("ActionClient", "ClientGoalHandle"),
        "typing": ("Any",),
    },
}
QOS = {"default": "10", "sensor_data": "qos_profile_sensor_data", "latched": "LATCHED"}
QOS_IMPORTS: dict[str, tuple[str, ...]] = {
    "default": (),
    "sensor_data": ("qos_profile_sensor_data",),
    "latched": ("DurabilityPolicy", "QoSProfile"),
}
#: The steps of a lifecycle that a node takes and undoes.
CONFIGURE, ACTIVATE = "configure", "activate"
LATCHED = "LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)"


class Part(NamedTuple):
    """An endpoint as its template shows it, and where in the class its lines go.

    `start`, `create` and `work` are lines of `__init__`; in a lifecycle node the second
    belong to its configuration and the third to its activation, each with the line that undoes it.
    `heads` are the heads of its methods, `message` the lines that make what it sends, `answer`
    those that fill in a response, `log` those that show what it received.
    """

    role: str
    word: str
    topic: str
    type: str
    template: str
    heads: tuple[str, ...]
    message: str = ""
    answer: tuple[str, ...] = ()
    send: tuple[str, ...] = ()
    log: tuple[str, ...] = ()
    more_log: tuple[str, ...] = ()
    feedback: str = ""
    start: tuple[str, ...] = ()
    create: tuple[str, ...] = ()
    work: tuple[str, ...] = ()


class Endpoints:
    """Makes the parts of one module, which share its page of imports."""

    def __init__(self, page: Page, *, lifecycle: bool) -> None:
        self._page = page
        self._lifecycle = lifecycle

    def part(self, endpoint: Endpoint, word: str, interface: ir.Interface) -> Part:
        """Return what an endpoint adds to the module."""
        plain = Part(
            role=endpoint.role,
            word=word,
            topic=shown(endpoint, word),
            type=self._page.use(interface.name),
            template=f"node/{endpoint.role}.py.jinja",
            heads=(),
        )
        sections = derive.sections(interface)
        match endpoint.role:
            case "publisher":
                return self._publisher(plain, endpoint, sections[0])
            case "subscriber":
                return self._subscriber(plain, endpoint, sections[0])
            case "service":
                return self._service(plain, endpoint, *sections)
            case "client":
                return self._client(plain, endpoint, sections[1])
            case "action_server":
                return self._action_server(plain, endpoint, *sections)
            case "action_client":
                return self._action_client(plain, endpoint, *sections)

    def _publisher(self, part: Part, endpoint: Endpoint, message: ir.Message) -> Part:
        word = part.word
        method = "create_lifecycle_publisher" if self._lifecycle else "create_publisher"
        words = [part.type, repr(endpoint.topic), QOS[endpoint.qos]]
        every = interval(1.0 / (endpoint.rate or DEFAULT_RATE))
        publisher, timer = f"self.{word}_publisher", f"self.{word}_timer"
        return part._replace(
            heads=(signature(f"def publish_{word}", ["self"], "None", depth=1),),
            message=constructed(message, self._page, head="message = ", depth=2),
            create=(
                *call(f"{publisher} = self.{method}", words, depth=2),
                *self._undo(CONFIGURE, "self.destroy_lifecycle_publisher", publisher),
            ),
            work=(
                *call(f"{timer} = self.create_timer", [every, f"self.publish_{word}"], depth=2),
                *self._undo(ACTIVATE, "self.destroy_timer", timer),
            ),
        )

    def _subscriber(self, part: Part, endpoint: Endpoint, message: ir.Message) -> Part:
        word = part.word
        callback, subscription = f"self.receive_{word}", f"self.{word}_subscription"
        words = [part.type, repr(endpoint.topic), callback, QOS[endpoint.qos]]
        head = signature(f"def receive_{word}", ["self", f"message: {part.type}"], "None", depth=1)
        return part._replace(
            heads=(head,),
            log=_log(part.topic, "message", message),
            work=(
                *call(f"{subscription} = self.create_subscription", words, depth=2),
                *self._undo(ACTIVATE, "self.destroy_subscription", subscription),
            ),
        )

    def _service(
        self, part: Part, endpoint: Endpoint, request: ir.Message, response: ir.Message
    ) -> Part:
        word, type_ = part.word, part.type
        parameters = ["self", f"request: {type_}.Request", f"response: {type_}.Response"]
        words = [type_, repr(endpoint.topic), f"self.handle_{word}"]
        return part._replace(
            heads=(signature(f"def handle_{word}", parameters, f"{type_}.Response", depth=1),),
            log=_log(part.topic, "request", request),
            answer=tuple(assigned(response, self._page, "response", depth=2)),
            work=(
                *call(f"self.{word}_service = self.create_service", words, depth=2),
                *self._undo(ACTIVATE, "self.destroy_service", f"self.{word}_service"),
            ),
        )

    def _client(self, part: Part, endpoint: Endpoint, response: ir.Message) -> Part:
        word = part.word
        parameters = ["self", f"request: {part.type}.Request"]
        words = [part.type, repr(endpoint.topic)]
        return part._replace(
            heads=(signature(f"async def call_{word}", parameters, "bool", depth=1),),
            log=_log(part.topic, "response", response),
            create=(
                *call(f"self.{word}_client = self.create_client", words, depth=2),
                *self._undo(CONFIGURE, "self.destroy_client", f"self.{word}_client"),
            ),
        )

    def _action_server(
        self,
        part: Part,
        endpoint: Endpoint,
        goal: ir.Message,
        result: ir.Message,
        feedback: ir.Message,
    ) -> Part:
        word, type_ = part.word, part.type
        handle = "goal_handle: ServerGoalHandle"
        heads = (
            signature(
                f"def accept_{word}", ["self", f"goal: {type_}.Goal"], "GoalResponse", depth=1
            ),
            signature(f"def begin_{word}", ["self", handle], "None", depth=1),
            signature(f"def cancel_{word}", ["self", handle], "CancelResponse", depth=1),
            signature(f"async def execute_{word}", ["self", handle], f"{type_}.Result", depth=1),
            signature(f"def close_{word}", ["self"], "None", depth=1),
        )
        words = [
            *("self", type_, repr(endpoint.topic)),
            f"execute_callback=self.execute_{word}",
            f"goal_callback=self.accept_{word}",
            f"handle_accepted_callback=self.begin_{word}",
            f"cancel_callback=self.cancel_{word}",
        ]
        log = _log(part.topic, "goal", goal)
        return part._replace(
            heads=heads,
            message=constructed(result, self._page, head="result = ", depth=2),
            feedback=constructed(feedback, self._page, head="feedback = ", depth=3),
            log=(f"goal: {type_}.Goal = goal_handle.request", *log) if goal.fields else log,
            start=(
                *((f"self.{word}_open = False",) if self._lifecycle else ()),
                f"self.{word}_goal: ServerGoalHandle | None = None",
            ),
            create=(
                *call(f"self.{word}_server = ActionServer", words, depth=2),
                *self._undo(CONFIGURE, "self.spawn", "self.retire", f"self.{word}_server"),
            ),
            work=(
                *((f"self.{word}_open = True",) if self._lifecycle else ()),
                *self._undo(ACTIVATE, f"self.close_{word}"),
            ),
        )

    def _action_client(
        self,
        part: Part,
        endpoint: Endpoint,
        goal: ir.Message,  # noqa: ARG002 - as of servers
        result: ir.Message,
        feedback: ir.Message,
    ) -> Part:
        word, type_ = part.word, part.type
        heads = (
            signature(f"async def send_{word}", ["self", f"goal: {type_}.Goal"], "bool", depth=1),
            signature(f"def follow_{word}", ["self", "message: Any"], "None", depth=1),
            signature(f"async def cancel_{word}", ["self"], "None", depth=1),
            signature(f"def drop_{word}", ["self"], "None", depth=1),
        )
        reported = _log(part.topic, "feedback", feedback)
        if feedback.fields:
            reported = (f"feedback: {type_}.Feedback = message.feedback", *reported)
        log = _log(part.topic, "result", result)
        if result.fields:
            log = (f"result: {type_}.Result = ending.result().result", *log)
        words = ["self", type_, repr(endpoint.topic)]
        return part._replace(
            heads=heads,
            log=log,
            more_log=reported,
            send=tuple(
                call(
                    f"sent = self.{word}_client.send_goal_async",
                    ["goal", f"feedback_callback=self.follow_{word}"],
                    depth=2,
                )
            ),
            start=(f"self.{word}_sent: Future | None = None",),
            create=(
                *call(f"self.{word}_client = ActionClient", words, depth=2),
                *self._undo(CONFIGURE, "self.spawn", "self.retire", f"self.{word}_client"),
            ),
            work=self._undo(ACTIVATE, f"self.drop_{word}"),
        )

    def _undo(self, what: str, *words: str) -> tuple[str, ...]:
        """Return the line by which a lifecycle node knows how to undo the line before."""
        return undo(what, *words) if self._lifecycle else ()


def undo(what: str, *words: str) -> tuple[str, ...]:
    """Return the line that remembers a call by which to undo a step of the lifecycle."""
    return tuple(call(f"self.undo_{what}.callback", words, depth=2))


def interval(seconds: float) -> str:
    """Return a period in seconds as source."""
    text = repr(round(seconds, 6))
    return text if abs(float(text) - seconds) < seconds * 1e-9 else f"1.0 / {1.0 / seconds:.6g}"


def shown(endpoint: Endpoint, word: str) -> str:
    """Return how an endpoint is called in text."""
    return endpoint.topic if len(endpoint.topic) <= SHOWN else word


def _log(topic: str, variable: str, message: ir.Message) -> tuple[str, ...]:
    """Return the lines that log what a message says, its short fields one by one."""
    return tuple(logged(_said(topic, variable, message), depth=2))


def log_head(topic: str, variable: str, message: ir.Message) -> str:
    """Return how the line begins that logs a message."""
    return " ".join(_said(topic, variable, message)).partition("{")[0][:HEAD]


def _said(topic: str, variable: str, message: ir.Message) -> list[str]:
    short = [f for f in message.fields if isinstance(f.type, (ir.Primitive, ir.String))]
    parts = [f"{f.name}={{{variable}.{pynames.field(f.name)}!r}}" for f in short[:LOGGED]]
    if not parts:
        parts = [f"{variable}={{{variable}}}"] if message.fields else [f"{variable} received"]
    return [f"{topic}:", *parts]
