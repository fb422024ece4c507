"""`python -m idlc.robot`: nodes of rclpy, unchanged, where there is no rclpy."""

import ast
import os
import shlex
import shutil
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import idlc
from idlc.cli.main import main
from idlc.robot.offer import OFFERED
from tests.robot.conftest import environ_of
from tests.robot.nodes import LONG, node_at
from tests.support.paths import EXAMPLE, GOLDEN, ROOT
from tests.support.waiting import WORK, wait_for

#: The installed packages that idlc uses here; the environment may have ROS 2's as well.
USED = "_yaml click jinja2 lark markupsafe msgspec numpy typing_extensions xxhash yaml zenoh"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder of packages without those of ROS 2."""
    folder = tmp_path_factory.mktemp("site")
    for name in USED.split():
        spec = find_spec(name)
        if spec is None or spec.origin is None:
            continue
        origin = Path(spec.origin)
        source = origin.parent if origin.name == "__init__.py" else origin
        provide(source, folder)
        if (libraries := source.parent / f"{name}.libs").is_dir():
            provide(libraries, folder)
    return folder


def provide(source, folder):
    """Link to a file or folder, or copy it where links need a right of their own."""
    try:
        (folder / source.name).symlink_to(source)
    except OSError:
        copy = shutil.copytree if source.is_dir() else shutil.copy
        copy(source, folder / source.name)


class Program:
    """A program in its own process, which ends with the test."""

    def __init__(self, log, words, cwd, environment):
        self._log = log
        command = [sys.executable, "-S", "-u", "-m", "idlc.robot", *map(str, words)]
        with log.open("w") as output:
            self.process = subprocess.Popen(
                command, cwd=cwd, env=environment, stdout=output, stderr=subprocess.STDOUT
            )

    @property
    def output(self):
        return self._log.read_text(encoding="utf-8")

    def until(self, text, times=1):
        """Wait until the program has printed a text this many times."""

        def is_printed():
            assert self.process.poll() is None, self.output
            return self.output.count(text) >= times

        wait_for(is_printed, lambda: f"`{text}` in:\n{self.output}")

    def ends(self):
        return self.process.wait(LONG)


@pytest.fixture
def start(site, address, tmp_path):
    """Return a function that starts a program in the example's folder."""
    programs = []
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(site), str(ROOT)]),
        **environ_of(address),
    }

    def started(*words, cwd=EXAMPLE):
        log = tmp_path / f"{len(programs)}.log"
        programs.append(Program(log, words, cwd, environment))
        return programs[-1]

    yield started
    for program in programs:
        program.process.kill()
        program.process.wait(LONG)


def file(name):
    return f"my_robot_controller/{name}.py"


@pytest.mark.parametrize("address", ["dds"], indirect=True)
def test_the_demo(start):
    """`make demo ROS=no` but for its environment."""
    demo = start(ROOT / "examples/demo.py")
    assert demo.process.wait(WORK) == 0, demo.output
    assert demo.output.splitlines()[-1].startswith("All of it agreed"), demo.output
    assert "Traceback" not in demo.output


def test_publisher_and_subscriber(start):
    subscriber = start(file("sensor_subscriber"))
    publisher = start(file("sensor_publisher"))
    subscriber.until("Temperature: 25.5C", 2)
    for program, number in ((subscriber, signal.SIGINT), (publisher, signal.SIGTERM)):
        program.process.send_signal(number)
        assert program.ends() == 0, program.output
        assert "Traceback" not in program.output


def test_service_and_client(start):
    start(file("add_two_ints_server"))
    client = start(file("add_two_ints_client"), "20", "22")
    assert client.ends() == 0, client.output
    assert "42 = 20 + 22" in client.output


def test_action_with_feedback(start):
    server = start("-m", "my_robot_controller.countdown_action_server")
    client = start(file("countdown_action_client"), "2")
    assert client.ends() == 0, client.output
    assert client.output.count("feedback.current_count=") == 2
    assert "success=True" in client.output
    server.until("countdown: done")


