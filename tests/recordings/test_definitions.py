"""What recordings say of their types, in all the ways in which recorders say it."""

import re
import sqlite3
import sys
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.parse import parse, parse_any
from idlc.model import catalog, ir
from idlc.model.distros import BY_NAME
from idlc.model.idl_text import file_text, idl
from idlc.model.link import link
from idlc.model.lowering.lower import lower
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.recordings.containers.container import Schema, Topic
from idlc.recordings.definitions import RECORDING, ROBOT, mcap_text, read_definition, type_name
from idlc.recordings.lengths import wrong_definition
from idlc.recordings.types import LocalTypes, contradictions, recorded_types, versions
from tests.support import idl_view, recorded_text
from tests.support.recordings import IMU, STORE, definition

LINE = "=" * 80 + "\n"
BYTE = "RIHS01_41e1a3345f73fe93ede006da826a6ee274af23dd4653976ff249b0f44e3e798f"
SHARE = Path(sys.prefix) / "share"


def topic(type_, text, encoding="ros2msg", hash_=None):
    schema = Schema(type_, encoding, text) if text else None
    return read_definition(Topic("/x", type_, 1, hash_, "cdr", schema), "rec")


def texts(*words):
    return {str(name): source.text for name, source in topic(*words).texts.items()}


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("middle", ["", "msg/"])
def test_a_text_is_divided_at_its_lines(middle, end):
    text = f"a_msgs/{middle}B[] b\nint32 c 3{end}\n{LINE}MSG: a_msgs/{middle}B\nint32 d{end}\n\n"
    text += f"{LINE}MSG: a_msgs/{middle}C\n"
    found = texts(f"a_msgs/{middle}A", text)
    assert found == {
        "a_msgs/msg/A": "a_msgs/B[] b\nint32 c 3\n",
        "a_msgs/msg/B": "int32 d\n",
        "a_msgs/msg/C": "",
    }


def test_idl_and_services_name_their_first_definition_too():
    found = texts(
        "a_msgs/msg/A", f"{LINE}IDL: a_msgs/msg/A\nmodule\n{LINE}IDL: a_msgs/msg/B\nx", "ros2idl"
    )
    assert found == {"a_msgs/msg/A": "module\n", "a_msgs/msg/B": "x\n"}
    text = f"{LINE}SRV: a_msgs/srv/A\nint32 a\n---\n\n{LINE}MSG: a_msgs/msg/B\nint32 b"
    for encoding in ("ros2msg", "unknown", ""):
        found = topic("a_msgs/srv/A_Event", text, encoding)
        assert (str(found.name), str(found.interface)) == ("a_msgs/srv/A_Event", "a_msgs/srv/A")
        assert {str(name): one.text for name, one in found.texts.items()} == {
            "a_msgs/srv/A": "int32 a\n---\n",
            "a_msgs/msg/B": "int32 b\n",
        }


def test_a_service_is_recorded_without_a_line_as_well():
    assert texts("a_msgs/srv/A_Event", "int32 a\n---\nint32 b\n") == {
        "a_msgs/srv/A": "int32 a\n---\nint32 b\n"
    }


@pytest.mark.parametrize(
    ("name", "interface"),
    [
        ("a/B", "a/msg/B"),
        ("a/msg/B", "a/msg/B"),
        ("a/msg/B_Request", "a/msg/B_Request"),
        ("a/srv/B_Event", "a/srv/B"),
        ("a/srv/B_Request", "a/srv/B"),
        ("a/action/B_FeedbackMessage", "a/action/B"),
        ("a/action/B_SendGoal_Event", "a/action/B"),
        ("a/action/B_GetResult_Response", "a/action/B"),
        ("a/action/B_Goal", "a/action/B"),
    ],
)
def test_types_and_what_they_are_derived_from(name, interface):
    assert str(topic(name, "").interface) == interface


