"""Messages in the hands of Python's own tools, and of those that everybody uses."""

import copy
import dataclasses
import functools
import importlib
import inspect
import io
import itertools
import json
import pickle
import pprint
import pydoc
import re
import subprocess
import sys
import typing
import unittest.mock
import weakref
from array import array

import msgspec
import numpy as np
import pytest
import rich.console
import rich.pretty

from idlc.cli import pytest_plugin
from idlc.model import python_names
from tests.support import generated

FILES = {
    "msg/Plain.msg": "int8 small\nfloat64 x 0.5\nstring text\nbool class\n",
    "msg/Empty.msg": "",
    "msg/Arrays.msg": "float64[9] matrix\nint16[2] two [1, 2]\nfloat32[] values\nuint8[] data\n"
    "string[] names\nbyte[] octets\nPlain[] parts\nPlain[2] pair\n",
    "msg/Nested.msg": "std_msgs/Header header\nArrays arrays\nPlain plain\n",
    "msg/Other.msg": "int32 value\n",
    "srv/Ask.srv": "string what\n---\nfloat64 answer\n",
    "action/Walk.action": "float64 to\n---\nfloat64 at\n---\nfloat64 left\n",
}
NAMES = [
    "citizen_msgs/msg/Plain",
    "citizen_msgs/msg/Empty",
    "citizen_msgs/msg/Arrays",
    "citizen_msgs/msg/Nested",
    "citizen_msgs/srv/Ask_Event",
    "citizen_msgs/action/Walk_SendGoal_Request",
    "std_msgs/msg/Header",
    "sensor_msgs/msg/CameraInfo",
]


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("citizens")
    generated.write_package(folder, "citizen_msgs", FILES)
    for package, files in generated.catalog_files().items():
        generated.write_package(folder, package, files)
    (folder / "users.py").write_text(
        "import dataclasses\n"
        "from citizen_msgs.msg import Arrays, Plain\n"
        "@dataclasses.dataclass\n"
        "class Decorated(Plain):\n"
        "    extra: int = 1\n"
        "@dataclasses.dataclass(slots=True)\n"
        "class Slotted(Plain):\n"
        "    extra: int = 1\n"
        "@dataclasses.dataclass\n"
        "class DecoratedArrays(Arrays):\n"
        "    extra: list = dataclasses.field(default_factory=list)\n"
        "class Subclass(Arrays):\n"
        "    def double(self):\n"
        "        return 2 * self.two\n"
        "Made = dataclasses.make_dataclass('Made', [('extra', int, 1)], bases=(Plain,))\n"
        "Made.__module__ = __name__\n"
    )
    with generated.importable(folder):
        yield folder
    sys.modules.pop("users", None)  # its classes are of these packages


USERS = ["Decorated", "Slotted", "DecoratedArrays", "Subclass", "Made"]


@pytest.fixture(params=[*NAMES, *USERS])
def kind(request):
    if "/" in request.param:
        return generated.class_of(request.param)
    import users

    return getattr(users, request.param)


def get(name):
    return generated.class_of(f"citizen_msgs/{name}")


def bases(kind):
    return [base for base in kind.__mro__ if base is not object]


def test_help_and_inspect_take_all_attributes(kind):
    for one in (kind, kind(), *bases(kind), type(kind)):
        assert kind.__name__ in pydoc.plain(pydoc.render_doc(kind))
        assert pydoc.plain(pydoc.render_doc(one))
        assert dict(inspect.getmembers(one))
        if isinstance(one, type):
            assert inspect.classify_class_attrs(one)
    parameters = [name for name in inspect.signature(kind).parameters if name != "options"]
    assert parameters == [field.name for field in dataclasses.fields(kind)]
    made = kind.__mro__[-3]
    assert inspect.getsource(made.__init__).lstrip().startswith("def __init__")
    if made.__init__.__module__ == made.__module__:  # what ROS 2 adds is in a module of its own
        assert inspect.getsource(made).lstrip().startswith(("@", "class "))


def test_help_of_modules_lists_what_they_offer():
    import citizen_msgs.msg
    import citizen_msgs.srv

    assert "class Plain" in pydoc.plain(pydoc.render_doc(citizen_msgs.msg))
    assert "class Ask" in pydoc.plain(pydoc.render_doc(citizen_msgs.srv))
    public = [name for name in dir(citizen_msgs.srv) if name[0] != "_"]
    assert public == ["Ask", "Ask_Event", "Ask_Request", "Ask_Response"]


