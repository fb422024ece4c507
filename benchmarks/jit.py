"""Classes for cydr, which compiles a codec of each to machine code when it is first used."""

import os
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path


class Classes:
    """Makes classes of structures as `idlc show --format json` describes them."""

    def __init__(self, folder: Path) -> None:
        os.environ["CYDR_CACHE_DIR"] = str(folder)  # looked at when it is imported
        self.made: dict[str, type] = {}

    @cached_property
    def types(self):
        from cydr import types

        return types

    def of(self, structures: Iterable[dict]) -> type:
        """Return the class of the first; raise KeyError if cydr has nothing like one of them."""
        structures = list(structures)
        for one in reversed(structures):  # what is used comes after what uses it
            if one["name"] not in self.made:
                self.made[one["name"]] = self._class(one)
        return self.made[structures[0]["name"]]

    def _class(self, structure: dict) -> type:
        from cydr import XcdrStruct
        from msgspec import defstruct

        fields = [(one["name"], self._annotation(one["type"])) for one in structure["fields"]]
        name = structure["name"].replace("/", "_")
        return defstruct(name, fields, bases=(XcdrStruct,), gc=False)

    def _annotation(self, spelled: str) -> object:
        element, bracket, size = spelled.rstrip("]").partition("[")
        if "/" in element and not bracket:
            package, _, name = element.partition("/")
            return self.made[f"{package}/msg/{name}"]
        plain = {"bool": "boolean", "char": "uint8"}.get(element, element)
        kind = vars(self.types)[plain]  # sequences of structures are not among them
        if not bracket:
            return kind
        shape = self.types.Shape[size] if size else self.types.Any
        return self.types.NDArray[shape, self.types.Bytes if plain == "string" else kind]
