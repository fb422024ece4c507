"""`idlc upgrade` on real recordings, with and without rules."""

import json
import os
import shlex
import shutil
import subprocess
import sys

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

import idlc
from idlc.api.upgrade import UpgradeError
from idlc.cli.main import main
from idlc.runtime.typeinfo import type_hash
from idlc.tasks.upgrade.recordings import definition_of
from idlc.versions.classes import version_of
from tests.support import programs
from tests.support.files import write
from tests.support.paths import ROOT

OLD = {
    "Drive": "int16 speed\nfloat32 angle  # [deg]\nWheel[] wheels\n",
    "Wheel": "float32 radius\nHub hub\nstring name\n",
    "Hub": "uint8 teeth\n",
}
#: Versions that need no rule, and some that do.
WIDER = {
    "Drive": "int16 speed\nfloat64 angle  # [deg]\nWheel[] wheels\nint32 gear 3\n",
    "Wheel": "Hub hub\nfloat64 radius\nstring name\n",
    "Hub": "uint16 teeth\n",
}
RENAMED = {**OLD, "Drive": "int16 velocity\nfloat32 angle  # [rad]\nWheel[] wheels\n"}
LATER = {**RENAMED, "Drive": "int16 velocity_x\nfloat32 angle  # [rad]\nWheel[] wheels\n"}
PAIR = "OLD = {}\nNEW = {}\n\n\n"


def write_package(folder, texts, package="drive_msgs"):
    for name, text in texts.items():
        path = folder / package / "msg" / f"{name}.msg"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return str(folder / package)


def write_recording(path, kind, messages, *, defined=True):
    version = version_of(kind)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "test")
        definition = definition_of(version).encode() if defined else b""
        schema = writer.register_schema(version.key.type, "ros2msg", definition)
        metadata = {"topic_type_hash": type_hash(kind)}
        channel = writer.register_channel("/drive", "cdr", schema, metadata)
        for number, message in enumerate(messages):
            writer.add_message(channel, 10 + number, message.serialize(), 20 + number)
        writer.finish()


@pytest.fixture
def old(tmp_path, monkeypatch):
    """A recording, and the classes of its messages."""
    monkeypatch.chdir(tmp_path)
    loaded = idlc.load(write_package(tmp_path / "old", OLD))
    wheel = loaded.Wheel(radius=0.5, hub=loaded.Hub(teeth=200), name="left")
    messages = [loaded.Drive(speed=n, angle=180.0, wheels=[wheel] * n) for n in range(4)]
    write_recording(tmp_path / "a.mcap", loaded.Drive, messages)
    return loaded


def key_of(kind):
    return (version_of(kind).key.type, version_of(kind).key.hash)


def messages_of(path, kind):
    with idlc.Recording(path) as recording:
        return [kind.deserialize(view) for b in recording["/drive"].batches() for view in b.views()]


def test_what_needs_no_rule_is_converted(old, tmp_path, capsys):
    new = idlc.load(write_package(tmp_path / "new", WIDER))
    before = (tmp_path / "a.mcap").read_bytes()
    assert main(["upgrade", "*.mcap", "--to", "new/drive_msgs", "-o", "out"]) == 0
    assert capsys.readouterr().out == "a.mcap → out/a.mcap\n  /drive: 4 messages converted\n"
    assert (tmp_path / "a.mcap").read_bytes() == before
    made = messages_of(tmp_path / "out" / "a.mcap", new.Drive)
    assert [message.speed for message in made] == [0, 1, 2, 3]
    hub = new.Hub(teeth=200)
    assert made[3] == new.Drive(
        speed=3, angle=180.0, wheels=[new.Wheel(hub=hub, radius=0.5, name="left")] * 3, gear=3
    )
    with (tmp_path / "out" / "a.mcap").open("rb") as file:
        (schema, channel, _), *_ = make_reader(file).iter_messages()
    assert channel.metadata["topic_type_hash"] == type_hash(new.Drive)
    assert schema.data.decode() == definition_of(version_of(new.Drive))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "new", "old", "out"]


