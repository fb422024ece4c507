"""Recordings for programs: `with idlc.Recording("rec.mcap") as rec: rec["/imu"].to_arrow()`."""

from __future__ import annotations

import re
import shlex
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, overload

import numpy as np
from msgspec.structs import replace

from idlc.diagnostics.text import did_you_mean, worded
from idlc.model.distros import BY_NAME, unknown_distro
from idlc.recordings.arguments import message_class, texts
from idlc.recordings.columns import to_arrow, to_columns, to_rows, unread_bytes
from idlc.recordings.columns.arrow import arrow
from idlc.recordings.columns.elements import ElementError
from idlc.recordings.columns.read import type_of
from idlc.recordings.containers.container import Container, Topic, open_pieces, open_recording
from idlc.recordings.containers.file import CDR, START, full_name, other_encoding, unread_reason
from idlc.recordings.containers.messages import (
    ALWAYS,
    NO_TIME,
    Raw,
    TopicMessages,
    Window,
    in_order,
    join_messages,
)
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.damage import Damage, DamageWarning
from idlc.recordings.lengths import MOST_PADDING, SAMPLE, check_lengths, sample
from idlc.recordings.times import END_OF_TIME, date_text, moment
from idlc.runtime.codec import PAUSE
from idlc.runtime.typeinfo import Structure, structure_of

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa

    from idlc.api.conditions import Condition
    from idlc.api.upgrade import Upgrade
    from idlc.recordings.aligned.table import Aligned
    from idlc.recordings.load import TopicType
    from idlc.versions.conversion import Version


class Reading(NamedTuple):
    """A class that messages of earlier versions are read as, and the rules to run for it."""

    kind: Any
    rules: Any = None


def checked_distro(name: str | None) -> str | None:
    """Return the name of a distribution; raise RecordingError if there is none of that name."""
    if name is not None and not (isinstance(name, str) and name in BY_NAME):
        raise RecordingError(f"no such distribution: `{name}`", unknown_distro(str(name)))
    return name


def readings(as_: Any, rules: Any) -> dict[str, Reading]:
    """Return the class for each type's name, of one class or several."""
    is_one = isinstance(as_, (type, str)) or not isinstance(as_, Iterable)
    kinds = (as_,) if is_one else tuple(as_)
    if not kinds:
        return {}
    return {structure_of(message_class(kind)).name: Reading(kind, rules) for kind in kinds}


KindT = TypeVar("KindT")
Selected = TypeVar("Selected", bound="Selection")
#: The path in errors of many messages: the index of a message, and the path in it.
_INDEXED = re.compile(r"\[(\d+)\]\.?(.*)")
#: So many messages are decoded ahead, of so many bytes together.
MANY, AHEAD = 256, 1 << 18
#: The columns of a message besides its fields.
TIMES = ("log_time", "publish_time")


if TYPE_CHECKING:

    class Stamped(tuple[int, KindT]):
        """The class for type checkers: named tuples can be generic from Python 3.11 on."""

        log_time: int
        message: KindT

        def __new__(cls, log_time: int, message: KindT) -> Stamped[KindT]: ...  # noqa: D102

else:

    class Stamped(NamedTuple):
        """A message, and when it was recorded, in nanoseconds."""

        log_time: int
        message: Any


class ReadOptions(NamedTuple):
    """How messages are read.

    `include` are folders in which types are looked for that the recording does not define, `distro`
    is the distribution of such types, and `others` are topics with other versions of the type. With
    `reading`, messages are converted to another version. They match all `conditions`. `checks` are
    the recording's `check` and `strict`.
    """

    include: tuple[str, ...] = ()
    distro: str | None = None
    others: tuple[Topic, ...] = ()
    reading: Reading | None = None
    conditions: tuple[Condition, ...] = ()
    checks: tuple[bool | None, bool] = (None, False)


