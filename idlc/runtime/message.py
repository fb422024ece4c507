"""The bases of generated messages, services and actions, and their metaclasses.

A message class declares `_fields_and_field_types`. Its metaclass makes a slot of each field,
named as rosidl names it (`_stamp`), and gives it its public name (`stamp`): the same slot, or a
property that converts for numeric arrays. Nothing else is computed until it is asked for.
Services and actions are names for their messages, never instances.
"""

from __future__ import annotations

import sys
from array import array

from . import codec
from .names import owner_of, public_name, slot_name, wire_name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from dataclasses import Field
    from functools import partial
    from typing import Any, ClassVar, Literal, TypeVar

    import typing_extensions
    from typing_extensions import dataclass_transform

    Kind = TypeVar("Kind", bound=type)

    @dataclass_transform(kw_only_default=True)
    def define(kind: Kind) -> Kind:
        """Return a generated class, in which type checkers see the dataclass that it is."""
        return kind

else:
    from _functools import partial

    def define(kind):
        """Return a generated class as it is."""
        return kind


# attributes on first access


class OnDemand:
    """A class attribute that is made on first access.

    An error in that is an AttributeError, as code that looks at all attributes of a class expects.
    """

    def __init__(self, module: str, function: str, *arguments: str) -> None:
        self._module = f"{__package__}.{module}"
        self._function = function
        self._arguments = arguments

    def __get__(self, instance: object, owner: type) -> Any:
        """Return what a function of the runtime makes for a class."""
        try:
            module = __import__(self._module, fromlist=[self._function])
            return getattr(module, self._function)(owner, *self._arguments)
        except Exception as error:
            raise AttributeError(str(error)) from error


def _columns() -> Any:
    """Return what reads columns: a part of idlc, of whichever version is installed."""
    try:
        return __import__("idlc.recordings.columns", fromlist=["to_columns"])
    except ImportError as error:
        raise ImportError(
            f"columns are read by idlc, which cannot be imported ({error}): "
            f"pip install --upgrade 'idlc[recordings]'",
            name=error.name,
        ) from error


# comparing, copying and showing messages

#: Values that a copy may share.
ATOMIC = frozenset({bool, bytes, float, int, str})
#: Elements up to which Python compares two arrays before numpy has begun.
SMALL = 64
#: Packages that are shown under other names than they are imported by.
SHOWN: dict[str, str] = {}


def equal(message: Any, other: Any) -> bool:
    """Compare a message with one of its class or of a copy of that, which has the same fields."""
    owner = owner_of(type(message))
    if not isinstance(other, owner):
        from .typeinfo import is_copy

        if not is_copy(owner, type(other)):
            return NotImplemented  # type: ignore[no-any-return]
    return all(
        same(getattr(message, slot), getattr(other, slot)) for slot in owner.__slots__
    )


def same(mine: Any, other: Any) -> bool:
    """Return whether two fields of numbers, bools or bytes are equal, whatever holds them."""
    kind = type(mine)
    if kind is array and type(other) is array and mine.typecode == other.typecode:
        if mine.typecode in "fd":  # no nan is equal to another
            return memoryview(mine) == memoryview(other)
        # only `bytes` and `bytearray` compare memory at once
        return bytearray(mine) == other
    if kind.__module__ == "numpy" or type(other).__module__ == "numpy":
        import numpy as np

        if type(other) is kind is np.ndarray and len(mine) <= SMALL:
            return bool(mine.data == other)
        return np.array_equal(mine, other)
    return bool(mine == other)


def copied(message: Any, memo: dict[int, Any] | None = None) -> Any:
    """Return a copy; with the memo of `deepcopy`, it shares nothing that can change."""
    kind = type(message)
    duplicate, store = object.__new__(kind), object.__setattr__
    if owner_of(kind) is kind:
        if memo is None:
            for slot in kind.__slots__:
                store(duplicate, slot, getattr(message, slot))
            return duplicate
        state = {slot: getattr(message, slot) for slot in kind.__slots__}
    else:  # a user's subclass, which may have more than slots
        reduced: Any = object.__reduce_ex__(message, 4)
        parts = reduced[2] if isinstance(reduced[2], tuple) else (reduced[2],)
        state = {name: part[name] for part in parts for name in part or ()}
    if memo is not None:
        from copy import deepcopy

        memo[id(message)] = duplicate
        for name, value in state.items():
            if type(value) not in ATOMIC:
                state[name] = deepcopy(value, memo)
    for name, value in state.items():
        store(duplicate, name, value)
    return duplicate


def represented(message: Any) -> str:
    """Return a message as rosidl shows it."""
    parts = []
    for field in message._fields_and_field_types:
        value = getattr(message, slot_name(field))
        shown = value.tolist() if type(value) is array else value
        parts.append(f"{field}={shown!r}")
    return f"{_shown_name(type(message))}({', '.join(parts)})"


