"""Recordings for programs: `with idlc.Recording("rec.mcap") as rec: rec["/imu"].to_arrow()`."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, overload

import numpy as np

from idlc.recordings.containers.compression import missing
from idlc.recordings.containers.container import Container, Topic, open_pieces, open_recording
from idlc.recordings.containers.file import CDR, START, other_encoding, unread_reason
from idlc.recordings.containers.messages import (
    ALWAYS,
    NO_TIME,
    Messages,
    Raw,
    Window,
    join_messages,
)
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.damage import Damage, DamageWarning
from idlc.recordings.times import date_text, moment

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa

    from idlc.api.upgrade import Upgrade
    from idlc.recordings.load import TopicType


class Reading(NamedTuple):
    """A class that messages of earlier versions are read as, and the rules to run for it."""

    kind: Any
    rules: Any = None


def readings(as_: Any, rules: Any) -> dict[str, Reading]:
    """Return the class for each type's name, of one class or several."""
    kinds = (as_,) if isinstance(as_, type) else tuple(as_)
    if not kinds:
        return {}
    from idlc.runtime.typeinfo import structure_of

    return {structure_of(kind).name: Reading(kind, rules) for kind in kinds}


Kind = TypeVar("Kind")
#: The path in errors of many messages: the index of a message, and the path in it.
_INDEXED = re.compile(r"\[(\d+)\]\.?(.*)")
#: The columns of a message besides its fields.
TIMES = ("log_time", "publish_time")


if TYPE_CHECKING:

    class Stamped(tuple[int, Kind]):
        """The class for type checkers: named tuples can be generic from Python 3.11 on."""

        log_time: int
        message: Kind

        def __new__(cls, log_time: int, message: Kind) -> Stamped[Kind]: ...  # noqa: D102

else:

    class Stamped(NamedTuple):
        """A message, and when it was recorded, in nanoseconds."""

        log_time: int
        message: Any


