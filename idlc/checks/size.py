"""How large a structure may be for its codec to be written out.

A codec has its nested structures inlined, so twenty messages of two fields each can ask for a
million lines. ROS 2 accepts such types; nobody can use them. They are refused before any work.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic
from idlc.model import derive, ir
from idlc.model.link import Model

MAX_FIELDS = 20_000
#: Each message imports the next: ten Python frames, of which there are a thousand at most.
MAX_DEPTH = 50
#: Of all structures of a package together.
MAX_PACKAGE_FIELDS = 2_000_000


class _Extent(NamedTuple):
    """The fields of a structure with all that it holds, and how deep they nest."""

    fields: int
    depth: int


Extents: TypeAlias = dict[ir.TypeName, _Extent]


def oversized(model: Model, extents: Extents | None = None) -> Iterator[Diagnostic]:
    """Yield a problem for each of the model's own interfaces that is over a limit, or for all.

    Packages that were compiled together share `extents`, so that each structure is measured once.
    """
    extents = {} if extents is None else extents
    for interface in model.own:
        _measure(interface, model, extents)
    total, refused = 0, False
    for interface in model.own:
        worst = [extents[message.name] for message in derive.messages(interface)]
        fields, depth = max(e.fields for e in worst), max(e.depth for e in worst)
        path = interface.source.path if interface.source else str(interface.name)
        total += sum(extent.fields for extent in worst)
        if fields > MAX_FIELDS:
            number = f"{fields:,}" if fields < 10**12 else "more than 10^12"
            message = f"`{interface.name}` has {number} fields, nested ones included"
            hint = f"split it up; code is generated for at most {MAX_FIELDS:,}"
        elif depth > MAX_DEPTH:
            message = f"`{interface.name}` nests messages {depth} deep"
            hint = f"flatten it; code is generated for a depth of at most {MAX_DEPTH}"
        else:
            continue
        refused = True
        yield codes.STRUCTURE_TOO_LARGE.of(path, message, hint=hint)
    if total > MAX_PACKAGE_FIELDS and not refused:
        message = f"`{model.package}` has {total:,} fields, nested ones included"
        hint = f"split it into packages; code is generated for at most {MAX_PACKAGE_FIELDS:,}"
        yield codes.STRUCTURE_TOO_LARGE.of(model.package, message, hint=hint)


def _measure(interface: ir.Interface, model: Model, found: Extents) -> None:
    """Measure structures after those that they hold; with a stack, so depth is no limit."""
    parts = {message.name: message for message in derive.messages(interface)}
    waiting = list(parts)
    while waiting:
        name = waiting[-1]
        message = parts[name] if name in parts else model.interfaces[name]
        assert isinstance(message, ir.Message)
        held = message.references
        missing = [one for one in held if one not in found]
        if missing:
            waiting += missing
            continue
        del waiting[-1]
        found[name] = _Extent(
            len(message.wire_fields) + sum(found[one].fields for one in held),
            1 + max((found[one].depth for one in held), default=0),
        )
