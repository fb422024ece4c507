"""Recordings for programs: `with idlc.Recording("rec.mcap") as rec: rec["/imu"].to_arrow()`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from idlc.driver.recordings.parts import Part, divided
from idlc.driver.recordings.selection import Selection
from idlc.recordings.container import Container, Topic, open_recording
from idlc.recordings.errors import RecordingError
from idlc.recordings.messages import ALWAYS, Messages, Window
from idlc.recordings.times import moment

#: A part reads about so many bytes of a recording.
PART = 1 << 25


class Recording(Mapping[str, "RecordedTopic"]):
    """An open recording: a mapping from names of topics to their messages.

    `path` is an .mcap or .db3 file, the folder of a bag, a list of these which are then one
    recording, a URL of an .mcap file that fsspec can open, or a file object. `notes` says what is
    unusual about it. Without `index`, summary and indexes of MCAP files are not used. `check`
    compares checksums. `include` are folders in which types are looked for that the recording does
    not define, as those of ROS 2 Humble do not.
    """

    def __init__(
        self,
        path: Any,
        *,
        index: bool = True,
        check: bool = False,
        include: Iterable[str] = (),
    ) -> None:
        self._include = tuple(map(str, include))
        self._container: Container = open_recording(path, index=index, check=check)
        self._topics: dict[str, list[Topic]] = {}
        for topic in self.topics:
            self._topics.setdefault(topic.name, []).append(topic)

    @property
    def topics(self) -> tuple[Topic, ...]:
        """What was recorded: name, type, count, hash, encoding and definition of each topic."""
        return self._container.topics

    @property
    def notes(self) -> tuple[str, ...]:
        """What is unusual about the recording, such as that it was not closed."""
        return self._container.notes

    def __getitem__(self, name: str) -> RecordedTopic:
        found = self._topics.get(name)
        if not found:
            from idlc.diagnostics.suggest import did_you_mean

            hint = did_you_mean(name, list(self)) or f"it has {', '.join(self) or 'none'}"
            raise UnknownTopicError(f"`{self._container.name}` has no topic `{name}`", hint)
        if len(found) > 1:
            kinds = ", ".join(sorted({one.type for one in found}))
            raise RecordingError(f"`{name}` has messages of several definitions, of {kinds}")
        return RecordedTopic(self._container, found[0], include=self._include)

    def __iter__(self) -> Iterator[str]:
        return iter(self._topics)

    def __len__(self) -> int:
        return len(self._topics)

    def __repr__(self) -> str:
        rows = [(one.name, one.type, f"{one.count:,}") for one in self.topics]
        name, kind, count = (max((len(row[at]) for row in rows), default=0) for at in range(3))
        lines = [f"{row[0]:{name}}  {row[1]:{kind}}  {row[2]:>{count}}" for row in rows]
        return "\n".join([f"<Recording {self._container.name}>", *lines])

    def close(self) -> None:
        """Close the files. Columns and messages that were made stay as they are."""
        self._container.close()

    def __enter__(self) -> Recording:  # noqa: PYI034 # Self came with Python 3.11
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class UnknownTopicError(RecordingError, KeyError):
    """A recording has no topic of that name."""

    __str__ = RecordingError.__str__


class RecordedTopic(Selection):
    """The messages of one topic of an open recording."""

    def __init__(
        self,
        container: Container,
        topic: Topic,
        window: Window = ALWAYS,
        include: tuple[str, ...] = (),
    ) -> None:
        super().__init__(topic, include)
        self._container = container
        self._window = window

    def __repr__(self) -> str:
        return f"<{self.topic.name} of {self._container.name}, {self.topic.type}>"

    def between(self, start: Any = None, end: Any = None) -> RecordedTopic:
        """Return those of a time: from `start`, until before `end`.

        A time is an int in nanoseconds, a datetime, or a text: `10` and `1m30s` count from the
        start of the recording, `1700000000.5` is a time of ROS in seconds, `2026-11-22T07:30` is
        in UTC. Times of numpy and pandas may be of any unit; a timedelta counts from the start.
        """
        first, last = (
            None if one is None else moment(one, self._container.start) for one in (start, end)
        )
        window = self._window.narrowed(first, last)
        return RecordedTopic(self._container, self.topic, window, self.include)

    def batches(self) -> Iterator[Messages]:
        """Yield the messages as they are recorded, many at a time."""
        return self._container.messages(self.topic, self._window)

    def parts(self, size: int = PART) -> list[Part]:
        """Return pieces for others to read, each of about `size` bytes of the recording.

        They can be pickled, and read in other processes and on other machines that see the file.
        """
        return list(divided(self._container, self.topic, self._window, size, self.include))
