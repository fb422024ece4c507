"""A path or text in place of a class, and the other way round, is an error in words."""

import contextlib
from pathlib import Path

import pytest

import idlc
from idlc.recordings.containers.source import RecordingError
from tests.support.files import write_all
from tests.tasks.test_upgrade import write_recording

#: Calls with an argument, and the kind of argument that each takes.
CALLS = {
    "as_": ("class", lambda _, given: idlc.Recording("r.mcap", as_=given)),
    "several as_": ("class", lambda _, given: idlc.Recording("r.mcap", as_=[given])),
    "reader": ("class", lambda _, given: idlc.reader(given, "a")),
    "patch": ("class", lambda it, given: idlc.patch(given, it().serialize(), {"a": 1})),
    "upgrade from": ("class", lambda it, given: idlc.upgrade(given, it)),
    "upgrade to": ("class", lambda it, given: idlc.upgrade(it, given)),
    "messages": ("class", lambda _, given: list(topic().messages(given))),
    "to_columns": ("class", lambda _, given: topic().to_columns(given)),
    "to_arrow": ("class", lambda _, given: topic().to_arrow(given)),
    "path": ("path", lambda _, given: idlc.Recording(given)),
    "include": ("texts", lambda _, given: idlc.Recording("r.mcap", include=given)),
    "include of load": ("texts", lambda _, given: idlc.load("r.mcap", include=given)),
    "rules": ("texts", lambda it, given: idlc.upgrade(it, it, rules=given)),
    "fields": ("texts", lambda _, given: topic().to_columns(fields=given)),
    "fields of messages": ("texts", lambda _, given: list(topic().messages(fields=given))),
    "aligned": ("texts", lambda _, given: recording().aligned(given, every="1s")),
    "distro": ("text", lambda _, given: idlc.Recording("r.mcap", distro=given)),
    "distro of load": ("text", lambda _, given: idlc.load("r.mcap", distro=given)),
    "topic": ("text", lambda _, given: recording()[given]),
    "type of a topic": ("text", lambda _, given: recording().topic("/drive", given)),
    "field": ("text", lambda it, given: idlc.reader(it, given)),
    "changes": ("mapping", lambda it, given: idlc.patch(it, it().serialize(), given)),
    "where": ("text", lambda _, given: list(topic().where(given, "==", 1).messages())),
    "operator": ("text", lambda _, given: list(topic().where("a", given, 1).messages())),
    "by": ("text", lambda _, given: list(topic().between("0", by=given).messages())),
    "kind": ("text", lambda it, given: idlc.to_numpy(it(), given)),
    "message": ("message", lambda it, given: idlc.upgrade(it, it).message(given)),
    "bytes": ("bytes", lambda it, given: idlc.upgrade(it, it).payload(given)),
}
#: Arguments by their kind.
GIVEN = {
    "class": lambda it: it,
    "another class": lambda _: Path,
    "text": lambda _: "a",
    "path": lambda _: Path("a"),
    "texts": lambda _: ["a"],
    "module": lambda _: idlc,
    "number": lambda _: 5,
    "message": lambda it: it(),
}
#: What is accepted in place of another kind.
ACCEPTED = {
    "path": set(),
    "texts": {"texts", "text", "path"},
    "text": {"text"},
    "class": {"class"},
    "message": {"message"},
    "bytes": set(),
    "mapping": set(),
}
#: Words of Python about its own ways, which say nothing about the argument.
PYTHON = ("has no attribute", "not iterable", "unhashable", "unpack", "has no len", "after *")


@pytest.fixture(scope="module")
def kind(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("recording"))
        write_all({"a/msg/A.msg": "int8 a\n"})
        kind = idlc.load("a").A
        write_recording(Path("r.mcap"), kind, [kind()])
        yield kind


def recording():
    return idlc.Recording("r.mcap")


def topic():
    return recording()["/drive"]


@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("call", CALLS)
def test_an_argument_of_another_kind_is_named(call, given, kind):
    wanted, function = CALLS[call]
    value = GIVEN[given](kind)
    if given in ACCEPTED[wanted]:
        with contextlib.suppress(ValueError, LookupError, RecordingError):
            function(kind, value)  # which need not exist
        return
    with pytest.raises((TypeError, ValueError, LookupError, RecordingError)) as caught:
        function(kind, value)
    assert not any(words in str(caught.value) for words in PYTHON), caught.value


def test_one_folder_is_one(tmp_path):
    """The letters of a text are no folders."""
    far, near = tmp_path / "far", tmp_path / "near"
    write_all({f"{far}/b_msgs/msg/B.msg": "int8 b\n", f"{near}/msg/C.msg": "b_msgs/B b\n"})
    for include in (str(far), far, [far]):
        assert idlc.load(str(near), include=include).C().b.b == 0
