"""The files that describe a package to what builds it: their names, and reading them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from idlc.diagnostics.source import Source
from idlc.project.root import MANIFEST
from idlc.project.settings import SETTINGS_FILE

CMAKE_LISTS = "CMakeLists.txt"
SETUP_PY = "setup.py"
SETUP_CFG = "setup.cfg"
#: What setuptools reads.
SETUP_FILES = (SETUP_PY, SETUP_CFG, SETTINGS_FILE)
PACKAGE_FILES = (MANIFEST, SETTINGS_FILE, CMAKE_LISTS, SETUP_PY, SETUP_CFG)


class PackageFiles(NamedTuple):
    """The files of a package that exist, besides its package.xml."""

    setup_py: Source | None
    setup_cfg: Source | None
    pyproject: Source | None
    cmake: Source | None


def read_package_files(read: Callable[[str], Source | None]) -> PackageFiles:
    """Return the files that `read` finds by their names in the package's folder."""
    return PackageFiles(*map(read, (*SETUP_FILES, CMAKE_LISTS)))
