"""The outcome of editing one of the user's files: its new text, or a line to add by hand."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias


class Edited(NamedTuple):
    """The whole new text; the old one where there was nothing to do."""

    text: str


class Refused(NamedTuple):
    """The reason why a file is not edited, and the line that the user has to add, and where."""

    why: str
    line: str
    where: str


Outcome: TypeAlias = Edited | Refused


class ConsoleScript(NamedTuple):
    """A console script: the command and the function that it calls."""

    name: str
    target: str

    @property
    def line(self) -> str:
        """The entry in `console_scripts`."""
        return f"{self.name} = {self.target}"

    def same(self, entry: str) -> bool:
        """Return whether an entry is the same, with any whitespace."""
        return split(entry) == (self.name, self.target)


def split(entry: str) -> tuple[str, str]:
    """Return the command and the target of an entry; an empty target if there is none."""
    name, _, target = entry.partition("=")
    return name.strip(), "".join(target.split())


def already_taken(script: ConsoleScript, target: str, where: str) -> Refused:
    """Return the refusal of a command that calls something else already."""
    why = f"`{script.name}` is already the command for `{target}`"
    return Refused(why, script.line, where)
