"""From the model to the files of a package, by way of the view-model and the templates.

Pure but for reading idlc's own templates and runtime. `idlc.lock` is not made here.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import msgspec

from idlc.generate.python import classes, fields, imports
from idlc.generate.python.classes import GroupView, MessageView
from idlc.generate.python.decode import decode, is_bulk
from idlc.generate.python.encode import encode
from idlc.generate.python.imports import ALONE, References, Surroundings
from idlc.generate.python.lines import call, text_of
from idlc.generate.python.literals import string_literal
from idlc.generate.python.positions import NamedExpressions
from idlc.generate.templates import Code, EscapedText, RenderedFile
from idlc.generate.templates import code as code_environment
from idlc.model import derive, ir, link, python_names
from idlc.model.catalog import is_standard
from idlc.model.idl_text import idl_text
from idlc.model.names import snake_case
from idlc.model.type_data import content
from idlc.project.lock import COPY_HEAD
from idlc.runtime import PROTOCOL
from idlc.runtime.names import stamp
from idlc.version import RUNTIME, __version__
from idlc.wire import plan
from idlc.wire.layout import Messages


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
    has_texts: bool


def codec(structure: ir.Message, references: References, messages: Messages) -> CodecView:
    """Return the view of a structure's codec."""
    names = python_names.Locals()
    steps = plan.steps(structure, messages, names)
    tables = NamedExpressions(names)
    writing = text_of(encode(steps, tables), 8)
    # The functions that make empty objects of the message and of those in it. They demand that
    # classes have the fields that the codec was made for.
    makers: dict[ir.TypeName, str] = {}
    nested = (
        step.type
        for step in plan.walk(steps)
        if isinstance(step, (plan.Enter, plan.StructuresStep))
    )
    for type_ in dict.fromkeys((structure.name, *nested)):
        stem = f"new_{snake_case(references.name(type_))}".replace("__", "_")
        words = ["kind" if type_ == structure.name else references.name(type_)]
        if _is_stamped(type_.package, references.package):
            held = structure if type_ == structure.name else messages[type_]
            words.append(f"{_stamp(held):#010x}")
        makers[type_] = tables.function(stem, call("maker", *words))
    foreign = {
        type_: references.name(type_) for type_ in makers if type_.package != references.package
    }
    reading = text_of(decode(steps, tables, makers[structure.name], makers, foreign), 8)
    inside, outside = references.imports(set(makers) - {structure.name}, 4)
    if tables.has_arrays:
        runtime = references.surroundings.runtime
        inside.insert(0, f"    from {runtime}_idlc import arrays as _arrays")
    return CodecView(
        name=Code(references.name(structure.name)),
        function=Code(f"{snake_case(structure.name.name).replace('__', '_')}_codec"),
        imports=_code(inside),
        outside=_code(outside),
        constants=_code(text_of(tables.definitions, 4)),
        encode=_code(writing),
        decode=_code(reading),
        is_bulk=is_bulk(steps),
        has_texts=tables.has_texts,
    )


def _code(lines: Iterable[str]) -> tuple[Code, ...]:
    return tuple(map(Code, lines))


def _is_stamped(package: str, own: str) -> bool:
    """Return whether a package's types must have the fields that code was generated for.

    Standard types of other packages may be those of another distribution at run time.
    """
    return package == own or not is_standard(package)


def _stamp(message: ir.Message) -> int:
    return stamp({field.name: idl_text(field.type) for field in message.fields})


def type_data_source(model: link.Model, surroundings: Surroundings = ALONE) -> str:
    """Return the text of the module: one line of it for each type, and each stamp of a class."""
    messages = [message for interface in model.own for message in derive.sections(interface)]
    messages += [
        message
        for name, message in model.messages.items()
        if name.package != model.package and _is_stamped(name.package, model.package)
    ]
    stamps = {str(message.name): _stamp(message) for message in messages}
    tables = {"stamps": dict(sorted(stamps.items())), **content(model)}
    parts = _parts(tables, surroundings.others)
    lines = "".join(f"    {string_literal(part)}\n" for part in parts)
    head = f'''\
# Generated by idlc. Do not edit.
# flake8: noqa
"""The types of {model.package}, as ROS 2 describes them."""
'''
    return f"{head}\nJSON = (\n{lines})\n"


def _parts(tables: Mapping[str, Any], around: str) -> list[str]:
    """Return pieces that joined are the JSON text, one for each entry."""
    parts: list[str] = []
    mark = f'{{"package":{_json(tables["package"])}'
    if around:
        mark += f',"around":{_json(around)}'
    for key in ("stamps", "descriptions", "hashes", "sources"):
        mark += f',"{key}":{{'
        entries = tables[key]
        for name, value in entries.items():
            parts.append(f"{mark}{_json(name)}:{_json(value)}")
            mark = ","
        mark = "}" if entries else f"{mark}}}"
    return [*parts[:-1], f"{parts[-1]}{mark}}}"]


