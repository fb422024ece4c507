"""Commands, which edit files by way of the editor."""

from __future__ import annotations

from idlc.lsp.edits import workspace_edit
from idlc.lsp.protocol.capabilities import ADD_DEPENDENCY
from idlc.lsp.protocol.errors import INVALID_PARAMS, RequestError
from idlc.lsp.protocol.parts import Command
from idlc.lsp.world import World


def execute(world: World, asked: Command) -> None:
    """Carry a command out."""
    if asked.command != ADD_DEPENDENCY:
        raise RequestError(INVALID_PARAMS, f"there is no command `{asked.command}`")
    match asked.arguments:
        case [str(uri), str(package)]:
            _declare(world, uri, package)
        case _:
            raise RequestError(INVALID_PARAMS, "a document and a package are needed")


def _declare(world: World, uri: str, package: str) -> None:
    known = world.known(uri)
    path = world.path(uri)
    project = world.projects.of(path) if path else None
    edit = project.workspace.dependency(path, package) if project and path else None
    if known is not None and edit is not None:
        change = workspace_edit([edit], known.state, world)
        label = f"declare {package}"
        world.ask("workspace/applyEdit", {"label": label, "edit": change})