def test_action_that_is_cancelled_and_one_that_is_rejected(start):
    server = start(file("execute_task_server"))
    client = start(file("execute_task_client"), "--server-timeout", LONG)
    client.until("feedback.current_status=")
    client.process.send_signal(signal.SIGINT)
    assert client.ends() == 130, client.output
    server.until("execute_task: cancelled")
    client = start(file("execute_task_client"), "", "--server-timeout", LONG)
    assert client.ends() == 1, client.output
    assert "the goal was rejected" in client.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_client_that_is_ended_while_it_waits(start, number):
    for name in ("add_two_ints_client", "countdown_action_client"):
        client = start(file(name))
        client.until("waiting for a server")
        client.process.send_signal(number)
        assert client.ends() == 0, client.output
        assert "Traceback" not in client.output


TUNED = """\
import rclpy
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.node import Node

rclpy.init()
node = Node("tuned")
node.add_on_set_parameters_callback(lambda _: SetParametersResult(successful=True))
value = node.declare_parameter("gain", 0.5, ParameterDescriptor(description="x")).value
print("gain", value, node.get_name())
node.destroy_node()
rclpy.shutdown()
"""


def test_parameters_of_the_command_line(start, tmp_path):
    (tmp_path / "tuned.py").write_text(TUNED, encoding="utf-8")
    program = start("tuned.py", "--ros-args", "-p", "gain:=2.5", cwd=tmp_path)
    assert program.ends() == 0, program.output
    assert program.output == "gain 2.5 tuned\n"


#: A node of each kind that ROS 2's examples have, in one program; it prints what rclpy lets it.
KINDS = """\
import sys
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.event_handler import (
    PublisherEventCallbacks, QoSPublisherMatchedInfo, SubscriptionEventCallbacks
)
from rclpy.executors import MultiThreadedExecutor
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.lifecycle import Node, Publisher, State, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos_overriding_options import QosCallbackResult, QoSOverridingOptions
from std_msgs.msg import String


def print(*words):
    # lines of several threads stay whole
    sys.stdout.write(" ".join(map(str, words)) + "\\n")


class Managed(Node):
    def on_configure(self, state: State) -> TransitionCallbackReturn:
        print("configuring from", state.label)
        accept = lambda qos: QosCallbackResult(successful=qos.depth == 7)
        self.words: Publisher = self.create_lifecycle_publisher(
            String, "words", 10, event_callbacks=PublisherEventCallbacks(matched=self.match),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(callback=accept),
        )
        return super().on_configure(state)

    def match(self, info: QoSPublisherMatchedInfo):
        print("matched", info.current_count)


rclpy.init()
node = Managed("managed", enable_logger_service=True)
heard, raw = [], []
executor = MultiThreadedExecutor()
executor.add_node(node)
node.trigger_configure()
node.words.publish(String(data="nobody hears this"))
group = MutuallyExclusiveCallbackGroup()
node.create_subscription(String, "words", heard.append, 10, callback_group=group,
                         event_callbacks=SubscriptionEventCallbacks(message_lost=print))
node.create_subscription(String, "words", raw.append, 10, raw=True)
while node.words.get_subscription_count() < 2:
    executor.spin_once(0.05)
node.trigger_activate()
node.declare_parameter("gain", 1)
node.add_pre_set_parameters_callback(lambda known: [*known, Parameter("gain", value=3)])
node.add_post_set_parameters_callback(lambda known: print("set", [each.value for each in known]))
node.set_parameters([Parameter("gain", value=2)])
condition = node.create_guard_condition(lambda: print("triggered"))
condition.trigger()
node.words.publish(String(data="hello"))
node.get_logger().set_level(LoggingSeverity.ERROR)
end = time.monotonic() + 30
while not (heard and raw) and time.monotonic() < end:
    executor.spin_once(0.05)
for _ in range(20):
    executor.spin_once(0.01)
print(heard[0].data, raw[0][-6:], node.trigger_shutdown().name)
executor.shutdown()
rclpy.shutdown()
"""


