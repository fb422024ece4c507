"""The damage of recordings: which bytes and messages cannot be read, and why."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from idlc.recordings.containers.source import RecordingError
from idlc.recordings.times import date_text


class Damage(msgspec.Struct, frozen=True):
    """A part of a recording that cannot be read.

    What is not known is None: `start` and `stop`, bytes of the file, the number of `messages` in
    this part, and their `first` and `last` log time in nanoseconds.
    """

    file: str
    problem: str
    start: int | None = None
    stop: int | None = None
    messages: int | None = None
    first: int | None = None
    last: int | None = None

    def __str__(self) -> str:
        parts = []
        if self.start is not None and self.stop is not None:
            parts.append(f"bytes {self.start:,} to {self.stop:,}")
        if self.messages is not None:
            parts.append(f"{self.messages:,} message{'s' * (self.messages != 1)}")
        if self.first is not None and self.last is not None:
            parts.append(f"from {date_text(self.first)} to {date_text(self.last)}")
        where = f" ({', '.join(parts)})" if parts else ""
        return f"`{self.file}`: {self.problem}{where}"


class DamageWarning(UserWarning):
    """A part of a recording cannot be read; the messages around it are read."""


class DamageList:
    """The damage of a file, in the order in which it was noticed.

    A strict one raises RecordingError instead. With `is_unproven`, messages were read from bytes
    that no checksum covers.
    """

    def __init__(self, file: str, is_strict: bool = False) -> None:
        self.file = file
        self.is_strict = is_strict
        self.is_unproven = False
        self._damage: dict[tuple[object, ...], Damage] = {}

    def __iter__(self) -> Iterator[Damage]:
        return iter(self._damage.values())

    def __len__(self) -> int:
        return len(self._damage)

    def add(
        self,
        problem: str,
        start: int | None = None,
        stop: int | None = None,
        *,
        messages: int | None = None,
        times: tuple[int | None, int | None] = (None, None),
    ) -> None:
        """Add damage, once; raise RecordingError if the list is strict."""
        problem = problem.removeprefix(f"`{self.file}`: ")
        damage = Damage(self.file, problem, start, stop, messages, *times)
        if self.is_strict:
            raise RecordingError(str(damage))
        # each topic may notice the same part, in other words
        place = (start, stop) if start is not None else (problem, *times)
        self._damage.setdefault(place, damage)
