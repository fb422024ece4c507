"""Parameters: declarations, services of other nodes, and values from the command line."""

import random
from types import SimpleNamespace

import pytest

import idlc
from idlc.robot import Parameter, RobotError, Service, parameters
from idlc.robot.nodes.arguments import parse_arguments
from idlc.robot.nodes.interfaces import standard
from idlc.robot.nodes.overrides import overrides_of
from idlc.robot.parameters import parameter_value_to_python
from idlc.robot.qos import qos_profile_parameter_events
from tests.robot.nodes import node_at, spin_until

Type = Parameter.Type
ROS = idlc.load("rcl_interfaces").rcl_interfaces


@pytest.fixture
def node(address):
    with node_at(address, "tuned", namespace="/ns") as node:
        yield node


@pytest.fixture
def ask(node, address):
    """Return a function that calls a service of the node's parameters from another session."""
    with node_at(address, "asker") as asker:

        def call(name, **fields):
            kind = getattr(ROS.srv, name)
            low = "".join(f"_{each.lower()}" if each.isupper() else each for each in name)[1:]
            client = asker.create_client(kind, f"/ns/tuned/{low}")
            spin_until(client.service_is_ready, asker)
            future = client.call_async(kind.Request(**fields))
            spin_until(future.done, node, asker)
            return future.result()

        yield call


def message(name, value):
    return Parameter(name, value=value).to_parameter_msg()


# declarations


@pytest.mark.parametrize(
    ("value", "type_"),
    [
        (True, "BOOL"),
        (3, "INTEGER"),
        (0.5, "DOUBLE"),
        ("text", "STRING"),
        ([b"a", b"b"], "BYTE_ARRAY"),
        ([True], "BOOL_ARRAY"),
        ((1, 2), "INTEGER_ARRAY"),
        ([0.5], "DOUBLE_ARRAY"),
        (["a"], "STRING_ARRAY"),
    ],
)
def test_values_have_the_types_of_ros(node, value, type_):
    parameter = node.declare_parameter("p", value)
    assert parameter.type_ is Type[type_]
    assert node.get_parameter("p").value == value
    again = Parameter.from_parameter_msg(parameter.to_parameter_msg())
    assert (again.type_, again.value) == (
        parameter.type_,
        [*value] if isinstance(value, tuple) else value,
    )


@pytest.mark.parametrize("value", [2**63, [1, "a"], {}, object(), [-(2**63) - 1]])
def test_other_values_are_errors(node, value):
    with pytest.raises((TypeError, ValueError)):
        node.declare_parameter("p", value)
    assert not node.has_parameter("p")


def test_errors_are_those_of_rclpy(node):
    node.declare_parameter("known", 1)
    with pytest.raises(parameters.ParameterNotDeclaredException, match="`nope`"):
        node.get_parameter("nope")
    with pytest.raises(parameters.ParameterNotDeclaredException, match="`nope`"):
        node.set_parameters([Parameter("nope", value=1)])
    with pytest.raises(parameters.ParameterAlreadyDeclaredException, match="`known`"):
        node.declare_parameter("known", 2)
    with pytest.raises(parameters.InvalidParameterException):
        node.declare_parameter("", 2)
    with pytest.raises(ValueError, match="neither a value nor a type"):
        node.declare_parameter("untyped")
    node.declare_parameter("empty", Type.DOUBLE)
    with pytest.raises(parameters.ParameterUninitializedException, match="`empty`"):
        node.get_parameter("empty")
    assert node.get_parameter_or("empty", Parameter("empty", value=1.0)).value == 1.0


