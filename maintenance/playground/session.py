"""The session in the playground's worker: an interface file, its problems, and views of it.

The language server checks a document that no file holds. It answers in place, because a worker
has no threads. Nothing is written, and no generated code is run.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from idlc.compiler.compiler import compile_package
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.editor.server import Server
from idlc.generate.python.render import module_views, template
from idlc.model import derive, ir, python_names
from idlc.model.link import Model
from idlc.project.library import Library
from idlc.project.root import Root
from idlc.tasks.show import shown
from idlc.versions.packages import compare
from maintenance.website import colours

PACKAGE = "demo_msgs"
#: Bytes of the longest message that is shown.
MAX_BYTES = 1 << 20
#: Characters of the longest line that has colours.
MAX_COLOURED = 1000
#: Bytes before the values of a message: little-endian CDR.
HEADER = b"\0\1\0\0"


class Session:
    """One document; `folder` exists and stays empty. Requests and answers are JSON."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / PACKAGE
        self.folder.mkdir(exist_ok=True)
        self._server = Server(BytesIO(), BytesIO())
        folders = [{"uri": self.folder.as_uri(), "name": PACKAGE}]
        self._server.answer("initialize", {"workspaceFolders": folders, "capabilities": {}})
        self._name = ir.TypeName(PACKAGE, "msg", "")
        self._before = ""
        self._version = 0

    def handle(self, request: str) -> str:
        """Return the answer to a request: a method of this class, and its parameters."""
        method, params = json.loads(request)
        methods: dict[str, Callable[..., object]] = {
            "open": self.open,
            "change": self.change,
            "completion": self.completion,
            "hover": self.hover,
            "colours": self.colours,
            "python": self.python,
            "bytes": self.bytes,
            "hash": self.hashes,
            "schema": self.schema,
            "breaking": self.breaking,
        }
        return self._server.encode(methods[method](**params)).decode()

    @property
    def _uri(self) -> str:
        return (self.folder / self._name.file).as_uri()

    def _notify(self, event: str, document: dict[str, object], **params: object) -> None:
        document = {"uri": self._uri, **document}
        params = {"textDocument": document, **params}
        self._server.handle_notification(f"textDocument/{event}", params)

    def open(self, kind: ir.Kind, name: str, text: str, before: str) -> object:
        """Open a document instead of the one that is open, and return its problems.

        `before` is the text that `breaking` compares with.
        """
        if self._name.name:
            self._notify("didClose", {})
        self._name, self._before = ir.TypeName(PACKAGE, kind, name), before
        self._notify("didOpen", {"languageId": "rosmsg", "version": 0, "text": text})
        return self._problems()

    def change(self, text: str) -> object:
        """Return the problems of a new text."""
        self._version += 1
        changes = [{"text": text}]
        self._notify("didChange", {"version": self._version}, contentChanges=changes)
        return self._problems()

    def _problems(self) -> object:
        return self._ask("diagnostic")

    def _ask(self, name: str, **params: object) -> Any:
        params = {"textDocument": {"uri": self._uri}, **params}
        return self._server.answer(f"textDocument/{name}", params)

    def completion(self, line: int, character: int) -> object:
        """Return what can be written at a position."""
        return self._ask("completion", position={"line": line, "character": character})

    def hover(self, line: int, character: int) -> object:
        """Return the description of what is at a position."""
        return self._ask("hover", position={"line": line, "character": character})

    def colours(self, text: str) -> list[tuple[str, str]]:
        """Return the pieces of a text, each with its class in the style sheet."""
        return [piece for line in text.split("\n") for piece in (*_pieces(line), ("\n", ""))]

    def _sound(self) -> tuple[ir.Interface, Model] | None:
        """Return the interface and its model, `None` while the text has errors."""
        context = self._server.state.context(self._uri)
        model = context.model if context else None
        return (context.interface, model) if context and model else None

    def python(self) -> str:
        """Return the module of the Python classes."""
        if (sound := self._sound()) is None:
            return ""
        interface, model = sound
        names = python_names.modules([interface.name])
        module = next(module_views(interface, model.messages, names))
        return str(template(f"message/{module.template}.py.jinja").render(module=module.view))

    def hashes(self) -> str:
        """Return the type hash of the interface and of each type derived from it."""
        if (sound := self._sound()) is None:
            return ""
        interface, model = sound
        names = sorted({str(part.name) for part in derive.structures(interface)})
        return "".join(f"{model.describer.hash(name)}  {name}\n" for name in names)

    def schema(self) -> str:
        """Return the JSON Schema."""
        sound = self._sound()
        return shown(*sound, "jsonschema") if sound else ""

    def breaking(self) -> object:
        """Return the changes since `before`; a text where one of the two has errors."""
        if (sound := self._sound()) is None:
            return "the text has errors"
        interface, after = sound
        report = Report()
        source = Source(self._name.file, self._before)
        library = Library((), Root(self.folder), report)
        before = compile_package(PACKAGE, [(self._name, source)], library, report)
        if report.had_errors:
            return "the text that you began with has errors"
        changes = compare(before, after.only({interface.name})).changes
        problems = [change.diagnostic for change in changes]
        return [
            {"code": each.code, "message": each.message, "levels": each.levels, "hint": each.hint}
            for each in problems
        ]

    def bytes(self, values: dict[str, str]) -> object:
        """Return the bytes of the first message of the file, and the row of each value.

        `values` are values as JSON by path; other fields have their defaults.
        """
        if (sound := self._sound()) is None:
            return None
        interface, model = sound
        writer = Writer(model, values)
        writer.message(derive.sections(interface)[0], "", None)
        rows = [row._asdict() for row in writer.rows]
        return {"hex": writer.data.hex(), "rows": rows}


