"""Files that a setup.py installs besides those it lists: of interfaces, and commands.

All of it is written into the build folder, and is not part of a source distribution.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path, PurePath, PurePosixPath
from typing import Any, TypeAlias

from idlc.cli import output
from idlc.compiler.compiler import models_of
from idlc.diagnostics.report import Report, ReportedError
from idlc.generate.prefix import libraries_of, shared
from idlc.packaging.facts import home_of
from idlc.project import prefixes
from idlc.project.atomic import write_whole
from idlc.project.files import is_file, read_bytes, reason
from idlc.project.find import list_files
from idlc.project.inputs import packages
from idlc.project.lock import FILE, load_lock
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import load_settings, scope
from idlc.project.step import present, remove_leftovers, stop_if_outdated
from idlc.tasks.gen import GenOptions, gen

#: The commands of setup.py that pip runs.
_WHEELS = frozenset({"bdist_wheel", "editable_wheel"})
_COMMAND = re.compile(r"\s*([\w.-]+)\s*=")
_LAUNCHER = """\
#!/bin/sh
# pip installs commands into bin, and ROS 2 starts what is here.
exec "$(dirname "$0")/../../bin/{name}" "$@"
"""
#: An entry of `data_files` in setup(): a file for the prefix, or a folder in it and its files.
_DataFile: TypeAlias = str | tuple[str, Iterable[str]]


def compiled_class(package: str, base: Any) -> type:
    """Compile the package in the working folder; return the class of its distribution.

    `base` is the class of distributions to extend.
    """
    report = Report()
    settings = load_settings(Root.here(), report)
    where = scope(settings, package)
    inputs = packages(list_files((".",), where.root, Report(), where.exclude).files, where, report)
    folder = home_of(where.root.base, package, where.root)
    if not inputs:
        if is_file(folder / FILE):
            stop_if_outdated(folder)
        return distribution_class(package, base, {}, folder)
    home = folder.relative_to(where.root.base).as_posix()
    runtime, vendoring = settings.runtime, settings.vendoring
    before = _packages(package, folder)
    with suppress(ReportedError):
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
    after = _packages(package, folder)
    gone = before - after  # setup() has found them already
    return distribution_class(package, base, files, folder, after, gone, libraries.build_tag)


def _packages(package: str, home: Path) -> set[str]:
    """Return the Python packages that were generated into a folder."""
    lock = load_lock(home, "", Report())
    modules = (PurePosixPath(package, path) for path in (lock.outputs if lock else ()))
    return {".".join(module.parent.parts) for module in modules if module.suffix == ".py"}


def distribution_class(
    package: str,
    base: Any,
    files: Mapping[str, bytes],
    home: Path,
    packages: Iterable[str] = (),
    gone: Iterable[str] = (),
    build_tag: str = "",
) -> type:
    """Return a class of distributions that installs files, by their paths in a prefix.

    They replace what `data_files` lists for the same paths. A package with interfaces whose files
    have no entries in ROS 2's index gets none from `data_files` either. The Python `packages` that
    were generated into `home` are installed, whether setup() lists them or not, and those that are
    `gone` are not. `build_tag` is for the names of wheels.
    """
    index = {f"{prefixes.INDEX}/{kind}/{package}" for kind in ("packages", "rosidl_interfaces")}

    def run_commands(self: Any) -> None:
        getattr(self, "set_defaults", lambda: None)()  # looks for packages that nothing names
        self.packages = sorted({*(self.packages or ()), *packages}.difference(gone))
        place = Path(self.get_option_dict("build").get("build_base", ("", "build"))[1], "idlc")
        self.sources = present(self.data_files or ())
        listed, added = _merged(self.sources, files, index if files else set())
        if _WHEELS & set(self.commands):
            # where `ros2 run` and launch files look for the commands of a package
            scripts = (self.entry_points or {}).get("console_scripts", ())
            lines = scripts.splitlines() if isinstance(scripts, str) else scripts
            for name in (match[1] for match in map(_COMMAND.match, lines) if match):
                added[f"lib/{package}/{name}"] = _LAUNCHER.format(name=name).encode()
        if any(path.endswith(".so") for path in files):
            options = self.get_option_dict("bdist_wheel")
            options.setdefault("plat_name", ("idlc", prefixes.wheel_platform()))
            if build_tag:
                options.setdefault("build_number", ("idlc", build_tag))
        try:
            installed = _write_files(place, added)
        except OSError as error:
            raise SystemExit(f"{package}: cannot write to `{place}`: {reason(error)}") from None
        self.data_files = installed + listed
        self.cmdclass["install_data"] = _whole(self.get_command_class("install_data"))
        base.run_commands(self)

    def run_command(self: Any, command: str) -> None:
        installed = self.data_files
        if command == "egg_info" and self.sources is not None:  # lists what is in an sdist
            self.data_files = self.sources
        base.run_command(self, command)
        self.data_files = installed
        remove_leftovers(self, command, home)

    # editable installations leave data files out, because they ask for them by this other name
    added = {"has_data": base.has_data_files, "sources": None}
    methods = {"run_commands": run_commands, "run_command": run_command}
    return type("Distribution", (base,), {**methods, **added})


def _merged(
    listed: Iterable[_DataFile], files: Mapping[str, bytes], index: set[str]
) -> tuple[list[_DataFile], dict[str, bytes]]:
    """Return `data_files` without those that new files replace, and the new files.

    A listed file that has the content already stays: colcon's links lead to it. Without a new
    entry in the index there is no old one either.
    """
    kept: list[_DataFile] = []
    new = dict(files)
    for entry in listed:
        if isinstance(entry, str):
            kept.append(entry)
            continue
        others = []
        for path in entry[1]:
            target = PurePath(entry[0], PurePath(path).name).as_posix()
            if target in files and is_file(path) and Path(path).read_bytes() == files[target]:
                new.pop(target, None)
            elif target in files or target in index:
                continue
            others.append(path)
        kept.append((entry[0], others))
    return kept, new


def _write_files(place: Path, files: Mapping[str, bytes]) -> list[tuple[str, list[str]]]:
    """Write files below a folder; return the `data_files` of setup() that install them."""
    for path, content in files.items():
        write_whole(place / path, content, 0o755 if path.startswith("lib/") else 0o644)
    return [(os.path.dirname(path), [(place / path).as_posix()]) for path in files]  # noqa: PTH120


def _whole(copying: Any) -> type:
    """Return a command that installs each file as a whole or not at all.

    Programs that have the old file open keep it.
    """

    def copy_file(self: Any, source: str, folder: str, *rest: Any, **named: Any) -> tuple[str, int]:
        target = Path(folder, Path(source).name)
        beside = target.with_name(f"{target.name}.new")
        beside.unlink(missing_ok=True)
        done: tuple[str, int] = copying.copy_file(self, source, str(beside), *rest, **named)
        if beside.exists():
            beside.replace(target)
        return str(target), done[1]

    return type("install_data", (copying,), {"copy_file": copy_file})
