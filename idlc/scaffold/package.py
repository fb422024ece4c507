"""The pipeline of `idlc scaffold package`."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterator, Mapping
from os.path import relpath
from pathlib import Path
from typing import NamedTuple, TypeAlias
from xml.sax.saxutils import escape, quoteattr

from idlc.compiler.compiler import stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source, Span
from idlc.generate.target import build_step
from idlc.generate.templates import Code, EscapedText, code
from idlc.model import catalog, ir
from idlc.model.names import why_not_package
from idlc.packaging.files import PACKAGE_FILES, SETUP_PY
from idlc.packaging.setup_py import Setup, span_of
from idlc.project.files import is_file
from idlc.project.lock import BUILD_STEP
from idlc.project.lock import FILE as LOCK
from idlc.project.package_xml import statements
from idlc.project.root import MANIFEST
from idlc.project.settings import SETTINGS_FILE, load_settings, scope
from idlc.scaffold.changes import Project, ScaffoldOptions, ScaffoldResult

VERSION = "0.1.0"
LICENSES = ("Apache-2.0", "BSD-3-Clause", "MIT")
_TEXTS = Path(__file__).parent / "licenses"

PYTHON = "ament_python"
CMAKE = "ament_cmake"
#: Packages of ROS 2 that interfaces need: events of services, goals and states of actions.
IMPLIED = ("action_msgs", "service_msgs", "unique_identifier_msgs")


class Package(NamedTuple):
    """A new package. `depends` are the packages that one of interfaces only depends on."""

    name: str
    description: str
    maintainer: str
    email: str
    license: str
    build_type: str = PYTHON
    depends: tuple[str, ...] = IMPLIED


class PackageView(NamedTuple):
    """The content of the templates of a package, with words of others as each place needs them."""

    name: Code
    version: Code
    license: Code
    build_type: Code
    description: EscapedText
    xml_description: EscapedText
    xml_maintainer: EscapedText
    xml_email: EscapedText
    py_description: Code
    py_maintainer: Code
    py_email: Code
    depends: tuple[Code, ...]

    @property
    def is_python(self) -> bool:
        """True if the package has nodes."""
        return self.build_type == PYTHON


#: Templates whose names differ from those of their files.
_TEMPLATES = {
    (PYTHON, "launch/NAME_launch.py"): "launch.py",
    (CMAKE, SETTINGS_FILE): "interfaces_pyproject.toml",
}
#: Files of a package of nodes, and of one of interfaces; NAME stands for the package.
_PYTHON_FILES = (
    *("package.xml", "setup.py", "setup.cfg", "pyproject.toml", "launch/NAME_launch.py"),
    *("test/test_style.py", "README.md", ".gitattributes", ".gitignore"),
)
_CMAKE_FILES = ("package.xml", "CMakeLists.txt", "pyproject.toml", "README.md", ".gitignore")
#: Files of a new package that are edited later on.
GROWING = (
    *PACKAGE_FILES,
    *("README.md", ".gitattributes", ".gitignore"),
)
#: Modules and folders that a package of such a name would hide.
_TAKEN = frozenset(
    "action idlc launch launch_ros msg pytest rclpy resource setuptools srv test".split()
)


def check_package_name(name: str) -> str:
    """Return the name of a new package; one that hides another module is refused."""
    why = why_not_package(name)
    if not why and name in _TAKEN:
        why = "is the name of a folder or module that the package needs"
    if why:
        raise ValueError(f"`{name}` {why}")
    return name


def package_files(package: Package) -> dict[str, str]:
    """Return the texts of a new package's files by their paths in its folder."""
    listed = _CMAKE_FILES if package.build_type == CMAKE else _PYTHON_FILES
    files = {}
    for path in listed:
        template = _TEMPLATES.get((package.build_type, path), path.rpartition("/")[2].lstrip("."))
        text = rendered(f"package/{template}.jinja", package)
        files[path.replace("NAME", package.name)] = text
    text = (_TEXTS / f"{package.license}.txt").read_text(encoding="utf-8")
    files["LICENSE"] = text.replace("(c) HOLDER", f"(c) {package.maintainer}")
    if package.build_type == PYTHON:
        files[f"resource/{package.name}"] = ""
        files[f"{package.name}/{BUILD_STEP}"] = build_step().decode()
        files[f"{package.name}/__init__.py"] = f'"""Nodes and interfaces of {package.name}."""\n'
    return files


def rendered(template: str, package: Package) -> str:
    """Return the text of one of a package's files."""
    view = PackageView(
        name=Code(package.name),
        version=Code(VERSION),
        license=Code(package.license),
        build_type=Code(package.build_type),
        description=EscapedText(package.description),
        xml_description=EscapedText(escape(package.description)),
        xml_maintainer=EscapedText(escape(package.maintainer)),
        xml_email=EscapedText(quoteattr(package.email)[1:-1].replace('"', "&quot;")),
        py_description=Code(repr(package.description)),
        py_maintainer=Code(repr(package.maintainer)),
        py_email=Code(repr(package.email)),
        depends=tuple(map(Code, package.depends)),
    )
    return code().get_template(template).render(package=view)