def test_descriptors_restrict_values(node):
    ranges = ROS.msg.IntegerRange(from_value=0, to_value=10, step=5)
    descriptor = ROS.msg.ParameterDescriptor(integer_range=[ranges])
    node.declare_parameter("count", 5, descriptor)
    node.declare_parameter("other", 0, descriptor)  # one descriptor may serve several
    assert node.describe_parameter("count").name == "count"
    ranges = ROS.msg.FloatingPointRange(from_value=0.0, to_value=1.0, step=0.1)
    descriptor = ROS.msg.ParameterDescriptor(floating_point_range=[ranges])
    node.declare_parameter("gain", 0.3, descriptor)
    node.declare_parameter("fixed", "a", ROS.msg.ParameterDescriptor(read_only=True))

    def outcome(name, value):
        (result,) = node.set_parameters([Parameter(name, value=value)])
        assert result.successful == (node.get_parameter(name).value == value)
        return result.reason

    assert not outcome("count", 10)
    assert "in steps of 5" in outcome("count", 7)
    assert "from 0 to 10" in outcome("count", 11)
    assert "INTEGER, not DOUBLE" in outcome("count", 0.5)
    assert not outcome("gain", 0.7)
    assert "in steps of" in outcome("gain", 0.75)
    assert "from 0.0 to 1.0" in outcome("gain", float("nan"))
    assert "read-only" in outcome("fixed", "b")
    with pytest.raises(parameters.InvalidParameterValueException, match="from 0 to 10"):
        node.declare_parameter("late", 11, node.describe_parameter("count"))


def test_callbacks_reject_values(node):
    node.declare_parameters("", [("a", 1), ("b", 2)])

    def check(parameters):
        return ROS.msg.SetParametersResult(
            successful=all(each.value < 10 for each in parameters), reason="too large"
        )

    node.add_on_set_parameters_callback(check)
    result = node.set_parameters_atomically([Parameter("a", value=3), Parameter("b", value=30)])
    assert (result.successful, result.reason) == (False, "too large")
    assert node.get_parameter("a").value == 1
    assert node.set_parameters([Parameter("a", value=4)])[0].successful
    assert node.get_parameter("a").value == 4
    node.add_on_set_parameters_callback(lambda _: None)
    assert "SetParametersResult" in node.set_parameters([Parameter("a", value=1)])[0].reason


def test_callbacks_before_and_after_see_and_change_what_is_set(node):
    node.declare_parameters("", [("a", 1), ("b", 2)])
    calls = []

    def note(name, result):
        def call(parameters):
            calls.append((name, [(each.name, each.value) for each in parameters]))
            return result(parameters)

        return call

    double = note("pre", lambda known: [Parameter("b", value=2 * known[0].value), *known])
    after, empty = note("post", lambda _: None), note("empty", lambda _: [])
    node.add_post_set_parameters_callback(after)
    node.add_pre_set_parameters_callback(double)
    node.add_on_set_parameters_callback(
        note("on", lambda _: ROS.msg.SetParametersResult(successful=True))
    )
    assert node.set_parameters([Parameter("a", value=5)])[0].successful
    both = [("b", 10), ("a", 5)]
    assert calls == [("pre", [("a", 5)]), ("on", both), ("post", both)]
    assert [node.get_parameter(name).value for name in "ab"] == [5, 10]
    calls.clear()
    node.declare_parameter("c", 3)
    assert [name for name, _ in calls] == ["on", "post"]
    node.remove_pre_set_parameters_callback(double)
    node.add_pre_set_parameters_callback(empty)
    node.remove_post_set_parameters_callback(after)
    assert "no parameters" in node.set_parameters_atomically([Parameter("a", value=6)]).reason
    assert node.get_parameter("a").value == 5
    with pytest.raises(ValueError, match="not in list"):
        node.remove_on_set_parameters_callback(double)


# services


def test_other_nodes_read_and_set_parameters(node, ask):
    node.declare_parameters("arm", [("gain", 0.5), ("names", ["a", "b"]), ("left.offset", 1)])
    node.declare_parameter("fixed", 1, ROS.msg.ParameterDescriptor(read_only=True))
    names = ["arm.gain", "arm.names"]
    answer = ask("GetParameters", names=names)
    assert [parameter_value_to_python(value) for value in answer.values] == [0.5, ["a", "b"]]
    assert [*ask("GetParameterTypes", names=names).types] == [3, 9]
    assert ask("GetParameters", names=["arm.gain", "nope"]).values == []
    (descriptor,) = ask("DescribeParameters", names=["fixed"]).descriptors
    assert (descriptor.name, descriptor.type, descriptor.read_only) == ("fixed", 2, True)
    result = ask("ListParameters").result
    assert {*result.names} == {
        "use_sim_time", "arm.gain", "arm.names", "arm.left.offset", "fixed",
    }  # fmt: skip
    assert {*result.prefixes} == {"arm", "arm.left"}
    assert ask("ListParameters", prefixes=["arm.left"]).result.names == ["arm.left.offset"]
    assert {*ask("ListParameters", prefixes=["arm"], depth=1).result.names} == {*names}
    assert {*ask("ListParameters", depth=1).result.names} == {"use_sim_time", "fixed"}
    answer = ask(
        "SetParameters",
        parameters=[message("arm.gain", 0.75), message("fixed", 2), message("nope", 1)],
    )
    assert [each.successful for each in answer.results] == [True, False, False]
    assert "not declared" in answer.results[2].reason
    assert node.get_parameter("arm.gain").value == 0.75
    answer = ask(
        "SetParametersAtomically", parameters=[message("arm.gain", 1.0), message("fixed", 2)]
    )
    assert not answer.result.successful
    assert node.get_parameter("arm.gain").value == 0.75


