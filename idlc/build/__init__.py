"""The function that setup.py calls: it compiles interfaces before a package is built."""

from __future__ import annotations

import os
import sys
from pathlib import Path, PurePosixPath
from typing import Any

from idlc.build.setup_command import distribution_class
from idlc.check.compiler import models_of
from idlc.check.package.facts import home_of
from idlc.cli import output
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import without_options
from idlc.generate.gen import GenOptions, gen
from idlc.generate.prefix import libraries_of, shared
from idlc.project.files import is_file, read_bytes
from idlc.project.find import list_files
from idlc.project.inputs import packages
from idlc.project.lock import load_lock
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import load_settings, scope


def compile_at_build(distribution: Any, keyword: str, value: object) -> None:  # noqa: ARG001
    """Have setup(idlc_interfaces=True) compile the interfaces before its commands run.

    setuptools finds this function by its entry point. Without idlc it warns of an unknown option,
    and the package is built with the classes that were committed.
    """
    if not value:
        return

    def run_commands() -> None:
        del distribution.run_commands
        name = str(distribution.get_name())  # setuptools 78 has its own str for pyproject.toml's
        compiled = compile_interfaces(name, type(distribution))
        distribution.__class__ = compiled.get("distclass", type(distribution))
        if hasattr(distribution, "set_defaults"):  # from setuptools 61 on
            distribution.set_defaults()
        generated = getattr(distribution, "generated", ())
        distribution.packages = sorted({*(distribution.packages or ()), *generated})
        distribution.run_commands()

    distribution.run_commands = run_commands


def compile_interfaces(package: str, base: type | None = None) -> dict[str, type]:
    """Bring the package's classes up to date, and install what rosidl installs beside them.

    Returns further arguments for setup(), `setup(..., **compiled)`: with them it installs the
    interfaces, their descriptions, libraries for C++ tools and the entries in ROS 2's index. These
    replace what `data_files` lists for the same places. `base` is the class of distributions to
    extend, setuptools' own by default.

    Works in the folder of the setup.py that is run, and writes only classes there, and only where
    they changed. A rejected interface ends the build with a report.
    """
    if "--dry-run" in sys.argv:
        return {}  # colcon asks setup.py for the package's name whatever it is to do, to test too
    working_folder, source = Path.cwd(), Path("setup.py").resolve().parent
    os.chdir(source)
    try:
        with without_options():
            return {"distclass": _compiled(package, base)}
    finally:
        os.chdir(working_folder)


def _compiled(package: str, base: type | None) -> type:
    """Compile the package in the working folder; return a class for setup(distclass=...)."""
    report = Report()
    settings = load_settings(Root.here(), report)
    where = scope(settings, package)
    inputs = packages(list_files((".",), where.root, Report(), where.exclude).files, where, report)
    if not inputs:
        return distribution_class(package, {}, base=base)
    home = home_of(where.root.base, package, where.root).relative_to(where.root.base).as_posix()
    runtime, vendoring = settings.runtime, settings.vendoring
    gen(GenOptions((".",), where, home, runtime=runtime, vendoring=vendoring), report)
    manifest = read_bytes(Path(MANIFEST), MANIFEST, report) if is_file(Path(MANIFEST)) else None
    if report.had_errors:
        output.show(report, "text", sys.stderr)
        raise SystemExit(f"{package}: the interfaces cannot be compiled, see above")
    ((_, model),) = models_of(inputs, where, Report())
    libraries = libraries_of(model)
    files = shared(model, manifest, libraries, report)
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    lock = load_lock(where.root.base / home, home, Report())
    modules = (PurePosixPath(package, path) for path in (lock.outputs if lock else ()))
    folders = {module.parent for module in modules if module.suffix == ".py"}
    generated = tuple(sorted(".".join(folder.parts) for folder in folders))
    return distribution_class(package, files, generated, libraries.build_tag, base)
