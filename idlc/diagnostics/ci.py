"""The commands that CI systems find in the output of programs, and how to break them."""

from __future__ import annotations

import re
from enum import Enum
from typing import NamedTuple


class LinePart(Enum):
    """The part of a line in which a CI system looks for a prefix."""

    ANYWHERE = "anywhere"
    #: Only blanks may stand before it.
    START = "start"


class CommandPrefix(NamedTuple):
    """Text that begins a command of a CI system."""

    text: str
    place: LinePart


#: The prefixes of commands by CI system.
SYSTEMS = {
    "Azure Pipelines": (
        CommandPrefix("##vso[", LinePart.ANYWHERE),
        CommandPrefix("##[", LinePart.ANYWHERE),
    ),
    "GitHub Actions": (
        CommandPrefix("::", LinePart.START),
        CommandPrefix("##[", LinePart.ANYWHERE),
    ),
    "GitLab CI": (
        CommandPrefix("section_start:", LinePart.ANYWHERE),
        CommandPrefix("section_end:", LinePart.ANYWHERE),
    ),
    "TeamCity": (CommandPrefix("##teamcity[", LinePart.ANYWHERE),),
    "Travis CI": (
        CommandPrefix("travis_fold:", LinePart.ANYWHERE),
        CommandPrefix("travis_time:", LinePart.ANYWHERE),
    ),
}
_PREFIXES = sorted({prefix for every in SYSTEMS.values() for prefix in every})
#: Characters that end a line for some program.
_ENDS = "\n\r\v\f\x1c-\x1e\x85\u2028\u2029"


def _pattern(*places: LinePart) -> re.Pattern[str]:
    starts = {LinePart.ANYWHERE: "", LinePart.START: rf"(?:(?<![^{_ENDS}])[^\S{_ENDS}]*)"}
    # after `::`, a colon is no name of a command
    parts = (
        f"{starts[prefix.place]}{re.escape(prefix.text[0])}(?={re.escape(prefix.text[1:])}(?!:))"
        for prefix in _PREFIXES
        if prefix.place in places
    )
    return re.compile("|".join(parts), re.IGNORECASE)


_EVERYWHERE = _pattern(*LinePart)
_INSIDE = _pattern(LinePart.ANYWHERE)


class Form(Enum):
    """The form of an output, which decides how a prefix is changed.

    `COMMANDS` are for a CI system: only text inside of their lines is changed. `EXACT` text cannot
    be changed without a loss.
    """

    TEXT = "text"
    JSON = "json"
    YAML = "yaml"
    XML = "xml"
    COMMANDS = "commands"
    EXACT = "exact"


class SpeakingError(Exception):
    """A CI system would obey a line of exact text."""


def silenced(text: str, form: Form = Form.TEXT) -> str:
    """Return text in which no CI system finds a command; raise SpeakingError for exact text.

    Data in JSON, YAML and XML stay the same, other text gets a space after the first character of
    the prefix.
    """
    if form is Form.COMMANDS:
        return _INSIDE.sub(_spaced, text)
    if form in (Form.TEXT, Form.EXACT):
        if form is Form.EXACT and _EVERYWHERE.search(text):
            raise SpeakingError
        return _EVERYWHERE.sub(_spaced, text)
    # they consist of quoted text, where a line never begins with a prefix
    return _INSIDE.sub(lambda match: _REFERENCES[form].format(ord(match[0])), text)


def _spaced(match: re.Match[str]) -> str:
    return f"{match[0]} "


#: Other ways to write a character.
_REFERENCES = {Form.JSON: "\\u{:04x}", Form.YAML: "\\x{:02x}", Form.XML: "&#{};"}