def test_changes_are_published(node, address):
    events = []
    with node_at(address, "observer") as observer:
        observer.create_subscription(
            ROS.msg.ParameterEvent, "/parameter_events", events.append, qos_profile_parameter_events
        )
        spin_until(lambda: node.count_subscribers("/parameter_events"), node, observer)
        node.declare_parameter("a", 1, ROS.msg.ParameterDescriptor(dynamic_typing=True))
        node.set_parameters([Parameter("a", value="now a text")])
        spin_until(lambda: len(events) == 2, observer)
    new, changed = events
    assert new.node == "/ns/tuned"
    assert new.new_parameters == [message("a", 1)]
    assert changed.changed_parameters == [message("a", "now a text")]


def test_hostile_requests_end_in_answers(node):
    node.declare_parameters("", [("a", 1), ("b.c", "text")])
    source = random.Random(29)
    services = [each for each in node.endpoints if isinstance(each, Service)]
    services = [each for each in services if "parameter" in each.srv_name]
    assert len(services) == 6
    fields = {
        "GetParameters": {"names": ["a", "b.c"]},
        "SetParameters": {"parameters": [message("a", 2), message("b.c", "x")]},
        "SetParametersAtomically": {"parameters": [message("a", [1, 2])]},
        "ListParameters": {"prefixes": ["b"], "depth": 2},
    }
    ends = []
    for number in range(10_000):
        service = services[number % 6]
        kind = service.interface.kind.Request
        given = fields.get(service.interface.kind.__name__, {"names": ["a"]})
        data = bytearray(kind(**given).serialize())
        for _ in range(source.randint(1, 6)):
            data[source.randrange(len(data))] = source.choice((0, 1, 9, 77, 255))
        service._receive(
            SimpleNamespace(
                payload=bytes(data),
                attachment=number.to_bytes(8, "little") + bytes(8) + b"\x10" + bytes(16),
                reply=lambda *_: ends.append("reply"),
                drop=lambda: ends.append("drop"),
            )
        )
        if number % 60 == 59:
            spin_until(lambda: not any(service._queue for service in services), node)
    spin_until(lambda: len(ends) == 10_000, node)
    assert {*ends} == {"reply", "drop"}
    assert type(node.get_parameter("a").value) is int


# the command line


#: Values as the real rclpy 7.1 reads them after `-p`.
READ = {
    "1e3": 1000.0,
    "yes": True,
    "y": True,
    "Off": False,
    "010": 8,
    "08": 8.0,
    "0x1F": 31,
    "1:30": "1:30",
    "2020-01-01": "2020-01-01",
    "null": "null",
    "~": "~",
    "1_000": "1_000",
    "-.inf": float("-inf"),
    "infinity": float("inf"),
    "5.": 5.0,
    "+5": 5,
    "'5'": "5",
    '"true"': "true",
    "!!str 5": "5",
    "99999999999999999999": 1e20,
    "0o17": "0o17",
    "0b11": "0b11",
    "1e": "1e",
    "tRue": "tRue",
    "[1,2]": [1, 2],
    "[yes, no]": [True, False],
    "[a, b]": ["a", "b"],
    "abc def": "abc def",
}


def overrides(*words, node="/ns/tuned"):
    return {
        name: parameter.value
        for name, parameter in overrides_of(parse_arguments(["--ros-args", *words]), node).items()
    }


