# mypy: disable-error-code="import-not-found,import-untyped"
# pyright: reportMissingImports=false, reportMissingTypeStubs=false
"""The classes that ROS 2 adds to services and actions: all are alike but for some types.

A service gets an Event. An action gets two services, the message of its feedback, and `Impl`,
in which rclpy looks for them. Their classes are composed when somebody asks for one, from the
classes here and the type data of the package.
"""

from __future__ import annotations

import sys
from _thread import allocate_lock
from struct import pack
from types import FunctionType

from . import codec
from .cdr import HEADERS, TRUTHS, counter, flags, listed, octets, order_of, wide_text
from .message import Message, OnDemand, Service, define, equal
from .names import owner_of, public_name, wire_name
from .sequences import ListOf, element_type, sequence_reader, sequence_writer

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, Generic, TypeAlias, TypeVar

    from typing_extensions import Unpack

    from .conversions import Options
    from .typeinfo import FieldInfo, Structure, Types

    # in some folders, one of these stands beside the package that this is copied to
    # isort: off
    from builtin_interfaces.msg import Time
    from service_msgs.msg import ServiceEventInfo
    from unique_identifier_msgs.msg import UUID
    # isort: on

    Goal = TypeVar("Goal")
    Result = TypeVar("Result")
    Feedback = TypeVar("Feedback")
    Request = TypeVar("Request")
    Response = TypeVar("Response")

    class Added(Message):
        """A message that ROS 2 adds."""

        def _fill(self, options: Options, *values: object) -> None: ...

else:
    from .sequences import Generic

    class Added:
        """The base of what holds the parts of messages, which itself is none."""

    Goal = Result = Feedback = Request = Response = None


class ActionImpl:
    """The attribute `Impl` of an action, which rclpy reads."""

    CancelGoalService = OnDemand("protocol", "find", "action_msgs/srv/CancelGoal")
    GoalStatusMessage = OnDemand("protocol", "find", "action_msgs/msg/GoalStatusArray")


def find(impl: type, name: str) -> Any:
    """Return what cancels goals of any action, or publishes their states."""
    from .typeinfo import types_of

    return types_of(impl).find_class(name)


# the fields of composed messages, as type checkers see them, constructors and docstrings


@define
class ServiceEvent(Added, Generic[Request, Response]):
    """Published about a call, where services are introspected. Added by ROS 2."""

    info: ServiceEventInfo
    request: list[Request]
    response: list[Response]

    def __init__(
        self,
        info: ServiceEventInfo | None = None,
        request: list[Request] | None = None,
        response: list[Response] | None = None,
        **options: Unpack[Options],
    ) -> None:
        self._fill(options, info, request, response)


@define
class SendGoalRequest(Added, Generic[Goal]):
    """Sent by a client to start a goal. Added by ROS 2."""

    goal_id: UUID
    goal: Goal

    def __init__(
        self,
        goal_id: UUID | None = None,
        goal: Goal | None = None,
        **options: Unpack[Options],
    ) -> None:
        self._fill(options, goal_id, goal)


@define
class SendGoalResponse(Added):
    """Tells a client whether a goal was accepted, and when. Added by ROS 2."""

    accepted: bool
    stamp: Time

    def __init__(
        self,
        accepted: bool = False,
        stamp: Time | None = None,
        **options: Unpack[Options],
    ) -> None:
        self._fill(options, accepted, stamp)


@define
class GetResultRequest(Added):
    """Sent by a client to wait for the result of a goal. Added by ROS 2."""

    goal_id: UUID

    def __init__(self, goal_id: UUID | None = None, **options: Unpack[Options]) -> None:
        self._fill(options, goal_id)


@define
class GetResultResponse(Added, Generic[Result]):
    """Tells a client how a goal ended, and its result. Added by ROS 2."""

    status: int
    result: Result

    def __init__(
        self, status: int = 0, result: Result | None = None, **options: Unpack[Options]
    ) -> None:
        self._fill(options, status, result)


@define
class FeedbackMessage(Added, Generic[Feedback]):
    """Published while a goal is executed. Added by ROS 2."""

    goal_id: UUID
    feedback: Feedback

    def __init__(
        self,
        goal_id: UUID | None = None,
        feedback: Feedback | None = None,
        **options: Unpack[Options],
    ) -> None:
        self._fill(options, goal_id, feedback)


if TYPE_CHECKING:

    class SendGoal(Service):
        """The service of an action that starts goals."""

        Response: TypeAlias = SendGoalResponse

    class GetResult(Service):
        """The service of an action that waits for results."""

        Request: TypeAlias = GetResultRequest


# composing

_lock = allocate_lock()


def event_of(service: Any) -> Any:
    """Return the event of a service, which the class then has, as its module has all names.

    Pickles look for classes there, and evaluated annotations for the names in them.
    """
    service = service.__mro__[-3]  # a user may derive a class from it
    with _lock:
        if "Event" not in vars(service):
            composition = _Composition(service, service.Request)
            call = f"a call of {composition.name}"
            service.Event = composition.add_message(
                f"{composition.name}_Event", ServiceEvent, call
            )
    return service.Event


