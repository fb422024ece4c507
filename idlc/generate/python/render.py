"""From the model to the files of a package, by way of the view-model and the templates.

Pure but for reading idlc's own templates and runtime. `idlc.lock` is not made here.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypedDict

import jinja2
import msgspec

from idlc.generate.idl import file_text
from idlc.generate.python import classes, fields, imports, positions
from idlc.generate.python.classes import GroupView, MessageView
from idlc.generate.python.decode import decode, is_bulk
from idlc.generate.python.encode import encode
from idlc.generate.python.imports import ALONE, Homes, References, Surroundings
from idlc.generate.python.lines import assign, call
from idlc.generate.python.literals import string_literal
from idlc.generate.python.positions import Tables
from idlc.model import derive, ir, link, python_names
from idlc.model.describe import IndividualDict
from idlc.model.names import snake_case
from idlc.project.templates import Code, RenderedFile, Text
from idlc.project.templates import code as code_environment
from idlc.runtime import PROTOCOL
from idlc.runtime.names import stamp
from idlc.version import RUNTIME, __version__
from idlc.wire import plan


class CodecView(msgspec.Struct, frozen=True):
    """The codec of a message class: all but the names are finished lines, indented."""

    name: Code
    function: Code
    imports: tuple[Code, ...]
    outside: tuple[Code, ...]
    constants: tuple[Code, ...]
    encode: tuple[Code, ...]
    decode: tuple[Code, ...]
    is_bulk: bool


def codec(structure: ir.Message, references: References, messages: plan.Messages) -> CodecView:
    """Return the view of a structure's codec."""
    names = python_names.Locals()
    steps = plan.steps(structure, messages, names)
    tables = Tables(names)
    writing = encode(steps, tables, 8)
    makers = _makers(structure, steps, references, messages, tables)
    foreign = {
        type_: references.name(type_) for type_ in makers if type_.package != references.package
    }
    bulk = is_bulk(steps)
    reading = positions.text_of(
        decode(steps, tables, makers[structure.name], makers, foreign, bulk=bulk), 8
    )
    constants = tuple(line for name, value in tables.definitions for line in assign(name, value, 4))
    inside, outside = references.imports(set(makers) - {structure.name}, 4)
    if any("_arrays." in line for line in constants):
        runtime = references.surroundings.runtime
        inside.insert(0, f"    from {runtime}_idlc import arrays as _arrays")
    return CodecView(
        name=Code(references.name(structure.name)),
        function=Code(f"{snake_case(structure.name.name).replace('__', '_')}_codec"),
        imports=_code(inside),
        outside=_code(outside),
        constants=_code(constants),
        encode=_code(writing),
        decode=_code(reading),
        is_bulk=bulk,
    )


def _code(lines: Iterable[str]) -> tuple[Code, ...]:
    return tuple(map(Code, lines))


def _makers(
    own: ir.Message,
    steps: tuple[plan.Step, ...],
    references: References,
    messages: plan.Messages,
    tables: Tables,
) -> dict[ir.TypeName, str]:
    """Return the functions that make empty objects of the message and of those in it.

    They demand that classes of the package have the fields that the codec was made for.
    """
    makers: dict[ir.TypeName, str] = {}
    for type_ in (own.name, *_types(steps)):
        if type_ not in makers:
            name = "kind" if type_ == own.name else references.name(type_)
            stem = f"new_{snake_case(references.name(type_))}".replace("__", "_")
            words = [name]
            if type_.package == references.package:
                words.append(f"{_stamp(own if type_ == own.name else messages[type_]):#010x}")
            makers[type_] = tables.define(stem, f"maker {name}", call("_idlc.maker", *words))
    return makers


def _stamp(message: ir.Message) -> int:
    return stamp({field.name: fields.idl_text(field.type) for field in message.fields})


def _types(steps: tuple[plan.Step, ...]) -> list[ir.TypeName]:
    types: list[ir.TypeName] = []
    for step in steps:
        if isinstance(step, plan.Enter):
            types.append(step.type)
        elif isinstance(step, plan.Items):
            types += [step.type, *_types(step.body)]
    return types


class TypesDict(TypedDict):
    """Descriptions and hashes by full name, and the package's own files by interface name.

    `stamps` are of the package's own classes.

    Other packages' files are left out: their text differs between an installation and the
    catalogue, and the same input must give the same output.
    """

    package: str
    stamps: dict[str, int]
    descriptions: dict[str, IndividualDict]
    hashes: dict[str, str]
    sources: dict[str, str]


