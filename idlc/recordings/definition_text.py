"""An interface as the text that recorders write, with all that it refers to."""

from __future__ import annotations

from idlc.model import ir
from idlc.model.idl_text import file_text
from idlc.model.link import Model, held

#: The line between messages in an MCAP schema of encoding `ros2msg`.
MCAP_LINE = "=" * 80


def mcap(interface: ir.Interface, model: Model) -> str:
    """Return a message's MCAP schema of encoding `ros2msg`: its text and nested messages' texts."""
    text = file_text(interface)
    for name in held(interface, model):
        line_end = "" if not text or text.endswith("\n") else "\n"
        text += f"{line_end}{MCAP_LINE}\nMSG: {name.package}/{name.name}\n"
        text += file_text(model.interfaces[name])
    return text if not text or text.endswith("\n") else f"{text}\n"


def definition_text(interface: ir.Interface, model: Model) -> str:
    """Return the text that a recorder writes: an interface's file, and those it refers to."""
    text = mcap(interface, model)
    if isinstance(interface, ir.Message):
        return text
    return f"{MCAP_LINE}\n{interface.name.kind.upper()}: {interface.name}\n{text}"