CUSTOM = """\
import sys
from concurrent.futures import ThreadPoolExecutor

import rclpy
from rclpy.callback_groups import CallbackGroup
from rclpy.executors import Executor, ShutdownException, TimeoutException
from rclpy.parameter import Parameter, parameter_dict_from_yaml_file, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient


class Pool(Executor):
    def __init__(self):
        super().__init__()
        self.pool, self.ran = ThreadPoolExecutor(), []

    def spin_once(self, timeout_sec=None):
        try:
            handler, entity, node = self.wait_for_ready_callbacks(timeout_sec=timeout_sec)
        except (TimeoutException, ShutdownException) as error:
            self.ran.append(type(error).__name__)
            return
        self.ran.append(node.get_name())
        self.pool.submit(handler).result()
        if handler.exception() is not None:
            raise handler.exception()


class Bucket(CallbackGroup):
    tokens = ended = 2

    def beginning_execution(self, entity):
        self.tokens -= self.tokens > 0
        return self.tokens > 0

    def ending_execution(self, entity):
        self.ended += 1


def fail():
    raise ValueError("a callback failed")


rclpy.init()
node = rclpy.create_node("blackboard", allow_undeclared_parameters=True)
other = rclpy.create_node("asks")
executor = Pool()
executor.spin_once(timeout_sec=0)
executor.add_node(node)
executor.add_node(other)
client = AsyncParameterClient(other, "blackboard")
assert client.wait_for_services(30.0)
answered = []


def ask(future, name):
    executor.spin_until_future_complete(future, 30)
    return getattr(future.result(), name)


two = [Parameter("gain", value=3), Parameter("name", value="x")]
results = ask(client.set_parameters(two, answered.append), "results")
print([each.successful for each in results])
print(ask(client.load_parameter_file(sys.argv[1]), "results")[0].successful, sys.argv[1])
print(ask(client.set_parameters_atomically([Parameter("gain", value=4)]), "result").successful)
values = ask(client.get_parameters(["gain", "name", "rate"]), "values")
print([parameter_value_to_python(each) for each in values])
print(list(ask(client.get_parameter_types(["gain", "name"]), "types")))
print([each.name for each in ask(client.describe_parameters(["gain"]), "descriptors")])
print(sorted(ask(client.list_parameters(["gain", "deep"], 1), "result").names))
print(ask(client.delete_parameters(["name"]), "results")[0].successful, len(answered))
print(sorted(parameter_dict_from_yaml_file(sys.argv[1], True, ["/other"], "ns")))
group, calls = Bucket(), []
timer = node.create_timer(0.001, lambda: calls.append(1), callback_group=group)
while group.tokens:
    executor.spin_once(timeout_sec=1)
for _ in range(3):
    executor.spin_once(timeout_sec=0.01)
print(len(calls), group.ended, {*executor.ran} == {"blackboard", "TimeoutException"})
group.tokens = 3
node.create_guard_condition(lambda: None).trigger()
executor.spin_once()
executor.spin_once()
print(len(calls))
timer.cancel()
node.create_guard_condition(fail).trigger()
try:
    executor.spin_once()
except ValueError as error:
    print(error)
executor.shutdown()
executor.spin_once()
print(executor.ran[-1])
rclpy.shutdown()
"""
FILE = "/**: {ros__parameters: {any: 1}}\n/other: {ros__parameters: {rate: 2.5, deep: {er: y}}}\n"


def test_executors_groups_and_parameter_clients_of_programs(start, tmp_path):
    (tmp_path / "custom.py").write_text(CUSTOM, encoding="utf-8")
    (tmp_path / "file.yaml").write_text(FILE, encoding="utf-8")
    program = start("custom.py", "file.yaml", cwd=tmp_path)
    assert program.ends() == 0, program.output
    assert program.output.splitlines() == [
        "[True, True]",
        "True file.yaml",
        "True",
        "[4, 'x', 2.5]",
        "[2, 4]",
        "['gain']",
        "['deep.er', 'gain']",
        "True 1",
        "['ns.any', 'ns.deep.er', 'ns.rate']",
        "1 3 True",
        "2",
        "a callback failed",
        "ShutdownException",
    ]


