"""`idlc.reader` and `idlc.patch`: fields of serialized messages, read and replaced in place."""

from __future__ import annotations

import struct
import sys
from array import array
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache, partial
from operator import attrgetter
from typing import Any, TypeAlias, overload

from idlc import runtime
from idlc.generate.python.reader import Path, PathError, PathStep, is_time, paths_of, reader_source
from idlc.model import ir
from idlc.model.from_description import message_of
from idlc.recordings.arguments import message_class
from idlc.runtime.cdr import NATIVE
from idlc.runtime.checked import validate_count, validate_element
from idlc.runtime.codec import FAILURES, READINGS, VIEWING, deserialize, maker, text_of_view
from idlc.runtime.names import DecodeError, ValidationError, owner_of, slot_name
from idlc.runtime.sequences import element_type
from idlc.runtime.typeinfo import FieldInfo, Structure, structure_of
from idlc.wire.layout import Messages

Buffer: TypeAlias = bytes | bytearray | memoryview
#: Readers that are kept: a program has a few, and those of a server's users are not endless.
MOST = 256
#: From this size on, slices of bytes take longer than those of a view.
_LARGE = 1 << 13


@overload
def reader(kind: type, path: str, /, *, nanoseconds: bool = False) -> Callable[[Buffer], Any]: ...


@overload
def reader(
    kind: type, /, *paths: str, nanoseconds: bool = False
) -> Callable[[Buffer], tuple[Any, ...]]: ...


def reader(kind: type, /, *paths: str, nanoseconds: bool = False) -> Callable[[Buffer], Any]:
    """Return a function that reads fields of serialized messages without decoding the rest.

    >>> read = idlc.reader(Imu, "header.stamp.sec", "linear_acceleration.z")
    >>> sec, z = read(buffer)

    Paths lead through messages and lists: `position[3]`, `position[-1]`, `transforms[*].header`.
    One path gives its value, several a tuple. Values are those that `deserialize` gives, but lists
    of numbers are read-only views of the buffer, as with `copy=False`. With `nanoseconds`, times
    and durations are integers. Raises ValueError for paths that the type does not have.

    The function raises DecodeError for what it would have to read and cannot, also for an element
    that a list does not have. It does not judge what it passes over.
    """
    if not paths:
        raise PathError("a reader needs the path of a field, such as `header.stamp`")
    return field_reader(message_class(kind), tuple(map(_text, paths)), nanoseconds)


def _text(path: Any) -> str:
    if not isinstance(path, str):
        raise PathError(f"{path!r} is not the path of a field, a text such as `position[3]`")
    return path


class Absent(Exception):  # noqa: N818 - an answer, which is caught where it is asked for
    """A list has no element at the index of a path."""


@lru_cache(MOST)
def field_reader(
    kind: type, paths: tuple[str, ...], nanoseconds: bool = False, asks: bool = False
) -> Callable[[Buffer], Any]:
    """Return the function; one that `asks` raises Absent for an element that does not exist."""
    owner = _Type(kind)
    return owner.reader(owner.paths(paths), nanoseconds=nanoseconds, asks=asks)


def type_at(kind: type, text: str) -> ir.FieldType:
    """Return the type of the single value at a path, or of a time; raise PathError for others."""
    owner = _Type(kind)
    (path,) = owner.paths((_text(text),))
    if path.has_many:
        raise PathError(f"`{text}` leads to many values: give an index such as `[0]`")
    if isinstance(path.type, (ir.Primitive, ir.String)) or is_time(path.type, owner.messages):
        return path.type
    raise PathError(f"`{text}` is not a single value: give the path of a number or a string")