@pytest.mark.parametrize("source", ["git:v1", "old/drive_msgs"])
def test_definitions_that_were_not_recorded_come_from_elsewhere(old, source, tmp_path, capsys):
    """Humble's .db3 files have none; a recorder also leaves out those that it does not find."""
    write_package(tmp_path / "src", OLD)
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "first"], ["tag", "v1"]):
        programs.run("git", "-c", "user.name=A", "-c", "user.email=a@b.c", *words, cwd="src")
    write_package(tmp_path / "src", WIDER)
    write_recording(tmp_path / "a.mcap", old.Drive, [old.Drive(speed=7)], defined=False)
    words = ["upgrade", "a.mcap", "--to", "src/drive_msgs", "-o"]
    assert main([*words, "unchanged"]) == 1
    shown = capsys.readouterr()
    assert "  /drive: copied, because its type is not known\n" in shown.out
    assert "error[IDL652]: idlc does not read `/drive`: the recording does not def" in shown.err
    assert "hint: give the publisher's version with `--from PATH`" in shown.err
    (copied,) = messages_of(tmp_path / "unchanged" / "a.mcap", old.Drive)
    assert copied == old.Drive(speed=7)
    assert main(["upgrade", "a.mcap", "--diff"]) == 1
    assert "no types changed" not in capsys.readouterr().out
    assert main([*words, "out", "--from", source]) == 0
    (made,) = messages_of(tmp_path / "out" / "a.mcap", idlc.load("src/drive_msgs").Drive)
    assert (made.speed, made.gear) == (7, 3)


@pytest.mark.parametrize(
    ("source", "problem"),
    [("git:v2", "v2"), ("nowhere", "no such file or folder"), ("distro:foxy", "no such distrib")],
)
def test_an_old_version_that_does_not_exist_is_an_error(old, source, problem, tmp_path, capsys):
    write_package(tmp_path / "new", WIDER)
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out", "--from", source]
    assert main(words) in (1, 2)
    assert problem in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_comments_change_the_definition_only(old, tmp_path, capsys):
    remarked = {**OLD, "Drive": "# A drive.\nint16 MOST=9\n" + OLD["Drive"]}
    write_package(tmp_path / "new", remarked)
    assert main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out"]) == 0
    assert "4 messages copied under the new definition" in capsys.readouterr().out
    payloads = []
    for path in ("a.mcap", "out/a.mcap"):
        with (tmp_path / path).open("rb") as file:
            payloads.append([message.data for _, _, message in make_reader(file).iter_messages()])
    assert payloads[0] == payloads[1]
    with idlc.Recording("out/a.mcap") as recording:
        assert "# A drive." in recording.topics[0].schema.text


def test_a_dry_run_shows_the_fate_of_each_field(old, tmp_path, capsys):
    write_package(tmp_path / "new", WIDER)
    assert main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "--diff", "--format", "json"]) == 0
    topic, summary = map(json.loads, capsys.readouterr().out.splitlines())
    assert topic["type"] == "topic"
    assert (topic["type_name"], topic["topic"], topic["fate"]) == (
        "drive_msgs/msg/Drive",
        "/drive",
        "automatic",
    )
    assert topic["hash"] == type_hash(old.Drive)
    fates = {each["path"]: each["fate"] for each in topic["findings"]}
    names = ("angle", "gear", "wheels[].radius", "wheels[].hub.teeth")
    assert fates == dict.fromkeys(names, "automatic")
    angle = next(each for each in topic["findings"] if each["path"] == "angle")
    assert angle["span"] == "new/drive_msgs/msg/Drive.msg:2:9"
    assert angle["old"] == "a.mcap: topic /drive: drive_msgs/msg/Drive.msg:2:9"
    assert summary == {"type": "summary", "errors": 0, "warnings": 0}
    assert not (tmp_path / "out").exists()


def test_hints_lead_to_an_upgraded_recording(old, tmp_path, capsys):
    """The commands in the hints work as they are pasted."""
    new = idlc.load(write_package(tmp_path / "new", RENAMED))
    assert main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out"]) == 1
    errors = capsys.readouterr().err
    assert errors.count("error[IDL661]") == 2
    assert main(pasted(errors)) == 0
    stub = capsys.readouterr().out.strip()
    text = (tmp_path / stub).read_text(encoding="utf-8")
    assert "-> int:\n    # field `speed` was renamed to `velocity`\n    return old.speed\n" in text
    assert "return old.angle * 0.017453292519943295" in text
    assert main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out"]) == 1
    assert main(pasted(capsys.readouterr().err)) == 0
    made = messages_of(tmp_path / "out" / "a.mcap", new.Drive)
    assert [message.velocity for message in made] == [0, 1, 2, 3]
    assert made[0].angle == pytest.approx(3.14159265)
    # of the new units nothing is left to convert
    capsys.readouterr()
    rules = ["--rules", "new/drive_msgs/upgrade"]
    words = ["upgrade", "out/a.mcap", "--to", "new/drive_msgs", "--diff", *rules]
    assert main(words) == 0
    assert capsys.readouterr().out == "no types changed\n"


