"""Recordings for programs: `with idlc.Recording("rec.mcap") as rec: rec["/imu"].to_arrow()`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, overload

import numpy as np

from idlc.recordings.columns.arrow import arrow
from idlc.recordings.containers.container import Container, Topic, open_pieces, open_recording
from idlc.recordings.containers.file import CDR, START, unread_reason
from idlc.recordings.containers.messages import (
    ALWAYS,
    Messages,
    Raw,
    Window,
    join_messages,
)
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.times import moment
from idlc.runtime.codec import PAUSE

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa

    from idlc.api.conditions import Condition
    from idlc.api.upgrade import Upgrade
    from idlc.recordings.aligned.table import Aligned
    from idlc.recordings.load import TopicType
    from idlc.runtime.typeinfo import Structure


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
#: So many messages are decoded ahead, of so many bytes together.
MANY, AHEAD = 256, 1 << 18
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
    are converted to another version of the type first. Only messages that match all `conditions`
    are read; `absent` counts those in which a path of one does not exist.
    """

    def __init__(
        self,
        topic: Topic,
        include: tuple[str, ...] = (),
        reading: Reading | None = None,
        conditions: tuple[Condition, ...] = (),
    ) -> None:
        self.topic = topic
        self.include = include
        self.reading = reading
        self.conditions = conditions
        self.absent = 0

    def read_all(self) -> Iterator[Messages]:
        """Yield all messages as they are recorded, many at a time."""
        raise NotImplementedError

    def recorded(self) -> Iterator[Messages]:
        """Yield the messages that match, as they are recorded, many at a time."""
        if not self.conditions:
            yield from self.read_all()
            return
        from idlc.api.conditions import Filter

        matching, done = Filter(self._type.kind, self.conditions), 0
        for batch in self.read_all():
            views = batch.views()
            results, error = _each(matching.matches, views)
            self.absent = matching.absent
            if any(results):
                mask = np.zeros(len(batch), bool)
                mask[: len(results)] = results
                yield batch.selected(mask)
            if error:
                _raise(error, self.topic, views[len(results)], done + len(results))
            done += len(batch)

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
            what = f"messages of `{self.topic.name}` are written as `{self.topic.encoding}`"
            raise RecordingError(f"{what}, not as ROS 2 writes them, `{CDR}`")
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
    def messages(self, kind: None = None, *, fields: None = None) -> Iterator[Stamped[Any]]: ...

    @overload
    def messages(self, kind: type[Kind], *, fields: None = None) -> Iterator[Stamped[Kind]]: ...

    @overload
    def messages(
        self, kind: Any = None, *, fields: str | Iterable[str]
    ) -> Iterator[Stamped[Any]]: ...

    def messages(
        self, kind: Any = None, *, fields: str | Iterable[str] | None = None
    ) -> Iterator[Stamped[Any]]:
        """Yield each message with its time, in the order in which they were recorded.

        With `fields`, the values at these paths take the place of the message, and nothing else is
        decoded: one value for one path, a tuple for several, as `idlc.reader` reads them.
        """
        self._source(kind)
        kind, done = kind or self.kind, 0
        read = kind.deserialize
        if fields is not None:
            from idlc.api.reader import reader

            read = reader(kind, *([fields] if isinstance(fields, str) else fields))
        for batch in self.batches():
            views = batch.views()
            # many small messages at once, because the collector is paused meanwhile
            step = max(1, min(MANY, AHEAD * len(views) // (sum(map(len, views)) + 1)))
            for first in range(0, len(views), step):
                part = views[first : first + step]
                values, error = _each(read, part)
                times = batch.log_times[first : first + len(values)].tolist()
                yield from map(Stamped, times, values)
                if error:
                    _raise(error, self.topic, part[len(values)], done + len(values))
                done += len(values)

    @property
    def read_type(self) -> Structure:
        """The type that messages are read as."""
        from idlc.recordings.columns.read import type_of

        return type_of(self._source(None))

    def table(self, batch: Messages, fields: Iterable[str] | None, numbers: Any = 0) -> pa.Table:
        """Return the columns of some messages, whose `numbers` in the recording errors name."""
        from idlc.recordings.columns import to_arrow

        with _at(self.topic, batch.views, numbers):
            messages = self._read_as(batch)
            return to_arrow(self._source(None), messages, fields, flat=True, datetimes=True)

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
            column = pa.Array.from_buffers(kind, len(batch), [None, pa.py_buffer(times)])
        table = table.add_column(0, pa.field(name, kind), column)
    return table


def _each(read: Callable[[Raw], Any], views: list[Raw]) -> tuple[list[Any], Exception | None]:
    """Return what is read of each message, up to the first that raises an error."""
    values: list[Any] = []
    try:
        with PAUSE:
            for view in views:
                values.append(read(view))  # noqa: PERF401 - those before an error stay
    except ValueError as error:
        return values, error
    return values, None


def _raise(error: Exception, topic: Topic, view: Raw, number: int) -> None:
    with _at(topic, lambda: [view], number):
        raise error


@contextmanager
def _at(topic: Topic, views: Callable[[], list[Raw]], done: Any = 0) -> Iterator[None]:
    """Turn errors in messages into errors that name the message of the recording.

    `done` is the number of messages before them, or an array with the number of each.
    """
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
        place = done + number if isinstance(done, int) else done[number]
        what = f"message {place} of `{topic.name}` is broken"
        raise RecordingError(f"{what}: {problem} at byte {error.offset}") from error


class Part(Selection):
    """Some of the messages of a topic, to be read wherever the file can be opened.

    A part can be pickled. `pieces` are chunks of an MCAP file, or rows of a .db3 file.
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
        conditions: tuple[Condition, ...] = (),
    ) -> None:
        super().__init__(topic, include, reading, conditions)
        self.place = place
        self.ids = ids
        self.pieces = pieces
        self.window = window

    def __reduce__(self) -> tuple[Any, ...]:
        where = self.place, self.ids, self.pieces, self.window
        return Part, (self.topic, *where, self.include, self.reading, self.conditions)

    def __repr__(self) -> str:
        return f"<Part of {self.topic.name} in {self.place}, {len(self.pieces)} pieces>"

    def read_all(self) -> Iterator[Messages]:
        """Yield all messages as they are recorded, many at a time."""
        with closing(open_pieces(self.place)) as file:
            yield from file.messages(self.ids, self.pieces, self.window)


#: A part reads about so many bytes of a recording.
PART = 1 << 25


class Recording(Mapping[str, "RecordedTopic"], AbstractContextManager["Recording"]):
    """An open recording: a mapping from names of topics to their messages.

    `path` is an .mcap or .db3 file, the folder of a bag, a list of these which are then one
    recording, a URL of an .mcap file that fsspec can open, or a file object. `notes` says what is
    unusual about it. Without `index`, summary and indexes of MCAP files are not used. `check`
    compares checksums. `include` are folders in which types are looked for that the recording does
    not define, as those of ROS 2 Humble do not. `as_` is a class, or several, that earlier versions
    of its type are read as; `rules` are files and folders of rules that this runs.
    """

    def __init__(
        self,
        path: Any,
        *,
        index: bool = True,
        check: bool = False,
        include: Iterable[str] = (),
        as_: Any = (),
        rules: Any = None,
    ) -> None:
        self._readings = readings(as_, rules)
        self._include = tuple(map(str, include))
        self._container: Container = open_recording(path, index=index, check=check)
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

    def __getitem__(self, name: str) -> RecordedTopic:
        topics = self._topics.get(name)
        if not topics:
            from idlc.diagnostics.text import did_you_mean

            hint = did_you_mean(name, list(self)) or f"it has {', '.join(self) or 'none'}"
            raise UnknownTopicError(f"`{self._container.name}` has no topic `{name}`", hint)
        if len(topics) > 1:
            kinds = ", ".join(sorted({topic.type for topic in topics}))
            raise RecordingError(f"`{name}` has messages of several definitions, of {kinds}")
        reading = self._readings.get(topics[0].type)
        return RecordedTopic(self._container, topics[0], ALWAYS, self._include, reading)

    def aligned(
        self,
        topics: Mapping[str, Any] | Iterable[str],
        *,
        on: str | None = None,
        every: Any = None,
        how: Any = "last",
        tolerance: Any = None,
        clock: Any = "log",
        start: Any = None,
        end: Any = None,
    ) -> Aligned:
        """Return a table with a row for each message of topic `on`, or `every` so often.

        >>> topics = {"/camera/image": None, "/joint_states": ["position", "velocity"]}
        >>> recording.aligned(topics, on="/camera/image", tolerance="50ms").to_arrow()

        `topics` has the fields of each topic, None for all. The value of a tick is that of the
        `last` message until then, or of the `nearest`, or `linear` between two. It is null without
        a message within `tolerance`. The `clock` of messages is `log`, or `header` for the stamp of
        their header. These three are for all topics, or a mapping has them by topic. Lengths of
        time are `50ms`, `30Hz`, a timedelta, or an int in nanoseconds; `start` and `end` limit the
        ticks, as for `between`.
        """
        from idlc.recordings.aligned.table import aligned

        limits = [
            None if time is None else moment(time, self._container.start) for time in (start, end)
        ]
        return aligned(self, topics, on, every, how, tolerance, clock, (limits[0], limits[1]))

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
        reading: Reading | None = None,
        conditions: tuple[Condition, ...] = (),
    ) -> None:
        super().__init__(topic, include, reading, conditions)
        self._container = container
        self._window = window

    def __repr__(self) -> str:
        return f"<{self.topic.name} of {self._container.name}, {self.topic.type}>"

    def between(self, start: Any = None, end: Any = None, *, by: str = "") -> RecordedTopic:
        """Return those of a time: from `start`, until before `end`.

        A time is an int in nanoseconds, a datetime, or a text: `10` and `1m30s` count from the
        start of the recording, `1700000000.5` is a time of ROS in seconds, `2026-11-22T07:30` is
        in UTC. Times of numpy and pandas may be of any unit; a timedelta counts from the start.
        The time is when a message was recorded, or with `by` the value of this field, such as
        "header.stamp".
        """
        if by:
            topic = self if start is None else self.where(by, ">=", start)
            return topic if end is None else topic.where(by, "<", end)
        first, last = (
            None if time is None else moment(time, self._container.start) for time in (start, end)
        )
        return self._narrowed(self._window.narrowed(first, last), self.conditions)

    def where(self, path: str, operator: str, value: Any) -> RecordedTopic:
        """Return the messages in which a field compares with a value: ==, !=, <, <=, > or >=.

        >>> recording["/imu"].where("linear_acceleration.z", ">", 12).to_arrow()

        Times are given as for `between`. Messages in which the path does not exist do not match;
        `absent` counts them. The path is one of the type that was recorded. Raises ValueError for
        a path that the type does not have.
        """
        from idlc.api.conditions import Condition

        self._source(None)
        condition = Condition(path, operator, value).typed(self._type.kind, self._container.start)
        return self._narrowed(self._window, (*self.conditions, condition))

    def _narrowed(self, window: Window, conditions: tuple[Condition, ...]) -> RecordedTopic:
        how = self.include, self.reading, conditions
        return RecordedTopic(self._container, self.topic, window, *how)

    def read_all(self) -> Iterator[Messages]:
        """Yield all messages as they are recorded, many at a time."""
        return self._container.messages(self.topic, self._window)

    def parts(self, size: int = PART) -> list[Part]:
        """Return pieces for others to read, each of about `size` bytes of the recording.

        They can be pickled, and read in other processes and on other machines that see the file.
        """
        how = self._window, self.include, self.reading, self.conditions
        return [
            Part(self.topic, file.place, tuple(numbers), pieces, *how)
            for file, numbers, _ in self._container.places(self.topic)
            for pieces in file.parts(numbers, self._window, size)
        ]
