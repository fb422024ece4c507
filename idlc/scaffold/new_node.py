"""Adding a node to its package: the files that a node needs, and those that list it.

Everything is a function of the texts of the package's files.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

from idlc.compiler.compiler import compile_package, stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source
from idlc.model import ir
from idlc.model.distros import BY_NAME, DEFAULT
from idlc.packaging import dependencies, entry_points, launch_py
from idlc.packaging.entry_points import ConsoleScript
from idlc.packaging.facts import folders, home_of
from idlc.packaging.files import (
    CMAKE_LISTS,
    SETUP_FILES,
    SETUP_PY,
    Edited,
    Outcome,
    Refused,
    read_package_files,
)
from idlc.packaging.layout import layout
from idlc.packaging.setup_py import Setup
from idlc.project.package_xml import statements
from idlc.project.prefixes import distribution, python_folders
from idlc.project.root import MANIFEST
from idlc.project.settings import load_settings
from idlc.scaffold import changes, interface, spec
from idlc.scaffold.changes import Project, ScaffoldOptions, ScaffoldResult
from idlc.scaffold.node import render, render_test, test_packages
from idlc.scaffold.package import rendered_for
from idlc.scaffold.spec import NodePlan, plan

TESTS = "test"
#: Tests of robust nodes have fixtures of their own.
ROBUST_TESTS = "test/robust"
LAUNCH_ENDING = "launch.py"


class NodeEntry(NamedTuple):
    """The changes that add a node to a package: new files, edits, and steps to do by hand.

    `notes` name the file that each is about.
    """

    added: Mapping[str, str]
    edits: Mapping[str, Outcome]
    notes: tuple[tuple[str, str], ...] = ()


def paths(package: str, launch_files: Iterable[str], home: str = "") -> list[str]:
    """Return the files of a package whose texts decide; `launch_files` are names in `launch/`.

    `home` is the folder of the Python package, by default that of its name.
    """
    listed = [name for name in launch_files if name.endswith(LAUNCH_ENDING)]
    usual = [f"{package}_launch.py", f"{package}.launch.py"]
    chosen = listed if len(listed) == 1 else [name for name in usual if name in listed]
    launch_file = f"launch/{next(iter(chosen), usual[0])}"
    shared = [f"{folder}/conftest.py" for folder in (TESTS, ROBUST_TESTS)]
    return [*SETUP_FILES, MANIFEST, *shared, f"{home or package}/__init__.py", launch_file]


def node_entry(
    planned: NodePlan,
    texts: Mapping[str, str],
    *,
    keys: Iterable[str] = (),
    folders: Mapping[str, bool] = MappingProxyType({}),
    home: str = "",
) -> NodeEntry:
    """Return the changes that add a node to a package, but for its own files.

    `texts` are those of the package's files that exist. A package with interfaces,
    whose `keys` are as `kind/Name.kind`, installs them; `folders` are its folders by dotted name,
    and `home` is that of the Python package.
    A launch file lists the node, unless it does one thing and ends: that is for the command line.
    """
    node = planned.node
    script = ConsoleScript(node.name, f"{node.package}.{node.name}:main")
    described = {name: texts[name] for name in SETUP_FILES if name in texts}
    if (own := tuple(keys)) and SETUP_PY in described:
        text = described[SETUP_PY]
        described[SETUP_PY] = interface.add_interfaces(text, node.package, own, folders)
    path, outcome = entry_points.add_console_script(described, script)
    launch = not planned.once
    manifest = dependencies.add_dependencies(
        texts.get(MANIFEST, ""),
        depends=planned.packages,
        tests=test_packages(planned),
        executes=("launch", "launch_ros") if launch else (),
    )
    edits: dict[str, Outcome] = {path: outcome, MANIFEST: manifest}
    start = f"{home or node.package}/__init__.py"
    notes = list(_installed_package(node.package, start, texts, edits, folders))
    # files that nodes need beside them
    added = {} if start in texts else {start: ""}
    conftest = f"{_tests(planned)}/conftest.py"
    if conftest not in texts:
        template = f"node/{'short/' if planned.short else ''}conftest.py.jinja"
        added[conftest] = rendered_for(node.package, template)
    entry = NodeEntry(added, edits, tuple(notes))
    return _with_launch(entry, node, texts) if launch else entry


def _with_launch(entry: NodeEntry, node: spec.NodeSpec, texts: Mapping[str, str]) -> NodeEntry:
    """Return an entry that also adds the node to a launch file, which setup.py installs."""
    added, edits, notes = {**entry.added}, {**entry.edits}, [*entry.notes]
    file = next((name for name in texts if name.startswith("launch/")), "")
    template = "package/launch.py.jinja"
    old = texts[file] if file else rendered_for(node.package, template)
    started = launch_py.add_node(old, launch_py.Started(node.package, node.name, node.lifecycle))
    path = file or f"launch/{node.package}_launch.py"
    if isinstance(started, Refused):
        line = f"add this {started.where}: {started.line.rstrip(',')}"
        notes.append((path, f"is not edited: {started.why}; {line}"))
        added |= {} if file else {path: old}
    elif file:
        edits[path] = started
    else:
        added[path] = started.text
    before = edits.get(SETUP_PY, Edited(texts.get(SETUP_PY, "")))
    if SETUP_PY in texts and isinstance(before, Edited):
        text, line = entry_points.add_launch(before.text, node.package, path)
        edits[SETUP_PY] = Edited(text)
        if line:
            why = f"does not show whether it installs `{path}`"
            notes.append((SETUP_PY, f"{why}: if not, add {line} to `data_files`"))
    return NodeEntry(added, edits, tuple(notes))


def _installed_package(
    package: str,
    start: str,
    texts: Mapping[str, str],
    edits: dict[str, Outcome],
    folders: Mapping[str, bool],
) -> Iterator[tuple[str, str]]:
    """Have setup.py install the Python package of a node; yield what is to do by hand.

    `start` is the file that makes the folder a package.
    """
    before = edits.get(SETUP_PY, Edited(texts.get(SETUP_PY, "")))
    if SETUP_PY not in texts or not isinstance(before, Edited):
        return
    files = read_package_files(lambda name: Source(name, texts[name]) if name in texts else None)
    home = start.rpartition("/")[0].replace("/", ".")
    setup = Setup(Source(SETUP_PY, before.text))
    view = layout(setup, files.setup_cfg, files.pyproject, {**folders, home: True})
    text, missing = entry_points.add_package(before.text, package, view)
    edits[SETUP_PY] = Edited(text)
    if missing and start not in texts:
        yield SETUP_PY, f"may not install the node: {missing}"


def _tests(planned: NodePlan) -> str:
    """Return the folder of the node's test."""
    return TESTS if planned.short else ROBUST_TESTS


