"""The opaque kind: rmw_fastrtps_cpp and others that use its type support.

Message memory is a `Memory` here, which holds the encoded bytes: encoding comes before the
middleware is called, decoding after it. Fast DDS copies the bytes while it holds the mutex of
a writer or a reader, and another thread may wait for that mutex while it holds the
interpreter's lock. Whoever gave that lock away in there would never get it back. So what copies
is machine code that allocates nothing but `bytes`, which starts no garbage collection. Where
there can be none, it is Python in which the interpreter lets no other thread run: that may
happen after a call and where it jumps. Only Python 3.11 and older may collect garbage.

Both read and write through three pointers inside Fast CDR's `Cdr`: where the next byte is,
where the message began, and where the buffer ends. Each is the second word of a pair whose
first word is the start of the buffer. `fast_cdr` looks for these pairs in a `Cdr` of its own;
where they are not found, it raises ImportError instead of touching anybody's memory.
"""

from __future__ import annotations

import ctypes
import os
import sys
from ctypes import PYFUNCTYPE, c_bool, c_char_p, c_size_t, c_void_p, py_object
from functools import cache
from struct import pack
from typing import Any

from . import c, introspection
from .c import RefusedError
from .cdr import HEADERS, NATIVE
from .codec import encode_error, functions
from .introspection import about
from .typeinfo import Structure

IDENTIFIER = "rosidl_typesupport_fastrtps_c"

#: The encapsulation header, which the middleware reads and writes itself.
_HEADER = 4
#: An array with this many bytes is not copied on its way to the middleware.
_LARGE = 16384


# Fast CDR, whose layout is found out and never assumed

_CDR = "_ZN8eprosima7fastcdr3Cdr"
_NEW_BUFFER = "_ZN8eprosima7fastcdr10FastBufferC1EPcm"
_NEW_CDR = f"{_CDR}C1ERNS0_10FastBufferENS1_10EndiannessE"
_LITTLE_ENDIAN = 1


#: By the libraries of a version of Fast CDR: the constructor of a `Cdr`, what it takes for plain
#: CDR, and the methods that append bytes and return the position.
_VERSIONS = {
    ("libfastcdr.so.2", "libfastcdr.2.dylib"): (
        f"{_NEW_CDR}NS0_10CdrVersionE",
        2,
        f"{_CDR}15serialize_arrayEPKcm",
        f"{_CDR}20get_current_positionEv",
    ),
    ("libfastcdr.so.1", "libfastcdr.1.dylib"): (  # ROS 2 Humble
        f"{_NEW_CDR}NS1_7CdrTypeE",
        1,
        f"{_CDR}14serializeArrayEPKcm",
        f"{_CDR}18getCurrentPositionEv",
    ),
}
#: Generous room for the C++ objects (200 and 40 bytes in Fast CDR 2.2).
_OBJECT_SIZE = 4096
_WORDS = 64
_ADVICE = (
    "idlc's type support for Fast DDS knows Fast CDR 1 and 2. Build the interface package "
    "with colcon instead, or use another middleware (RMW_IMPLEMENTATION=rmw_cyclonedds_cpp)"
)


def _load() -> tuple[ctypes.CDLL, tuple[str, int, str, str]]:
    """Return the Fast CDR that the middleware has already loaded, never another one."""
    for names, version in _VERSIONS.items():
        for name in names:
            try:
                return ctypes.CDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_LAZY), version
            except OSError:
                continue
    tried = " or ".join(name for names in _VERSIONS for name in names)
    raise ImportError(f"the middleware has not loaded {tried}. {_ADVICE}")


def _find(words: list[int], begin: int, positions: tuple[int, int, int]) -> int | None:
    """Return the only index of the three pairs, else None."""
    pattern = [word for position in positions for word in (begin, position)]
    indices = [i for i in range(_WORDS - 6) if words[i : i + 6] == pattern]
    return indices[0] if len(indices) == 1 else None


