"""Names: the verdicts and expansions of rcl and rmw."""

from contextlib import suppress

import pytest

from idlc.robot import names
from idlc.robot.names import InvalidNameError, expand_name, expand_namespace
from tests.support.examples import given, st


@pytest.mark.parametrize(
    ("name", "expanded"),
    [
        ("chatter", "/ns/deep/chatter"),
        ("a/b", "/ns/deep/a/b"),
        ("/chatter", "/chatter"),
        ("~", "/ns/deep/talker"),
        ("~/private", "/ns/deep/talker/private"),
        ("_hidden/_a__b", "/ns/deep/_hidden/_a__b"),
        ("a" * 238, "/ns/deep/" + "a" * 238),
    ],
)
def test_names_are_expanded(name, expanded):
    assert expand_name(name, "/ns/deep", "talker") == expanded
    assert names.is_absolute(expanded)


def test_the_root_namespace_adds_nothing():
    assert expand_name("x", "/", "talker") == "/x"
    assert expand_name("~/x", "/", "talker") == "/talker/x"


@pytest.mark.parametrize(
    "name",
    [
        *("", "/", "a/", "a//b", "a b", "a-b", "ä", "{node}", "a\n"),
        *("a/~", "~x", "1a", "a/1", "/~", "a" * 239),
    ],
)
def test_invalid_names_are_refused_with_the_rule(name):
    with pytest.raises(InvalidNameError, match="is not a name; write at most 247 characters"):
        expand_name(name, "/ns/deep", "talker")


@given(st.text("/~_a1 {}ns.\n"))
def test_any_name_is_refused_or_becomes_absolute(name):
    with suppress(InvalidNameError):
        assert names.is_absolute(expand_name(name, "/ns", "node"))


@pytest.mark.parametrize("number", range(256))
def test_only_letters_digits_and_underscores_are_in_names(number):
    character = chr(number)
    is_word = character == "_" or (character.isascii() and character.isalnum())
    for name in (f"a{character}b", f"a/b{character}"):
        with suppress(InvalidNameError):
            assert expand_name(name, "/ns", "node") == f"/ns/{name}"
            assert is_word or (character == "/" and name == "a/b")
    assert names.is_node_name(f"a{character}") == is_word
    assert names.is_namespace(f"/a{character}") == is_word


def test_namespaces_may_lack_their_slash():
    assert [*map(expand_namespace, ("", "/", "ns", "/a/b"))] == ["/", "/", "/ns", "/a/b"]
    for name in ("/a/", "//", "a b", "~", "/1"):
        with pytest.raises(InvalidNameError):
            expand_namespace(name)


def test_types_have_names_in_dds():
    assert names.dds_type("std_msgs/msg/String") == "std_msgs::msg::dds_::String_"
    assert names.ros_type("std_msgs::msg::dds_::String_") == "std_msgs/msg/String"
    assert names.ros_type("a::action::dds_::Move_SendGoal_") == "a/action/Move_SendGoal"
    for name in ("String", "std_msgs/String", "a/b/C", "a/msg/C/d", "a/msg/C\n", "../msg/C"):
        with pytest.raises(InvalidNameError):
            names.dds_type(name)
        assert names.ros_type(name) is None


def test_an_action_consists_of_services_and_topics():
    parts = names.action_names("/ns/move")
    assert parts.send_goal == "/ns/move/_action/send_goal"
    assert parts.status == "/ns/move/_action/status"
    for field, name in parts._asdict().items():
        assert names.action_part(name) == ("/ns/move", field)
    assert names.action_part("/_action/status") is None
    assert names.action_part("/a/_action/other") is None
    assert names.action_part("/a/status") is None
