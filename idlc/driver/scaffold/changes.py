"""What the commands of `idlc scaffold` share: the package around, then all changes or none."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import NamedTuple

from idlc.checks.package.long_lines import wrapped
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.disk.cache import templates as template_cache
from idlc.disk.library import Library
from idlc.disk.output.project import Done, Project
from idlc.disk.packages.enclosing import declared_name, manifest
from idlc.disk.packages.facts import home_of
from idlc.disk.read import absolute, shown
from idlc.disk.scope import scope
from idlc.disk.settings import pyproject, user_templates
from idlc.driver.stages import stage
from idlc.model import ir
from idlc.scaffold.edits.outcome import Edited, Outcome
from idlc.scaffold.template_problems import BrokenTemplateError
from idlc.scaffold.templates import ENDING, Templates, folders


class Settings(NamedTuple):
    """What every scaffold command can be told."""

    dry_run: bool = False
    force: bool = False
    include: tuple[str, ...] = ()
    launch: bool = True
    templates: str | None = None


class Result(NamedTuple):
    """What a command did, or would do: its files, and a diff where nothing was written.

    `notes` say what is left to do by hand, `following` which arguments of `idlc` come next.
    """

    folder: str
    done: tuple[Done, ...]
    diff: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    following: tuple[str, ...] = ()


def templates(settings: Settings, report: Report) -> Templates:
    """Return idlc's templates, and those of the user's folder instead of them."""
    folder = settings.templates or pyproject.load(report).templates
    if folder is None:
        return Templates()
    found = Templates(user_templates.read(folder, folders(), ENDING, report))
    found.check(report)
    return found


@contextmanager
def rendering(subject: str, report: Report) -> Iterator[None]:
    """Report what is wrong with a user's template within; anything else is idlc's own fault."""
    template_cache.keep()
    with stage("scaffold", subject):
        try:
            yield
        except BrokenTemplateError as error:
            report.add(error.problem)


def find_package(settings: Settings, report: Report) -> tuple[Project, str] | None:
    """Return the package that the working folder belongs to, and its name."""
    manifest.cache_clear()
    path = manifest(absolute("."))
    if path is None:
        message = "this folder belongs to no package: there is no package.xml here or above"
        hint = "run `idlc scaffold package NAME`, then `cd NAME`"
        report.add(codes.NO_SUCH_PATH.of("package.xml", message, hint=hint))
        return None
    name = declared_name(path, shown(path), report)
    folder = shown(path.parent) if path.parent != absolute(".") else "."
    return None if name is None else (Project(folder, report, force=settings.force), name)


def library_around(package: str, project: Project, settings: Settings, report: Report) -> Library:
    """Return the library that has a package and what is used in it."""
    distro = scope(pyproject.load(Report())).distro
    own = {package: (project.path,)}
    return Library(settings.include, report, own=own, distro=distro)


def generation(project: Project, own: str, settings: Settings) -> tuple[str, ...]:
    """Return the words of the command that compiles the package's interfaces."""
    included = (word for folder in settings.include for word in ("-I", folder))
    if "[tool.idlc]" in (project.text("pyproject.toml") or ""):
        return ("gen", *included)
    home = home_of(project.path, own).relative_to(project.path).as_posix()
    return ("gen", project.name, "-o", project.shown(home), *included)


def keys_of(project: Project) -> set[str]:
    """Return the interfaces of a package as `kind/Name.kind`."""
    return {f"{k}/{name}" for k in ir.KINDS for name in project.names(k) if name.endswith(f".{k}")}


def accepted(
    project: Project, edits: Mapping[str, Outcome], report: Report
) -> dict[str, str] | None:
    """Return the edited texts; report IDL621 for each refusal and return `None`."""
    edited = {}
    for path, outcome in edits.items():
        if isinstance(outcome, Edited):
            edited[path] = outcome.text
            if path == "setup.py":
                edited[path] = wrapped(project.text(path) or "", outcome.text)
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
    """Write all files or none, or show what that would change; `None` after a problem."""
    found = project.plan(added, edited)
    if found is None or report.had_errors:
        return None
    changes, done = found
    if settings.dry_run:
        return Result(project.name, tuple(done), tuple(project.diff(changes)))
    if not project.apply(changes):
        return None
    return Result(project.name, tuple(done))