def pasted(errors):
    hint = next(line for line in errors.splitlines() if "= hint: " in line)
    program, *words = shlex.split(hint.split("`")[1])
    assert program == "idlc"
    return words


def test_a_stub_is_typed(old, tmp_path):
    write_package(tmp_path / "new", RENAMED)
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "--write-rules", "new/rules"]
    assert main(words) == 0
    site = tmp_path / "site" / "idlc"
    site.mkdir(parents=True)
    for name in ("__init__.py", "version.py", "py.typed", "runtime"):
        (site / name).symlink_to(ROOT / "idlc" / name)
    check = [sys.executable, "-m", "mypy", "--strict", "rules", "--follow-imports=silent"]
    env = {**os.environ, "MYPYPATH": str(site.parent)}
    where = tmp_path / "new"
    done = subprocess.run(check, cwd=where, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    stub = next(path for path in (where / "rules").glob("drive*.py"))
    text = stub.read_text(encoding="utf-8")
    stub.write_text(text.replace("old.speed", "old.sped"), encoding="utf-8")
    done = subprocess.run(check, cwd=where, env=env, capture_output=True, text=True, check=False)
    assert '"Drive" has no attribute "sped"' in done.stdout


def test_a_function_that_is_missing_is_added(old, tmp_path, capsys):
    write_package(tmp_path / "new", RENAMED)
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "--write-rules", "rules"]
    assert main(words) == 0
    stub = tmp_path / capsys.readouterr().out.strip()
    whole = stub.read_text(encoding="utf-8")
    mine = whole[: whole.index("\n\ndef angle")] + "\n\n# mine\n"
    stub.write_text(mine, encoding="utf-8")
    assert main(words) == 0
    added = stub.read_text(encoding="utf-8")
    assert added.startswith(mine.rstrip("\n") + "\n")
    assert added.count("def velocity") == added.count("def angle") == 1
    assert main(words) == 0
    assert stub.read_text(encoding="utf-8") == added


def rules_file(path, old, new, *functions):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(PAIR.format(old, new) + "\n\n".join(functions), encoding="utf-8")
    return str(path)


def test_a_value_that_does_not_fit_is_an_error(old, tmp_path, capsys):
    new = idlc.load(write_package(tmp_path / "new", {**OLD, "Drive": "int8 speed\n"}))
    keys = key_of(old.Drive), key_of(new.Drive)
    path = rules_file(tmp_path / "r.py", *keys, "def speed(old): return old.speed * 60\n")
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "--rules", path, "-o", "out"]
    assert main(words) == 1
    message = "`/drive` at 13 ns: speed: must be an integer from -128 to 127 (int8), not 180"
    assert message in capsys.readouterr().err
    assert not [path for path in (tmp_path / "out").glob("**/*") if path.is_file()]
    rules_file(tmp_path / "r.py", *keys, "def speed(old): return [][old.speed]\n")
    assert main(words) == 1
    message = "`/drive` at 10 ns: speed: the rule raised IndexError: list index out of range"
    assert message in capsys.readouterr().err


def test_rules_lead_over_versions_in_between(old, tmp_path, capsys):
    between = idlc.load(write_package(tmp_path / "between", RENAMED))
    new = idlc.load(write_package(tmp_path / "new", LATER))
    folder = tmp_path / "new" / "drive_msgs" / "upgrade"
    words = ["upgrade", "a.mcap", "--to", "between/drive_msgs", "--write-rules", str(folder)]
    assert main(words) == 0
    keys = key_of(between.Drive), key_of(new.Drive)
    rules_file(folder / "second.py", *keys, "def velocity_x(old): return old.velocity + 1\n")
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "--rules", str(folder), "-o", "out"]
    assert main(words) == 0, capsys.readouterr().err
    made = messages_of(tmp_path / "out" / "a.mcap", new.Drive)
    assert [message.velocity_x for message in made] == [1, 2, 3, 4]
    assert made[0].angle == pytest.approx(3.14159265)
    assert made[3].wheels[0].hub.teeth == 200


