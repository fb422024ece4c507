"""What a generated class offers to who uses it."""

import copy
import dataclasses
import json
import math
import pickle
import re
import sys
from array import array

import numpy as np
import pytest

from tests.support import generated

FILES = {
    "msg/Point.msg": "float64 x\nfloat64 y 1.5\n",
    "msg/Robot.msg": (
        "# A robot.\n\nstring<=5 name\nuint8 mode 1  # [m]\nfloat32 speed\nPoint goal\n"
        "Point[] path\nPoint[2] pair\nfloat64[3] pose\nint32[<=4] ids\nuint8[] image\n"
        "string[] tags\nbool[2] flags\nbyte octet\nbyte[] octets\nwstring wide\n"
        "int16[] some [1, 2]\nuint8 IDLE=0\nstring HELLO=hi\n"
    ),
    "msg/Empty.msg": "",
    "msg/Odd.msg": (
        "int32 class\nint32 serialize 3\nint32 self\nint32 fields_and_field_types\n"
        "int32 check_fields\nint32 int 4\nstring list\nint32 type\nint32 id\nint32 print\n"
        "int32 match\nint32 property\nbyte bytes\nint32 range\nint32 len\nint32[] str\n"
        "int32 codec\nint32 message\nint32 data\nint32 at\nint32 encode\nstring text\n"
        "string put\nint32[] view\nPoint[] item\nPoint array\nint32 idlc\nint32 locals\n"
        "int32 object\nint32 options\nint32 isinstance\n"
    ),
    "msg/Any.msg": "Point point\n",
    "msg/Text.msg": "Any any\nMessage[] messages\n",
    "msg/Message.msg": "float64[2] numbers\nstring text\n",
    "msg/Many.msg": (
        "float64[100] numbers\nbool[100] flags\nfloat64[] readings\nfloat32[] ranges\n"
        "int64[] ticks\n"
    ),
    "srv/Go.srv": "int32 a\n---\nPoint b\n",
    "action/Walk.action": "int32 steps\n---\nint32 done\n---\nPoint now\n",
}


@pytest.fixture(scope="module", autouse=True)
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("messages")
    generated.write_package(folder, "robot_msgs", FILES)
    with generated.importable(folder):
        yield folder


def get(name):
    return generated.class_of(f"robot_msgs/{name}")


def errors():
    return sys.modules["robot_msgs._idlc"]


def robot(**fields):
    return get("msg/Robot")(**fields)


def test_it_is_a_dataclass():
    cls = get("msg/Robot")
    assert dataclasses.is_dataclass(cls)
    assert dataclasses.is_dataclass(cls())
    fields = {field.name: field for field in dataclasses.fields(cls)}
    assert list(fields) == list(cls.__match_args__) == list(cls.get_fields_and_field_types())
    assert fields["mode"].default == 1
    assert fields["mode"].type is int
    assert fields["path"].default_factory() == []
    assert fields["some"].default_factory() == array("h", [1, 2])
    message = cls("me", goal=get("msg/Point")(2.0))
    other = dataclasses.replace(message, name="you", ids=[1])
    assert (other.name, other.ids, other.goal.x) == ("you", array("i", [1]), 2.0)
    assert message.name == "me"
    if sys.version_info >= (3, 13):
        assert copy.replace(message, name="you").name == "you"
    assert dataclasses.asdict(message)["goal"] == {"x": 2.0, "y": 1.5}
    match message:
        case cls("me", mode, goal=goal):
            assert (mode, goal.x) == (1, 2.0)
        case _:
            pytest.fail("did not match")


def test_it_is_made_by_position_or_keyword():
    point = get("msg/Point")
    assert point(1.0, 2.0) == point(x=1.0, y=2.0)
    assert point() == point(0.0, 1.5)
    with pytest.raises(TypeError, match="unexpected keyword argument 'z'"):
        point(z=1.0)
    assert repr(get("msg/Empty")()) == "robot_msgs.msg.Empty()"
    assert get("msg/Empty").deserialize(get("msg/Empty")().serialize()) == get("msg/Empty")()


def test_defaults_are_not_shared():
    one, two = robot(), robot()
    one.path.append(1)
    one.some.append(3)
    one.pose[0] = 4
    assert (two.path, list(two.some), two.pose[0]) == ([], [1, 2], 0)
    assert array("h", [1, 2]) == get("msg/Robot").SOME__DEFAULT


