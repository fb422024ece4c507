"""`[tool.idlc]` of the nearest pyproject.toml: defaults for options of the command line.

Paths in it are relative to the file's folder. A mistake is reported as IDL611.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, get_args

import msgspec
from msgspec import Meta

from idlc.diagnostics import codes
from idlc.diagnostics.codes import BAD_CONFIG
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import did_you_mean
from idlc.model.distros import BY_NAME, DEFAULT, Distro, split_names, unknown_distro
from idlc.project.files import decode
from idlc.project.find import Exclusions, exclusion
from idlc.project.lock import Runtime, Vendoring
from idlc.project.prefixes import distribution
from idlc.project.root import Root

TextValue = Annotated[str, Meta(title="a string")]
TextsValue = Annotated[tuple[str, ...], Meta(title="a list of strings")]
TextOrTextsValue = Annotated[str | tuple[str, ...], Meta(title="a string or a list of strings")]
Mode = Annotated[Runtime | None, Meta(title='"carried" or "installed"')]
Switch = Annotated[bool, Meta(title="true or false")]
SwitchOrBeside = Annotated[bool | Literal["beside"], Meta(title='true, false or "beside"')]
TableValue = Annotated[dict[str, Any], Meta(title="a table")]
TablesValue = Annotated[tuple[dict[str, Any], ...], Meta(title="a list of tables")]

_Shape = TypeVar("_Shape", bound=msgspec.Struct)


class TableLocation(NamedTuple):
    """The location of a table: file, name, name in messages, number among tables of the name."""

    source: Source
    table: str
    shown: str
    number: int = 0

    def wrong(self, key: str, message: str, report: Report, hint: str | None = None) -> None:
        """Report a problem with a setting, at its location in the file."""
        if span := self._span(key):
            report.add(BAD_CONFIG.at(span, message, hint=hint))
        else:
            report.add(BAD_CONFIG.of(self.source.path, message, hint=hint))

    def no_url(self, key: str, value: str, report: Report) -> None:
        """Report a URL: files, which others may have written, do not cause downloads."""
        if "://" in value:
            message = f"`{key}` in {self.shown} is a URL"
            self.wrong(
                key, message, report, "idlc opens a URL only if you pass it on the command line"
            )

    def _span(self, key: str) -> Span | None:
        """Return the span of a key of the table, else of its header, else of any such key."""
        text = self.source.text
        name = r"[ \t]*\.[ \t]*".join(map(re.escape, self.table.split(".")))
        headers = [*re.finditer(rf"(?m)^[ \t]*\[+[ \t]*({name})[ \t]*\]", text)]
        if self.number < len(headers):
            header = headers[self.number]
            after = re.compile(r"(?m)^[ \t]*\[").search(text, header.end())
            match = _key(key).search(text, header.end(), after.start() if after else len(text))
            return Span(self.source, *(match or header).span(1))
        match = _key(key).search(text)
        return Span(self.source, *match.span(1)) if match else None


def _key(name: str) -> re.Pattern[str]:
    return re.compile(rf"(?m)(?:^|[{{,])[ \t]*(?:[\w-]+\.)*[\"']?({re.escape(name)})[\"']?[ \t]*=")


def read_table(
    table: Mapping[str, Any], shape: type[_Shape], place: TableLocation, report: Report
) -> _Shape | None:
    """Return a table as a Struct; invalid settings are reported and left out.

    `None` means that a setting without a default is missing.
    """
    fields = {field.encode_name: field for field in msgspec.structs.fields(shape)}
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key not in fields:
            listed = ", ".join(f"`{name}`" for name in fields)
            hint = did_you_mean(key, fields) or f"the settings are {listed}"
            place.wrong(key, f"unknown setting `{key}` in {place.shown}", report, hint)
            continue
        read = read_value(value, fields[key].type, key, place, report)
        if read is not None:
            values[fields[key].name] = read
    for key, field in fields.items():
        if field.required and key not in table:
            what = _meta(field.type).description
            place.wrong(key, f"{place.shown} needs `{key}`, {what}", report)
    required = {field.name for field in fields.values() if field.required}
    return shape(**values) if required <= values.keys() else None


def read_value(value: object, type_: Any, key: str, place: TableLocation, report: Report) -> Any:
    """Return a value as one of the types above; report any other value and return `None`."""
    try:
        return msgspec.convert(value, type_)
    except msgspec.ValidationError:
        what = _meta(type_).title
        place.wrong(key, f"`{key}` in {place.shown} must be {what}", report)
        return None


def _meta(type_: Any) -> Meta:
    return next(argument for argument in get_args(type_) if isinstance(argument, Meta))


SETTINGS_FILE = "pyproject.toml"
#: The square of the dots in each line, added up, from which on reading takes a second.
_COSTLY = 10_000_000


class Settings(msgspec.Struct, frozen=True, rename="kebab"):
    """`[tool.idlc]` as written in the file; `command_table` reads the tables of commands."""

    paths: TextsValue = ()
    include: TextsValue = ()
    exclude: TextsValue = ()
    out: TextValue = ""
    package: TextValue = ""
    runtime: Mode = None
    vendor_deps: SwitchOrBeside = False
    enums: Switch = False
    distro: TextOrTextsValue = ()
    breaking: TableValue = {}
    check: TableValue = {}


class Config(Settings, frozen=True, kw_only=True):
    """The settings for the base of `root`, to which paths are relative; absent ones are empty.

    `source` is the file, `folder` the file's folder, to which `exclude` is relative.
    """

    root: Root
    distro: tuple[str, ...] = ()
    source: Source | None = None
    folder: Path | None = None

    @property
    def vendoring(self) -> Vendoring:
        """The place of other packages' types that `vendor_deps` asks for."""
        if self.vendor_deps == "beside":
            return "beside"
        return "private" if self.vendor_deps else ""