class _Type:
    """The type of a generated class, for readers."""

    def __init__(self, kind: type) -> None:
        self.owner: Any = owner_of(kind)
        self.structure: Structure = structure_of(self.owner)
        # each package may have a runtime of its own, and its errors
        own_runtime = sys.modules[self.owner.__base__.__module__.rpartition(".")[0]]
        self.error: type[DecodeError] = own_runtime.DecodeError
        self.validation_error: type[ValidationError] = own_runtime.ValidationError
        self.name = ir.TypeName.parse(self.structure.name)
        self.messages: Messages = dict(_messages(self.structure))

    def paths(self, texts: tuple[str, ...]) -> tuple[Path, ...]:
        """Return what texts mean in the type; raise PathError if some lead nowhere."""
        return paths_of(texts, self.messages[self.name], self.messages)

    def reader(
        self,
        paths: tuple[Path, ...],
        *,
        nanoseconds: bool = False,
        positions: bool = False,
        asks: bool = False,
    ) -> Callable[[Buffer], Any]:
        """Return the function that reads values, or a tuple of their `positions`."""

        def absent(number: int, count: int, offset: int) -> Exception:
            if asks:
                return Absent()
            problem = f"there is no such element, the list has {count}"
            return self.error(problem, paths[number].text, offset)

        def slow(buffer: Buffer) -> Any:
            """Read what middlewares accept, but the statements do not; or raise the DecodeError."""
            message = deserialize(self.owner, bytes(buffer))
            if positions:
                raise self.error("a field of this message cannot be located")
            values = []
            for number, path in enumerate(paths):
                times = nanoseconds and is_time(path.type, self.messages)
                try:
                    values.append(_value_at(message, path.parts, _nanoseconds if times else _view))
                except _TooShort as error:
                    raise absent(number, error.args[0], 0) from None
            return values[0] if len(values) == 1 else tuple(values)

        text = reader_source(
            self.name, paths, self.messages, nanoseconds=nanoseconds, positions=positions
        )
        namespace: dict[str, Any] = {
            "_idlc": runtime,
            "reading": READINGS[text_of_view, True],
            "maker_of": lambda name: maker(self.structure.types[name].find_class()),
            "dtype": partial(element_type, reading=VIEWING),
            "words_of": _words_of,
            "pass_texts": _pass_texts,
            "DecodeError": self.error,
            "FAILURES": FAILURES,
            "absent": absent,
        }
        if "frombuffer(" in text:
            import numpy as np

            namespace["frombuffer"] = np.frombuffer
        if "_arrays." in text:
            from idlc.runtime import arrays

            namespace["_arrays"] = arrays
        exec(text, namespace)  # noqa: S102 - made of the type's plan, not of the paths' text
        big = namespace["make"](">", 0, slow, slow)
        fast: Callable[[Buffer], Any] = namespace["make"]("<", 256, big, slow)
        return fast


def _messages(structure: Structure) -> Iterator[tuple[ir.TypeName, ir.Message]]:
    """Yield a structure and all that it refers to."""
    names, done = [structure.name], set()
    while names:
        name = names.pop()
        if name not in done:
            done.add(name)
            message = message_of(structure.types.descriptions[name], "its package")
            names += map(str, message.references)
            yield message.name, message


# parts of readers


def _words_of(data: Buffer, limit: int, order: str) -> Any:
    """Return the words of a buffer, among which are the sizes of strings."""
    words = memoryview(data)[: limit & -4].cast("I")
    if order == NATIVE:
        return words
    swapped = array("I", words.tobytes())
    swapped.byteswap()
    return swapped


def _pass_texts(words: Any, start: int, count: int) -> int:
    """Return the end of strings: of all but the last, the next begins at a multiple of four."""
    if not count:
        return start
    word = start >> 2
    for _ in range(count - 1):
        word += words[word] + 7 >> 2
    end: int = 4 * word + 4 + words[word]
    return end


class _TooShort(Exception):  # noqa: N818 - an answer, too
    """A list has only so many elements."""


def _value_at(value: Any, parts: tuple[PathStep, ...], finish: Callable[[Any], Any]) -> Any:
    """Return what is at a path of a message."""
    for place, (name, index) in enumerate(parts, 1):
        value = getattr(value, slot_name(name))
        if index is None:
            continue
        elements = value.tolist() if hasattr(value, "tolist") else value
        if index == "*":
            return [_value_at(element, parts[place:], finish) for element in elements]
        assert isinstance(index, int)
        if not -len(elements) <= index < len(elements):
            raise _TooShort(len(elements))
        value = elements[index]
    return finish(value)


