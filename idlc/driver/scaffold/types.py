"""The interfaces that the endpoints of a node name."""

from __future__ import annotations

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.suggest import did_you_mean
from idlc.disk.library import Library
from idlc.driver.scaffold.changes import Settings, find_package, library_around
from idlc.model import ir
from idlc.scaffold.roles import ROLES
from idlc.scaffold.roles.role import Endpoint, Role


def check(role: Role, type_: str, settings: Settings) -> None:
    """Raise ValueError if there is no such interface for the package of the working folder."""
    report = Report()
    found = find_package(settings, report)
    if found is None or role.kind is None:
        return  # which is said when the node is written
    library = library_around(found[1], found[0], settings, report)
    type_name(Endpoint(role, type_, ""), found[1], library, report)
    for problem in report:
        raise ValueError("; ".join(filter(None, (problem.message, problem.hint))))


def type_name(endpoint: Endpoint, own: str, library: Library, report: Report) -> ir.TypeName | None:
    """Return the interface that `Name`, `package/Name` or `package/kind/Name` means here."""
    kind = endpoint.role.kind
    if kind is None:
        return None
    parts = endpoint.type.split("/")
    name = ir.TypeName(parts[0] if len(parts) > 1 else own, kind, parts[-1])
    fits = len(parts) <= 2 or (len(parts) == 3 and parts[1] == kind)
    if fits and library.source(name) is not None:
        return name
    message = f"no such {_ARTICLES[kind]}: `{endpoint.type}`"
    report.add(codes.NO_SUCH_TYPE.of("", message, hint=_hint(name, own, library)))
    return None


_ARTICLES: dict[ir.Kind, str] = {"msg": "message", "srv": "service", "action": "action"}


def _hint(name: ir.TypeName, own: str, library: Library) -> str | None:
    """Return what may have been meant by an interface that there is not."""
    for kind, what in _ARTICLES.items():
        if kind != name.kind and library.source(name._replace(kind=kind)) is not None:
            options = " or ".join(role.option for role in ROLES if role.kind == kind)
            return f"it is {'an' if what == 'action' else 'a'} {what}: use {options}"
    if name.package == own:
        elsewhere = [
            f"`{package}/{name.name}`"
            for package in library.packages()
            if ir.TypeName(package, name.kind, name.name) in library.interfaces(package)
        ]
        if elsewhere:
            return f"did you mean {' or '.join(elsewhere)}?"
    known = [str(one) for one in library.interfaces(name.package) if one.kind == name.kind]
    hint = did_you_mean(str(name), known)
    if name.package == own:
        return hint or f"write it with `idlc scaffold interface {name.kind} {name.name} FIELD...`"
    if hint or name.package in library.packages():
        return hint
    near = did_you_mean(name.package, library.packages())
    return near or f"there is no package `{name.package}` here: name its folder with -I"
