"""`idlc columns --grid`: topics on one clock, in one file, after a summary."""

import csv
from pathlib import Path

from pyarrow import parquet

import idlc
from idlc.cli.main import main
from tests.support import recordings as made


def test_a_file_holds_the_table_and_a_summary_comes_first(here, capfd):
    made.by_mcap(here / "rec.mcap", made.messages())
    grid = ("--grid", "/camera/image", "--how", "/imu=linear", "--tolerance", "250ms")
    command = ["columns", "rec.mcap", "/camera/image:width,data", "/imu:orientation", *grid]
    assert main([*command, "-o", "train.parquet"]) == 0
    lines = capfd.readouterr().err.splitlines()
    assert lines[1].split()[:4] == ["/camera/image", "20", "3.333", "Hz"]
    assert lines[3] == "/camera/image, /imu: 20 rows → train.parquet"
    topics = {"/camera/image": ["width", "data"], "/imu": "orientation"}
    with idlc.Recording("rec.mcap") as recording:
        ways = {"how": {"/imu": "linear"}, "tolerance": "250ms"}
        table = recording.aligned(topics, on="/camera/image", **ways).to_arrow()
    assert parquet.read_table("train.parquet").equals(table, check_metadata=True)
    assert main([*command, "-o", "train.parquet"])
    assert "`train.parquet` exists" in capfd.readouterr().err
    assert main([*command, "--format", "text"]) == 0
    assert capfd.readouterr().out.splitlines() == lines[:3]


def test_gaps_stay_gaps_in_every_format(here):
    """Lists, bytes and messages without fields, which files hold in ways of their own."""
    types = ("/Empty", "/MarkerArray", "/String", "/OccupancyGrid")
    found = [message for message in made.varied() if message.topic in types]
    made.by_mcap(here / "rec.mcap", found)
    for name in ("a.parquet", "a.csv", "a.arrow"):
        grid = ("--grid", "60ms", "--tolerance", "10ms", "-o", name)
        assert main(["columns", "rec.mcap", *grid]) == 0
    with idlc.Recording("rec.mcap") as recording:
        table = recording.aligned(list(types), every="60ms", tolerance="10ms").to_arrow()
    written = parquet.read_table("a.parquet")
    with Path("a.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for name in table.column_names:
        gaps = table[name].is_null().to_pylist()
        assert any(gaps) != (name == "time")
        assert written[name].is_null().to_pylist() == gaps
        if not name.endswith((".data", "_id", "frame_id")):  # CSV has no empty texts
            assert [not row[name] for row in rows] == gaps


def test_what_cannot_be_done_is_said(here, capfd):
    made.by_mcap(here / "rec.mcap", made.messages(9))
    cases = {
        ("--how", "last"): "--how, --tolerance and --clock need --grid",
        ("--grid", "/imu", "--fields", "x"): "--grid has no --fields",
        ("--grid", "/im"): "has no topic `/im`",
        ("--grid", "fast"): "'fast' is not a length of time",
        ("--grid", "1s", "/imu:orientatio"): "has no field 'orientatio'",
        ("--grid", "1s", "/imu:orientation", "--how", "linear"): "",
        ("--grid", "1s", "-o", "a.txt"): "`a.txt` has no extension of a known format",
    }
    for words, message in cases.items():
        out = () if "-o" in words else ("-o", "a.parquet", "--force")
        assert bool(main(["columns", "rec.mcap", *words, *out])) == bool(message)
        assert message in capfd.readouterr().err
