"""The lines of a node that log a message, and what its test looks for in them."""

from __future__ import annotations

from idlc.emit import pynames
from idlc.model import ir
from idlc.scaffold.line_breaks import logged

#: Fields that are named in one line.
FIELDS = 6
#: As much of a line as tests look for.
HEAD = 50


def lines(title: str, variable: str, message: ir.Message) -> tuple[str, ...]:
    """Return the lines of a method that log a message, its short fields one by one."""
    return tuple(logged(_parts(title, variable, message), depth=2))


def head(title: str, variable: str, message: ir.Message) -> str:
    """Return how the line begins that these lines log."""
    return " ".join(_parts(title, variable, message)).partition("{")[0][:HEAD]


def _parts(title: str, variable: str, message: ir.Message) -> list[str]:
    short = [f for f in message.fields if isinstance(f.type, (ir.Primitive, ir.String))]
    parts = [f"{f.name}={{{variable}.{pynames.field(f.name)}!r}}" for f in short[:FIELDS]]
    if not parts:
        parts = [f"{variable}={{{variable}}}"] if message.fields else [f"{variable} received"]
    return [f"{title}:", *parts]