def test_the_metaclass_is_where_it_says_it_is(kind):
    for cls in (kind, get("srv/Ask"), get("action/Walk")):
        metaclass = type(cls)
        assert getattr(sys.modules[metaclass.__module__], metaclass.__name__) is metaclass
        assert pickle.loads(pickle.dumps(metaclass)) is metaclass


def test_mocks_know_what_a_message_has(kind):
    for mock in (
        unittest.mock.Mock(spec=kind),
        unittest.mock.Mock(spec=kind()),
        unittest.mock.create_autospec(kind)(),
        unittest.mock.create_autospec(kind, instance=True),
    ):
        assert isinstance(mock, kind)
        for name in kind.get_fields_and_field_types():
            getattr(mock, "class_" if name == "class" else name)
        with pytest.raises(AttributeError):
            mock.nothing_of_the_kind  # noqa: B018


def test_all_of_dataclasses_works(kind):
    message = kind()
    assert dataclasses.is_dataclass(kind)
    assert dataclasses.is_dataclass(message)
    fields = dataclasses.fields(message)
    assert fields == dataclasses.fields(kind)
    names = [field.name for field in fields]
    assert list(kind.__match_args__) == names
    assert list(dataclasses.asdict(message)) == names
    assert len(dataclasses.astuple(message)) == len(names)
    assert dataclasses.replace(message) == message
    assert kind.__dataclass_params__.init
    assert kind.__dataclass_params__.eq
    assert not kind.__dataclass_params__.frozen
    assert set(kind.__dataclass_fields__) == set(names)
    values = {field.name: getattr(message, field.name) for field in fields}
    assert kind(**values) == message
    for field in fields:
        fresh = field.default_factory is not dataclasses.MISSING
        default = field.default_factory() if fresh else field.default
        assert np.array_equal(default, getattr(message, field.name))
    if sys.version_info >= (3, 13):
        assert copy.replace(message) == message


def test_the_base_is_a_dataclass_without_fields():
    base = get("msg/Plain").__mro__[1]
    assert base.__name__ == "Message"
    assert dataclasses.fields(base) == ()
    assert base.__dataclass_params__
    assert base.SLOT_TYPES == ()
    with pytest.raises(TypeError, match="Message is not a generated message class"):
        base.deserialize(b"")


def test_equality_is_true_or_false(kind):
    assert (kind() == kind()) is True
    assert (kind() != kind()) is False
    for field in dataclasses.fields(kind):
        if type(field.default) in (int, float) and kind.__module__ != "users":
            mine, same, other = kind(), kind(), kind()
            for message, value in ((mine, 7), (same, 7), (other, 8)):
                setattr(message, field.name, np.float64(value))
            assert (mine == other) is False
            assert (mine == same) is True
            assert (mine == kind()) is False
    assert kind() != get("msg/Other")()


def test_a_dataclass_of_a_users_keeps_what_a_message_does():
    import users

    for cls in (users.Decorated, users.Slotted, users.Made):
        message = cls(1, 2.0, "t", True, extra=5)
        assert message.serialize() == get("msg/Plain")(1, 2.0, "t", True).serialize()
        again = cls.deserialize(message.serialize())
        assert type(again) is cls
        assert (again.small, again.x, again.text, again.class_) == (1, 2.0, "t", True)
        assert message != cls(1, 2.0, "t", True, extra=6)
        message.text = "other"
        assert get("msg/Plain").deserialize(message.serialize()).text == "other"
        assert repr(message).startswith(f"{cls.__name__}(small=1, ")
    assert not hasattr(users.Slotted(), "__dict__")
    arrays = users.DecoratedArrays(extra=[1])
    assert arrays == users.DecoratedArrays(extra=[1])
    assert arrays != users.DecoratedArrays(extra=[2])
    assert arrays != users.DecoratedArrays(two=[3, 4], extra=[1])
    assert users.Subclass(two=[3, 4]) != users.Subclass()
    with pytest.raises(TypeError, match="frozen"):
        dataclasses.dataclass(frozen=True)(type("Frozen", (get("msg/Plain"),), {}))
    ordered = dataclasses.dataclass(order=True)(type("Ordered", (get("msg/Other"),), {}))
    assert ordered(1) < ordered(2)