# pprint knows what can be shown field by field from where dataclasses make `__repr__`
represented.__qualname__ = "__create_fn__.<locals>.__repr__"


def _shown_name(kind: type) -> str:
    """Return a class's name after that of its package, its module left out."""
    package = kind.__module__.rpartition(".")[0]
    home, _, last = package.rpartition(".")
    if home in SHOWN:
        package = f"{SHOWN[home]}.{last}"
    return f"{package}.{kind.__name__}" if package else kind.__name__


def named_values(message: Any) -> Iterator[tuple[str, Any]]:
    """Yield each field's Python name and value, those that a user's subclass adds included."""
    import dataclasses

    for field in dataclasses.fields(message):
        yield field.name, getattr(message, field.name)


def pretty(message: Any, printer: Any, cycle: bool) -> None:
    """Show a message on as many lines as it takes, with IPython's pretty printer."""
    name = _shown_name(type(message))
    if cycle:
        printer.text(f"{name}(...)")
        return
    with printer.group(len(name) + 1, f"{name}(", ")"):
        for index, (field, value) in enumerate(named_values(message)):
            if index:
                printer.text(",")
                printer.breakable()
            printer.text(f"{field}=")
            printer.pretty(value.tolist() if type(value) is array else value)


# messages


class InterfaceMeta(type):
    """The attributes that rclpy reads from a metaclass; one subclass for each interface."""

    _TYPE_SUPPORT: ClassVar[Any] = None

    def __setattr__(cls, name: str, value: object) -> None:
        if name.isupper() and name[0] != "_" and hasattr(cls, name):
            raise AttributeError(f"{cls.__name__}.{name} is a constant")
        super().__setattr__(name, value)


def metaclass_of(
    base: type[InterfaceMeta], name: str, namespace: dict[str, Any]
) -> Any:
    """Return a metaclass for one interface, in the module of its class like rosidl's."""
    module = namespace["__module__"]
    metaclass = type(f"Metaclass_{name}", (base,), {"__module__": module})
    setattr(sys.modules.get(module), metaclass.__name__, metaclass)
    return metaclass


class MessageMeta(InterfaceMeta):
    """Makes a message class from `_fields_and_field_types`."""

    _CREATE_ROS_MESSAGE: ClassVar[Any] = None
    _CONVERT_FROM_PY: ClassVar[Any] = None
    _CONVERT_TO_PY: ClassVar[Any] = None
    _DESTROY_ROS_MESSAGE: ClassVar[Any] = None

    #: The message class that a metaclass was made for.
    _message: ClassVar[Any] = None

    def __new__(
        cls,
        name: str,
        bases: tuple[type, ...],
        namespace: dict[str, Any],
        **options: Any,
    ) -> Any:
        """Return a message class, or a user's subclass of one."""
        fields = namespace.get("_fields_and_field_types")
        if fields is None:
            if not bases:
                return super().__new__(cls, name, bases, namespace)
            return _subclass(cls, name, bases, namespace, options)
        metaclass = metaclass_of(cls, name, namespace)
        converted = {
            public: namespace.pop(public, None) for public in map(public_name, fields)
        }
        namespace["__slots__"] = [slot_name(field) for field in fields]
        created: Any = type.__new__(metaclass, name, bases, namespace)
        for slot, (public, conversion) in zip(
            created.__slots__, converted.items(), strict=True
        ):
            member = created.__dict__[slot]
            attribute = member if conversion is None else conversion.property_of(member)
            type.__setattr__(created, public, attribute)
        metaclass._message = created
        return created

    @classmethod
    def __import_type_support__(cls) -> None:
        """Set the five capsules that rclpy reads from this metaclass."""
        from . import typesupport

        typesupport.import_message(cls._message)