@pytest.mark.parametrize(
    "name",
    [
        "",
        "B",
        "a/b/c/D",
        "../a/msg/B",
        "a/../B",
        "/a/msg/B",
        "a/msg/../B",
        "a/msg/b",
        "A/msg/B",
        "a/msg/B c",
        "a/msg/B\n",
        "a/idl/B",
        "a/srv/_Event",
        "a/msg/B;import os",
        "foxglove.Scene",
        "a/msg/Ü",
    ],
)
def test_what_is_no_name_is_none(name):
    assert type_name(name) is None
    assert topic(name, "int32 a").texts == {}
    assert texts("a/msg/B", f"int32 a\n{LINE}MSG: {name}\nint32 b\n") == {"a/msg/B": "int32 a\n"}


def test_the_first_of_two_definitions_counts_and_that_is_told():
    text = (
        f"int32 a\n{LINE}MSG: a/B\nint32 b\n{LINE}MSG: a/B\nint32 c\n{LINE}MSG: a/A\nint32 a # x\n"
    )
    assert texts("a/msg/A", text) == {"a/msg/A": "int32 a\n", "a/msg/B": "int32 b\n"}
    ((name, first, second),) = contradictions(versions([topic("a/msg/A", text)]))
    assert (str(name), first.text, second.text) == ("a/msg/B", "int32 b\n", "int32 c\n")


def types_of(*topics):
    report, scope = Report(), Scope(Root.here())
    (version,) = versions(topics)
    return recorded_types(version, LocalTypes(scope, Report()), report), report


def test_what_rosbags_writes_has_its_hash():
    names = [name for name in STORE.fielddefs if name.startswith(("sensor_msgs/msg/", "nav_msgs/"))]
    assert IMU in names
    topics = [topic(name, definition(name), hash_="x") for name in names]
    types, _ = types_of(*topics)
    assert not types.errors.had_errors
    assert len(types.topics) == len(names)
    expected = {name: STORE.hash_rihs01(name) for name in names}
    assert {str(one.name): types.hash(one) for one in types.topics} == expected


def test_what_idlc_writes_has_its_hash_in_both_languages():
    for name in catalog.interfaces():
        if name.kind != "msg" or name.package not in ("sensor_msgs", "diagnostic_msgs"):
            continue
        model = link(
            name.package, [lower(parse(catalog.source(name)), name, Report())], catalog, Report()
        )
        expected = model.describer.hash(str(name))
        as_msg = topic(str(name), mcap_text(model.interfaces[name], model))
        parts = [f"{LINE}IDL: {one.name}\n{idl(one)}" for one in model.interfaces.values()]
        as_idl = topic(str(name), "\n".join(parts), "ros2idl")
        for one in (as_msg, as_idl):
            types, report = types_of(one)
            assert types.hash(types.topics[0]) == expected
            assert [found.code for found in report] == []


def test_idl_is_written_as_the_file_that_it_was():
    """Tools ask for the text of the file; comments and units may stand at other places in it."""
    for path in SHARE.glob("*/*/*.idl"):
        package, kind, _ = path.parts[-3:]
        name = ir.TypeName(package, kind, path.stem)
        source = Source("x.idl", path.read_text(encoding="utf-8"))
        found = lower(parse_any(source), name, Report())
        report = Report()
        again = lower(parse(Source("x", file_text(found))), name, report)
        assert not report.had_errors
        assert bare(again) == bare(found), name


def bare(interface):
    sections = idl_view.sections(interface)
    return [
        (
            [(one.name, one.type, one.default) for one in section.fields],
            [(one.name, one.type, one.value) for one in section.constants],
        )
        for section in sections
    ]


@pytest.mark.parametrize("value", ["it's", 'say "x"', "a#b", "back\\slash", "\\n", "é漢", "\t", ""])
def test_texts_of_idl_survive_in_the_file(value):
    name = ir.TypeName("a", "msg", "B")
    field = ir.Field(name="x", type=ir.String(), default=ir.Default(value, value))
    many = ir.Field(
        name="y", type=ir.Sequence(ir.String()), default=ir.Default((value,), repr((value,)))
    )
    constant = ir.Constant(name="C", type=ir.String(), value=value)
    source = Source("x.idl", "")
    own = ir.Message(name=name, fields=(field, many), constants=(constant,), source=source)
    report = Report()
    again = lower(parse(Source("x", file_text(own))), name, report)
    assert not report.had_errors
    assert [one.default.value for one in again.fields] == [value, (value,)]
    assert again.constants[0].value == value