def test_nodes_of_each_kind_of_the_examples(start, tmp_path):
    (tmp_path / "kinds.py").write_text(KINDS, encoding="utf-8")
    override = "qos_overrides./words.publisher.depth:=7"
    program = start("kinds.py", "--ros-args", "-p", override, cwd=tmp_path)
    assert program.ends() == 0, program.output
    # threads print the callbacks of one group in order, but not those of several
    lines = program.output.splitlines()
    assert lines[0] == "configuring from unconfigured"
    assert {"matched 2", "set [2, 3]", "triggered"} <= {*lines}
    assert lines[-1] == r"hello b'hello\x00' SUCCESS"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("import rclpy.waitable", "rclpy.waitable"),
        ("from rclpy.node import HIDDEN_NODE_PREFIX", "rclpy.node.HIDDEN_NODE_PREFIX"),
        ("import rclpy; rclpy.get_rmw_implementation_identifier()", "rclpy.get_rmw_impl"),
    ],
)
def test_other_names_of_rclpy_are_named(start, tmp_path, text, name):
    (tmp_path / "node.py").write_text(text, encoding="utf-8")
    program = start("node.py", cwd=tmp_path)
    assert program.ends() == 1
    last = program.output.splitlines()[-1]
    assert f"idlc does not offer `{name}" in last
    assert "docs/robot-nodes.md" in last


def test_it_refuses_where_rclpy_can_be_imported(start, tmp_path):
    (tmp_path / "rclpy.py").write_text("", encoding="utf-8")
    (tmp_path / "node.py").write_text("print('ran')", encoding="utf-8")
    program = start("node.py", cwd=tmp_path)
    assert program.ends() == 2
    assert "error: rclpy is installed" in program.output
    assert "ran" not in program.output


#: Words of a command line, and the hint.
MISTAKES = {
    "": "write `python -m idlc.robot my_node.py`",
    "--unknown": "write `python -m idlc.robot my_node.py`",
    "none.py": "name a node's .py file",
    "talkr.py": "did you mean `talker.py`?",
    "-m talker.py": "write `python -m idlc.robot talker.py`",
    "-m talkr": "change to the folder that contains it, or name its .py file",
    "-m bot.talkr": "change to the folder that contains it, or name its .py file",
    "-m none.talker": "change to the folder that contains it, or name its .py file",
}


@pytest.mark.parametrize("words", MISTAKES)
def test_mistakes_on_the_command_line_are_errors(start, words, tmp_path):
    (tmp_path / "talker.py").write_text("raise SystemExit('ran')", encoding="utf-8")
    (tmp_path / "bot").mkdir()
    (tmp_path / "bot" / "__init__.py").write_text("", encoding="utf-8")
    program = start(*words.split(), cwd=tmp_path)
    assert program.ends() == 2
    first, second = program.output.splitlines()
    assert first.startswith("error: ")
    assert second == f"  = hint: {MISTAKES[words]}"


def test_a_package_that_cannot_import_another_shows_its_own_error(start, tmp_path):
    (tmp_path / "bot").mkdir()
    (tmp_path / "bot" / "__init__.py").write_text("import none.other", encoding="utf-8")
    program = start("-m", "bot.talker", cwd=tmp_path)
    assert program.ends() == 1
    assert "No module named 'none'" in program.output


NAMES = """\
import sys
from importlib import import_module

from idlc.robot.offer import OFFERED

for module, names in OFFERED.items():
    for name in names.split():
        value = getattr(import_module(module), name)
        home = import_module(getattr(value, "__module__", "idlc.robot.qos"))
        assert home.__name__.startswith("idlc.robot."), (module, name)
        assert value in vars(home).values(), (module, name)
    print(module)
"""


def test_each_offered_name_is_one_of_idlc(start, tmp_path):
    (tmp_path / "node.py").write_text(NAMES, encoding="utf-8")
    program = start("node.py", cwd=tmp_path)
    assert program.ends() == 0, program.output
    assert program.output.split() == [*OFFERED]


