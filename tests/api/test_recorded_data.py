"""The programs of docs/recordings.md; parts, also on a cluster that loses a worker."""

import json
import os
import re
import subprocess
import sys
import sysconfig

import pyarrow as pa
import pytest

import idlc
from tests.support import recordings as made
from tests.support.paths import DOCS, ROOT

PAGE = (DOCS / "recordings.md").read_text(encoding="utf-8").partition("## List topics and types")[0]
PROGRAMS = re.findall(r"^```python\n((?:.*\n)*?)```$", PAGE, re.MULTILINE)
#: Those for Dask and Ray start processes; they run in the tests of these.
(CLUSTER,) = [code for code in PROGRAMS if "from dask" in code]
(RAY,) = [code for code in PROGRAMS if "import ray" in code]
ALONE = [code for code in PROGRAMS if code not in (CLUSTER, RAY)]
#: Threads of Daft's sometimes crash a process that ends, after all is done.
AT_ONCE = "\nimport os, sys\nsys.stdout.flush()\nos._exit(0)\n"
COMMANDS = re.findall(r"^\$ (idlc .*)\n", PAGE, re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("document")
    made.by_mcap(folder / "drive.mcap", made.messages(600), chunk_size=20_000)
    return folder


def run(folder, *words):
    env = {**os.environ, "PYTHONPATH": str(ROOT), "DO_NOT_TRACK": "1"}
    env |= {"DAFT_ANALYTICS_ENABLED": "0", "MPLBACKEND": "agg", "COLUMNS": "88"}
    command = [sys.executable, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder, env=env)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_commands_and_programs_do_what_the_page_says(folder):
    for command in COMMANDS:
        if command.startswith("idlc columns") and "-o" not in command:
            assert run(folder, "-m", *command.split(), "--format", "text") in PAGE
        else:
            run(folder, "-m", *command.split())
    described, read, counted, loaded, aligned, pictured, averaged = (
        run(folder, "-c", code + AT_ONCE * ("daft" in code)) for code in ALONE
    )
    assert "count    200.0" in described
    assert re.search(r"^/imu +sensor_msgs/msg/Imu +200$", read, re.MULTILINE)
    assert counted.startswith("[(200, 0.")
    assert loaded.endswith("True\n")
    assert re.fullmatch(r"/imu 3\.33\d* 0\.0\n/joints 3\.33\d* 0\.2\n", aligned)
    assert pictured == "uint8 3 33\n"
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


def test_parts_on_a_cluster_are_read_as_the_new_type(folder):
    """As in one process, with the class from a folder that each worker loads."""
    from dask.distributed import Client

    package = folder / "sensor_msgs"
    (package / "msg").mkdir(parents=True)
    text = "int8 added 5\nstd_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
    (package / "msg" / "Imu.msg").write_text(text, encoding="utf-8")
    new = idlc.load(str(package)).Imu
    made.by_mcap(folder / "old.mcap", made.messages(300), chunk_size=20_000)
    with idlc.Recording(folder / "old.mcap", as_=new) as recording:
        topic = recording["/imu"]
        parts, whole = topic.parts(5_000), topic.to_arrow()
        added = topic.to_columns(fields=["added", "orientation.x"])
    assert len(parts) >= 4
    with Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        client.run(sys.path.insert, 0, str(ROOT))
        tables = client.gather(client.map(to_arrow, parts, pure=False))
    assert pa.concat_tables(tables).equals(whole)
    assert added["added"].tolist() == [5] * 100
    assert added["orientation"]["x"].tolist() == [
        row["x"] for row in whole["orientation"].to_pylist()
    ]


def to_arrow(part):
    return part.to_arrow()


#: The program for Ray, over two files, while a worker of two dies with a part.
ON_RAY = """
import os
from pathlib import Path
import pyarrow as pa

program = {"__name__": "program"}
exec(Path("program.py").read_text(), program)
ray, Recording, work = program["ray"], program["Recording"], program["turning"]
ray.init(num_cpus=2, include_dashboard=False, _node_ip_address="127.0.0.1")
marker = Path("died").absolute()

def dying_once(rows):
    try:
        marker.touch(exist_ok=False)
    except FileExistsError:
        return work(rows)
    os._exit(1)

parts = [part for path in ("drive.mcap", "second.mcap")
         for part in Recording(path)["/imu"].parts(50_000)]
assert len(parts) >= 4
order = [(name, "ascending") for name in ("log_time", "angular_velocity.z")]
found = ray.data.from_items(parts).map_batches(dying_once, batch_size=1)
found = pa.concat_tables(ray.get(found.to_arrow_refs())).sort_by(order)
assert marker.exists()
alone = pa.concat_tables([work({"item": [part]}) for part in parts]).sort_by(order)
assert found.num_rows == 300
print(found.to_pydict() == alone.to_pydict())
"""


@pytest.mark.long
def test_ray_finds_what_one_process_finds_though_a_worker_dies(tmp_path):
    """Ray is 80 MB that no other test needs: it is added to what is installed here."""
    made.by_mcap(tmp_path / "drive.mcap", made.messages(600), chunk_size=20_000)
    made.by_mcap(tmp_path / "second.mcap", made.messages(300, seed=2), chunk_size=20_000)
    (tmp_path / "program.py").write_text(RAY, encoding="utf-8")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", "env"], cwd=tmp_path, check=True)
    (site,) = (tmp_path / "env").glob("lib/python*/site-packages")
    (site / "others.pth").write_text(f"{sysconfig.get_path('purelib')}\n", encoding="utf-8")
    python = str(tmp_path / "env/bin/python")
    pip = ("-m", "pip", "--python", python, "install", "-q", "--disable-pip-version-check")
    run(tmp_path, *pip, "ray[data]>=2.60")
    env = {**os.environ, "PYTHONPATH": str(ROOT), "RAY_USAGE_STATS_ENABLED": "0"}
    command = [python, "-c", ON_RAY]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=tmp_path, env=env
    )
    assert done.stdout.splitlines()[-1:] == ["True"], done.stderr


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