def test_versions_differ_in_more_than_comments():
    a = topic("a/msg/A", "# one\nint32 a  # [m]\n")
    same = topic("a/msg/A", "# another\nint32 a  # x [m]\n")
    other = topic("a/msg/A", "int64 a\n")
    assert len(versions([a, same])) == 1
    assert len(versions([a, other, same])) == 2
    assert len(versions([a, topic("a/msg/A", "int32 a 3  # [m]\n")])) == 2
    assert len(versions([a, topic("a/msg/A", "int32 a  # [km]\n")])) == 2
    broken = [topic("a/msg/A", "int32\n"), topic("a/msg/A", "int33\n")]
    assert len(versions([a, *broken])) == 3
    as_idl = 'module a { module msg { struct A { @unit (value="m") int32 a; }; }; };'
    assert len(versions([a, topic("a/msg/A", as_idl, "ros2idl")])) == 1
    assert versions([]) == []


def test_a_message_without_fields_has_an_empty_definition():
    empty = recorded_text.right_hash("std_msgs/msg/Empty")
    types, report = types_of(topic("std_msgs/msg/Empty", "", hash_=empty))
    assert (len(types.topics), list(report)) == (1, [])
    model = link("a", [ir.Message(name=ir.TypeName("a", "msg", "B"))], catalog, Report())
    own = model.describer.hash("a/msg/B")
    types, report = types_of(topic("a/msg/B", "", hash_=own))
    assert types.hash(types.topics[0]) == own
    assert list(report) == []
    blank = Schema("a/msg/B", "ros2msg", "\n")
    types, report = types_of(read_definition(Topic("/x", "a/msg/B", 1, None, "cdr", blank), "rec"))
    assert (types.topics, [one.code for one in report]) == ((), ["IDL652"])


@pytest.mark.parametrize(("hash_", "code"), [(None, "IDL652"), ("here", ""), ("there", "")])
def test_an_empty_definition_within_another_is_believed_by_its_hash(hash_, code):
    text = f"String s\n{LINE}MSG: std_msgs/String\n"
    name = ir.TypeName.parse("std_msgs/msg/A")
    there, here = (
        link(
            "std_msgs",
            [lower(parse(Source("x", one)), own, Report()) for own, one in pairs],
            catalog,
            Report(),
        ).describer.hash(str(name))
        for pairs in (
            [(name, "String s"), (ir.TypeName.parse("std_msgs/msg/String"), "")],
            [(name, "String s")],
        )
    )
    types, report = types_of(
        topic(str(name), text, hash_=hash_ and {"here": here, "there": there}[hash_])
    )
    assert types.hash(types.topics[0]) == (there if hash_ == "there" else here)
    assert "".join(one.code for one in report) == code


def test_idl_of_others_gives_way_to_what_is_known_here():
    text = "module std_msgs { module msg { @final struct String { wchar a; }; }; };"
    types, report = types_of(topic("std_msgs/msg/String", text, "ros2idl"))
    assert [one.code for one in report] == ["IDL652"]
    assert types.hash(types.topics[0]) == recorded_text.right_hash("std_msgs/msg/String")


def test_a_db3_has_the_definition_of_a_service_by_the_service(tmp_path, capsys):
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as db:
        db.executescript(
            """
            CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,
              serialization_format TEXT, offered_qos_profiles TEXT, type_description_hash TEXT);
            CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
              data BLOB);
            CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT,
              encoding TEXT, encoded_message_definition TEXT, type_description_hash TEXT);
            INSERT INTO topics VALUES
              (1, '/a/_service_event', 'a_srvs/srv/Ask_Event', 'cdr', '', '');
            INSERT INTO message_definitions VALUES
              (1, 'a_srvs/srv/Ask', 'ros2msg', 'int32 a' || char(10) || '---', '');
            """
        )
    db.close()
    assert main(["show", str(path), "--format", "hash"]) == 0
    assert "a_srvs/srv/Ask_Event" in capsys.readouterr().out


