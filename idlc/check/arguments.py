"""The rule about constructor arguments in a package's Python code, which type checkers miss."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic
from idlc.model import derive
from idlc.model.comments import deprecation
from idlc.model.link import Model
from idlc.packaging.facts import Facts
from idlc.packaging.setup_py import parse, span_of


def deprecated_arguments(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """Report arguments for deprecated fields: PEP 702 cannot mark a parameter."""
    classes = dict(_classes(model))
    for module, source in facts.modules.items() if classes else ():
        tree = parse(source.text)
        nodes = list(ast.walk(tree)) if tree else []
        names = dict(name for node in nodes for name in _imports(module, node))
        for call in (node for node in nodes if isinstance(node, ast.Call)):
            fields = classes.get(_class(call.func, names), {})
            for field, node in _arguments(call, [*fields]):
                advice = fields.get(field)
                if advice is not None:
                    message = f"the field `{field}` is deprecated"
                    span = span_of(source, node)
                    yield codes.DEPRECATED_ARGUMENT.at(span, message, hint=advice)


def _classes(model: Model) -> Iterator[tuple[str, dict[str, str | None]]]:
    """Yield each class with a deprecated field, and the advice of its fields in their order."""
    for interface in model.interfaces.values():
        package, kind, name = interface.name
        for section in derive.sections(interface):
            fields = {field.name: deprecation(field.comment) for field in section.fields}
            if any(advice is not None for advice in fields.values()):
                own = section.name.name.removeprefix(name).replace("_", ".", 1)
                yield f"{package}.{kind}.{name}{own}", fields


def _imports(module: str, node: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield the names that an import gives to modules and classes, and their full names."""
    if isinstance(node, ast.Import):
        yield from ((alias.asname, alias.name) for alias in node.names if alias.asname)
    elif isinstance(node, ast.ImportFrom):
        above = module.split(".")[: -node.level] if node.level else []
        origin = ".".join([*above, *filter(None, (node.module,))]).removeprefix("src.")
        yield from ((alias.asname or alias.name, f"{origin}.{alias.name}") for alias in node.names)


def _class(node: ast.expr, names: dict[str, str]) -> str:
    """Return the full name of what is called; empty if it is not written as a dotted name."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return ""
    return ".".join((names.get(node.id, node.id), *reversed(parts)))


def _arguments(call: ast.Call, fields: list[str]) -> Iterator[tuple[str, ast.AST]]:
    """Yield the field of each argument of a call, and its node."""
    for field, node in zip(fields, call.args, strict=False):
        if isinstance(node, ast.Starred):
            break
        yield field, node
    yield from ((each.arg, each) for each in call.keywords if each.arg)
