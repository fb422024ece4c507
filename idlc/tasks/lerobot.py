"""`idlc columns --format lerobot`: recordings as the episodes of a data set for LeRobot."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from msgspec.structs import replace

from idlc.api.arrays import to_numpy
from idlc.api.recording import RecordedTopic, Recording
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.terminal import Progress
from idlc.diagnostics.text import did_you_mean
from idlc.recordings.aligned.clock import length
from idlc.recordings.aligned.table import Aligned, ClockFit, masked
from idlc.recordings.columns.arrow import arrow
from idlc.recordings.columns.elements import names_of
from idlc.recordings.containers.messages import join_messages
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.lerobot import ADDED, DataSet, Feature, av, data_set
from idlc.recordings.times import SECOND, date_text
from idlc.recordings.types import NAMED
from idlc.tasks.aligned import Grid, field_problem, table_of, topic_of
from idlc.tasks.columns import ColumnsOptions, WrittenFile, columns, problems

#: The fields that a picture of these types is made of.
PICTURES = {
    "Image": ["height", "width", "encoding", "is_bigendian", "step", "data"],
    "CompressedImage": ["format", "data"],
}
#: Where red, green and blue are among the channels of a pixel.
CHANNELS = {
    "rgb8": [0, 1, 2],
    "rgba8": [0, 1, 2],
    "bgr8": [2, 1, 0],
    "bgra8": [2, 1, 0],
    "mono8": [0, 0, 0],
}


class LeRobot(msgspec.Struct, frozen=True):
    """A data set: the columns of features, and what begins an episode."""

    features: tuple[str, ...] = ()
    episodes: str | None = None
    task: str | None = None


class FeaturePart(NamedTuple):
    """A column of numbers, or of lists of `size` numbers; or the pictures of a type, `dtype`."""

    topic: str
    path: str
    dtype: Any
    size: int | None = None

    @property
    def name(self) -> str:
        """The name of the column in the table, or of the topic of pictures."""
        return f"{self.topic}.{self.path}" if self.path else self.topic


class Episode(NamedTuple):
    """Rows of a table, and what the robot does in them."""

    first: int
    last: int
    task: str


def write_data_set(
    request: LeRobot,
    grid: Grid,
    announce: Callable[[list[ClockFit]], None],
    options: ColumnsOptions,
    report: Report,
    progress: Progress,
) -> list[WrittenFile]:
    """Write a data set, whole or not at all, with an episode or more for each recording."""
    folder = Path(options.out)
    if os.path.lexists(folder):
        what, hint = f"`{folder}` exists", "choose another folder"
        report.add(codes.EXISTING_FILE.of(str(folder), what, hint=hint))
        return []
    written: list[WrittenFile] = []
    with problems(options, report):
        rate = SECOND / length(grid.clock_of_rows)
        if rate.denominator != 1:
            what = f"a data set for LeRobot has a whole number of frames per second, not {rate}"
            raise RecordingError(what, "write a period such as `30Hz`")
        with data_set(folder, int(rate)) as data:
            work = partial(_add, data, request, grid, announce)
            for path in options.recordings:
                if not columns(replace(options, recordings=(path,)), report, progress, work):
                    return []
            if not len(data):
                raise RecordingError("in no row, each topic has a value")
            data.finish()
        episodes = f"{len(data):,} episode{'s' * (len(data) != 1)}"
        written.append(WrittenFile(episodes, options.out, data.frames))
    return written


def _add(
    data: DataSet,
    request: LeRobot,
    grid: Grid,
    announce: Callable[[list[ClockFit]], None],
    recording: Recording,
    options: ColumnsOptions,
    report: Report,
    progress: Progress,
) -> list[WrittenFile]:
    """Add the episodes of a recording; return an empty list if it lacks the fields."""
    path, before = options.recordings[0], data.frames
    words = options.topics or [name for name in recording if name != request.episodes]
    try:
        available, left_out = _available([topic_of(word, recording) for word in words], recording)
        features = _features(available, request.features)
        table = table_of(grid, _fields(features), recording, options)
        episodes = list(_episodes(request, grid, table, recording, options))
    except ValueError as error:
        field_problem(error, options, report)
        return []
    used = {part for parts in features.values() for part in parts}
    left_out += [f"`{part.name}`" for part in available if part not in used]
    if left_out and not before:
        report.notes.append(f"not in the data set: {first_few(left_out, NAMED)}")
    announce(table.summary())
    described = {name: _described(parts, table.schema) for name, parts in features.items()}
    for episode in episodes:
        part = _without_ends(table.rows(episode.first, episode.last))
        if len(part):
            data.add(described, episode.task, len(part), _blocks(part, features))
        progress(path, episode.last, len(table))
    if cut := len(table) - (data.frames - before):
        where = "outside of episodes, or " if request.episodes else ""
        what = f"left out {cut:,} of {len(table):,} rows: {where}before or after values of a topic"
        report.notes.append(f"`{path}`: {what}")
    return [WrittenFile(path, options.out, data.frames - before)]


def _without_ends(table: Aligned) -> Aligned:
    """Return the rows from the first to the last one in which each topic has a value.

    Raises RecordingError if a topic has no value in between.
    """
    rows = np.flatnonzero(np.all([*table.present().values()], axis=0))
    part = table.rows(int(rows[0]), int(rows[-1]) + 1) if len(rows) else table.rows(0, 0)
    for topic, present in part.present().items():
        if not present.all():
            what = f"`{topic}` has no value in {(~present).sum():,} of {len(part):,} rows"
            raise RecordingError(
                f"{what}, and LeRobot has no gaps", "a longer `--tolerance` fills gaps"
            )
    return part


def _available(
    topics: Sequence[tuple[str, Any]], recording: Recording
) -> tuple[list[FeaturePart], list[str]]:
    """Return the pictures and numbers of topics, and the columns that are neither."""
    available: list[FeaturePart] = []
    left_out: list[str] = []
    for topic, fields in topics:
        selection = recording[topic]
        kind = selection.read_type.name.rpartition("/")[2]
        if fields is None and kind in PICTURES:
            available.append(FeaturePart(topic, "", kind))
            continue
        for field in selection.table(join_messages([]), fields).schema:
            parts = _numbers(selection, topic, field)
            available += parts
            left_out += [] if parts else [f"`{topic}.{field.name}`"]
    return available, left_out


def _numbers(selection: RecordedTopic, topic: str, field: Any) -> list[FeaturePart]:
    """Return a column of numbers; for a list whose elements have names, a column for each."""
    types, path, kind, size = arrow().types, field.name, field.type, None
    is_list = types.is_large_list(kind)
    if types.is_fixed_size_list(kind):
        size = kind.list_size
    if is_list or size is not None:
        kind = kind.value_type
    if not (types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind)):
        return []
    dtype = np.dtype(kind.to_pandas_dtype())
    if is_list:
        names = names_of(selection.read_type, path)
        wanted = (path, *names) if len(names) == 1 else (path,)
        batch = next(iter(selection.recorded()), join_messages([]))
        first = selection.table(batch.selected(np.arange(len(batch)) == 0), wanted).to_pydict()
        size = len(first[path][0]) if first[path] else 0
        if size and len(names) == 1:
            return [FeaturePart(topic, f"{path}.{name}", dtype) for name in first[names[0]][0]]
    return [] if size == 0 else [FeaturePart(topic, path, dtype, size)]


def _features(
    available: Sequence[FeaturePart], wanted: Sequence[str]
) -> dict[str, list[FeaturePart]]:
    """Return what each feature is made of: what the user wants, and other topics by name."""
    features: dict[str, list[FeaturePart]] = {}
    for word in wanted:
        name, equals, paths = word.partition("=")
        if not equals:
            raise RecordingError(f"`{word}` is not a feature", "write `action=/cmd_vel`")
        for path in paths.split(","):
            parts = [
                each for each in available if re.match(rf"{re.escape(path)}(?![^.[])", each.name)
            ]
            if not parts:
                known_names = {name for each in available for name in (each.topic, each.name)}
                hint = did_you_mean(path, known_names)
                raise RecordingError(f"no numbers and no pictures are in `{path}`", hint)
            known = features.setdefault(name, [])
            known += [part for part in parts if part not in known]
    named = {part.topic for parts in features.values() for part in parts}
    for part in available:
        if part.topic not in named:  # a part of an action must not become an observation
            words = re.sub(r"[^\w.-]", "_", part.topic.strip("/"), flags=re.ASCII)
            features.setdefault(f"observation.{'' if part.path else 'images.'}{words}", []).append(
                part
            )
    if not features:
        raise RecordingError("the topics have no numbers and no pictures")
    _check(features)
    return features


def _check(features: Mapping[str, Sequence[FeaturePart]]) -> None:
    """Raise RecordingError for a feature that LeRobot does not have."""
    for name, parts in features.items():
        has_pictures = not all(part.path for part in parts)
        if has_pictures:
            av()
        if name in ADDED or not re.fullmatch(r"\w[\w.-]*", name, re.ASCII):
            raise RecordingError(f"a feature cannot have the name `{name}`")
        if has_pictures and len(parts) > 1:
            raise RecordingError(f"`{name}` can have the pictures of one topic, and nothing else")
        if "image" in name and not has_pictures:  # LeRobot decides by the name
            hint = f"choose another name: `--feature NAME={parts[0].topic}`"
            raise RecordingError(f"`{name}` has no pictures, which LeRobot expects there", hint)


def _fields(features: Mapping[str, Sequence[FeaturePart]]) -> dict[str, list[str]]:
    """Return the fields that are read of each topic."""
    fields: dict[str, list[str]] = {}
    for part in dict.fromkeys(part for parts in features.values() for part in parts):
        fields.setdefault(part.topic, []).extend([part.path] if part.path else PICTURES[part.dtype])
    return fields


def _dtype(parts: Sequence[FeaturePart]) -> str:
    """Return the type of a feature of numbers: LeRobot's models are of 32 bits."""
    dtype = np.result_type(*(part.dtype for part in parts))
    return "float32" if dtype.kind == "f" else dtype.name