@cache
def fast_cdr() -> tuple[int, int]:
    """Return where a `Cdr` has the position and the end of its buffer, as indices of words.

    Raises ImportError if that cannot be found out.
    """
    library, (constructor, plain, append_name, position_name) = _load()

    def method(name: str, *arguments: Any) -> Any:
        return PYFUNCTYPE(c_void_p, *arguments)((name, library))

    try:
        new_buffer = method(_NEW_BUFFER, c_void_p, c_void_p, c_size_t)
        new_cdr = method(constructor, c_void_p, c_void_p, ctypes.c_int, ctypes.c_int)
        append = method(append_name, c_void_p, c_void_p, c_size_t)
        position_of = method(position_name, c_void_p)
    except AttributeError as error:
        raise ImportError(f"this Fast CDR is unknown: {error}. {_ADVICE}") from error

    data = ctypes.create_string_buffer(64)
    begin, size = ctypes.addressof(data), len(data)
    buffer, cdr = (ctypes.create_string_buffer(_OBJECT_SIZE) for _ in range(2))
    here = ctypes.addressof(cdr)
    new_buffer(buffer, begin, size)
    new_cdr(cdr, buffer, _LITTLE_ENDIAN, plain)
    indices = set()
    for text in (b"\1\2\3", b"\4\5"):
        append(here, text, len(text))
        position = position_of(here)
        words = c.WORDS[here >> 3 : (here >> 3) + _WORDS].tolist()
        indices.add(_find(words, begin, (position, begin, begin + size)))
    index = indices.pop()
    if not indices and index is not None and data.value == b"\1\2\3\4\5":
        c.WORDS[(here >> 3) + index + 1] = begin + 1
        if position_of(here) == begin + 1:
            return index + 1, index + 5
    raise ImportError(f"the layout of this Fast CDR is unknown. {_ADVICE}")


# message memory


class Memory:
    """Message memory: `message @ memory` encodes into it, `+memory` is the message."""

    __slots__ = ("body", "message", "received", "size", "spans")

    #: The encoded message with header; the parts of a large one, which are not copied.
    body: Any
    #: For machine code, where there are parts: the size of all without header, then
    #: address and size of each, as words.
    spans: bytes
    #: The message that `body` was made from.
    message: Any
    #: The size of `body`, where functions in Python read it.
    size: int
    #: What was received, with header; no attribute in a memory that is sent.
    received: bytes

    def keep_apart(self, parts: list[Any]) -> int:
        """Take the parts of a message, and return their size without header.

        Arrays cannot change their length until it is sent.
        """
        parts[0] = parts[0][_HEADER:]
        self.body = views = [memoryview(part).cast("B") for part in parts]
        start = _view_start() >> 3
        words: list[int] = []
        for view in views:
            words += c.WORDS[(id(view) >> 3) + start], len(view)
        size = sum(words[1::2])
        self.spans = pack(f"={1 + len(words)}Q", size, *words)
        return size


def _memory_type(name: str, cls: Any, *, native: bool) -> type[Memory]:
    """Return the memory of a message class; `native`: for machine code, which takes parts."""
    codec = cls._codec_(NATIVE)
    encode, decode, bulk = codec.encode, codec.decode, codec.bulk and native
    _, decode_any = functions(cls)
    native_order = HEADERS[NATIVE][1]
    join = b"".join
    true = c.TRUE
    large = False

    def store(memory: Any, message: Any) -> object:
        nonlocal large
        try:
            # what follows on a topic is as large as what came before
            if large:
                large = encode(message, memory.keep_apart) >= _LARGE
            else:
                memory.body = body = encode(message, join)
                large = bulk and len(body) >= _LARGE
        except Exception as error:
            raise encode_error(message, sys.byteorder, error) from error
        if not native:
            memory.body = memory.body[_HEADER:]
            memory.size = len(memory.body)
        memory.message = message
        return true

    def taken(memory: Any) -> Any:
        try:
            data = memory.received
        except AttributeError:
            return memory.message
        if data[1] == native_order and not data[0]:
            try:
                return decode(data)
            except Exception:  # noqa: S110 (the careful decoder reports it)
                pass
        return decode_any(data)

    methods = {"__rmatmul__": store, "__pos__": c.taking(name, taken)}
    return type("Memory", (Memory,), {"__slots__": (), **methods})


def _offset(owner: object, word: int) -> int:
    """Return where in an object a word lies; raises RefusedError if that is unknown."""
    first, last = id(owner), id(owner) + type(owner).__basicsize__
    words = c.WORDS[first >> 3 : last >> 3].tolist()
    if words.count(word) != 1:
        raise RefusedError("the layout of this Python's objects is unknown")
    return 8 * words.index(word)


@cache
def _view_start() -> int:
    """Return where a memoryview says where its content is."""
    content = b"content"
    return _offset(memoryview(content), id(content) + c.BYTES_OFFSET)


