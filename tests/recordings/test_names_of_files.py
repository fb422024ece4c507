"""The order of the files of a recording, and files that are no recordings."""

import random

import pytest
import zstandard

import idlc
from idlc.cli.main import main
from idlc.project.words import expand, in_order
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.damage import DamageWarning
from tests.support import recordings as made

ORDERS = [
    ["run_0.mcap", "run_1.mcap", "run_2.mcap", "run_10.mcap", "run_11.mcap"],
    ["a_9.mcap", "a_10.mcap", "b_1.mcap"],
    ["2024-9-1_3.mcap", "2024-9-1_20.mcap", "2024-10-1_1.mcap"],
]


@pytest.mark.parametrize("names", ORDERS)
def test_a_pattern_and_a_folder_sort_by_numbers(names, tmp_path):
    message = made.messages(1)[0]
    for number, name in enumerate(names):
        made.by_mcap(tmp_path / name, [message._replace(log_time=number)])
    assert [one.rpartition("/")[2] for one in expand(str(tmp_path / "*.mcap"))] == names
    for place in (tmp_path, expand(str(tmp_path / "*.mcap"))):
        with idlc.Recording(place) as recording:
            times = recording["/imu"].to_columns()["log_time"].tolist()
            assert times == list(range(len(names)))


def test_what_a_shell_expanded_is_sorted_and_other_words_are_not():
    assert in_order(sorted(ORDERS[0])) == ORDERS[0]
    assert in_order(["b.mcap", "a.mcap"]) == ["b.mcap", "a.mcap"]
    assert in_order(["b/run_2.mcap", "a/run_1.mcap"]) == ["b/run_2.mcap", "a/run_1.mcap"]


@pytest.mark.parametrize(
    ("content", "message", "hint"),
    [
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS", "git lfs pull"),
        (b"/annex/objects/SHA256E-s1--0.mcap\n", "git-annex", "git annex get"),
        (b"#ROSBAG V2.0\n", "ROS 1", "rosbags-convert --src"),
    ],
)
def test_the_hint_leads_on(content, message, hint, tmp_path, capsys):
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=message) as caught:
        idlc.Recording(path)
    assert hint in caught.value.hint
    assert main(["show", str(path)]) == 1
    assert hint in capsys.readouterr().err


@pytest.mark.parametrize("encoding", ["json", "ros1", "protobuf"])
def test_messages_of_other_encodings(encoding, tmp_path, capsys):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = made.Writer(file)
        writer.start()
        schema = writer.register_schema("demo/msg/P", "jsonschema", b"{}")
        writer.add_message(writer.register_channel("/j", encoding, schema), 1, b"{}", 1)
        writer.finish()
    assert main(["check", str(path)]) == 0
    said = "".join(capsys.readouterr())
    assert f"idlc does not read `/j`: its messages are written as `{encoding}`" in said
    assert "-I" not in said
    with idlc.Recording(path) as recording, pytest.raises(RecordingError) as caught:
        recording["/j"].to_columns()
    assert "mcap" in caught.value.hint


@pytest.mark.parametrize("storage", ["db3", "mcap"])
@pytest.mark.parametrize("beside", [True, False])
def test_a_bag_that_is_compressed_by_files(storage, beside, tmp_path):
    messages = made.messages(30)
    bag = made.by_rosbags(tmp_path / "bag", messages, storage)
    (path,) = bag.glob(f"*.{storage}")
    packed = path.with_name(path.name + ".zstd")
    packed.write_bytes(zstandard.compress(path.read_bytes()))
    metadata = bag / "metadata.yaml"
    text = metadata.read_text(encoding="utf-8").replace(path.name, packed.name)
    metadata.write_text(text, encoding="utf-8")
    if not beside:
        path.unlink()
    for place in (bag, packed):
        with idlc.Recording(place) as recording:
            topic = recording["/imu"]
            (part,) = topic.parts()
            assert len(topic.to_columns()) == len(part.to_columns()) == 10
            assert recording.notes == recording.damage == ()


def test_a_compressed_file_that_is_cut_off(tmp_path):
    rng = random.Random(1)
    messages = [one._replace(data=one.data + rng.randbytes(9000)) for one in made.messages(90)]
    path = made.by_mcap(tmp_path / "a.mcap", messages, "", chunk_size=20_000)
    packed = zstandard.compress(path.read_bytes())
    place = tmp_path / "a.mcap.zstd"
    place.write_bytes(packed[: len(packed) // 2])
    path.unlink()
    with pytest.warns(DamageWarning), idlc.Recording(place) as recording:
        assert 0 < sum(topic.count for topic in recording.topics) < 90
    with pytest.raises(RecordingError):
        idlc.Recording(place, strict=True)
