"""The pipelines of `idlc scaffold`: what to add and to edit, then all of it or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from idlc.disk.library import Library
from idlc.disk.package import MANIFEST, declared_name, manifest
from idlc.disk.project import Done, Project
from idlc.disk.read import absolute, shown
from idlc.driver.stages import compile_package, stage
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.scaffold import cmake, node_test, package_xml, spec
from idlc.scaffold import interface as interface_text
from idlc.scaffold import node as node_page
from idlc.scaffold import package as package_files
from idlc.scaffold.edit import Edited, Outcome, Script
from idlc.scaffold.plan import Plan, plan
from idlc.text import codes
from idlc.text.diagnostics import Report
from idlc.text.source import Source
from idlc.text.suggest import did_you_mean


class Settings(NamedTuple):
    """What every scaffold command can be told."""

    dry_run: bool = False
    force: bool = False
    include: tuple[str, ...] = ()


class Result(NamedTuple):
    """What a command did, or would do: its files, and a diff where nothing was written."""

    folder: str
    done: tuple[Done, ...]
    diff: tuple[str, ...] = ()


def package(
    wanted: package_files.Package, folder: str, settings: Settings, report: Report
) -> Result | None:
    """Write a new package below `folder`."""
    name = wanted.name if folder in ("", ".") else f"{folder}/{wanted.name}"
    project = Project(name, report, force=settings.force)
    with stage("scaffold", wanted.name):
        files = package_files.files(wanted)
    # what later commands add to stays as it is
    growing = (*_GROWING, f"launch/{wanted.name}_launch.py")
    new = {
        path: text
        for path, text in files.items()
        if path not in growing or settings.force or not _there(project, path)
    }
    return _write(project, new, {}, settings, report)


#: Files of a new package that are edited later on.
_GROWING = (MANIFEST, "setup.py", "pyproject.toml", "setup.cfg", "CMakeLists.txt")


def _there(project: Project, path: str) -> bool:
    return (project.path / path).exists()


def interface(
    kind: ir.Kind,
    name: str,
    fields: Sequence[str],
    comment: str,
    settings: Settings,
    report: Report,
) -> Result | None:
    """Write an interface file into the package that the working folder belongs to."""
    found = _package(settings, report)
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
    edits = _manifest(project, depends, [], group=True)
    lists = project.text("CMakeLists.txt")
    if lists is not None:
        edits.append(("CMakeLists.txt", cmake.add_dependencies(lists, depends)))
    edited = _accepted(project, edits, report)
    if edited is None:
        return None
    if lists is None:
        there = {f"{one}/{f}" for one in ir.KINDS for f in project.names(one) if f.endswith(one)}
        edited |= dict([interface_text.index(own, there | {path})])
    return _write(project, {path: text}, edited, settings, report)


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


def node(wanted: spec.Node, settings: Settings, report: Report) -> Result | None:
    """Write a node and its test, and enter it wherever its package lists its nodes."""
    found = _package(settings, report)
    if found is None:
        return None
    project, own = found
    wanted = wanted._replace(package=own)
    planned = _planned(wanted, project, settings, report)
    if planned is None:
        return None
    with stage("scaffold", wanted.name):
        added = {
            f"{own}/{wanted.name}.py": node_page.render(planned),
            f"test/test_{wanted.name}.py": node_test.render(planned),
        }
        for path, text in added.items():
            compile(text, path, "exec", dont_inherit=True)
        added |= _support(project, own)
        edits = _edits(project, planned, added)
    edited = _accepted(project, edits, report)
    if edited is None:
        return None
    return _write(project, added, edited, settings, report)


def _package(settings: Settings, report: Report) -> tuple[Project, str] | None:
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


def _planned(
    wanted: spec.Node, project: Project, settings: Settings, report: Report
) -> Plan | None:
    """Return the node with the interfaces that its endpoints name; reports IDL618."""
    library = Library(settings.include, report, own={wanted.package: (project.path,)})
    interfaces: list[ir.Interface] = []
    messages: dict[ir.TypeName, ir.Message] = {}
    for endpoint in wanted.endpoints:
        name = _type_name(endpoint, wanted.package, library, report)
        source = name and library.source(name)
        if not name or source is None:
            continue
        model = compile_package(name.package, [(name, source)], library, report)
        if not report.had_errors:
            interfaces.append(model.interfaces[name])
            messages.update(model.messages)
    return None if report.had_errors else plan(wanted, interfaces, messages)


def _type_name(
    endpoint: spec.Endpoint, own: str, library: Library, report: Report
) -> ir.TypeName | None:
    """Return the interface that `Name`, `package/Name` or `package/kind/Name` means here."""
    kind: ir.Kind = spec.ROLES[endpoint.role]
    parts = endpoint.type.split("/")
    package_name = parts[0] if len(parts) > 1 else own
    name = ir.TypeName(package_name, kind, parts[-1])
    fits = len(parts) <= 2 or (len(parts) == 3 and parts[1] == kind)
    if fits and library.source(name) is not None:
        return name
    known = [str(one) for one in library.interfaces(package_name) if one.kind == kind]
    hint = did_you_mean(str(name), known)
    if package_name == own:
        hint = hint or f"write it with `idlc scaffold interface {kind} {parts[-1]} FIELD...`"
    hint = hint or did_you_mean(package_name, library.packages())
    article = {"msg": "message", "srv": "service", "action": "action"}[kind]
    message = f"no such {article}: `{endpoint.type}`"
    report.add(codes.NO_SUCH_TYPE.of("", message, hint=hint))
    return None


def _support(project: Project, own: str) -> dict[str, str]:
    """Return the files that nodes need beside them and that their package lacks."""
    plain = package_files.Package(own, "", "", "", "Apache-2.0")
    found = {}
    if not _there(project, "test/conftest.py"):
        template = "scaffold_conftest.py.jinja"
        found["test/conftest.py"] = package_files.rendered(template, plain)
    if not _there(project, f"{own}/__init__.py"):
        found[f"{own}/__init__.py"] = ""
    return found


def _edits(project: Project, planned: Plan, added: dict[str, str]) -> list[tuple[str, Outcome]]:
    """Return the edits of the package's own files; new launch files go to `added`."""
    from idlc.scaffold import console_script, launch_py

    own, name = planned.node.package, planned.node.name
    texts = {
        path: text
        for path in ("pyproject.toml", "setup.cfg", "setup.py")
        if (text := project.text(path)) is not None
    }
    edits = [console_script.add_script(texts, Script(name, f"{own}.{name}:main"))]
    tests = ["python3-pytest", *(["lifecycle_msgs"] if planned.node.lifecycle else [])]
    edits += _manifest(project, planned.packages, tests, group=False)
    launch = _launch_file(project, own)
    text = project.text(launch)
    if text is None:
        plain = package_files.Package(own, "", "", "", "Apache-2.0")
        made = launch_py.add_node(
            package_files.rendered("scaffold_launch.py.jinja", plain), own, name
        )
        assert isinstance(made, Edited)
        added[launch] = made.text
    else:
        edits.append((launch, launch_py.add_node(text, own, name)))
    return edits


def _launch_file(project: Project, own: str) -> str:
    """Return the launch file that lists the package's nodes."""
    found = [name for name in project.names("launch") if name.endswith("launch.py")]
    preferred = [f"{own}_launch.py", f"{own}.launch.py"]
    for name in (*preferred, *(found if len(found) == 1 else ())):
        if name in found:
            return f"launch/{name}"
    return f"launch/{preferred[0]}"


def _manifest(
    project: Project, depends: Sequence[str], tests: Sequence[str], *, group: bool
) -> list[tuple[str, Outcome]]:
    text = project.text(MANIFEST) or ""
    return [(MANIFEST, package_xml.add(text, depends=depends, tests=tests, group=group))]


def _accepted(
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


def _write(
    project: Project,
    added: dict[str, str],
    edited: dict[str, str],
    settings: Settings,
    report: Report,
) -> Result | None:
    found = project.plan(added, edited)
    if found is None or report.had_errors:
        return None
    changes, done = found
    if settings.dry_run:
        return Result(project.name, tuple(done), tuple(project.diff(changes)))
    if not project.apply(changes):
        return None
    return Result(project.name, tuple(done))
