"""What is installed for a package: its classes, and what ROS 2's tools look for in a prefix."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.disk.find import look, nothing_in
from idlc.disk.machine.distribution import Distribution
from idlc.disk.packages.enclosing import MANIFEST
from idlc.disk.packages.inputs import Inputs, packages
from idlc.disk.read import is_folder, read_bytes
from idlc.disk.scope import Scope, scope
from idlc.disk.settings import pyproject
from idlc.driver.generate.gen import GenOptions, gen
from idlc.driver.generate.libraries import libraries_of
from idlc.driver.generate.share import INTERFACES, shared
from idlc.driver.stages import models_of


class Content(NamedTuple):
    """The folder with the classes, and the files of the prefix by their paths in it.

    `native` is whether some are for one kind of processor.
    """

    classes: Path
    prefix: Mapping[str, bytes]
    native: bool


def compiled(
    name: str, classes: Path, distribution: Distribution | None, report: Report
) -> Content | None:
    """Compile the package in the working folder, its classes into a folder of their own.

    Returns `None` after a problem.
    """
    settings = scope(pyproject.load(report))
    where = msgspec.structs.replace(
        settings, package=None, include=(*settings.include, *_required_prefixes())
    )
    given = _package(name, where, report)
    if given is None:
        return None
    made = Report()
    gen(GenOptions(paths=(".",), out=str(classes), scope=where), made)
    # who builds a package need not be able to import it
    report.extend(one for one in made if one.code != codes.DEPENDENCY_NOT_IMPORTABLE.id)
    manifest = read_bytes(Path(MANIFEST), MANIFEST, report)
    if report.had_errors or manifest is None:
        return None
    ((_, model),) = models_of((given,), where, Report())
    libraries = libraries_of(model, distribution)
    files = shared(model, manifest, libraries, report)
    prefix = {
        path: text.encode() if isinstance(text, str) else text for path, text in files.items()
    }
    return Content(classes, prefix, bool(libraries.files))


def _required_prefixes() -> list[str]:
    """Return the folders of packages that frontends installed because pyproject.toml says so.

    They install what `requires` names on sys.path, and not always below sys.prefix.
    """
    ends = ("site-packages", "dist-packages")
    places = dict.fromkeys(Path(path) for path in sys.path if path.endswith(ends))
    prefixes = [place.parents[2] for place in places if len(place.parents) > 2]
    found = [path for path in prefixes if is_folder(path / INTERFACES)]
    return [f"{path}/share" for path in found if path != Path(sys.prefix)]


def _package(name: str, where: Scope, report: Report) -> Inputs | None:
    """Return the files of the package in the working folder; report IDL606 or IDL608 for none."""
    found = look((".",), report, where.exclude)
    if found.empty:
        report.add(nothing_in(".", where.exclude))
    given = () if report.had_errors else packages(found.files, where, report)
    if given and [one.package for one in given] != [name]:
        others = ", ".join(f"`{one.package}`" for one in given)
        message = f"the wheel is of `{name}`, and the interfaces in this folder are of {others}"
        hint = "build each in its own folder; `exclude` in [tool.idlc] leaves files out"
        report.add(codes.SEVERAL_PACKAGES.of(".", message, hint=hint))
    return None if report.had_errors else given[0]
