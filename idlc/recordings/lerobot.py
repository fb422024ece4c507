"""Data sets in version 3.0 of LeRobot's format, as its version 0.6.1 writes them.

Each episode has a file of numbers, and a video for each camera. LeRobot may put several episodes
into a file, but looks for pictures by times of 32 bits, which are inexact late in a long video.
"""

from __future__ import annotations

import json
import os
import secrets
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from idlc.recordings.columns.arrow import arrow
from idlc.recordings.containers.compression import missing
from idlc.recordings.containers.source import RecordingError

#: So many files are in a folder of files.
CHUNK = 1000
FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
DATA, VIDEO = f"data/{FILE}.parquet", f"videos/{{video_key}}/{FILE}.mp4"
#: What LeRobot adds to the features.
ADDED = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
#: LeRobot's own settings of the encoder.
ENCODER = {"g": 2, "crf": 30, "preset": 12}
QUANTILES = (0.01, 0.1, 0.5, 0.9, 0.99)
BINS = 5000
#: Statistics take only some of the pixels of a large picture, as if it had the smaller size.
LARGE, SMALL = 300, 150


class Feature(NamedTuple):
    """Numbers of each frame, or pictures if the type is `video`."""

    dtype: str
    names: Sequence[str] = ("height", "width", "channels")
    units: Sequence[str | None] = ()

    def described(self, fps: int, shape: Sequence[int]) -> dict[str, Any]:
        """Return what `info.json` says about it."""
        info: dict[str, Any] = {}
        if self.dtype == "video":
            stream = {"height": shape[0], "width": shape[1], "codec": "av1", "pix_fmt": "yuv420p"}
            how = {"fast_decode": 0, "video_backend": "pyav", "extra_options": {}}
            video = {**stream, "fps": fps, "channels": 3, **ENCODER, **how}
            info = {f"video.{name}": value for name, value in video.items()}
            info |= {"has_audio": False, "is_depth_map": False}
        elif any(self.units):
            info = {"units": [*self.units]}
        described = {"dtype": self.dtype, "shape": [*shape], "names": [*self.names]}
        return described | ({"info": info} if info else {})


def av() -> Any:
    """Return PyAV, or say how to install it."""
    os.environ.setdefault("SVT_LOG", "0")  # the encoder would print what it does
    try:
        import av
    except ImportError:
        raise missing("av", "PyAV encodes the videos", "lerobot") from None
    return av


