"""The type support of a package's messages, in two libraries as C++ tools look for them.

When asked for another identifier, a handle returns another handle, or NULL:

    rosidl_typesupport_cpp                what rclcpp, rosbag2 and the like load
    ├─ rosidl_typesupport_fastrtps_c      what Fast DDS asks for: a name, no bound, no codec
    └─ rosidl_typesupport_introspection_c what others ask for: fields with types and offsets
    rosidl_typesupport_introspection_cpp  what tools load that only want to know the fields

So messages travel in serialized form only, which is what these tools do with types that they were
not compiled with. There is no service and no action among the symbols: each tool copes with a
symbol that is missing, none with half a service. `inspect` reads a library of anybody from its
bytes, which are not trusted.
"""

from __future__ import annotations

from struct import error, pack, unpack_from
from typing import NamedTuple

from idlc.generate.native.elf import SECTION, SYMBOL, Image, Machine, SectionPlace, shared_library
from idlc.generate.native.platforms import (
    AARCH64,
    LAYOUTS,
    MESSAGE,
    STRING,
    TYPE_IDS,
    WSTRING,
    X86_64,
    StructLayout,
    Structures,
)
from idlc.model import derive, ir
from idlc.model.describe import FieldDict, IndividualDict
from idlc.model.link import Model

#: Words of a structure of C.
Words = tuple[int | SectionPlace | None, ...]


def hash_bytes(text: str) -> bytes:
    """Return a type's hash as C has it: the version, and the digest."""
    return b"\1" + bytes.fromhex(text.removeprefix("RIHS01_"))


class Descriptions:
    """The functions that return hash, description and sources of each type, made once."""

    def __init__(self, model: Model, image: Image) -> None:
        self._model = model
        self._image = image
        self._individuals: dict[str, Words] = {}
        self._about: dict[str, tuple[SectionPlace, ...]] = {}

    def functions(self, name: str) -> tuple[SectionPlace, ...]:
        """Return functions that return a type's hash, description and sources."""
        if name not in self._about:
            image, describer = self._image, self._model.describer
            hash_ = image.constants.put(hash_bytes(describer.hash(name)))
            full = describer.description(name)
            individuals = (full["type_description"], *full["referenced_type_descriptions"])
            own, *others = map(self._individual, individuals)
            description = image.tables.words(*own, *self._sequence(others))
            rows = [self._source(individual["type_name"]) for individual in individuals]
            places = (hash_, description, image.tables.words(*self._sequence(rows)))
            self._about[name] = tuple(image.function("get", target=place) for place in places)
        return self._about[name]

    def _individual(self, individual: IndividualDict) -> Words:
        name = individual["type_name"]
        if name not in self._individuals:
            fields = [self._field(field) for field in individual["fields"]]
            self._individuals[name] = (*self._string(name), *self._sequence(fields))
        return self._individuals[name]

    def _field(self, field: FieldDict) -> Words:
        kind = field["type"]
        return (
            *self._string(field["name"]),
            kind["type_id"],
            kind["capacity"],
            kind["string_capacity"],
            *self._string(kind["nested_type_name"]),
            *self._string(field["default_value"]),
        )

    def _source(self, name: str) -> Words:
        """Return a type's source; derived types have none, and ROS 2 calls that implicit."""
        interface = self._model.interfaces.get(ir.TypeName.parse(name))
        source = interface.source if interface else None
        encoding = name.split("/")[1] if source else "implicit"
        text = source.text if source else ""
        return (*self._string(name), *self._string(encoding), *self._string(text))

    def _string(self, text: str) -> Words:
        """Return a string of C with its size, and its capacity with the terminator."""
        size = len(text.encode())
        return (self._image.string(text), size, size + 1) if text else (None, 0, 0)

    def _sequence(self, rows: list[Words]) -> Words:
        if not rows:
            return None, 0, 0
        first = self._image.tables.words(*(word for row in rows for word in row))
        return first, len(rows), len(rows)


MACHINES = {"x86_64": X86_64, "aarch64": AARCH64}

AUTHOR = b"idlc"
OWN = "rosidl_typesupport_cpp"
FASTRTPS = "rosidl_typesupport_fastrtps_c"
FIELDS = "rosidl_typesupport_introspection_c"
FIELDS_CPP = "rosidl_typesupport_introspection_cpp"
#: Zeros after the callbacks for Fast DDS: later distributions read more of them.
ROOM = 72


