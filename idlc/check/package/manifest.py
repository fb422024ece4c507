"""Rules on package.xml: it declares the dependencies of a package's interfaces and nodes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Label
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import closest_package
from idlc.model import catalog, ir
from idlc.model.link import Model, own_fields
from idlc.project.package_xml import Facts, addition
from idlc.version import RUNTIME

_NEEDED = ("depend", "build_depend", "build_export_depend", "exec_depend")
#: Packages that rosidl adds by itself.
_IMPLICIT = frozenset({"service_msgs", "action_msgs", "unique_identifier_msgs"})
_GROUP = "rosidl_interface_packages"
#: The packages that generate interfaces, and those that generated code needs, usual first.
_GENERATORS = ("rosidl_default_generators", "rosidl_core_generators")
_RUNTIME = ("rosidl_default_runtime", "rosidl_core_runtime", *_GENERATORS)


def declared_dependencies(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """Packages whose messages are used are declared."""
    seen = _may_use(facts)
    existing = _packages_with_interfaces(model) | facts.available
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
            hint = f"write `{line}` in place of `{misspelt}`, which is not known here"
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


def _may_use(facts: Facts) -> set[str]:
    """Return the packages whose messages a package may use: itself and its dependencies."""
    # interfaces that CMake does not install are for the package's own tests
    declared = facts.declared(*_NEEDED, *(() if facts.generates else ("test_depend",)))
    return {facts.name, *declared}


def dependency(facts: Facts, package: str) -> Edit | None:
    """Return the edit that declares a package; `None` if it is declared, or cannot be."""
    if package in _may_use(facts):
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
    used = {name.package for name in model.interfaces} | _IMPLICIT
    for package, statement in facts.declared("depend", "build_depend").items():
        if package not in used and catalog.is_standard(package) and not _has_gaps(model):
            message = f"no interface of this package uses `{package}`"
            yield codes.UNUSED_DEPENDENCY.at(statement.span, message, hint="remove the line")


def _has_gaps(model: Model) -> bool:
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
        message = "CMake stops at a package with interfaces that is in no interface group"
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
            (_RUNTIME, "exec_depend", ("exec_depend", "depend")),
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
    """What the nodes and the generated classes import is declared."""
    files = (facts.setup_py, facts.setup_cfg, facts.pyproject, facts.manifest)
    if facts.runtime == "installed" and not names_runtime(file.text for file in files if file):
        place = facts.setup_py or facts.pyproject or facts.manifest
        setting = "install_requires" if place is facts.setup_py else "dependencies"
        message = f"the classes import `idlc_runtime`, which `{place.path}` does not require"
        hint = f"add `{RUNTIME}` to `{setting}`"
        yield codes.UNDECLARED_IMPORT.at(Span(place, 0, 0), message, hint=hint)
    if not facts.modules:
        return
    from idlc.check.package.setup_py import imported_modules, span_of

    declared = {facts.name, *facts.declared(*_NEEDED, "test_depend")}
    used = used_packages(model)
    for source in facts.modules.values():
        for module, node in imported_modules(source):
            package = module.partition(".")[0]
            if package in facts.available and package not in declared:
                declared.add(package)
                tag = "depend" if package in used else "exec_depend"
                message = f"`{facts.manifest.path}` does not declare `{package}`"
                hint = f"add `<{tag}>{package}</{tag}>`"
                edits = _additions(facts, (tag, package))
                span = span_of(source, node)
                yield codes.UNDECLARED_IMPORT.at(span, message, hint=hint, edits=edits)


def _additions(facts: Facts, *elements: tuple[str, str]) -> tuple[Edit, ...]:
    """Return the edits that add elements to package.xml, each after similar ones."""
    edits = (addition(facts.manifest, facts.statements, tag, text) for tag, text in elements)
    return tuple(edit for added in edits for edit in added)


_COMMAND = re.compile(r'\b([A-Za-z_]\w*)[ \t]*\(([^()"]*(?:"[^"]*"[^()"]*)*)\)')
#: The command that generates interfaces.
GENERATE = "rosidl_generate_interfaces"
_KEYWORD = "DEPENDENCIES"
_OPTIONS = {"ADD_LINTER_TESTS", "LIBRARY_NAME", "SKIP_GROUP_MEMBERSHIP_CHECK", "SKIP_INSTALL"}
_VARIABLE = re.compile(r"\$\{(\w+)\}")


class Call(NamedTuple):
    """A command, its words and the range of each."""

    name: str
    words: tuple[str, ...]
    places: tuple[Span, ...]
    span: Span


def calls(source: Source) -> Iterator[Call]:
    """Yield the commands of a CMakeLists.txt, except nested ones."""
    code = re.sub(r"#[^\r\n]*", lambda comment: " " * len(comment[0]), source.text)
    for command in _COMMAND.finditer(code):
        places = [
            Span(source, command.start(2) + word.start(), command.start(2) + word.end())
            for word in re.finditer(r"[^\s;]+", command[2])
        ]
        words = tuple(place.text.strip('"') for place in places)
        yield Call(command[1].lower(), words, tuple(places), Span(source, *command.span()))


def listed_dependencies(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """CMakeLists.txt names each package whose messages are used; without it, rosidl stops."""
    if facts.cmake is None or not (facts.generates and model.own):
        return
    commands = list(calls(facts.cmake))
    generating = [command for command in commands if command.name == GENERATE]
    if len(generating) != 1:
        return
    (call,) = generating
    sets = [command for command in commands if command.name == "set" and command.words]
    lists = {command.words[0]: command for command in sets}
    grown = {command.words[1:2] for command in commands if command.name == "list"}
    count = len(call.words)
    first = call.words.index(_KEYWORD) + 1 if _KEYWORD in call.words else count
    end = next((at for at in range(first, count) if call.words[at] in _OPTIONS), count)
    words = call.words[first:end]
    named = [variable[1] for word in words if (variable := _VARIABLE.fullmatch(word))]
    seen = {word for word in words if word.isidentifier()}
    for name in named:
        if name not in lists or (name,) in grown:
            return  # computed
        seen |= {*lists[name].words[1:]}
    if any("$" in word for word in seen) or len(seen) < len(words) - len(named):
        return
    target = lists[named[0]] if named else call._replace(places=call.places[:end])
    where = f"to `set({named[0]} ...)`" if named else "to its `DEPENDENCIES`"
    for package, span in used_packages(model).items():
        if package not in seen and package != facts.name:
            yield codes.MISSING_CMAKE_DEPENDENCY.at(
                span,
                f"`{facts.cmake.path}` does not give `{package}` to `{GENERATE}`",
                hint=f"add `{package}` {where}, and `find_package({package} REQUIRED)`",
                edits=(
                    dependency_edit(target, package, listed=bool(words)),
                    *_find_package_edits(commands, package),
                ),
            )


def dependency_edit(target: Call, package: str, *, listed: bool) -> Edit:
    """Return the edit that adds a package to a list, in the layout of its last word.

    A command without such a list gets the keyword as well, unless it is `set()`.
    """
    last = target.places[-1]
    text = last.source.text
    margin = re.search(r"(?:\r\n?|\n)[ \t]*\Z", text[: last.start])
    if len(target.places) == 1 and target.name == "set":
        margin = re.match(r"[ \t]*((?:\r\n?|\n))", text[last.end :])
        return _insert(last, f"{margin[1]}  {package}" if margin else f" {package}")
    between = margin[0] if margin else " "
    return _insert(last, f"{between}{package}" if listed else f"{between}{_KEYWORD} {package}")


def _find_package_edits(commands: list[Call], package: str) -> tuple[Edit, ...]:
    """Return the edit that finds a package, unless a loop or a command does so."""
    finding = [command for command in commands if command.name == "find_package" and command.words]
    names = {command.words[0] for command in finding}
    if not names or package in names or "$" in "".join(names):
        return ()
    last = finding[-1].span
    text = last.source.text
    line_end = "\r\n" if "\r\n" in text else "\n"
    indent = text[text.rfind("\n", 0, last.start) + 1 : last.start]
    indent = "" if indent.strip() else indent
    return (_insert(last, f"{line_end}{indent}find_package({package} REQUIRED)"),)


def _insert(after: Span, text: str) -> Edit:
    return Edit(Span(after.source, after.end, after.end), text)
