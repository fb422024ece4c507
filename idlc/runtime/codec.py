"""Making messages: codecs, imported and made for one byte order on first use, and constructors.

The codecs of a module of classes are in the module of the same name and `__codec`.
Constructors leave checks to `checked`, which is rarely needed.
"""

from __future__ import annotations

import gc
import os
import struct

from .cdr import NATIVE, order_of
from .names import DecodeError, ValidationError, demand_stamp, owner_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from functools import partial
    from typing import Any, TypeAlias

    from .conversions import Join

    #: A function that decodes bytes.
    Text: TypeAlias = Callable[[Any], str]
    #: `serialize(message, byteorder="little")` and `deserialize(buffer, copy=True)`.
    Functions: TypeAlias = tuple[Callable[..., bytes], Callable[..., Any]]

    #: Gives the codec of a byte order, whose `decode` makes values as a `Reading` says.
    Codecs: TypeAlias = Callable[..., "Codec"]
else:
    # functools takes longer to import than all that is here
    from _functools import partial


#: Whether all messages check their fields. Read once, as in rosidl's modules.
CHECK_FIELDS = os.environ.get("ROS_PYTHON_CHECK_FIELDS") == "1"

ORDERS = {"little": "<", "big": ">"}

#: Takes a memoryview, too. Slower than `bytes.decode`.
text_of_view: Text = partial(str, encoding="utf-8")


class Reading:
    """The values that a decoder makes: strings by `text`, numeric arrays as copies or as views."""

    def __init__(self, text: Text, copy: bool) -> None:
        self.text = text
        self.copy = copy

    def of(self, kind: type) -> Reading:
        """Return the reading for sequences of a class of another package.

        Classes of rosidl get copies: their `==` cannot compare views.
        """
        return self if hasattr(type(kind), "_message") else COPYING


READINGS: dict[tuple[Text, bool], Reading] = {
    (text, copy): Reading(text, copy)
    for text in (bytes.decode, text_of_view)
    for copy in (True, False)
}
COPYING, VIEWING = READINGS[bytes.decode, True], READINGS[bytes.decode, False]


#: The exceptions of decoding a buffer that is not a message.
FAILURES = (struct.error, ValueError, IndexError, OverflowError)


class Pause:
    """Keeps the garbage collector, which finds nothing in messages, from running in any thread.

    The last of the threads in it lets it run, unless it was disabled before the first.
    """

    def __init__(self) -> None:
        self.threads: list[None] = []  # a count that no thread can interrupt
        self.has_disabled = False
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self.threads.clear)
            os.register_at_fork(after_in_child=self.resume)

    def __enter__(self) -> None:
        self.threads.append(None)
        if gc.isenabled():
            self.has_disabled = True
            gc.disable()

    def __exit__(self, *_: object) -> None:
        self.threads.pop()
        if not self.threads:
            self.resume()

    def resume(self) -> None:
        """Let it run: no thread is in the pause, as in a process that was forked."""
        if self.has_disabled:
            self.has_disabled = False
            gc.enable()


PAUSE = Pause()
#: From this size on, messages of many parts are decoded while the collector is paused.
LARGE = 1 << 14


class Codec:
    """The two functions of one class and byte order.

    `encode(message, join)` returns `join(parts)`: buffers, of which the first begins with the
    encapsulation header. Numeric sequences are parts of their own, not copied; it starts again if
    one had another length when it was joined than when it was counted.
    `decode(data)` returns a message from `bytes` that begin with the encapsulation header.
    `bulk` says that there are numeric sequences, so that a memoryview saves a copy.
    """

    def __init__(
        self,
        encode: Callable[[Any, Join], Any],
        decode: Callable[[Any], Any],
        bulk: bool = False,
    ) -> None:
        self.encode = encode
        self.decode = decode
        self.bulk = bulk


def codecs_of(kind: type) -> Codecs:
    """Return the codecs of a generated class, which keeps them as `_codec_`."""
    owner = owner_of(kind)
    module = __import__(f"{owner.__module__}__codec", fromlist=["CODECS"])
    return keep_codecs(owner, module.CODECS[owner.__name__])


def keep_codecs(owner: Any, make: Callable[[Any, str, Reading], Codec]) -> Codecs:
    """Return the codecs that `make` makes, each once; the class keeps them as `_codec_`."""
    cached: dict[tuple[str, Reading], Codec] = {}
    types = owner._fields_and_field_types.values()
    has_parts = any("/" in type_ for type_ in types if type_.startswith("sequence<"))

    def codecs(order: str, reading: Reading = COPYING) -> Codec:
        codec = cached.get((order, reading))
        if codec is None:
            codec = cached[order, reading] = make(owner, order, reading)
            if has_parts:
                codec.decode = partial(_decode_parts, codec.decode)
        return codec

    owner._codec_ = staticmethod(codecs)
    return codecs


def _decode_parts(decode: Callable[[Any], Any], data: Any) -> Any:
    if len(data) < LARGE:
        return decode(data)
    with PAUSE:
        return decode(data)


