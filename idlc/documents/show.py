"""The pipeline of `idlc show`: find a type, compile it, print it in another format."""

from __future__ import annotations

import json
from collections.abc import Iterator

from idlc.check.compiler import stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.documents.query import requested_models
from idlc.language.tree import OPTIONAL
from idlc.model import derive, ir
from idlc.model.ir import spell, spell_value
from idlc.model.link import Model
from idlc.project.settings import Scope

INDENT = "    "
GAP = 2
#: Comments are not aligned further to the right than this column.
WIDEST = 60


def outline(interface: ir.Interface, model: Model) -> Iterator[str]:
    """Yield the lines; sections of services and actions are divided as in their files."""
    for number, section in enumerate(derive.sections(interface)):
        if number:
            yield "---"
        yield from (f"# {line}".rstrip() for line in section.comment)
        if section.comment and (section.constants or section.fields):
            yield ""
        rows = [*_constants(section), *_fields(section, model, 0)]
        widths = [len(code) for code, _ in rows if len(code) <= WIDEST]
        column = max(widths, default=0) + GAP
        for code, comment in rows:
            yield from _commented(code, comment, column)


def _constants(message: ir.Message) -> Iterator[tuple[str, tuple[str, ...]]]:
    for constant in message.constants:
        yield (
            f"{spell(constant.type)} {constant.name}={spell_value(constant.value)}",
            constant.comment,
        )


def _fields(message: ir.Message, model: Model, depth: int) -> Iterator[tuple[str, tuple[str, ...]]]:
    for field in message.fields:
        default = f" {spell_value(field.default.value)}" if field.default else ""
        unit = f" [{field.unit}]" if field.unit else ""
        *before, last = field.comment or ("",)
        comment = tuple(line for line in (*before, f"{last}{unit}".strip()) if line)
        optional = f"{OPTIONAL} " if field.optional else ""
        yield f"{INDENT * depth}{optional}{spell(field.type)} {field.name}{default}", comment
        element = ir.element_of(field.type)
        if isinstance(element, ir.Ref):
            nested = model.messages[element.target]
            constants = (
                (f"{INDENT * (depth + 1)}{code}", about) for code, about in _constants(nested)
            )
            yield from constants
            yield from _fields(nested, model, depth + 1)


def _commented(code: str, comment: tuple[str, ...], column: int) -> Iterator[str]:
    """Yield a line of code with its comment after it, later comment lines below."""
    if not comment:
        yield code
        return
    first, *rest = comment
    yield f"{code.ljust(column - GAP)}{' ' * GAP}# {first}".rstrip()
    yield from (f"{' ' * column}# {line}".rstrip() for line in rest)


def show(target: str, style: str, scope: Scope, report: Report) -> list[str]:
    """Return the interfaces of a type name or path, each as text in a format."""
    texts = []
    wholes: list[ir.TypeName] = []
    for model, names in list(requested_models((target,), scope, report)):
        for own in model.own:
            wholes.append(own.name)
            if str(own.name) in names:
                with stage("show", str(own.name)):
                    texts.append(shown(own, model, style))
    if not texts and not report.had_errors:
        message = f"`{target}` is a part of a service or action"
        hint = f"`idlc show {wholes[0]}` shows the whole" if wholes else None
        report.add(codes.NO_SUCH_TYPE.of("", message, hint=hint))
    return texts


def shown(interface: ir.Interface, model: Model, style: str) -> str:
    """Return an interface in a format."""
    from idlc.documents import schemas
    from idlc.generate import idl

    match style:
        case "json":
            return json.dumps(schemas.facts(interface, model)) + "\n"
        case "ros2idl":
            return idl.idl(interface)
        case "jsonschema":
            return json.dumps(schemas.json_schema(interface, model), indent=2) + "\n"
        case "mcap":
            return schemas.mcap(interface, model)
    return "".join(_lines(interface, model, outline(interface, model)))


def _lines(interface: ir.Interface, model: Model, outline: Iterator[str]) -> Iterator[str]:
    """Yield an outline below the interface's name and hash."""
    yield f"# {interface.name}\n"
    if model.distro.has_hashes:
        yield f"# {model.describer.hash(str(interface.name))}\n"
    yield "\n"
    yield from (f"{line}\n" for line in outline)
