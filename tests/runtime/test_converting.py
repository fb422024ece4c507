"""Classes for Lyrical take `None` for any default and any iterable for a list; others do not."""

import copy
import pickle
from array import array
from collections import UserList, deque

import pytest

from idlc.model.distros import BY_NAME, DISTROS
from tests.support import generated

FILES = {
    "msg/Inner.msg": "int32 a 7\n",
    "msg/Scalars.msg": 'string text "t"\nint32 number 5\nfloat64 real\nbool flag true\nbyte raw\n',
    "msg/Lists.msg": "string[] names\nInner[] inners\nbool[2] flags\nbyte[] raw\n"
    "wstring[<=3] wide\nfloat64[] numbers\nint32[2] pair\nInner inner\n",
}
SERVICE = {"srv/Ask.srv": "int32 a\n---\nint32 b\n"}
LISTS = {
    "names": ["a", "b"],
    "wide": ["a", "b"],
    "flags": [True, False],
    "raw": [b"a", b"b"],
}
SEQUENCES = (tuple, deque, UserList, iter, lambda values: dict.fromkeys(values).keys())


@pytest.fixture(scope="module")
def kinds(tmp_path_factory):
    """Return the classes of a distribution by name."""
    folder = tmp_path_factory.mktemp("classes")
    for distro in DISTROS:
        package = f"of_{distro.name}"
        files = FILES | SERVICE if distro.converts_values else FILES
        generated.write_model(folder, generated.model_of(package, files, distro))
    with generated.importable(folder):
        yield lambda distro, name: generated.class_of(f"of_{distro}/msg/{name}")


CONVERTING = pytest.mark.parametrize("distro", ["lyrical", "rolling"])
PLAIN = pytest.mark.parametrize("distro", ["humble", "iron", "jazzy", "kilted"])


def test_which_distributions_convert():
    assert {one for one in BY_NAME if BY_NAME[one].converts_values} == {"lyrical", "rolling"}


@CONVERTING
@pytest.mark.parametrize("options", [{}, {"check_fields": False}, {"check_fields": True}])
def test_none_is_the_default_of_every_field(kinds, distro, options):
    for name in ("Scalars", "Lists", "Inner"):
        kind = kinds(distro, name)
        for field in kind.__match_args__:
            assert kind(**{field: None}, **options) == kind()
        assert kind(*[None] * len(kind.__match_args__), **options) == kind()
    message = kinds(distro, "Scalars")(**options)
    assert [message.text, message.number, message.flag] == ["t", 5, True]


@CONVERTING
def test_the_lists_of_an_event_take_any_iterable(kinds, distro):
    service = generated.class_of(f"of_{distro}/srv/Ask")
    for make in (tuple, deque, iter):
        event = service.Event(request=make([service.Request(a=1)]))
        assert event.request == [service.Request(a=1)]
        event.response = make([service.Response(b=2)])
        assert event.response == [service.Response(b=2)]


@CONVERTING
def test_a_field_is_not_set_to_its_default_by_none(kinds, distro):
    message = kinds(distro, "Scalars")()
    message.text = None
    with pytest.raises(ValueError, match="text"):
        message.serialize()
    with pytest.raises(TypeError, match="names: must be a sequence, not None"):
        kinds(distro, "Lists")().names = None


@PLAIN
def test_none_is_no_value_before_lyrical(kinds, distro):
    with pytest.raises(TypeError, match="text: must be a str, not None"):
        kinds(distro, "Scalars")(text=None)
    with pytest.raises(ValueError, match="number"):
        kinds(distro, "Scalars")(number=None).serialize()


@CONVERTING
@pytest.mark.parametrize("field", LISTS)
@pytest.mark.parametrize("make", SEQUENCES)
def test_sequences_become_lists(kinds, distro, field, make):
    kind, values = kinds(distro, "Lists"), LISTS[field]
    assigned = kind()
    setattr(assigned, field, make(values))
    for message in (kind(**{field: make(values)}), assigned):
        assert type(getattr(message, field)) is list
        assert getattr(message, field) == values
        assert kind.deserialize(message.serialize()) == message


@CONVERTING
def test_what_lists_are_and_are_not_made_of(kinds, distro):
    kind, inner = kinds(distro, "Lists"), kinds(distro, "Inner")
    names = ["a"]
    message = kind(names=names, inners=(inner(1), inner(2)), raw=b"xy", flags=bytearray(b"\2\0"))
    assert message.names is names
    assert [one.a for one in message.inners] == [1, 2]
    assert (message.raw, message.flags) == ([b"x", b"y"], [True, False])
    message.names = "ab"
    assert message.names == ["a", "b"]
    for wrong in (5, 2.5, object()):
        with pytest.raises(TypeError, match="inners: must be a sequence"):
            kind(inners=wrong)
    # ROS's tools try a text or dictionary in the place of a message, and need a TypeError
    for wrong in ("ab", {"names": ["a"]}):
        with pytest.raises(TypeError, match="names: must be a sequence"):
            kind(wrong)


@CONVERTING
def test_messages_that_check_their_fields_have_lists(kinds, distro):
    kind = kinds(distro, "Lists")
    message = kind(names=("a",), check_fields=True)
    message.names.append("b")
    message.raw = (b"x",)
    assert (message.names, message.raw) == (["a", "b"], [b"x"])
    for wrong in ((1,), "ab", None, 5):
        with pytest.raises(AssertionError, match="names"):
            message.names = wrong


@CONVERTING
def test_python_sees_them_as_it_sees_others(kinds, distro):
    kind = kinds(distro, "Lists")
    message = kind(names=("a",), numbers=(1, 2), pair=(3, 4))
    assert type(message.numbers) is array
    for other in (copy.copy(message), copy.deepcopy(message), pickle.loads(pickle.dumps(message))):
        assert other == message
    assert kind.from_dict(message.to_dict()) == message


@pytest.mark.parametrize("distro", BY_NAME)
@pytest.mark.parametrize("options", [{}, {"check_fields": False}])
def test_an_unknown_keyword_is_a_type_error(kinds, distro, options):
    with pytest.raises(TypeError, match="did you mean 'text'"):
        kinds(distro, "Scalars")(txt="a", **options)


@pytest.mark.parametrize("distro", BY_NAME)
@pytest.mark.parametrize("error", [TypeError, AssertionError, ValueError])
def test_an_unknown_keyword_of_a_message_that_checks(kinds, distro, error):
    """Jazzy's own classes raise AssertionError there, and Lyrical's TypeError."""
    with pytest.raises(error, match="did you mean 'text'"):
        kinds(distro, "Scalars")(txt="a", check_fields=True)
