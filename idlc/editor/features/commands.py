"""Commands, which an editor sends when its user chose one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from idlc.diagnostics.report import Report, first_few
from idlc.editor.elements import workspace_edit
from idlc.editor.features import rename
from idlc.editor.protocol import capabilities
from idlc.editor.protocol.capabilities import UPDATE_GENERATED
from idlc.editor.protocol.framing import INVALID_PARAMS, REQUEST_FAILED, RequestError
from idlc.editor.protocol.parts import Command
from idlc.editor.state import ServerState

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from idlc.generate.gen import Run
    from idlc.generate.package import Generated

#: Problems, and packages, that a message names.
NAMED = 5
_ERROR, _INFO = 1, 3


def command(state: ServerState, uri: str) -> dict[str, object] | None:
    """Return the command for a document whose generated package is out of date."""
    generation = _generated(state, uri)
    if generation is None or not generation[0].is_needed(*generation[1]):
        return None
    title = f"Update the generated package in {generation[0].options.out}"
    return {"title": title, "command": UPDATE_GENERATED, "arguments": [uri]}


def _generated(
    state: ServerState, uri: str
) -> tuple[Run, tuple[str, Mapping[str, str], str]] | None:
    """Return the run that a document is an input of, and all inputs of its package."""
    from idlc.generate.gen import run_for

    path = state.path(uri)
    workspace = state.workspace_of(path) if path else None
    if path is None or workspace is None:
        return None
    inputs = workspace.inputs(path)
    run = run_for(path, inputs[0])
    return (run, inputs) if run else None


def update(state: ServerState, uri: str) -> None:
    """Generate as `idlc gen` does, and report the outcome; raises RequestError."""
    generation = _generated(state, uri)
    if generation is None:
        raise RequestError(REQUEST_FAILED, "[tool.idlc] does not say where to generate it")
    run, (package, _, _) = generation
    unsaved = sorted(f"`{path.name}`" for path in _unsaved(state, package))
    if unsaved:
        names = first_few(unsaved, NAMED)
        raise RequestError(REQUEST_FAILED, f"save first, what is on disk is compiled: {names}")
    report = Report()
    try:
        done = run.make(report)
    except OSError as error:
        raise RequestError(REQUEST_FAILED, f"nothing was generated: {error}") from error
    state.forget()
    failed = report.had_errors
    message = _failure(report) if failed else _success(done)
    state.notify("window/showMessage", {"type": _ERROR if failed else _INFO, "message": message})


def _unsaved(state: ServerState, package: str) -> Iterator[Path]:
    """Yield the files of a package that hold another text than their documents."""
    for document in state.documents:
        context = state.context(document.uri)
        if (
            context
            and document.path
            and context.interface.name.package == package
            and not document.is_on_disk()
        ):
            yield document.path


def _failure(report: Report) -> str:
    listed = first_few(
        (
            f"{diagnostic.where[0]}: {diagnostic.code}: {diagnostic.message}"
            for diagnostic in report.errors
        ),
        NAMED,
    )
    return f"idlc gen: nothing was written: {listed}"


def _success(done: Iterable[Generated]) -> str:
    return "idlc gen: " + first_few(map(_done, done), NAMED)


def _done(generated: Generated) -> str:
    done = [f"{generated.written} written"] if generated.written else []
    done += [f"{generated.removed} removed"] if generated.removed else []
    return f"{generated.package}: {', '.join(done) or 'unchanged'} in {generated.out}"


def execute(state: ServerState, params: Command) -> None:
    """Run a command."""
    match params.command, *params.arguments:
        case capabilities.ADD_DEPENDENCY, str(uri), str(package):
            _declare(state, uri, package)
        case capabilities.RENAME_FILE, str(uri), str(new):
            _rename(state, uri, new)
        case capabilities.UPDATE_GENERATED, str(uri):
            update(state, uri)
        case _:
            raise RequestError(INVALID_PARAMS, f"there is no command `{params.command}` for these")


def _rename(state: ServerState, uri: str, new: str) -> None:
    state.forget()
    context = state.context(uri)
    edit = rename.rename_interface(context, uri, new, context, state) if context else None
    if edit is not None:
        state.ask("workspace/applyEdit", {"label": f"rename to {new}", "edit": edit})


def _declare(state: ServerState, uri: str, package: str) -> None:
    state.notice_changes()  # or the edit may be of an older package.xml
    context = state.context(uri)
    path = state.path(uri)
    workspace = state.workspace_of(path) if path else None
    edit = workspace.dependency(path, package) if workspace and path else None
    if context is not None and edit is not None:
        change = workspace_edit([edit], context.snapshot, state)
        label = f"declare {package}"
        state.ask("workspace/applyEdit", {"label": label, "edit": change})
