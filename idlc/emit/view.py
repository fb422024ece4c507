"""The view-model: what each module of an interface says, as text that templates lay out.

In: the model. Out: frozen structs. All text from interface files has gone through `literals`, all
names through `pynames`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from idlc.emit import classes, documentation, fields, pynames
from idlc.emit.classes import GroupView, MessageView
from idlc.emit.codec import wire_plan
from idlc.emit.codecs import CodecView, codec
from idlc.emit.references import Homes, References
from idlc.model import derive, ir


class ModuleView(msgspec.Struct, frozen=True, kw_only=True):
    """A module of classes or of codecs; `imports` are lines.

    `protocol` is the module of what ROS 2 adds to the service or action.
    """

    template: str
    path: str
    origin: str
    pragmas: tuple[str, ...]
    title: str
    imports: tuple[str, ...] = ()
    messages: tuple[MessageView, ...] = ()
    codecs: tuple[CodecView, ...] = ()
    services: tuple[GroupView, ...] = ()
    action: GroupView | None = None
    protocol: str = ""


PRAGMAS = (
    '# mypy: disable-error-code="import-not-found,import-untyped"',
    "# pyright: reportMissingImports=false, reportMissingTypeStubs=false",
)
HIDING_PRAGMAS = ("# pyright: reportIncompatibleMethodOverride=false",)


class _Part(NamedTuple):
    """What one module of classes defines of an interface."""

    interface: ir.Interface
    structures: tuple[ir.Message, ...]
    references: References
    module: pynames.ModuleName
    is_added: bool
    converts: bool


def modules(
    interface: ir.Interface,
    messages: wire_plan.Messages,
    names: pynames.Modules,
    around: str = "",
    *,
    converts: bool = False,
) -> Iterator[ModuleView]:
    """Yield the views of an interface's modules; `names` has the modules of all its package.

    `converts` is whether classes convert values as those of Lyrical do.
    """
    homes = Homes(interface, names, around)
    written = derive.sections(interface)
    added = derive.messages(interface)[len(written) :]
    for structures, module in ((written, homes.classes), (added, homes.protocol)):
        if structures:
            references = References(interface, structures, messages, homes)
            part = _Part(interface, structures, references, module, structures is added, converts)
            yield _classes(part, homes)
            yield _codecs(part, messages)


def _classes(part: _Part, homes: Homes) -> ModuleView:
    interface, references = part.interface, part.references
    name = interface.name
    purposes = documentation.purposes(interface)
    is_action = isinstance(interface, ir.Action)
    file = f"{name.kind}/{name.name}.{name.kind}"
    return ModuleView(
        template="protocol" if part.is_added else name.kind,
        path=f"{name.kind}/{part.module}.py",
        origin=f"{name}.{name.kind}",
        pragmas=(
            *(PRAGMAS if references.others else ()),
            *(HIDING_PRAGMAS if any(map(_hides_methods, part.structures)) else ()),
        ),
        title=f"What ROS 2 adds to {name}." if part.is_added else f"The classes of {name}.",
        imports=tuple(_imports(references, part.structures)),
        messages=tuple(
            classes.message(one, references, purposes, file, converts=part.converts)
            for one in part.structures
        ),
        # a service's own class is its author's; those of an action's services are not
        services=classes.services(interface, purposes) if part.is_added == is_action else (),
        action=classes.action(interface) if isinstance(interface, ir.Action) else None,
        protocol=homes.protocol,
    )


def _codecs(part: _Part, messages: wire_plan.Messages) -> ModuleView:
    name = part.interface.name
    codecs = tuple(codec(one, part.references, messages) for one in part.structures)
    return ModuleView(
        template="codec",
        path=f"{name.kind}/{pynames.codec_module(part.module)}.py",
        origin=f"{name}.{name.kind}",
        pragmas=PRAGMAS if any(one.outside for one in codecs) else (),
        title=f"The codecs of {f'what ROS 2 adds to {name}' if part.is_added else name}.",
        codecs=codecs,
    )


def _hides_methods(structure: ir.Message) -> bool:
    return any(pynames.hides_method(field.name) for field in structure.fields)


def _imports(references: References, structures: tuple[ir.Message, ...]) -> Iterator[str]:
    used = {fields.support(field.type) for message in structures for field in message.fields}
    standard = ["import builtins as _builtins"] if any(map(fields.shadows, structures)) else []
    if "sequence" in used:
        standard.append("from array import array as _array")
    inside, outside = references.imports(references.direct)
    yield from (*standard, "") if standard else ()
    yield "from .. import _idlc"
    if "array" in used:
        yield "from .._idlc import arrays as _arrays"
    yield from inside
    if outside:
        yield from ("", "with _idlc.importing():", *outside)
    implied = references.modules()
    if implied:
        yield from ("", "TYPE_CHECKING = False", "if TYPE_CHECKING:")
        yield from (f"    import {module} as {name}" for module, name in implied)
        yield "else:"
        yield from (f'    {name} = _idlc.Package("{module}")' for module, name in implied)
