"""`idlc.reader` and `idlc.patch`: fields of serialized messages, read and replaced in place."""

from __future__ import annotations

import struct
import sys
from array import array
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from operator import attrgetter
from types import SimpleNamespace
from typing import Any, NoReturn, TypeAlias, overload

from idlc import runtime
from idlc.generate.python.reader import (
    PathError,
    Wanted,
    is_time,
    reader_source,
    wanted_values,
)
from idlc.model import ir
from idlc.model.from_description import message_of
from idlc.runtime.cdr import NATIVE, order_of
from idlc.runtime.checked import validate_count, validate_element
from idlc.runtime.codec import FAILURES, READINGS, maker, text_of_view
from idlc.runtime.names import DecodeError, ValidationError, owner_of, slot_name
from idlc.runtime.typeinfo import CarefulReader, FieldInfo, Structure, structure_of
from idlc.wire.layout import Messages

Buffer: TypeAlias = bytes | bytearray | memoryview
#: Readers that are kept: a program has a few, and those of a server's users are not endless.
MOST = 256


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
    return field_reader(kind, paths, nanoseconds)


class Absent(Exception):  # noqa: N818 - an answer, which is caught where it is asked for
    """A list has no element at the index of a path."""


@lru_cache(MOST)
def field_reader(
    kind: type, paths: tuple[str, ...], nanoseconds: bool = False, asks: bool = False
) -> Callable[[Buffer], Any]:
    """Return the function; one that `asks` raises Absent for an element that does not exist."""
    return _Type(kind).reader(paths, nanoseconds=nanoseconds, asks=asks)


def type_at(kind: type, path: str) -> ir.FieldType:
    """Return the type of the single value at a path, or of a time; raise PathError for others."""
    owner = _Type(kind)
    node = wanted_values((path,), owner.message, owner.messages)
    while not node.numbers:
        if None in node.elements:
            raise PathError(f"`{path}` leads to many values: give an index such as `[0]`")
        (node,) = (*node.fields.values(), *node.elements.values())
    if isinstance(node.type, (ir.Primitive, ir.String)) or is_time(node.type, owner.messages):
        return node.type
    raise PathError(f"`{path}` is not a single value: give the path of a number or a string")


