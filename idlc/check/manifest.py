"""Rules on package.xml: it declares the dependencies of a package's interfaces and nodes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Label
from idlc.diagnostics.source import Span
from idlc.diagnostics.text import closest_package
from idlc.model import catalog, ir
from idlc.model.link import Model, own_fields
from idlc.packaging.dependencies import LIBRARIES, addition
from idlc.packaging.facts import Facts
from idlc.version import RUNTIME

_NEEDED = ("depend", "build_depend", "build_export_depend", "exec_depend")
#: What rosdep adds to the name of a distribution of pip or Debian.
_PIP = re.compile(r"^python3?-|-pip$")
#: Folders and files of code that a node does not run.
_ASIDE = frozenset("conftest example examples launch sample samples setup test tests".split())
#: Packages that rosidl adds by itself.
IMPLICIT = frozenset({"service_msgs", "action_msgs", "unique_identifier_msgs"})
_GROUP = "rosidl_interface_packages"
#: The packages that generate interfaces, and those that generated code needs, usual first.
_GENERATORS = ("rosidl_default_generators", "rosidl_core_generators")
RUNTIME_PACKAGES = ("rosidl_default_runtime", "rosidl_core_runtime", *_GENERATORS)


def declared_dependencies(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """Packages whose messages are used are declared."""
    seen = may_use(facts)
    existing = _packages_with_interfaces(model) | facts.available | {*LIBRARIES.values()}
    declared = facts.declared(*_NEEDED)
    unknown = [name for name in declared if name not in existing]
    for package, span in used_packages(model).items():
        if package in seen:
            continue
        labels: tuple[Label, ...] = ()
        hint, edits = f"add `<depend>{package}</depend>`", _additions(facts, ("depend", package))
        misspelt = next((name for name in unknown if closest_package(name, [package])), None)
        if misspelt:
            tag = declared[misspelt].tag
            line = f"<{tag}>{package}</{tag}>"
            hint = f"write `{line}` instead of `{misspelt}`, which idlc cannot find"
            labels, edits = (Label(declared[misspelt].span, "misspelt?"),), ()
        message = f"`{facts.manifest.path}` does not declare `{package}`"
        yield codes.MISSING_DEPENDENCY.at(span, message, hint=hint, labels=labels, edits=edits)


def used_packages(model: Model) -> dict[str, Span]:
    """Return the packages whose messages are used, with the range of each one's first use."""
    packages = _packages_with_interfaces(model)
    spans: dict[str, Span] = {}
    for field, target in model.references():
        if field.type_span is not None and target.package in packages:
            spans.setdefault(target.package, field.type_span)
    return spans


def _packages_with_interfaces(model: Model) -> set[str]:
    """Return the packages with interfaces."""
    return {name.package for name in model.interfaces} | {*catalog.packages(model.distro)}


def may_use(facts: Facts) -> set[str]:
    """Return the packages whose messages a package may use: itself and its dependencies."""
    # interfaces that CMake does not install are for the package's own tests
    declared = facts.declared(*_NEEDED, *(() if facts.generates else ("test_depend",)))
    return {facts.name, *declared}


def dependency(facts: Facts, package: str) -> Edit | None:
    """Return the edit that declares a package; `None` if it is declared, or cannot be."""
    if package in may_use(facts):
        return None
    edits = _additions(facts, ("depend", package))
    return Edit(edits[0].span, "".join(edit.text for edit in edits)) if edits else None


def declaration(facts: Facts, package: str) -> Span | None:
    """Return the range of a package's declaration, `None` without one."""
    statement = facts.declared(*_NEEDED, "test_depend").get(package)
    return statement.span if statement else None


