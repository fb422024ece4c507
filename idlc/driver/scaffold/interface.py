"""The pipeline of `idlc scaffold interface`."""

from __future__ import annotations

from collections.abc import Sequence

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
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
from idlc.driver.stages import compile_package
from idlc.model import ir
from idlc.model.link import Model
from idlc.scaffold import new_interface, new_package
from idlc.scaffold.edits import enter_interface
from idlc.scaffold.edits.enter_interface import CMAKE, MANIFEST, SETUP
from idlc.scaffold.templates import Templates


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
    text = new_interface.text(kind, fields, comment)
    used = templates(settings, report)
    model = _model(project, ir.TypeName(own, kind, name), path, text, settings, report)
    if report.had_errors:
        return None
    added = {path: text}
    with rendering(name, report):
        added |= _test_of_interfaces(project, own, used)
    read = {one: project.text(one) for one in (CMAKE, MANIFEST, SETUP)}
    texts = {one: text for one, text in read.items() if text is not None}
    keys, there = {*keys_of(project), path}, folders(project.path)
    edits = enter_interface.enter(model, texts, keys, there, tested=len(added) > 1)
    edited = accepted(project, edits, report)
    if edited is None:
        return None
    edited |= enter_interface.index(model, texts, keys)
    result = write(project, added, edited, settings, report)
    after = () if CMAKE in texts else generation(project, own, settings)
    return result and result._replace(following=after)


def _model(
    project: Project, name: ir.TypeName, path: str, text: str, settings: Settings, report: Report
) -> Model:
    """Return the model of a package that has a new interface only; report what is wrong with it."""
    library = library_around(name.package, project, settings, report)
    problems = Report()
    source = Source(project.shown(path), text)
    model = compile_package(name.package, [(name, source)], library, problems)
    report.extend(problems)
    return model


def _test_of_interfaces(project: Project, own: str, used: Templates) -> dict[str, str]:
    """Return the test that `colcon test` runs, for a package that says what idlc generates."""
    path = "test/test_interfaces.py"
    if "[tool.idlc]" not in (project.text("pyproject.toml") or "") or project.has(path):
        return {}
    template = "package/test_interfaces.py.jinja"
    return {path: new_package.rendered(template, new_package.plain(own), used)}