def _described(parts: Sequence[FeaturePart], schema: Any) -> Feature:
    """Return a feature, with names and units of its numbers."""
    if not parts[0].path:
        return Feature("video")
    is_one = len({part.topic for part in parts}) == 1
    names: list[str] = []
    units: list[str | None] = []
    for part in parts:
        name = part.path if is_one else part.name
        own = [name] if part.size is None else [f"{name}[{at}]" for at in range(part.size)]
        unit = (schema.field(part.name).metadata or {}).get(b"ros2.unit")
        names += own
        units += [unit and unit.decode()] * len(own)
    return Feature(_dtype(parts), names, units)


def _episodes(
    request: LeRobot, grid: Grid, table: Aligned, recording: Recording, options: ColumnsOptions
) -> Iterator[Episode]:
    """Yield the rows of each episode, which the next message of a topic ends."""
    task, topic = request.task or "", request.episodes
    if topic is None:
        yield Episode(0, len(table), task)
        return
    schema = recording[topic].table(join_messages([]), None).schema
    fields = ["data"] if "data" in schema.names else []
    on = replace(grid, clock_of_rows=topic, how=(), tolerance=())
    starts = table_of(on, {topic: fields}, recording, options)
    values = starts.to_arrow()[f"{topic}.data"].to_pylist() if fields else [True] * len(starts)
    rows = [*np.searchsorted(table.ticks, starts.ticks).tolist(), len(table)]
    for first, last, value in zip(rows, rows[1:], values, strict=False):
        if value is not False and value != "":
            yield Episode(first, last, value if isinstance(value, str) else task)


