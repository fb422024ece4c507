"""What a server knows, which features look at."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from idlc.diagnostics.source import Source, Span
from idlc.editor.documents import Document, Documents
from idlc.editor.projects import Projects
from idlc.editor.protocol import positions, uris
from idlc.editor.protocol.capabilities import DEFAULT_ENCODING
from idlc.editor.protocol.parts import Location, Position, Range
from idlc.editor.workspace import State, Wishes
from idlc.model import ir
from idlc.project.cache import cache_folder

FOLDER = "interfaces"


def inside(source: Source) -> str:
    """Return what a text of the catalogue is, such as `jazzy/std_msgs/msg/Header.msg`."""
    return source.path.replace("<", "", 1).replace(">", "", 1)


def file_of(source: Source) -> Path | None:
    """Return a file of this user's cache that holds a text of the catalogue; `None` if none can."""
    base = cache_folder()
    if base is None:
        return None
    path = base / FOLDER / inside(source)
    data = source.text.encode()
    try:
        if not path.is_file() or path.read_bytes() != data:
            _write(path, data)
    except OSError:
        return None
    return path


def _write(path: Path, data: bytes) -> None:
    """Put a file that can only be read in the place of what is there, at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(name).chmod(0o444)
        Path(name).replace(path)
    except OSError:
        with suppress(OSError):
            Path(name).unlink()
        raise


#: What a client calls that it can watch folders which are not below the workspace's.
RELATIVE = "relativePatternSupport"
#: What it calls that it can show documents which are no files.
CONTENT = "textDocumentContent"


class Settings(Wishes, frozen=True, rename="camel", kw_only=True):
    """What an editor's settings say, below `idlc`: options of `idlc check`, and of features.

    `against` is what the lens on breaking changes compares with.
    """

    inlay_hints: bool = True
    code_lens: bool = True
    default_lens: bool = True
    against: str = ""


class Known(NamedTuple):
    """An interface file: what is known of its folder, what it defines, and its text."""

    state: State
    interface: ir.Interface
    source: Source


class Renaming(NamedTuple):
    """A file that the client was last told to rename, with the edits of its users.

    `text` is what the document at `uri`, where the user asked for it, holds after the edits.
    """

    old: Path
    new: Path
    uri: str
    text: str


class World:
    """The state of a server."""

    def __init__(
        self,
        ask: Callable[..., None] = lambda *_: None,
        tell: Callable[..., None] = lambda *_: None,
    ) -> None:
        #: Ask the client something, and tell it something: a method, and what it is given.
        self.ask = ask
        self.tell = tell
        self.documents = Documents()
        self.projects = Projects(self.documents)
        self.encoding = DEFAULT_ENCODING
        self.settings = Settings()
        self.client: dict[str, Any] = {}
        self.renaming: Renaming | None = None
        #: Folders that lenses compare with a revision, with those in which git notes what it is.
        self.repositories: dict[Path, tuple[Path, ...]] = {}

    def supports(self, *path: str) -> bool:
        """Return whether the client says that it can do something, or names it in a list."""
        found: Any = self.client
        for name in path:
            if isinstance(found, list):
                found = name in found
            else:
                found = found.get(name) if isinstance(found, dict) else None
        return found not in (None, False)

    def follow_git(self, folder: Path, repository: Callable[[], Iterable[Path]]) -> None:
        """Have the client tell when something else is checked out for a folder, if it can."""
        if folder in self.repositories:
            return
        places = self.repositories[folder] = tuple(repository())
        if not (places and self.supports("workspace", "didChangeWatchedFiles", RELATIVE)):
            return
        watchers = [
            {"globPattern": {"baseUri": uris.from_path(place), "pattern": pattern}}
            for place in places
            for pattern in ("{HEAD,packed-refs}", "refs/**")
        ]
        method = "workspace/didChangeWatchedFiles"
        options = {"watchers": watchers}
        one = {"id": uris.from_path(folder), "method": method, "registerOptions": options}
        self.ask("client/registerCapability", {"registrations": [one]})

    def is_gits(self, path: Path) -> bool:
        """Return whether a file is one in which git notes what is checked out."""
        places = (place for some in self.repositories.values() for place in some)
        return any(path.is_relative_to(place) for place in places)

    def lenses_moved(self) -> None:
        """Have lenses asked for again if what they compare with is another commit now."""
        against = self.settings.against
        moved = [
            one.workspace.earlier(against).has_moved()
            for one in self.projects
            if one.folder in self.repositories and one.is_loaded
        ]
        if any(moved):
            self.refresh("codeLens")

    def refresh(self, what: str) -> None:
        """Have the client ask for something again, such as `codeLens`, if it can."""
        if self.supports("workspace", what, "refreshSupport"):
            self.ask(f"workspace/{what}/refresh", None)

    def settle(self, given: object) -> str:
        """Take the client's settings; return what is wrong with them, empty if nothing is."""
        own = given.get("idlc", given) if isinstance(given, dict) else {}
        try:
            self.settings = msgspec.convert(own, Settings)
        except msgspec.ValidationError as error:
            return f"the settings of idlc are not used: {error}"
        wishes = {name: getattr(self.settings, name) for name in Wishes.__struct_fields__}
        self.projects.settle(Wishes(**wishes))
        return ""

    def known(self, uri: str) -> Known | None:
        """Return what is known of an interface file; `None` if it is not looked at."""
        path = self.path(uri)
        project = self.projects.of(path) if path else None
        state = project.state(self.documents) if project else None
        if path is None or state is None or path not in state.interfaces:
            return None
        interface, source = state.interfaces[path]
        return Known(state, interface, source)

    def path(self, uri: str) -> Path | None:
        """Return the path of a document."""
        document = self.documents.get(uri)
        return document.path if document else uris.to_path(uri)

    def uri(self, path: Path) -> str:
        """Return the URI of a file, as the client spells it if it is open."""
        document: Document | None = self.documents.at(path)
        return document.uri if document else uris.from_path(path)

    def offset(self, source: Source, position: Position) -> int:
        """Return the character of a text at a position."""
        return self._places(source).offset(position)

    def range(self, span: Span) -> Range:
        """Return the range of a span."""
        return self._places(span.source).range(span.start, span.end)

    def _places(self, source: Source) -> positions.Places:
        """Return the places of a text; a client that keeps byte order marks counts them."""
        skips_mark = positions.has_mark(source.text) and not any(
            positions.has_mark(one.text) for one in self.documents
        )
        return positions.places(source.text, self.encoding, skips_mark=skips_mark)

    def location(self, span: Span, state: State) -> Location:
        """Return the location of a span; what is built in is a document of its own.

        For clients that cannot show such a document, it is a file of the user's cache.
        """
        source = span.source
        if is_built_in(source):
            path = None if self.supports("workspace", CONTENT) else file_of(source)
            uri = uris.from_path(path) if path else f"idlc:/{inside(source)}"
            return Location(uri, self.range(span))
        return Location(self.uri(state.path_of(source)), self.range(span))


def is_built_in(source: Source) -> bool:
    """Return whether a text is of the catalogue."""
    return source.path.startswith("<")