def test_only_named_rules_are_run(old, tmp_path, capsys):
    new = idlc.load(write_package(tmp_path / "new", RENAMED))
    folder = tmp_path / "new" / "drive_msgs" / "upgrade"
    functions = (
        "open('canary', 'w').close()\n",
        "def velocity(old): return old.speed\n",
        "def angle(old): return old.angle\n",
        "UNITS = {'angle': ('deg', 'rad')}\n",
    )
    rules_file(folder / "drive.py", key_of(old.Drive), key_of(new.Drive), *functions)
    main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out"])
    assert "run the rules: `idlc upgrade" in capsys.readouterr().err
    main(["check", "new/drive_msgs"])
    main(["breaking", "new/drive_msgs", "--against", "old/drive_msgs"])
    assert "drive.py converts recorded data" in capsys.readouterr().out
    main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "--diff", "--rules", str(folder)])
    assert not (tmp_path / "canary").exists()
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out", "--rules", str(folder)]
    assert main(words) == 0
    assert (tmp_path / "canary").exists()


@pytest.mark.parametrize(
    "text",
    [
        "def velocity(:",
        "\0",
        "(" * 5000 + ")" * 5000,
        "OLD = " + "-" * 20000 + "1",
        f"OLD = {'9' * 10000}",
        "OLD = ('a', 1)\nNEW = ('a', 'b')",
        "OLD = ('', '')\nNEW = ('../../a', 'b')",
        "OLD = NEW = ('drive_msgs/msg/Drive', 'RIHS01_')",
        "\ud800",
    ],
)
def test_hostile_rules_are_refused_or_without_effect(old, tmp_path, capsys, text):
    write_package(tmp_path / "new", RENAMED)
    path = tmp_path / "new" / "drive_msgs" / "upgrade" / "drive.py"
    path.parent.mkdir()
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    main(["check", "new/drive_msgs"])
    main(["breaking", "new/drive_msgs", "--against", "old/drive_msgs"])
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out"]
    assert main(words) == main([*words, "--rules", str(path)]) == 1
    output = capsys.readouterr()
    assert "IDL901" not in output.out + output.err
    assert not (tmp_path / "out").exists()


def test_a_removed_type_is_lost(old, tmp_path, capsys):
    write_package(tmp_path / "new", {"Motor": "int8 power\n"})
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out"]
    assert main(words) == 1
    assert (
        "error[IDL662]: `/drive`: type `drive_msgs/msg/Drive` was removed"
        in capsys.readouterr().err
    )
    assert main([*words, "--allow-loss"]) == 0
    assert messages_of(tmp_path / "out" / "a.mcap", old.Drive)[3].speed == 3


def test_a_renamed_type_needs_rules(old, tmp_path, capsys):
    new = idlc.load(write_package(tmp_path / "new", {**OLD, "Motion": OLD["Drive"], "Drive": ""}))
    (tmp_path / "new" / "drive_msgs" / "msg" / "Drive.msg").unlink()
    keys = key_of(old.Drive), key_of(new.Motion)
    path = rules_file(tmp_path / "r.py", *keys, "def speed(old): return old.speed + 1\n")
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "--rules", path, "-o", "out"]
    assert main(words) == 0, capsys.readouterr().err
    assert [m.speed for m in messages_of(tmp_path / "out" / "a.mcap", new.Motion)] == [1, 2, 3, 4]


def test_wrong_calls_end_with_status_2(old, tmp_path, capsys):
    write_package(tmp_path / "new", WIDER)
    assert main(["upgrade", "a.mcap"]) == 2
    assert main(["upgrade", "nothing.mcap", "-o", "out"]) == 2
    assert main(["upgrade", "a.mcap", "--to", "distro:nope", "-o", "out"]) == 2
    assert main(["upgrade", "a.mcap", "--to", "nothing", "-o", "out"]) == 2
    assert main(["upgrade", "a.mcap", "/no", "--to", "new/drive_msgs", "-o", "o"]) == 2
    assert main(["upgrade", "a.mcap", "--rules", "no.py", "--to", "new/drive_msgs", "-o", "o"]) != 0
    assert main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "."]) == 1
    assert "`./a.mcap` exists" in capsys.readouterr().err