class Selection:
    """Messages of one topic.

    They are of the type that was recorded, compiled when it is first needed, unless a class that
    idlc generated is given; that must be of the same type as the recorded one. `include` are
    folders in which types are looked for that the recording does not define. With `reading`, they
    are converted to another version of the type first.
    """

    def __init__(
        self, topic: Topic, include: tuple[str, ...] = (), reading: Reading | None = None
    ) -> None:
        self.topic = topic
        self.include = include
        self.reading = reading

    def recorded(self) -> Iterator[Messages]:
        """Yield the messages as they are recorded, many at a time."""
        raise NotImplementedError

    def batches(self) -> Iterator[Messages]:
        """Yield the messages, many at a time, in the version that they are read as."""
        done = 0
        for batch in self.recorded():
            yield self._read_as(batch, done)
            done += len(batch)

    def _read_as(self, batch: Messages, first: int = 0) -> Messages:
        """Return messages in the version that they are read as."""
        if self.reading is None or self._upgrade.plan.same:
            return batch
        from idlc.api.upgraded import Upgraded

        times = batch.log_times, batch.publish_times
        return Upgraded(*times, batch, self._upgrade, self.topic.name, first)

    @cached_property
    def _upgrade(self) -> Upgrade:
        from idlc.api.upgrade import upgrade

        assert self.reading is not None
        return upgrade(self._type.kind, *self.reading)

    @cached_property
    def _type(self) -> TopicType:
        from idlc.recordings.load import type_of

        return type_of(self.topic, self.include)

    @property
    def kind(self) -> Any:
        """The class of the messages, compiled from what was recorded unless it was given."""
        return self._type.kind if self.reading is None else self.reading.kind

    def _source(self, kind: Any) -> Any:
        """Return what columns are read by: `kind` if it is of the recorded type, or that type."""
        if self.topic.encoding != CDR:
            raise RecordingError(*other_encoding(self.topic.name, self.topic.encoding))
        if self.reading is not None:
            if kind not in (None, self.reading.kind):
                what = f"`{self.topic.name}` is read as {self.reading.kind.__name__}"
                raise RecordingError(what, "omit the class")
            return self.reading.kind
        if kind is None:
            return self._type.structure
        from idlc.recordings.load import check_class

        return check_class(kind, self.topic, self.include)

    def __iter__(self) -> Iterator[Stamped[Any]]:
        return self.messages()

    @overload
    def messages(self, kind: None = None) -> Iterator[Stamped[Any]]: ...

    @overload
    def messages(self, kind: type[Kind]) -> Iterator[Stamped[Kind]]: ...

    def messages(self, kind: Any = None) -> Iterator[Stamped[Any]]:
        """Yield each message with its time, in the order in which they were recorded.

        A time after the year 2262 is None.
        """
        self._source(kind)
        kind, done = kind or self.kind, 0
        for batch in self.batches():
            for time, view in zip(batch.log_times.tolist(), batch.views(), strict=True):
                with _at(self.topic, lambda: [view], done):  # noqa: B023 # called at once
                    message = kind.deserialize(view)
                known: Any = None if time == NO_TIME else time
                yield Stamped(known, message)
                done += 1

    def to_columns(
        self, kind: Any = None, *, fields: Iterable[str] | None = None, datetimes: bool = False
    ) -> Any:
        """Return columns of numpy: log_time, publish_time and those of the messages.

        `fields` are those that are wanted, such as "header.stamp". With `datetimes`, times are
        datetime64, log_time and publish_time included, which are nanoseconds otherwise.
        """
        from idlc.recordings.columns import to_columns

        source = self._source(kind)
        recorded = join_messages(list(self.recorded()))
        batch = self._read_as(recorded)
        with _at(self.topic, recorded.views):
            table = to_columns(source, batch, fields)
        times = zip(_names(table.keys()), (batch.log_times, batch.publish_times), strict=True)
        columns = {name: values for name, values in times if values is not None}
        codes = {**dict.fromkeys(columns, "M8[ns]"), **table.times}
        result = type(table)({**columns, **dict(table)}, len(table), codes)
        return result.dated() if datetimes else result

    def to_pandas(self, kind: Any = None, *, fields: Iterable[str] | None = None) -> pd.DataFrame:
        """Return a table of pandas with columns such as "header.stamp" or "pose.position.x".

        Times are datetime64[ns], in UTC but without a time zone; durations are timedelta64[ns].
        """
        frame: pd.DataFrame = self.to_columns(kind, fields=fields).to_pandas()
        return frame

    def to_polars(self, kind: Any = None, *, fields: Iterable[str] | None = None) -> pl.DataFrame:
        """Return the same as a table of polars."""
        frame: pl.DataFrame = self.to_columns(kind, fields=fields).to_polars()
        return frame

    def to_arrow(self, kind: Any = None, **options: Any) -> pa.Table:
        """Return a table of Arrow: log_time, publish_time and the fields of the messages.

        Options are those of `to_arrow` of messages: `fields`, `flat`, `datetimes`, `dictionary`.
        """
        pa = arrow()
        source = self._source(kind)
        tables = list(self._tables(source, options))
        return pa.concat_tables(tables) if tables else _table(source, options)

    def to_reader(self, kind: Any = None, **options: Any) -> pa.RecordBatchReader:
        """Return the same piece by piece, without the whole table in memory."""
        pa = arrow()
        source = self._source(kind)
        batches = (batch for table in self._tables(source, options) for batch in table.to_batches())
        return pa.RecordBatchReader.from_batches(_table(source, options).schema, batches)

    def _tables(self, source: Any, options: Any) -> Iterator[pa.Table]:
        done = 0
        for batch in self.recorded():
            with _at(self.topic, batch.views, done):
                table = _table(source, options, self._read_as(batch, done))
            yield table
            done += len(batch)


def _names(fields: list[str]) -> list[str]:
    """Return names for the times of messages that no field has: none begins with an underscore."""
    return [f"_{name}" if name in fields else name for name in TIMES]


def _table(source: Any, options: Any, batch: Messages | None = None) -> pa.Table:
    """Return the table of some messages, or of none, with their times in front."""
    from idlc.recordings.columns import to_arrow

    pa = arrow()
    batch = join_messages([]) if batch is None else batch
    table, kind = to_arrow(source, batch, **options), pa.timestamp("ns")
    names = _names(table.column_names)
    for name, times in zip(names[::-1], (batch.publish_times, batch.log_times), strict=True):
        if times is None:
            column = pa.nulls(len(batch), kind)
        else:
            column = pa.Array.from_buffers(kind, len(batch), [_known(times), pa.py_buffer(times)])
        table = table.add_column(0, pa.field(name, kind), column)
    return table


