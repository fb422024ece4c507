"""Python's garbage collector: paused while messages are decoded, and never longer."""

import gc
import os
import sys
import threading

import pytest

from idlc.runtime import codec
from tests.support import generated

pytestmark = pytest.mark.usefixtures("standard")


@pytest.fixture
def cls(standard):
    return generated.class_of("geometry_msgs/msg/PoseStamped")


@pytest.fixture
def states(cls, monkeypatch):
    """Record whether the collector is enabled each time that a message is decoded."""
    seen = []
    decode = cls._codec_("<").decode

    def watched(data):
        seen.append(gc.isenabled())
        return decode(data)

    monkeypatch.setattr(cls._codec_("<"), "decode", watched)
    return seen


@pytest.fixture(autouse=True)
def enabled():
    assert gc.isenabled()
    yield
    gc.enable()


def test_it_is_paused_and_resumed_also_after_an_error(cls, states):
    raws = [cls().serialize()] * 3
    assert len(cls.deserialize_many(iter(raws))) == 3
    assert states == [False] * 3
    assert gc.isenabled()
    with pytest.raises(ValueError, match=r"\[1\]"):
        cls.deserialize_many([raws[0], b""])
    assert gc.isenabled()
    with pytest.raises(TypeError):
        cls.deserialize_many([raws[0], None])
    assert gc.isenabled()


def test_it_stays_disabled_where_a_program_disabled_it(cls, states):
    gc.disable()
    cls.deserialize_many([cls().serialize()])
    cls.from_dict({})
    assert states == [False]
    assert not gc.isenabled()


def test_what_a_program_runs_is_not_in_the_pause(cls, states):
    def buffers():
        for _ in range(3):
            states.append(gc.isenabled())
            yield cls().serialize()

    cls.deserialize_many(buffers())
    assert states == [True] * 3 + [False] * 3


def test_a_message_of_many_parts_is_decoded_in_a_pause(cls, monkeypatch):
    path = generated.class_of("nav_msgs/msg/Path")
    pause = sys.modules[path.__base__.__module__.rpartition(".")[0]].codec.PAUSE
    seen = []

    class Watched(list):
        def append(self, value):
            seen.append(value)
            super().append(value)

    monkeypatch.setattr(pause, "threads", Watched())
    for count in (1, 1000):
        seen.clear()
        message = path(poses=[cls() for _ in range(count)])
        assert path.deserialize(message.serialize()) == message
        assert seen == [None] * (count > 1)
        assert gc.isenabled()


def test_the_last_of_many_threads_resumes_it():
    pause = codec.PAUSE
    inside, leave = threading.Barrier(5), [threading.Event() for _ in range(4)]

    def decode(number):
        with pause:
            inside.wait(30)
            leave[number].wait(30)

    threads = [threading.Thread(target=decode, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    inside.wait(30)
    for thread, event in zip(threads, leave, strict=True):
        assert not gc.isenabled()
        event.set()
        thread.join(30)
    assert gc.isenabled()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_process_does_not_wait_for_threads_that_it_does_not_have():
    inside, leave = threading.Event(), threading.Event()

    def decode():
        with codec.PAUSE:
            inside.set()
            leave.wait(30)

    thread = threading.Thread(target=decode)
    thread.start()
    inside.wait(30)
    child = os.fork()
    if not child:
        enabled = gc.isenabled()
        with codec.PAUSE:
            enabled &= not gc.isenabled()
        os._exit(0 if enabled and gc.isenabled() else 1)
    leave.set()
    thread.join(30)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