def test_a_folder_of_a_bag_is_named_in_any_way(old, tmp_path, monkeypatch, capsys):
    target = write_package(tmp_path / "new", WIDER)
    (tmp_path / "bag" / "notes").mkdir(parents=True)
    (tmp_path / "a.mcap").rename(tmp_path / "bag" / "a.mcap")
    for place, word in (
        (tmp_path, "bag/"),
        (tmp_path / "bag", "."),
        (tmp_path / "bag/notes", ".."),
    ):
        monkeypatch.chdir(place)
        out = str(tmp_path / f"out{len(word)}{word.count('.')}")
        assert main(["upgrade", word, "--to", target, "-o", f"{out}/"]) == 0
        assert capsys.readouterr().out.startswith(f"{word} → {out}/bag\n")
        assert (tmp_path / out / "bag" / "a.mcap").is_file()


def test_recordings_are_read_as_the_new_type(old, tmp_path):
    new = idlc.load(write_package(tmp_path / "new", WIDER))
    with idlc.Recording("a.mcap", as_=new.Drive) as recording:
        topic = recording["/drive"]
        assert topic.to_columns()["gear"].tolist() == [3] * 4
        assert [message.speed for _, message in topic] == [0, 1, 2, 3]
        assert topic.kind is new.Drive
        pytest.importorskip("pyarrow")
        assert topic.to_arrow()["angle"].to_pylist() == [180.0] * 4


def test_services_and_nested_types_of_a_real_recorder_are_converted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = ROOT / "tests" / "recordings" / "service_events"
    shutil.copytree(folder / "kit_msgs", tmp_path / "kit_msgs")
    service, leaf = tmp_path / "kit_msgs/srv/Add.srv", tmp_path / "kit_msgs/msg/Leaf.msg"
    text = "int64 a\nint64 b\nint64 gamma 7\n---\nfloat64 half\nint64 sum\nstring note\n"
    service.write_text(text, encoding="utf-8")
    leaf.write_text(leaf.read_text(encoding="utf-8") + "int32 extra 5\n", encoding="utf-8")
    recording = str(folder / "service_events.mcap")
    # nothing defines the type of one topic, which is copied
    assert main(["upgrade", recording, "--to", "kit_msgs", "-o", "out"]) == 1
    include = [str(tmp_path)]
    with (
        idlc.Recording(recording, include=[str(folder)]) as before,
        idlc.Recording("out/service_events.mcap", include=include) as after,
    ):
        assert list(before) == list(after)
        for topic in before:
            if "_action/feedback" in topic:  # whose definition was not recorded
                continue
            old = [message.to_dict() for _, message in before[topic]]
            new = [message.to_dict() for _, message in after[topic]]
            assert [without_added(values) for values in new] == old
            if topic == "/leaf":
                assert {values["extra"] for values in new} == {5}
            if topic == "/add/_service_event":
                assert {r["gamma"] for values in new for r in values["request"]} == {7}
        assert after["/rosout"].topic.schema == before["/rosout"].topic.schema


def without_added(value):
    if isinstance(value, dict):
        added = ("gamma", "half", "extra")
        return {key: without_added(each) for key, each in value.items() if key not in added}
    return [without_added(each) for each in value] if isinstance(value, list) else value


def test_a_revision_is_a_version(old, tmp_path, monkeypatch, capsys):
    write_package(tmp_path / "git", WIDER)
    for words in ("init -q", "add --all", "-c user.name=a -c user.email=a@b commit -qm wider"):
        programs.run("git", *words.split(), cwd=tmp_path / "git")
    write_package(tmp_path / "git", RENAMED)
    monkeypatch.chdir(tmp_path / "git" / "drive_msgs")
    words = ["upgrade", "../../a.mcap", "-o", "../../out", "--to", "git:HEAD"]
    assert main(words) == 0, capsys.readouterr().err
    new = idlc.load(write_package(tmp_path / "new", WIDER))
    assert messages_of(tmp_path / "out" / "a.mcap", new.Drive)[2].gear == 3