def load_settings(root: Root, report: Report) -> Config:
    """Return the settings for the base of a root."""
    for folder in (root.base, *root.base.parents):
        path = folder / SETTINGS_FILE
        if root.is_file(path):
            return _read(path, root, report)
    return Config(root=root)


def settings_here() -> tuple[Config, Report]:
    """Return the settings for the working folder, and a new report with what is wrong in them."""
    report = Report()
    return load_settings(Root.here(), report), report


def _read(path: Path, root: Root, report: Report) -> Config:
    name = root.shown(path)
    data = root.read_bytes(path, name, report)
    source = decode(data, name, report) if data is not None and b"idlc" in data else None
    if source is None:
        return Config(root=root)
    try:
        document = toml(source.text)
    except ValueError as error:
        report.add(broken_toml(source, str(error)))
        return Config(root=root)
    tool = document.get("tool", {})
    table = tool.get("idlc", {}) if isinstance(tool, dict) else {}
    place = TableLocation(source, "tool.idlc", "[tool.idlc]")
    if not isinstance(table, dict):
        place.wrong("idlc", "`tool.idlc` must be a table", report)
        return Config(root=root)
    settings = read_table(table, Settings, place, report)
    assert settings is not None
    for url in settings.paths:
        place.no_url("paths", url, report)
    wanted = settings.distro
    distros = split_names(wanted) if isinstance(wanted, str) else wanted
    for name in distros:
        if name and name not in BY_NAME:
            message = f"`distro` in {place.shown} contains `{name}`, which is not a distribution"
            place.wrong("distro", message, report, unknown_distro(name))
    folder = path.parent
    values = {
        **msgspec.structs.asdict(settings),
        "paths": tuple(_typed(folder, each, root) for each in settings.paths),
        "out": settings.out and _typed(folder, settings.out, root),
        "include": tuple(_typed(folder, each, root) for each in settings.include),
        "distro": tuple(name for name in distros if name in BY_NAME),
    }
    return Config(root=root, source=source, folder=folder, **values)