def test_modules_are_attributes_of_their_packages(start, tmp_path):
    text = "import rclpy\nprint(rclpy.qos.QoSProfile.__name__, rclpy.action.client.__name__)"
    (tmp_path / "node.py").write_text(text, encoding="utf-8")
    program = start("node.py", cwd=tmp_path)
    assert program.ends() == 0, program.output
    assert program.output == "QoSProfile rclpy.action.client\n"


def test_the_page_lists_the_names():
    page = (ROOT / "docs/robot-nodes.md").read_text(encoding="utf-8")
    for module, names in OFFERED.items():
        words = ", ".join(f"`{name}`" for name in sorted(names.split()))
        assert not words or f"| `{module}` | {words} |" in page


def test_scaffolded_nodes_use_only_offered_names():
    used = set()
    for path in (ROOT / "golden").rglob("*.py"):
        if "/test/" in path.as_posix():
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and f"{node.module}.".startswith("rclpy."):
                used |= {(node.module, alias.name) for alias in node.names}
    offered = {(module, name) for module, names in OFFERED.items() for name in names.split()}
    assert ("rclpy.lifecycle", "LifecycleNode") in used
    assert used <= offered


# what `idlc scaffold` writes

SCAFFOLDED = """
idlc scaffold node listener --subscriber Command:command --qos latched
idlc scaffold node writer --publisher std_msgs/String:words@20
idlc gen
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A package with a node of each kind, except lifecycle nodes."""
    folder = tmp_path_factory.mktemp("scaffolded")
    commands = (GOLDEN / "scaffold/nodes/commands").read_text(encoding="utf-8") + SCAFFOLDED
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for line in commands.split("\n"):
            program, *words = shlex.split(line) or ["cd", "."]
            if program == "cd":
                patch.chdir(words[0])
            else:
                assert main(words) == 0, line
    return folder / "demo"


@pytest.mark.long
def test_scaffolded_publishers_subscribers_timers_and_parameters(start, package):
    talker = start("demo/talker.py", cwd=package)
    talker.until("[talker]: tick", 2)
    listener = start("demo/listener.py", cwd=package)
    listener.until("command: message.command='stop'")
    ros = ["--ros-args", "-r", "words:=/talker/words", "-r", "__node:=poet"]
    start("-m", "demo.writer", *ros, cwd=package)
    talker.until("~/words: message.data='hello'")
    for program in (talker, listener):
        program.process.send_signal(signal.SIGINT)
        assert program.ends() == 0, program.output
        assert "Traceback" not in program.output


@pytest.mark.long
def test_scaffolded_parameters_are_set_from_outside(start, package, address):
    talker = start("demo/talker.py", "--ros-args", "-p", "speed:=2.5", cwd=package)
    kind = idlc.load("rcl_interfaces/srv/GetParameters").GetParameters
    with node_at(address, "observer") as node:
        client = node.create_client(kind, "/talker/get_parameters")
        assert client.wait_for_service(timeout_sec=LONG), talker.output
        response = client.call(kind.Request(names=["speed", "names"]), LONG)
        assert [each.double_value for each in response.values] == [2.5, 0.0]
        assert [*response.values[1].string_array_value] == ["a", "b"]


@pytest.mark.long
def test_scaffolded_services_and_actions(start, package):
    oracle, station = (start(f"demo/{name}.py", cwd=package) for name in ("oracle", "station"))
    timeout = ("--server-timeout", LONG)
    asker = start("demo/asker.py", "why", "--loud", *timeout, cwd=package)
    assert asker.ends() == 0, asker.output
    assert "ask: response.answer=" in asker.output
    oracle.until("ask: request.question='why'")
    both = start("demo/both.py", "--dock-station", "3", *timeout, cwd=package)
    assert both.ends() == 0, both.output
    assert both.output.count("dock: feedback.distance=") == 5
    assert "dock: result.docked=False" in both.output
    station.until("dock: done")
    ship = start("demo/ship.py", *timeout, cwd=package)
    ship.until("dock: feedback.distance=")
    ship.process.send_signal(signal.SIGTERM)
    assert ship.ends() == 130, ship.output
    station.until("dock: cancelled")
