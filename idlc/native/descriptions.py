"""What a library tells of a type: its hash, its description and its source, as rcl asks."""

from __future__ import annotations

from idlc.model import ir
from idlc.model.describe import FieldDict, IndividualDict
from idlc.model.link import Model
from idlc.native.image import Image, Place

#: Words of a structure of C.
Words = tuple[int | Place | None, ...]


def hash_bytes(text: str) -> bytes:
    """Return a type's hash as C has it: the version, and the digest."""
    return b"\1" + bytes.fromhex(text.removeprefix("RIHS01_"))


class Descriptions:
    """The functions of each type that return these three, made once."""

    def __init__(self, model: Model, image: Image) -> None:
        self._model = model
        self._image = image
        self._individuals: dict[str, Words] = {}
        self._about: dict[str, tuple[Place, Place, Place]] = {}

    def about(self, name: str) -> tuple[Place, Place, Place]:
        """Return functions that return a type's hash, description and sources."""
        if name not in self._about:
            told = (self._hash(name), *self._description(name))
            hash_, description, sources = (
                self._image.function("get", target=place) for place in told
            )
            self._about[name] = (hash_, description, sources)
        return self._about[name]

    def _hash(self, name: str) -> Place:
        return self._image.constants.put(hash_bytes(self._model.describer.hash(name)))

    def _description(self, name: str) -> tuple[Place, Place]:
        full = self._model.describer.description(name)
        referenced = full["referenced_type_descriptions"]
        own, *others = (self._individual(one) for one in (full["type_description"], *referenced))
        description = self._image.tables.words(*own, *self._sequence(others))
        names = (name, *(one["type_name"] for one in referenced))
        sources = [self._source(one) for one in names]
        return description, self._image.tables.words(*self._sequence(sources))

    def _individual(self, one: IndividualDict) -> Words:
        name = one["type_name"]
        if name not in self._individuals:
            fields = [self._field(field) for field in one["fields"]]
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
        """Return a string of C with its size, and with room for what ends it."""
        size = len(text.encode())
        return (self._image.string(text), size, size + 1) if text else (None, 0, 0)

    def _sequence(self, rows: list[Words]) -> Words:
        if not rows:
            return None, 0, 0
        first = self._image.tables.words(*(word for row in rows for word in row))
        return first, len(rows), len(rows)
