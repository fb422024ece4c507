"""Commands, which an editor sends when its user chose one of them."""

from __future__ import annotations

from idlc.lsp.edits import workspace_edit
from idlc.lsp.features import generated, rename
from idlc.lsp.protocol import capabilities
from idlc.lsp.protocol.errors import INVALID_PARAMS, RequestError
from idlc.lsp.protocol.parts import Command
from idlc.lsp.world import World


def execute(world: World, asked: Command) -> None:
    """Carry a command out."""
    match asked.command, *asked.arguments:
        case capabilities.ADD_DEPENDENCY, str(uri), str(package):
            _declare(world, uri, package)
        case capabilities.RENAME_FILE, str(uri), str(new):
            _rename(world, uri, new)
        case capabilities.UPDATE_GENERATED, str(uri):
            generated.update(world, uri)
        case _:
            raise RequestError(INVALID_PARAMS, f"there is no command `{asked.command}` for these")


def _rename(world: World, uri: str, new: str) -> None:
    world.projects.forget()
    known = world.known(uri)
    edit = rename.rename_interface(known, uri, new, known, world) if known else None
    if edit is not None:
        world.ask("workspace/applyEdit", {"label": f"rename to {new}", "edit": edit})


def _declare(world: World, uri: str, package: str) -> None:
    world.projects.notice_changes()  # or the edit may be of an older package.xml
    known = world.known(uri)
    path = world.path(uri)
    project = world.projects.of(path) if path else None
    edit = project.workspace.dependency(path, package) if project and path else None
    if known is not None and edit is not None:
        change = workspace_edit([edit], known.state, world)
        label = f"declare {package}"
        world.ask("workspace/applyEdit", {"label": label, "edit": change})