def test_a_subclass_reads_its_own_kind_whenever_it_was_made():
    other = get("msg/Other")
    buffer = other(7).serialize()
    assert type(other.deserialize(buffer)) is other

    class Mine(other):
        pass

    class Loud(Mine):
        @classmethod
        def deserialize(cls, buffer, **options):
            message = super().deserialize(buffer, **options)
            message.value += 1
            return message

    class Louder(Loud):
        pass

    read = [cls.deserialize(buffer) for cls in (other, Mine, Loud, Louder)]
    assert [type(message) for message in read] == [other, Mine, Loud, Louder]
    assert [message.value for message in read] == [7, 7, 8, 8]
    many = Mine.deserialize_many([buffer])
    assert [type(message) for message in many] == [Mine]
    assert repr(other(7)) == "citizen_msgs.msg.Other(value=7)"
    Mine.__module__ = "alone"
    assert repr(Mine(7)) == "Mine(value=7)"


def test_subclasses_may_take_options():
    class Base(get("msg/Other")):
        def __init_subclass__(cls, unit="", **options):
            super().__init_subclass__(**options)
            cls.unit = unit

    class Sub(Base, unit="m"):
        __slots__ = "note"

    assert (Sub.unit, Sub(3).value) == ("m", 3)


def test_type_hints_are_types(kind):
    for cls in (kind, *bases(kind)):
        hints = typing.get_type_hints(cls)
        assert all(not isinstance(hint, str) for hint in hints.values())
    assert list(typing.get_type_hints(kind)) == [field.name for field in dataclasses.fields(kind)]
    hints = typing.get_type_hints(kind.__init__)
    names = {field.name for field in dataclasses.fields(kind)}
    assert set(hints) - {"return", "options"} <= names
    assert all(not isinstance(field.type, str) for field in dataclasses.fields(kind))


def test_type_hints_are_what_they_name():
    hints = typing.get_type_hints(get("msg/Nested"))
    assert hints["header"] is generated.class_of("std_msgs/msg/Header")
    hints = typing.get_type_hints(get("srv/Ask_Event"))
    assert hints["info"] is generated.class_of("service_msgs/msg/ServiceEventInfo")
    assert hints["request"] == list[get("srv/Ask_Request")]


LONG = {"text": "a long text, " * 4, "frame_id": "a long name, " * 4, "names": ["a long name"] * 9}


def long(kind):
    names = {field.name for field in dataclasses.fields(kind)}
    return kind(**{name: value for name, value in LONG.items() if name in names})


@pytest.mark.parametrize("name", ["Plain", "Arrays", "Nested", "Decorated"])
def test_long_messages_are_shown_field_by_field(name):
    import users

    kind = users.Decorated if name == "Decorated" else get(f"msg/{name}")
    message = long(kind)
    names = [field.name for field in dataclasses.fields(message)]
    console = rich.console.Console(file=io.StringIO(), width=60)
    console.print(message)
    shown = [pprint.pformat(message, width=60), console.file.getvalue()]
    shown.append(rich.pretty.pretty_repr(message, max_width=60))
    for text in shown:
        begins = re.findall(r"^(?: *|\w+\()(\w+)=", text, re.MULTILINE)
        assert [begin for begin in begins if begin in names] == names, text


def test_short_messages_are_shown_on_a_line():
    message = get("msg/Plain")(text="t")
    assert pprint.pformat(message) == repr(message)
    assert rich.pretty.pretty_repr(message) == "Plain(small=0, x=0.5, text='t', class_=False)"
    assert pprint.pformat(get("msg/Empty")()) == "citizen_msgs.msg.Empty()"
    assert rich.pretty.pretty_repr(get("msg/Empty")()) == "Empty()"


def test_ipython_shows_long_messages_on_several_lines():
    pretty = pytest.importorskip("IPython.lib.pretty").pretty
    message = long(get("msg/Plain"))
    assert pretty(message).splitlines() == [
        "citizen_msgs.msg.Plain(small=0,",
        "                       x=0.5,",
        f"                       text={message.text!r},",
        "                       class_=False)",
    ]
    assert pretty(get("msg/Plain")()) == repr(get("msg/Plain")()).replace("class=", "class_=")
    for name in ("Arrays", "Empty", "Nested"):
        assert pretty(long(get(f"msg/{name}"))).startswith(f"citizen_msgs.msg.{name}(")
    assert "..." in pretty(get("msg/Arrays")(values=range(2000)))