def test_sections_of_services_and_actions_are_converted(tmp_path):
    texts = {
        "srv/Ask.srv": (
            "string name\n---\nint8 count\n",
            "string name\nbool loud\n---\nint16 count\n",
        ),
        "action/Go.action": ("int8 goal\n---\n---\n", "int16 goal\nbool soon true\n---\n---\n"),
    }
    versions = []
    for number in (0, 1):
        for path, pair in texts.items():
            write(tmp_path / f"{number}/kit_msgs/{path}", pair[number])
        versions.append(idlc.load(tmp_path / f"{number}/kit_msgs"))
    old, new = versions
    request = idlc.upgrade(old.Ask.Request, new.Ask.Request)
    assert request.message(old.Ask.Request(name="Ada")) == new.Ask.Request(name="Ada", loud=False)
    goal = idlc.upgrade(old.Go.Goal, new.Go.Goal)
    assert goal.message(old.Go.Goal(goal=3)) == new.Go.Goal(goal=3, soon=True)
    with pytest.raises(UpgradeError, match=r"Ask_Response.* needs rules .*: count: "):
        idlc.upgrade(new.Ask.Response, old.Ask.Response)


GATE = "uint8 OPEN=0\nuint8 CLOSED=1\nuint8 state\nuint8 zone 3\n"


@pytest.mark.parametrize(
    ("before", "after", "field", "values"),
    [
        (GATE, GATE.replace("OPEN=0", "OPEN=1").replace("CLOSED=1", "CLOSED=0"), "state", [1, 0]),
        (
            "uint8 zone\nuint8 MODE_A=1\nuint8 MODE_B=2\nuint8[] mode # idlc: enum\n",
            "uint8 zone\nuint8 MODE_A=5\nuint8 MODE_B=2\nuint8[] mode # idlc: enum\n",
            "mode",
            [[1, 2, 9], [5, 2, 9]],
        ),
        (
            'string LEFT="l"\nstring side\n',
            'string LEFT="left"\nstring side\nuint8 more\n',
            "side",
            ["l", "left"],
        ),
        ("In i\n", "In i\n", "i", [0, 1]),
    ],
)
def test_renumbered_constants_need_a_rule(
    before, after, field, values, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    inner = [GATE, GATE.replace("OPEN=0", "OPEN=1").replace("CLOSED=1", "CLOSED=0")]
    kinds = []
    for side, text, nested in zip(("old", "new"), (before, after), inner, strict=True):
        texts = {"Gate": text, **({"In": nested} if field == "i" else {})}
        kinds.append(idlc.load(write_package(tmp_path / side, texts)))
    old, new = kinds
    first = old.Gate(i=old.In(state=values[0])) if field == "i" else old.Gate(**{field: values[0]})
    write_recording(tmp_path / "a.mcap", old.Gate, [first])
    command = ["upgrade", "a.mcap", "--to", "new/drive_msgs"]
    assert main([*command, "-o", "out"]) == 1
    assert "constants changed from" in capsys.readouterr().err
    with pytest.raises(UpgradeError, match="constants changed"):
        list(idlc.Recording("a.mcap", as_=new.Gate)["/drive"].messages())
    assert main([*command, "--write-rules", "rules"]) == 0
    again = [*command, "--rules", "rules", "-o"]
    assert main([*again, "out"]) == 0
    assert main(["upgrade", "out/a.mcap", *again[2:], "twice"]) == 0
    for folder in ("out", "twice"):  # a second run changes nothing
        (message,) = messages_of(tmp_path / folder / "a.mcap", new.Gate)
        value = message.i.state if field == "i" else getattr(message, field)
        assert (list(value) if isinstance(values[1], list) else value) == values[1]


def test_constants_of_no_field_need_no_rule(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = "uint16 VERSION={}\nfloat32 LIMIT={}\nfloat32 speed\n"
    old, _ = (
        idlc.load(write_package(tmp_path / side, {"Gate": text.format(n, n)}))
        for n, side in enumerate(("old", "new"))
    )
    write_recording(tmp_path / "a.mcap", old.Gate, [old.Gate(speed=1)])
    assert main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "-o", "out"]) == 0
    assert "copied under the new definition" in capsys.readouterr().out
