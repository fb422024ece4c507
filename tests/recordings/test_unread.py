"""Recordings of messages that idlc does not read: of other encapsulations, or compressed."""

import re
from pathlib import Path

import pytest

import idlc
from idlc.cli.main import main
from idlc.recordings.containers.source import RecordingError
from tests.recordings.test_containers import LEAVES_OUT
from tests.support import recordings as made

SENTENCES = {
    **dict.fromkeys(["0002", "0003"], "are encoded as PL_CDR (XCDR1)"),
    **dict.fromkeys(["0006", "0007"], "are encoded as PLAIN_CDR2 (XCDR2)"),
    **dict.fromkeys(["0008", "0009"], "are encoded as DELIMITED_CDR2 (XCDR2)"),
    **dict.fromkeys(["000a", "000b"], "are encoded as PL_CDR2 (XCDR2)"),
    "04224d18": "are compressed with lz4",
    "1f8b0800": "are compressed with gzip",
    "425a6839": "are compressed with bzip2",
    "fd377a585a00": "are compressed with xz",
}
#: So many bytes of a chunk are before its content.
CHUNK_HEAD = {"zstd": 9 + 40 + 4, "lz4": 9 + 40 + 3}
OTHERS = ["", "00", "0001", "0000", "0004", "04224d17", "28b52ffd"]


def messages(start, topic="/imu"):
    """Return messages of which those of one topic begin with other bytes."""
    head = bytes.fromhex(start)
    return [
        one._replace(data=head + one.data[len(head) :] if start else b"")
        if one.topic == topic
        else one
        for one in made.messages()
    ]


@pytest.fixture
def notes(capfd):
    def notes_of(path, command):
        main([command, str(path)])
        lines = "".join(capfd.readouterr()).splitlines()
        return [line for line in lines if line.startswith(("note: messages of", "warning[IDL651]"))]

    return notes_of


@pytest.mark.parametrize("start", SENTENCES)
def test_topics_that_cannot_be_read_are_noted(start, notes, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", messages(start), chunk_size=3000)
    for command in ("show", "check"):
        (note,) = notes(path, command)
        assert f": messages of `/imu` {SENTENCES[start]}, but idlc reads only" in note


def test_the_page_of_the_code_shows_the_warning(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made.by_mcap(Path("drive.mcap"), messages("0007"))
    assert main(["check", "drive.mcap"]) == 0
    shown = "".join(capsys.readouterr()).split("warning[IDL651]")[1].partition("\n\n")[0]
    assert main(["explain", "IDL651"]) == 0
    assert shown.replace("/imu", "/scan") in capsys.readouterr().out


@pytest.mark.parametrize("start", OTHERS)
def test_other_topics_are_not_noted(start, notes, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", messages(start))
    assert not notes(path, "show") + notes(path, "check")


@pytest.mark.parametrize("left_out", LEAVES_OUT)
@pytest.mark.parametrize("compression", made.COMPRESSIONS)
@pytest.mark.parametrize("topic", made.MAKERS)
def test_mcap_files_of_every_kind(left_out, compression, topic, notes, tmp_path):
    options = {"chunk_size": 3000, **LEAVES_OUT[left_out]}
    path = made.by_mcap(tmp_path / "a.mcap", messages("0007", topic), compression, **options)
    (note,) = notes(path, "show")
    assert f"`{topic}`" in note


@pytest.mark.parametrize("storage", ["db3", "mcap"])
def test_bags(storage, notes, tmp_path):
    bag = made.by_rosbags(tmp_path / "bag", messages("000b"), storage)
    (note,) = notes(bag, "check")
    assert "PL_CDR2 (XCDR2)" in note


def test_a_damaged_chunk_does_not_keep_a_recording_from_being_shown(tmp_path, capfd):
    path = made.by_mcap(tmp_path / "a.mcap", messages("0007"))
    data = path.read_bytes()
    at = data.index(b"\x28\xb5\x2f\xfd")
    path.write_bytes(data[: at + 8] + bytes(64) + data[at + 72 :])
    assert main(["show", str(path)]) == 0
    assert "/imu" in capfd.readouterr().out


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_damaged_chunk_of_a_file_that_was_not_closed_costs_its_topics_only(compression, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", made.messages(), compression, chunk_size=1)
    data = path.read_bytes()
    magic = {"zstd": b"\x28\xb5\x2f\xfd", "lz4": b"\x04\x22\x4d\x18"}[compression]
    at = [found.start() for found in re.finditer(re.escape(magic), data)][30]
    path.write_bytes(data[:at] + bytes(40) + data[at + 40 : -100])
    with idlc.Recording(path) as recording:
        (damage,) = recording.damage
        assert (damage.messages, damage.start) == (1, at - CHUNK_HEAD[compression])
        assert "cannot be decompressed" in damage.problem
        for name in recording:
            assert len(recording[name].to_columns()) == 20 - (name == "/imu")


@pytest.mark.parametrize("start", SENTENCES)
@pytest.mark.parametrize("storage", ["db3", "mcap"])
def test_reading_says_what_messages_are(start, storage, tmp_path):
    bag = made.by_rosbags(tmp_path / "bag", messages(start), storage)
    with idlc.Recording(bag) as recording:
        topic = recording["/imu"]
        for read in (lambda: list(topic.messages()), topic.to_columns, topic.to_arrow):
            with pytest.raises(RecordingError) as caught:
                read()
            assert SENTENCES[start] in str(caught.value)
            assert "broken" not in str(caught.value)
            assert caught.value.hint
        assert len(recording["/joints"].to_columns()) == 20
