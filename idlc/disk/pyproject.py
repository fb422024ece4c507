"""`[tool.idlc]` of the nearest pyproject.toml: what would otherwise be typed each time.

Paths in it are relative to the file's folder. A mistake is reported as IDL611.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.suggest import did_you_mean
from idlc.disk.read import decode, is_file, read_bytes, shown

if TYPE_CHECKING:
    from idlc.diagnostics.report import Diagnostic, Report

FILE = "pyproject.toml"


class Config(msgspec.Struct, frozen=True):
    """The settings found; what is absent is empty or `None`. Paths are as one would type them.

    `tables` holds the tables of single commands, which are checked by `idlc.disk.command_settings`;
    `source` is the file, `folder` where it lies; `exclude` is relative to that.
    """

    paths: tuple[str, ...] = ()
    out: str | None = None
    package: str | None = None
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    vendor_deps: bool = False
    templates: str | None = None
    tables: Mapping[str, Mapping[str, Any]] = MappingProxyType({})
    source: Source | None = None
    folder: Path | None = None


_SHAPES = {
    "paths": "a list of strings",
    "include": "a list of strings",
    "exclude": "a list of strings",
    "out": "a string",
    "package": "a string",
    "vendor-deps": "true or false",
    "templates": "a string",
    "breaking": "a table",
    "check": "a table",
}


def load(report: Report) -> Config:
    """Return the settings that hold in the working folder."""
    for folder in (here := Path.cwd(), *here.parents):
        path = folder / FILE
        if is_file(path):
            return _read(path, report)
    return Config()


def _read(path: Path, report: Report) -> Config:
    name = shown(path)
    data = read_bytes(path, name, report)
    if data is None or b"idlc" not in data:
        return Config()
    source = decode(data, name, report)
    if source is None:
        return Config()
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    try:
        document: dict[str, Any] = tomllib.loads(source.text)
    except tomllib.TOMLDecodeError as error:
        report.add(_broken(source, str(error)))
        return Config()
    tool = document.get("tool", {})
    table = tool.get("idlc", {}) if isinstance(tool, dict) else {}
    return _checked(table, source, path.parent, report)


def _broken(source: Source, message: str) -> Diagnostic:
    text, _, place = message.partition(" (at ")
    numbers = [int(number) for number in re.findall(r"\d+", place)]
    if len(numbers) == 2 and numbers[0] <= len(source.line_starts):
        start = source.line_starts[numbers[0] - 1] + numbers[1] - 1
    else:
        start = len(source.text)
    return codes.BAD_CONFIG.at(
        Span(source, start, start + 1), f"not valid TOML: {text[:1].lower()}{text[1:]}"
    )


def _checked(table: object, source: Source, folder: Path, report: Report) -> Config:
    """Return the settings in a table; report each that is unknown or of the wrong type."""
    if not isinstance(table, dict):
        report.add(wrong(source, "idlc", "`tool.idlc` must be a table", None))
        return Config()
    found: dict[str, Any] = {}
    for key, value in table.items():
        if key not in _SHAPES:
            report.add(wrong(source, key, f"unknown setting `{key}` in [tool.idlc]", _close(key)))
        elif not _fits(value, _SHAPES[key]):
            report.add(wrong(source, key, f"`{key}` in [tool.idlc] must be {_SHAPES[key]}", None))
        else:
            found[key] = value
    return Config(
        paths=tuple(_typed(folder, path) for path in found.get("paths", ())),
        out=_typed(folder, found["out"]) if "out" in found else None,
        package=found.get("package"),
        include=tuple(_typed(folder, path) for path in found.get("include", ())),
        exclude=tuple(found.get("exclude", ())),
        vendor_deps=found.get("vendor-deps", False),
        templates=_typed(folder, found["templates"]) if "templates" in found else None,
        tables={key: value for key, value in found.items() if _SHAPES[key] == "a table"},
        source=source,
        folder=folder,
    )


def _fits(value: object, shape: str) -> bool:
    match shape:
        case "a list of strings":
            return isinstance(value, list) and all(isinstance(item, str) for item in value)
        case "a string":
            return isinstance(value, str)
        case "a table":
            return isinstance(value, dict)
        case _:
            return isinstance(value, bool)


def _close(key: str) -> str:
    settings = ", ".join(f"`{known}`" for known in _SHAPES)
    return did_you_mean(str(key), _SHAPES) or f"the settings are {settings}"


def _typed(folder: Path, path: str) -> str:
    """Return a path in the file as one would type it in the working folder."""
    whole = folder / path
    try:
        return Path(os.path.relpath(whole)).as_posix() if folder != Path.cwd() else path
    except ValueError:
        return whole.as_posix()


def wrong(source: Source, key: str, message: str, hint: str | None = None) -> Diagnostic:
    """Return the problem with a setting, at the place where it stands."""
    place = re.search(rf"(?m)^[ \t]*[\"']?({re.escape(key)})[\"']?[ \t]*=", source.text)
    if place is None:
        return codes.BAD_CONFIG.of(source.path, message, hint=hint)
    return codes.BAD_CONFIG.at(Span(source, *place.span(1)), message, hint=hint)
