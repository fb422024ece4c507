"""The frames of a data set, and a description of what LeRobot makes of them.

In an environment with LeRobot, `python -m tests.support.lerobot_frames` writes the description
again, golden/lerobot.json. idlc writes the same frames in tests/tasks/test_lerobot.py.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

GOLDEN = Path(__file__).parents[2] / "golden/lerobot.json"
FPS = 10
#: The task and the number of frames of each episode.
EPISODES = (("pick", 20), ("place", 15), ("pick", 1))
CAMERA = "observation.images.top"
FEATURES: dict[str, dict[str, Any]] = {
    "observation.state": {
        "dtype": "float32",
        "shape": (2,),
        "names": ["position.shoulder", "position.elbow"],
    },
    "observation.count": {"dtype": "int32", "shape": (1,), "names": ["data"]},
    "observation.flag": {"dtype": "bool", "shape": (1,), "names": ["data"]},
    "action": {"dtype": "float32", "shape": (2,), "names": ["linear.x", "angular.z"]},
    CAMERA: {"dtype": "video", "shape": (96, 320, 3), "names": ["height", "width", "channels"]},
}


class Frame(NamedTuple):
    """The values of one time; `is_first` in an episode."""

    is_first: bool
    task: str
    state: list[float]
    count: int
    flag: bool
    action: list[float]
    picture: Any


def frames() -> Iterator[Frame]:
    """Yield the frames of all episodes."""
    for episode, (task, length) in enumerate(EPISODES):
        for index in range(length):
            picture = np.zeros((96, 320, 3), np.uint8)
            picture[:, 8 * index : 8 * index + 24, episode] = 200
            picture[40:56] = [10 * index, 90, 120]
            state = [(index - 7) / 8, (index * index % 11) / 4]
            yield Frame(
                index == 0, task, state, 3 * index, index % 3 == 0, [0.5 * index, 5.0], picture
            )


def write_by_lerobot(folder: Path) -> None:
    """Write a data set with LeRobot."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset  # type: ignore[import-not-found]

    data = LeRobotDataset.create("local/golden", FPS, FEATURES, root=folder, use_videos=True)
    for number, frame in enumerate(frames()):
        if frame.is_first and number:
            data.save_episode(parallel_encoding=False)
        values = (
            np.array(frame.state, np.float32),
            np.array([frame.count], np.int32),
            np.array([frame.flag]),
            np.array(frame.action, np.float32),
            frame.picture,
        )
        data.add_frame({**dict(zip(FEATURES, values, strict=True)), "task": frame.task})
    data.save_episode(parallel_encoding=False)
    data.finalize()


def description(folder: Path) -> dict[str, Any]:
    """Return what a data set consists of, apart from which episodes share a file."""
    from pyarrow import parquet

    def read(place: str) -> Any:
        return parquet.read_table(folder / place)

    tables = {name: read(name) for name in ("data", "meta/episodes", "meta/tasks.parquet")}
    places = ("data/", "videos/", "meta/episodes/")
    rows = [
        {name: value for name, value in row.items() if not name.startswith(places)}
        for row in tables["meta/episodes"].to_pylist()
    ]
    return {
        "info": json.loads((folder / "meta/info.json").read_text(encoding="utf-8")),
        "stats": json.loads((folder / "meta/stats.json").read_text(encoding="utf-8")),
        "schemas": {
            name: {field.name: str(field.type) for field in table.schema}
            for name, table in tables.items()
        },
        "rows": tables["data"].to_pylist(),
        "episodes": rows,
        "tasks": tables["meta/tasks.parquet"].to_pylist(),
        "index": json.loads(tables["meta/tasks.parquet"].schema.metadata[b"pandas"])[
            "index_columns"
        ],
        "files": sorted({path.suffix for path in folder.rglob("*") if path.is_file()}),
    }


def main() -> None:
    """Write the golden description."""
    with tempfile.TemporaryDirectory() as folder:
        write_by_lerobot(Path(folder, "golden"))
        found = description(Path(folder, "golden"))
    python = ".".join(map(str, sys.version_info[:3]))
    versions = {name: version(name) for name in ("lerobot", "av", "datasets", "pyarrow")}
    found = {"written by": {**versions, "python": python}, **found}
    lines = (f"{json.dumps(name)}: {json.dumps(found[name])}" for name in found)
    GOLDEN.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
