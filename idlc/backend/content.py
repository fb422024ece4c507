"""What is installed for a package: its classes, and what ROS 2's tools look for in a prefix."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec

from idlc.disk import config
from idlc.disk.distribution import Distribution
from idlc.disk.find import look, nothing_in
from idlc.disk.inputs import Inputs, packages
from idlc.disk.package import MANIFEST
from idlc.disk.read import read_bytes
from idlc.disk.scope import scope
from idlc.driver.gen import GenOptions, gen
from idlc.driver.libraries import Libraries, libraries_of
from idlc.driver.stages import models_of
from idlc.model.idl import idl
from idlc.model.link import Model
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
    where = msgspec.structs.replace(scope(config.load(report)), package=None)
    found = look((".",), report, where.exclude)
    if found.empty:
        report.add(nothing_in(".", where.exclude))
    if report.had_errors:
        return None
    gen(GenOptions(paths=(".",), out=str(classes), scope=where), report)
    manifest = read_bytes(Path(MANIFEST), MANIFEST, report)
    if report.had_errors or manifest is None:
        return None
    (classes / "__init__.py").write_text(f'"""Interfaces of {name}."""\n', encoding="utf-8")
    ((given, model),) = models_of(packages(found.files, where, Report()), where, Report())
    libraries = libraries_of(model, distribution)
    files = {**_share(given, model), f"share/{name}/{MANIFEST}": manifest, **libraries.files}
    return Content(classes, {**files, **_entry(name, libraries, report)}, bool(libraries.files))


def _share(given: Inputs, model: Model) -> dict[str, bytes]:
    """Return the interfaces as ROS 2 installs them, and the list of them."""
    files = {one.file.key: one.data for one in given.files}
    for own in model.own:
        stem = f"{own.name.kind}/{own.name.name}"
        files[f"{stem}.idl"] = idl(own).encode()
        files[f"{stem}.json"] = json.dumps(model.describer.installed(str(own.name))).encode()
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
