"""The files that describe a package to what builds it: their names, reading and editing them."""

from __future__ import annotations

from collections.abc import Callable
from configparser import Error as ConfigError
from configparser import RawConfigParser
from typing import NamedTuple, TypeAlias

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


#: Characters of the longest setup.cfg that is read.
_MOST = 100_000


class SetupCfg:
    """The values of a setup.cfg. Raises ValueError for a text that setuptools cannot read."""

    def __init__(self, text: str) -> None:
        if len(text) > _MOST:
            raise ValueError(f"setup.cfg has more than {_MOST:,} characters")
        self._parser = RawConfigParser(strict=False)
        try:
            self._parser.read_string(text)
        except ConfigError as error:
            raise ValueError(error.message) from None

    def has(self, section: str, key: str) -> bool:
        """Return whether a section has a key."""
        return self._parser.has_option(section, key)

    def has_section(self, section: str) -> bool:
        """Return whether there is a section."""
        return self._parser.has_section(section)

    def lines(self, section: str, key: str) -> tuple[str, ...]:
        """Return the lines of a value, without those that are empty."""
        text = self._parser.get(section, key, fallback="") or ""
        return tuple(line for part in text.split("\n") if (line := part.strip()))

    def words(self, section: str, key: str) -> tuple[str, ...]:
        """Return the parts of a value, which lines or commas separate."""
        lines = self.lines(section, key)
        parts = lines if len(lines) > 1 else "".join(lines).split(",")
        return tuple(word for part in parts if (word := part.strip()))


class Edited(NamedTuple):
    """The whole new text of a file; the old one where there was nothing to do."""

    text: str


class Refused(NamedTuple):
    """The reason why a file is not edited, and the line that the user has to add, and where."""

    why: str
    line: str
    where: str


Outcome: TypeAlias = Edited | Refused
