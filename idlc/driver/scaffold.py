"""The pipelines of `idlc scaffold`: what to add and to edit, then all of it or nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.disk.enclosing_package import MANIFEST, declared_name, manifest
from idlc.disk.library import Library
from idlc.disk.output.project import Done, Project
from idlc.disk.read import absolute, shown
from idlc.driver.stages import compile_package, stage
from idlc.emit.render import support_packages
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.scaffold import new_interface as interface_text
from idlc.scaffold import new_package as package_files
from idlc.scaffold.edits import cmake, data_files, package_xml
from idlc.scaffold.edits.outcome import Edited, Outcome


class Settings(NamedTuple):
    """What every scaffold command can be told."""

    dry_run: bool = False
    force: bool = False
    include: tuple[str, ...] = ()
    launch: bool = True


class Result(NamedTuple):
    """What a command did, or would do: its files, and a diff where nothing was written.

    `notes` say what is left to do by hand, `following` which arguments of `idlc` come next.
    """

    folder: str
    done: tuple[Done, ...]
    diff: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    following: tuple[str, ...] = ()


def package(
    wanted: package_files.Package,
    folder: str,
    settings: Settings,
    report: Report,
    starters: Mapping[str, str] | None = None,
) -> Result | None:
    """Write a new package below `folder`, with interfaces if it has none yet."""
    name = wanted.name if folder in ("", ".") else f"{folder}/{wanted.name}"
    project = Project(name, report, force=settings.force)
    with stage("scaffold", wanted.name):
        files = package_files.files(wanted)
    if not any(project.names(kind) for kind in ir.KINDS):
        files |= starters or {}
    # what later commands add to stays as it is
    growing = (*_GROWING, f"launch/{wanted.name}_launch.py")
    new = {
        path: text
        for path, text in files.items()
        if path not in growing or settings.force or not project.has(path)
    }
    return write(project, new, {}, settings, report)


#: Files of a new package that are edited later on.
_GROWING = (
    *(MANIFEST, "setup.py", "pyproject.toml", "setup.cfg", "CMakeLists.txt"),
    *("README.md", ".gitattributes", ".gitignore"),
)


def interface(
    kind: ir.Kind,
    name: str,
    fields: Sequence[str],
    comment: str,
    settings: Settings,
    report: Report,
) -> Result | None:
    """Write an interface file into the package that the working folder belongs to."""
    found = find_package(settings, report)
    if found is None:
        return None
    project, own = found
    path = f"{kind}/{name}.{kind}"
    text = interface_text.text(kind, fields, comment)
    full = ir.TypeName(own, kind, name)
    library = Library(settings.include, report, own={own: (project.path,)})
    problems = Report()
    model = compile_package(own, [(full, Source(project.shown(path), text))], library, problems)
    report.extend(problems)
    if report.had_errors:
        return None
    needed = set(derive.IMPLICIT_PACKAGES[kind]) | {one.package for one in model.interfaces}
    depends = sorted(needed - {own} - _reached_only(model))
    tests = _test_of_interfaces(project, own)
    runner = ["python3-pytest"] if tests else []
    edits = manifest_edit(project, depends, runner, group=True)
    lists = project.text("CMakeLists.txt")
    if lists is not None:
        edits.append(("CMakeLists.txt", cmake.add_dependencies(lists, depends)))
    setup = project.text("setup.py")
    if setup is not None and lists is None:
        kinds = {kind, *(one for one in ir.KINDS if project.names(one))}
        parts = [*support_packages(), *sorted(kinds)]
        packages = [own, *(f"{own}.{part}" for part in parts)]
        wired = data_files.add_libraries(setup)
        edits.append(("setup.py", data_files.add_packages(wired, packages)))
    edited = accepted(project, edits, report)
    if edited is None:
        return None
    if lists is None:
        keys = {f"{one}/{f}" for one in ir.KINDS for f in project.names(one) if f.endswith(one)}
        edited |= dict([interface_text.index(own, keys | {path})])
    result = write(project, {path: text, **tests}, edited, settings, report)
    after = generation(project, own) if lists is None else ()
    return result and result._replace(following=after)


def generation(project: Project, own: str) -> tuple[str, ...]:
    """Return the words of the command that compiles the package's interfaces."""
    if "[tool.idlc]" in (project.text("pyproject.toml") or ""):
        return ("gen",)
    return ("gen", project.name, "-o", project.shown(own))


def _test_of_interfaces(project: Project, own: str) -> dict[str, str]:
    """Return the test that `colcon test` runs, for a package that says what idlc generates."""
    path = "test/test_interfaces.py"
    if "[tool.idlc]" not in (project.text("pyproject.toml") or "") or project.has(path):
        return {}
    plain = package_files.Package(own, "", "", "", package_files.LICENSES[0])
    return {path: package_files.rendered("package/test_interfaces.py.jinja", plain)}


def _reached_only(model: Model) -> set[str]:
    """Return the packages that others depend on, but not the package itself."""
    direct = {
        element.target.package
        for one in model.own
        for message in derive.sections(one)
        for field in message.fields
        if isinstance(element := ir.element_of(field.type), ir.Ref)
    }
    implied = {p for one in model.own for p in derive.IMPLICIT_PACKAGES[one.name.kind]}
    return {name.package for name in model.interfaces} - direct - implied


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


def manifest_edit(
    project: Project, depends: Sequence[str], tests: Sequence[str], *, group: bool
) -> list[tuple[str, Outcome]]:
    """Return the edit that adds the dependencies that a package.xml lacks."""
    text = project.text(MANIFEST) or ""
    return [(MANIFEST, package_xml.add(text, depends=depends, tests=tests, group=group))]


def accepted(
    project: Project, edits: Sequence[tuple[str, Outcome]], report: Report
) -> dict[str, str] | None:
    """Return the edited texts; report IDL621 for each refusal and return `None`."""
    edited = {}
    for path, outcome in edits:
        if isinstance(outcome, Edited):
            edited[path] = outcome.text
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
    added: dict[str, str],
    edited: dict[str, str],
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