def test_constants_cannot_be_changed():
    cls = get("msg/Robot")
    assert (cls.IDLE, robot().HELLO) == (0, "hi")
    for target in (cls, robot()):
        for name in ("IDLE", "MODE__DEFAULT"):
            with pytest.raises(AttributeError):
                setattr(target, name, 3)
    with pytest.raises(AttributeError):
        robot().unknown = 1


@pytest.mark.parametrize(
    "value",
    [
        [1, 2, 3],
        (1, 2, 3),
        range(1, 4),
        array("i", [1, 2, 3]),
        array("b", [1, 2, 3]),
        np.array([1, 2, 3]),
        np.array([1, 2, 3], np.int32),
        np.array([3, 2, 1], np.int32)[::-1],
        np.array([1, 2, 3], ">i4"),
        memoryview(array("i", [1, 2, 3])),
        iter([1, 2, 3]),
    ],
    ids=lambda value: type(value).__name__,
)
def test_anything_like_a_sequence_becomes_an_array(value):
    message = robot()
    message.ids = value
    assert message.ids == array("i", [1, 2, 3])
    assert message.ids.typecode == "i"
    assert get("msg/Robot").deserialize(message.serialize()).ids == message.ids


def test_arrays_are_copied_and_converted():
    ids, pose = array("i", [1]), np.zeros(3)
    message = robot(ids=ids, pose=pose)
    ids[0] = pose[0] = 5
    assert message.ids == array("i", [1])
    assert message.pose.tolist() == [0, 0, 0]
    message.pose = [1, 2, 3]
    assert message.pose.dtype == np.float64
    assert message.pose.tolist() == [1, 2, 3]
    message.image = b"abc"
    assert message.image == array("B", b"abc")
    message.ids = array("i", [1, 2]).tobytes()
    assert message.ids == array("i", [1, 2])


@pytest.mark.parametrize(
    ("field", "value", "kind", "words"),
    [
        ("pose", [1, 2], ValueError, "pose: has 2 elements, needs 3"),
        ("pose", np.zeros((3, 3)), ValueError, "pose: needs an array of 3 elements, not of shape"),
        ("pose", [1, 2, "a"], ValueError, "pose[2]: must be a number (float64), not 'a'"),
        ("pose", "abc", TypeError, "pose: "),
        ("ids", [1, 2**40], OverflowError, "ids[1]: must be an integer from -2147483648"),
        ("ids", ["a"], TypeError, "ids[0]: must be an integer"),
        ("ids", 5, TypeError, "ids: must be a sequence, not 5"),
        ("ids", {"a": 1}, TypeError, "ids: "),
        ("ids", b"abc", ValueError, "ids: has 3 bytes, needs a multiple of 4"),
        ("ids", np.array([1.5]), TypeError, "ids[0]: must be an integer"),
        ("ids", iter(["a"]), TypeError, "ids: "),
    ],
)
def test_a_wrong_array_is_named_when_it_is_assigned(field, value, kind, words):
    message = robot()
    with pytest.raises(kind, match=re.escape(words)) as caught:
        setattr(message, field, value)
    assert isinstance(caught.value, sys.modules["robot_msgs._idlc"].ValidationError)
    assert pickle.loads(pickle.dumps(caught.value)).path == caught.value.path


def test_equality_looks_at_every_element():
    assert robot(pose=[1, 2, 3]) == robot(pose=[1, 2, 3])
    assert robot(pose=[1, 2, 3]) != robot(pose=[1, 2, 4])
    assert robot(ids=[1, 2]) != robot(ids=[1, 3])
    assert robot(ids=[1]) != robot(ids=[1, 0])
    assert robot(image=b"ab") == robot(image=b"ab")
    assert robot(flags=[True, False]) != robot(flags=[True, True])
    assert robot() != get("msg/Point")()
    assert robot() != 3
    assert robot(speed=math.nan) != robot(speed=math.nan)
    assert robot(goal=get("msg/Point")(3.0)) != robot()
    with pytest.raises(TypeError, match="unhashable"):
        hash(robot())


@pytest.mark.parametrize("size", [1, 64, 65, 1 << 16, (1 << 16) + 1, 200_000])
@pytest.mark.parametrize("at", [0, -1])
@pytest.mark.parametrize(("kind", "field"), [("Robot", "image"), ("Many", "ticks")])
def test_equality_of_arrays_of_every_size(kind, field, size, at):
    kind = get(f"msg/{kind}")
    data = [0] * size
    mine, other = kind(**{field: data}), kind(**{field: data})
    assert mine == other
    data[at] = 1
    assert mine != kind(**{field: data})
    assert mine != kind(**{field: data[:-1]})
    assert kind(**{field: data}) == kind(**{field: data})


