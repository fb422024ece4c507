"""The imports of a module, in the order that ament_flake8 wants."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from idlc.project.templates import Code


class Import(NamedTuple):
    """An import of a module, or of names from it; several are on a line each."""

    module: Code
    names: tuple[Code, ...] = ()


class ImportList:
    """Names by the modules that they come from."""

    def __init__(self, names: Mapping[str, Iterable[str]]) -> None:
        self._names = {module: set(imported) for module, imported in names.items()}

    def add(self, module: str, *names: str) -> None:
        """Add names from a module."""
        if names:
            self._names.setdefault(module, set()).update(names)

    def add_all(self, names: Mapping[str, Iterable[str]]) -> None:
        """Add names from several modules."""
        for module, imported in names.items():
            self.add(module, *imported)

    def packages(self) -> set[str]:
        """Return the packages that are imported, but for the standard library."""
        return {module.partition(".")[0] for module in self._names} - sys.stdlib_module_names

    def groups(self, plain: Iterable[str]) -> tuple[tuple[Import, ...], ...]:
        """Return the imports in groups: of the standard library, then all others.

        `plain` modules are imported as they are.
        """
        imports = [Import(Code(module)) for module in plain]
        for module, names in self._names.items():
            renamed = {name for name in names if " as " in name}
            imports += [Import(Code(module), (Code(name),)) for name in renamed]
            ordered = sorted(names - renamed, key=lambda name: (name.lower(), name))
            imports += [Import(Code(module), tuple(map(Code, ordered)))] if ordered else []
        imports.sort(key=lambda entry: (entry.module.lower(), *map(str.lower, entry.names[:1])))
        library = sys.stdlib_module_names
        standard = tuple(entry for entry in imports if entry.module.partition(".")[0] in library)
        others = tuple(entry for entry in imports if entry.module.partition(".")[0] not in library)
        return tuple(filter(None, (standard, others)))