class Selection:
    """Messages of one topic.

    They are of the type that was recorded, compiled when it is first needed, unless a class that
    idlc generated is given; that must be of the same type as the recorded one. `absent` counts the
    messages in which a path of a condition does not exist.
    """

    #: The messages whose lengths were compared with the type, and whether one does not fit.
    _compared = 0
    _differs = False

    def __init__(self, topic: Topic, options: ReadOptions) -> None:
        self.topic = topic
        self.options = options
        self.absent = 0

    def read_all(self) -> Iterator[TopicMessages]:
        """Yield all messages as they are recorded, many at a time."""
        raise NotImplementedError

    def recorded(self) -> Iterator[TopicMessages]:
        """Yield the messages that match, as they are recorded, many at a time."""
        self.absent = 0
        return self.matching(self.read_all())

    def matching(self, batches: Iterable[TopicMessages]) -> Iterator[TopicMessages]:
        """Yield the messages of batches that match the conditions."""
        if not self.options.conditions:
            yield from batches
            return
        from idlc.api.conditions import Filter

        matching, done = Filter(self._type.kind, self.options.conditions), 0
        absent = self.absent
        for batch in batches:
            views = batch.views()
            results, error = _each(matching.matches, views)
            self.absent = absent + matching.absent
            if any(results):
                mask = np.zeros(len(batch), bool)
                mask[: len(results)] = results
                yield batch.selected(mask)
            if error:
                _raise(error, self.topic, views[len(results)], done + len(results))
            done += len(batch)
        matching.warn()

    def batches(self) -> Iterator[TopicMessages]:
        """Yield the messages, many at a time, in the version that they are read as."""
        done = 0
        for batch in self.recorded():
            yield self.read_as(batch, done)
            done += len(batch)

    def read_as(self, batch: TopicMessages, first: int = 0) -> TopicMessages:
        """Return messages in the version that they are read as."""
        if self.options.reading is None or self._upgrade.plan.same:
            return batch
        from idlc.api.upgrade import Upgraded

        times = batch.log_times, batch.publish_times
        return Upgraded(*times, batch, self._upgrade, self.topic.name, first)

    @cached_property
    def _upgrade(self) -> Upgrade:
        from idlc.api.upgrade import upgrade

        assert self.options.reading is not None
        return upgrade(self._type.kind, *self.options.reading)

    @property
    def structure(self) -> Structure:
        """The type of the messages as they are recorded."""
        return self._type.structure

    @cached_property
    def _type(self) -> TopicType:
        from idlc.recordings.load import type_of

        return type_of(self.topic, self.options.include, self.options.distro, self._sample)

    @property
    def version(self) -> Version:
        """The recorded version of the type."""
        from idlc.versions.conversion import Version

        return Version(self._type.models, self._type.name)

    def _sample(self) -> list[Raw]:
        """Return some messages as they are recorded."""
        return sample(self.read_all())

    def compare_lengths(self, batch: TopicMessages | None = None, kind: Any = None) -> None:
        """Compare the lengths of the first messages with their type: see `_judge`."""
        if self._compared >= SAMPLE or self.topic.encoding != CDR:
            return
        count = SAMPLE - self._compared
        raws = self._sample() if batch is None else batch.first_views(count)
        structure = self._structure(kind)
        unread = unread_bytes(structure, raws)
        self._compared += len(raws)
        self._judge(structure, unread, raws)

    def _structure(self, kind: Any) -> Structure:
        """Return the type that recorded messages are read as."""
        is_recorded = kind is None or self.options.reading is not None
        if is_recorded:
            return self._type.structure
        return structure_of(kind)

    def _judge(self, structure: Structure, unread: Any, raws: Sequence[Raw]) -> None:
        """Warn, once, if messages are longer than their type; raise if they are of another one."""
        if self._differs or not raws:
            return
        from idlc.recordings.load import OtherDefinitionWarning, known_versions

        known = known_versions(self.topic, self.options.include, self.options.others)
        if problem := check_lengths(self.topic, structure, unread, raws[:SAMPLE], known):
            self._differs = True
            warnings.warn(problem, OtherDefinitionWarning, stacklevel=4)

    def _on_unread(self, kind: Any, batch: TopicMessages) -> Callable[[Any], None]:
        """Return what judges messages by the bytes that reading them left, if that is known."""

        def judge(unread: Any) -> None:
            if unread is None:
                self.compare_lengths(batch, kind)
                return
            longer = np.flatnonzero(unread > MOST_PADDING)[:SAMPLE].tolist()
            if longer and not self._differs:
                views = batch.views()
                self._judge(self._structure(kind), unread, [views[index] for index in longer])

        return judge

    @property
    def kind(self) -> Any:
        """The class of the messages, compiled from what was recorded unless it was given."""
        reading = self.options.reading
        return self._type.kind if reading is None else reading.kind

    def _source(self, kind: Any) -> Any:
        """Return what columns are read by: `kind` if it is of the recorded type, or that type."""
        if self.topic.encoding != CDR:
            raise RecordingError(*other_encoding(self.topic.name, self.topic.encoding))
        reading = self.options.reading
        if reading is not None:
            if kind not in (None, reading.kind):
                what = f"`{self.topic.name}` is read as {reading.kind.__name__}"
                raise RecordingError(what, "omit the class")
            return reading.kind
        if kind is None:
            return self._type.structure
        from idlc.recordings.load import check_class

        return check_class(kind, self.topic, self.options.include)

    def __iter__(self) -> Iterator[Stamped[Any]]:
        return self.messages()

    @overload
    def messages(self, kind: None = None, *, fields: None = None) -> Iterator[Stamped[Any]]: ...

    @overload
    def messages(self, kind: type[KindT], *, fields: None = None) -> Iterator[Stamped[KindT]]: ...

    @overload
    def messages(
        self, kind: Any = None, *, fields: str | Iterable[str]
    ) -> Iterator[Stamped[Any]]: ...

    def messages(
        self, kind: Any = None, *, fields: str | Iterable[str] | None = None
    ) -> Iterator[Stamped[Any]]:
        """Yield each message with its time, in the order in which they were recorded.

        With `fields`, the values at these paths take the place of the message, and nothing else is
        decoded: one value for one path, a tuple for several, as `idlc.reader` reads them. A time
        after the year 2262 is None.
        """
        self._source(kind)
        recorded_kind, kind, done = kind, kind or self.kind, 0
        read = kind.deserialize
        if fields is not None:
            from idlc.api.reader import reader

            read = reader(kind, *texts(fields, "`fields`"))
        for recorded in self.recorded():
            self.compare_lengths(recorded, recorded_kind)
            batch = self.read_as(recorded, done)
            views = batch.views()
            # many small messages at once, because the collector is paused meanwhile
            step = max(1, min(MANY, AHEAD * len(views) // (sum(map(len, views)) + 1)))
            for first in range(0, len(views), step):
                part = views[first : first + step]
                values, error = _each(read, part)
                times = _known_times(batch.log_times[first : first + len(values)])
                yield from map(Stamped, times, values)
                if error:
                    _raise(error, self.topic, part[len(values)], done + len(values))
                done += len(values)

    @property
    def read_type(self) -> Structure:
        """The type that messages are read as."""
        return type_of(self._source(None))

    def table(
        self, batch: TopicMessages, fields: Iterable[str] | None, numbers: Any = 0
    ) -> pa.Table:
        """Return the columns of some messages, whose `numbers` in the recording errors name."""
        source, judge = self._source(None), self._on_unread(None, batch)
        with _at(self.topic, batch.views, numbers):
            return to_arrow(source, self.read_as(batch), fields, True, True, on_unread=judge)

    def to_columns(
        self, kind: Any = None, *, fields: Iterable[str] | None = None, datetimes: bool = False
    ) -> Any:
        """Return columns of numpy: log_time, publish_time and those of the messages.

        `fields` are those that are wanted, such as "header.stamp". With `datetimes`, times are
        datetime64, log_time and publish_time included, which are nanoseconds otherwise.
        """
        source = self._source(kind)
        recorded = join_messages(list(self.recorded()))
        batch = self.read_as(recorded)
        judge = self._on_unread(kind, recorded)
        with _at(self.topic, recorded.views):
            table = to_columns(source, batch, fields, on_unread=judge)
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
        With `each`, a list of messages such as `transforms`, the rows are its elements.
        """
        pa = arrow()
        source = self._source(kind)
        tables = list(self._tables(source, options, kind))
        return pa.concat_tables(tables) if tables else _table(source, options)

    def to_reader(self, kind: Any = None, **options: Any) -> pa.RecordBatchReader:
        """Return the same piece by piece, without the whole table in memory."""
        pa = arrow()
        source = self._source(kind)
        batches = (
            batch for table in self._tables(source, options, kind) for batch in table.to_batches()
        )
        return pa.RecordBatchReader.from_batches(_table(source, options).schema, batches)

    def _tables(self, source: Any, options: Any, kind: Any) -> Iterator[pa.Table]:
        done = 0
        for batch in self.recorded():
            judge = self._on_unread(kind, batch)
            with _at(self.topic, batch.views, done):
                more = {**options, "on_unread": judge}
                table = _table(source, more, self.read_as(batch, done))
            yield table
            done += len(batch)


def _names(fields: list[str]) -> list[str]:
    """Return names for the times of messages that no field has: none begins with an underscore."""
    return [f"_{name}" if name in fields else name for name in TIMES]


def _table(source: Any, options: Any, batch: TopicMessages | None = None) -> pa.Table:
    """Return the table of some messages, or of none, with their times in front."""
    pa, kind, rows = arrow(), arrow().timestamp("ns"), None
    batch = join_messages([]) if batch is None else batch
    options = dict(options)
    each = options.pop("each", None)
    if each is None:
        table = to_arrow(source, batch, **options)
    else:
        table, rows = to_rows(source, batch, each, **options)
    names = _names(table.column_names)
    for name, times in zip(names[::-1], (batch.publish_times, batch.log_times), strict=True):
        if times is None:
            column = pa.nulls(len(batch), kind)
        else:
            column = pa.Array.from_buffers(kind, len(batch), [_known(times), pa.py_buffer(times)])
        column = column if rows is None else column.take(rows)
        table = table.add_column(0, pa.field(name, kind), column)
    return table


def _known_times(times: Any) -> list[Any]:
    """Return times as a list; None for those that are not known."""
    known: list[Any] = times.tolist()
    if (times == NO_TIME).any():
        return [None if time == NO_TIME else time for time in known]
    return known


def _known(times: Any) -> Any:
    """Return Arrow's bits of the times that are known; None if all are."""
    known = times != NO_TIME
    return None if known.all() else arrow().py_buffer(np.packbits(known, bitorder="little"))


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
    except ElementError as unclear:
        place = done + unclear.row if isinstance(done, int) else done[unclear.row]
        what = f"message {place} of `{topic.name}`: {unclear.problem}"
        raise RecordingError(what, "select elements by index, such as `position[0]`") from unclear
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


def _warn(damage: tuple[Damage, ...], warned: int) -> int:
    """Warn of the damage after the first `warned` ones; return how much there is."""
    for each in damage[warned:]:
        warnings.warn(DamageWarning(str(each)), stacklevel=3)
    return len(damage)


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
        options: ReadOptions,
    ) -> None:
        super().__init__(topic, options)
        self.place = place
        self.ids = ids
        self.pieces = pieces
        self.window = window

    def __reduce__(self) -> tuple[Any, ...]:
        where = self.place, self.ids, self.pieces, self.window
        return Part, (self.topic, *where, self.options)

    def __repr__(self) -> str:
        return f"<Part of {self.topic.name} in {self.place}, {len(self.pieces)} pieces>"

    def read_all(self) -> Iterator[TopicMessages]:
        """Yield all messages as they are recorded, many at a time."""
        with closing(open_pieces(self.place, *self.options.checks)) as file:
            warned = 0
            for batch in file.messages(self.ids, self.pieces, self.window):
                warned = _warn(tuple(file.damage), warned)
                yield batch
            _warn(tuple(file.damage), warned)


#: For those who give ints.
HINT = "write a text, such as `'10'`, for seconds from the start; an int is nanoseconds"
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
        distro: str | None = None,
        as_: Any = (),
        rules: Any = None,
    ) -> None:
        self._readings = readings(as_, rules)
        names = texts(include, "the folders of `include`")
        self._options = ReadOptions(names, checked_distro(distro), checks=(check, strict))
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
        topics = self._topics.get(name) if isinstance(name, str) else None
        if not topics:
            hint = did_you_mean(str(name), list(self)) or f"it has {', '.join(self) or 'none'}"
            raise UnknownTopicError(f"`{self._container.name}` has no topic `{name}`", hint)
        return self._selected(topics)

    def topic(self, name: str, type_name: str | None = None) -> RecordedTopic:
        """Return the messages of a topic, only those of one type if several were recorded."""
        if type_name is None:
            return self[name]
        topics = [
            topic for topic in self._topics.get(name, ()) if topic.type == full_name(str(type_name))
        ]
        if not topics:
            kinds = ", ".join(sorted({topic.type for topic in self._topics.get(name, ())}))
            what = f"`{name}` has no messages of `{type_name}`"
            raise RecordingError(what, f"it has {kinds}" if kinds else None)
        return self._selected(topics)

    def _selected(self, topics: list[Topic]) -> RecordedTopic:
        """Return the messages of topics of one name, which must be of one type."""
        name, kinds = topics[0].name, {topic.type for topic in topics}
        if len(kinds) > 1 or len({topic.encoding for topic in topics}) > 1:
            listed = ", ".join(sorted(kinds))
            selection = worded("--type TYPE", "recording.topic(name, type)")
            hint = f"select one of them: `{selection}`"
            what = f"`{name}` has messages of several types, {listed}"
            raise RecordingError(what, hint if len(kinds) > 1 else None)
        reading = self._readings.get(topics[0].type)
        groups: dict[str, list[RecordedTopic]] = {}
        for single in self._apart(topics):
            digest = single.structure.hash if len(topics) > 1 else ""
            groups.setdefault(digest, []).append(single)
        versions = [
            version for group in groups.values() for version in self._of_one_hash(group, reading)
        ]
        if len(versions) == 1:
            return versions[0]
        if reading is not None:
            return RecordedVersions(self._container, ALWAYS, versions)
        places = (f"{digest} ({', '.join(self._files(group))})" for digest, group in groups.items())
        files = [self._files(group) for group in groups.values()]
        target = "PATH"
        if (
            not set(files[-1]).intersection(name for own in files[:-1] for name in own)
            and len(files[-1]) == 1
        ):
            target = shlex.quote(files[-1][0])
        olds = " ".join(map(shlex.quote, dict.fromkeys(name for own in files[:-1] for name in own)))
        hint = f"convert them: `idlc upgrade {olds} --to {target} -o upgraded`"
        hint += worded("", "; or give the class to read them as: `Recording(..., as_=Class)`")
        raise RecordingError(
            f"`{name}` has messages of {len(versions)} versions of {topics[0].type}: "
            f"{' and '.join(places)}",
            hint,
        )

    def _apart(self, topics: Iterable[Topic]) -> Iterator[RecordedTopic]:
        """Yield the messages of each definition by themselves."""
        every = tuple(topics)
        same_type: dict[str, list[Topic]] = {}
        for topic in every:
            same_type.setdefault(topic.type, []).append(topic)
        for topic in every:
            options = self._options._replace(
                reading=self._readings.get(topic.type),
                others=tuple(each for each in same_type[topic.type] if each is not topic),
            )
            yield RecordedTopic(self._container, topic, ALWAYS, options)

    def definitions(self) -> Iterator[RecordedTopic]:
        """Yield the messages of each topic, those of different definitions apart."""
        for topics in self._topics.values():
            yield from self._apart(topics)

    def _of_one_hash(
        self, group: list[RecordedTopic], reading: Reading | None
    ) -> list[RecordedTopic]:
        """Return the messages of definitions of one hash as one.

        If units or constants differ, warn of it, or keep them apart if they are converted.
        """
        if len(group) > 1:
            from idlc.recordings.load import OtherDefinitionWarning
            from idlc.versions.conversion import changed_meanings

            first, *others = (topic.version for topic in group)
            changes = {each: None for other in others for each in changed_meanings(first, other)}
            if changes and reading is not None:
                return group
            for change in changes:
                what = f"`{group[0].topic.name}` has messages of several definitions: {change}"
                warnings.warn(OtherDefinitionWarning(what), stacklevel=4)
        return [self._joined(group)]

    def _joined(self, group: list[RecordedTopic]) -> RecordedTopic:
        """Return the messages of topics whose types are the same."""
        if len(group) == 1:
            return group[0]
        topic = self._container.joined([each.topic for each in group])
        return RecordedTopic(self._container, topic, ALWAYS, group[0].options)

    def _files(self, group: list[RecordedTopic]) -> list[str]:
        """Return the paths of the files that have messages of some topics."""
        places = (place for each in group for place in self._container.places(each.topic))
        return list(dict.fromkeys(file.name for file, *_ in places))

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

        `topics` has the fields of each topic, None for all, or elements of lists, such as
        `position.elbow` by name or `covariance[0]` by index. A row has the values of the `last`
        message until its time, of the `nearest`, or on a line between two (`linear`). They are null
        without a message within `tolerance`. The `clock` of messages is `log`, or `header` for the
        stamp of their header. These three are for all topics, or a mapping has them by topic.
        Lengths of time are `50ms`, `30Hz`, a timedelta, or an int in nanoseconds; `start` and `end`
        limit the ticks, as for `between`.
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
        options: ReadOptions,
    ) -> None:
        super().__init__(topic, options)
        self._container = container
        self.window = window

    def __repr__(self) -> str:
        topic, name = self.topic, self._container.name
        if self.window != ALWAYS or self.options.conditions:
            return f"<part of {topic.name} in {name}: {topic.type}>"
        text = f"<{topic.name} in {name}: {topic.type}, {topic.count:,} messages"
        start, end = self._container.span() or (0, 0)
        if start < end < END_OF_TIME and topic.count > 1:
            seconds = (end - start) / 1e9
            text += f" in {seconds:,.1f} s, {(topic.count - 1) / seconds:,.1f} per second"
        return f"{text}>"

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
        window = self.window.narrowed(first, last)
        if (start, end) != (None, None):
            is_number = any(isinstance(time, int) for time in (start, end))
            self._check_range(window, HINT if is_number else None)
        return self._narrowed(window, self.options)

    def _check_range(self, window: Window, hint: str | None) -> None:
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
        if hint is None:
            seconds = ceil((span[1] - span[0]) / 1e9)
            hint = f"give times from `0` to `{seconds}`, in seconds from the start, or dates"
        what = f"no message is in the range of times ({limits})"
        raise RecordingError(f"{what}: the recording is from {recorded}", hint)

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
        conditions = *self.options.conditions, condition
        return self._narrowed(self.window, self.options._replace(conditions=conditions))

    def _narrowed(self, window: Window, options: ReadOptions) -> RecordedTopic:
        return RecordedTopic(self._container, self.topic, window, options)

    def read_all(self) -> Iterator[TopicMessages]:
        """Yield all messages as they are recorded, many at a time."""
        warned = len(self._container.damage)
        for batch in self._container.messages(self.topic, self.window):
            warned = _warn(self._container.damage, warned)
            yield batch
        _warn(self._container.damage, warned)

    def parts(self, size: int = PART) -> list[Part]:
        """Return pieces for others to read, each of about `size` bytes of the recording.

        They can be pickled, and read in other processes and on other machines that see the file.
        """
        places = self._container.places(self.topic)
        return [part for file, ids, _ in places for part in self.parts_of(file, ids, size)]

    def parts_of(self, file: Any, ids: list[int], size: int) -> list[Part]:
        """Return the parts of one file."""
        how = self.window, self.options
        return [
            Part(self.topic, file.place, tuple(ids), pieces, *how)
            for pieces in file.parts(ids, self.window, size)
        ]