def test_equality_of_long_arrays():
    data = bytearray(300_000)
    mine = robot(image=data)
    assert mine == robot(image=data)
    for at in (0, 65535, 65536, 299_999):
        data[at] = 255
        assert mine != robot(image=data)
        data[at] = 0
    assert mine == robot(image=data)
    mine.image.append(1)  # nothing holds it


@pytest.mark.parametrize(
    ("kind", "field", "size"),
    [
        *(("Robot", "pose", 3), ("Many", "numbers", 100)),
        *(("Many", field, size) for field in ("readings", "ranges") for size in (1, 64, 5000)),
    ],
)
def test_equality_of_floats_in_arrays_is_that_of_floats(kind, field, size):
    kind = get(f"msg/{kind}")
    zeros = [0.0] * size
    assert kind(**{field: zeros}) == kind(**{field: [-0.0, *zeros[1:]]})
    assert kind(**{field: zeros}) != kind(**{field: [*zeros[1:], 1e-30]})
    assert kind(**{field: [*zeros[1:], math.nan]}) != kind(**{field: [*zeros[1:], math.nan]})
    every_second = np.zeros(2 * size)[::2]
    assert kind(**{field: every_second}) == kind(**{field: zeros})


def test_equality_of_arrays_of_other_numbers_is_that_of_the_numbers():
    kind = get("msg/Many")
    mine, other = kind(), kind()
    mine.readings, other.readings = array("d", [0.5, 2]), array("f", [0.5, 2])
    assert mine == other
    other.readings = array("f", [0.5, 3])
    assert mine != other
    mine.readings, other.readings = np.array([1.5, 2]), np.array([1.5, 2], dtype=np.float32)
    assert mine == other
    other.readings = array("d", [1.5, 2])
    assert mine == other
    other.readings = array("d", [1.5])
    assert mine != other


def test_copies_and_pickles_are_equal():
    message = robot(name="n", ids=[1], pose=[1, 2, 3], path=[get("msg/Point")(1.0)])
    for other in (
        copy.copy(message),
        copy.deepcopy(message),
        *(pickle.loads(pickle.dumps(message, n)) for n in range(2, 6)),
    ):
        assert other == message
        assert other is not message
    assert copy.copy(message).path is message.path
    assert copy.deepcopy(message).path is not message.path


def test_old_pickles_of_messages_that_check_their_fields_are_read():
    """Recorded before the runtime's modules were merged: they name `checked` and its function."""
    recorded = (
        b"\x80\x02crobot_msgs._idlc.checked\n_restored\nq\x00crobot_msgs.msg._point\nPoint\nq\x01"
        b"}q\x02(X\x02\x00\x00\x00_xq\x03G@\x00\x00\x00\x00\x00\x00\x00"
        b"X\x02\x00\x00\x00_yq\x04G?\xf8\x00\x00\x00\x00\x00\x00u\x86q\x05Rq\x06."
    )
    message = pickle.loads(recorded)
    assert message == get("msg/Point")(2.0, 1.5)
    with pytest.raises(AssertionError, match="x: "):
        message.x = "text"
    assert pickle.dumps(get("msg/Point")(2.0, check_fields=True), 2) == recorded


def test_repr_is_rosidls():
    assert repr(robot(ids=[1, 2], octet=b"a")).startswith(
        "robot_msgs.msg.Robot(name='', mode=1, speed=0.0, goal=robot_msgs.msg.Point(x=0.0, y=1.5)"
    )
    assert "pose=array([0., 0., 0.]), ids=[1, 2], image=[]" in repr(robot(ids=[1, 2]))


def test_names_that_python_needs_get_an_underscore_and_stay_on_the_wire():
    cls = get("msg/Odd")
    message = cls(class_=1, self=2, list="x", bytes=b"y", item=[get("msg/Point")(3.0)])
    assert (message.class_, message.serialize, message.self, message.int) == (1, 3, 2, 4)
    assert message.to_dict()["class"] == 1
    assert "class" in cls.get_fields_and_field_types()
    message.fields_and_field_types = 7
    assert cls.from_dict(json.loads(json.dumps(message.to_dict()))) == message
    assert cls.deserialize(super(cls, message).serialize()) == message
    assert message.to_dict()["fields_and_field_types"] == 7
    assert dataclasses.replace(message, class_=9).class_ == 9
    assert "class=1" in repr(message)


