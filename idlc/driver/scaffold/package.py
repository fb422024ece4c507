"""The pipeline of `idlc scaffold package`."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterator, Mapping
from xml.sax.saxutils import escape, quoteattr

from idlc.checks.package.package_xml import statements
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source
from idlc.disk.output.project import Project
from idlc.disk.scope import scope
from idlc.disk.settings import pyproject
from idlc.driver.scaffold.changes import Result, Settings, rendering, templates, write
from idlc.model import catalog, ir
from idlc.scaffold import new_package

#: Where the choices of a package are: in elements of package.xml, and arguments of setup().
_TAGS = {
    **{field: field for field in ("description", "maintainer", "license", "build_type")},
    "email": "maintainer",
}
_ARGUMENTS = {
    **{field: field for field in ("description", "maintainer", "license")},
    "email": "maintainer_email",
}


def package(
    wanted: new_package.Package,
    folder: str,
    settings: Settings,
    report: Report,
    starters: Mapping[str, str] | None = None,
    given: Collection[str] = (),
) -> Result | None:
    """Write a new package below `folder`, with interfaces if it has none yet.

    `given` are the fields of `wanted`, and `starters`, that the user chose. Reports IDL620 where
    files that stay as they are say otherwise.
    """
    name = wanted.name if folder in ("", ".") else f"{folder}/{wanted.name}"
    project = Project(name, report, force=settings.force)
    used = templates(settings, report)
    if report.had_errors:
        return None
    files: dict[str, str] = {}
    with rendering(wanted.name, report):
        there = catalog.packages(scope(pyproject.load(report)).distro)
        depends = tuple(name for name in wanted.depends if name in there)  # Humble lacks one
        files = new_package.files(wanted._replace(depends=depends), used)
    if not any(project.names(kind) for kind in ir.KINDS):
        files |= starters or {}
    elif "starters" in given:
        report.extend(_absent(project, starters or {}))
    # what later commands add to stays as it is
    growing = (*new_package.GROWING, f"launch/{wanted.name}_launch.py")
    new = {
        path: text
        for path, text in files.items()
        if path not in growing or settings.force or not project.has(path)
    }
    for path, look in (("package.xml", _other_manifest), ("setup.py", _other_setup)):
        text = project.text(path) if path in files and path not in new else None
        if text is not None:
            report.extend(look(Source(project.shown(path), text), wanted, {*given, "build_type"}))
    return write(project, new, {}, settings, report)


def _absent(project: Project, starters: Mapping[str, str]) -> Iterator[Diagnostic]:
    """Yield a problem for each interface that the package, which has others, lacks."""
    for path in starters:
        if not project.has(path):
            kind, name = path.rpartition(".")[0].split("/")
            yield codes.EXISTING_FILE.of(
                project.shown(path),
                f"`{project.name}` has interfaces already, and `{path}` is not one of them",
                hint=f"run `cd {shlex.quote(project.name)}`, then "
                f"`idlc scaffold interface {kind} {name}`",
            )


def _other_manifest(
    source: Source, wanted: new_package.Package, given: Collection[str]
) -> Iterator[Diagnostic]:
    """Yield where a package.xml says other than what was given."""
    known = statements(source)
    for field, tag in _TAGS.items():
        lines = [one for one in known if one.tag == tag]
        values = [
            one.attributes.get("email", "") if field == "email" else one.text for one in lines
        ]
        values = [" ".join(text.split()) for text in values]
        said = getattr(wanted, field)
        if field in given and lines and said not in values:
            line = f"<{tag}>{escape(said)}</{tag}>"
            if tag == "maintainer":
                name = wanted.maintainer if "maintainer" in given else lines[0].text
                email = wanted.email if "email" in given else lines[0].attributes.get("email", "")
                line = f"<maintainer email={quoteattr(email)}>{escape(name)}</maintainer>"
            yield codes.EXISTING_FILE.at(
                lines[0].span,
                f"the {field.replace('_', ' ')} is `{values[0]}` here, not `{said}`; "
                "the file was not changed",
                hint=f"write `{line}`" if field != "build_type" else "choose another name",
            )


def _other_setup(
    source: Source, wanted: new_package.Package, given: Collection[str]
) -> Iterator[Diagnostic]:
    """Yield where a setup.py says other than what was given."""
    from idlc.checks.package.python_files import span_of
    from idlc.checks.package.setup_py import Setup

    setup = Setup(source)
    for field, argument in _ARGUMENTS.items():
        node, said = setup.arguments.get(argument), getattr(wanted, field)
        text = setup.text(node)
        if node is not None and field in given and text not in (None, said):
            yield codes.EXISTING_FILE.at(
                span_of(source, node),
                f"the {field} is `{text}` here, not `{said}`; the file was not changed",
                hint=f"write `{argument}={said!r}`",
            )