def _nanoseconds(value: Any) -> int:
    nanoseconds: int = value.sec * 10**9 + value.nanosec
    return nanoseconds


def _view(value: Any) -> Any:
    """Return a value as a reader does: numbers of a list are a view that cannot be written."""
    if hasattr(value, "tolist"):
        import numpy as np

        value = np.asarray(value)
        value.flags.writeable = False
    return value


# replacing fields


def patch(kind: type, data: Buffer, changes: Mapping[str, Any]) -> bytes:
    """Return a serialized message with other values for some fields, by their paths.

    >>> idlc.patch(Imu, buffer, {"header.stamp": stamp})

    Fields are of a fixed size, so all other bytes stay as they are: numbers, arrays of them,
    elements such as `position[3]`, and messages of such fields, given as messages or dictionaries.
    Times can be given as nanoseconds. Raises ValueError for a path that does not lead to such a
    field, ValidationError for a value that a field cannot hold, and DecodeError.
    """
    if not changes:
        return bytes(data)
    if type(changes) is not dict and not isinstance(changes, Mapping):
        raise TypeError(f"`changes` has values by the paths of fields; {changes!r} has none")
    try:
        patcher = _patcher(kind, tuple(changes))
    except (AttributeError, TypeError):
        message_class(kind)
        raise
    if type(data) is not bytes:
        data = memoryview(data).cast("B")
    places = patcher.locate(data)
    view = data if len(data) < _LARGE else memoryview(data)
    end = max(places) + patcher.longest
    head = bytearray(view[:end])
    try:
        numbers: list[Any] = []
        for field, value in zip(patcher.fields, changes.values()):  # noqa: B905 # as many
            numbers += field.numbers(value)
        runs = patcher.runs[data[1]]
        for place, (pack_into, chosen) in zip(places, runs):  # noqa: B905 # as many
            pack_into(head, place, *numbers[chosen])
    except (struct.error, OverflowError):
        for field, value in zip(patcher.fields, changes.values(), strict=True):
            field.checked(value)
        raise patcher.error("the message ends before a field", "", len(data)) from None
    return b"".join((head, view[end:]))


@lru_cache(MOST)
def _patcher(kind: type, texts: tuple[str, ...]) -> _Patcher:
    return _Patcher(_Type(kind), tuple(map(_text, texts)))


class _Patcher:
    """The fields to replace, and the runs of numbers without a gap that they consist of."""

    def __init__(self, type_: _Type, texts: tuple[str, ...]) -> None:
        self.error = type_.error
        type_.paths(texts)
        self.fields = [_Field(type_, text) for text in texts]
        starts, count, self.longest = [], 0, 0
        #: By the byte order of a message: what writes a run, and which of all numbers are in it.
        self.runs: tuple[list[tuple[Callable[..., None], slice]], ...] = [], []
        for field in self.fields:
            for leaf, codes, length in field.runs:
                starts.append(leaf)
                for order, runs in zip("><", self.runs, strict=True):
                    layout = struct.Struct(order + codes)
                    runs.append((layout.pack_into, slice(count, count + length)))
                    self.longest = max(self.longest, layout.size)
                count += length
        self.locate = type_.reader(type_.paths(tuple(starts)), positions=True)