def impl_of(action: Any) -> Any:
    """Return what rclpy needs of an action, in the same way."""
    action = action.__mro__[-3]
    with _lock:
        if "Impl" not in vars(action):
            action.Impl = _Composition(action, action.Goal).add_impl()
    return action.Impl


class _Composition:
    """Makes the classes of one service or action; `added` has them by name."""

    def __init__(self, group: Any, section: Any) -> None:
        from .typeinfo import structure_of

        own = structure_of(section)
        self.types = own.types
        self.kind = own.name.rpartition("/")[0]
        self.module: str = group.__module__
        self.scope = vars(sys.modules[self.module])
        self.name = wire_name(group.__name__)
        self.converts: bool = group._converts_
        self.added: dict[str, Any] = {}

    def add_impl(self) -> Any:
        goal = f"a {self.name} goal"
        sending, getting = f"{self.name}_SendGoal", f"{self.name}_GetResult"
        feedback = f"{self.name}_FeedbackMessage"
        self.add_message(f"{sending}_Request", SendGoalRequest, goal)
        self.add_message(f"{sending}_Response", SendGoalResponse, goal)
        self.add_message(f"{sending}_Event", ServiceEvent, f"a call that starts {goal}")
        self.add_message(f"{getting}_Request", GetResultRequest, goal)
        self.add_message(f"{getting}_Response", GetResultResponse, goal)
        self.add_message(
            f"{getting}_Event", ServiceEvent, "a call that waits for a result"
        )
        parts = {
            "FeedbackMessage": self.add_message(feedback, FeedbackMessage, goal),
            "SendGoalService": self.add_service(sending, f"Starts {goal}"),
            "GetResultService": self.add_service(
                getting, f"Waits for the result of {goal}"
            ),
        }
        name = f"{self.name}_Impl"
        return self.add(type, name, ActionImpl, ActionImpl.__doc__ or "", parts)

    def add_service(self, name: str, purpose: str) -> Any:
        """Add a service of an action; its messages are there already."""
        parts = {
            part: self.added[public_name(f"{name}_{part}")]
            for part in ("Request", "Response", "Event")
        }
        return self.add(
            type(Service), name, Service, f"{purpose}. Added by ROS 2.", parts
        )

    def add(
        self, make: Any, name: str, base: type, doc: str, parts: dict[str, Any]
    ) -> Any:
        name = public_name(name)
        place = {"__module__": self.module, "__qualname__": name, "__doc__": doc}
        self.scope[name] = self.added[name] = made = make(name, (base,), place | parts)
        return made

    def add_message(self, name: str, shape: Any, subject: str) -> Any:
        """Add a message, of the fields that the type data has; `shape` is its class here."""
        fields = self.types[f"{self.kind}/{name}"].fields
        defaults = shape.__init__.__defaults__
        hints = {field.name: self.hint(field) for field in fields}
        values = [None if self.converts else value for value in defaults]
        # a constructor as if it were of the module, where its annotations are
        code = shape.__init__.__code__
        constructor: Any = FunctionType(code, self.scope, "__init__", tuple(values))
        constructor.__qualname__ = f"{public_name(name)}.__init__"
        constructor.__module__ = __name__  # where its source is
        constructor.__annotations__ = {
            field: hint.replace("ListOf", "Iterable") + " | None" * (value is None)
            for (field, hint), value in zip(hints.items(), values, strict=True)
        } | {"options": "_idlc.Unpack[_idlc.Options]", "return": "None"}
        parts: dict[str, Any] = {
            "__match_args__": tuple(hints),
            "__annotations__": hints,
            "__init__": constructor,
            "__eq__": equal,
            "_fill": _fill,
            "_usual": type(defaults[0]),
            "_makers": {
                field.name if field.is_list else field.slot: self.maker(field)
                for field in fields
            },
            "_fields_and_field_types": {
                field.name: _spell(field, "boolean", "sequence<{}, {}>")
                for field in fields
            },
        }
        if self.converts:
            parts |= {field.name: ListOf() for field in fields if field.is_list}
        if shape in (ServiceEvent, SendGoalResponse, GetResultRequest):
            parts["_codec_"] = OnDemand("protocol", "field_codecs")
        purpose = f"{shape.__doc__}".replace("a call", subject).replace(
            "a goal", subject
        )
        entries = [f"        {field.name}: {_spell(field)}\n" for field in fields]
        doc = f"{purpose}\n\n    Attributes:\n{''.join(entries)}    "
        return self.add(type(Message), name, Message, doc, parts)

    def hint(self, field: FieldInfo) -> str:
        if field.nested is None:
            return _plain(field).__name__
        kind, _, short = field.nested.name.rpartition("/")
        hint = public_name(short)
        if kind != self.kind:
            package = f"_{kind.replace('/', '_')}"
            self.scope.setdefault(package, _Package(self.types, kind))
            hint = f"{package}.{hint}"
        if field.is_list:
            return f"_idlc.ListOf[{hint}]" if self.converts else f"list[{hint}]"
        return hint

    def maker(self, field: FieldInfo) -> Callable[[], Any]:
        if field.is_list:
            return list
        if field.nested is None:
            return _plain(field)
        from functools import cache

        kind = cache(field.nested.find_class)
        return lambda: kind()()


