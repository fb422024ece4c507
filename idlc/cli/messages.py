"""Messages as words of a command line, and as text."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import click
import msgspec

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


def texts(style: str, messages: Iterable[Any]) -> Iterator[str]:
    """Yield messages as YAML documents, JSON lines or CSV rows."""
    for number, message in enumerate(messages):
        values = message.to_dict()
        if style == "json":
            yield f"{_json(values)}\n"
        elif style == "yaml":
            yield _yaml(values) + BETWEEN
        else:
            cells = dict(_cells(values, ""))
            rows = io.StringIO()
            head = [] if number else [cells.keys()]
            csv.writer(rows, lineterminator="\n").writerows((*head, cells.values()))
            yield rows.getvalue()


#: Text that some readers of YAML take for a number.
_NUMBER = re.compile(
    r"[-+]?(?:0o[0-7]+|0x[0-9a-fA-F]+|(?:\.[0-9]+|[0-9]+\.?[0-9]*)(?:[eE][-+]?[0-9]+)?)"
)


def _yaml(values: Any) -> str:
    """Return a YAML document; text that is not plainly visible is quoted, with escapes."""
    import yaml

    base: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)

    class Dumper(base):  # type: ignore[misc]
        pass

    def represent(dumper: Any, text: str) -> Any:
        is_odd = one_line(text) != text or silenced(text) != text
        style = "'" if _NUMBER.fullmatch(text) else None
        style = '"' if is_odd else style
        return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)

    Dumper.add_representer(str, represent)
    options = {"sort_keys": False, "default_flow_style": None, "allow_unicode": True}
    text = yaml.dump(values, Dumper=Dumper, width=100, **options)
    if silenced(text, Form.COMMANDS) != silenced(text):  # a line begins within a value
        text = yaml.dump(values, Dumper=Dumper, width=1 << 30, **options)
    return "\n".join(map(_escaped, text.split("\n")))


def _escaped(line: str) -> str:
    """Return a line with hidden characters as escapes; they are in quoted text only."""
    if one_line(line) == line:
        return line
    return "".join(each if one_line(each) == each else f"\\U{ord(each):08x}" for each in line)


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
