"""What ROS 2 adds to services and actions, against messages that somebody wrote out."""

import random
import threading

import numpy as np
import pytest

from tests.support import generated, values
from tests.support.layouts import random_package
from tests.support.rounds import some
from tests.support.waiting import LIMIT, join

SEEDS = range(24)
UUID = "unique_identifier_msgs/UUID goal_id\n"
INFO = "service_msgs/ServiceEventInfo info\n"
#: The text of a message with the same fields, for each message that ROS 2 adds.
ADDED = {
    "srv/Ask_Event": f"{INFO}First[<=1] request\nSecond[<=1] response\n",
    "action/Walk_SendGoal_Request": f"{UUID}First goal\n",
    "action/Walk_SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp\n",
    "action/Walk_SendGoal_Event": (
        f"{INFO}PlainWalkSendGoalRequest[<=1] request\nPlainWalkSendGoalResponse[<=1] response\n"
    ),
    "action/Walk_GetResult_Request": UUID,
    "action/Walk_GetResult_Response": "int8 status\nSecond result\n",
    "action/Walk_GetResult_Event": (
        f"{INFO}PlainWalkGetResultRequest[<=1] request\nPlainWalkGetResultResponse[<=1] response\n"
    ),
    "action/Walk_FeedbackMessage": f"{UUID}Third feedback\n",
}
PARTS = ("First", "Second", "Third")
PACKAGES = ("builtin_interfaces", "service_msgs", "unique_identifier_msgs")


def plain_name(name):
    """Return the message with the fields of a message that ROS 2 adds."""
    return "Plain" + name.partition("/")[2].replace("_", "")


def files_of(rng):
    """Return a package: random messages, and a service and an action with the same fields."""
    files, _ = random_package(rng)
    texts = rng.choices(sorted(files.values()), k=3)
    files |= {f"msg/{part}.msg": text for part, text in zip(PARTS, texts, strict=True)}
    files |= {f"msg/{plain_name(name)}.msg": text for name, text in ADDED.items()}
    files["srv/Ask.srv"] = "---\n".join(texts[:2])
    files["action/Walk.action"] = "---\n".join(texts)
    return files


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("protocol")
    catalog = generated.catalog_files()
    for package in PACKAGES:
        generated.write_package(folder, package, catalog[package])
    with generated.importable(folder):
        yield folder


def pairs(rng, seed, folder):
    """Yield random messages that ROS 2 adds, and the class of the same fields."""
    if not (folder / f"added{seed}_msgs").exists():
        generated.write_package(folder, f"added{seed}_msgs", files_of(random.Random(seed)))
    for name in ADDED:
        kind = generated.class_of(f"added{seed}_msgs/{name}")
        plain = generated.class_of(f"added{seed}_msgs/msg/{plain_name(name)}")
        for _ in range(4):
            yield values.randomized(kind(), rng, longest=rng.choice([1, 4, 40])), plain


@pytest.mark.parametrize("seed", some(SEEDS))
def test_its_bytes_are_those_of_the_same_fields(folder, seed):
    for message, plain in pairs(random.Random(seed), seed, folder):
        kind = type(message)
        content = message.to_dict()
        for order in ("little", "big"):
            raw = message.serialize(byteorder=order)
            assert raw == plain.from_dict(content).serialize(byteorder=order)
            for buffer in (raw, bytearray(raw), memoryview(raw + bytes(3))):
                assert kind.deserialize(buffer) == message
                viewed = kind.deserialize(buffer, copy=False)
                assert viewed == message
                assert viewed.serialize(byteorder=order) == raw
            assert plain.deserialize(raw).to_dict() == content


def error_of(function, *arguments):
    """Return the exception that a call ends with, as text; "" if it returns."""
    try:
        function(*arguments)
    except ValueError as error:
        return f"{type(error).__name__}: {error}"
    return ""


@pytest.mark.parametrize("seed", some(SEEDS))
def test_a_shorter_buffer_is_refused_in_the_same_words(folder, seed):
    rng = random.Random(seed)
    for message, plain in pairs(rng, seed, folder):
        raw = message.serialize(byteorder=rng.choice(["little", "big"]))
        for size in {*range(4), *(rng.randrange(len(raw)) for _ in range(20))}:
            refused = error_of(type(message).deserialize, raw[:size])
            assert "at byte" in refused
            plain_name = type(plain()).__name__
            name = type(message).__name__
            assert refused == error_of(plain.deserialize, raw[:size]).replace(plain_name, name)