class _Package:
    """The classes of another package, imported on first access to one of them."""

    def __init__(self, types: Types, kind: str) -> None:
        self._types = types
        self._kind = kind

    def __getattr__(self, name: str) -> Any:
        """Return a class; what begins with an underscore is none."""
        if name[0] == "_":
            raise AttributeError(f"{self._kind} has no class {name!r}")
        return self._types[f"{self._kind}/{wire_name(name)}"].find_class()


def _fill(self: Any, options: Any, *values: Any) -> None:
    """Set the fields of a new message."""
    if options or values[0].__class__ is not self._usual:
        from .checked import construct

        arguments = dict(zip(self.__match_args__, values, strict=True))
        if construct(self, options, arguments):
            return
    for (name, make), value in zip(self._makers.items(), values, strict=True):
        setattr(self, name, make() if value is None else value)


def _plain(field: FieldInfo) -> type:
    return bool if _spell(field) == "bool" else int


def _spell(field: FieldInfo, boolean: str = "bool", listed: str = "{}[<={}]") -> str:
    """Return the type of a field in words of ROS 2."""
    if field.primitive is not None:
        return boolean if field.primitive.code == "?" else field.primitive.name
    assert field.nested is not None
    package, _, short = field.nested.name.split("/")
    name = f"{package}/{short}"
    return listed.format(name, field.bound) if field.is_list else name


# codecs of what is rarely sent


def field_codecs(kind: type) -> codec.Codecs:
    """Return codecs that read and write a message field by field, as the type data has them."""
    from functools import cache

    from .typeinfo import CarefulReader, structure_of

    owner = owner_of(kind)
    structure = structure_of(owner)

    @cache
    def maker_of(other: Structure) -> Any:
        return codec.maker(owner if other is structure else other.find_class())

    def make(_owner: Any, order: str, reading: codec.Reading) -> codec.Codec:
        def numbers(message: Any, field: Any, raw: Any) -> Any:
            if field.is_sequence:
                code, own = field.primitive.code, reading.of(type(message))
                element = element_type(order, code, own)
                count = len(raw) // field.primitive.size
                return sequence_reader(order, code, own)(raw, element, count, 0)
            from .arrays import array_reader

            return array_reader(order, field.primitive.name, field.size, reading)(raw)

        def encode(message: Any, join: Any) -> Any:
            writer = _Writer(order)
            writer.message(message, structure)
            return join(writer.parts)

        def decode(data: Any) -> Any:
            if not reading.copy:
                data = memoryview(data)
            reader = CarefulReader(
                data, order_of(data), lambda other: maker_of(other)(), numbers
            )
            return reader.message(structure, "")

        return codec.Codec(encode, decode, bulk=True)

    return codec.keep_codecs(owner, make)


class _Writer:
    """Goes over a message; `parts` are its bytes up to the position `at`."""

    def __init__(self, order: str) -> None:
        self.order = order
        self.parts: list[bytes] = [HEADERS[order]]
        self.at = 4

    def put(self, raw: bytes, align: int) -> None:
        """Write bytes and the padding before them."""
        padding = (4 - self.at) % align
        self.parts.append(bytes(padding) + raw)
        self.at += padding + len(raw)

    def message(self, message: Any, structure: Structure) -> None:
        if not structure.fields:
            self.put(b"\0", 1)
        for field in structure.fields:
            value = getattr(message, field.slot)
            if field.is_list:
                self.elements(value, field)
            else:
                self.element(value, field)

    def elements(self, values: Any, field: FieldInfo) -> None:
        """Write an array or sequence, as it is at this moment."""
        primitive, count = field.primitive, counter(self.order, field.size, field.bound)
        if primitive is None:
            values = listed(values)
            self.put(count(len(values)), 4 if field.is_sequence else 1)
            for value in values:
                self.element(value, field)
            return
        if primitive.code in "?c":
            raw = (flags if primitive.code == "?" else octets)(values)
        elif field.size is None:
            raw = bytes(memoryview(sequence_writer(self.order, primitive.code)(values)))
        else:
            from .arrays import array_writer

            raw = array_writer(self.order, primitive.name, field.size)(values)
        self.put(count(len(raw) // primitive.size), 4 if field.is_sequence else 1)
        if raw:
            self.put(raw, primitive.size)

    def element(self, value: Any, field: FieldInfo) -> None:
        if field.nested:
            self.message(value, field.nested)
        elif field.primitive is not None:
            if field.primitive.code == "?":
                value = TRUTHS[value]
            raw = pack(self.order + field.primitive.code, value)
            self.put(raw, field.primitive.size)
        elif field.wide:
            raw = wide_text(self.order)(value)
            self.put(pack(self.order + "I", len(raw) // 4) + raw, 4)
        else:
            raw = value.encode() + b"\0"
            self.put(pack(self.order + "I", len(raw)) + raw, 4)
