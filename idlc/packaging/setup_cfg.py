"""setup.cfg, as setuptools reads it."""

from __future__ import annotations

from configparser import Error as ConfigError
from configparser import RawConfigParser

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
