"""Messages as words of a command line, and as text."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import secrets
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, partial
from typing import Any

import click
import msgspec

from idlc.api.reader import Absent, field_reader, reader
from idlc.diagnostics.ci import Form, silenced
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


def fields_of(
    kind: Any, paths: Sequence[str], complain: Callable[[str], object]
) -> Callable[[bytes], dict[str, Any]]:
    """Return a function that reads fields of a message as `to_dict` has them; absent ones are None.

    `complain` is called if the first message has no element of a name, such as `position.elbow`.
    Raises ValueError for paths that the class does not have.
    """
    elements: dict[str, Any] = {}
    try:
        reader(kind, *paths)  # which names all that are wrong
    except ValueError as error:
        try:
            from idlc.api.conditions import ElementReader, named_element
        except ModuleNotFoundError:  # numpy
            raise error from None
        named = {path: named_element(kind, path) for path in paths}
        elements = {path: ElementReader(kind, each) for path, each in named.items() if each}
        if fields := [path for path in paths if path not in elements]:
            reader(kind, *fields)
    readers = {
        path: elements.get(path) or field_reader(kind, (path,), False, True) for path in paths
    }

    def read(buffer: bytes) -> dict[str, Any]:
        values: dict[str, Any] = dict.fromkeys(readers)
        for path, read_field in readers.items():
            try:
                values[path] = _plain(read_field(buffer))
            except Absent:
                element = elements.get(path)
                if element and element.others and element.lacking == 1:
                    complain(element.element.missing(element.others, "this message"))
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


def texts(
    style: str, messages: Iterable[dict[str, Any]], *, is_brief: bool = False
) -> Iterator[str]:
    """Yield messages, as dictionaries, as YAML documents, JSON lines or CSV rows.

    If `is_brief`, YAML shows only the first elements of a long array.
    """
    for number, values in enumerate(messages):
        if style == "json":
            yield f"{_json(values)}\n"
        elif style == "yaml":
            yield _yaml(_shortened(values) if is_brief else values) + BETWEEN
        else:
            cells = dict(_cells(values, ""))
            rows = io.StringIO()
            head = [] if number else [cells.keys()]
            csv.writer(rows, lineterminator="\n").writerows((*head, cells.values()))
            yield rows.getvalue()


#: Arrays of more elements are shortened on a terminal, and written without the YAML library.
_LONG = 32
#: Texts that readers of YAML 1.2 take for numbers, while PyYAML reads and writes YAML 1.1.
_NUMBER = re.compile(r"[-+]?(\.\d+|\d+(\.\d*)?)([eE][-+]?\d+)?|0o[0-7]+|0x[\dA-Fa-f]+")


def _shortened(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _shortened(part) for name, part in value.items()}
    if not isinstance(value, list):
        return value
    shown = [_shortened(part) for part in value[: _LONG // 2 if len(value) > _LONG else None]]
    return [*shown, f"... {len(value)} in all"] if len(value) > _LONG else shown


#: Stands for a long array in a document; nobody who writes a message knows it.
_MARK = f"array{secrets.token_hex(8)}x"


def _yaml(values: Any) -> str:
    """Return a YAML document; text that is not plainly visible is quoted, with escapes.

    PyYAML takes seconds and much memory for an image, so it writes a mark for each long array of
    numbers, and the numbers replace the mark afterwards.
    """
    import yaml

    arrays: list[str] = []
    options = {"sort_keys": False, "default_flow_style": None, "allow_unicode": True}

    def dumped(width: int) -> str:
        arrays.clear()
        text = yaml.dump(values, Dumper=partial(_dumper(), arrays), width=width, **options)
        return "\n".join(map(_escaped, text.split("\n")))

    text = dumped(100)
    if silenced(text, Form.COMMANDS) != silenced(text):  # a line begins within a value
        text = dumped(1 << 30)
    return re.sub(rf"{_MARK}(\d+)x", lambda match: arrays[int(match[1])], text)


@cache
def _dumper() -> Any:
    """Return the class that writes documents, and long arrays of numbers into a list."""
    import yaml

    class Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
        def __init__(self, arrays: list[str], *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            self.arrays = arrays

        def represent_text(self, text: str) -> Any:
            is_odd = one_line(text) != text or silenced(text) != text
            style = "'" if _NUMBER.fullmatch(text) else None
            style = '"' if is_odd else style
            return self.represent_scalar("tag:yaml.org,2002:str", text, style=style)

        def represent_array(self, array: list[Any]) -> Any:
            if len(array) <= _LONG or not {*map(type, array)} <= {int, float}:
                return self.represent_list(array)
            plain = repr(array)
            is_plain = "e" not in plain and "n" not in plain
            self.arrays.append(plain if is_plain else f"[{', '.join(map(_number, array))}]")
            return self.represent_text(f"{_MARK}{len(self.arrays) - 1}x")

    Dumper.add_representer(str, Dumper.represent_text)
    Dumper.add_representer(list, Dumper.represent_array)
    return Dumper


def _escaped(line: str) -> str:
    """Return a line with hidden characters as escapes; they are in quoted text only."""
    if one_line(line) == line:
        return line
    return "".join(each if one_line(each) == each else f"\\U{ord(each):08x}" for each in line)


def _number(value: float) -> str:
    """Return a number in YAML, where a number with an exponent has a point."""
    if isinstance(value, float) and not math.isfinite(value):
        return {"nan": ".nan", "inf": ".inf", "-inf": "-.inf"}[repr(value)]
    text = repr(value)
    return text.replace("e", ".0e") if "." not in text else text


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
