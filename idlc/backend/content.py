"""What is installed for a package: its classes, and what ROS 2's tools look for in a prefix."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec

from idlc.disk import config
from idlc.disk.distribution import Distribution
from idlc.disk.find import look, nothing_in
from idlc.disk.inputs import Inputs, packages
from idlc.disk.package import MANIFEST
from idlc.disk.read import is_folder, read_bytes
from idlc.disk.scope import Scope, scope
from idlc.driver.gen import GenOptions, gen
from idlc.driver.libraries import Libraries, libraries_of
from idlc.driver.stages import models_of
from idlc.model.idl import idl
from idlc.model.link import Model
from idlc.text import codes
from idlc.text.diagnostics import Report

_INDEX = "share/ament_index/resource_index"


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
    settings = scope(config.load(report))
    where = msgspec.structs.replace(
        settings, package=None, include=(*settings.include, *_required_prefixes())
    )
    given = _package(name, where, report)
    if given is None:
        return None
    made = Report()
    gen(GenOptions(paths=(".",), out=str(classes), scope=where), made)
    # who builds a package need not be able to import it
    report.extend(one for one in made if one.code != codes.NOT_IMPORTABLE.id)
    manifest = read_bytes(Path(MANIFEST), MANIFEST, report)
    if report.had_errors or manifest is None:
        return None
    (classes / "__init__.py").write_text(f'"""Interfaces of {name}."""\n', encoding="utf-8")
    ((_, model),) = models_of((given,), where, Report())
    libraries = libraries_of(model, distribution)
    files = {**_share(given, model), f"share/{name}/{MANIFEST}": manifest, **libraries.files}
    return Content(classes, {**files, **_entry(name, libraries, report)}, bool(libraries.files))


def _required_prefixes() -> list[str]:
    """Return the folders of packages that frontends installed because pyproject.toml says so.

    They install what `requires` names on sys.path, and not always below sys.prefix.
    """
    libraries = (
        Path(path) for path in sys.path if path.endswith(("site-packages", "dist-packages"))
    )
    prefixes = (path.parents[2] for path in libraries if len(path.parents) > 2)
    found = [path for path in prefixes if is_folder(path / _INDEX / "rosidl_interfaces")]
    return [f"{path}/share" for path in dict.fromkeys(found) if path != Path(sys.prefix)]


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


def _share(given: Inputs, model: Model) -> dict[str, bytes]:
    """Return the interfaces as ROS 2 installs them, and the list of them."""
    files = {one.file.key: one.data for one in given.files}
    for own in model.own:
        stem = f"{own.name.kind}/{own.name.name}"
        installed = model.describer.installed(str(own.name))
        files[f"{stem}.idl"] = idl(own).encode()
        files[f"{stem}.json"] = json.dumps(installed, indent=2).encode()
    listed = sorted(key for key in files if not key.endswith(".json"))
    shared = {f"share/{given.package}/{key}": data for key, data in files.items()}
    return {**shared, f"{_INDEX}/rosidl_interfaces/{given.package}": "\n".join(listed).encode()}


def _entry(name: str, libraries: Libraries, report: Report) -> dict[str, bytes]:
    """Return the entry in the index of packages; recorders stop at one without libraries."""
    if libraries.missing:
        report.notes.append(
            f"`{name}` is not entered in the index of ROS 2's packages, because recorders stop at "
            f"one without a library for C++ tools: {libraries.missing}"
        )
        return {}
    return {f"{_INDEX}/packages/{name}": b""}