class Message(metaclass=MessageMeta):
    """The base of all generated messages.

    `_codec_` gives the functions that read and write one byte order.
    """

    __slots__ = ()
    __hash__ = None  # type: ignore[assignment]

    # no annotations at run time, where `typing.get_type_hints` would ask for their names
    if TYPE_CHECKING:
        _fields_and_field_types: ClassVar[dict[str, str]]
        _codec_: ClassVar[codec.Codecs]
        SLOT_TYPES: ClassVar[tuple[Any, ...]]
        __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    else:
        _codec_ = OnDemand("codec", "codecs_of")
        SLOT_TYPES = OnDemand("typeinfo", "slot_types")
        __dataclass_fields__ = OnDemand("conversions", "dataclass_fields")
        __dataclass_params__ = OnDemand("conversions", "dataclass_params")

        def __replace__(self, /, **changes):
            """Return a copy with other values for some fields, for `copy.replace`."""
            from dataclasses import replace

            return replace(self, **changes)

    @property
    def _check_fields(self) -> bool:
        """True if the message checks each value at its assignment, as in rosidl."""
        # only what has imported that module has such instances
        module = f"{__package__}.checked"
        return any(base.__module__ == module for base in type(self).__mro__)

    @_check_fields.setter
    def _check_fields(self, check: bool) -> None:
        from .checked import Checked, checked_class

        kind: Any = type(self)
        if check and not issubclass(kind, Checked):
            self.__class__ = checked_class(kind)
        elif not check and issubclass(kind, Checked):
            plain: Any = kind.__base__
            self.__class__ = plain

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Return the IDL type of each field, by its name on the wire."""
        return dict(cls._fields_and_field_types)

    def serialize(self, *, byteorder: Literal["little", "big"] = "little") -> bytes:
        """Return the message as CDR with its four-byte encapsulation header.

        Raises ValidationError for a value that its field cannot hold. The bound of a string is
        not a matter of the wire format and only checked by `validate`.
        """
        return codec.functions(type(self))[0](self, byteorder)

    @classmethod
    def deserialize(
        cls, buffer: bytes | bytearray | memoryview, *, copy: bool = True
    ) -> typing_extensions.Self:
        """Return the message that `buffer` begins with, in the byte order that its header names.

        Raises DecodeError. Bytes after the message are ignored; invalid UTF-8 becomes U+FFFD.
        With `copy=False`, numeric sequences and arrays are read-only `numpy.ndarray`s, which of
        all but short arrays are views of the buffer.
        """
        message: typing_extensions.Self = codec.deserialize(cls, buffer, copy=copy)
        return message

    @classmethod
    def serialize_many(
        cls,
        messages: Iterable[typing_extensions.Self],
        *,
        byteorder: Literal["little", "big"] = "little",
    ) -> list[bytes]:
        """Return what `serialize` returns of each message.

        A ValidationError's path begins with the message's index.
        """
        return codec.serialize_many(cls, messages, byteorder)

    @classmethod
    def deserialize_many(
        cls, buffers: Iterable[bytes | bytearray | memoryview], *, copy: bool = True
    ) -> list[typing_extensions.Self]:
        """Return what `deserialize` returns of each; a DecodeError's path begins with the index."""
        return codec.deserialize_many(cls, buffers, copy)

    @classmethod
    def to_columns(
        cls,
        messages: Iterable[bytes | bytearray | memoryview],
        *,
        fields: Iterable[str] | None = None,
        datetimes: bool = False,
    ) -> Any:
        """Return many serialized messages as Columns of numpy, without making messages.

        An `idlc.Batch` of messages is not copied. Needs idlc itself.
        """
        return _columns().to_columns(cls, messages, fields, datetimes)

    @classmethod
    def to_arrow(
        cls,
        messages: Iterable[bytes | bytearray | memoryview],
        *,
        fields: Iterable[str] | None = None,
        flat: bool = False,
        datetimes: bool = False,
        dictionary: bool = False,
    ) -> Any:
        """Return many serialized messages as a `pyarrow.Table`, without making messages.

        With `flat`, nested messages are columns with names such as "header.stamp.sec". Needs idlc
        itself.
        """
        return _columns().to_arrow(cls, messages, fields, flat, datetimes, dictionary)

    def validate(self) -> None:
        """Raise ValidationError if a field, at any depth, holds what it cannot hold."""
        from .checked import validate

        validate(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by their names on the wire, in types that JSON knows.

        Nested messages become dictionaries, arrays lists, and bytes integers.
        """
        from .conversions import to_dict

        return to_dict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> typing_extensions.Self:
        """Return the message that `to_dict` would turn into `values`; absent fields have defaults.

        Raises ValidationError for an unknown name or a value that its field cannot hold.
        """
        from .conversions import from_dict

        with codec.PAUSE:
            message: typing_extensions.Self = from_dict(cls, values)
        return message

    __copy__ = __deepcopy__ = copied
    _repr_pretty_ = pretty

    def __repr__(self) -> str:
        return represented(self)

    # pprint shows it field by field, as it does dataclasses
    __repr__.__wrapped__ = represented  # type: ignore[attr-defined]

    def __rich_repr__(self) -> Iterable[tuple[str, Any]]:
        """Return names and values, for rich."""
        return named_values(self)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """Return how pydantic checks and writes a message."""
        from .conversions import message_schema

        return message_schema(cls, handler(source), handler)

    def __reduce_ex__(self, protocol: Any) -> Any:
        # the two oldest protocols of pickle do not know slots; theirs can say what later ones do
        reduction = super().__reduce_ex__(max(protocol, 2))
        from .typeinfo import structure_of

        vendor = structure_of(type(self)).vendor
        return vendor.reduced(reduction) if vendor else reduction


if codec.CHECK_FIELDS:
    MessageMeta.__call__ = codec.call_checked  # type: ignore[assignment]


# classes that users derive from generated ones, with `@dataclass` or without


def _subclass(
    metaclass: Any,
    name: str,
    bases: tuple[type, ...],
    namespace: dict[str, Any],
    options: dict[str, Any],
) -> Any:
    """Return the subclass; its `deserialize` and `==` are of its own kind."""
    if "__slots__" in namespace:
        # fields have slots, which second ones would hide: dataclass(slots=True) asks for them
        fields = {
            name for base in bases for name in getattr(base, "__match_args__", ())
        }
        slots = namespace["__slots__"]
        if isinstance(slots, dict):
            slots = {name: doc for name, doc in slots.items() if name not in fields}
        elif not isinstance(slots, str):
            slots = tuple(name for name in slots if name not in fields)
        namespace["__slots__"] = slots
        namespace.pop("__weakref__", None)  # dataclass() of Python 3.10 forgets it
    created: Any = type.__new__(metaclass, name, bases, namespace, **options)
    owner = metaclass._message
    if owner is not None:
        # until now it was a static method, which is faster
        if "deserialize" not in owner._fields_and_field_types:
            owner.deserialize = classmethod(codec.deserialize)
        # a property may hold a `numpy.ndarray`, compared element by element
        holders = (vars(owner)[name] for name in owner.__match_args__)
        if created.__eq__ is owner.__eq__ and any(
            isinstance(holder, property) for holder in holders
        ):
            created.__eq__ = _equal
    return created


def _equal(self: Any, other: Any) -> Any:
    """Compare as the generated class does, and then the fields that a dataclass adds."""
    kind = type(self)
    owner = owner_of(kind)
    is_dataclass = kind.__dataclass_fields__ is not owner.__dataclass_fields__
    if not is_dataclass or not kind.__dataclass_params__.eq:
        return owner.__eq__(self, other)
    if type(other) is not kind:
        return NotImplemented
    return owner.__eq__(self, other) and all(
        same(getattr(self, name), getattr(other, name))
        for name, field in kind.__dataclass_fields__.items()
        if field.compare and name not in owner.__match_args__
    )


# services and actions


def _find_added(group: Any, name: str) -> Any:
    """Return what ROS 2 adds to a service or action, as its module's `__getattr__`."""
    module = group.__module__
    if name.startswith(f"{wire_name(group.__name__)}_"):
        getattr(group, group._added)
        if name in vars(sys.modules[module]):
            return vars(sys.modules[module])[name]
    raise AttributeError(f"module {module!r} has no attribute {name!r}")


class _GroupMeta(InterfaceMeta):
    """Gives each service and action a metaclass of its own, for its type support."""

    _interface: ClassVar[Any] = None
    #: The attribute that stands for what ROS 2 adds, in a class that is not itself part of it.
    _added: ClassVar[str]
    #: The function of `typesupport` that sets its capsule.
    _import: ClassVar[str]

    def __new__(
        cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any]
    ) -> Any:
        if not bases:
            return super().__new__(cls, name, bases, namespace)
        metaclass = metaclass_of(cls, name, namespace)
        created: Any = type.__new__(metaclass, name, bases, namespace)
        metaclass._interface = created
        if cls._added not in namespace and len(created.__mro__) == 3:
            module: Any = sys.modules[created.__module__]
            module.__getattr__ = partial(_find_added, created)
        return created

    @classmethod
    def __import_type_support__(cls) -> None:
        """Set the capsule that rclpy reads from this metaclass."""
        from . import typesupport

        getattr(typesupport, cls._import)(cls._interface)

    def __call__(cls, *_values: object, **_named: object) -> Any:
        name, is_service = cls.__name__, issubclass(cls, Service)
        parts = (
            ["Request", "Response"] if is_service else ["Goal", "Result", "Feedback"]
        )
        uses = " or ".join(f"{name}.{part}(...)" for part in parts)
        raise NotImplementedError(f"{name} cannot be created: use {uses}")


class ServiceMeta(_GroupMeta):
    """The metaclass of services."""

    _added = "Event"
    _import = "import_service"


class ActionMeta(_GroupMeta):
    """The metaclass of actions."""

    _added = "Impl"
    _import = "import_action"


class Service(metaclass=ServiceMeta):
    """The base of services: `Request`, `Response` and `Event` are their messages."""

    #: True if fields make lists of the values that they are given, as from Lyrical on.
    _converts_ = False

    if not TYPE_CHECKING:
        Event = OnDemand("protocol", "event_of")


class Action(metaclass=ActionMeta):
    """The base of actions: `Goal`, `Result` and `Feedback` are their messages."""

    _converts_ = False

    if not TYPE_CHECKING:
        Impl = OnDemand("protocol", "impl_of")
