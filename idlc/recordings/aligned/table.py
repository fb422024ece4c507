"""Topics of a recording as one table: a row for each tick of a clock."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from copy import copy
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from idlc.diagnostics.text import worded
from idlc.recordings.aligned import clock
from idlc.recordings.aligned.clock import FOREVER, WAYS, Match, grid, length, match
from idlc.recordings.aligned.describe import leaves, metadata, quaternions
from idlc.recordings.arguments import texts
from idlc.recordings.columns.arrow import arrow
from idlc.recordings.columns.elements import element_of, names_of
from idlc.recordings.columns.values import needing
from idlc.recordings.containers.messages import (
    ALWAYS,
    NO_TIME,
    Ranges,
    TopicMessages,
    Window,
    join_messages,
)
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.times import SECOND

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa

    from idlc.runtime.typeinfo import Structure

#: The times by which messages are ordered: when they were recorded, or their header's stamp.
CLOCKS = ("log", "header")
#: Topics whose messages take no more bytes are read once, others a second time for the values.
SMALL = 1 << 24
#: A row group has no more rows, and needs messages of about so many bytes.
ROWS, GROUP = 1 << 16, 1 << 25
STAMP = "header.stamp"


class Track(NamedTuple):
    """A topic of the table: its columns, and how the value of a tick is found."""

    topic: str
    fields: tuple[str, ...] | None
    how: str
    tolerance: int | None
    clock: str
    schema: pa.Schema
    quaternions: list[list[str]]


class Times(NamedTuple):
    """The messages of a topic, as they were recorded, and their order by the clock.

    A topic with few bytes has its values, too.
    """

    times: Any
    order: Any
    log_times: Any
    sizes: Any
    values: pa.Table | None

    def needed(self, each: Match) -> Needed:
        """Return the messages that a match needs, as they can be read again."""
        each = each.at(self.order)
        every = each.first if each.second is None else np.concatenate([each.first, each.second])
        numbers = np.unique(every[every >= 0])
        log = self.log_times[numbers]
        window, rows = ALWAYS, numbers
        if len(log) and not (log == NO_TIME).any():
            window = Window(int(log.min()), int(log.max()) + 1)
            rows = (np.cumsum(window.holds(self.log_times)) - 1)[numbers]
        places = np.full(int(numbers.max(initial=-1)) + 1, -1)
        places[numbers] = np.arange(len(numbers))
        return Needed(window, rows, numbers, log, each.at(places))


class ClockFit(NamedTuple):
    """How well a topic fits a clock: rates are in hertz, and the rest is in seconds.

    `missing` counts the ticks without a value, `unordered` the messages after a later one.
    """

    topic: str
    messages: int
    rate: float
    longest_gap: float
    mean_age: float
    largest_age: float
    missing: int
    unordered: int


class AlignedTopic(NamedTuple):
    """A topic of an open recording."""

    track: Track
    selection: Any


class Needed(NamedTuple):
    """The messages of a topic that some ticks need: their places in a window, and log times.

    `numbers` are their places in the recording; the indexes of `match` are those of `rows`.
    """

    window: Window
    rows: Any
    numbers: Any
    log_times: Any
    match: Match


class AlignedPart:
    """Some rows of an aligned table, for others to read wherever the file can be opened.

    It can be pickled, and knows where the values before its first tick are.
    """

    def __init__(
        self, sources: tuple[AlignedTopic, ...], schema: pa.Schema, ticks: Any, needs: list[Needed]
    ) -> None:
        self.schema = schema
        self._ticks = ticks
        self._tracks = [source.track for source in sources]
        self._needs = needs
        self._parts = [
            _ordered_parts(source.selection.between(*need.window)) if len(need.rows) else []
            for source, need in zip(sources, needs, strict=True)
        ]

    def __len__(self) -> int:
        return len(self._ticks)

    def to_arrow(self) -> pa.Table:
        """Return the rows as a table of Arrow."""
        values = [
            (track, _values(track, parts, need), need.match)
            for track, parts, need in zip(self._tracks, self._parts, self._needs, strict=True)
        ]
        return _assembled(self.schema, self._ticks, values)


def _ordered_parts(selection: Any) -> list[Any]:
    """Return the parts of messages; raise RecordingError if they are not in the recorded order."""
    parts: list[Any] = selection.parts()
    channels = {(str(part.place), part.ids) for part in parts}
    if len(channels) > len({place for place, _ in channels}):
        what = f"a file has several versions of the messages of `{selection.topic.name}`"
        hint = "convert the file: `idlc upgrade REC --to PATH -o OUT`"
        hint = worded(hint, f"use to_reader(), or {hint}")
        raise RecordingError(f"{what}: its table has no parts", hint)
    return parts


class Aligned:
    """A table with a row for each tick of a clock, made of several topics: see `Recording.aligned`.

    Messages are read when the table is needed, large ones only if their values are in it.
    """

    def __init__(
        self,
        sources: tuple[AlignedTopic, ...],
        on: AlignedTopic | None,
        period: Fraction | None,
        span: tuple[int | None, int | None],
    ) -> None:
        self._sources = sources
        self._on = on
        self._period = period
        self._span = span
        self.schema = self._schema()

    def _schema(self) -> pa.Schema:
        """Return the columns, with units and enums of fields in their metadata."""
        pa = arrow()
        fields = [pa.field("time", pa.timestamp("ns"))]
        about: dict[str, Any] = {}
        problems: list[str] = []
        for source in self._sources:
            track, structure = source.track, source.selection.read_type
            facts = metadata(structure)
            if track.how == "linear":
                problems += _not_linear(track, structure)
            for field in track.schema:
                name = f"{track.topic}.{field.name}"
                element = element_of(structure, field.name)
                path = element.values if element else field.name
                fields.append(pa.field(name, field.type, metadata=facts.get(path)))
            age = f"{track.topic}.{'_age' if 'age' in track.schema.names else 'age'}"
            fields.append(pa.field(age, pa.duration("ns")))
            how = {"how": track.how, "tolerance": track.tolerance, "clock": track.clock}
            about[track.topic] = {"type": structure.name, "hash": structure.hash, **how}
        if problems:
            what = f"there are no values between those of {', '.join(problems)}"
            hint = "select other fields, elements such as `position[0]`, or `last` for these topics"
            raise RecordingError(what, hint)
        clock = {"on": self._on.track.topic} if self._on else {"every": str(self._period)}
        return pa.schema(fields, {"idlc.aligned": json.dumps({**clock, "topics": about})})

    @cached_property
    def _times(self) -> list[Times]:
        return [_scan(*source) for source in self._sources]

    @cached_property
    def ticks(self) -> Any:
        """The times of the rows, in nanoseconds."""
        start, end = self._span
        if self._on is not None:
            known = (
                times
                for source, times in zip(self._sources, self._times, strict=True)
                if source is self._on
            )
            ticks = (next(known, None) or _scan(*self._on)).times
            limits = (None if time is None else np.searchsorted(ticks, time) for time in self._span)
            return ticks[slice(*limits)]
        assert self._period is not None
        ends = [int(each.times[at]) for each in self._times if len(each.times) for at in (0, -1)]
        first = min(ends, default=None) if start is None else start
        last = max(ends, default=None) if end is None else end - 1
        if first is None or last is None or last < first:
            return np.zeros(0, np.int64)
        return grid(first, last, self._period, sum(len(each.times) for each in self._times))

    @cached_property
    def _matches(self) -> list[Match]:
        """The messages of each topic that belong to the ticks."""
        matches, ticks = [], self.ticks
        for source, each in zip(self._sources, self._times, strict=True):
            track = source.track
            if source is not self._on:
                matches.append(match(ticks, each.times, track.how, track.tolerance))
                continue
            first = int(np.searchsorted(each.times, ticks[0])) if len(ticks) else 0
            matches.append(Match(np.arange(first, first + len(ticks)), np.zeros_like(ticks)))
        return matches

    def _blocks(self, size: int) -> Iterator[tuple[Any, list[Match]]]:
        """Yield ticks with what belongs to them: messages of about `size` bytes."""
        cost = np.arange(len(self.ticks)) * max(1, size // ROWS)
        for each, times in zip(self._matches, self._times, strict=True):
            cost += np.cumsum(np.append(times.sizes[times.order], 0)[each.first])
        stops = [*(np.flatnonzero(np.diff(cost // size)) + 1).tolist(), len(cost)]
        for start, stop in zip([0, *stops], stops, strict=False):
            if start < stop:
                rows = slice(start, stop)
                yield self.ticks[rows], [each.part(rows) for each in self._matches]

    def _tables(self) -> Iterator[pa.Table]:
        for ticks, matches in self._blocks(GROUP):
            values = []
            for source, times, each in zip(self._sources, self._times, matches, strict=True):
                need, table = times.needed(each), times.values
                if table is None:
                    selections = [source.selection.between(*need.window)]
                    table, each = _values(source.track, selections, need), need.match
                else:
                    each = each.at(times.order)
                values.append((source.track, table, each))
            yield _assembled(self.schema, ticks, values)

    def parts(self, size: int = GROUP) -> list[AlignedPart]:
        """Return pieces of the table for others to read, each of about `size` bytes of messages."""
        parts = []
        for ticks, matches in self._blocks(size):
            pairs = zip(self._times, matches, strict=True)
            needs = [times.needed(each) for times, each in pairs]
            parts.append(AlignedPart(self._sources, self.schema, ticks, needs))
        return parts

    def present(self) -> dict[str, Any]:
        """Return which ticks have a message of each topic."""
        pairs = zip(self._sources, self._matches, strict=True)
        return {source.track.topic: each.first >= 0 for source, each in pairs}

    def rows(self, first: int, last: int) -> Aligned:
        """Return some rows of the table, for which no times are read again."""
        result, rows = copy(self), slice(first, last)
        vars(result)["_matches"] = [each.part(rows) for each in self._matches]
        vars(result)["ticks"] = self.ticks[rows]
        return result

    def summary(self) -> list[ClockFit]:
        """Return how well each topic fits the clock."""
        triples = zip(self._sources, self._times, self._matches, strict=True)
        return [_summary(source.track.topic, times, each) for source, times, each in triples]

    def __len__(self) -> int:
        return len(self.ticks)

    def to_reader(self) -> pa.RecordBatchReader:
        """Return the table piece by piece, without the whole table in memory."""
        batches = (batch for table in self._tables() for batch in table.to_batches())
        return arrow().RecordBatchReader.from_batches(self.schema, batches)

    def to_arrow(self) -> pa.Table:
        """Return a table of Arrow: `time`, the fields of each topic, and the age of each value."""
        return self.to_reader().read_all()

    def to_pandas(self) -> pd.DataFrame:
        """Return a table of pandas, in which NaN, None and NaT stand for gaps."""
        with needing("pandas", "to_pandas"):
            import pandas  # noqa: F401 # pyarrow would not say how to install it
        frame: pd.DataFrame = self.to_arrow().to_pandas()
        return frame

    def to_polars(self) -> pl.DataFrame:
        """Return a table of polars."""
        with needing("polars", "to_polars"):
            import polars
        return polars.DataFrame(polars.from_arrow(self.to_arrow()))

    def to_numpy(self) -> dict[str, Any]:
        """Return a masked array for each column; lists of one length have two dimensions."""
        table = self.to_arrow()
        return {name: masked(table[name].combine_chunks()) for name in table.column_names}


def aligned(
    recording: Any,
    topics: Mapping[str, Any] | Iterable[str],
    on: str | None,
    every: Any,
    how: Any,
    tolerance: Any,
    clock: Any,
    span: tuple[int | None, int | None],
) -> Aligned:
    """Return the table of `Recording.aligned`; raise RecordingError for what it cannot have."""
    if not isinstance(topics, Mapping):
        topics = dict.fromkeys(texts(topics, "`topics`"))
    wanted = dict(topics)
    if (on is None) == (every is None):
        raise RecordingError("the clock is either `on` a topic or `every` so often", "give one")
    for option in (how, tolerance, clock):
        for name in option if isinstance(option, Mapping) else ():
            recording[name]

    def source(name: str, fields: Any) -> AlignedTopic:
        limit = _for(name, tolerance, None)
        way = _choice("how", _for(name, how, "last"), WAYS)
        way = "on" if name == on else way
        by = _choice("clock", _for(name, clock, "log"), CLOCKS)
        fields = None if fields in (None, ...) else fields
        fields = (fields,) if isinstance(fields, str) else fields
        fields = None if fields is None else tuple(fields)
        selection = recording[name]
        schema = selection.table(join_messages([]), fields).schema.remove_metadata()
        turned = quaternions(selection.read_type) if way == "linear" else []
        limit = None if limit is None else int(length(limit))
        return AlignedTopic(Track(name, fields, way, limit, by, schema, turned), selection)

    sources = {name: source(name, fields) for name, fields in wanted.items()}
    base = None if on is None else sources.get(on) or source(on, ())
    every_source = [*sources.values(), *([base] if base and on not in sources else [])]
    bare = [each.track.topic for each in every_source if not _has_clock(each)]
    if bare:
        what = f"messages of {', '.join(bare)} have no {STAMP}"
        raise RecordingError(what, "clock={'/topic': 'log'} selects the clock of a topic")
    limits = [None if time is None else min(max(time, -FOREVER), FOREVER) for time in span]
    period = None if every is None else length(every)
    return Aligned(tuple(sources.values()), base, period, (limits[0], limits[1]))


def _for(name: str, option: Any, default: Any) -> Any:
    return option.get(name, default) if isinstance(option, Mapping) else option


def _choice(option: str, value: Any, choices: tuple[str, ...]) -> str:
    if value not in choices:
        raise RecordingError(f"{option}={value!r} is not one of {', '.join(choices)}")
    return str(value)


def _has_clock(source: AlignedTopic) -> bool:
    """Return whether messages have the times that order them."""
    if source.track.clock == "log":
        return True
    stamps = [leaf for leaf in leaves(source.selection.read_type) if leaf.path == STAMP]
    return any(leaf.structure.name == "std_msgs/msg/Header" for leaf in stamps)


def _not_linear(track: Track, structure: Structure) -> Iterator[str]:
    """Yield the columns that have no values between those of two messages.

    Elements of lists may change their places, unless they are those of an array without names.
    """
    types, names = arrow().types, set(track.schema.names)
    for field in track.schema:
        number = field.type
        if types.is_fixed_size_list(number) and not names_of(structure, field.name):
            number = number.value_type
        if not types.is_floating(number):
            yield f"`{track.topic}.{field.name}` ({field.type})"
    for paths in track.quaternions:
        if names.intersection(paths) and not names.issuperset(paths):
            yield f"`{track.topic}.{paths[0][:-2]}` (a part of a quaternion)"


def _scan(track: Track, selection: Any) -> Times:
    """Read the times of a topic's messages, and also the values if they are small."""
    none = np.zeros(0, np.int64)
    log_times, stamps, sizes = [none], [none], [none]
    tables = [track.schema.empty_table()]
    size = done = 0
    for batch in selection.recorded():
        numbers = np.arange(done, done + len(batch))
        done += len(batch)
        log_times.append(batch.log_times)
        sizes.append(_sizes(batch))
        size += int(sizes[-1].sum())
        if size <= SMALL:
            tables.append(selection.table(batch, track.fields, numbers))
        if track.clock == "header":
            column = selection.table(batch, (STAMP,), numbers)[STAMP].combine_chunks()
            stamps.append(column.cast(arrow().int64()).to_numpy())
    log = np.concatenate(log_times)
    times = np.concatenate(stamps) if track.clock == "header" else log
    order = np.flatnonzero(times != NO_TIME)
    order = order[np.argsort(times[order], kind="stable")]
    values = arrow().concat_tables(tables).combine_chunks() if size <= SMALL else None
    return Times(times[order], order, log, np.concatenate(sizes), values)