def functions(kind: type) -> Functions:
    """Return `serialize` and `deserialize` of the generated class that `kind` is, or extends.

    They replace those that the class inherits, unless its fields have these names.
    """
    owner = owner_of(kind)
    pair: Functions | None = owner.__dict__.get("_functions_")
    if pair is not None:
        return pair
    codecs = owner._codec_
    little = codecs("<")
    encode, decode, join = little.encode, little.decode, b"".join
    view: Any = None

    def serialize(self: Any, byteorder: str = "little") -> Any:
        try:
            if byteorder == "little":
                return encode(self, join)
            return codecs(ORDERS[byteorder]).encode(self, join)
        except Exception as error:
            raise encode_error(self, byteorder, error) from error

    def deserialize(buffer: Any, copy: bool = True) -> Any:
        nonlocal view
        try:
            if type(buffer) is bytes and buffer[1] == 1 and not buffer[0]:
                if not copy and view is None:
                    view = codecs("<", VIEWING).decode
                return (decode if copy else view)(buffer)
            return read(codecs, buffer, copy)
        except DecodeError:
            raise
        except FAILURES:
            pass
        # middlewares accept some malformed messages
        from .typeinfo import read_carefully

        return read_carefully(owner, bytes(buffer), maker)

    base = owner.__mro__[1]
    serialize.__doc__ = base.serialize.__doc__
    deserialize.__doc__ = base.deserialize.__doc__
    owner._functions_ = serialize, deserialize
    methods = {"serialize": serialize, "deserialize": staticmethod(deserialize)}
    for name, function in methods.items():
        if name not in owner.__dict__:
            setattr(owner, name, function)
    return serialize, deserialize


def read(codecs: Codecs, buffer: Any, copy: bool = True) -> Any:
    """Return a message from any buffer, in either byte order."""
    text: Text = bytes.decode
    if type(buffer) is not bytes:
        view = memoryview(buffer).cast("B")
        if codecs(NATIVE).bulk:
            text, buffer = text_of_view, view.toreadonly()
        else:
            buffer = bytes(view)
    return codecs(order_of(buffer), READINGS[text, copy]).decode(buffer)


def deserialize(kind: Any, buffer: Any, *, copy: bool = True) -> Any:
    """Return a message of a generated class, or of a user's subclass of one."""
    owner = owner_of(kind)
    message = functions(owner)[1](buffer, copy)
    if kind is owner:
        return message
    result = kind.__new__(kind)
    for slot in owner.__slots__:
        setattr(result, slot, getattr(message, slot))
    return result


def encode_error(message: Any, byteorder: str, error: Exception) -> Exception:
    """Return the exception that says which field was wrong."""
    if byteorder not in ORDERS:
        return ValueError(f"byteorder must be 'little' or 'big', not {byteorder!r}")
    from .checked import validate

    try:
        validate(message, wire_only=True)
    except ValidationError as exact:
        return exact
    return error


# many messages of one type


def serialize_many(kind: Any, messages: Iterable[Any], byteorder: str) -> list[bytes]:
    """Return each message's bytes; raise ValidationError that names the message by its index."""
    if byteorder not in ORDERS:
        raise ValueError(f"byteorder must be 'little' or 'big', not {byteorder!r}")
    encode, join = kind._codec_(ORDERS[byteorder]).encode, b"".join
    messages = list(messages)
    result: list[bytes] = []
    put = result.append
    try:
        for message in messages:
            put(encode(message, join))
    except Exception as error:
        index = len(result)
        failure = encode_error(messages[index], byteorder, error)
        if isinstance(failure, ValidationError):
            raise failure.at(f"[{index}].{failure.path}") from error
        raise failure from error
    return result


def deserialize_many(kind: Any, buffers: Iterable[Any], copy: bool) -> list[Any]:
    """Return the message of each buffer; raise DecodeError that names the buffer by its index."""
    if owner_of(kind) is not kind:
        return [_indexed(kind, raw, copy, index) for index, raw in enumerate(buffers)]
    codecs = kind._codec_
    decode = codecs("<", READINGS[bytes.decode, copy]).decode
    result: list[Any] = []
    put = result.append
    buffers = list(buffers)  # whose code runs before the pause
    with PAUSE:
        for buffer in buffers:
            try:
                if type(buffer) is bytes and buffer[1] == 1 and not buffer[0]:
                    put(decode(buffer))
                else:
                    put(read(codecs, buffer, copy))
            except FAILURES:
                put(_indexed(kind, buffer, copy, len(result)))
    return result


def _indexed(kind: Any, buffer: Any, copy: bool, index: int) -> Any:
    """Return one message as `deserialize` would; a DecodeError has the index in its path."""
    try:
        return deserialize(kind, buffer, copy=copy)
    except DecodeError as error:
        path = f"[{index}].{error.path}" if error.path else f"[{index}]"
        raise DecodeError(error.problem, path, error.offset) from error


# constructors


def call_checked(cls: Any, *values: Any, **named: Any) -> Any:
    """Make a message that checks its fields, as the environment asks for."""
    if "check_fields" in cls._fields_and_field_types:
        return type.__call__(cls, *values, **named)  # the name is a field's
    if owner_of(cls) is cls:
        return type.__call__(cls, *values, **{"check_fields": True, **named})
    message = type.__call__(cls, *values, **named)
    message._check_fields = True
    return message


def maker(kind: Any, number: int | None = None) -> Callable[[], Any]:
    """Return a function that makes an empty instance, of an idlc-made or rosidl-made class.

    Raises ImportError for a class whose fields have another stamp than `number`.
    """
    demand_stamp(kind, number)
    if hasattr(type(kind), "_message"):
        if CHECK_FIELDS:
            from .checked import checked_class

            kind = checked_class(kind)
        return partial(object.__new__, kind)
    if "_check_fields" not in getattr(kind, "__slots__", ()):
        return partial(object.__new__, kind)

    def make() -> Any:
        message: Any = object.__new__(kind)
        message._check_fields = CHECK_FIELDS
        return message

    return make