#: A definition with errors, and the hash of what it was once.
BROKEN = "strin&g data\n"
RIGHT = recorded_text.right_hash("std_msgs/msg/String")


@pytest.mark.parametrize("encoding", ["ros2msg", "ros2idl"])
@pytest.mark.parametrize(("hash_", "said"), [(RIGHT, "the recorded hash"), (None, "the same name")])
def test_what_has_errors_is_what_is_known_here(encoding, hash_, said):
    types, report = types_of(topic("std_msgs/msg/String", BROKEN, encoding, hash_))
    assert types.hash(types.topics[0]) == RIGHT
    assert not types.errors.had_errors
    (told,) = report
    assert told.code == "IDL652"
    broken = "there are errors in the definition of `std_msgs/msg/String`; idlc uses "
    # installed, or of the catalogue
    origin = r"the (local type|type of ROS 2 Jazzy), which has "
    assert re.fullmatch(re.escape(broken) + origin + said, told.message)


@pytest.mark.parametrize(
    ("name", "hash_"),
    [("std_msgs/msg/String", "RIHS01_" + "0" * 64), ("demo_msgs/msg/Own", None)],
)
def test_what_has_errors_and_was_something_else_is_an_error(name, hash_):
    types, _ = types_of(topic(name, BROKEN, hash_=hash_))
    assert types.hash(types.topics[0]) is None
    (error,) = types.errors
    assert error.where[0] == f"rec: topic /x: {name}.msg"


def test_what_has_errors_within_others_is_what_is_known_here():
    text = f"String s\n{LINE}MSG: std_msgs/String\n{{}}"
    sound, broken = text.format("string data\n"), text.format(BROKEN)
    (wanted,) = types_of(topic("std_msgs/msg/A", sound))[0].topics
    right = types_of(topic("std_msgs/msg/A", sound))[0].hash(wanted)
    for hash_, code in ((None, "IDL652"), (right, "IDL652"), ("RIHS01_1", "IDL201")):
        types, report = types_of(topic("std_msgs/msg/A", broken, hash_=hash_))
        assert [one.code for one in (*types.errors, *report)] == [code]
        assert types.hash(types.topics[0]) == (right if code == "IDL652" else None)


#: A type, its definition and hash -> the problem; {0} is a recording or a robot.
SUBSTITUTIONS = {
    ("own_msgs/msg/Pair", "", None): "idlc does not read `/x`: {0.name} does not define `own_msgs",
    ("std_msgs/msg/Byte", "", None): "{0.name} does not define `std_msgs/msg/Byte`; idlc uses",
    ("std_msgs/msg/Byte", "int8 data\n", BYTE): "{0.hash} does not match the definition of",
    ("std_msgs/msg/Byte", "int9 data\n", BYTE): "which has {0.hash}",
}


@pytest.mark.parametrize("origin", [RECORDING, ROBOT])
@pytest.mark.parametrize("case", SUBSTITUTIONS)
def test_problems_name_where_definitions_come_from(case, origin):
    type_, text, hash_ = case
    definition = topic(type_, text, hash_=hash_)._replace(origin=origin)
    report = Report()
    local = LocalTypes(Scope(Root.here()), report)
    recorded_types(*versions([definition]), local, report)
    (problem,) = report
    assert SUBSTITUTIONS[case].format(origin) in problem.message
    said = f"{problem.message} {problem.hint}"
    other = RECORDING if origin is ROBOT else ROBOT
    assert not [words for words in other if words in said]
    if "same name" in said:
        assert f"check that it equals {origin.type}; `distro=NAME` or" in problem.hint


@pytest.mark.parametrize(
    ("distro", "option", "hint"),
    [
        (None, "", "choose the publisher's version with `distro=` or `include=`"),
        (None, "--from", "choose the publisher's version with `--from`"),
        (BY_NAME["humble"], "", "use `distro='humble'`"),
        (BY_NAME["humble"], "--from", "use `--from distro:humble`"),
    ],
)
def test_what_to_do_where_a_recording_without_definitions_is_of_another_version(
    distro, option, hint
):
    assert wrong_definition(Topic("/a", "demo/msg/A", 1, None, "cdr", None), distro, option) == hint