BIG = {
    "srv/See.srv": "float64[] asked\n---\nuint8[] seen\nstring[] words\n",
    "action/Scan.action": "uint8[] area\n---\nint16 a\nfloat64[] ranges\n---\nuint8[] seen\n",
}


@pytest.fixture(scope="module")
def big(folder, tmp_path_factory):
    own = tmp_path_factory.mktemp("big")
    generated.write_package(own, "big_msgs", BIG)
    with generated.importable(own):
        yield generated.class_of("big_msgs/srv/See"), generated.class_of("big_msgs/action/Scan")


def test_large_sequences_are_views_of_the_buffer(big):
    see, scan = big
    impl = scan.Impl
    response = see.Response(seen=bytes(100_000))
    events = see.Event(response=[response])
    for message, path in (
        (impl.SendGoalService.Request(goal=scan.Goal(area=bytes(100_000))), "goal.area"),
        (impl.GetResultService.Response(result=scan.Result(ranges=range(9999))), "result.ranges"),
        (impl.FeedbackMessage(feedback=scan.Feedback(seen=bytes(100_000))), "feedback.seen"),
        (events, "response"),
    ):
        raw = message.serialize()
        for buffer in (raw, memoryview(raw), bytearray(raw)):
            found = type(message).deserialize(buffer, copy=False)
            for part in path.split("."):
                found = getattr(found, part)
            found = found[0].seen if message is events else found
            assert np.shares_memory(found, np.frombuffer(buffer, "uint8"))
            assert not found.flags.writeable


def test_a_wrong_value_is_named_by_its_path(big):
    see, scan = big
    impl = scan.Impl
    request, response = see.Request(), see.Response(words=["a", None])
    for message, words in (
        (see.Event(response=[response]), r"^response\[0\]\.words\[1\]: must be a str"),
        (see.Event(request=[request, request]), r"^request: has 2 elements, at most 1"),
        (impl.GetResultService.Response(status=3, result=scan.Result(a=1 << 15)), r"^result\.a: "),
        (impl.SendGoalService.Response(stamp=None, accepted=True), ""),
    ):
        for order in ("little", "big"):
            if not words:
                assert type(message).deserialize(message.serialize(byteorder=order)) == message
                continue
            with pytest.raises(ValueError, match=words):
                message.serialize(byteorder=order)
    message = impl.SendGoalService.Response()
    message.accepted = 2
    with pytest.raises(ValueError, match=r"^accepted: must be a bool"):
        message.serialize()


def test_a_constructor_takes_what_generated_ones_take(big):
    see, scan = big
    response = scan.Impl.SendGoalService.Response
    assert response(True).accepted is True
    assert response(1).accepted == 1
    for arguments in ({"accepted": "yes"}, {"accepted": None}, {"unknown": 1}):
        with pytest.raises(TypeError):
            response(**arguments)
    for arguments in ({"goal_id": 1}, {"goal_id": "a"}):
        with pytest.raises(TypeError):
            scan.Impl.FeedbackMessage(**arguments)
    with pytest.raises(TypeError):
        see.Event(None, [], [], [])
    checked = see.Event(check_fields=True)
    with pytest.raises(AssertionError):
        checked.request = [1]
    assert response(accepted=True) != response()
    assert response() != see.Event()


def test_threads_that_ask_at_the_same_time_get_the_same_classes(tmp_path):
    generated.write_package(
        tmp_path, "race_msgs", {f"action/A{n}.action": "---\n---\n" for n in range(20)}
    )
    with generated.importable(tmp_path):
        for number in range(20):
            action = generated.class_of(f"race_msgs/action/A{number}")
            kinds = []
            start = threading.Barrier(4)

            def ask(action=action, kinds=kinds, start=start):
                start.wait(LIMIT)
                kinds.append(action.Impl.FeedbackMessage)

            threads = [threading.Thread(target=ask) for _ in range(4)]
            for thread in threads:
                thread.start()
            join(*threads)
            assert len(kinds) == 4
            assert set(kinds) == {action.Impl.FeedbackMessage}