def _known(times: Any) -> Any:
    """Return Arrow's bits of the times that are known; None if all are."""
    known = times != NO_TIME
    return None if known.all() else arrow().py_buffer(np.packbits(known, bitorder="little"))


def arrow() -> Any:
    """Return pyarrow, or say how to install it."""
    try:
        import pyarrow
    except ImportError:
        raise missing("pyarrow", "tables are made by Arrow") from None
    return pyarrow


@contextmanager
def _at(topic: Topic, views: Callable[[], list[Raw]], done: int = 0) -> Iterator[None]:
    """Turn errors in messages into errors that name the message of the recording."""
    try:
        yield
    except ValueError as caught:
        error: Any = caught
        if not hasattr(error, "problem"):  # each package has a DecodeError of its own
            raise
        match = _INDEXED.match(error.path)
        number, path = (int(match[1]), match[2]) if match else (0, error.path)
        why = unread_reason(topic.name, bytes(views()[number][:START]))
        if why:
            raise RecordingError(*why) from error
        problem = f"{path}: {error.problem}" if path else error.problem
        what = f"message {done + number} of `{topic.name}` is broken"
        raise RecordingError(f"{what}: {problem} at byte {error.offset}") from error


def _warn(damage: tuple[Damage, ...], warned: int) -> int:
    """Warn of the damage after the first `warned` ones; return how much there is."""
    for each in damage[warned:]:
        warnings.warn(DamageWarning(str(each)), stacklevel=3)
    return len(damage)


class Part(Selection):
    """Some of the messages of a topic, to be read wherever the file can be opened.

    A part can be pickled. `pieces` are chunks of an MCAP file, or rows of a .db3 file, and `checks`
    are the recording's `check` and `strict`.
    """

    def __init__(
        self,
        topic: Topic,
        place: Any,
        ids: tuple[int, ...],
        pieces: tuple[Any, ...],
        window: Window,
        include: tuple[str, ...] = (),
        reading: Reading | None = None,
        checks: tuple[bool | None, bool] = (None, False),
    ) -> None:
        super().__init__(topic, include, reading)
        self.place = place
        self.ids = ids
        self.pieces = pieces
        self.window = window
        self.checks = checks

    def __reduce__(self) -> tuple[Any, ...]:
        where = self.place, self.ids, self.pieces, self.window
        return Part, (self.topic, *where, self.include, self.reading, self.checks)

    def __repr__(self) -> str:
        return f"<Part of {self.topic.name} in {self.place}, {len(self.pieces)} pieces>"

    def recorded(self) -> Iterator[Messages]:
        """Yield the messages as they are recorded, many at a time."""
        with closing(open_pieces(self.place, *self.checks)) as file:
            warned = 0
            for batch in file.messages(self.ids, self.pieces, self.window):
                warned = _warn(tuple(file.damage), warned)
                yield batch
            _warn(tuple(file.damage), warned)


#: A part reads about so many bytes of a recording.
PART = 1 << 25