@lru_cache(maxsize=10_000)
def _pieces(line: str) -> list[tuple[str, str]]:
    if len(line) > MAX_COLOURED:  # the grammar is read in quadratic time
        return [(line, "")]
    return [(text, colours.style(scope)) for text, scope in colours.tokens(line)]


class Row(NamedTuple):
    """A value in the bytes; `start` and `end` count from the first byte, header included."""

    path: str
    type: str
    value: str
    start: int
    end: int
    error: str = ""


class Writer:
    """Writes the bytes of a message (language 8), with a row for each value."""

    def __init__(self, model: Model, values: dict[str, str]) -> None:
        self.data = bytearray(HEADER)
        self.rows: list[Row] = []
        self._model = model
        self._values = values

    def message(self, message: ir.Message, path: str, value: dict[str, object] | None) -> None:
        """Write a structure. Without a `value`, its fields have rows."""
        unknown = set(value or ()) - {field.name for field in message.fields}
        if unknown:
            raise ValueError(f"`{message.name}` has no field `{min(unknown)}`")
        for field in message.wire_fields:
            default = field.default.value if field.default else None
            if value is not None:
                self._write(field.type, value.get(field.name, default))
            elif isinstance(field.type, ir.Ref):
                self.message(self._model.messages[field.type.target], f"{path}{field.name}.", None)
            else:
                self._row(field, f"{path}{field.name}", default)

    def _row(self, field: ir.Field, path: str, default: object) -> None:
        """Write a value and its row; a wrong value has a row with the error, and the default."""
        before, error = bytes(self.data), ""
        text = self._values.get(path)
        value = default
        try:
            value = default if text is None else json.loads(text)
            self._write(field.type, value)
        except (ValueError, TypeError, OverflowError, RecursionError, struct.error) as problem:
            error = str(problem)
            self.data = bytearray(before)
            self._write(field.type, default)
        if text is None:
            text = json.dumps(self._complete(field.type, default))
        start = len(before) + self._padding(field.type, len(before))
        self.rows.append(Row(path, ir.spell(field.type), text, start, len(self.data), error))

    def _complete(self, type_: ir.FieldType, value: object) -> object:
        """Return a value to begin with: a default, or zeros."""
        if value is not None:
            return value
        match type_:
            case ir.Primitive():
                return False if type_.name == "bool" else 0.0 if "float" in type_.name else 0
            case ir.String():
                return ""
            case ir.Array() if not isinstance(type_.element, ir.Ref):
                return [self._complete(type_.element, None)] * type_.size
            case ir.Array():
                return [{}] * type_.size
        return []

    def _padding(self, type_: ir.FieldType, at: int) -> int:
        """Return the bytes between an offset and the first value of a type."""
        match type_:
            case ir.Primitive():
                return -(at - len(HEADER)) % type_.info.size
            case ir.Array():
                return self._padding(type_.element, at)
            case ir.Ref():
                first = self._model.messages[type_.target].wire_fields[0]
                return self._padding(first.type, at)
        return -(at - len(HEADER)) % 4

    def _align(self, type_: ir.FieldType) -> None:
        self.data += bytes(self._padding(type_, len(self.data)))
        if len(self.data) > MAX_BYTES:
            raise ValueError("the message is too long to show")

    def _write(self, type_: ir.FieldType, value: object) -> None:
        match type_:
            case ir.Primitive():
                self._align(type_)
                self.data += packed(type_, self._complete(type_, value))
            case ir.String():
                self._align(type_)
                self.data += text_bytes(type_, self._complete(type_, value))
            case ir.Ref():
                if value is not None and not isinstance(value, dict):
                    raise TypeError(f"`{type_.target.name}` is an object, such as {{}}")
                self.message(self._model.messages[type_.target], "", value or {})
            case ir.Array() | ir.Sequence():
                items = self._complete(type_, value)
                if not isinstance(items, (list, tuple)):
                    raise TypeError("expected a list, such as []")
                self._check_length(type_, len(items))
                if isinstance(type_, ir.Sequence):
                    self._write(ir.Primitive("uint32"), len(items))
                for item in items:
                    self._write(type_.element, item)

    def _check_length(self, type_: ir.Array | ir.Sequence, length: int) -> None:
        if isinstance(type_, ir.Array) and length != type_.size:
            raise ValueError(f"expected {type_.size} elements")
        if isinstance(type_, ir.Sequence) and type_.bound is not None and length > type_.bound:
            raise ValueError(f"expected at most {type_.bound} elements")


def packed(type_: ir.Primitive, value: object) -> bytes:
    """Return a number's bytes; raises TypeError or ValueError for another value."""
    info = type_.info
    if info.code == "?":
        if not isinstance(value, bool):
            raise TypeError("expected true or false")
    elif isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError("expected a number")
    elif info.low is not None and info.high is not None:
        if not isinstance(value, int) or not info.low <= value <= info.high:
            raise ValueError(f"expected an integer from {info.low} to {info.high}")
    elif info.code == "f" and math.isfinite(value) and abs(value) > 3.4028235677973366e38:
        raise ValueError("too large for float32")
    return struct.pack(f"<{info.code}", value)


def text_bytes(type_: ir.String, value: object) -> bytes:
    """Return a string's bytes; raises TypeError or ValueError for another value."""
    if not isinstance(value, str):
        raise TypeError("expected a string in quotation marks")
    if type_.bound is not None and len(value) > type_.bound:
        raise ValueError(f"expected at most {type_.bound} characters")
    if type_.wide:
        data = value.encode("utf-32-le")
        return struct.pack("<I", len(data) // 4) + data
    if "\0" in value:
        raise ValueError("a string cannot contain a zero")
    data = value.encode()
    return struct.pack("<I", len(data) + 1) + data + b"\0"
