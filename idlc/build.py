"""What the setup.py of a scaffolded package calls: its interfaces compiled before it is built."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from idlc.cli import output
from idlc.diagnostics.report import Report
from idlc.disk.find import look
from idlc.disk.output.project import Project
from idlc.disk.packages.inputs import packages
from idlc.disk.scope import scope
from idlc.disk.settings import pyproject
from idlc.disk.setup_command import distribution_class
from idlc.driver.generate.gen import GenOptions, gen
from idlc.driver.generate.libraries import Libraries, libraries_of
from idlc.driver.stages import models_of
from idlc.emit.render import support_packages
from idlc.model.link import Model
from idlc.scaffold import new_interface


def compile_interfaces(package: str) -> dict[str, type]:
    """Bring the package's classes, and what ROS 2 installs beside interfaces, up to date.

    Returns what setup() is to be given besides, for its libraries: `setup(..., **compiled)`.

    Works in the folder of the setup.py that is run, and writes nothing where nothing changed. A
    rejected interface ends the build with a report.
    """
    if "--dry-run" in sys.argv:
        return {}  # colcon asks setup.py for the package's name whatever it is to do, to test too
    here, source = Path.cwd(), Path("setup.py").resolve().parent
    os.chdir(source)
    try:
        installed, libraries, generated = _compile(package)
    finally:
        os.chdir(here)
    if source != here:
        _link(installed, source, here)
    made = distribution_class(package, libraries.files, libraries.missing, generated)
    return {"distclass": made}


def _link(paths: Iterable[str], source: Path, here: Path) -> None:
    """Link to files of the source where colcon builds: with --symlink-install, among links.

    Those links it makes before there are any compiled files.
    """
    for path in paths:
        if not (here / path).exists():
            (here / path).unlink(missing_ok=True)
            (here / path).parent.mkdir(parents=True, exist_ok=True)
            (here / path).symlink_to(source / path)


def _compile(package: str) -> tuple[Iterable[str], Libraries, Iterable[str]]:
    """Compile the package in the working folder.

    Returns the files that ROS 2's tools read, libraries, and the Python packages of the classes.
    """
    report = Report()
    where = scope(pyproject.load(report), package)
    found = packages(look((".",), Report(), where.exclude).files, where, report)
    if not found:
        return (), Libraries({}), ()
    (given,) = found
    gen(GenOptions(paths=(".",), out=package, scope=where), report)
    ((_, model),) = models_of(found, where, Report())
    files = dict([new_interface.index(package, given.digests)])
    if not report.had_errors:
        files |= dict(_described(model))
        project = Project(".", report)
        planned = project.plan({}, files)
        if planned is not None:
            project.apply(planned[0])
    output.show(report, "text", sys.stderr)
    if report.had_errors:
        raise SystemExit(f"{package}: the interfaces cannot be compiled, see above")
    parts = {*support_packages(), *(key.partition("/")[0] for key in given.digests)}
    return files, libraries_of(model), (package, *(f"{package}.{part}" for part in parts))


def _described(model: Model) -> Iterator[tuple[str, str]]:
    """Yield the description of each interface that ROS 2 installs, and its path."""
    for own in model.own:
        content = json.dumps(model.describer.installed(str(own.name)), indent=2)
        yield f"{new_interface.RESOURCE}/{own.name.kind}/{own.name.name}.json", content + "\n"