def test_classes_may_have_the_names_of_what_generated_code_uses():
    text = get("msg/Text")(messages=[get("msg/Message")([1, 2], "t")])
    assert get("msg/Text").deserialize(text.serialize(byteorder="big")) == text
    text.validate()


def test_a_subclass_stays_one():
    class Mine(get("msg/Point")):
        def length(self):
            return self.x

    message = Mine(2.0)
    found = Mine.deserialize(message.serialize())
    assert type(found) is Mine
    assert found == message
    assert found.length() == 2.0
    assert type(get("msg/Point").deserialize(message.serialize())) is get("msg/Point")


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"mode": 256}, "mode: must be an integer from 0 to 255 (uint8), not 256"),
        ({"mode": 1.5}, "mode: must be an integer from 0 to 255 (uint8), not 1.5"),
        ({"mode": "a"}, "mode: must be an integer from 0 to 255 (uint8), not 'a'"),
        ({"mode": None}, "mode: must be an integer from 0 to 255 (uint8), not None"),
        ({"speed": "a"}, "speed: must be a number (float32), not 'a'"),
        ({"speed": 1e39}, "speed: must be a number from -3.4028234663852886e+38 to 3.4028234663"),
        ({"name": 5}, "name: must be a str, not 5"),
        ({"name": "\ud800"}, "name: must be a str without lone surrogates"),
        ({"wide": "\ud800"}, "wide: must be a str without lone surrogates"),
        ({"goal": 5}, "goal: must be a robot_msgs/msg/Point, not 5"),
        ({"path": [5]}, "path[0]: must be a robot_msgs/msg/Point, not 5"),
        ({"path": 5}, "path: must be a sequence, not 5"),
        ({"pair": []}, "pair: has 0 elements, needs 2"),
        ({"ids": [1] * 5}, "ids: has 5 elements, at most 4 are allowed"),
        ({"tags": ["a", 5]}, "tags[1]: must be a str, not 5"),
        ({"flags": [True]}, "flags: has 1 element, needs 2"),
        ({"octet": b"ab"}, "octet: must be bytes of length 1, not b'ab'"),
        ({"octets": [b"a", b""]}, "octets[1]: must be bytes of length 1, not b''"),
    ],
    ids=str,
)
def test_a_wrong_value_is_named_when_written_and_when_validated(fields, words):
    message = robot()
    for name, value in fields.items():
        setattr(message, name, value)
    for action in (message.validate, message.serialize):
        with pytest.raises(ValueError, match=re.escape(words)) as caught:
            action()
        assert type(caught.value).__name__ == "ValidationError"


def test_fields_may_have_the_names_that_a_constructor_uses():
    kind = get("msg/Odd")
    with pytest.raises(TypeError, match="unexpected keyword argument 'z'"):
        kind(z=1)
    assert kind(locals=1, object=2, options=3) == kind(locals=1, object=2, options=3)
    assert kind(locals=1) != kind()


def test_the_first_field_is_checked_at_once():
    """ROS's tools fill in a nested message after `type(field)({...})` raised TypeError."""
    for kind, value in (("Robot", {"name": "a"}), ("Point", {"x": 1.0}), ("Point", None)):
        with pytest.raises(TypeError, match="must be"):
            get(f"msg/{kind}")(value)
    assert get("msg/Point")(np.float32(1.5)).x == 1.5
    assert get("msg/Point")(1).x == 1


def test_the_path_of_a_wrong_value_leads_to_it():
    message = robot(path=[get("msg/Point")(), get("msg/Point")()])
    message.path[1].x = "a"
    with pytest.raises(ValueError, match=r"path\[1\]\.x: must be a number") as caught:
        message.serialize()
    assert (caught.value.path, caught.value.value) == ("path[1].x", "a")


def test_the_bound_of_a_string_is_only_validated():
    message = robot(name="too long")
    assert get("msg/Robot").deserialize(message.serialize()).name == "too long"
    with pytest.raises(ValueError, match="name: has 8 characters, at most 5 are allowed"):
        message.validate()