class RecordedVersions(RecordedTopic):
    """The messages of several versions of one type, read as one of them."""

    def __init__(self, container: Container, window: Window, versions: list[RecordedTopic]) -> None:
        first, count = versions[0], sum(version.topic.count for version in versions)
        super().__init__(container, replace(first.topic, count=count), window, first.options)
        self.versions = versions

    def between(self, start: Any = None, end: Any = None, *, by: str = "") -> RecordedVersions:
        """Return those of a time: see `RecordedTopic.between`."""
        return self._each(lambda version: version.between(start, end, by=by))

    def where(self, path: str, operator: str, value: Any) -> RecordedVersions:
        """Return those in which a field compares with a value: see `RecordedTopic.where`.

        Each version must have the path.
        """
        return self._each(lambda version: version.where(path, operator, value))

    def _each(self, select: Callable[[RecordedTopic], RecordedTopic]) -> RecordedVersions:
        versions = [select(version) for version in self.versions]
        return RecordedVersions(self._container, versions[0].window, versions)

    def parts(self, size: int = PART) -> list[Part]:
        """Return pieces for others to read, in the order of the files; each is of one version."""
        return [
            part
            for file, owners in self._owners()
            for version, ids in owners
            for part in version.parts_of(file, ids, size)
        ]

    def _owners(self) -> Iterator[tuple[Any, list[tuple[RecordedTopic, list[int]]]]]:
        """Yield the files with messages, and which versions have them."""
        owners: dict[int, list[tuple[RecordedTopic, list[int]]]] = {}
        for version in self.versions:
            for file, ids, _ in self._container.places(version.topic):
                owners.setdefault(id(file), []).append((version, ids))
        for file in self._container.files:
            if id(file) in owners:
                yield file, owners[id(file)]

    def compare_lengths(self, batch: TopicMessages | None = None, kind: Any = None) -> None:
        """Compare nothing: `recorded` compares the lengths of each version."""

    def _on_unread(self, _kind: Any, _batch: TopicMessages) -> Callable[[Any], None]:
        return lambda _: None

    def read_as(self, batch: TopicMessages, first: int = 0) -> TopicMessages:  # noqa: ARG002
        """Return messages as they are: `recorded` has converted them."""
        return batch

    def recorded(self) -> Iterator[TopicMessages]:
        """Yield the messages as one version; those that are stored together in order of time."""
        for version in self.versions:
            version.absent = 0
        warned = len(self._container.damage)
        for file, owners in self._owners():
            every = [number for _, ids in owners for number in ids]
            for pieces in file.parts(every, self.window, PART):
                batches = []
                for version, ids in owners:
                    recorded = file.messages(ids, pieces, self.window)
                    for batch in version.matching(recorded):
                        version.compare_lengths(batch)
                        batches.append(version.read_as(batch))
                self.absent = sum(version.absent for version in self.versions)
                warned = _warn(self._container.damage, warned)
                if batches:
                    yield in_order(batches) if len(owners) > 1 else join_messages(batches)
