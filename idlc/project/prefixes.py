"""The content of install prefixes: the packages with interfaces, and their libraries."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from importlib.machinery import PathFinder
from pathlib import Path
from typing import NamedTuple

from idlc.diagnostics.report import Report, first_few
from idlc.model import distros
from idlc.model.names import is_package_name
from idlc.project.files import entries, is_file, is_folder, read_bytes
from idlc.project.package_xml import declared_version

#: Where a prefix lists what is installed in it, by kind and name.
INDEX = "share/ament_index/resource_index"


def ament_prefixes() -> tuple[Path, ...]:
    """Return the folders that ROS packages are installed in, in order of precedence."""
    listed = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return tuple(dict.fromkeys(Path(prefix) for prefix in (*listed, sys.prefix) if prefix))


def modules_folder() -> str:
    """Return the folder of a prefix in which the Python of ROS 2 here looks for modules."""
    folders = (
        path.parent.relative_to(prefix).as_posix()
        for prefix in ament_prefixes()
        for path in sorted(prefix.glob("lib/python3*/site-packages/rclpy"))
    )
    own = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
    return next(folders, own)


def runs_nodes() -> bool:
    """Return whether this Python has rclpy; environments of pipx or pre-commit have idlc alone."""
    return bool(python_folders("rclpy"))


def python_folders(package: str) -> list[Path]:
    """Return the folders that importing a package would use, without importing it."""
    spec = PathFinder.find_spec(package, sys.path)
    return [Path(place) for place in (spec and spec.submodule_search_locations) or ()]


def machine() -> str:
    """Return the processor of this Python, such as `x86_64`; empty if not on Linux."""
    whole = sys.maxsize > 1 << 32  # a 32-bit Python on a 64-bit kernel
    if sys.platform != "linux" or not whole:
        return ""
    import platform  # slow to import, and few runs need it

    return platform.machine()


def wheel_platform() -> str:
    """Return the platform tag of wheels with libraries for this machine.

    The libraries need no library of the system, so they run wherever the generated code does: the
    tags name the oldest systems with a supported Python.
    """
    import platform

    libc = "manylinux_2_17" if platform.libc_ver()[0] == "glibc" else "musllinux_1_1"
    return f"{libc}_{machine()}"


#: The distribution where nothing of ROS 2 is installed.
DEFAULT = distros.DEFAULT.name
#: The distribution of each release of rosidl, which is in every installation of ROS 2.
_BY_VERSION = {
    "3.1": "humble",
    "4.0": "iron",
    "4.6": "jazzy",
    "4.9": "kilted",
    "5.2": "lyrical",
    "5.3": "rolling",
}
_TELLING = "share/rosidl_runtime_c/package.xml"


class Distribution(NamedTuple):
    """A distribution, by the name that ROS_DISTRO has for it; `why` is the evidence.

    An unknown distribution has an empty name.
    """

    name: str
    why: str


def distribution(prefixes: Iterable[Path] | None = None) -> Distribution:
    """Return the distribution that is installed in prefixes, by default in those of ROS 2.

    The first one found wins, or the one that ROS_DISTRO names if there are several. ROS_DISTRO
    decides only where nothing is installed: it is often set wrongly.
    """
    places = ament_prefixes() if prefixes is None else prefixes
    distributions = list(filter(None, map(installed, places)))
    requested = os.environ.get("ROS_DISTRO", "")
    if not distributions and requested:
        name = requested if requested in _BY_VERSION.values() else ""
        return Distribution(name, f"ROS_DISTRO={requested}")
    first = next(iter(distributions), Distribution(DEFAULT, "ROS 2 is not installed"))
    return next((each for each in distributions if each.name == requested), first)


def installed(prefix: Path) -> Distribution | None:
    """Return the distribution in a prefix itself; `None` if it has no rosidl."""
    version = declared_version(prefix / _TELLING)
    if not version:
        return None
    name = _BY_VERSION.get(".".join(version.split(".")[:2]), "")
    return Distribution(name, f"rosidl {version} in {prefix.as_posix()}")


def prefixes(folder: Path) -> list[Path]:
    """Return the prefixes that a folder is or holds: colcon makes one for each package."""
    if is_folder(folder / INDEX):
        return [folder]
    return [path for path in entries(folder) if is_folder(path / INDEX)]


def with_interfaces(prefix: Path) -> list[str]:
    """Return the packages with interfaces in a prefix's index, by which C++ tools find them."""
    names = _registered(prefix, "rosidl_interfaces")
    return [name for name in names if is_file(prefix / INDEX / "packages" / name)]


def inconsistencies(prefix: Path) -> Iterator[tuple[str, str]]:
    """Yield each package whose entries in the index do not match its files, and the problem."""
    interfaces = _registered(prefix, "rosidl_interfaces")
    packages = set(_registered(prefix, "packages"))
    for name in interfaces:
        if name not in packages:
            why = "is in ROS 2's list of interface packages but not in its list of packages"
            yield name, f"{why}, so `ros2 interface list` fails"
            continue
        path = prefix / INDEX / "rosidl_interfaces" / name
        listed = (read_bytes(path, path.as_posix(), Report()) or b"").decode("utf-8", "replace")
        share = prefix / "share" / name
        missing = [line for line in listed.split() if not is_file(share / line)]
        if missing:
            files = first_few((f"`{file[:80]}`" for file in missing), 3)
            yield name, f"lacks files that ROS 2's index lists: {files}"
    for name in sorted(packages.difference(interfaces)):
        share = prefix / "share" / name
        if any(any((share / kind).glob(f"*.{kind}")) for kind in ("msg", "srv", "action")):
            yield (
                name,
                "has interfaces that ROS 2's index omits, so `ros2 interface` cannot find them",
            )


def _registered(prefix: Path, kind: str) -> list[str]:
    """Return the packages that have an entry of a kind in a prefix's index."""
    return [path.name for path in entries(prefix / INDEX / kind) if is_package_name(path.name)]