def toml(text: str) -> dict[str, Any]:
    """Return a TOML document; raises ValueError for one that is not valid, or would take long."""
    # reading takes time by the square of the parts of a key
    if sum(line.count(".") ** 2 for line in text.splitlines()) > _COSTLY:
        raise ValueError("a line has too many dots")
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    try:
        document: dict[str, Any] = tomllib.loads(text)
    except RecursionError:
        raise ValueError("this is nested too deeply") from None
    return document


def broken_toml(source: Source, message: str) -> Diagnostic:
    """Return the problem with a file that is not valid TOML, with the parser's message."""
    text, _, place = message.partition(" (at ")
    if not place:
        return codes.BAD_CONFIG.at(Span(source, 0, len(source.text)), message)
    numbers = [int(number) for number in re.findall(r"\d+", place)]
    start = len(source.text)
    if len(numbers) == 2 and numbers[0] <= len(source.line_starts):
        start = source.line_starts[numbers[0] - 1] + numbers[1] - 1
    span = Span(source, start, start + 1)
    is_marked = source.text.startswith("\ufeff")
    hint = "save the file as UTF-8 without a byte order mark" if is_marked else None
    return codes.BAD_CONFIG.at(span, f"not valid TOML: {text[:1].lower()}{text[1:]}", hint=hint)


def _typed(folder: Path, path: str, root: Root) -> str:
    """Return a path in the file relative to the base."""
    whole = folder / path
    try:
        return Path(root.relative(whole)).as_posix() if folder != root.base else path
    except ValueError:
        return whole.as_posix()


def command_table(
    config: Config, name: Literal["breaking", "check"], shape: type[_Shape], report: Report
) -> tuple[_Shape, TableLocation | None]:
    """Return the table of a command and its place, without one where there is no file."""
    if config.source is None:
        return shape(), None
    place = TableLocation(config.source, f"tool.idlc.{name}", f"[tool.idlc.{name}]")
    table = read_table(getattr(config, name), shape, place, report)
    assert table is not None
    return table, place


class Scope(msgspec.Struct, frozen=True):
    """Options of a lookup: the package's name if set, folders with other packages, exclusions.

    Paths are relative to `root`. `typed` are the folders of `include` that the command line
    named, not the settings. `out` is the folder that [tool.idlc] compiles `paths` into; its
    name may be the package's. `distros` are the distributions of ROS 2 that files are read for, one
    except for `check`; none means the one that is installed. With `enums`, generated classes have
    enums for all fields whose names constants begin with.
    """

    root: Root
    package: str | None = None
    include: tuple[str, ...] = ()
    exclude: Exclusions = Exclusions()
    paths: tuple[str, ...] = ()
    out: str | None = None
    enums: bool = False
    distros: tuple[Distro, ...] = ()
    typed: tuple[str, ...] = ()

    @property
    def distro(self) -> Distro:
        """The distribution that files are read for where that is one."""
        return self.distros[0] if self.distros else BY_NAME.get(distribution().name, DEFAULT)

    @property
    def typed_outside(self) -> tuple[str, ...]:
        """The folders outside of the base that the command line named."""
        root = self.root
        return tuple(
            path for path in self.typed if not root.absolute(path).is_relative_to(root.base)
        )


def scope(
    settings: Config,
    package: str | None = None,
    include: Sequence[str] = (),
    exclude: Sequence[str] = (),
    distro: str | None = None,
) -> Scope:
    """Combine options of the command line with settings; `distro` is a list with commas."""
    left_out = exclusion(exclude, settings.root.base).parts if exclude else ()
    if settings.exclude and settings.folder is not None:
        left_out += exclusion(settings.exclude, settings.folder).parts
    names = split_names(distro) if distro else settings.distro
    return Scope(
        settings.root,
        package or settings.package or None,
        (*include, *settings.include),
        Exclusions(left_out),
        settings.paths,
        settings.out or None,
        settings.enums,
        tuple(dict.fromkeys(BY_NAME[name] for name in names)),
        tuple(include),
    )
