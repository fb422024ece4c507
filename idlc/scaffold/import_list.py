"""What a module of Python imports, collected from its parts."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping

from idlc.scaffold.line_breaks import imports


class ImportList:
    """Names by the modules that they come from."""

    def __init__(self, names: Mapping[str, Iterable[str]]) -> None:
        self._names = {module: set(found) for module, found in names.items()}

    def add(self, module: str, *names: str) -> None:
        """Add names from a module."""
        if names:
            self._names.setdefault(module, set()).update(names)

    def add_all(self, names: Mapping[str, Iterable[str]]) -> None:
        """Add names from several modules."""
        for module, found in names.items():
            self.add(module, *found)

    def packages(self) -> set[str]:
        """Return the packages that are imported, but for the standard library."""
        return {module.partition(".")[0] for module in self._names} - sys.stdlib_module_names

    def groups(self, plain: Iterable[str]) -> tuple[tuple[str, ...], ...]:
        """Return the lines in groups: the standard library's, then all others.

        `plain` modules are imported as they are.
        """
        modules = {*self._names, *plain}
        standard = {one for one in modules if one.partition(".")[0] in sys.stdlib_module_names}
        groups = (
            imports(
                {one: self._names[one] for one in group if one in self._names},
                [one for one in plain if one in group],
            )
            for group in (standard, modules - standard)
        )
        return tuple(tuple(group) for group in groups if group)
