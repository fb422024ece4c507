"""Loaded classes are found by what pickles hold of them, in any process."""

import pickle
import subprocess
import sys

import cloudpickle
import pytest

import idlc

DEFINITIONS = {
    "msg/Inner.msg": "float32 x\n",
    "msg/Outer.msg": "Inner[] inner\nstd_msgs/Header header\n",
    "srv/Ask.srv": "Inner inner\n---\nbool ok\n",
    "action/Drive.action": "float32 far\n---\nbool ok\n---\nfloat32 left\n",
}
#: Reads a pickle where nothing was loaded before.
READER = "import pickle, sys; print(pickle.load(open(sys.argv[1], 'rb')))"


@pytest.fixture
def packages(tmp_path):
    for path, text in DEFINITIONS.items():
        file = tmp_path / "demo_msgs" / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return idlc.load(str(tmp_path / "demo_msgs"))


def read_elsewhere(tmp_path, data):
    path = tmp_path / "value.pickle"
    path.write_bytes(data)
    return subprocess.run(
        [sys.executable, "-c", READER, str(path)],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    ).stdout.strip()


@pytest.mark.parametrize("dumps", [pickle.dumps, cloudpickle.dumps])
def test_another_process_reads_pickles_of_loaded_classes(packages, tmp_path, dumps):
    msg, srv, action = (getattr(packages.demo_msgs, kind) for kind in ("msg", "srv", "action"))
    header = packages.std_msgs.msg.Header(frame_id="map")
    values = [
        msg.Outer(inner=[msg.Inner(x=1.5)], header=header),
        srv.Ask.Request(inner=msg.Inner(x=2.5)),
        srv.Ask.Event(),
        action.Drive.Impl.FeedbackMessage(),
        (msg.Outer, srv.Ask, action.Drive),
    ]
    for value in values:
        data = dumps(value)
        assert pickle.loads(data) == value
        assert read_elsewhere(tmp_path, data) == str(value)


def test_a_checked_message_stays_one(packages, tmp_path):
    message = packages.demo_msgs.msg.Inner(x=1.5)
    message._check_fields = True
    assert pickle.loads(pickle.dumps(message))._check_fields
    assert read_elsewhere(tmp_path, pickle.dumps(message)) == "demo_msgs.msg.Inner(x=1.5)"


def test_a_pickle_of_many_messages_holds_their_classes_once(packages):
    inner = packages.demo_msgs.msg.Inner
    single, many = (len(pickle.dumps([inner(x=n) for n in range(count)])) for count in (1, 101))
    assert single < 20_000
    assert many - single < 100 * 100


class Own:
    """The place of a class that a test derives from a loaded one."""


def test_a_class_that_a_user_derives_is_found_by_its_name(packages):
    Own.kind = type(
        "kind",
        (packages.demo_msgs.msg.Inner,),
        {"__module__": __name__, "__qualname__": "Own.kind"},
    )
    assert pickle.loads(pickle.dumps(Own.kind(x=2.0))) == Own.kind(x=2.0)
    assert pickle.loads(pickle.dumps(Own.kind)) is Own.kind


def test_modules_are_not_looked_for_where_programs_run(packages, tmp_path, monkeypatch):
    """A folder of the working directory has the name of a loaded package."""
    monkeypatch.chdir(tmp_path)
    again = idlc.load("demo_msgs")
    assert again.demo_msgs.msg.Inner is packages.demo_msgs.msg.Inner
