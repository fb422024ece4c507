"""A module of classes stands alone until somebody asks for codecs, or for what ROS 2 adds."""

import builtins
import importlib
import pickle
import subprocess
import sys
import typing

import pytest

from idlc.model.names import is_message_name
from tests.support import generated

FILES = {
    "msg/Foo.msg": "int32 a\n",
    "msg/FooCodec.msg": "int32 b\n",
    "msg/FooProtocol.msg": "Foo[] c\n",
    "srv/Foo.srv": "Foo a\n---\nint32 sum\n",
    "srv/FooProtocol.srv": "int32 a\n---\n",
    "action/Foo.action": "int32 a  # How far [m]\n---\nbool done\n---\nfloat32 part\n",
    "action/FooProtocol.action": "---\n---\n",
}
#: Messages called like what generated code takes from Python, and one that holds them all.
BUILTINS = [
    name for name in dir(builtins) if is_message_name(name) and name not in {"None", "True"}
]
TAKEN = {f"msg/{name}.msg": "string text\nint32[] numbers\n" for name in BUILTINS} | {
    "msg/Holder.msg": "".join(f"{name}[] {name.lower()}s\n" for name in BUILTINS)
}


@pytest.fixture(scope="module", autouse=True)
def packages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("modules")
    generated.write_package(folder, "foo_msgs", FILES)
    generated.write_package(folder, "taken_msgs", TAKEN)
    catalog = generated.catalog_files()
    for package in ("builtin_interfaces", "service_msgs", "unique_identifier_msgs"):
        generated.write_package(folder, package, catalog[package])
    with generated.importable(folder):
        yield folder


@pytest.mark.parametrize(
    ("use", "modules"),
    [
        ("msg.Foo(1) == msg.Foo(2)", {"msg._foo"}),
        ("msg.Foo().serialize()", {"msg._foo", "msg._foo__codec"}),
        ("srv.Foo.Request().a.a", {"msg._foo", "srv._foo"}),
        ("action.Foo.Goal(3)", {"action._foo"}),
        (
            "action.Foo.Goal(3).serialize()",
            {"action._foo", "action._foo__codec"},
        ),
        ("action.Foo.Impl.FeedbackMessage", {"action._foo"}),
        ("action.Foo_SendGoal", {"action._foo"}),
        ("srv.Foo_Event", {"msg._foo", "srv._foo"}),
    ],
)
def test_what_is_not_asked_for_is_not_imported(packages, use, modules):
    code = (
        "import sys\n"
        "from foo_msgs import action, msg, srv\n"
        f"{use}\n"
        "print(*(n for n in sys.modules if n.startswith('foo_msgs.') and '._' in n[9:]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=packages, capture_output=True, text=True, check=True
    )
    found = {name.removeprefix("foo_msgs.") for name in done.stdout.split()}
    assert {name for name in found if not name.startswith("_idlc")} == modules


NAMES = ["FeedbackMessage", "SendGoal_Request", "SendGoal_Event", "GetResult_Response"]


@pytest.mark.parametrize("name", NAMES)
def test_what_ros_adds_is_where_rosidl_has_it(name):
    cls = generated.class_of(f"foo_msgs/action/Foo_{name}")
    module = importlib.import_module("foo_msgs.action._foo")
    assert cls.__module__ == module.__name__
    assert getattr(module, f"Foo_{name}") is cls
    assert isinstance(pickle.loads(pickle.dumps(cls())), cls)
    assert list(typing.get_type_hints(cls)) == list(cls.get_fields_and_field_types())
    assert "Added by ROS 2." in cls.__doc__
    assert cls.deserialize(cls().serialize()) == cls()


def test_a_pickle_finds_what_ros_adds_before_anybody_asked(packages):
    message = generated.class_of("foo_msgs/action/Foo_FeedbackMessage")()
    code = "import pickle, sys\nprint(pickle.loads(sys.stdin.buffer.read()).feedback.part)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        input=pickle.dumps(message),
        cwd=packages,
        capture_output=True,
        check=True,
    )
    assert done.stdout == b"0.0\n"


def test_a_service_and_an_action_keep_what_was_asked_for():
    action, service = (
        generated.class_of("foo_msgs/action/Foo"),
        generated.class_of("foo_msgs/srv/Foo"),
    )
    assert action.Impl is action.Impl
    assert service.Event is generated.class_of("foo_msgs/srv/Foo_Event")
    assert "Impl" in dir(action)
    with pytest.raises(AttributeError, match="no attribute 'Foo_Nothing'"):
        importlib.import_module("foo_msgs.action._foo").Foo_Nothing  # noqa: B018


@pytest.mark.parametrize("name", ["msg/Foo", "msg/FooCodec", "msg/FooProtocol", "srv/FooProtocol"])
def test_names_like_those_of_modules_are_free(name):
    cls = generated.class_of(f"foo_msgs/{name}")
    message = getattr(cls, "Event", cls)()
    assert type(message).deserialize(message.serialize()) == message


@pytest.mark.parametrize("name", BUILTINS)
def test_messages_may_be_called_like_what_python_has(name):
    cls, other = (generated.class_of(f"taken_msgs/msg/{one}") for one in (name, "Holder"))
    message = cls(text="a", numbers=[1])
    assert message == cls("a", [1])
    assert message != cls("b", [1])
    assert message != other()
    holder = other(**{f"{name.lower()}s": [message]})
    assert other.deserialize(holder.serialize()) == holder
    for buffer in (message.serialize()[:-1], b"\0\1\0\0\1\0\0\0a"):
        with pytest.raises(ValueError, match="at byte"):
            cls.deserialize(buffer)
    with pytest.raises(ValueError, match="text"):
        cls(text="\ud800").serialize()
