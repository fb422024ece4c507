"""The pipeline of `idlc check --prefix`: whether C++ tools can load what they find installed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from idlc.check.compiler import models_of, stage
from idlc.check.run import Checked
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.generate.native.inspect import Inspected, inspect
from idlc.generate.native.layouts import LAYOUTS
from idlc.generate.native.library import FIELDS_CPP, MACHINES, OWN, hash_bytes, symbol, told
from idlc.model import derive
from idlc.project import inputs
from idlc.project.find import look
from idlc.project.prefixes import (
    INDEX,
    InstalledPackage,
    ament_prefixes,
    distribution,
    inconsistencies,
    installed_packages,
    prefixes,
)
from idlc.project.prefixes import machine as this_machine
from idlc.project.root import Root
from idlc.project.settings import Scope

if TYPE_CHECKING:
    from idlc.model.link import Model

_AGAIN = "build the package again, with idlc installed, or run `idlc gen SOURCES --ament PREFIX`"


def check_prefix(folder: str, root: Root, report: Report) -> Checked:
    """Report each package in a prefix, or in the prefixes in a folder, that stops recorders."""
    found = prefixes(root.absolute(folder))
    if not found:
        message = f"no packages are installed in `{folder}`: there is no share/ament_index"
        hint = "name the folder that is in AMENT_PREFIX_PATH, or colcon's `install`"
        report.add(codes.NO_SUCH_PATH.of(folder, message, hint=hint))
    for prefix in found:
        for package, why in inconsistencies(prefix):
            message = f"`{package}`, which is in ROS 2's index, {why}"
            place = root.shown(prefix / INDEX)
            report.add(codes.INCONSISTENT_INDEX.of(place, message, hint=_AGAIN))
    files = []
    for one in (one for prefix in found for one in installed_packages(prefix, root)):
        model = _model(one)
        for identifier in (OWN, FIELDS_CPP):
            name = f"lib{one.package}__{identifier}.so"
            files.append(one.library(name))
            with stage("check library", files[-1]):
                why = _problem(one, name, identifier, model)
            if why:
                message = f"`{name}` {why}: C++ tools fail at the types of `{one.package}`"
                report.add(codes.UNUSABLE_LIBRARY.of(files[-1], message, hint=_AGAIN))
    if found and not files and not len(report):
        message = f"no package with interfaces is registered in `{folder}`"
        hint = "build one with idlc, or name the prefix in which it is installed"
        report.add(codes.NO_SUCH_PATH.of(folder, message, hint=hint))
    return Checked(tuple(files), len(files))


def _model(one: InstalledPackage) -> Model | None:
    """Return what a package's installed interfaces mean; `None` where idlc cannot say."""
    dropped = Report()
    files = look((one.share,), one.root, dropped).files
    given = inputs.load(one.package, files, one.prefix / "share" / one.package, one.root, dropped)
    found = list(models_of((given,), Scope(one.root, include=(str(one.prefix),)), dropped))
    return None if dropped.had_errors or not files else found[0][1]


def _problem(one: InstalledPackage, name: str, identifier: str, model: Model | None) -> str:
    """Say what is wrong with a library, in words that follow its name; empty if nothing is."""
    data = one.content(name)
    if data is None:
        return "is missing" if identifier == OWN else ""
    library = inspect(data)
    if library is None:
        return "is no shared library, or a part of one"
    machine = MACHINES.get(this_machine())
    if machine is not None and library.machine != machine.number:
        return f"is for another processor than {this_machine()}"
    if model is None:
        return ""
    return next(_differences(one, data, library, identifier, model), "")


def _differences(
    one: InstalledPackage, data: bytes, library: Inspected, identifier: str, model: Model
) -> Iterator[str]:
    """Yield how a library is not what the installed interfaces make."""
    messages = [message for own in model.own for message in derive.messages(own)]
    missing = [
        str(message.name)
        for message in messages
        # older distributions have no events
        if symbol(identifier, message.name) not in library.symbols
        and (library.told is not None or not message.name.name.endswith("_Event"))
    ]
    if missing:
        names = first_few((f"`{name}`" for name in missing), 3)
        yield f"lacks {names}"
    if library.told is None:
        return
    stale = [
        str(message.name)
        for message in messages
        if hash_bytes(model.describer.hash(str(message.name))) not in data
    ]
    if stale:
        names = first_few((f"`{name}`" for name in stale), 3)
        yield f"is out of date: {names} changed since"
    here = distribution((one.prefix, *ament_prefixes()))
    layout = LAYOUTS.get(here.name)
    if layout is not None and library.told != told(layout):
        yield f"is for another distribution of ROS 2 than {here.name} ({here.why})"
