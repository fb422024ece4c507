"""The command that declares a package in package.xml, for what is completed."""

from __future__ import annotations

from idlc.lsp.protocol.capabilities import ADD_DEPENDENCY
from idlc.lsp.world import World


def command(uri: str, package: str, world: World) -> dict[str, object] | None:
    """Return the command for a document, if the client can have its files edited."""
    if not world.supports("workspace", "applyEdit"):
        return None
    title = f"Declare {package} in package.xml"
    return {"title": title, "command": ADD_DEPENDENCY, "arguments": [uri, package]}