def content(model: link.Model) -> TypesDict:
    """Return the descriptions of a package's types and of everything that they refer to."""
    describer = model.describer
    descriptions: dict[str, IndividualDict] = {}
    for interface in model.own:
        structures = (*derive.messages(interface), *derive.pseudo_structures(interface))
        for structure in structures:
            full = describer.description(str(structure.name))
            for description in (full["type_description"], *full["referenced_type_descriptions"]):
                descriptions[description["type_name"]] = description
    stamps = {
        str(message.name): _stamp(message)
        for interface in model.own
        for message in derive.sections(interface)
    }
    sources = {
        # rosidl reads texts so, and no checkout of git's makes a difference then
        str(interface.name): file_text(interface).replace("\r\n", "\n").replace("\r", "\n")
        for interface in model.own
        if interface.source is not None
    }
    return {
        "package": model.package,
        "stamps": dict(sorted(stamps.items())),
        "descriptions": dict(sorted(descriptions.items())),
        "hashes": {name: describer.hash(name) for name in sorted(descriptions)},
        "sources": dict(sorted(sources.items())),
    }


def type_data_source(model: link.Model, surroundings: Surroundings = ALONE) -> str:
    """Return the text of the module: one line of it for each type."""
    parts = _parts(content(model), surroundings.others)
    lines = "".join(f"    {string_literal(part)}\n" for part in parts)
    head = f'''\
# Generated by idlc. Do not edit.
# flake8: noqa
"""The types of {model.package}, as ROS 2 describes them."""
'''
    return f"{head}\nJSON = (\n{lines})\n"


def _parts(tables: TypesDict, around: str) -> list[str]:
    """Return pieces that joined are the JSON text, one for each entry."""
    parts: list[str] = []
    mark = f'{{"package":{_json(tables["package"])}'
    if around:
        mark += f',"around":{_json(around)}'
    for key in ("stamps", "descriptions", "hashes", "sources"):
        mark += f',"{key}":{{'
        entries: dict[str, Any] = tables[key]
        for name, value in entries.items():
            parts.append(f"{mark}{_json(name)}:{_json(value)}")
            mark = ","
        mark = "}" if entries else f"{mark}}}"
    return [*parts[:-1], f"{parts[-1]}{mark}}}"]


_json = json.JSONEncoder(ensure_ascii=True, separators=(",", ":")).encode


class ModuleView(msgspec.Struct, frozen=True, kw_only=True):
    """A module of classes or of codecs; `imports` are lines.

    `converts` says that classes convert values as Lyrical's do.
    """

    origin: Text
    pragmas: tuple[Code, ...]
    title: Text
    runtime: Code
    imports: tuple[Code, ...] = ()
    messages: tuple[MessageView, ...] = ()
    codecs: tuple[CodecView, ...] = ()
    group: GroupView | None = None
    converts: bool = False
    has_texts: bool = False


class Module(NamedTuple):
    """A module to write: the name of its template, its path, and what it shows."""

    template: str
    path: str
    view: ModuleView


PRAGMAS = (
    Code('# mypy: disable-error-code="import-not-found,import-untyped"'),
    Code("# pyright: reportMissingImports=false, reportMissingTypeStubs=false"),
)
HIDING_PRAGMAS = (Code("# pyright: reportIncompatibleMethodOverride=false"),)


def module_views(
    interface: ir.Interface,
    messages: plan.Messages,
    names: python_names.Modules,
    surroundings: Surroundings = ALONE,
    *,
    converts: bool = False,
) -> Iterator[Module]:
    """Yield the views of an interface's modules; `names` has the modules of all its package.

    With `converts`, classes convert values as Lyrical's do.
    """
    homes = Homes(interface, names, surroundings)
    written = derive.sections(interface)
    view = _classes(interface, written, References(interface, written, messages, homes), converts)
    yield Module(interface.name.kind, f"{interface.name.kind}/{homes.classes}.py", view)
    sent = written + derive.composites(interface)
    references = References(interface, sent, messages, homes)
    codecs = tuple(codec(structure, references, messages) for structure in sent)
    view = ModuleView(
        origin=Text(f"{interface.name}.{interface.name.kind}"),
        pragmas=PRAGMAS if any(codec.outside for codec in codecs) else (),
        title=Text(f"The codecs of {interface.name}."),
        runtime=Code(surroundings.runtime),
        codecs=codecs,
        has_texts=any("*" in line for codec in codecs for line in codec.constants),
    )
    path = f"{interface.name.kind}/{python_names.codec_module(homes.classes)}.py"
    yield Module("codec", path, view)