_json = json.JSONEncoder(ensure_ascii=True, separators=(",", ":")).encode


class ModuleView(msgspec.Struct, frozen=True, kw_only=True):
    """A module of classes or of codecs; `imports` and those for type checkers are lines.

    `converts` says that classes convert values as Lyrical's do.
    """

    origin: EscapedText
    pragmas: tuple[Code, ...]
    title: EscapedText
    runtime: Code
    imports: tuple[Code, ...] = ()
    type_imports: tuple[Code, ...] = ()
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
    messages: Messages,
    names: python_names.Modules,
    surroundings: Surroundings = ALONE,
    *,
    converts: bool = False,
) -> Iterator[Module]:
    """Yield the views of an interface's modules; `names` has the modules of all its package.

    With `converts`, classes convert values as Lyrical's do.
    """
    name, home, written = interface.name, names[interface.name], derive.sections(interface)
    references = References(interface, written, messages, names, surroundings, converts=converts)
    every = [field for structure in written for field in structure.fields]
    is_foreign = references.others and not surroundings.vendors
    is_hiding = any(field.name in python_names.METHODS for field in every)
    purposes = zip(written, fields.purposes(interface), strict=True)
    views = tuple(
        classes.message(structure, references, purpose) for structure, purpose in purposes
    )
    view = ModuleView(
        origin=EscapedText(f"{name}.{name.kind}"),
        pragmas=(PRAGMAS if is_foreign else ()) + (HIDING_PRAGMAS if is_hiding else ()),
        title=EscapedText(f"The classes of {name}."),
        runtime=Code(surroundings.runtime),
        imports=_code(_imports(references, written, views)),
        type_imports=_code(_type_imports(views)),
        messages=views,
        group=None if isinstance(interface, ir.Message) else classes.group(interface),
        converts=converts,
    )
    yield Module(name.kind, f"{name.kind}/{home}.py", view)
    sent = written + derive.composites(interface)
    references = References(interface, sent, messages, names, surroundings)
    codecs = tuple(codec(structure, references, messages) for structure in sent)
    view = ModuleView(
        origin=EscapedText(f"{name}.{name.kind}"),
        pragmas=PRAGMAS if any(codec.outside for codec in codecs) else (),
        title=EscapedText(f"The codecs of {name}."),
        runtime=Code(surroundings.runtime),
        codecs=codecs,
        has_texts=any(codec.has_texts for codec in codecs),
    )
    yield Module("codec", f"{name.kind}/{python_names.codec_module(home)}.py", view)


def _type_imports(views: Iterable[MessageView]) -> Iterator[str]:
    deprecated = [field for view in views for field in view.fields if field.descriptor]
    if any("_np." in field.read for field in deprecated):
        yield "import numpy as _np"
        yield "from numpy.typing import NDArray as _NDArray"
    if deprecated:
        yield "from typing_extensions import deprecated as _deprecated"


def _imports(
    references: References, structures: tuple[ir.Message, ...], views: Iterable[MessageView]
) -> Iterator[str]:
    every = [field for message in structures for field in message.fields]
    numeric = [field for field in every if fields.number_info(field.type)]
    standard = ["import builtins as _builtins"] if any(map(fields.shadows, structures)) else []
    if any(isinstance(field.type, ir.Sequence) and not field.default for field in numeric):
        standard.append("from array import array as _array")
    if any(view.enums for view in views):
        standard.append("from enum import IntEnum as _IntEnum")
    inside, outside = references.imports(references.direct)
    yield from (*standard, "") if standard else ()
    runtime = references.surroundings.runtime
    yield f"from {runtime} import _idlc"
    if any(isinstance(field.type, ir.Array) for field in numeric):
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
    """Return the support package, a copy of idlc.runtime that tools of its users leave alone."""
    runtime = PACKAGE / "runtime"
    return tuple(
        RenderedFile(
            f"_idlc/{path.relative_to(runtime).as_posix()}",
            COPY_HEAD + path.read_text(encoding="utf-8"),
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
        converts = model.distro.converts_values
        for module in module_views(own, model.messages, modules, surroundings, converts=converts):
            text = template(f"message/{module.template}.py.jinja").render(module=module.view)
            yield RenderedFile(module.path, text)
    for kind in model.kinds:
        page = imports.package(model, kind, modules, surroundings)
        text = template("message/package_init.py.jinja").render(package=page)
        yield RenderedFile(f"{kind}/__init__.py", text)
    yield RenderedFile("_type_data.py", type_data_source(model, surroundings))