def used_dependencies(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """A package of interfaces alone declares no interfaces that it does not use."""
    if facts.modules or facts.native or not facts.whole:
        return
    used = {name.package for name in model.interfaces} | IMPLICIT
    for package, statement in facts.declared("depend", "build_depend").items():
        if package not in used and catalog.is_standard(package) and not has_gaps(model):
            message = f"no interface in this package uses `{package}`"
            yield codes.UNUSED_DEPENDENCY.at(statement.span, message, hint="remove the line")


def has_gaps(model: Model) -> bool:
    """Return whether some field has an unknown type, which may be of any package."""
    elements = [ir.element_of(field.type) for field in own_fields(model)]
    return any(
        element.target not in model.interfaces
        if isinstance(element, ir.Ref)
        else isinstance(element, ir.Unknown)
        for element in elements
    )


def interface_group(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """A package whose interfaces CMake generates is a member of the group of such packages."""
    if facts.generates and model.own and _GROUP not in facts.declared("member_of_group"):
        message = "CMake requires `rosidl_interface_packages` for a package with interfaces"
        hint = f"add `<member_of_group>{_GROUP}</member_of_group>`"
        edits = _additions(facts, ("member_of_group", _GROUP))
        yield codes.NOT_IN_INTERFACE_GROUP.at(facts.place, message, hint=hint, edits=edits)


def generators(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """A package whose interfaces CMake generates declares the generators and their runtime."""
    if not (facts.generates and model.own):
        return
    missing = [
        (tag, packages[0])
        for packages, tag, others in (
            (_GENERATORS, "buildtool_depend", ("buildtool_depend", "build_depend", "depend")),
            (RUNTIME_PACKAGES, "exec_depend", ("exec_depend", "depend")),
        )
        if facts.declared(*others).keys().isdisjoint(packages)
    ]
    if missing:
        needed = " and ".join(f"`{package}`" for _, package in missing)
        message = f"a package with interfaces needs {needed}"
        edits = _additions(facts, *missing)
        hint = "add " + " and ".join(f"`<{tag}>{name}</{tag}>`" for tag, name in missing)
        yield codes.NO_INTERFACE_GENERATORS.at(facts.place, message, hint=hint, edits=edits)


def names_runtime(texts: Iterable[str]) -> bool:
    """Return whether one of some texts, such as requirements, names the distribution."""
    return any(map(re.compile(r"\bidlc[-_.]runtime\b", re.IGNORECASE).search, texts))


def declared_imports(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """Report imports of nodes and generated classes that package.xml does not declare."""
    files = (facts.setup_py, facts.setup_cfg, facts.pyproject, facts.manifest)
    if facts.runtime == "installed" and not names_runtime(file.text for file in files if file):
        place = facts.setup_py or facts.pyproject or facts.manifest
        setting = "install_requires" if place is facts.setup_py else "dependencies"
        message = f"the classes import `idlc_runtime`, but `{place.path}` does not require it"
        hint = f"add `{RUNTIME}` to `{setting}`"
        yield codes.UNDECLARED_IMPORT.at(Span(place, 0, 0), message, hint=hint)
    if not facts.modules:
        return
    from idlc.packaging.setup_py import imported_modules, span_of

    declared = {facts.name, *facts.declared(*_NEEDED, "test_depend")}
    by_pip = {_PIP.sub("", name).replace("-", "_") for name in declared}
    used = used_packages(model)
    for name, source in facts.modules.items():
        if _is_test(name, facts.name):
            continue
        for module, node in imported_modules(source):
            top = module.partition(".")[0]
            provided_by_pip = {top, f"py{top}"} & by_pip
            packages = facts.providers.get(top, frozenset())
            if top in facts.contained or provided_by_pip or packages & declared:
                continue
            if len(packages) != 1:  # it is of no ROS package, or of one that idlc would guess
                continue
            (package,) = packages
            declared.add(package)
            tag = "depend" if package in used else "exec_depend"
            message = f"`{facts.manifest.path}` does not declare `{package}`"
            message += f", which provides `{top}`" if package != top else ""
            hint = f"add `<{tag}>{package}</{tag}>`"
            edits = _additions(facts, (tag, package))
            if package in facts.dependents:
                hint = f"`{package}` depends on `{facts.name}`: move shared code to a third package"
                edits = ()
            yield codes.UNDECLARED_IMPORT.at(span_of(source, node), message, hint=hint, edits=edits)


def _is_test(module: str, package: str) -> bool:
    """Return whether a module is a test, an example or a launch file by its dotted name."""
    first, *others = module.split(".")
    parts = others if first == package else [first, *others]
    return any(
        part in _ASIDE or part.startswith("test_") or part.endswith(("_test", "_tests", "_launch"))
        for part in parts
    )


def _additions(facts: Facts, *elements: tuple[str, str]) -> tuple[Edit, ...]:
    """Return the edits that add elements to package.xml, each after similar ones."""
    edits = (addition(facts.manifest, facts.statements, tag, text) for tag, text in elements)
    return tuple(edit for added in edits for edit in added)