def libraries(
    model: Model, machine: Machine, layout: StructLayout = LAYOUTS["jazzy"]
) -> dict[str, bytes]:
    """Return the content of each library of a package by the name of its file.

    A library that is open must not change: write a new file, and move it into place.
    """
    return {
        f"lib{model.package}__{identifier}.so": _library(model, Image(machine), layout, identifier)
        for identifier in (OWN, FIELDS_CPP)
        if model.own
    }


def identity_stamp(layout: StructLayout) -> bytes:
    """Return the first bytes of a library's constants: its author, and its layout."""
    return AUTHOR + pack(f"<{len(layout)}I", *layout)


def symbol(identifier: str, name: ir.TypeName) -> str:
    """Return the symbol under which tools ask a library of this kind for a message."""
    return "__".join((identifier, "get_message_type_support_handle", *name))


def _library(model: Model, image: Image, layout: StructLayout, identifier: str) -> bytes:
    image.constants.put(identity_stamp(layout))
    support = _TypeSupport(model, image, layout, cpp=identifier == FIELDS_CPP)
    for interface in model.own:
        for message in derive.messages(interface):
            handle = support.fields[message.name]
            if identifier == OWN:
                handle = support.resolving_handle(message.name, handle)
            name = symbol(identifier, message.name)
            image.exports[name] = image.function("get", target=handle)
    return shared_library(image, f"lib{model.package}__{identifier}.so")


