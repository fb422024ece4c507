"""Stubs: the functions that a person completes, and the classes of both versions beside them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.diagnostics.text import one_line
from idlc.generate.python.imports import Surroundings
from idlc.generate.python.literals import string_literal
from idlc.generate.python.render import interface_files
from idlc.generate.templates import Code, EscapedText, RenderedFile, code
from idlc.model import ir, python_names
from idlc.model.link import Model
from idlc.project import write
from idlc.project.root import Root
from idlc.recordings.definitions import interface_of
from idlc.versions.conversion import FieldPlan, Plan, Version, VersionKey, is_list
from idlc.versions.meanings import renumbered
from idlc.versions.rules import TYPES, Rules, read_rules

_AROUND = Surroundings(runtime="....", others="..", enums="none")


class _KeyView(NamedTuple):
    type: Code
    hash: Code


class _PairView(NamedTuple):
    """What a field had in both versions: a unit, or constants."""

    field: Code
    old: Code
    new: Code


class _FunctionView(NamedTuple):
    """A function, and the imports of the classes in its type."""

    name: Code
    type: Code
    reason: EscapedText
    body: Code
    imports: tuple[str, ...] = ()


def write_stubs(plans: Iterable[Plan], folder: str, root: Root, report: Report) -> list[str]:
    """Write a file of rules for each pair of versions that needs some; return their paths.

    A function that is missing from a file is added at its end. Raises ReportedError.
    """
    pairs = {
        (part.old.key, part.new.key): part
        for plan in plans
        for part in plan.walk()
        if any(field.finding.fate == "needs a rule" for field in part.fields)
    }
    files: dict[str, str] = {}
    for (old, new), part in pairs.items():
        name = f"{old.short}_to_{new.short.rpartition('_')[2]}.py".lower()
        existing = Path(root.path(folder)) / name
        text = _grown(existing, part, root, report) if existing.exists() else _file(part)
        if text is not None:
            files[name] = text
    report.raise_errors()
    others = {file.path: file.text for part in pairs.values() for file in _type_files(part)}
    if files:
        others |= {"__init__.py": '"""Rules that upgrade recordings."""\n'}
    every = {path: text.encode() for path, text in {**files, **others}.items()}
    out = Path(root.path(folder)).absolute()
    shown = folder.rstrip("/")
    changes = write.compare(out, shown, every, {}, report)
    kept = [change for change in changes if change.path != "__init__.py" or change.old is None]
    report.raise_errors()
    if not write.apply(write.WritePlan(out, tuple(kept), {}), shown, report):
        raise ReportedError
    return [f"{shown}/{change.path}" for change in kept if change.path in files]


def _grown(file: Path, plan: Plan, root: Root, report: Report) -> str | None:
    """Return the text of a file of rules with those of a plan; `None` if it has other rules."""
    rules, bad = read_rules([file], root, report)
    report.extend(codes.BAD_RULES.at(error.span, str(error)) for error in bad)
    if not rules:
        return None
    if (rules[0].old, rules[0].new) != (plan.old.key, plan.new.key):
        message = f"`{rules[0].path}` has rules for other versions"
        report.add(codes.EXISTING_FILE.of(rules[0].path, message, hint="move it away"))
        return None
    return _completed(rules[0], plan)


def _open(plan: Plan) -> list[FieldPlan]:
    return [field for field in plan.fields if field.finding.fate == "needs a rule"]


def _file(plan: Plan) -> str:
    old, new = plan.old.key, plan.new.key
    functions = [_function(plan, field) for field in _open(plan)]
    lines = {_import(plan.old, plan.old), *(line for each in functions for line in each.imports)}
    units = [_pair_view(name, *pair) for field in _open(plan) for name, pair in _units(field)]
    changes = renumbered(plan.old.message, plan.new.message)
    constants = [
        _pair_view(field.new.name, change.old, change.new)
        for field in _open(plan)
        if (change := changes.get(field.new.name))
    ]
    view = {
        "title": EscapedText(f"Rules from {old.short} to {new.short} of {new.type}."),
        "iterable": any("Iterable" in function.type for function in functions),
        "imports": [Code(line) for line in sorted(lines)],
        "old": _key(old),
        "new": _key(new),
        "units": units,
        "constants": constants,
        "class": Code(old.short),
        "functions": functions,
    }
    return code().get_template("upgrade/rules.py.jinja").render(rules=view)


def _completed(rules: Rules, plan: Plan) -> str:
    """Return the text of a file with the functions that it lacks."""
    text = rules.source.text.rstrip("\n") + "\n"
    template = code().get_template("upgrade/function.py.jinja")
    for field in _open(plan):
        if field.new.name not in rules.fields:
            function = _function(plan, field)
            text += template.render(function=function, rules={"class": Code(plan.old.key.short)})
    return text


def _key(key: VersionKey) -> _KeyView:
    return _KeyView(Code(string_literal(key.type)), Code(string_literal(key.hash)))


def _pair_view(*texts: str) -> _PairView:
    return _PairView(*(Code(string_literal(text)) for text in texts))


def _units(field: FieldPlan) -> Iterator[tuple[str, tuple[str, str]]]:
    old = field.old
    if old is not None and old.unit and field.new.unit and old.unit != field.new.unit:
        yield field.new.name, (old.unit, field.new.unit)


def _import(home: Version, version: Version) -> str:
    """Return the import of a class from the packages of the version that holds it."""
    name, key = version.name, version.key
    module = f"{TYPES}.{home.key.short.lower()}.{name.package}.{name.kind}"
    return f"from .{module} import {python_names.class_(name)} as {key.short}"


def _function(plan: Plan, field: FieldPlan) -> _FunctionView:
    finding = field.finding
    type_, lines = _annotation(plan, field.new.type)
    body = f"return {finding.proposal}" if finding.proposal else "raise NotImplementedError"
    return _FunctionView(
        Code(python_names.field(field.new.name)),
        Code(type_),
        EscapedText(one_line(finding.reason)),
        Code(body),
        lines,
    )


def _annotation(plan: Plan, type_: ir.FieldType) -> tuple[str, tuple[str, ...]]:
    """Return the annotation of a value, and the imports of the classes that it names."""
    element, lines = ir.element_of(type_), tuple[str, ...]()
    is_number = False
    match element:
        case ir.Ref():
            home, version = plan.new, plan.new.of(element.target)
            if element.target in plan.old.reached:
                # what the old message holds can be returned as it is
                home = plan.old if plan.old.of(element.target).key == version.key else home
            name, lines = version.key.short, (_import(home, version),)
        case ir.String():
            name = "str"
        case ir.Primitive("bool"):
            name = "bool"
        case ir.Primitive("byte"):
            name = "bytes"
        case _:
            is_number = True
            info = element.info if isinstance(element, ir.Primitive) else None
            name = "int" if info is not None and info.low is not None else "float"
    if not is_list(type_):
        return name, lines
    return f"{'Iterable' if is_number else 'list'}[{name}]", lines


def _type_files(plan: Plan) -> Iterator[RenderedFile]:
    """Yield the classes of the versions that the rules of a plan name, as packages."""
    yield RenderedFile(f"{TYPES}/__init__.py", '"""The classes of recorded versions."""\n')
    yield RenderedFile(
        f"{TYPES}/_idlc.py", code().get_template("upgrade/runtime.py.jinja").render()
    )
    for version in {version.key: version for version in (plan.old, plan.new)}.values():
        yield from _home_files(version.key.short.lower(), _needed(version))


def _home_files(name: str, models: Iterable[Model]) -> Iterator[RenderedFile]:
    """Yield the packages of a version in a folder of this name, without codecs."""
    home = f"{TYPES}/{name}"
    title = '"""A version of a type, and all that it refers to."""\n'
    yield RenderedFile(f"{home}/__init__.py", title)
    for model in models:
        yield RenderedFile(f"{home}/{model.package}/__init__.py", "")
        for file in interface_files(model, _AROUND):
            if "__codec" not in file.path:
                yield RenderedFile(f"{home}/{model.package}/{file.path}", file.text)


def _needed(version: Version) -> Sequence[Model]:
    """Return the models of the types that a version consists of, and of no others."""
    names = {interface_of(name) for name in version.reached}
    packages = sorted({name.package for name in names})
    return [version.models[package].only(names) for package in packages]