class _Field:
    """A field that can be replaced: its numbers, and where runs of them begin."""

    def __init__(self, type_: _Type, path: str) -> None:
        self.type = type_
        self.path = path
        structure: Structure | None = type_.structure
        for part in path.split("."):
            assert structure is not None
            name = part.partition("[")[0]
            self.field = next(field for field in structure.fields if field.name == name)
            structure = self.field.nested
        leaves = [*_leaves(path, path, self.field)]
        self.is_time = structure is not None and _is_time(structure)
        #: The path of the first, the codes, and how many numbers there are.
        self.runs: list[tuple[str, str, int]] = []
        first, size = 0, 0
        for leaf, count, code in leaves:
            unit = struct.calcsize(f"={code}")
            if unit <= first and size % unit == 0:  # so there is no padding
                start, codes, length = self.runs.pop()
                self.runs.append((start, f"{codes}{count}{code}", length + count))
            else:
                self.runs.append((leaf, f"{count}{code}", count))
                first, size = unit, 0
            size += count * unit
        #: Takes the numbers of a message, where a Struct checks them all.
        self.getter: Callable[[Any], Any] | None = None
        inner = [leaf.removeprefix(f"{path}.").split(".") for leaf, _, _ in leaves]
        if len(leaves) > 1 and all(code != "?" and count == 1 for _, count, code in leaves):
            self.getter = attrgetter(*(".".join(map(slot_name, names)) for names in inner))

    def numbers(self, value: Any) -> Any:
        """Return the numbers of a value; those that a Struct checks are not checked before."""
        if type(value) in (int, float):
            if self.field.is_numeric:
                return (value,)
            if self.is_time and type(value) is int:
                return divmod(value, 10**9)
        elif self.getter is not None:
            with suppress(AttributeError):  # not a message
                return self.getter(value)
        return self.checked(value)

    def checked(self, value: Any) -> list[Any]:
        """Return the numbers; raise the ValidationError of the class's package."""
        try:
            return [*_numbers(self.path, self.field, value)]
        except ValidationError as error:
            raise error.at(error.path, self.type.validation_error) from None


def _is_time(structure: Structure) -> bool:
    return [field.name for field in structure.fields] == ["sec", "nanosec"]


def _is_whole_list(path: str, field: FieldInfo) -> bool:
    return field.is_list and not path.endswith("]")


def _leaves(whole: str, path: str, field: FieldInfo) -> Iterator[tuple[str, int, str]]:
    """Yield the path of each number or array that a field consists of, the count and its code."""
    is_list = _is_whole_list(path, field)
    is_empty = field.nested is not None and not field.nested.fields
    if "*" in path or field.text or is_empty or (is_list and (field.is_sequence or field.nested)):
        hint = "give the path of a number, or of a message that has only numbers"
        raise PathError(f"`{whole}` has no fixed size, or not one place: {hint}")
    if field.nested:
        for inner in field.nested.fields:
            yield from _leaves(whole, f"{path}.{inner.name}", inner)
        return
    assert field.primitive is not None
    yield path, (field.size or 1) if is_list else 1, field.primitive.code


def _numbers(path: str, field: FieldInfo, value: Any) -> Iterator[Any]:
    """Yield the numbers that a field consists of."""
    if field.nested:
        parts = _parts(path, field, field.nested, value)
        for part, element in zip(field.nested.fields, parts, strict=True):
            yield from _numbers(f"{path}.{part.name}", part, element)
    elif not _is_whole_list(path, field):
        validate_element(value, field, path, wire_only=True)
        yield value
    else:
        if isinstance(value, (str, Mapping)) or not hasattr(value, "__len__"):
            raise ValidationError(path, "a sequence", value)
        validate_count(value, field, path)
        is_octets = isinstance(value, (bytes, bytearray)) and not field.is_numeric
        for element in (bytes((octet,)) for octet in value) if is_octets else value:
            validate_element(element, field, path, wire_only=True)
            yield element


def _parts(path: str, field: FieldInfo, structure: Structure, value: Any) -> list[Any]:
    """Return the values for the fields of a structure."""
    names = [part.name for part in structure.fields]
    if _is_time(structure) and type(value) is int:
        return [*divmod(value, 10**9)]
    if not isinstance(value, Mapping):
        validate_element(value, field, path, wire_only=True)
        return [getattr(value, part.slot) for part in structure.fields]
    if set(value) != set(names):
        raise ValidationError(path, f"a dictionary of {', '.join(names)}", value)
    return [value[name] for name in names]