PICKLES = """
import pickle, sys
sys.path.insert(0, sys.argv[1])
for buffer in pickle.load(sys.stdin.buffer):
    message = pickle.loads(buffer)
    sys.stdout.write(repr(message) + "\\n")
"""


def test_pickles_are_read_by_another_process(folder):
    import users

    kinds = [generated.class_of(name) for name in NAMES] + [getattr(users, name) for name in USERS]
    messages = [long(kind) for kind in kinds]
    messages[-1].more = "of a user's"
    buffers = []
    for message, protocol in itertools.product(messages, range(pickle.HIGHEST_PROTOCOL + 1)):
        buffers.append(pickle.dumps(message, protocol))
        again = pickle.loads(buffers[-1])
        assert type(again) is type(message)
        assert again == message
        assert getattr(again, "__dict__", {}) == getattr(message, "__dict__", {})
    done = subprocess.run(
        [sys.executable, "-c", PICKLES, str(folder)],
        input=pickle.dumps(buffers),
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    expected = [repr(message) for message in messages for _ in range(pickle.HIGHEST_PROTOCOL + 1)]
    assert done.stdout.decode().splitlines() == expected


def test_copies_are_like_the_original(kind):
    message = long(kind)
    for other in (copy.copy(message), copy.deepcopy(message)):
        assert type(other) is kind
        assert other == message
        assert other is not message
    types = kind._fields_and_field_types
    assert copy.deepcopy(types) == pickle.loads(pickle.dumps(types)) == types
    assert json.loads(json.dumps(types)) == kind.get_fields_and_field_types()


@pytest.mark.parametrize("name", NAMES)
def test_messages_that_check_their_fields_are_like_others(name):
    kind = generated.class_of(name)
    message = kind(check_fields=True)
    assert message == kind()
    assert pprint.pformat(message) == pprint.pformat(kind())
    assert pydoc.plain(pydoc.render_doc(message))
    assert dict(inspect.getmembers(message))
    assert list(dataclasses.asdict(message)) == list(kind.__match_args__)
    assert kind.deserialize(message.serialize()) == kind()
    pickled = [pickle.dumps(message, protocol) for protocol in range(pickle.HIGHEST_PROTOCOL + 1)]
    for again in (copy.copy(message), copy.deepcopy(message), *map(pickle.loads, pickled)):
        assert (again, again._check_fields) == (message, True)


def test_msgspec_writes_what_it_knows():
    message = generated.class_of("std_msgs/msg/Header")(frame_id="map")
    plain = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}
    assert msgspec.to_builtins(message) == plain
    assert msgspec.json.decode(msgspec.json.encode(message)) == plain
    arrays = get("msg/Arrays")(values=[1.5])
    with pytest.raises(TypeError, match="array"):
        msgspec.to_builtins(arrays)
    found = msgspec.to_builtins(arrays, enc_hook=lambda value: value.tolist())
    assert (found["values"], found["two"]) == ([1.5], [1, 2])


def test_functions_dispatch_on_classes():
    import users

    @functools.singledispatch
    def size(message):
        return 0

    @size.register
    def _(message: get("msg/Plain")):
        return 1

    assert [size(cls()) for cls in (get("msg/Plain"), users.Decorated, users.Subclass)] == [1, 1, 0]


def test_weak_references_are_for_subclasses():
    # as with rosidl's classes, whose slots leave no room for one
    class Mine(get("msg/Plain")):
        pass

    message = Mine()
    assert weakref.ref(message)() is message
    with pytest.raises(TypeError):
        weakref.ref(get("msg/Plain")())


@pytest.fixture
def without_rosidl(monkeypatch):
    for module in ("rosidl_parser", "rosidl_parser.definition", "action_msgs", "action_msgs.srv"):
        monkeypatch.setitem(sys.modules, module, None)


