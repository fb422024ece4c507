"""The steps that the commands of `idlc scaffold` share: finding the package, making changes."""

from __future__ import annotations

import difflib
from codecs import BOM_UTF8
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.diagnostics.text import did_you_mean
from idlc.model import ir
from idlc.packaging.facts import home_of
from idlc.packaging.files import SETUP_PY, Edited, Outcome
from idlc.packaging.setup_edits import arrange
from idlc.project.files import entries
from idlc.project.library import Library
from idlc.project.lock import Tree
from idlc.project.package_xml import declared_name
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import SETTINGS_FILE, load_settings, scope
from idlc.project.step import digest
from idlc.project.write import FileChange, WritePlan, apply, compare, difference, shown
from idlc.scaffold.roles import ROLES, EndpointSpec, Role


class FileOutcome(NamedTuple):
    """A file and its outcome: `created`, `edited`, `replaced` or `unchanged`."""

    path: str
    what: str


class ScaffoldOptions(NamedTuple):
    """The options of every scaffold command, and the folder that it works in."""

    root: Root
    dry_run: bool = False
    force: bool = False
    include: tuple[str, ...] = ()


class ScaffoldResult(NamedTuple):
    """The files that a command wrote or would write, with a diff if it wrote nothing.

    `notes` list steps to do by hand, `following` the arguments of the next `idlc` command.
    """

    folder: str
    done: tuple[FileOutcome, ...]
    diff: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    following: tuple[str, ...] = ()


def marked(text: str, old: bytes) -> bytes:
    """Return the bytes of an edited file, with the byte order mark that it had."""
    return BOM_UTF8 * old.startswith(BOM_UTF8) + text.encode()


class Project:
    """A package's folder, existing or not; `name` is the folder's name in reports."""

    def __init__(
        self, name: str, settings: ScaffoldOptions, report: Report, package: str = ""
    ) -> None:
        self.name = name
        self.package = package
        self.path: Path = settings.root.absolute(name)
        self._settings = settings
        self._report = report

    def shown(self, path: str) -> str:
        """Return the name of a file in the folder for reports."""
        return shown(self.name, path)

    def has(self, path: str) -> bool:
        """Return whether a file or folder of this name exists."""
        return (self.path / path).exists()

    def text(self, path: str) -> str | None:
        """Return a file's text, `None` without one; no byte order mark, which edits keep."""
        if not (self.path / path).is_file():
            return None
        root = self._settings.root
        source = root.read_source(self.path / path, self.shown(path), self._report)
        return source.text.removeprefix("\ufeff") if source else None

    def names(self, folder: str) -> list[str]:
        """Return the names of the files in one of its folders, sorted."""
        return [path.name for path in entries(self.path / folder) if path.is_file()]

    def keys(self) -> set[str]:
        """Return the interfaces of the package as `kind/Name.kind`."""
        return {f"{k}/{name}" for k in ir.KINDS for name in self.names(k) if name.endswith(f".{k}")}

    def library(self) -> Library:
        """Return a library with the package and the packages that it may use."""
        root, include = self._settings.root, self._settings.include
        distro = scope(load_settings(root, Report())).distro
        return Library(include, root, self._report, own={self.package: (self.path,)}, distro=distro)

    def generation(self) -> tuple[str, ...]:
        """Return the words of the command that compiles the package's interfaces."""
        included = [word for folder in self._settings.include for word in ("-I", folder)]
        if "[tool.idlc]" in (self.text(SETTINGS_FILE) or ""):
            return ("gen", *included)
        home = home_of(self.path, self.package, self._settings.root)
        out = self.shown(home.relative_to(self.path).as_posix())
        return ("gen", self.name, "-o", out, *included)

    def accepted(self, edits: Mapping[str, Outcome]) -> dict[str, str]:
        """Return the edited texts; report IDL621 for each refusal. Raises ReportedError."""
        self._report.raise_errors()  # a file that cannot be read is not missing
        edited = {}
        for path, outcome in edits.items():
            if isinstance(outcome, Edited):
                edited[path] = outcome.text
                if path == SETUP_PY:
                    edited[path] = arrange(self.text(path) or "", outcome.text)
                continue
            place = self.shown(path)
            message = f"cannot edit `{place}`: {outcome.why}"
            lines = "these lines" if "\n" in outcome.line else "this line"
            hint = f"add {lines} {outcome.where}, then run the command again"
            self._report.add(codes.CANNOT_EDIT.of(place, message, hint=hint, detail=outcome.line))
        self._report.raise_errors()
        return edited

    def write(
        self, added: Mapping[str, str], edited: Mapping[str, str] = MappingProxyType({})
    ) -> ScaffoldResult:
        """Write all files or none, or only show the changes.

        `edited` texts replace what was read before; `added` ones only an equal file, unless the
        command runs with force. Reports IDL614 and IDL620, and raises ReportedError.
        """
        files = {path: text.encode("utf-8") for path, text in sorted({**added, **edited}.items())}
        tree, owned = Tree(self.path), {}
        for path in edited:
            old = tree.read(path)
            if isinstance(old, bytes):
                files[path] = marked(edited[path], old)
                owned[path] = frozenset((digest(old),))
        changes = {c.path: c for c in compare(self.path, self.name, files, owned, self._report)}
        done = []
        for path, content in files.items():
            change = changes.get(path)
            if change is None:
                what = "unchanged"
            elif change.old is None:
                what = "created"
            else:
                what = "edited" if path in edited else "replaced"
                if what == "replaced" and not self._settings.force:
                    place, detail = self.shown(path), "\n".join(difference(change.old, content))
                    message = f"`{place}` already exists with different content"
                    hint = "choose another name, or add --force, "
                    hint += "which keeps a copy of the file"
                    problem = codes.EXISTING_FILE.of(place, message, hint=hint, detail=detail)
                    self._report.add(problem)
            done.append(FileOutcome(path, what))
        self._report.raise_errors()
        if self._settings.dry_run:
            return ScaffoldResult(self.name, tuple(done), tuple(self._diff(changes.values())))
        if not apply(WritePlan(self.path, (*changes.values(),), {}), self.name, self._report):
            raise ReportedError
        return ScaffoldResult(self.name, tuple(done))

    def _diff(self, changes: Iterable[FileChange]) -> Iterator[str]:
        """Yield the lines of a unified diff of planned changes."""
        for change in changes:
            path = self.shown(change.path)
            before = f"a/{path}" if change.old is not None else "/dev/null"
            old, new = (
                (data or b"").decode("utf-8", errors="replace").splitlines(keepends=True)
                for data in (change.old, change.new)
            )
            for line in difflib.unified_diff(old, new, before, f"b/{path}"):
                yield line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"
            if not old and not new:
                yield f"--- {before}\n+++ b/{path}\n"