class Recording(Mapping[str, "RecordedTopic"], AbstractContextManager["Recording"]):
    """An open recording: a mapping from names of topics to their messages.

    `path` is an .mcap or .db3 file, the folder of a bag, a list of these which are then one
    recording, a URL of an .mcap file that fsspec can open, or a file object. `notes` says what is
    unusual about it. Without `index`, summary and indexes of MCAP files are not used. `check`
    compares checksums; by default, only those of files that are known to be damaged. What is
    damaged is left out with a warning, and is in `damage`; `strict` raises RecordingError instead.
    `include` are folders in which types are looked for that the recording does
    not define, as those of ROS 2 Humble do not. `as_` is a class, or several, that earlier versions
    of its type are read as; `rules` are files and folders of rules that this runs.
    """

    def __init__(
        self,
        path: Any,
        *,
        index: bool = True,
        check: bool | None = None,
        strict: bool = False,
        include: Iterable[str] = (),
        as_: Any = (),
        rules: Any = None,
    ) -> None:
        self._readings = readings(as_, rules)
        self._include = tuple(map(str, include))
        self._checks = check, strict
        self._container: Container = open_recording(path, index=index, check=check, strict=strict)
        _warn(self._container.damage, 0)
        self._topics: dict[str, list[Topic]] = {}
        for topic in self.topics:
            self._topics.setdefault(topic.name, []).append(topic)

    @property
    def topics(self) -> tuple[Topic, ...]:
        """The recorded topics: name, type, count, hash, encoding and definition of each."""
        return self._container.topics

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about anomalies of the recording, such as that it was not closed."""
        return self._container.notes

    @property
    def damage(self) -> tuple[Damage, ...]:
        """The parts that cannot be read, as far as the recording was read."""
        return self._container.damage

    def __getitem__(self, name: str) -> RecordedTopic:
        topics = self._topics.get(name)
        if not topics:
            from idlc.diagnostics.text import did_you_mean

            hint = did_you_mean(name, list(self)) or f"it has {', '.join(self) or 'none'}"
            raise UnknownTopicError(f"`{self._container.name}` has no topic `{name}`", hint)
        if len(topics) > 1:
            kinds = ", ".join(sorted({topic.type for topic in topics}))
            raise RecordingError(f"`{name}` has messages of several definitions, of {kinds}")
        how = self._include, self._readings.get(topics[0].type), self._checks
        return RecordedTopic(self._container, topics[0], ALWAYS, *how)

    def __iter__(self) -> Iterator[str]:
        return iter(self._topics)

    def __len__(self) -> int:
        return len(self._topics)

    def __repr__(self) -> str:
        rows = [(topic.name, topic.type, f"{topic.count:,}") for topic in self.topics]
        name, kind, count = (max((len(row[at]) for row in rows), default=0) for at in range(3))
        lines = [f"{row[0]:{name}}  {row[1]:{kind}}  {row[2]:>{count}}" for row in rows]
        return "\n".join([f"<Recording {self._container.name}>", *lines])

    def close(self) -> None:
        """Close the files. Columns and messages that were made stay as they are."""
        self._container.close()

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
        window: Window,
        include: tuple[str, ...],
        reading: Reading | None,
        checks: tuple[bool | None, bool],
    ) -> None:
        super().__init__(topic, include, reading)
        self._container = container
        self._window = window
        self._checks = checks

    def __repr__(self) -> str:
        return f"<{self.topic.name} of {self._container.name}, {self.topic.type}>"

    def between(self, start: Any = None, end: Any = None) -> RecordedTopic:
        """Return those of a time: from `start`, until before `end`.

        A time is an int in nanoseconds, a datetime, or a text: `10` and `1m30s` count from the
        start of the recording, `1700000000.5` is a time of ROS in seconds, `2026-11-22T07:30` is
        in UTC. Times of numpy and pandas may be of any unit; a timedelta counts from the start.
        """
        first, last = (
            None if time is None else moment(time, self._container.start) for time in (start, end)
        )
        window = self._window.narrowed(first, last)
        if (start, end) != (None, None):
            self._check_range(window)
        how = self.include, self.reading, self._checks
        return RecordedTopic(self._container, self.topic, window, *how)

    def _check_range(self, window: Window) -> None:
        """Raise RecordingError if a range of times does not touch the recording."""
        span = self._container.span()
        if None not in window and window.start > window.end:  # type: ignore[operator]
            raise RecordingError("the range of times ends before it starts")
        if span is None:
            return
        is_late = window.start is not None and window.start > span[1]
        is_early = window.end is not None and window.end < span[0]
        if not (is_late or is_early):
            return
        limits = " to ".join("" if time is None else date_text(time) for time in window).strip()
        recorded = " to ".join(map(date_text, span))
        hint = "write a text, such as `'10'`, for seconds from the start; an int is nanoseconds"
        what = f"no message is in the range of times ({limits})"
        raise RecordingError(f"{what}: the recording is from {recorded}", hint)

    def recorded(self) -> Iterator[Messages]:
        """Yield the messages as they are recorded, many at a time."""
        warned = len(self._container.damage)
        for batch in self._container.messages(self.topic, self._window):
            warned = _warn(self._container.damage, warned)
            yield batch
        _warn(self._container.damage, warned)

    def parts(self, size: int = PART) -> list[Part]:
        """Return pieces for others to read, each of about `size` bytes of the recording.

        They can be pickled, and read in other processes and on other machines that see the file.
        """
        how = self._window, self.include, self.reading, self._checks
        return [
            Part(self.topic, file.place, tuple(numbers), pieces, *how)
            for file, numbers, _ in self._container.places(self.topic)
            for pieces in file.parts(numbers, self._window, size)
        ]
