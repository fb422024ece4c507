"""What is installed in a prefix: the packages with interfaces, and their libraries."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.diagnostics.report import Report
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
    """Yield the packages of a prefix that have interfaces and are in its index."""
    try:
        names = sorted(path.name for path in (prefix / INDEX / "rosidl_interfaces").iterdir())
    except OSError:
        return
    for name in names:
        if is_package_name(name) and is_file(prefix / INDEX / "packages" / name):
            yield Installed(prefix, name)