def _classes(
    interface: ir.Interface,
    structures: tuple[ir.Message, ...],
    references: References,
    converts: bool,
) -> ModuleView:
    name = interface.name
    purposes = fields.purposes(interface)
    file = f"{name.kind}/{name.name}.{name.kind}"
    return ModuleView(
        origin=Text(f"{name}.{name.kind}"),
        pragmas=(
            *(PRAGMAS if references.others and not references.surroundings.vendors else ()),
            *(HIDING_PRAGMAS if any(map(_hides_methods, structures)) else ()),
        ),
        title=Text(f"The classes of {name}."),
        runtime=Code(references.surroundings.runtime),
        imports=_code(_imports(references, structures)),
        messages=tuple(
            classes.message(structure, references, purposes, file, converts=converts)
            for structure in structures
        ),
        group=None if isinstance(interface, ir.Message) else classes.group(interface),
        converts=converts,
    )


def _hides_methods(structure: ir.Message) -> bool:
    return any(python_names.hides_method(field.name) for field in structure.fields)


def _imports(references: References, structures: tuple[ir.Message, ...]) -> Iterator[str]:
    every = [field for message in structures for field in message.fields]
    used = {fields.support(field.type) for field in every}
    standard = ["import builtins as _builtins"] if any(map(fields.shadows, structures)) else []
    if any(fields.support(field.type) == "sequence" and not field.default for field in every):
        standard.append("from array import array as _array")
    inside, outside = references.imports(references.direct)
    yield from (*standard, "") if standard else ()
    runtime = references.surroundings.runtime
    yield f"from {runtime} import _idlc"
    if "array" in used:
        yield f"from {runtime}_idlc import arrays as _arrays"
    yield from inside
    if outside:
        yield from ("", "with _idlc.importing():", *outside)


PACKAGE = Path(__file__).parents[2]


@cache
def template(name: str) -> jinja2.Template:
    """Return a template of generated code."""
    return code_environment().get_template(name)


@cache
def carried_runtime() -> tuple[RenderedFile, ...]:
    """Return the support package, a verbatim copy of idlc.runtime."""
    runtime = PACKAGE / "runtime"
    return tuple(
        RenderedFile(
            f"_idlc/{path.relative_to(runtime).as_posix()}", path.read_text(encoding="utf-8")
        )
        for path in sorted(runtime.rglob("*.py"))
    )


def installed_runtime(package: str) -> tuple[RenderedFile]:
    """Return the module that takes the runtime from the distribution idlc-runtime."""
    required, version = Code(RUNTIME), Code(__version__)
    text = template("message/runtime.py.jinja").render(
        package=Code(package), required=required, version=version, protocol=PROTOCOL
    )
    return (RenderedFile("_idlc.py", text),)


def module_files(
    interface: ir.Interface,
    model: link.Model,
    modules: python_names.Modules,
    surroundings: Surroundings = ALONE,
) -> Iterator[RenderedFile]:
    """Yield the modules of one interface."""
    converts = model.distro.converts_values
    views = module_views(interface, model.messages, modules, surroundings, converts=converts)
    for module in views:
        text = template(f"message/{module.template}.py.jinja").render(module=module.view)
        yield RenderedFile(module.path, text)


def render_package(
    model: link.Model,
    surroundings: Surroundings = ALONE,
    runtime: Iterable[RenderedFile] | None = None,
) -> tuple[RenderedFile, ...]:
    """Return all files of a generated package but its lock, sorted by path.

    `runtime` are the files of its `_idlc`, by default a copy of the runtime.
    The model must be without errors: no `Unknown` type, no missing one.
    """
    files = [
        *interface_files(model, surroundings),
        # a package without it would lose to any other of its name, wherever that stands on the path
        RenderedFile("__init__.py", f'"""The interfaces of {model.package}."""\n'),
        RenderedFile("py.typed", ""),
        *(carried_runtime() if runtime is None else runtime),
    ]
    return tuple(sorted(files, key=lambda file: file.path))


def interface_files(model: link.Model, surroundings: Surroundings) -> Iterator[RenderedFile]:
    """Yield the modules of a package's interfaces and the description of their types."""
    modules = python_names.modules(interface.name for interface in model.own)
    for own in model.own:
        yield from module_files(own, model, modules, surroundings)
    for kind in model.kinds:
        page = imports.package(model, kind, modules, surroundings)
        text = template("message/package_init.py.jinja").render(package=page)
        yield RenderedFile(f"{kind}/__init__.py", text)
    yield RenderedFile("_type_data.py", type_data_source(model, surroundings))
