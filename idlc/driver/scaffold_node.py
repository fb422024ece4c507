"""The pipeline of `idlc scaffold node`."""

from __future__ import annotations

from idlc.disk.library import Library
from idlc.disk.project import Project
from idlc.driver.scaffold import (
    Result,
    Settings,
    accepted,
    find_package,
    manifest_edit,
    write,
)
from idlc.driver.stages import compile_package, stage
from idlc.model import ir
from idlc.scaffold import console_script, data_files, launch_py, node_test, spec
from idlc.scaffold import node as node_page
from idlc.scaffold import package as package_files
from idlc.scaffold.edit import Edited, Outcome, Script
from idlc.scaffold.plan import Plan, plan
from idlc.text import codes
from idlc.text.diagnostics import Report
from idlc.text.suggest import did_you_mean


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
            f"test/test_{wanted.name}.py": node_test.render(planned),
        }
        for path, text in added.items():
            compile(text, path, "exec", dont_inherit=True)
        added |= _support(project, own)
        edits = _edits(project, planned, added)
    edited = accepted(project, edits, report)
    if edited is None:
        return None
    return write(project, added, edited, settings, report)


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
    if not project.has("test/conftest.py"):
        template = "scaffold_conftest.py.jinja"
        found["test/conftest.py"] = package_files.rendered(template, plain)
    if not project.has(f"{own}/__init__.py"):
        found[f"{own}/__init__.py"] = ""
    return found


def _edits(project: Project, planned: Plan, added: dict[str, str]) -> list[tuple[str, Outcome]]:
    """Return the edits of the package's own files; new launch files go to `added`."""
    own, name = planned.node.package, planned.node.name
    texts = {
        path: text
        for path in ("pyproject.toml", "setup.cfg", "setup.py")
        if (text := project.text(path)) is not None
    }
    edits = [console_script.add_script(texts, Script(name, f"{own}.{name}:main"))]
    tests = ["python3-pytest", *(["lifecycle_msgs"] if planned.node.lifecycle else [])]
    tests += ["rcl_interfaces"] if planned.node.parameters else []
    edits += manifest_edit(project, planned.packages, tests, group=False)
    launch = _launch_file(project, own)
    text = project.text(launch)
    if text is None:
        plain = package_files.Package(own, "", "", "", "Apache-2.0")
        made = launch_py.add_node(
            package_files.rendered("scaffold_launch.py.jinja", plain), own, name
        )
        assert isinstance(made, Edited)
        added[launch] = made.text
        edits = _with_data_files(edits, texts, own, launch)
    else:
        edits.append((launch, launch_py.add_node(text, own, name)))
    return edits


def _with_data_files(
    edits: list[tuple[str, Outcome]], texts: dict[str, str], own: str, launch: str
) -> list[tuple[str, Outcome]]:
    """Return the edits with one more, or a fuller one, so that setup.py installs a launch file."""
    before = dict(edits).get("setup.py") or Edited(texts.get("setup.py", ""))
    if "setup.py" not in texts or not isinstance(before, Edited):
        return edits
    others = [one for one in edits if one[0] != "setup.py"]
    return [*others, ("setup.py", data_files.add_launch(before.text, own, launch))]


def _launch_file(project: Project, own: str) -> str:
    """Return the launch file that lists the package's nodes."""
    found = [name for name in project.names("launch") if name.endswith("launch.py")]
    preferred = [f"{own}_launch.py", f"{own}.launch.py"]
    for name in (*preferred, *(found if len(found) == 1 else ())):
        if name in found:
            return f"launch/{name}"
    return f"launch/{preferred[0]}"