def test_a_wrong_byte_order_is_refused():
    with pytest.raises(ValueError, match="byteorder must be 'little' or 'big'"):
        robot().serialize(byteorder="middle")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"nmae": "a"}, "nmae: robot_msgs/msg/Robot has no such field; did you mean 'name'?"),
        ({"goal": {"q": 1}}, "goal.q: robot_msgs/msg/Point has no such field"),
        ({"goal": 5}, "goal: must be a dictionary of robot_msgs/msg/Point, not 5"),
        ({"path": [{"x": "a"}]}, "path[0].x: must be a number"),
        ({"path": {"x": 1}}, "path: must be a list"),
        ({"ids": [1, 2, 3, 4, 5]}, "ids: has 5 elements, at most 4"),
        ({"ids": "abc"}, "ids: "),
        ({"ids": [2**31]}, "ids[0]: must be an integer"),
        ({"pose": [1]}, "pose: has 1 element, needs "),
        ({"octet": 256}, "octet: must be an integer from 0 to 255"),
        ({"mode": -1}, "mode: must be an integer from 0"),
        ({"name": "too long"}, "name: has 8 characters, at most 5"),
        ([], "values: must be a dictionary"),
    ],
    ids=str,
)
def test_from_dict_refuses_what_does_not_fit(values, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        get("msg/Robot").from_dict(values)


def test_from_dict_fills_in_defaults():
    found = get("msg/Robot").from_dict({"name": "a", "octets": [1, 2], "path": [{"y": 3}]})
    assert found.octets == [b"\1", b"\2"]
    assert (found.path[0].x, found.path[0].y, found.mode) == (0.0, 3, 1)
    assert json.loads(json.dumps(found.to_dict()))["octets"] == [1, 2]


def test_services_and_actions_are_names_for_their_messages():
    service, action = get("srv/Go"), get("action/Walk")
    for group, uses in (
        (service, "use Go.Request(...) or Go.Response(...)"),
        (action, "use Walk.Goal(...) or Walk.Result(...) or Walk.Feedback(...)"),
    ):
        with pytest.raises(NotImplementedError, match=re.escape(uses)):
            group()
    assert service.Request is get("srv/Go_Request")
    assert service.Response is get("srv/Go_Response")
    assert service.Request(a=1).a == 1
    assert action.Goal(steps=2).steps == 2
    assert action.Result.__name__ == "Walk_Result"
    assert action.Feedback.__module__ == "robot_msgs.action._walk"
    assert action.Impl.SendGoalService.Request.__name__ == "Walk_SendGoal_Request"
    assert action.Impl.GetResultService.Response(status=3).result == action.Result()
    assert type(service) is not type(action)
    assert type(type(service)) is type


@pytest.fixture
def without_ros(monkeypatch):
    for package in ("action_msgs", "service_msgs", "std_msgs", "unique_identifier_msgs"):
        for module in (package, f"{package}.msg", f"{package}.srv"):
            monkeypatch.setitem(sys.modules, module, None)


@pytest.mark.usefixtures("without_ros")
def test_what_needs_ros_fails_only_when_used():
    service, action = get("srv/Go"), get("action/Walk")
    words = r"pip install ros-jazzy-.*--vendor-deps"
    for use in (service.Event, action.Impl.SendGoalService.Request):
        with pytest.raises(ImportError, match=words) as caught:
            use()
        assert caught.value.name
    for name in ("CancelGoalService", "GoalStatusMessage"):
        with pytest.raises(AttributeError, match=words):
            getattr(action.Impl, name)


@pytest.mark.usefixtures("without_ros")
def test_a_missing_dependency_is_explained(tmp_path):
    files = {"msg/Stamped.msg": "std_msgs/Header header\n"}
    generated.write_package(tmp_path, "lonely_msgs", files)
    with generated.importable(tmp_path), pytest.raises(ImportError) as caught:
        generated.class_of("lonely_msgs/msg/Stamped")
    assert "pip install ros-jazzy-std-msgs" in str(caught.value)
    assert "--vendor-deps" in str(caught.value)


def test_packages_import_lazily_and_list_what_they_have():
    for name in [name for name in sys.modules if name.startswith("robot_msgs.")]:
        if "_idlc" not in name:
            del sys.modules[name]
    import robot_msgs.msg

    assert "robot_msgs.msg._robot" not in sys.modules
    assert {"Robot", "Point", "Odd"} <= set(dir(robot_msgs.msg))
    assert robot_msgs.msg.Robot().mode == 1
    with pytest.raises(AttributeError, match="no attribute 'Nothing'"):
        robot_msgs.msg.Nothing  # noqa: B018
    assert set(robot_msgs.msg.__all__) == {
        "Any", "Empty", "Many", "Message", "Odd", "Point", "Robot", "Text",
    }  # fmt: skip


def test_parts_are_buffers_that_are_not_copied():
    message = robot(image=bytes(100_000))
    parts = message._codec_("<").encode(message, list)
    assert any(part is message.image for part in parts)
    assert parts[0][:4] == b"\0\1\0\0"
    assert b"".join(parts) == message.serialize()
