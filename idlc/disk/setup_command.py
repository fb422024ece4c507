"""What a setup.py installs besides what it lists: libraries for C++ tools, commands for `ros2 run`.

Both are made in the folder of the build, and are no part of a source distribution.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from idlc.disk.machine import environment
from idlc.disk.read import reason

#: By an entry here, recorders and others take a package for one whose library can be loaded.
INDEX = f"{environment.INDEX}/packages"
#: How a file is called until it is whole.
NEW = ".new"
#: The commands of setup.py by which pip installs.
_WHEELS = frozenset({"bdist_wheel", "editable_wheel"})
_BUILDS = _WHEELS | {"build", "build_py", "develop", "install", "install_lib"}
_NOT_INSTALLED = """\
{package}: setup() is given `packages` without {absent}, so that the classes of the interfaces \
would not be installed; write `packages=find_packages(exclude=['test'])`, or run \
`idlc check --fix`"""
_COMMAND = re.compile(r"\s*([\w.-]+)\s*=")
_LAUNCHER = """\
#!/bin/sh
# pip installs commands into bin, and ROS 2 starts what is here.
exec "$(dirname "$0")/../../bin/{name}" "$@"
"""


def distribution_class(
    package: str, libraries: Mapping[str, bytes], missing: str, packages: Iterable[str] = ()
) -> type:
    """Return a class for setup(distclass=...) that installs libraries, by paths in a prefix.

    With a reason why they are `missing`, the package is not entered in ROS 2's index. The build
    stops unless setup() was given all Python `packages` that were generated.
    """
    base = import_module("setuptools").Distribution

    def run_commands(self: Any) -> None:
        absent = sorted({*packages}.difference(self.packages or ()))
        if absent and _BUILDS & {*self.commands}:
            raise SystemExit(_NOT_INSTALLED.format(package=package, absent=", ".join(absent)))
        place = Path(self.get_option_dict("build").get("build_base", ("", "build"))[1], "idlc")
        added = dict(libraries)
        if _WHEELS & set(self.commands):
            added |= _launchers(package, self.entry_points)
        if libraries:
            tag = ("idlc", environment.wheel_platform())
            self.get_option_dict("bdist_wheel").setdefault("plat_name", tag)
        listed = list(self.data_files or ())
        if missing:
            sys.stderr.write(f"{package}: not entered in the index of ROS 2: {missing}\n")
            listed = [one for one in listed if not _enters(one)]
        try:
            made = _made(place, added)
        except OSError as error:
            raise SystemExit(f"{package}: cannot write to `{place}`: {reason(error)}") from None
        self.data_files = made + listed  # the index comes after what it leads to
        self.cmdclass["install_data"] = _whole(self.get_command_class("install_data"))
        base.run_commands(self)

    # editable installations leave data files out, because they ask for them by this other name
    added = {"run_commands": run_commands, "has_data": base.has_data_files}
    return type("Distribution", (base,), added)


def _enters(entry: str | tuple[str, Iterable[str]]) -> bool:
    return not isinstance(entry, str) and entry[0].rstrip("/") == INDEX


def _launchers(package: str, entry_points: Any) -> dict[str, bytes]:
    """Return a file for each command of a package where `ros2 run` and launch files look for it."""
    scripts = (entry_points or {}).get("console_scripts", ())
    lines = scripts.splitlines() if isinstance(scripts, str) else scripts
    names = [found[1] for found in map(_COMMAND.match, lines) if found]
    return {f"lib/{package}/{name}": _LAUNCHER.format(name=name).encode() for name in names}


def _made(place: Path, files: Mapping[str, bytes]) -> list[tuple[str, list[str]]]:
    """Write files below a folder; return what setup() is to install, in its own words."""
    for path, content in files.items():
        target = place / path
        if not target.is_file() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            beside = target.with_name(f"{target.name}{NEW}")
            beside.write_bytes(content)
            beside.chmod(0o755)
            beside.replace(target)
    return [(os.path.dirname(path), [(place / path).as_posix()]) for path in files]  # noqa: PTH120


def _whole(copying: Any) -> type:
    """Return a command that installs each file as a whole or not at all.

    A program that has the old one open goes on with it.
    """

    def copy_file(self: Any, source: str, folder: str, *rest: Any, **named: Any) -> tuple[str, int]:
        target = Path(folder, Path(source).name)
        beside = target.with_name(f"{target.name}{NEW}")
        beside.unlink(missing_ok=True)
        done: tuple[str, int] = copying.copy_file(self, source, str(beside), *rest, **named)
        if beside.exists():
            beside.replace(target)
        return str(target), done[1]

    return type("install_data", (copying,), {"copy_file": copy_file})
