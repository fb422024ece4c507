"""Types and packages by the names that people give them, and what there is around here."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, first_few
from idlc.diagnostics.suggest import closest, did_you_mean
from idlc.disk.library import Library
from idlc.disk.packages import nearby
from idlc.disk.read import shown
from idlc.disk.scope import Scope
from idlc.model import ir

_DIVIDER = re.compile(r"/|\.|::")
_LISTED = 5


class Package(NamedTuple):
    """A package that is known here; `path` is `None` if it is built in."""

    name: str
    interfaces: int
    path: str | None


class Meant(NamedTuple):
    """A type that a text means, and the interface whose file defines it."""

    name: ir.TypeName
    interface: ir.TypeName


def packages(scope: Scope, report: Report) -> list[Package]:
    """Return all packages that are known here, those below the working folder included."""
    library = _wide(scope, report)
    return [_package(name, library) for name in library.packages()]


def _package(name: str, library: Library) -> Package:
    home = library.home(name)
    return Package(name, len(library.interfaces(name)), shown(home) if home else None)


def interfaces(wanted: Sequence[str], scope: Scope, report: Report) -> list[str]:
    """Return the names of all interfaces of packages; reports IDL618."""
    library = _wide(scope, report)
    found = []
    for package in wanted:
        names = [str(one) for one in library.interfaces(package)]
        if not names:
            hint = did_you_mean(package, library.packages()) or "`idlc list` names the packages"
            message = f"no package `{package}` is known here"
            report.add(codes.NO_SUCH_TYPE.of("", message, hint=hint))
        found += names
    return found


def _near(scope: Scope, report: Report) -> Library:
    return Library(scope.include, report, own=nearby.near(), distro=scope.distro)


def _wide(scope: Scope, report: Report) -> Library:
    own = {**nearby.below(), **nearby.near()}
    return Library(scope.include, report, own=own, distro=scope.distro)


def resolve(text: str, scope: Scope, report: Report) -> tuple[Library, tuple[Meant, ...]]:
    """Return the types that a text means, and where they are found; reports IDL618.

    `package/kind/Name`, `package/Name` and `Name` mean one type, also with dots or `::`, and
    `package` means all of its interfaces. Folders below are searched for what is not found else.
    """
    library = _near(scope, report)
    meant = _meant(text, library)
    if not meant:
        library = _wide(scope, Report())
        meant = _meant(text, library)
    if len(meant) == 1 or text in library.packages():
        return library, meant
    report.add(_several(text, meant) if meant else _nothing(text, library))
    return library, ()


def _meant(text: str, library: Library) -> tuple[Meant, ...]:
    """Return every type that a text may mean."""
    match _DIVIDER.split(text):
        case [package, kind, name]:
            places = [(package, one) for one in ir.KINDS if one == kind]
        case [package, name]:
            # as in interface files, it is a message if there is one
            if found := _found(ir.TypeName(package, "msg", name), library):
                return (found,)
            places = [(package, kind) for kind in ir.KINDS]
        case [package] if package in library.packages():
            return tuple(Meant(one, one) for one in library.interfaces(package))
        case [name]:
            places = [(package, kind) for package in library.packages() for kind in ir.KINDS]
        case _:
            return ()
    names = (ir.TypeName(package, kind, name) for package, kind in places)
    return tuple(found for one in names if (found := _found(one, library)))


def _found(name: ir.TypeName, library: Library) -> Meant | None:
    """Return a type and its interface, which for a derived type has a shorter name."""
    interface = name
    while library.source(interface) is None:
        shorter, _, rest = interface.name.rpartition("_")
        if not shorter or not rest or name.kind == "msg":
            return None
        interface = interface._replace(name=shorter)
    return Meant(name, interface)


def _several(text: str, meant: Sequence[Meant]) -> Diagnostic:
    names = first_few((f"`{one.name}`" for one in meant), _LISTED)
    message = f"`{text}` may be {len(meant)} types"
    return codes.NO_SUCH_TYPE.of("", message, hint=f"name one of {names}")


def _nothing(text: str, library: Library) -> Diagnostic:
    if not _DIVIDER.search(text):
        message = f"`{text}` is no file or folder, and no type or package that is known here"
    else:
        message = f"no such type: `{text}`"
    hint = _similar(_DIVIDER.split(text), library) or "`idlc list` shows what is known here"
    return codes.NO_SUCH_TYPE.of("", message, hint=hint)


def _similar(parts: Sequence[str], library: Library) -> str | None:
    """Return the hint that names what is nearest to a type's or package's name."""
    if len(parts) == 1:
        named = {one.name: str(one) for one in _all(library)}
        near = closest(parts[0], [*nearby.names(), *named, *library.packages()])
        return f"did you mean `{named.get(near, near)}`?" if near else None
    package = closest(parts[0], library.packages()) or ""
    named = {one.name: str(one) for one in library.interfaces(package)}
    if package == parts[0]:
        near = closest(parts[-1], named)
        return (
            f"did you mean `{named[near]}`?" if near else f"`idlc list {package}` names its types"
        )
    if parts[-1] in named:
        return f"did you mean `{named[parts[-1]]}`?"
    return f"package `{parts[0]}` is not known: point -I to it, or source its workspace"


def _all(library: Library) -> Iterator[ir.TypeName]:
    for package in library.packages():
        yield from library.interfaces(package)
