"""Messages that contain themselves, which no message may."""

from __future__ import annotations

from collections.abc import Iterable

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic
from idlc.diagnostics.source import Span
from idlc.model import ir
from idlc.model.circles import circles
from idlc.model.pool import Pool

#: Messages of a circle that are named.
NAMED = 10


def check_recursion(interfaces: Iterable[ir.TypeName], pool: Pool) -> None:
    """Note each field that closes a circle."""
    for path, field in circles(interfaces, pool.references, pool.searched):
        if field.type_span is not None:
            pool[path[-1]].errors.append(_circle(path, field.type_span))


def _circle(path: list[ir.TypeName], span: Span) -> Diagnostic:
    """Return the problem with a circle of the messages on `path`."""
    left_out = len(path) - NAMED
    shown = [name.name for name in path[:NAMED]]
    shown += [f"{left_out} more"] if left_out > 0 else []
    circle = " → ".join((*shown, path[0].name))
    return codes.RECURSIVE_TYPE.at(
        span,
        f"`{path[0].name}` contains itself: {circle}",
        hint="ROS 2 has no recursive types; refer to the other message by an id",
    )
