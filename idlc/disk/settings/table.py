"""A table of settings → a Struct, and where in the file what is wrong with it stands.

The Struct is all that there is to say about a table: a field's type decides what is accepted, its
`title` is what it must be, and its `description`, if it is required, what it is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, TypeVar, get_args

import msgspec
from msgspec import Meta

from idlc.diagnostics.codes import BAD_CONFIG
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.suggest import did_you_mean

Text = Annotated[str, Meta(title="a string")]
Texts = Annotated[tuple[str, ...], Meta(title="a list of strings")]
TextOrTexts = Annotated[str | tuple[str, ...], Meta(title="a string or a list of strings")]
Switch = Annotated[bool, Meta(title="true or false")]
Table = Annotated[dict[str, Any], Meta(title="a table")]
Tables = Annotated[tuple[dict[str, Any], ...], Meta(title="a list of tables")]

_Shape = TypeVar("_Shape", bound=msgspec.Struct)


class Place(NamedTuple):
    """A table of a file: its name, how messages call it, and its number among those of one name."""

    source: Source
    table: str
    shown: str
    number: int = 0

    def wrong(self, key: str, message: str, report: Report, hint: str | None = None) -> None:
        """Report what is wrong with a setting, where it stands."""
        span = self._span(key)
        report.add(
            BAD_CONFIG.of(self.source.path, message, hint=hint)
            if span is None
            else BAD_CONFIG.at(span, message, hint=hint)
        )

    def no_url(self, key: str, value: str, report: Report) -> None:
        """Report a URL: what a file of somebody else names is not fetched."""
        if "://" in value:
            message = f"`{key}` in {self.shown} is a URL"
            self.wrong(key, message, report, "URLs are opened if they are typed")

    def _span(self, key: str) -> Span | None:
        """Return where a key of the table stands, else the table's header, else any such key."""
        text = self.source.text
        name = r"[ \t]*\.[ \t]*".join(map(re.escape, self.table.split(".")))
        headers = [*re.finditer(rf"(?m)^[ \t]*\[+[ \t]*({name})[ \t]*\]", text)]
        if self.number < len(headers):
            header = headers[self.number]
            after = re.compile(r"(?m)^[ \t]*\[").search(text, header.end())
            found = _key(key).search(text, header.end(), after.start() if after else len(text))
            return Span(self.source, *(found or header).span(1))
        found = _key(key).search(text)
        return Span(self.source, *found.span(1)) if found else None


def _key(name: str) -> re.Pattern[str]:
    return re.compile(rf"(?m)(?:^|[{{,])[ \t]*(?:[\w-]+\.)*[\"']?({re.escape(name)})[\"']?[ \t]*=")


def read_table(
    table: Mapping[str, Any], shape: type[_Shape], place: Place, report: Report
) -> _Shape | None:
    """Return a table as a Struct; what is wrong is reported and left out.

    `None` means that something without a default is missing.
    """
    fields = {field.encode_name: field for field in msgspec.structs.fields(shape)}
    found: dict[str, Any] = {}
    for key, value in table.items():
        if key not in fields:
            listed = ", ".join(f"`{known}`" for known in fields)
            hint = did_you_mean(key, fields) or f"the settings are {listed}"
            place.wrong(key, f"unknown setting `{key}` in {place.shown}", report, hint)
            continue
        read = read_value(value, fields[key].type, key, place, report)
        if read is not None:
            found[fields[key].name] = read
    missing = [key for key, field in fields.items() if field.required and key not in table]
    for key in missing:
        what = _meta(fields[key].type).description
        place.wrong(key, f"{place.shown} needs `{key}`, {what}", report)
    required = {field.name for field in fields.values() if field.required}
    return shape(**found) if required <= found.keys() else None


def read_value(value: object, type_: Any, key: str, place: Place, report: Report) -> Any:
    """Return a value as one of the types above; report one that is of another, return `None`."""
    try:
        return msgspec.convert(value, type_)
    except msgspec.ValidationError:
        what = _meta(type_).title
        place.wrong(key, f"`{key}` in {place.shown} must be {what}", report)
        return None


def _meta(type_: Any) -> Meta:
    return next(one for one in get_args(type_) if isinstance(one, Meta))
