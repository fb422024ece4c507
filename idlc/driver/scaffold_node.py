"""The pipeline of `idlc scaffold node`."""

from __future__ import annotations

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.suggest import did_you_mean
from idlc.disk.environment import python_folders
from idlc.disk.library import Library
from idlc.disk.output.project import Project
from idlc.driver.scaffold import (
    Result,
    Settings,
    accepted,
    find_package,
    generation,
    manifest_edit,
    write,
)
from idlc.driver.stages import compile_package, stage
from idlc.model import ir
from idlc.scaffold import new_package as package_files
from idlc.scaffold import node as node_page
from idlc.scaffold import node_tests, spec
from idlc.scaffold.edits import console_script, data_files, launch_py
from idlc.scaffold.edits.outcome import Edited, Outcome, Script
from idlc.scaffold.planned import Plan, plan


def node(wanted: spec.Node, settings: Settings, report: Report) -> Result | None:
    """Write a node and its test, and enter it wherever its package lists its nodes."""
    found = find_package(settings, report)
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
            f"test/test_{wanted.name}.py": node_tests.render(planned),
        }
        for path, text in added.items():
            compile(text, path, "exec", dont_inherit=True)
        added |= _support(project, own)
        edits = _edits(project, planned)
        notes = _launched(project, planned, added, edits) if settings.launch else []
    edited = accepted(project, list(edits.items()), report)
    if edited is None:
        return None
    result = write(project, added, edited, settings, report)
    if result is None:
        return None
    missing = not project.has(f"{own}/_idlc")
    compiled = own in {interface.name.package for interface in planned.interfaces}
    after = generation(project, own) if missing and compiled else ()
    return result._replace(notes=(*notes, *_absent(planned)), following=after)


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
        problems = Report()
        model = compile_package(name.package, [(name, source)], library, problems)
        if problems.had_errors:
            report.extend(problems)  # warnings were shown when the interface was written
        else:
            interfaces.append(model.interfaces[name])
            messages.update(model.messages)
    return None if report.had_errors else plan(wanted, interfaces, messages)


def check_type(role: spec.Role, type_: str, settings: Settings) -> None:
    """Raise ValueError if there is no such interface for the package of the working folder."""
    report = Report()
    found = find_package(settings, report)
    if found is None:
        return  # which is said when the node is written
    library = Library(settings.include, report, own={found[1]: (found[0].path,)})
    _type_name(spec.Endpoint(role, type_, ""), found[1], library, report)
    for problem in report:
        raise ValueError("; ".join(filter(None, (problem.message, problem.hint))))


def _type_name(
    endpoint: spec.Endpoint, own: str, library: Library, report: Report
) -> ir.TypeName | None:
    """Return the interface that `Name`, `package/Name` or `package/kind/Name` means here."""
    kind: ir.Kind = spec.ROLES[endpoint.role]
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
    """Return what may have been meant by an interface that there is not."""
    for kind, what in _ARTICLES.items():
        if kind != name.kind and library.source(name._replace(kind=kind)) is not None:
            roles = [role for role, spoken in spec.ROLES.items() if spoken == kind]
            options = " or ".join(f"--{role.replace('_', '-')}" for role in roles)
            return f"it is {'an' if what == 'action' else 'a'} {what}: use {options}"
    if name.package == own:
        elsewhere = [
            f"`{package}/{name.name}`"
            for package in library.packages()
            if ir.TypeName(package, name.kind, name.name) in library.interfaces(package)
        ]
        if elsewhere:
            return f"did you mean {' or '.join(elsewhere)}?"
    known = [str(one) for one in library.interfaces(name.package) if one.kind == name.kind]
    hint = did_you_mean(str(name), known)
    if name.package == own:
        return hint or f"write it with `idlc scaffold interface {name.kind} {name.name} FIELD...`"
    if hint or name.package in library.packages():
        return hint
    near = did_you_mean(name.package, library.packages())
    return near or f"there is no package `{name.package}` here: name its folder with -I"


def _support(project: Project, own: str) -> dict[str, str]:
    """Return the files that nodes need beside them and that their package lacks."""
    plain = package_files.Package(own, "", "", "", "Apache-2.0")
    found = {}
    if not project.has("test/conftest.py"):
        template = "package/conftest.py.jinja"
        found["test/conftest.py"] = package_files.rendered(template, plain)
    if not project.has(f"{own}/__init__.py"):
        found[f"{own}/__init__.py"] = ""
    return found


def _edits(project: Project, planned: Plan) -> dict[str, Outcome]:
    """Return the edits of the files that describe the package."""
    own, name = planned.node.package, planned.node.name
    script = Script(name, f"{own}.{name}:main")
    tests = ["python3-pytest", *(["lifecycle_msgs"] if planned.node.lifecycle else [])]
    tests += ["rcl_interfaces"] if planned.node.parameters else []
    edits = [console_script.add_script(_descriptions(project), script)]
    return dict([*edits, *manifest_edit(project, planned.packages, tests, group=False)])


def _descriptions(project: Project) -> dict[str, str]:
    """Return the texts of the files by which Python installs the package."""
    names = ("pyproject.toml", "setup.cfg", "setup.py")
    found = {name: text for name in names if (text := project.text(name)) is not None}
    if "setup.py" in found and any(map(project.names, ir.KINDS)):
        found["setup.py"] = data_files.add_libraries(found["setup.py"])
    return found


def _launched(
    project: Project, planned: Plan, added: dict[str, str], edits: dict[str, Outcome]
) -> list[str]:
    """Enter the node in the launch file, which may be new; return what is left to do by hand.

    A node that does one thing and ends is for the command line.
    """
    if planned.once:
        return []
    own, name = planned.node.package, planned.node.name
    started = launch_py.Started(own, name, planned.node.lifecycle)
    launch = _launch_file(project, own)
    text = project.text(launch)
    if text is not None:
        outcome = launch_py.add_node(text, started)
        if isinstance(outcome, Edited):
            edits[launch] = outcome
            return []
        where = f"`{project.shown(launch)}` is not edited: {outcome.why}"
        return [f"{where}; add this {outcome.where}: {outcome.line.rstrip(',')}"]
    plain = package_files.Package(own, "", "", "", "Apache-2.0")
    made = launch_py.add_node(package_files.rendered("package/launch.py.jinja", plain), started)
    assert isinstance(made, Edited)
    added[launch] = made.text
    setup = project.text("setup.py")
    before = edits.get("setup.py") or Edited(setup or "")
    if setup is not None and isinstance(before, Edited):
        edits["setup.py"] = data_files.add_launch(before.text, own, launch)
    return []


def _absent(planned: Plan) -> list[str]:
    """Return what to install, where there is ROS 2 but not all that the node imports."""
    absent = [name for name in planned.packages if not python_folders(name)]
    if not absent or not python_folders("rclpy"):
        return []
    names = ", ".join(f"`{name}`" for name in absent)
    wheels = " ".join(f"ros-jazzy-{name.replace('_', '-')}" for name in absent)
    return [f"{names} cannot be imported here: install it with ROS 2, or `pip install {wheels}`"]


def _launch_file(project: Project, own: str) -> str:
    """Return the launch file that lists the package's nodes."""
    found = [name for name in project.names("launch") if name.endswith("launch.py")]
    preferred = [f"{own}_launch.py", f"{own}.launch.py"]
    for name in (*preferred, *(found if len(found) == 1 else ())):
        if name in found:
            return f"launch/{name}"
    return f"launch/{preferred[0]}"
