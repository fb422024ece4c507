"""Messages as words of a command line, and as text."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import click
import msgspec

from idlc.diagnostics.text import one_line
from idlc.runtime.names import ValidationError

#: The line after each YAML document.
BETWEEN = "---\n"


def message_of(kind: Any, words: Sequence[str]) -> Any:
    """Return a message of a class with fields from words such as `pose.x=1.5`."""
    values, paths = kind().to_dict(), set[str]()
    names = ", ".join(values) or "none"
    for word in words:
        path, equals, text = word.partition("=")
        if not equals or path in paths:
            problem = "is set twice" if equals else "is not a value"
            raise click.UsageError(f"`{one_line(path)}` {problem}; write `FIELD=VALUE` once")
        paths.add(path)
        *parents, last = path.split(".")
        place = _fields_in(values, parents)
        place[last] = text if isinstance(place.get(last), str) else _value(text)
    try:
        return kind.from_dict(values)
    except (ValidationError, TypeError, OverflowError) as error:
        hint = "" if "; " in str(error) else f"; the fields are {names}"
        raise click.UsageError(f"{one_line(str(error))}{hint}") from None


def _fields_in(values: dict[str, Any], parents: Sequence[str]) -> dict[str, Any]:
    """Return the values in a field of a field; for an unknown field, they are new and empty."""
    for parent in parents:
        if not isinstance(values.get(parent), dict):
            values[parent] = {}
        values = values[parent]
    return values


def _value(text: str) -> Any:
    """Return the value in JSON, or else the text, which its field refuses."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def field_words(kind: Any, word: str) -> list[str]:
    """Return the words that a word begins, up to the value or the next field."""
    before, dot, last = word.rpartition(".")
    fields = _fields_in(kind().to_dict(), before.split(".") if dot else ())
    return [
        f"{before}{dot}{name}{'.' if isinstance(value, dict) else '='}"
        for name, value in fields.items()
        if name.startswith(last)
    ]


def fields_of(kind: Any, paths: Sequence[str]) -> Callable[[bytes], dict[str, Any]]:
    """Return a function that reads fields of a message as `to_dict` has them; absent ones are None.

    Raises ValueError for paths that the class does not have.
    """
    from idlc.api.reader import Absent, field_reader, reader

    reader(kind, *paths)  # which names all that are wrong
    readers = {path: field_reader(kind, (path,), False, True) for path in paths}

    def read(buffer: bytes) -> dict[str, Any]:
        values: dict[str, Any] = dict.fromkeys(readers)
        for path, read_field in readers.items():
            with suppress(Absent):
                values[path] = _plain(read_field(buffer))
        return values

    return read


def _plain(value: Any) -> Any:
    """Return a value as `to_dict` has it."""
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, list):
        return [_plain(element) for element in value]
    if isinstance(value, bytes):
        return value[0]
    return value.tolist() if hasattr(value, "tolist") else value


def texts(style: str, messages: Iterable[dict[str, Any]]) -> Iterator[str]:
    """Yield messages, as dictionaries, as YAML documents, JSON lines or CSV rows."""
    import yaml

    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    options = {"sort_keys": False, "default_flow_style": None, "allow_unicode": True, "width": 100}
    for number, values in enumerate(messages):
        if style == "json":
            yield f"{_json(values)}\n"
        elif style == "yaml":
            yield yaml.dump(values, Dumper=dumper, **options) + BETWEEN
        else:
            cells = dict(_cells(values, ""))
            rows = io.StringIO()
            head = [] if number else [cells.keys()]
            csv.writer(rows, lineterminator="\n").writerows((*head, cells.values()))
            yield rows.getvalue()


def _json(values: Any) -> str:
    """Return values as JSON, in which numbers that are not finite are null."""
    return json.dumps(msgspec.json.decode(msgspec.json.encode(values)))


def _cells(values: dict[str, Any], before: str) -> Iterator[tuple[str, Any]]:
    """Yield names and values of columns: a nested message has several, a list is JSON."""
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _cells(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", _json(value) if isinstance(value, list) else value
