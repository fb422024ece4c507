"""What rules found before, as long as nothing changed that it depends on."""

from __future__ import annotations

from typing import TypeAlias

from idlc.diagnostics.report import Diagnostic
from idlc.model import ir
from idlc.model.link import Model

Found: TypeAlias = dict[ir.TypeName, tuple[Diagnostic, ...]]


class Memory:
    """What was found in the interfaces of each package, with all that these referred to then."""

    def __init__(self) -> None:
        self._packages: dict[str, tuple[dict[ir.TypeName, ir.Interface | None], Found]] = {}

    def of(self, model: Model) -> Found:
        """Return what still holds of a package's own interfaces; what is added is remembered.

        The time is that of looking at each interface and reference once, circles or not.
        """
        graph = model.graph()
        before, found = self._packages.get(model.package, ({}, {}))
        waiting = [
            name
            for name, (now, _) in graph.items()
            if name not in before or before[name] is not now
        ]
        users: dict[ir.TypeName, list[ir.TypeName]] = {}
        for name, (_, targets) in graph.items():
            for target in targets:
                users.setdefault(target, []).append(name)
        changed: set[ir.TypeName] = set()
        while waiting:
            name = waiting.pop()
            if name not in changed:
                changed.add(name)
                waiting += users.get(name, ())
        own = (one.name for one in model.own)
        kept = {name: found[name] for name in own if name in found and name not in changed}
        self._packages[model.package] = {name: now for name, (now, _) in graph.items()}, kept
        return kept