@pytest.mark.usefixtures("without_rosidl")
def test_what_is_missing_is_a_missing_attribute(kind):
    for one in (kind, kind()):
        assert not hasattr(one, "SLOT_TYPES")
        assert dict(inspect.getmembers(one))
        with pytest.raises(AttributeError) as caught:
            one.SLOT_TYPES  # noqa: B018
        assert f"{kind.__name__}.SLOT_TYPES needs rosidl_parser" in str(caught.value)
        assert "pip install ros-jazzy-rosidl-parser" in str(caught.value)
    assert unittest.mock.create_autospec(kind)
    assert pydoc.plain(pydoc.render_doc(kind))
    walk = get("action/Walk")
    assert dict(inspect.getmembers(walk.Impl))
    with pytest.raises(AttributeError, match="needs action_msgs, which cannot be imported"):
        walk.Impl.CancelGoalService  # noqa: B018


ASSERTIONS = """
from citizen_msgs.msg import Arrays, Nested, Plain
import users

def test_plain():
    assert Plain(1, 2.0, "a") == Plain(1, 2.0, "b")

def test_subclass():
    assert users.Decorated(extra=1) == users.Decorated(extra=2)

def test_within_a_dictionary():
    assert {"x": Plain(text="a" * 90)} == {"x": Plain(text="b" * 90)}

def test_arrays():
    assert Arrays(two=[1, 2]) == Arrays(two=[1, 3])

def test_nested():
    assert Nested(plain=Plain(3)) == Nested(plain=Plain(4))
"""