def find_package(settings: ScaffoldOptions, report: Report) -> Project:
    """Return the package that the working folder belongs to. Raises ReportedError."""
    root = settings.root
    path = root.manifest(root.base)
    if path is None:
        message = "this folder is not in a package: no package.xml here or above"
        hint = "run `idlc scaffold package NAME`, then `cd NAME`"
        raise report.refused(codes.NO_SUCH_PATH.of(MANIFEST, message, hint=hint))
    name = declared_name(path, root, report)
    if name is None:
        raise ReportedError
    folder = root.shown(path.parent) if path.parent != root.base else "."
    return Project(folder, settings, report, name)


def check(role: Role, type_: str, settings: ScaffoldOptions) -> None:
    """Raise ValueError if there is no such interface for the package of the working folder."""
    report = Report()
    try:
        project = find_package(settings, report)
    except ReportedError:
        return  # it is reported when the node is written
    type_name(EndpointSpec(role, type_, ""), project.package, project.library(), report)
    for problem in report:
        raise ValueError("; ".join(filter(None, (problem.message, problem.hint))))


def type_name(
    endpoint: EndpointSpec, own: str, library: Library, report: Report
) -> ir.TypeName | None:
    """Return the interface that `Name`, `package/Name` or `package/kind/Name` means here."""
    kind = endpoint.role.kind
    if kind is None:
        return None
    parts = endpoint.type.split("/")
    name = ir.TypeName(parts[0] if len(parts) > 1 else own, kind, parts[-1])
    fits = len(parts) <= 2 or (len(parts) == 3 and parts[1] == kind)
    if fits and library.source(name) is not None:
        return name
    message = f"no such {_ARTICLES[kind]}: `{endpoint.type}`"
    report.add(codes.NO_SUCH_TYPE.of("", message, hint=_hint(name, own, library)))
    return None


_ARTICLES: dict[ir.Kind, str] = {"msg": "message", "srv": "service", "action": "action"}


def _hint(name: ir.TypeName, own: str, library: Library) -> str | None:
    """Return a hint for the name of an interface that does not exist."""
    for kind, what in _ARTICLES.items():
        if kind != name.kind and library.source(name._replace(kind=kind)) is not None:
            options = " or ".join(role.option for role in ROLES if role.kind == kind)
            return f"it is {'an' if what == 'action' else 'a'} {what}: use {options}"
    if name.package == own:
        packages = library.packages()
        others = [p for p in packages if name._replace(package=p) in library.interfaces(p)]
        if others:
            return f"did you mean {' or '.join(f'`{package}/{name.name}`' for package in others)}?"
    interfaces = library.interfaces(name.package)
    names_of_kind = [str(other) for other in interfaces if other.kind == name.kind]
    hint = did_you_mean(str(name), names_of_kind)
    if name.package == own:
        return hint or f"write it with `idlc scaffold interface {name.kind} {name.name} FIELD...`"
    if hint or name.package in library.packages():
        return hint
    near = did_you_mean(name.package, library.packages())
    return near or f"no such package: `{name.package}`; add its folder with -I"
