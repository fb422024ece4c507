"""What is installed in a prefix: the packages with interfaces, and their libraries."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.diagnostics.report import Report, first_few
from idlc.disk.machine.environment import INDEX
from idlc.disk.read import is_file, is_folder, read_bytes, shown
from idlc.model.names import is_package_name


class Installed(NamedTuple):
    """A package with interfaces that is in a prefix's index, by which C++ tools find it."""

    prefix: Path
    package: str

    @property
    def share(self) -> str:
        """The folder of its interfaces."""
        return shown(self.prefix / "share" / self.package)

    def library(self, name: str) -> str:
        """Return the path of one of its libraries, as people know it."""
        return shown(self.prefix / "lib" / name)

    def content(self, name: str) -> bytes | None:
        """Return the content of one of its libraries, `None` where there is none to be read."""
        path = self.prefix / "lib" / name
        return read_bytes(path, shown(path), Report()) if is_file(path) else None


def prefixes(folder: Path) -> list[Path]:
    """Return the prefixes that a folder is or holds: colcon makes one for each package."""
    if is_folder(folder / INDEX):
        return [folder]
    try:
        inner = sorted(folder.iterdir())
    except OSError:
        return []
    return [path for path in inner if is_folder(path / INDEX)]


def installed(prefix: Path) -> Iterator[Installed]:
    """Yield the packages of a prefix that are registered as packages with interfaces."""
    for name in _registered(prefix, "rosidl_interfaces"):
        if is_file(prefix / INDEX / "packages" / name):
            yield Installed(prefix, name)


def inconsistencies(prefix: Path) -> Iterator[tuple[str, str]]:
    """Yield each package whose entries in the index and files do not match, and what is wrong."""
    interfaces = _registered(prefix, "rosidl_interfaces")
    packages = set(_registered(prefix, "packages"))
    for name in interfaces:
        if name not in packages:
            yield name, "has interfaces and is not a package there: `ros2 interface list` fails"
            continue
        path = prefix / INDEX / "rosidl_interfaces" / name
        listed = (read_bytes(path, shown(path), Report()) or b"").decode("utf-8", "replace")
        share = prefix / "share" / name
        missing = [line for line in listed.split() if not is_file(share / line)]
        if missing:
            files = first_few((f"`{file[:80]}`" for file in missing), 3)
            yield name, f"lists {files} there, and not all of it is installed"
    for name in sorted(packages.difference(interfaces)):
        share = prefix / "share" / name
        if any(any((share / kind).glob(f"*.{kind}")) for kind in ("msg", "srv", "action")):
            yield name, "has interfaces that are not listed there: `ros2 interface` misses them"


def _registered(prefix: Path, kind: str) -> list[str]:
    """Return the packages that have an entry of a kind in a prefix's index."""
    try:
        names = sorted(path.name for path in (prefix / INDEX / kind).iterdir())
    except OSError:
        return []
    return [name for name in names if is_package_name(name)]
