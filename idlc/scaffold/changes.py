"""The steps that the commands of `idlc scaffold` share: finding the package, making changes."""

from __future__ import annotations

import difflib
from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from idlc.check.compiler import stage
from idlc.check.package.facts import home_of
from idlc.check.package.setup_edits import wrap_lines
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.text import did_you_mean
from idlc.model import ir
from idlc.project.edits import Edited, Outcome
from idlc.project.files import decode, entries, read_bytes
from idlc.project.library import Library
from idlc.project.lock import Tree, digest
from idlc.project.package_xml import declared_name
from idlc.project.root import Root
from idlc.project.settings import load_settings, scope
from idlc.project.templates import verbatim
from idlc.project.write import Plan, apply, compare, difference, shown
from idlc.scaffold.roles import ROLES, Endpoint, Role
from idlc.scaffold.templates import BrokenTemplateError, Templates, read


class FileOutcome(NamedTuple):
    """A file and its outcome: `created`, `edited`, `replaced` or `unchanged`."""

    path: str
    what: str


class Project:
    """A package's folder, existing or not; `name` is its name in reports."""

    def __init__(self, name: str, root: Root, report: Report, *, force: bool = False) -> None:
        self.name = name
        self.path: Path = root.absolute(name)
        self._report = report
        self._force = force

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
        data = read_bytes(self.path / path, self.shown(path), self._report)
        source = None if data is None else decode(data, self.shown(path), self._report)
        return source.text.removeprefix("\ufeff") if source else None

    def names(self, folder: str) -> list[str]:
        """Return the names of the files in one of its folders, sorted."""
        return [path.name for path in entries(self.path / folder) if path.is_file()]

    def plan(
        self, added: Mapping[str, str], edited: Mapping[str, str] | None = None
    ) -> tuple[Plan, list[FileOutcome]] | None:
        """Return the changes that write files; `None` if something is in the way.

        `edited` texts replace what was read before; `added` ones only an equal file, unless the
        folder is written with force. Reports IDL614 and IDL620.
        """
        edited = edited or {}
        files = {path: text.encode("utf-8") for path, text in sorted({**added, **edited}.items())}
        tree, owned = Tree(self.path), {}
        for path in edited:
            old = tree.read(path)
            if isinstance(old, bytes):
                files[path] = BOM_UTF8 * old.startswith(BOM_UTF8) + files[path]
                owned[path] = frozenset((digest(old),))
        report = Report()
        changes = {c.path: c for c in compare(self.path, self.name, files, owned, report)}
        outcomes = []
        for path in files:
            change = changes.get(path)
            if change is None:
                outcomes.append(FileOutcome(path, "unchanged"))
            elif change.old is None:
                outcomes.append(FileOutcome(path, "created"))
            elif path in edited:
                outcomes.append(FileOutcome(path, "edited"))
            else:
                outcomes.append(FileOutcome(path, "replaced"))
                if not self._force:
                    report.add(self._differs(path, change.old, files[path]))
        self._report.extend(report)
        return None if report.had_errors else (Plan(self.path, (*changes.values(),), {}), outcomes)

    def diff(self, plan: Plan) -> Iterator[str]:
        """Yield the lines of a unified diff of planned changes."""
        for change in plan.changes:
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

    def _differs(self, path: str, old: bytes, new: bytes) -> Diagnostic:
        shown = self.shown(path)
        return codes.EXISTING_FILE.of(
            shown,
            f"`{shown}` exists and is not what would be written",
            hint="keep it and choose another name, or run again with --force, which keeps a copy",
            detail="\n".join(difference(old, new)),
        )


class Settings(NamedTuple):
    """The options of every scaffold command, and the folder that it works in."""

    root: Root
    dry_run: bool = False
    force: bool = False
    include: tuple[str, ...] = ()
    launch: bool = True
    templates: str | None = None


class Result(NamedTuple):
    """The files that a command wrote or would write, with a diff if it wrote nothing.

    `notes` list steps to do by hand, `following` the arguments of the next `idlc` command.
    """

    folder: str
    done: tuple[FileOutcome, ...]
    diff: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    following: tuple[str, ...] = ()


def templates(settings: Settings, report: Report) -> Templates:
    """Return idlc's templates, where templates in the user's folder replace them."""
    folder = settings.templates or load_settings(settings.root, report).templates
    if not folder:
        return Templates()
    user_templates = Templates(read(folder, settings.root, report))
    user_templates.check(report)
    return user_templates


@contextmanager
def rendering(subject: str, report: Report) -> Iterator[None]:
    """Report problems of a user's template within; other exceptions are bugs of idlc."""
    with stage("scaffold", subject):
        try:
            yield
        except BrokenTemplateError as error:
            report.add(error.problem)


