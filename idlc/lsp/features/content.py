"""Interfaces that are built in, as documents that can only be read."""

from __future__ import annotations

from idlc.lsp.protocol.errors import INVALID_PARAMS, RequestError
from idlc.lsp.protocol.parts import AskedContent
from idlc.lsp.world import World
from idlc.model import catalog, ir
from idlc.model.distro import BY_NAME


def text(_world: World, asked: AskedContent) -> dict[str, str]:
    """Return the text of `idlc:/jazzy/std_msgs/msg/Header.msg`."""
    scheme, _, path = asked.uri.partition(":")
    distro, _, name = path.strip("/").partition("/")
    stem, _, _kind = name.rpartition(".")
    source = None
    if scheme == "idlc" and distro in BY_NAME and stem.count("/") == 2:
        package, kind, interface = stem.split("/")
        if kind in ir.KINDS:
            source = catalog.source(ir.TypeName(package, kind, interface), BY_NAME[distro])
    if source is None:
        raise RequestError(INVALID_PARAMS, f"there is no document `{asked.uri}`")
    return {"text": source.text}
