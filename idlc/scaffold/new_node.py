"""Adding a node to its package: the files that a node needs, and those that list it.

Everything is a function of the texts of the package's files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from idlc.check.compiler import compile_package
from idlc.check.package.facts import folders
from idlc.diagnostics.report import Report
from idlc.model import ir
from idlc.model.distros import BY_NAME, DEFAULT
from idlc.project import package_xml
from idlc.project.edits import Edited, Outcome, Refused, Script
from idlc.project.prefixes import distribution, python_folders
from idlc.scaffold import spec
from idlc.scaffold.changes import (
    Project,
    Result,
    Settings,
    accepted,
    find_package,
    generation,
    keys_of,
    library_around,
    rendering,
    templates,
    type_name,
    write,
)
from idlc.scaffold.edits import launch_py, setup_py
from idlc.scaffold.node import render, render_test, test_packages
from idlc.scaffold.package import rendered_for
from idlc.scaffold.spec import Plan, plan
from idlc.scaffold.templates import Templates

MANIFEST = "package.xml"
SETUP = "setup.py"
CONFTEST = "test/conftest.py"
LAUNCH_ENDING = "launch.py"


class Entry(NamedTuple):
    """The changes that add a node to a package: new files, edits, and steps to do by hand.

    `notes` name the file that each is about.
    """

    added: Mapping[str, str]
    edits: Mapping[str, Outcome]
    notes: tuple[tuple[str, str], ...] = ()


def paths(package: str, launch_files: Iterable[str]) -> list[str]:
    """Return the files of a package whose texts decide; `launch_files` are names in `launch/`."""
    return [
        *("pyproject.toml", "setup.cfg", SETUP, MANIFEST, CONFTEST),
        *(f"{package}/__init__.py", _launch_file(package, launch_files)),
    ]


def node_entry(
    planned: Plan,
    texts: Mapping[str, str],
    templates: Templates,
    *,
    launch: bool = True,
    keys: Iterable[str] = (),
    folders: Mapping[str, bool] = MappingProxyType({}),
) -> Entry:
    """Return the changes that add a node to a package, but for its own files.

    `texts` are those of the package's files that exist. A package with interfaces,
    whose `keys` are as `kind/Name.kind`, installs them; `folders` are its folders by dotted name.
    A launch file lists the node, unless it does one thing and ends: that is for the command line.
    """
    node = planned.node
    script = Script(node.name, f"{node.package}.{node.name}:main")
    setup_files = ("pyproject.toml", "setup.cfg", SETUP)
    described = {name: texts[name] for name in setup_files if name in texts}
    if (own := tuple(keys)) and SETUP in described:
        text = described[SETUP]
        described[SETUP] = setup_py.add_interfaces(text, node.package, own, folders)
    path, outcome = setup_py.add_console_script(described, script)
    launch = launch and not planned.once
    manifest = package_xml.add_dependencies(
        texts.get(MANIFEST, ""),
        depends=planned.packages,
        tests=test_packages(planned),
        executes=("launch", "launch_ros") if launch else (),
    )
    edits: dict[str, Outcome] = {path: outcome, MANIFEST: manifest}
    # files that nodes need beside them
    added = {f"{node.package}/__init__.py": ""}
    added[CONFTEST] = rendered_for(node.package, "package/conftest.py.jinja", templates)
    added = {path: text for path, text in added.items() if path not in texts}
    if not launch:
        return Entry(added, edits)
    file = next((name for name in texts if name.startswith("launch/")), "")
    text = texts.get(file) or rendered_for(node.package, "package/launch.py.jinja", templates)
    started = launch_py.add_node(text, launch_py.Started(node.package, node.name, node.lifecycle))
    path = file or _launch_file(node.package, ())
    if isinstance(started, Refused):
        line = f"add this {started.where}: {started.line.rstrip(',')}"
        note = (path, f"is not edited: {started.why}; {line}")
        return Entry(added if file else {**added, path: text}, edits, (note,))
    if file:
        return Entry(added, {**edits, path: started})
    before = edits.get(SETUP, Edited(texts.get(SETUP, "")))
    if SETUP in texts and isinstance(before, Edited):
        edits[SETUP] = setup_py.add_launch(before.text, node.package, path)
    return Entry({**added, path: started.text}, edits)


def _launch_file(package: str, names: Iterable[str]) -> str:
    """Return the launch file that lists the package's nodes, of the names in `launch/`."""
    launch_files = [name for name in names if name.endswith(LAUNCH_ENDING)]
    preferred = [f"{package}_launch.py", f"{package}.launch.py"]
    for name in (*preferred, *(launch_files if len(launch_files) == 1 else ())):
        if name in launch_files:
            return f"launch/{name}"
    return f"launch/{preferred[0]}"


def node(requested: spec.Node, settings: Settings, report: Report) -> Result | None:
    """Write a node and its test, and add it to the files that list the nodes of its package."""
    located = find_package(settings, report)
    if located is None:
        return None
    project, own = located
    used = templates(settings, report)
    planned = _planned(requested._replace(package=own), project, settings, report)
    if planned is None or report.had_errors:
        return None
    entry = Entry({}, {})
    with rendering(requested.name, report):
        entry = _entry(planned, project, used, launch=settings.launch)
    edited = accepted(project, entry.edits, report)
    result = None if edited is None else write(project, entry.added, edited, settings, report)
    if result is None:
        return None
    missing = not project.has(f"{own}/_type_data.py")
    used_names = (placed.interface.name for placed in planned.endpoints if placed.interface)
    compiled = any(name.package == own for name in used_names)
    after = generation(project, own, settings) if missing and compiled else ()
    notes = (f"`{project.shown(path)}` {text}" for path, text in entry.notes)
    return result._replace(notes=(*notes, *_absent(planned)), following=after)


def _planned(
    requested: spec.Node, project: Project, settings: Settings, report: Report
) -> Plan | None:
    """Return the node with the interfaces of its endpoints; report missing ones."""
    library = library_around(requested.package, project, settings, report)
    interfaces: list[ir.Interface | None] = []
    messages: dict[ir.TypeName, ir.Message] = {}
    for endpoint in requested.endpoints:
        name = type_name(endpoint, requested.package, library, report)
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
    return None if report.had_errors else plan(requested, interfaces, messages)


def _entry(planned: Plan, project: Project, used: Templates, *, launch: bool) -> Entry:
    """Return the files of a node, and the edits that list it in its package."""
    own, name = planned.node.package, planned.node.name
    files = {
        f"{own}/{name}.py": render(planned, used),
        f"test/test_{name}.py": render_test(planned, used),
    }
    for path, text in files.items():
        compile(text, path, "exec", dont_inherit=True)
    read = {path: project.text(path) for path in paths(own, project.names("launch"))}
    texts = {path: text for path, text in read.items() if text is not None}
    keys, present = keys_of(project), folders(project.path)
    entry = node_entry(planned, texts, used, launch=launch, keys=keys, folders=present)
    return entry._replace(added={**files, **entry.added})


def _absent(planned: Plan) -> list[str]:
    """Return a note if ROS 2 is installed, but not all packages that the node imports."""
    absent = [name for name in planned.packages if not python_folders(name)]
    if not absent or not python_folders("rclpy"):
        return []
    names = ", ".join(f"`{name}`" for name in absent)
    distro = BY_NAME.get(distribution().name, DEFAULT)
    return [f"{names} cannot be imported here: {distro.installing(absent)}"]