@pytest.mark.parametrize("verbose", [[], ["-vv"]])
def test_pytest_explains_what_differs(folder, tmp_path, verbose):
    (tmp_path / "test_messages.py").write_text(ASSERTIONS)
    command = [
        sys.executable,
        "-m",
        "pytest",
        *"-p no:cacheprovider -p no:idlc -c /dev/null".split(),
    ]
    done = subprocess.run(
        [*command, *verbose, f"--rootdir={tmp_path}", "test_messages.py"],
        cwd=tmp_path,
        env={"PYTHONPATH": str(folder), "COLUMNS": "80"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "5 failed" in done.stdout, done.stdout + done.stderr
    assert "representation of details failed" not in done.stdout
    tests = done.stdout.split("____ test_")[1:]
    assert "Differing attributes" in tests[0]
    assert "['text']" in tests[0]
    assert "['extra']" in tests[1]
    if verbose:
        assert f"text='{'a' * 90}'," in tests[2]


def test_pydantic_checks_messages():
    pydantic = pytest.importorskip("pydantic")
    plain = pydantic.TypeAdapter(get("msg/Plain"))
    message = plain.validate_python({"small": 3, "text": "t"})
    assert message == get("msg/Plain")(3, 0.5, "t")
    assert plain.validate_python(message) is message
    assert plain.dump_python(message) == {"small": 3, "x": 0.5, "text": "t", "class_": False}
    assert plain.validate_json(plain.dump_json(message)) == message
    assert set(plain.json_schema()["properties"]) == {"small", "x", "text", "class_"}
    mistaken = get("msg/Plain")()
    mistaken.small = "x"
    for wrong in ({"small": "x"}, {"small": 300}, 3, mistaken):
        with pytest.raises(pydantic.ValidationError):
            plain.validate_python(wrong)


def test_pydantic_models_hold_messages(kind):
    pydantic = pytest.importorskip("pydantic")
    for config in ({}, {"arbitrary_types_allowed": True}):
        fields = {"message": (kind, ...), "many": (list[kind], [])}
        model = pydantic.create_model("Model", __config__=pydantic.ConfigDict(**config), **fields)
        message = long(kind)
        made = model(message=message)
        assert made.message is message
        assert model.model_validate(made.model_dump()).message == message
        assert model.model_validate_json(made.model_dump_json()).message == message
        assert model.model_json_schema()


def test_pydantic_says_which_array_is_wrong():
    pydantic = pytest.importorskip("pydantic")
    arrays = pydantic.TypeAdapter(get("msg/Arrays"))
    message = arrays.validate_python({"values": [1, 2], "two": (3, 4), "data": b"ab"})
    assert message.values == array("f", [1, 2])
    assert list(message.two) == [3, 4]
    assert message.data == array("B", b"ab")
    for name, value in (("two", [1]), ("data", [300]), ("values", "text"), ("names", [1])):
        with pytest.raises(pydantic.ValidationError):
            arrays.validate_python({name: value})


def test_pydantic_reports_every_error_of_a_message_where_it_is():
    pydantic = pytest.importorskip("pydantic")
    nested = {"small": 300, "x": "much", "text": 3}
    adapter = pydantic.TypeAdapter(list[get("msg/Plain")])
    again = pydantic.create_model(
        "Model", first=(get("msg/Plain"), ...), more=(list[get("msg/Plain")], ...)
    )
    arrays = pydantic.TypeAdapter(get("msg/Arrays"))

    def places(check, value):
        with pytest.raises(pydantic.ValidationError) as raised:
            check(value)
        return [error["loc"] for error in raised.value.errors()]

    each = [("small",), ("x",), ("text",)]
    assert places(adapter.validate_python, [nested, {}, nested]) == [
        (index, *place) for index in (0, 2) for place in each
    ]
    assert places(again.model_validate, {"first": nested, "more": [nested]}) == [
        *(("first", *place) for place in each),
        *(("more", 0, *place) for place in each),
    ]
    wrong = {"data": [1, 300, -1], "two": [1], "names": ["a", 1], "values": [1e300]}
    assert set(places(arrays.validate_python, wrong)) == {
        ("data", 1),
        ("data", 2),
        ("two",),
        ("names", 1),
        ("values", 0),
    }
    # what is a message already is checked as well, wherever it is used again
    mistaken = get("msg/Plain")()
    mistaken.small = 300
    assert places(again.model_validate, {"first": mistaken, "more": [mistaken]}) == [
        ("first",),
        ("more", 0),
    ]


def test_pytest_says_which_fields_differ(kind):
    explain = pytest_plugin.pytest_assertrepr_compare
    assert explain("==", kind(), long(kind))[:3] == [
        f"{kind.__name__}(...) == {kind.__name__}(...)",
        "",
        "Differing fields:",
    ]
    plain, arrays = get("msg/Plain"), get("msg/Arrays")
    assert explain("==", plain(1, text="a"), plain(2, text="a" * 99))[3:] == [
        "  small: 1 != 2",
        f"  text: 'a' != '{'a' * 76}...",
    ]
    assert explain("==", arrays(values=[1, 2]), arrays(values=[1, 3, 4]))[3:] == [
        "  values: 2 elements != 3 elements",
        "  values[1]: 2.0 != 3.0",
    ]
    mistaken = plain()
    mistaken.text = object()
    for op, left, right in (
        ("!=", plain(), plain(2)),
        ("==", plain(), arrays()),
        ("==", plain(), None),
        ("==", 3, 4),
    ):
        assert explain(op, left, right) is None
    explain("==", mistaken, plain())


def test_importing_messages_imports_none_of_this(folder):
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from citizen_msgs.srv import Ask\n"
        "from citizen_msgs.msg import Plain\n"
        "assert Plain.deserialize(Plain().serialize()) == Plain()\n"
        "print({'dataclasses', 'inspect', 'typing', 'numpy', 'copyreg'} & set(sys.modules))\n"
    )
    done = subprocess.run(
        [sys.executable, "-S", "-c", code, str(folder)], capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("set()\n", "")


#: A field for each method that messages inherit, of kinds that generated code treats differently.
HIDING = """int8 validate
uint8 serialize
float32[] deserialize
string to_dict
int32[3] from_dict
bool to_columns
bool[] to_arrow
Part[] serialize_many
Part deserialize_many
int8 get_fields_and_field_types
int8 mro
int8 copy
"""
HIDING_FILES = {
    "msg/Hiding.msg": HIDING,
    "msg/Part.msg": "int8 validate\nint8 serialize\nint8[] deserialize\nint8 to_dict\n",
    "msg/None.msg": "int8 a\n",
    "msg/True.msg": "None one\nNone[] more\nNone[2] pair\n",
    "srv/None.srv": "None a\n---\nTrue b\n",
    "action/False.action": "None a\n---\nint8 b\n---\nTrue c\n",
}


@pytest.fixture(scope="module")
def hiding(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hiding")
    generated.write_package(folder, "hiding_msgs", HIDING_FILES)
    with generated.importable(folder):
        yield importlib.import_module("hiding_msgs.msg")


def test_fields_are_free_to_have_the_names_of_methods(hiding):
    kind, part = hiding.Hiding, hiding.Part
    message = kind(
        1, 2, [3.5], "4", [5, 6, 7], True, [False], [part(1, 2, [3], 4)], part(6), 8, 9, 10
    )
    message.validate = 100
    message.deserialize = [4.5]
    assert (message.validate, message.serialize, message.to_dict) == (100, 2, "4")
    assert (message.mro, message.copy, message.get_fields_and_field_types) == (9, 10, 8)
    assert isinstance(message.deserialize, array)
    assert list(message.from_dict) == [5, 6, 7]
    base = kind.__mro__[1]
    for _ in range(2):  # before and after the codec is there
        for order in ("little", "big"):
            buffer = base.serialize(message, byteorder=order)
            assert super(kind, message).serialize(byteorder=order) == buffer
            assert super(kind, kind).deserialize(buffer) == message
            assert super(kind, kind).deserialize(bytearray(buffer), copy=False).mro == 9
            assert super(kind, kind).deserialize_many([buffer]) == [message]
            assert super(kind, kind).serialize_many([message], byteorder=order) == [buffer]
        assert list(super(kind, kind).to_columns([buffer])["from_dict"][0]) == [
            5,
            6,
            7,
        ]
    plain = base.to_dict(message)
    assert super(kind, kind).from_dict(json.loads(json.dumps(plain))) == message
    assert list(super(kind, kind).get_fields_and_field_types()) == list(plain)
    base.validate(message)
    message.validate = 1000
    for check in (base.validate, base.serialize):
        with pytest.raises(ValueError, match=r"^validate: must be an integer from -128 to 127"):
            check(message)
    message.validate = 1
    checked = kind(deserialize=[2.5], check_fields=True)
    assert super(kind, kind).deserialize(base.serialize(checked)) == checked
    with pytest.raises(AssertionError, match="validate"):
        checked.validate = "x"
    for other in (copy.copy(message), copy.deepcopy(message), dataclasses.replace(message)):
        assert other == message
    assert pickle.loads(pickle.dumps(message)) == message
    assert [field.name for field in dataclasses.fields(kind)] == list(plain)
    assert "super(Hiding, message)" in pydoc.getdoc(kind)
    assert pydoc.plain(pydoc.render_doc(kind))
    for garbage in (b"", buffer[:9]):
        with pytest.raises(ValueError, match="byte"):
            super(kind, kind).deserialize(garbage)
        with pytest.raises(ValueError, match=r"^\[0\]"):
            super(kind, kind).deserialize_many([garbage])


def test_subclasses_keep_fields_of_the_names_of_methods(hiding):
    class Mine(hiding.Part):
        pass

    message = Mine(serialize=3, deserialize=[1, 2])
    assert list(message.deserialize) == [1, 2]
    buffer = super(hiding.Part, message).serialize()
    again = super(hiding.Part, Mine).deserialize(buffer)
    assert type(again) is Mine
    assert again == message


def test_the_methods_are_those_that_a_field_can_hide():
    base = get("msg/Plain").__mro__[1]
    assert {name for name in vars(base) if name[0].islower()} == python_names.METHODS


def test_messages_may_be_called_like_words_of_python(hiding):
    none, true = hiding.None_, hiding.True_
    assert (getattr(hiding, "None"), getattr(hiding, "True")) == (none, true)
    assert "None_" in dir(hiding)
    message = true(none(1), [none(2)])
    assert true.deserialize(message.serialize()) == message
    assert true.from_dict(message.to_dict()) == message
    message.validate()
    message.one.a = 1000
    with pytest.raises(ValueError, match=r"^one\.a"):
        message.validate()
    with pytest.raises(ValueError, match=r"^one\.a: .* at byte 4"):
        true.deserialize(b"\0\1\0\0")
    service = importlib.import_module("hiding_msgs.srv").None_
    assert service.Request(a=none(3)).to_dict() == {"a": {"a": 3}}
    action = importlib.import_module("hiding_msgs.action").False_
    assert action.Feedback.from_dict({"c": {"one": {"a": 3}}}).c.one == none(3)
    assert action.Impl.SendGoalService.Request().to_dict()["goal"] == {"a": {"a": 0}}
