"""The base of generated messages: what rosidl's classes offer, and dataclasses besides.

A message class declares `_fields_and_field_types`. Its metaclass makes a slot of each field,
named as rosidl names it (`_stamp`), and gives it its public name (`stamp`): the same slot, or a
property that converts for numeric arrays. Nothing else is computed until it is asked for.
"""

from __future__ import annotations

import sys

from . import codec
from .construction import CHECK_FIELDS, call_checked, is_checked
from .lazy import OnDemand, dataclass_fields, dataclass_params, slot_types
from .names import public_name, slot_name
from .objects import copied, deeply_copied, pretty, represented

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from dataclasses import Field, dataclass
    from typing import Any, ClassVar, Literal

    import typing_extensions

    from .on_demand.columns import Batch
else:

    def dataclass(**_options):
        """Leave the class as it is: the generated class already is what a dataclass has."""
        return lambda cls: cls


#: What generated classes call `dict`; linters take a display for a mistake there.
table = dict


class InterfaceMeta(type):
    """What rclpy looks for on the class of a class; one subclass for each interface."""

    _TYPE_SUPPORT: ClassVar[Any] = None

    def __setattr__(cls, name: str, value: object) -> None:
        if name.isupper() and name[0] != "_" and hasattr(cls, name):
            raise AttributeError(f"{cls.__name__}.{name} is a constant")
        super().__setattr__(name, value)


def metaclass_of(
    base: type[InterfaceMeta], name: str, namespace: dict[str, Any]
) -> Any:
    """Return a metaclass for one interface, in the module of its class like rosidl's."""
    module = namespace["__module__"].removesuffix("__protocol")
    if module != namespace["__module__"]:
        namespace["__module__"] = module
        namespace.pop("__firstlineno__", None)  # that is another file's
    made = type(f"Metaclass_{name}", (base,), {"__module__": module})
    setattr(sys.modules.get(module), made.__name__, made)
    return made


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
            from .subclasses import subclass

            return subclass(cls, name, bases, namespace, options)
        metaclass = metaclass_of(cls, name, namespace)
        converted = {
            public: namespace.pop(public, None) for public in map(public_name, fields)
        }
        namespace["__slots__"] = [slot_name(field) for field in fields]
        made: Any = type.__new__(metaclass, name, bases, namespace)
        for slot, (public, conversion) in zip(
            made.__slots__, converted.items(), strict=True
        ):
            member = made.__dict__[slot]
            attribute = member if conversion is None else conversion.property_of(member)
            type.__setattr__(made, public, attribute)
        metaclass._message = made
        return made

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
        _codec_ = OnDemand(codec.codecs_of)
        SLOT_TYPES = OnDemand(slot_types)
        __dataclass_fields__ = OnDemand(dataclass_fields)
        __dataclass_params__ = OnDemand(dataclass_params)

    @property
    def _check_fields(self) -> bool:
        """Whether the message checks each value when it is assigned, as in rosidl."""
        return is_checked(type(self))

    @_check_fields.setter
    def _check_fields(self, check: bool) -> None:
        from .checked import become_checked

        become_checked(self, check)

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
        from .on_demand.batches import serialize_many

        return serialize_many(cls, messages, byteorder)

    @classmethod
    def deserialize_many(
        cls, buffers: Iterable[bytes | bytearray | memoryview], *, copy: bool = True
    ) -> list[typing_extensions.Self]:
        """Return what `deserialize` returns of each; a DecodeError's path begins with the index."""
        from .on_demand.batches import deserialize_many

        return deserialize_many(cls, buffers, copy)

    @classmethod
    def to_columns(
        cls,
        messages: Iterable[bytes | bytearray | memoryview] | Batch,
        *,
        fields: Iterable[str] | None = None,
        ragged: bool | None = None,
        datetimes: bool = False,
    ) -> Any:
        """Return many serialized messages as columns of numpy, without making messages.

        They are a structured array; or Columns, where that cannot hold them or if `ragged`.
        """
        from .on_demand.columns.read import to_columns

        return to_columns(cls, messages, fields, ragged, datetimes)

    @classmethod
    def to_arrow(
        cls,
        messages: Iterable[bytes | bytearray | memoryview] | Batch,
        *,
        fields: Iterable[str] | None = None,
        flat: bool = False,
        datetimes: bool = False,
        dictionary: bool = False,
    ) -> Any:
        """Return many serialized messages as a `pyarrow.Table`, without making messages.

        With `flat`, nested messages are columns with names such as "header.stamp.sec".
        """
        from .on_demand.columns.arrow import to_arrow

        return to_arrow(cls, messages, fields, flat, datetimes, dictionary)

    def validate(self) -> None:
        """Raise ValidationError if a field, at any depth, holds what it cannot hold."""
        from .on_demand.validation import validate

        validate(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by their names on the wire, in types that JSON knows.

        Nested messages become dictionaries, arrays lists, and bytes integers.
        """
        from .on_demand.dictionaries import to_dict

        return to_dict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> typing_extensions.Self:
        """Return the message that `to_dict` would turn into `values`; absent fields have defaults.

        Raises ValidationError for an unknown name or a value that its field cannot hold.
        """
        from .on_demand.dictionaries import from_dict

        message: typing_extensions.Self = from_dict(cls, values)
        return message

    if not TYPE_CHECKING:

        def __replace__(self, /, **changes):
            """Return a copy with other values for some fields, for `copy.replace`."""
            from dataclasses import replace

            return replace(self, **changes)

    __copy__ = copied
    __deepcopy__ = deeply_copied
    _repr_pretty_ = pretty

    def __repr__(self) -> str:
        return represented(self)

    # pprint shows it field by field, as it does dataclasses
    __repr__.__wrapped__ = represented  # type: ignore[attr-defined]

    def __rich_repr__(self) -> Iterable[tuple[str, Any]]:
        """Return names and values, for rich."""
        from .on_demand.fields import named_values

        return named_values(self)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """Return how pydantic checks and writes a message."""
        from .on_demand.pydantic_schema import message_schema

        return message_schema(cls, handler(source), handler)

    def __reduce_ex__(self, protocol: Any) -> Any:
        # the two oldest protocols of pickle do not know slots; theirs can say what later ones do
        return super().__reduce_ex__(max(protocol, 2))


if CHECK_FIELDS:
    MessageMeta.__call__ = call_checked  # type: ignore[assignment]

__all__ = [
    "InterfaceMeta",
    "Message",
    "MessageMeta",
    "dataclass",
    "table",
]