class _Type:
    """The type of a generated class, for readers."""

    def __init__(self, kind: type) -> None:
        owner: Any = owner_of(kind)
        self.structure: Structure = structure_of(owner)
        # each package may have a runtime of its own, and its errors
        own_runtime = sys.modules[owner.__base__.__module__.rpartition(".")[0]]
        self.error: type[DecodeError] = own_runtime.DecodeError
        self.validation_error: type[ValidationError] = own_runtime.ValidationError
        self.messages: Messages = dict(_messages(self.structure))
        self.message = self.messages[ir.TypeName.parse(self.structure.name)]

    def reader(
        self,
        paths: tuple[str, ...],
        *,
        nanoseconds: bool = False,
        positions: bool = False,
        asks: bool = False,
    ) -> Callable[[Buffer], Any]:
        """Return the function that reads values, or their `positions`, and tells byte orders."""
        wanted = wanted_values(paths, self.message, self.messages)
        text = reader_source(
            wanted, len(paths), self.messages, nanoseconds=nanoseconds, positions=positions
        )

        def absent(number: int, count: int, offset: int) -> Exception:
            if asks:
                return Absent()
            problem = f"there is no such element, the list has {count}"
            return self.error(problem, paths[number], offset)

        namespace: dict[str, Any] = {
            "_idlc": runtime,
            "reading": READINGS[text_of_view, True],
            "maker_of": lambda name: maker(self.structure.types[name].find_class()),
            "dtype": _dtype,
            "NATIVE": NATIVE,
            "swapped": _swapped,
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
        careful = _Careful(self, wanted, len(paths), nanoseconds, absent)
        slow = careful.refuse if positions else careful.read
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


def _dtype(order: str, name: str) -> Any:
    import numpy as np

    kind: Any = np.dtype(name)
    return kind.newbyteorder(order)


def _swapped(words: memoryview) -> Any:
    swapped = array("I", words.tobytes())
    swapped.byteswap()
    return swapped


class _Careful:
    """Reads what the fast function refuses as `deserialize` does, up to the last wanted field."""

    def __init__(
        self,
        type_: _Type,
        wanted: Wanted,
        count: int,
        nanoseconds: bool,
        absent: Callable[[int, int, int], Exception],
    ) -> None:
        self.type = type_
        self.wanted = wanted
        self.count = count
        self.nanoseconds = nanoseconds
        self.absent = absent

    def read(self, buffer: Buffer) -> Any:
        """Return the values; raise the DecodeError of the class's package."""
        results = self.values(self.wanted, self.message(bytes(buffer)))
        values = tuple(results[number] for number in range(self.count))
        return values[0] if self.count == 1 else values

    def refuse(self, buffer: Buffer) -> NoReturn:
        """Raise the DecodeError that says why there is no position."""
        self.message(bytes(buffer))
        raise self.type.error("a field of this message cannot be located")

    def message(self, data: bytes) -> SimpleNamespace:
        """Return the fields up to the last that is wanted."""
        message, missing = SimpleNamespace(), set(self.wanted.fields)
        try:
            careful = CarefulReader(data, order_of(data), self.make)
            for field in self.type.structure.fields:
                if not missing:
                    break
                setattr(message, field.slot, careful.field(field, field.public, message))
                missing.discard(field.name)
        except DecodeError as error:
            raise self.type.error(error.problem, error.path, error.offset) from error
        return message

    def make(self, structure: Structure) -> Any:
        """Return an empty message; its package may be missing if none of its messages is wanted."""
        if _has_messages(self.wanted):
            return maker(structure.find_class())()
        return SimpleNamespace()

    def values(self, wanted: Wanted, value: Any) -> dict[int, Any]:
        """Return what is wanted of a value."""
        results = dict.fromkeys(wanted.numbers, self.result(wanted.type, value))
        for name, inner in wanted.fields.items():
            results |= self.values(inner, getattr(value, slot_name(name)))
        for index, inner in wanted.elements.items():
            elements = value.tolist() if hasattr(value, "tolist") else value
            if index is None:
                rows = [self.values(inner, element) for element in elements]
                for number in inner.all_numbers():
                    results[number] = [row[number] for row in rows]
            elif -len(elements) <= index < len(elements):
                results |= self.values(inner, elements[index])
            else:
                raise self.absent(min(inner.all_numbers()), len(elements), 0)
        return results

    def result(self, type_: ir.FieldType, value: Any) -> Any:
        """Return a value as the fast function does."""
        if self.nanoseconds and is_time(type_, self.type.messages):
            return value.sec * 10**9 + value.nanosec
        if hasattr(value, "tolist"):
            import numpy as np

            value = np.asarray(value)
            value.flags.writeable = False
        return value


def _has_messages(wanted: Wanted) -> bool:
    """Return whether values that are wanted are, or hold, messages."""
    type_ = wanted.type.element if isinstance(wanted.type, (ir.Array, ir.Sequence)) else wanted.type
    inner = (*wanted.fields.values(), *wanted.elements.values())
    return (isinstance(type_, ir.Ref) and bool(wanted.numbers)) or any(map(_has_messages, inner))


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
    patcher = _patcher(kind, tuple(changes))
    view = memoryview(data).cast("B")
    places = patcher.locate(view)
    structs = patcher.structs["<" if view[1] else ">"]
    values = [
        numbers
        for (path, field), value in zip(patcher.fields.items(), changes.values(), strict=True)
        for numbers in patcher.numbers(path, field, value)
    ]
    end = 0
    for path, layout, place in zip(patcher.paths, structs, places, strict=True):
        end = max(end, place + layout.size)
        if end > len(view):
            raise patcher.type.error(f"{layout.size} bytes expected", path, place)
    head = bytearray(view[:end])
    try:
        for layout, place, numbers in zip(structs, places, values, strict=True):
            layout.pack_into(head, place, *numbers)
    except (struct.error, OverflowError):
        for (path, field), value in zip(patcher.fields.items(), changes.values(), strict=True):
            patcher.checked(path, field, value)
        raise
    return b"".join((head, view[end:]))


@lru_cache(MOST)
def _patcher(kind: type, paths: tuple[str, ...]) -> _Patcher:
    return _Patcher(_Type(kind), paths)


class _Patcher:
    """Where fields are, and which numbers a value for them consists of."""

    def __init__(self, type_: _Type, paths: tuple[str, ...]) -> None:
        self.type = type_
        wanted_values(paths, type_.message, type_.messages)
        self.fields = {path: self.field(path) for path in paths}
        leaves = [
            leaf for path, field in self.fields.items() for leaf in _leaves(path, path, field)
        ]
        self.paths = tuple(path for path, _ in leaves)
        self.structs = {
            order: [struct.Struct(order + code) for _, code in leaves] for order in "<>"
        }
        #: What takes the numbers of a message, where a Struct checks them all.
        self.getters: dict[str, Callable[[Any], tuple[Any, ...]]] = {}
        for path in paths:
            inner = [(leaf, code) for leaf, code in leaves if leaf.startswith(f"{path}.")]
            if len(inner) > 1 and all(code[0] == "1" and code != "1?" for _, code in inner):
                ends = (leaf.removeprefix(f"{path}.").split(".") for leaf, _ in inner)
                slots = (".".join(map(slot_name, end)) for end in ends)
                self.getters[path] = attrgetter(*slots)
        locate = type_.reader(self.paths, positions=True)
        self.locate = locate if len(leaves) > 1 else lambda data: (locate(data),)

    def field(self, path: str) -> FieldInfo:
        """Return the field at the end of a path."""
        structure: Structure | None = self.type.structure
        for part in path.split("."):
            assert structure is not None
            name = part.partition("[")[0]
            field = next(field for field in structure.fields if field.name == name)
            structure = field.nested
        return field

    def numbers(self, path: str, field: FieldInfo, value: Any) -> list[tuple[Any, ...]]:
        """Return the numbers of a value; those that a Struct checks are not checked before."""
        getter = self.getters.get(path)
        if getter is not None and hasattr(type(value), "_fields_and_field_types"):
            with suppress(AttributeError):  # a message of another type
                return [(number,) for number in getter(value)]
        if field.is_numeric and type(value) in (int, float):
            return [(value,)]
        return self.checked(path, field, value)

    def checked(self, path: str, field: FieldInfo, value: Any) -> list[tuple[Any, ...]]:
        """Return the numbers; raise the ValidationError of the class's package."""
        try:
            return list(_numbers(path, field, value))
        except ValidationError as error:
            raise error.at(error.path, self.type.validation_error) from None


def _is_whole_list(path: str, field: FieldInfo) -> bool:
    return field.is_list and not path.endswith("]")


def _leaves(whole: str, path: str, field: FieldInfo) -> Iterator[tuple[str, str]]:
    """Yield the path of each number or array that a field consists of, and its code."""
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
    yield path, f"{field.size if is_list else 1}{field.primitive.code}"


def _numbers(path: str, field: FieldInfo, value: Any) -> Iterator[tuple[Any, ...]]:
    """Yield the numbers of each leaf of a field."""
    if field.nested:
        inner = [(f"{path}.{part.name}", part) for part in field.nested.fields]
        parts = _parts(path, field.nested, value)
        for (place, part), element in zip(inner, parts, strict=True):
            yield from _numbers(place, part, element)
        return
    elements: tuple[Any, ...] = (value,)
    if _is_whole_list(path, field):
        if isinstance(value, (str, Mapping)) or not hasattr(value, "__len__"):
            raise ValidationError(path, "a sequence", value)
        validate_count(value, field, path)
        octets = isinstance(value, (bytes, bytearray)) and not field.is_numeric
        elements = tuple(bytes((octet,)) for octet in value) if octets else tuple(value)
    for element in elements:
        validate_element(element, field, path, wire_only=True)
    yield elements


def _parts(path: str, structure: Structure, value: Any) -> list[Any]:
    """Return the values for the fields of a structure."""
    names = [field.name for field in structure.fields]
    if names == ["sec", "nanosec"] and isinstance(value, int):
        return list(divmod(value, 10**9))
    if not isinstance(value, Mapping):
        if any(not hasattr(value, field.slot) for field in structure.fields):
            raise ValidationError(path, f"a {structure.name}", value)
        return [getattr(value, field.slot) for field in structure.fields]
    if set(value) != set(names):
        raise ValidationError(path, f"a dictionary of {', '.join(names)}", value)
    return [value[name] for name in names]
