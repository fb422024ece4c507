"""Texts above a file: its hash, who uses it, and what its changes break."""

from __future__ import annotations

from idlc.breaking.change import LEVELS
from idlc.breaking.packages import compare
from idlc.lsp.features.navigation import users
from idlc.lsp.protocol.parts import Action, Lens, OfDocument, Position, Range
from idlc.lsp.world import Known, World

_TOP = Range(Position(0, 0), Position(0, 0))
_HASH, _USERS, _BREAKS = "hash", "users", "breaks"


def lenses(world: World, asked: OfDocument) -> list[Lens]:
    """Return the lenses of a file; what they say is found out when they are shown."""
    known = world.known(asked.text_document.uri) if world.settings.code_lens else None
    if known is None:
        return []
    kinds = [_HASH] if known.state.library.distro.has_hashes else []
    kinds += [_USERS] if known.interface.name.kind == "msg" else []
    kinds += [_BREAKS] if world.settings.against else []
    return [Lens(_TOP, data=[asked.text_document.uri, kind]) for kind in kinds]


def resolve(world: World, asked: Lens) -> Lens:
    """Return a lens with what it says."""
    uri, kind = asked.data
    return Lens(asked.range, Action(_text(world, uri, kind), ""), asked.data)


def _text(world: World, uri: str, kind: str) -> str:
    known = world.known(uri)
    if known is None:
        return ""
    name = known.interface.name
    if kind == _USERS:
        count = len(list(users(name, world)))
        return f"{count} use{'s' * (count != 1)}"
    if kind == _BREAKS:
        return _what_breaks(known, world)
    model = known.state.model_of(known.interface)
    return model.describer.hash(str(name)) if model else "no type hash: there are errors"


def _what_breaks(known: Known, world: World) -> str:
    """Return what the changes of a file break against the version of the settings."""
    against, interface = world.settings.against, known.interface
    project = world.projects.of(known.state.path_of(known.source))
    before = project.workspace.earlier(against).get(interface.name.package) if project else None
    after = known.state.model_of(interface)
    if before is None or after is None or interface.name not in before.interfaces:
        return f"nothing to compare with in {against}" if after else ""
    name = {interface.name}
    broken = {
        level
        for change in compare(before.only(name), after.only(name)).changes
        for level in change.levels
    }
    if not broken:
        return f"breaks nothing against {against}"
    count = len({state.path_of(span.source) for state, span in users(interface.name, world)})
    levels = ", ".join(level for level in LEVELS if level in broken)
    return f"breaks: {levels} for {count} user{'s' * (count != 1)} against {against}"
