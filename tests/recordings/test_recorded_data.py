"""The programs of docs/recorded-data.md; parts, also on a cluster that loses a worker."""

import json
import os
import re
import subprocess
import sys

import pyarrow as pa
import pytest

import idlc
from tests.support import recordings as made
from tests.support.paths import DOCS, ROOT

PAGE = (DOCS / "recorded-data.md").read_text(encoding="utf-8")
PROGRAMS = re.findall(r"^```python\n((?:.*\n)*?)```$", PAGE, re.MULTILINE)
#: The one for Dask starts processes; it runs in the test of these.
(CLUSTER,) = [code for code in PROGRAMS if "dask" in code]
ALONE = [code for code in PROGRAMS if code != CLUSTER]
#: Threads of Daft's sometimes crash a process that ends, after all is done.
AT_ONCE = "\nimport os, sys\nsys.stdout.flush()\nos._exit(0)\n"
COMMANDS = re.findall(r"^\$ (idlc .*)\n", PAGE, re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("document")
    made.by_mcap(folder / "drive.mcap", made.messages(600), chunk_size=20_000)
    return folder


def run(folder, *words):
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    env = {**os.environ, "PYTHONPATH": path, "DO_NOT_TRACK": "1", "DAFT_ANALYTICS_ENABLED": "0"}
    command = [sys.executable, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder, env=env)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_commands_and_programs_do_what_the_page_says(folder):
    for command in COMMANDS:
        run(folder, "-m", *command.split())
    described, read, counted, loaded, averaged = (
        run(folder, "-c", code + AT_ONCE * ("daft" in code)) for code in ALONE
    )
    assert "count    200.0" in described
    assert "/imu  sensor_msgs/msg/Imu  200" in read
    assert counted.startswith("[(200, 0.")
    assert loaded.endswith("True\n")
    assert averaged.startswith("{'angular_velocity.z': [0.")


def dying_once(work, part, marker):
    """Do the work, but end the whole process the first time."""
    try:
        marker.touch(exist_ok=False)
    except FileExistsError:
        return work(part)
    os._exit(1)


def test_a_cluster_that_loses_a_worker_finds_what_one_process_finds(folder):
    """The program for Dask, over two files, while one of two processes dies with a part."""
    from dask.distributed import Client

    paths = [folder / "drive.mcap", folder / "second.mcap"]
    made.by_mcap(paths[1], made.messages(300, seed=2), chunk_size=20_000)
    program = {"__name__": "program"}
    exec(CLUSTER, program)  # noqa: S102
    parts = []
    for path in paths:
        with idlc.Recording(path) as recording:
            parts += recording["/imu"].parts(50_000)
    assert len(parts) >= 4
    alone = [program["turning"](part) for part in parts]
    with Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        client.run(sys.path.insert, 0, str(ROOT))
        work, marker = program["turning"], folder / "died"
        tables = client.gather([client.submit(dying_once, work, one, marker) for one in parts])
    assert marker.exists()
    assert pa.concat_tables(tables).equals(pa.concat_tables(alone))
    assert pa.concat_tables(tables).num_rows == 300


@pytest.mark.parametrize("storage", ["mcap", "db3"])
def test_parts_are_the_whole_in_their_order(storage, tmp_path):
    found = made.messages(120)
    path = made.by_rosbags(tmp_path / "bag", found, storage)
    with idlc.Recording(path) as recording:
        for topic in made.MAKERS:
            chosen = recording[topic].between("2", "9")
            wanted = chosen.to_arrow()
            assert 0 < wanted.num_rows < recording[topic].topic.count
            for size in (1, 5000, 1 << 30):
                parts = chosen.parts(size)
                tables = [part.to_arrow() for part in parts]
                assert pa.concat_tables(tables).equals(wanted)
                pairs = [pair for part in parts for pair in part.messages()]
                assert pairs == list(chosen)
            assert len(parts) == 1


def test_the_notebook_runs(tmp_path):
    notebook = json.loads((ROOT / "examples" / "recording.ipynb").read_text(encoding="utf-8"))
    code = [cell["source"] for cell in notebook["cells"] if cell["cell_type"] == "code"]
    cells = ["".join(lines) for lines in code]
    assert not any(cell.get("outputs") for cell in notebook["cells"])
    said = run(tmp_path, "-c", "\n".join(cells))
    assert "1000 messages, 0.0 ms late at most" in said
    assert "turned by 0.25 rad in 1.99 s" in said