def _sizes(batch: TopicMessages) -> Any:
    if isinstance(batch, Ranges):
        return np.asarray(batch.stops - batch.starts, np.int64)
    return np.fromiter(map(len, batch.views()), np.int64, len(batch))


def _summary(topic: str, times: Times, each: Match) -> ClockFit:
    count, steps = len(times.times), np.diff(times.times) / SECOND
    ages = np.abs(each.age[each.first >= 0]) / SECOND
    return ClockFit(
        topic,
        count,
        len(steps) / steps.sum() if steps.any() else 0.0,
        float(steps.max(initial=0)),
        float(ages.mean()) if len(ages) else 0.0,
        float(ages.max(initial=0)),
        int(np.count_nonzero(each.first < 0)),
        int(np.count_nonzero(np.diff(times.order) < 0)),
    )


def _values(track: Track, selections: Iterable[Any], need: Needed) -> pa.Table:
    """Return the values of needed messages, without decoding others."""
    tables = [track.schema.empty_table()]
    done = last = 0
    for selection in selections:
        for batch in selection.recorded():
            first = last
            last = int(np.searchsorted(need.rows, done + len(batch)))
            if last > first:
                mask = np.zeros(len(batch), bool)
                mask[need.rows[first:last] - done] = True
                chosen = batch if mask.all() else batch.selected(mask)
                if (chosen.log_times != need.log_times[first:last]).any():
                    raise RecordingError(f"`{track.topic}` changed while it was read")
                tables.append(selection.table(chosen, track.fields, need.numbers[first:last]))
            done += len(batch)
            if last == len(need.rows):
                break
    if last < len(need.rows):
        raise RecordingError(f"`{track.topic}` changed while it was read")
    return arrow().concat_tables(tables)