def node(requested: spec.NodeSpec, settings: ScaffoldOptions, report: Report) -> ScaffoldResult:
    """Write a node and its test, and add it to the files that list the nodes of its package.

    Raises ReportedError.
    """
    project = changes.find_package(settings, report)
    own, name = project.package, requested.name
    if _is_cmake(project):
        raise report.refused(_needs_python(project))
    home = home_of(project.path, own, settings.root).relative_to(project.path).as_posix()
    load_settings(settings.root, report)  # reports what is wrong with them
    planned = _planned(requested._replace(package=own), project, report)
    entry = NodeEntry({}, {})
    with stage("scaffold", name):
        files = {
            f"{home}/{name}.py": render(planned),
            f"{_tests(planned)}/test_{name}.py": render_test(planned),
        }
        for path, text in files.items():
            compile(text, path, "exec", dont_inherit=True)
        wanted = paths(own, project.names("launch"), home)
        texts = {path: content for path in wanted if (content := project.text(path)) is not None}
        keys, present = project.keys(), folders(project.path)
        entry = node_entry(planned, texts, keys=keys, folders=present, home=home)
        entry = entry._replace(added={**files, **entry.added})
    result = project.write(entry.added, project.accepted(entry.edits))
    notes = _notes(planned, entry, project)
    used_names = (placed.interface.name for placed in planned.endpoints if placed.interface)
    compiled = any(interface.package == own for interface in used_names)
    missing = not project.has(f"{home}/_type_data.py")
    after = project.generation() if missing and compiled else ()
    return result._replace(notes=tuple(notes), following=after)


def _notes(planned: NodePlan, entry: NodeEntry, project: Project) -> list[str]:
    """Return what is left to do by hand, and the packages that cannot be imported here."""
    notes = [f"`{project.shown(path)}` {text}" for path, text in entry.notes]
    absent = [package for package in planned.packages if not python_folders(package)]
    if absent and python_folders("rclpy"):
        listed = ", ".join(f"`{package}`" for package in absent)
        distro = BY_NAME.get(distribution().name, DEFAULT)
        notes.append(f"{listed} cannot be imported here: {distro.installing(absent)}")
    return notes


def _is_cmake(project: Project) -> bool:
    """Return whether CMake builds a package, which then has no console scripts."""
    declared = statements(Source(MANIFEST, project.text(MANIFEST) or ""))
    types = {each.text for each in declared if each.tag == "build_type"}
    return types == {"ament_cmake"} or (not types and project.has(CMAKE_LISTS))


def _needs_python(project: Project) -> Diagnostic:
    message = f"CMake builds `{project.package}`, and installs no console scripts"
    hint = f"create a package for nodes beside it: `idlc scaffold package {project.package}_nodes`"
    return codes.CANNOT_EDIT.of(project.shown(MANIFEST), message, hint=hint)


def _planned(requested: spec.NodeSpec, project: Project, report: Report) -> NodePlan:
    """Return the node with the interfaces of its endpoints; report missing ones, and raise."""
    library = project.library()
    interfaces: list[ir.Interface | None] = []
    messages: dict[ir.TypeName, ir.Message] = {}
    for endpoint in requested.endpoints:
        name = changes.type_name(endpoint, requested.package, library, report)
        source = name and library.source(name)
        if not name or source is None:
            interfaces.append(None)
            continue
        problems = Report()
        model = compile_package(name.package, [(name, source)], library, problems)
        if problems.had_errors:  # the interfaces of other endpoints are judged, too
            report.extend(problems)  # warnings were shown when the interface was written
        else:
            interfaces.append(model.interfaces[name])
            messages.update(model.messages)
    report.raise_errors()
    return plan(requested, interfaces, messages)
