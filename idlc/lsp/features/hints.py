"""Offset and size of each field on the wire, after its name."""

from __future__ import annotations

from idlc.export.byte_layout import layout
from idlc.lsp.elements import elements
from idlc.lsp.protocol.parts import OfRange, Part, Position
from idlc.lsp.world import World


class Hint(Part, frozen=True):
    """A text that stands in a line without being in it."""

    position: Position
    label: str
    tooltip: str
    padding_left: bool


def hints(world: World, asked: OfRange) -> list[Hint]:
    """Return the hints in a range; none where the file has errors."""
    known = world.known(asked.text_document.uri) if world.settings.inlay_hints else None
    model = known.state.model_of(known.interface) if known else None
    if known is None or model is None:
        return []
    low = world.offset(known.source, asked.range.start)
    high = world.offset(known.source, asked.range.end)
    found = []
    placed = {}
    for one in elements(known.source, known.interface):
        if not low <= one.name.end <= high:
            continue
        name = one.message.name
        if name not in placed:
            fields, _ = layout(one.message, model.messages)
            placed[name] = {id(each.field): each for each in fields}
        here = placed[name].get(id(one.meaning))
        if here is not None:
            text = f"@{here.offset}, {here.size} B"
            tip = f"{here.size.in_bytes} at offset {here.offset} of the message, header not counted"
            found.append(Hint(world.range(one.name).end, text, tip, True))
    return found