def _assembled(
    schema: pa.Schema, ticks: Any, values: list[tuple[Track, pa.Table, Match]]
) -> pa.Table:
    """Return the table of some ticks, from the values of messages."""
    pa = arrow()
    columns = [pa.array(ticks, pa.timestamp("ns"))]
    for track, table, each in values:
        gap = each.first < 0
        if gap.all():
            columns += [pa.nulls(len(ticks), type_) for type_ in track.schema.types]
        elif each.second is not None:
            index = pa.array(np.arange(len(ticks)), mask=gap)
            columns += [column.take(index) for column in _between(track, table, each)]
        else:
            columns += _taken(table, each.first, gap)
        columns.append(pa.array(each.age, pa.duration("ns"), mask=gap))
    return pa.Table.from_arrays(columns, schema=schema)


def _taken(table: pa.Table, index: Any, gap: Any) -> list[Any]:
    """Return the values of messages at indexes, without a copy if these are all messages."""
    if len(index) == len(table) and (index == np.arange(len(index))).all():
        return list(table.columns)
    rows = arrow().array(index, mask=gap)
    return [column.combine_chunks().take(rows) for column in table.columns]


def _between(track: Track, table: pa.Table, each: Match) -> list[Any]:
    """Return the values between messages; those of gaps mean nothing."""
    pa = arrow()
    first, second = (
        {name: table[name].combine_chunks().take(rows) for name in table.column_names}
        for rows in (pa.array(np.maximum(places, 0)) for places in (each.first, each.second))
    )
    arrays = {name: clock.interpolated(first[name], second[name], each.weight) for name in first}
    for paths in track.quaternions:
        if paths[0] in arrays:
            starts, ends = (
                np.stack([columns[path].to_numpy() for path in paths], axis=1)
                for columns in (first, second)
            )
            turned = clock.turned(starts, ends, each.weight)
            for path, values in zip(paths, turned.T, strict=True):
                arrays[path] = pa.array(values, first[path].type)
    return list(arrays.values())


def masked(column: Any) -> Any:
    """Return a column of Arrow as a masked array of numpy."""
    pa = arrow()
    mask = column.is_null().to_numpy(zero_copy_only=False)
    present = column.drop_null()
    if pa.types.is_fixed_size_list(column.type):
        values = present.flatten().to_numpy().reshape(len(present), column.type.list_size)
    elif pa.types.is_large_list(column.type) and pa.types.is_primitive(column.type.value_type):
        sizes = np.diff(present.offsets.to_numpy())
        values = present.flatten().to_numpy(zero_copy_only=False)
        if len(sizes) and (sizes == sizes[0]).all():
            values = values.reshape(len(sizes), sizes[0])
        else:
            values = present.to_numpy(zero_copy_only=False)
    else:
        values = present.to_numpy(zero_copy_only=False)
    result = np.ma.zeros((len(mask), *values.shape[1:]), values.dtype)
    result[~mask] = values
    result[mask] = np.ma.masked
    return result
