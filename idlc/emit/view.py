"""The view-model: what each module of an interface says, as text that templates lay out.

In: the model. Out: frozen structs. All text from interface files has gone through `literals`, all
names through `pynames`.
"""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from idlc.emit import classes, documentation, fields, pynames
from idlc.emit.classes import GroupView, MessageView
from idlc.emit.codec import wire_plan
from idlc.emit.codecs import CodecView, codec
from idlc.emit.references import Homes, References
from idlc.model import derive, ir


class ModuleView(msgspec.Struct, frozen=True, kw_only=True):
    """A module of classes or of codecs; `imports` are the lines after those that all have.

    `protocol` is the module of what ROS 2 adds to the services and the action. `implements` is
    the action of which the module is that.
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


def modules(
    interface: ir.Interface, messages: wire_plan.Messages, names: pynames.Modules
) -> Iterator[ModuleView]:
    """Yield the views of an interface's modules; `names` has the modules of all its package."""
    written = derive.sections(interface)
    added = derive.messages(interface)[len(written) :]
    homes = Homes(interface, names)
    for structures in (written, added):
        if structures:
            references = References(interface, structures, messages, homes)
            is_added = structures is added
            yield _classes(interface, structures, references, homes, is_added=is_added)
            yield _codecs(interface, structures, references, messages, homes, is_added=is_added)


def _classes(
    interface: ir.Interface,
    structures: tuple[ir.Message, ...],
    references: References,
    homes: Homes,
    *,
    is_added: bool,
) -> ModuleView:
    name = interface.name
    purposes = documentation.purposes(interface)
    action = classes.action(interface) if isinstance(interface, ir.Action) else None
    has_services = is_added == isinstance(interface, ir.Action)
    title = f"What ROS 2 adds to {name}." if is_added else f"The classes of {name}."
    return ModuleView(
        template="protocol" if is_added else name.kind,
        path=f"{name.kind}/{homes.protocol if is_added else homes.classes}.py",
        origin=f"{name}.{name.kind}",
        pragmas=(
            *(PRAGMAS if _has_others(references, references.direct | references.implied) else ()),
            *(HIDING_PRAGMAS if any(map(_hides_methods, structures)) else ()),
        ),
        title=title,
        imports=tuple(_imports(references, structures)),
        messages=tuple(classes.message(one, references, purposes) for one in structures),
        services=classes.services(interface, purposes) if has_services else (),
        action=action,
        protocol=homes.protocol,
    )


def _codecs(
    interface: ir.Interface,
    structures: tuple[ir.Message, ...],
    references: References,
    messages: wire_plan.Messages,
    homes: Homes,
    *,
    is_added: bool,
) -> ModuleView:
    name = interface.name
    module = pynames.codec_module(homes.protocol if is_added else homes.classes)
    codecs = tuple(codec(structure, references, messages) for structure in structures)
    what = f"what ROS 2 adds to {name}" if is_added else str(name)
    return ModuleView(
        template="codec",
        path=f"{name.kind}/{module}.py",
        origin=f"{name}.{name.kind}",
        pragmas=PRAGMAS if any(one.outside for one in codecs) else (),
        title=f"The codecs of {what}.",
        codecs=codecs,
    )


def _hides_methods(structure: ir.Message) -> bool:
    return any(pynames.hides_method(field.name) for field in structure.fields)


def _has_others(references: References, types: set[ir.TypeName]) -> bool:
    return any(name.package != references.package for name in types)


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