def find_package(settings: Settings, report: Report) -> tuple[Project, str] | None:
    """Return the package that the working folder belongs to, and its name."""
    root = settings.root
    path = root.manifest(root.base)
    if path is None:
        message = "this folder belongs to no package: there is no package.xml here or above"
        hint = "run `idlc scaffold package NAME`, then `cd NAME`"
        report.add(codes.NO_SUCH_PATH.of("package.xml", message, hint=hint))
        return None
    name = declared_name(path, root, report)
    folder = root.shown(path.parent) if path.parent != root.base else "."
    return (
        None
        if name is None
        else (Project(folder, settings.root, report, force=settings.force), name)
    )


def library_around(package: str, project: Project, settings: Settings, report: Report) -> Library:
    """Return a library with a package and the packages that it may use."""
    distro = scope(load_settings(settings.root, Report())).distro
    own = {package: (project.path,)}
    return Library(settings.include, settings.root, report, own=own, distro=distro)


def generation(project: Project, own: str, settings: Settings) -> tuple[str, ...]:
    """Return the words of the command that compiles the package's interfaces."""
    included = (word for folder in settings.include for word in ("-I", folder))
    if "[tool.idlc]" in (project.text("pyproject.toml") or ""):
        return ("gen", *included)
    home = home_of(project.path, own, settings.root).relative_to(project.path).as_posix()
    return ("gen", project.name, "-o", project.shown(home), *included)


def keys_of(project: Project) -> set[str]:
    """Return the interfaces of a package as `kind/Name.kind`."""
    return {f"{k}/{name}" for k in ir.KINDS for name in project.names(k) if name.endswith(f".{k}")}


def accepted(
    project: Project, edits: Mapping[str, Outcome], report: Report
) -> dict[str, str] | None:
    """Return the edited texts; report IDL621 for each refusal and return `None`."""
    if report.had_errors:  # a file that cannot be read is not missing
        return None
    edited = {}
    for path, outcome in edits.items():
        if isinstance(outcome, Edited):
            edited[path] = outcome.text
            if path == "setup.py":
                edited[path] = wrap_lines(project.text(path) or "", outcome.text)
            continue
        shown_path = project.shown(path)
        report.add(
            codes.CANNOT_EDIT.of(
                shown_path,
                f"cannot edit `{shown_path}`: {outcome.why}",
                hint=f"add this line by hand {outcome.where}, then run the command again",
                detail=outcome.line,
            )
        )
    return None if report.had_errors else edited


def write(
    project: Project,
    added: Mapping[str, str],
    edited: Mapping[str, str],
    settings: Settings,
    report: Report,
) -> Result | None:
    """Write all files or none, or only show the changes; `None` after a problem."""
    planned = project.plan(added, edited)
    if planned is None or report.had_errors:
        return None
    changes, done = planned
    if settings.dry_run:
        return Result(project.name, tuple(done), tuple(project.diff(changes)))
    if not apply(changes, project.name, report):
        return None
    return Result(project.name, tuple(done))


#: The default folder of copies.
FOLDER = "templates"


def copied(chosen: Sequence[str], settings: Settings, report: Report) -> Result | None:
    """Copy templates into the user's folder, to be changed there."""
    set_already = settings.templates or load_settings(settings.root, report).templates
    if report.had_errors:
        return None
    folder = set_already or FOLDER
    project = Project(folder, settings.root, report, force=settings.force)
    result = write(project, {name: verbatim(name) for name in chosen}, {}, settings, report)
    if result is None or set_already:
        return result
    note = f'set `templates = "{folder}"` in [tool.idlc] of pyproject.toml, or use --templates'
    return result._replace(notes=(note,))


def check(role: Role, type_: str, settings: Settings) -> None:
    """Raise ValueError if there is no such interface for the package of the working folder."""
    report = Report()
    located = find_package(settings, report)
    if located is None or role.kind is None:
        return  # a missing package is reported when the node is written
    project, own = located
    library = library_around(own, project, settings, report)
    type_name(Endpoint(role, type_, ""), own, library, report)
    for problem in report:
        raise ValueError("; ".join(filter(None, (problem.message, problem.hint))))


def type_name(endpoint: Endpoint, own: str, library: Library, report: Report) -> ir.TypeName | None:
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
        elsewhere = [
            f"`{package}/{name.name}`"
            for package in library.packages()
            if ir.TypeName(package, name.kind, name.name) in library.interfaces(package)
        ]
        if elsewhere:
            return f"did you mean {' or '.join(elsewhere)}?"
    interfaces = library.interfaces(name.package)
    names_of_kind = [str(other) for other in interfaces if other.kind == name.kind]
    hint = did_you_mean(str(name), names_of_kind)
    if name.package == own:
        return hint or f"write it with `idlc scaffold interface {name.kind} {name.name} FIELD...`"
    if hint or name.package in library.packages():
        return hint
    near = did_you_mean(name.package, library.packages())
    return near or f"there is no package `{name.package}` here: name its folder with -I"