@cache
def _words() -> dict[str, int]:
    """Return what the machine code reads, the same for all types."""
    position, end = fast_cdr()
    memory, spans, received, body = Memory(), b"spans", b"received", bytes(54321)
    memory.spans, memory.received, memory.body = spans, received, body
    _view_start()
    return {
        "copy": c.address(ctypes.CDLL(None).memcpy),
        "new_bytes": c.c_function("PyBytes_FromStringAndSize"),
        "forget": c.c_function("Py_DecRef"),
        "clear_error": c.c_function("PyErr_Clear"),
        "position": 8 * position,
        "end": 8 * end,
        "spans": _offset(memory, id(spans)),
        "received": _offset(memory, id(received)),
        "content": c.BYTES_OFFSET,
        "body": _offset(memory, id(body)),
        "length": _offset(body, len(body)),
    }


def _native(answers: dict[bytes, int], memory: type[Memory]) -> dict[str, int]:
    """Return the addresses of the functions that Fast DDS calls; raises RefusedError.

    rclpy calls one, too: `create`, which so needs no callback of ctypes.
    """
    table = [
        word
        for identifier, handle in answers.items()
        for word in (id(c.keep(identifier)) + c.BYTES_OFFSET, handle)
    ]
    answered = ctypes.addressof(c.keep((c_size_t * (len(table) + 1))(*table)))
    make = c.c_function("PyObject_CallNoArgs")
    words = {"answers": answered, "memory": id(c.keep(memory)), "make": make}
    return c.machine_code("fastrtps", _words() | words)


@cache
def _python_functions() -> dict[str, int]:
    """Return the addresses of functions in Python that Fast DDS calls."""
    position, end = fast_cdr()
    everything, characters, words = c.MEMORY, c.CHARACTERS, c.WORDS

    def serialize(memory: Any, cdr: int) -> bool:
        try:
            here = cdr >> 3
            start = words[here + position]
            stop = start + memory.size
            if stop <= words[here + end]:
                everything[start:stop] = memory.body
                words[here + position] = stop
                return True
        except BaseException:  # noqa: S110
            pass
        return False

    def deserialize(cdr: int, memory: Any) -> bool:
        try:
            here = cdr >> 3
            memory.received = characters[
                words[here + position] - _HEADER : words[here + end]
            ]
            return True
        except BaseException:
            return False

    def size(memory: Any) -> int:
        try:
            return memory.size  # type: ignore[no-any-return]
        except BaseException:
            return 0

    def maximum(bounds_info: Any) -> int:
        try:  # noqa: SIM105 (a context manager would be called outside of it)
            bounds_info[0] = b"\0"
        except BaseException:  # noqa: S110
            pass
        return 0

    bounds = ctypes.POINTER(ctypes.c_char)
    return {
        "serialize": c.callback(PYFUNCTYPE(c_bool, py_object, c_void_p), serialize),
        "deserialize": c.callback(PYFUNCTYPE(c_bool, c_void_p, py_object), deserialize),
        "serialized_size": c.callback(PYFUNCTYPE(c_size_t, py_object), size),
        "maximum_size": c.callback(PYFUNCTYPE(c_size_t, bounds), maximum),
    }


#: `message_type_support_callbacks_t`.
_Callbacks = c.structure(
    "Callbacks",
    namespace=c_char_p,
    name=c_char_p,
    functions=c_void_p * 4,  # serialize, deserialize, and two about sizes
    later=c_void_p * 10,  # what later versions read: zero for "none of it"
)


def message(cls: Any, structure: Structure) -> tuple[int, ...]:
    """Return the addresses that rclpy reads from a message class, in their order."""
    name = structure.name
    support = c.keep(c.MessageTypeSupport(c.identifier(IDENTIFIER)))
    answers = {
        IDENTIFIER.encode(): ctypes.addressof(support),
        introspection.IDENTIFIER.encode(): introspection.handle(structure, False),
    }
    try:
        functions = _native(answers, _memory_type(name, cls, native=True))
    except RefusedError:
        memory = _memory_type(name, cls, native=False)
        create = c.address(PYFUNCTYPE(py_object)(memory))
        resolve = c.resolver(answers)
        functions = {**_python_functions(), "resolve": resolve, "create": create}
    *callbacks, resolve, create = functions.values()
    type_names = c.namespace_and_name(name, "::")
    support.data = c.pointer(_Callbacks(*type_names, (c_void_p * 4)(*callbacks)))
    support.func = resolve
    support.about = about(structure)
    names = ("Py_DecRef", "PyNumber_MatrixMultiply", "PyNumber_Positive")
    return create, *map(c.c_function, names), ctypes.addressof(support)


def service(name: str, request: int, response: int, *_: int) -> tuple[int, int]:
    """Return identifier and data of a service's type support, from its messages' handles."""
    handles = (c_void_p * 3)(request, response)
    data = c.ServiceMembers(*c.namespace_and_name(name, "::"), handles)
    return c.identifier(IDENTIFIER), c.pointer(data)
