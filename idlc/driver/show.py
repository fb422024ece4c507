"""The pipeline of `idlc show`: find a type, compile it, say it in another way."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.disk.scope import Scope
from idlc.driver.query import wanted_models
from idlc.driver.stages import stage

if TYPE_CHECKING:
    from idlc.model import ir
    from idlc.model.link import Model


def show(wanted: str, style: str, scope: Scope, report: Report) -> list[str]:
    """Return the interfaces that a type name or path means, each as text in a format."""
    texts = []
    wholes: list[ir.TypeName] = []
    for model, names in list(wanted_models((wanted,), scope, report)):
        for own in model.own:
            wholes.append(own.name)
            if str(own.name) in names:
                with stage("show", str(own.name)):
                    texts.append(shown(own, model, style))
    if not texts and not report.had_errors:
        message = f"`{wanted}` is a part of a service or action"
        hint = f"`idlc show {wholes[0]}` shows the whole" if wholes else None
        report.add(codes.NO_SUCH_TYPE.of("", message, hint=hint))
    return texts


def shown(interface: ir.Interface, model: Model, style: str) -> str:
    """Return an interface in a format."""
    from idlc.export import idl, outline, schemas

    match style:
        case "json":
            return json.dumps(schemas.facts(interface, model)) + "\n"
        case "ros2idl":
            return idl.idl(interface)
        case "jsonschema":
            return json.dumps(schemas.json_schema(interface, model), indent=2) + "\n"
        case "mcap":
            return schemas.mcap(interface, model)
    return "".join(_lines(interface, model, outline.outline(interface, model)))


def _lines(interface: ir.Interface, model: Model, outline: Iterator[str]) -> Iterator[str]:
    """Yield an outline below the interface's name and hash."""
    yield f"# {interface.name}\n"
    if model.distro.has_hashes:
        yield f"# {model.describer.hash(str(interface.name))}\n"
    yield "\n"
    yield from (f"{line}\n" for line in outline)