def rendered_for(name: str, template: str) -> str:
    """Return the text of a file of which only the package's name matters."""
    return rendered(template, Package(name, "", "", "", LICENSES[0]))


#: The choices that package.xml and setup.py repeat.
_CHOICES = ("description", "maintainer", "license", "email")
#: A field of a package, the range that sets it, the values there, and the code that would do.
_Choice: TypeAlias = tuple[str, Span, list[str], str]


def package(
    requested: Package,
    settings: ScaffoldOptions,
    report: Report,
    starters: Mapping[str, str] | None = None,
    chosen: Collection[str] = (),
) -> ScaffoldResult:
    """Write a new package, with interfaces if it has none yet, but not among generated code.

    Raises ReportedError.

    `chosen` are the fields of `requested`, and `starters`, that the user chose. Reports IDL620
    where files that stay as they are contradict them.
    """
    base = settings.root.base
    generated = next((folder for folder in (base, *base.parents) if is_file(folder / LOCK)), None)
    if generated is not None:
        hint = f"change to a folder of sources: `cd {shlex.quote(relpath(generated.parent, base))}`"
        message = f"`{generated}` contains generated code"
        report.add(codes.FOREIGN_FILE.of(requested.name, message, hint=hint))
        report.raise_errors()
    project = Project(requested.name, settings, report)
    with stage("scaffold", requested.name):
        available = catalog.packages(scope(load_settings(settings.root, report)).distro)
        depends = tuple(name for name in requested.depends if name in available)  # Humble lacks one
        files = package_files(requested._replace(depends=depends))
    if not any(project.names(kind) for kind in ir.KINDS):
        files |= starters or {}
    elif "starters" in chosen:
        report.extend(_absent(project, starters or {}))
    # files that later commands add to stay as they are
    growing = () if settings.force else (*GROWING, f"launch/{requested.name}_launch.py")
    kept = [path for path in growing if project.has(path)]
    new = {path: text for path, text in files.items() if path not in kept}
    kept_files = files.keys() & {*kept}
    report.extend(_contradictions(project, requested, kept_files, {*chosen, "build_type"}))
    return project.write(new)


def _contradictions(
    project: Project, requested: Package, kept: Collection[str], chosen: Collection[str]
) -> Iterator[Diagnostic]:
    """Yield a problem for each choice that one of the kept files contradicts."""
    for path, choices in ((MANIFEST, _in_manifest), (SETUP_PY, _in_setup)):
        text = project.text(path) if path in kept else None
        if not text:
            continue
        for field, span, values, line in choices(
            Source(project.shown(path), text), requested, chosen
        ):
            value = getattr(requested, field)
            if field in chosen and value not in values:
                shown = f"the {field.replace('_', ' ')} is `{values[0]}` here, not `{value}`"
                hint = "choose another name" if field == "build_type" else f"write `{line}`"
                message = f"{shown}; the file was not changed"
                yield codes.EXISTING_FILE.at(span, message, hint=hint)


def _absent(project: Project, starters: Mapping[str, str]) -> Iterator[Diagnostic]:
    """Yield a problem for each interface that the package, which has others, lacks."""
    for path in starters:
        if not project.has(path):
            kind, name = path.rpartition(".")[0].split("/")
            yield codes.EXISTING_FILE.of(
                project.shown(path),
                f"`{project.name}` already has interfaces, but not `{path}`",
                hint=f"run `cd {shlex.quote(project.name)}`, then "
                f"`idlc scaffold interface {kind} {name}`",
            )


def _in_manifest(source: Source, requested: Package, chosen: Collection[str]) -> Iterator[_Choice]:
    """Yield what a package.xml says of each choice, and the element to write in its place."""
    declared = statements(source)
    for field in (*_CHOICES, "build_type"):
        tag = "maintainer" if field == "email" else field
        lines = [statement for statement in declared if statement.tag == tag]
        if not lines:
            continue
        emails = [line.attributes.get("email", "") for line in lines]
        texts = emails if field == "email" else [line.text for line in lines]
        new = f"<{tag}>{escape(getattr(requested, field))}</{tag}>"
        if tag == "maintainer":
            name = requested.maintainer if "maintainer" in chosen else lines[0].text
            email = requested.email if "email" in chosen else emails[0]
            new = f"<maintainer email={quoteattr(email)}>{escape(name)}</maintainer>"
        yield field, lines[0].span, [" ".join(text.split()) for text in texts], new


def _in_setup(source: Source, requested: Package, _: Collection[str]) -> Iterator[_Choice]:
    """Yield what a setup.py says of each choice, and the argument to write in its place."""
    setup = Setup(source)
    for field in _CHOICES:
        argument = "maintainer_email" if field == "email" else field
        node = setup.arguments.get(argument)
        text = setup.text(node)
        if node is not None and text is not None:
            new = f"{argument}={getattr(requested, field)!r}"
            yield field, span_of(source, node), [text], new
