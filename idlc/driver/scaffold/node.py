"""The pipeline of `idlc scaffold node`."""

from __future__ import annotations

from idlc.diagnostics.report import Report
from idlc.disk.machine.distribution import distribution
from idlc.disk.machine.environment import python_folders
from idlc.disk.output.project import Project
from idlc.disk.packages.facts import folders
from idlc.driver.scaffold.changes import (
    Result,
    Settings,
    accepted,
    find_package,
    generation,
    keys_of,
    library_around,
    rendering,
    templates,
    write,
)
from idlc.driver.scaffold.types import type_name
from idlc.driver.stages import compile_package
from idlc.model import ir
from idlc.model.distro import BY_NAME, DEFAULT
from idlc.scaffold import node as node_module
from idlc.scaffold import node_tests, spec
from idlc.scaffold.edits import enter_node
from idlc.scaffold.edits.enter_node import Entry
from idlc.scaffold.planned import Plan, plan
from idlc.scaffold.templates import Templates


def node(wanted: spec.Node, settings: Settings, report: Report) -> Result | None:
    """Write a node and its test, and enter it wherever its package lists its nodes."""
    found = find_package(settings, report)
    if found is None:
        return None
    project, own = found
    used = templates(settings, report)
    planned = _planned(wanted._replace(package=own), project, settings, report)
    if planned is None or report.had_errors:
        return None
    entry = Entry({}, {})
    with rendering(wanted.name, report):
        entry = _entry(planned, project, used, launch=settings.launch)
    edited = accepted(project, entry.edits, report)
    result = None if edited is None else write(project, entry.added, edited, settings, report)
    if result is None:
        return None
    missing = not project.has(f"{own}/_idlc")
    compiled = any(one.interface and one.interface.name.package == own for one in planned.endpoints)
    after = generation(project, own, settings) if missing and compiled else ()
    notes = (f"`{project.shown(path)}` {text}" for path, text in entry.notes)
    return result._replace(notes=(*notes, *_absent(planned)), following=after)


def _planned(
    wanted: spec.Node, project: Project, settings: Settings, report: Report
) -> Plan | None:
    """Return the node with the interfaces of its endpoints; report those that there are not."""
    library = library_around(wanted.package, project, settings, report)
    interfaces: list[ir.Interface | None] = []
    messages: dict[ir.TypeName, ir.Message] = {}
    for endpoint in wanted.endpoints:
        name = type_name(endpoint, wanted.package, library, report)
        source = name and library.source(name)
        if not name or source is None:
            interfaces.append(None)
            continue
        problems = Report()
        model = compile_package(name.package, [(name, source)], library, problems)
        if problems.had_errors:
            report.extend(problems)  # warnings were shown when the interface was written
        else:
            interfaces.append(model.interfaces[name])
            messages.update(model.messages)
    return None if report.had_errors else plan(wanted, interfaces, messages)


def _entry(planned: Plan, project: Project, used: Templates, *, launch: bool) -> Entry:
    """Return the files of a node, and how its package lists it."""
    own, name = planned.node.package, planned.node.name
    files = {
        f"{own}/{name}.py": node_module.render(planned, used),
        f"test/test_{name}.py": node_tests.render(planned, used),
    }
    for path, text in files.items():
        compile(text, path, "exec", dont_inherit=True)
    read = {path: project.text(path) for path in enter_node.paths(own, project.names("launch"))}
    texts = {path: text for path, text in read.items() if text is not None}
    keys, there = keys_of(project), folders(project.path)
    entry = enter_node.enter(planned, texts, files, used, keys=keys, folders=there)
    if launch:
        entry = enter_node.launch(planned, texts, entry, used)
    return entry._replace(added={**files, **entry.added})


def _absent(planned: Plan) -> list[str]:
    """Return what to install, where there is ROS 2 but not all that the node imports."""
    absent = [name for name in planned.packages if not python_folders(name)]
    if not absent or not python_folders("rclpy"):
        return []
    names = ", ".join(f"`{name}`" for name in absent)
    here = BY_NAME.get(distribution().name, DEFAULT)
    return [f"{names} cannot be imported here: {here.installing(absent)}"]