def _blocks(
    table: Aligned, features: Mapping[str, Sequence[FeaturePart]]
) -> Iterator[dict[str, Any]]:
    """Yield some frames of each feature, until the table ends."""
    for batch in table.to_reader():
        yield {
            name: _stacked(batch, parts) if parts[0].path else _pictures(batch, parts[0])
            for name, parts in features.items()
        }


def _stacked(batch: Any, parts: Sequence[FeaturePart]) -> Any:
    """Return the numbers of a feature; raise RecordingError for what it cannot hold."""
    dtype, result = _dtype(parts), []
    for part in parts:
        values = masked(batch[part.name])
        if values.shape[1:] != (() if part.size is None else (part.size,)):
            hint = f"select elements, such as `{part.topic}:{part.path}[0]`"
            raise RecordingError(f"`{part.name}` has not always {part.size} elements", hint)
        plain = np.asarray(values).reshape(len(batch), -1)
        with np.errstate(over="ignore", invalid="ignore"):
            held = plain.astype(dtype)
            exact = (
                np.isfinite(held) if plain.dtype.kind == "f" else held.astype(plain.dtype) == plain
            )
        wrong = np.ma.getmaskarray(values).reshape(held.shape) | ~exact
        if wrong.any():
            row = int(wrong.any(axis=1).argmax())
            time = date_text(batch["time"].cast(arrow().int64())[row].as_py())
            value = batch[part.name][row].as_py()
            what = "no value" if value is None else f"{value}, which {dtype} cannot hold"
            raise RecordingError(f"`{part.name}` has {what}, at {time}")
        result.append(held)
    return np.concatenate(result, axis=1)


def _pictures(batch: Any, part: FeaturePart) -> Iterator[Any]:
    """Yield pictures in red, green and blue, one at a time."""
    names = [f"{part.topic}.{field}" for field in PICTURES[part.dtype]]
    for index in range(len(batch)):
        row = {name: batch[name][index].as_py() for name in names}
        try:
            pixels = to_numpy(row, part.dtype, prefix=f"{part.topic}.")
            decoded = {(): "mono8", (3,): "rgb8"}.get(pixels.shape[2:], "of other channels")
            encoding = row.get(f"{part.topic}.encoding", decoded)
            if encoding not in CHANNELS or pixels.dtype != np.uint8:
                raise ValueError(f"it is {encoding}, not {', '.join(CHANNELS)}")
        except (ValueError, ImportError) as error:
            raise RecordingError(f"a picture of `{part.topic}` has no video: {error}") from None
        yield np.atleast_3d(pixels)[:, :, CHANNELS[encoding]]