class _TypeSupport:
    """The handles of one library. `fields` are for FIELDS, or with `cpp` for FIELDS_CPP."""

    def __init__(self, model: Model, image: Image, layout: StructLayout, *, cpp: bool) -> None:
        self.image = image
        self.layout = layout
        self.cpp = cpp
        self.descriptions = Descriptions(model, image)
        self.structures = Structures(layout.of_cpp() if cpp else layout)
        self.refuse = image.function("refuse")
        self.fields: dict[ir.TypeName, SectionPlace] = {}
        for message in _reached(model):
            self.fields[message.name] = self._fields(message)

    def resolving_handle(self, name: ir.TypeName, fields: SectionPlace) -> SectionPlace:
        """Return the handle that answers for all others."""
        image, refuse = self.image, self.refuse
        fastrtps = image.tables.words(
            image.string(f"{name.package}::{name.kind}"),
            image.string(name.name),
            *(refuse, refuse, refuse),  # serialize, deserialize, size
            image.function("unbounded"),
            None,  # no key
            *[0] * (ROOM // 8),
        )
        answers = {FASTRTPS: self._single(FASTRTPS, fastrtps, name), FIELDS: fields}
        rows = [word for key, handle in answers.items() for word in (image.string(key), handle)]
        # the table holds the handle itself, which follows: its place is known before
        handle = SectionPlace(image.data, len(image.data.data))
        table = image.tables.words(*rows, image.string(OWN), handle, None, None)
        return self._handle(OWN, table, image.function("resolve"), name)

    def _handle(
        self, identifier: str, data: SectionPlace, find: SectionPlace, name: ir.TypeName
    ) -> SectionPlace:
        about = self.descriptions.functions(str(name))
        return self.image.data.words(self.image.string(identifier), data, find, *about)

    def _single(self, identifier: str, data: SectionPlace, name: ir.TypeName) -> SectionPlace:
        """Return a handle that knows its own identifier only."""
        image = self.image
        places = {"identifier": image.string(identifier), "function": image.function("same")}
        return self._handle(identifier, data, image.function("knows", **places), name)

    def _fields(self, message: ir.Message) -> SectionPlace:
        image, name = self.image, message.name
        offsets, size, _ = self.structures.add(name, message.wire_fields)
        rows = [
            word
            for field, offset in zip(message.wire_fields, offsets, strict=True)
            for word in self._member(field, offset)
        ]
        separator = "::" if self.cpp else "__"
        data = image.tables.words(
            image.string(f"{name.package}{separator}{name.kind}"),
            image.string(name.name),
            len(offsets),
            size,
            *[0] * (self.layout.members // 8 - 4),  # whether there is a key
            image.tables.words(*rows),
            *self._memory(name),
        )
        return self._single(FIELDS_CPP if self.cpp else FIELDS, data, name)

    def _member(self, field: ir.Field, offset: int) -> tuple[int | SectionPlace | None, ...]:
        kind, bound, nested = _element(ir.element_of(field.type))
        count, bounded, resize = 0, 0, None
        if isinstance(field.type, ir.Array):
            count = field.type.size
        elif isinstance(field.type, ir.Sequence):
            count, bounded = field.type.bound or 0, int(field.type.bound is not None)
            resize = self.refuse
        many = isinstance(field.type, (ir.Array, ir.Sequence))
        return (
            self.image.string(field.name),
            kind,
            bound,
            self.fields[nested] if nested else None,
            many << 8 * (self.layout.is_array - 32),
            count,
            bounded | offset << 32,
            *(None, None, None, None, None, None),  # default, size, get, get, fetch, assign
            resize,
            *[0] * (self.layout.member // 8 - 14),
        )

    def _memory(self, name: ir.TypeName) -> tuple[SectionPlace | None, SectionPlace | None]:
        """Return the functions that begin and end a message in memory: C++ cannot have any."""
        if not self.cpp:
            return None, None
        image = self.image
        text = f"{name} was compiled by idlc, not in C++: it exists only in serialized form"
        slot = image.imported("_ZSt21__throw_runtime_errorPKc", "libstdc++.so.6")
        throw = image.function("throw", message=image.string(text), function=slot)
        return throw, image.function("nothing")


def _element(element: ir.Element) -> tuple[int, int, ir.TypeName | None]:
    """Return a type's id in introspection, its bound, and its name if it is a message."""
    match element:
        case ir.Primitive():
            return TYPE_IDS[element.name], 0, None
        case ir.String():
            return (WSTRING if element.wide else STRING), element.bound or 0, None
        case ir.Ref():
            return MESSAGE, 0, element.target
        case ir.Unknown():
            raise ValueError("an unknown type has no type support")


def _reached(model: Model) -> list[ir.Message]:
    """Return a package's messages and all that they refer to, nested ones first."""
    describe = model.describer.description
    reached: set[str] = set()
    for interface in model.own:
        for message in derive.messages(interface):
            referenced = describe(str(message.name))["referenced_type_descriptions"]
            reached |= {str(message.name), *(part["type_name"] for part in referenced)}
    held = {name: len(describe(name)["referenced_type_descriptions"]) for name in reached}
    ordered = sorted(reached, key=lambda name: (held[name], name))
    return [model.messages[ir.TypeName.parse(name)] for name in ordered]


#: Longer names are no symbols of type support.
LONGEST = 2000
_HEADER = b"\x7fELF\2\1\1"  # of 64 bits, little-endian
_SHARED, _SYMBOLS = 3, 11
_CONSTANTS = (1, 2)  # content that is mapped, and neither written to nor run


class Inspected(NamedTuple):
    """A library: its processor's number, the symbols that it defines, and the stamp of idlc.

    That is `None` in a library that idlc did not make.
    """

    machine: int
    symbols: frozenset[str]
    stamp: bytes | None


class _SectionHeader(NamedTuple):
    type: int
    flags: int
    at: int
    size: int
    link: int


def inspect(data: bytes) -> Inspected | None:
    """Return the content of a file; `None` if it is no shared library for Linux, or truncated."""
    try:
        kind, machine = unpack_from("<2H", data, 16)
        (start,), (count,) = unpack_from("<Q", data, 40), unpack_from("<H", data, 60)
        end = start + count * SECTION
        if not data.startswith(_HEADER) or kind != _SHARED or end > len(data):
            return None
        rows = range(start, end, SECTION)
        sections = [_SectionHeader(*unpack_from("<4xIQ8x2QI", data, row)) for row in rows]
        (table, *_) = (part for part in sections if part.type == _SYMBOLS)
        if table.at + table.size > len(data):
            return None
        names = sections[table.link].at
        symbols = set()
        for at in range(table.at, table.at + table.size - SYMBOL + 1, SYMBOL):
            name, is_defined = unpack_from("<I2xH", data, at)
            text = data[names + name : names + name + LONGEST].partition(b"\0")[0]
            if is_defined and text:
                symbols.add(text.decode("ascii", "replace"))
    except (error, ValueError, IndexError, OverflowError):
        return None
    size = len(identity_stamp(LAYOUTS["jazzy"]))
    constants = (part.at for part in sections if (part.type, part.flags) == _CONSTANTS)
    stamps = (data[at : at + size] for at in constants)
    stamp = next((stamp for stamp in stamps if stamp.startswith(AUTHOR)), None)
    return Inspected(machine, frozenset(symbols), stamp)