@pytest.mark.parametrize("text", READ)
def test_values_of_the_command_line_are_read_as_ros_reads_them(text):
    (value,) = overrides("-p", f"v:={text}").values()
    assert (value, type(value)) == (READ[text], type(READ[text]))


FILE = """\
/**:
  ros__parameters:
    a: 1
    group: {x: 1, deep: {y: two}}
/ns/tuned:
  ros__parameters:
    a: 2
other:
  ros__parameters:
    a: 3
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (FILE, {"a": 2, "group.x": 1, "group.deep.y": "two"}),
        ("ns: {tuned: {ros__parameters: {a: 5}}}", {"a": 5}),
        ("ns/tuned: {ros__parameters: {a: 6}}", {"a": 6}),
        ("/*/tuned: {ros__parameters: {a: 7}}", {"a": 7}),
        ("tuned: {ros__parameters: {a: 8}}", {}),
        ("/**/tuned: {ros__parameters: {a: 9}}", {"a": 9}),
        ("/**: {tuned: {ros__parameters: {a: 10}}}", {"a": 10}),
    ],
)
def test_files_set_parameters_of_the_nodes_that_they_name(tmp_path, text, expected):
    path = tmp_path / "p.yaml"
    path.write_text(text, encoding="utf-8")
    assert overrides("--params-file", str(path)) == expected
    assert overrides("-p", "a:=1", "--params-file", str(path))["a"] == 1


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("/**: {ros__parameters: {a: [1, 2.0]}}", "p.yaml:1:28: [1, 2.0] is not a bool"),
        ("/**: {ros__parameters: {a: [1, [2]]}}", "p.yaml:1:28: [1, [2]] is not a bool"),
        ("/**: {ros__parameters: {a: !!python/object:os.system x}}", "not tag:yaml.org,2002:py"),
        ("/**: {ros__parameters: 3}", "p.yaml:1:24: expected"),
        ("/**: {ros__parameters: {a: }}", "p.yaml:1:27: expected a value"),
        ("other: {ros__parameters: {a: [b, 2]}}", "p.yaml:1:30: ['b', 2] is not a bool"),
        ("/**:\n\tx", "p.yaml:2:1: "),
        ("[" * 100_000, "p.yaml:"),  # the depth that Python can follow differs
        ("", "p.yaml: expected"),
        ("/**: {ros__parameters: {a: &x 1, b: *x}}", "p.yaml:1:37: ROS 2 refuses aliases"),
        ("/**: {ros__parameters: {[a]: 1}}", "p.yaml:1:25: a name is missing"),
    ],
)
def test_files_with_mistakes_are_named_with_line_and_column(tmp_path, text, problem):
    path = tmp_path / "p.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RobotError) as error:
        overrides("--params-file", str(path))
    assert problem in str(error.value)


def test_an_argument_without_a_value_is_an_error():
    with pytest.raises(RobotError, match="expected a value"):
        overrides("-p", "a:=")


def test_a_missing_file_is_an_error(tmp_path):
    with pytest.raises(RobotError, match="No such file"):
        overrides("--params-file", str(tmp_path / "none.yaml"))


def test_overrides_replace_defaults(address):
    words = [
        "--ros-args",
        "-p",
        "gain:=0.75",
        "-p",
        "list:=[]",
        "-p",
        "typed:=0.5",
        "-p",
        "use_sim_time:=true",
    ]
    with node_at(address, "tuned", cli_args=words) as node:
        assert node.declare_parameter("gain", 0.5).value == 0.75
        assert node.declare_parameter("list", [0.5]).type_ is Type.DOUBLE_ARRAY
        assert node.declare_parameter("more", 1).value == 1
        with pytest.raises(parameters.InvalidParameterTypeException, match="INTEGER, not DOUBLE"):
            node.declare_parameter("typed", 1)
        assert node.get_clock().simulated is not None
        node.set_parameters([Parameter("use_sim_time", value=False)])
        assert node.get_clock().simulated is None
    with node_at(
        address,
        "all",
        parameter_overrides=[Parameter("x", value=1)],
        automatically_declare_parameters_from_overrides=True,
    ) as node:
        assert node.get_parameter("x").value == 1
        assert standard("rcl_interfaces/msg/ParameterValue").kind is type(
            node.get_parameter("x").get_parameter_value()
        )
