"""The installed files of a package: its classes, and the files that tools of ROS 2 look for."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import msgspec

from idlc.compiler.compiler import models_of
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError, first_few
from idlc.generate.prefix import Libraries, build_tag, libraries_of, shared
from idlc.project.files import is_folder, read_bytes
from idlc.project.find import list_files, no_interfaces
from idlc.project.inputs import packages
from idlc.project.lock import load_lock
from idlc.project.prefixes import INDEX, Distribution
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import SETTINGS_FILE, Config, TableLocation, load_settings, scope
from idlc.tasks.gen import GenOptions, gen


class Options(NamedTuple):
    """The settings of a frontend: the distribution of libraries, and whether there are any."""

    distribution: Distribution | None
    libraries: bool = True


class PrefixContent(NamedTuple):
    """The files of the prefix by their paths in it; `libraries` are those among them."""

    prefix: Mapping[str, bytes]
    libraries: Libraries


def compile_package(name: str, classes: Path, options: Options, report: Report) -> PrefixContent:
    """Compile the package in the working folder, its classes into a folder of their own.

    Raises ReportedError.
    """
    root = Root.here()
    config = load_settings(root, report)
    refuse_beside(config, report)
    if config.source and config.package not in ("", name):
        place = TableLocation(config.source, "tool.idlc", "[tool.idlc]")
        message = f"`package` is `{config.package}`, but package.xml names the package `{name}`"
        place.wrong("package", message, report, "remove `package` from [tool.idlc]")
    settings = scope(config, distro=options.distribution and options.distribution.name)
    include = (*settings.include, *required_prefixes())
    where = msgspec.structs.replace(settings, package=None, include=include)
    files = list_files((".",), root, report, where.exclude)
    if files.empty:
        report.add(no_interfaces(".", root, where.exclude))
    report.raise_errors()
    inputs = packages(files.files, where, report)
    if inputs and [package.package for package in inputs] != [name]:
        others = ", ".join(f"`{package.package}`" for package in inputs)
        message = f"the wheel is for `{name}`, but this folder contains interfaces of {others}"
        hint = "build each in its own folder, or exclude files with `exclude` in [tool.idlc]"
        report.add(codes.SEVERAL_PACKAGES.of(".", message, hint=hint))
    report.raise_errors()
    lock = load_lock(Path(name), name, report)
    # where classes are committed, people describe the package in the first of these
    kept = {Path(name, path) for path in ("__init__.py", *(lock.outputs if lock else ()))}
    own = sorted({*Path(name).rglob("*.py")} - kept)
    if own:  # the wheel would not have them
        listed = first_few((f"`{root.shown(path)}`" for path in own), 3)
        message = f"idlc.backend builds only interfaces, but this folder contains {listed}"
        hint = 'use `build-backend = "setuptools.build_meta"` with the setup.py of a package'
        report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint=hint))
    runtime, vendoring = config.runtime, config.vendoring
    generate(GenOptions((".",), where, str(classes), runtime=runtime, vendoring=vendoring), report)
    manifest = read_bytes(Path(MANIFEST), MANIFEST, report)
    report.raise_errors()
    assert manifest is not None  # it was read, or reported
    ((_, model),) = models_of(inputs, where, Report())
    if options.libraries:
        libraries = libraries_of(model, options.distribution)
    else:
        libraries = Libraries({}, "the build has the setting `libraries=no`", build_tag(model))
    return PrefixContent(shared(model, manifest, libraries, report), libraries)


def refuse_beside(config: Config, report: Report) -> None:
    """Report IDL611 if packages of ROS 2 would be in the wheel."""
    if config.source and config.vendoring == "beside":
        message = "`vendor-deps` is `beside`: a wheel would overwrite ROS 2 packages"
        hint = "set it to true, so that the package contains the types that it uses"
        place = TableLocation(config.source, "tool.idlc", "[tool.idlc]")
        place.wrong("vendor-deps", message, report, hint)


def generate(request: GenOptions, report: Report) -> None:
    """Write classes, and report the problems.

    The environment of a build need not be able to import what the classes import.
    """
    problems = Report()
    with suppress(ReportedError):
        gen(request, problems)
    unimportable = codes.DEPENDENCY_NOT_IMPORTABLE.id
    report.extend(problem for problem in problems if problem.code != unimportable)


def required_prefixes() -> list[str]:
    """Return the folders of packages that frontends installed because pyproject.toml says so.

    They install what `requires` names on sys.path, and not always below sys.prefix.
    """
    ends = ("site-packages", "dist-packages")
    places = dict.fromkeys(Path(path) for path in sys.path if path.endswith(ends))
    prefixes = [place.parents[2] for place in places if len(place.parents) > 2]
    installed = [path for path in prefixes if is_folder(path / INDEX)]
    return [f"{path}/share" for path in installed if path != Path(sys.prefix)]