class _Video:
    """A video that is being encoded, and how often its pictures have each value."""

    _file: Any = None
    _stream: Any = None

    def __init__(self, path: Path, fps: int, frames: int) -> None:
        self._path, self._fps = path, fps
        # the frames that LeRobot takes for statistics
        count = max(min(frames, 100), min(int(frames**0.75), 10_000))
        self._sampled = set(np.round(np.linspace(0, frames - 1, count)).astype(int).tolist())
        self._done = 0
        self._counts = np.zeros((3, 256), np.int64)
        self.shape: tuple[int, ...] = ()

    def add(self, picture: Any) -> None:
        """Encode a picture in RGB; raise RecordingError if it has another size than the first."""
        if self._file is None:
            self.shape = picture.shape
            self._path.parent.mkdir(parents=True, exist_ok=True)
            options = {name: str(value) for name, value in ENCODER.items()}
            options["svtav1-params"] = "fast-decode=0"
            self._file = av().open(str(self._path), "w")
            self._stream = self._file.add_stream("libsvtav1", self._fps, options=options)
            self._stream.height, self._stream.width, _ = self.shape
            self._stream.pix_fmt = "yuv420p"
        if picture.shape != self.shape:
            sizes = (f"{width} × {height}" for height, width, _ in (self.shape, picture.shape))
            raise RecordingError(f"a video has pictures of one size, not {' and '.join(sizes)}")
        if not picture.size:
            raise RecordingError("a picture without pixels cannot be encoded")
        self.encode(av().VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24"))
        if self._done in self._sampled:
            side = max(picture.shape)
            step = int(side / SMALL) if side >= LARGE else 1
            for counts, channel in zip(self._counts, np.moveaxis(picture, 2, 0), strict=True):
                counts += np.bincount(channel[::step, ::step].reshape(-1), minlength=256)
        self._done += 1

    def encode(self, frame: Any) -> None:
        """Encode a frame, or what is left if it is None."""
        try:
            self._file.mux(self._stream.encode(frame))
        except av().FFmpegError as error:
            size = f"{self.shape[1]} × {self.shape[0]}"
            raise RecordingError(f"pictures of {size} cannot be encoded: {error}") from None

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()

    def statistics(self) -> dict[str, Any]:
        """Return statistics of each channel, for values between 0 and 1."""
        channels = [statistics(np.arange(256), counts) for counts in self._counts]
        result: dict[str, Any] = {
            name: [[[channel[name] / 255]] for channel in channels] for name in channels[0]
        }
        return result | {"count": [len(self._sampled)]}


def statistics(values: Any, counts: Any) -> dict[str, float]:
    """Return statistics of values that occur so often, with quantiles of a histogram's bins."""
    values, counts = np.asarray(values, float)[counts > 0], counts[counts > 0]
    total, least, most = int(counts.sum()), values.min(), values.max()
    mean = (values * counts).sum() / total
    deviation = np.sqrt(((values - mean) ** 2 * counts).sum() / total)
    result = {"min": least, "max": most, "mean": mean, "std": deviation}
    edges = np.linspace(least - 1e-10, most + 1e-10, BINS + 1)
    sums = np.cumsum(np.histogram(values, edges, weights=counts)[0])
    for quantile in QUANTILES:
        place = int(np.searchsorted(sums, quantile * total))
        before = sums[place - 1] if place else 0
        fraction = (quantile * total - before) / (sums[place] - before) if place else 0
        value = edges[place] + fraction * (edges[place + 1] - edges[place])
        result[f"q{round(quantile * 100):02}"] = mean if total < 2 else value
    return {name: float(value) for name, value in result.items()}


def _of_columns(values: Any) -> dict[str, Any]:
    """Return statistics of each column of an array."""
    counts = np.ones(len(values), np.int64)
    columns = [statistics(column, counts) for column in values.T]
    result = {name: [column[name] for column in columns] for name in columns[0]}
    return result | {"count": [len(values)]}


def _of_episodes(episodes: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return statistics of a feature in all episodes, as LeRobot aggregates them."""
    arrays = {name: np.array([each[name] for each in episodes]) for name in episodes[0]}
    count = arrays["count"].sum(axis=0)
    weights = arrays["count"].reshape(-1, *[1] * (arrays["mean"].ndim - 1)) / count
    result = {name: (values * weights).sum(axis=0) for name, values in arrays.items()}
    spread = arrays["std"] ** 2 + (arrays["mean"] - result["mean"]) ** 2
    result |= {"min": arrays["min"].min(axis=0), "max": arrays["max"].max(axis=0), "count": count}
    result["std"] = np.sqrt((spread * weights).sum(axis=0))
    return {name: values.tolist() for name, values in result.items()}


def _encoded(blocks: Iterable[Mapping[str, Any]], videos: Mapping[str, _Video]) -> dict[str, Any]:
    """Encode the pictures of blocks, and return the numbers."""
    numbers: dict[str, list[Any]] = {}
    for block in blocks:
        for name, values in block.items():
            if name not in videos:
                numbers.setdefault(name, []).append(values)
                continue
            for picture in values:
                videos[name].add(picture)
    for video in videos.values():
        video.encode(None)
    return {name: np.concatenate(values) for name, values in numbers.items()}


def _under(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    return {f"{prefix}/{name}": value for name, value in values.items()}


class DataSet:
    """A data set that is being written; the numbers of one episode are in memory."""

    def __init__(self, folder: Path, draft: Path, fps: int) -> None:
        self._folder, self._draft, self._fps = folder, draft, fps
        self.frames = 0
        self._features: dict[str, Any] = {}
        self._tasks: dict[str, int] = {}
        self._episodes: list[dict[str, Any]] = []
        self._statistics: list[dict[str, Any]] = []

    def __len__(self) -> int:
        return len(self._episodes)

    def add(
        self,
        features: Mapping[str, Feature],
        task: str,
        frames: int,
        blocks: Iterable[Mapping[str, Any]],
    ) -> None:
        """Write an episode: blocks have some frames of each feature, numbers in two dimensions."""
        number = len(self)
        place = dict(zip(("chunk_index", "file_index"), divmod(number, CHUNK), strict=True))
        with ExitStack() as opened:
            videos: dict[str, _Video] = {}
            for name, feature in features.items():
                if feature.dtype == "video":
                    path = self._draft / VIDEO.format(video_key=name, **place)
                    videos[name] = _Video(path, self._fps, frames)
                    opened.enter_context(closing(videos[name]))
            arrays = _encoded(blocks, videos)
        shapes = {name: video.shape for name, video in videos.items()}
        shapes |= {name: values.shape[1:] for name, values in arrays.items()}
        self._describe(
            {name: each.described(self._fps, shapes[name]) for name, each in features.items()}
        )
        index, same = np.arange(frames), np.ones(frames, int)
        numbered = index / self._fps, index, same * number, self.frames + index
        added = *numbered, same * self._tasks.setdefault(task, len(self._tasks))
        for (name, dtype), values in zip(ADDED.items(), added, strict=True):
            arrays[name] = values.astype(dtype)[:, None]
        self._write(DATA.format(**place), {name: _column(each) for name, each in arrays.items()})
        own = {name: video.statistics() for name, video in videos.items()}
        own |= {name: _of_columns(values) for name, values in arrays.items()}
        self._statistics.append(own)
        row = {"episode_index": number, "tasks": [task], "length": frames}
        row |= _under("data", place)
        row |= {"dataset_from_index": self.frames, "dataset_to_index": self.frames + frames}
        for name in videos:
            span = {"from_timestamp": 0.0, "to_timestamp": frames / self._fps}
            row |= _under(f"videos/{name}", {**place, **span})
        for name, each in own.items():
            row |= _under(f"stats/{name}", each)
        self._episodes.append(row | _under("meta/episodes", {"chunk_index": 0, "file_index": 0}))
        self.frames += frames

    def _describe(self, features: dict[str, Any]) -> None:
        """Keep what the first episode has; raise RecordingError if another one differs."""
        known = self._features or features
        for name in {**known, **features}:
            if known.get(name) != features.get(name):
                hint = "select columns, such as `/joint_states:position.elbow`"
                raise RecordingError(f"`{name}` is not as in the episodes before", hint)
        self._features = features

    def _write(self, name: str, columns: Mapping[str, Any], metadata: Any = None) -> None:
        from pyarrow import parquet

        path = self._draft / name
        path.parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(arrow().table(dict(columns)).replace_schema_metadata(metadata), path)

    def finish(self) -> None:
        """Write what is known about all episodes, and give the folder its name."""
        rows = {name: [each[name] for each in self._episodes] for name in self._episodes[0]}
        self._write("meta/episodes/chunk-000/file-000.parquet", rows)
        # pandas reads it, and finds tasks by this index
        index = {"name": "task", "field_name": "task", "metadata": None}
        index |= {"pandas_type": "unicode", "numpy_type": "object"}
        pandas = {"index_columns": ["task"], "column_indexes": [], "columns": [index]}
        tasks = {"task_index": [*self._tasks.values()], "task": [*self._tasks]}
        self._write("meta/tasks.parquet", tasks, {"pandas": json.dumps(pandas)})
        added = {
            name: {"dtype": dtype, "shape": [1], "names": None} for name, dtype in ADDED.items()
        }
        has_video = any(each["dtype"] == "video" for each in self._features.values())
        info = {
            "codebase_version": "v3.0",
            "fps": self._fps,
            "features": self._features | added,
            "total_episodes": len(self),
            "total_frames": self.frames,
            "total_tasks": len(self._tasks),
            "chunks_size": CHUNK,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "data_path": DATA,
            "video_path": VIDEO if has_video else None,
            "robot_type": None,
            "splits": {"train": f"0:{len(self)}"},
        }
        names = self._statistics[0]
        stats = {name: _of_episodes([each[name] for each in self._statistics]) for name in names}
        for name, content in (("info", info), ("stats", stats)):
            text = json.dumps(content, indent=4, ensure_ascii=False)
            (self._draft / f"meta/{name}.json").write_text(text, encoding="utf-8")
        self._draft.rename(self._folder)


def _column(values: Any) -> Any:
    """Return a column of Arrow: a list for each frame, or one number."""
    pa, size = arrow(), values.shape[1]
    flat = pa.array(values.reshape(-1))
    return flat if size == 1 else pa.FixedSizeListArray.from_arrays(flat, size)


@contextmanager
def data_set(folder: Path, fps: int) -> Iterator[DataSet]:
    """Give a data set, of which nothing stays unless it is finished."""
    draft = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}")
    try:
        draft.mkdir(parents=True)
        yield DataSet(folder, draft, fps)
    except OSError as error:
        reason = error.strerror or error
        raise RecordingError(f"`{folder}` cannot be written: {reason}") from None
    finally:
        shutil.rmtree(draft, ignore_errors=True)
