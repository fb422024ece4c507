"""Things that rclpy does with idlc's classes, each a function: behaviour.py NAME [ARGUMENT...]

The packages on PYTHONPATH are idlc's. A function fails by raising; it may print for the test.
"""

import array
import contextlib
import gc
import importlib
import json
import logging
import os
import random
import signal
import sys
import threading
import time
from pathlib import Path

import rclpy
import std_msgs.msg
from rclpy._rclpy_pybind11 import RCLError, RMWError
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import (
    ByteMultiArray,
    Float64MultiArray,
    Header,
    MultiArrayDimension,
    String,
    UInt8MultiArray,
)
from waiting import PATIENCE, eventually, join

NUMBERS = ["Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64",
           "UInt64"]  # fmt: skip
LATCHED = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def raises(kind, function, *arguments):
    """Return the exception that a call raises."""
    try:
        function(*arguments)
    except kind as error:
        return error
    raise AssertionError(f"{function} raised no {kind}")


def resident():
    """Return the resident memory in megabytes."""
    gc.collect()
    words = Path("/proc/self/statm").read_text("ascii").split()
    return int(words[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def plain(value):
    """Return a message without arrays of numbers as dictionaries and lists."""
    if isinstance(value, list):
        return [plain(item) for item in value]
    fields = getattr(value, "get_fields_and_field_types", dict)()
    return {name: plain(getattr(value, name)) for name in fields} or value


def assigned(cls, data):
    """Return a message whose wrong data were assigned, which nobody checks."""
    message = cls()
    message.data = data
    return message


def node_and_string():
    rclpy.init()
    node = rclpy.create_node("behaviour")
    return node, node.create_publisher(String, "topic", LATCHED)


def nothing_is_loaded_before_rclpy_asks():
    """The classes alone load neither ctypes nor the data of types."""
    assert "ctypes" not in sys.modules or "std_msgs._idlc.typesupport" not in sys.modules
    String("text").serialize()
    waiting = {
        f"std_msgs._idlc.{name}" for name in ("c", "introspection", "typeinfo", "typesupport")
    }
    assert not waiting & set(sys.modules)
    assert type(String)._TYPE_SUPPORT is None
    serialize_message(String("text"))
    assert type(String)._TYPE_SUPPORT is not None


def rclpy_accepts_the_classes():
    from rclpy.type_support import check_is_valid_msg_type, check_is_valid_srv_type
    from std_srvs.srv import SetBool

    check_is_valid_msg_type(Header)
    check_is_valid_srv_type(SetBool)
    message = Header(frame_id="map")
    message.stamp.sec = 5
    data = serialize_message(message)
    assert data == message.serialize()
    assert deserialize_message(data, Header) == message
    assert deserialize_message(message.serialize(byteorder="big"), Header) == message


def raw_latched_and_waited_for():
    from rclpy.wait_for_message import wait_for_message

    node, publisher = node_and_string()
    publisher.publish(String("latched"))
    publisher.publish(String("raw").serialize())
    raw, decoded = [], []
    node.create_subscription(String, "topic", raw.append, LATCHED, raw=True)
    node.create_subscription(String, "topic", decoded.append, LATCHED)
    eventually(lambda: len(raw) == len(decoded) == 2, node)
    assert [message.data for message in decoded] == ["latched", "raw"]
    # the middleware may add padding
    expected = [String("latched").serialize(), String("raw").serialize()]
    assert all(found.startswith(data) for found, data in zip(raw, expected, strict=True))
    found, message = wait_for_message(
        String, node, "topic", qos_profile=LATCHED, time_to_wait=PATIENCE
    )
    assert found
    assert message == String("latched")


def readers_take_raw_messages():
    import idlc

    node, publisher = node_and_string()
    publisher.publish(String("text"))
    header = node.create_publisher(Header, "header", LATCHED)
    plain = Header(frame_id="map").serialize()
    header.publish(idlc.patch(Header, plain, {"stamp": 5 * 10**9 + 7}))
    texts, headers = [], []
    node.create_subscription(String, "topic", texts.append, LATCHED, raw=True)
    node.create_subscription(Header, "header", headers.append, LATCHED, raw=True)
    eventually(lambda: texts and headers, node)
    assert idlc.reader(String, "data")(texts[0]) == "text"
    read = idlc.reader(Header, "stamp", "stamp.sec", "frame_id", nanoseconds=True)
    assert read(headers[0]) == (5 * 10**9 + 7, 5, "map")
    assert raises(ValueError, idlc.reader(Header, "frame_id"), headers[0][:14])


def wrong_values_raise_where_they_are_published():
    node, publisher = node_and_string()
    header = node.create_publisher(Header, "header", 1)
    wrong = Header()
    wrong.stamp.nanosec = -1
    error = raises(ValueError, header.publish, wrong)
    assert "stamp.nanosec" in str(error), error
    assert "4294967295" in str(error), error
    assert "data" in str(raises(ValueError, publisher.publish, assigned(String, 5)))
    assert "data" in str(raises(ValueError, serialize_message, assigned(String, None)))
    raises(TypeError, publisher.publish, header)
    array_of_bytes = assigned(ByteMultiArray, [b"ab"])
    assert "data" in str(raises(ValueError, serialize_message, array_of_bytes))
    received = []
    node.create_subscription(String, "topic", received.append, LATCHED)
    publisher.publish(String("right"))
    eventually(lambda: received, node)
    assert received == [String("right")]


def garbage_is_dropped():
    logging.disable()
    chance = random.Random(5)
    samples = [
        String("hello"),
        Header(frame_id="x" * 100),
        UInt8MultiArray(data=array.array("B", bytes(5000))),
    ]
    outcomes = {"message": 0, "error": 0}  # errors that say something
    for i in range(24_000):
        message = samples[i % len(samples)]
        data = bytearray(message.serialize())
        for _ in range(chance.randrange(1, 6)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        if i % 2:
            del data[chance.randrange(len(data) + 1) :]
        try:
            result = deserialize_message(bytes(data), type(message))
        except RMWError as error:
            outcomes["error"] += bool(str(error))
        else:
            assert type(result) is type(message)
            outcomes["message"] += 1
    assert min(outcomes.values()) > 1000, outcomes


def without_machine_code(name):
    """Do something where there is no machine code, which Fast DDS can do without."""
    c = importlib.import_module("std_msgs._idlc.c")
    c.CODE, c._executable = {}, None  # to call this would be an error
    globals()[name]()


def received_garbage_is_dropped():
    logging.disable()
    node, publisher = node_and_string()
    received = []
    node.create_subscription(String, "topic", received.append, LATCHED)
    publisher.publish(b"\0\1\0\0\xff\xff\xff\xffabc")
    publisher.publish(b"\7\7\7\7\1")
    publisher.publish(String("fine"))
    eventually(lambda: received, node)
    assert received == [String("fine")]


def large_arrays_of_every_type():
    """The second and later of large messages take a way of their own."""
    for kind in NUMBERS:
        cls = getattr(std_msgs.msg, f"{kind}MultiArray")
        for label in ("", "a", "ab", "abcdefg"):
            message = cls(data=[number % 100 for number in range(20_000 + len(label))])
            message.layout.dim.append(MultiArrayDimension(label=label))
            for _ in range(3):
                assert serialize_message(message) == message.serialize(), kind
            assert deserialize_message(serialize_message(message), cls) == message, kind


def arrays_that_another_thread_changes():
    """The bytes are of one moment; of a large array, the other thread may have to wait for it."""
    sys.setswitchinterval(1e-6)
    for cls, size in ((Float64MultiArray, 5), (Float64MultiArray, 5000), (UInt8MultiArray, 50_000)):
        message = cls(data=[1] * size)
        stop = threading.Event()

        def change(message=message, size=size, stop=stop):
            while not stop.is_set():
                with contextlib.suppress(BufferError):
                    message.data.append(1)
                    del message.data[size:]
                    message.data.pop()
                    message.data.append(1)

        thread = threading.Thread(target=change)
        thread.start()
        for _ in range(3000):
            data = serialize_message(message)
            found = deserialize_message(data, cls)
            assert abs(len(found.data) - size) <= 2
            assert found.serialize() == data
        stop.set()
        join(thread)


def memory_stays_flat(count):
    node, publisher = node_and_string()
    arrays = node.create_publisher(UInt8MultiArray, "arrays", 1)
    subscriptions = [
        node.create_subscription(String, "topic", [].append, 1),
        node.create_subscription(UInt8MultiArray, "arrays", [].append, 1),
    ]
    text, numbers = String("hello"), UInt8MultiArray(data=array.array("B", bytes(20_000)))
    wrong = assigned(String, 5)

    def work():
        for i in range(int(count) // 4):
            publisher.publish(text)
            if i % 4 == 0:
                arrays.publish(numbers)
                raises(ValueError, publisher.publish, wrong)
            for subscription, cls in zip(subscriptions, (String, UInt8MultiArray), strict=True):
                subscription.handle.take_message(cls, False)

    work()
    before = resident()
    for _ in range(3):
        work()
    assert resident() - before < 3, (before, resident())


def memory_stays_flat_in_services(count):
    """Also with what an action sends: an action consists of services and topics."""
    from std_srvs.srv import SetBool

    node, _ = node_and_string()
    service = node.create_service(SetBool, "service", print)
    client = node.create_client(SetBool, "service")
    assert client.wait_for_service(PATIENCE)

    def taken(take, kind, place):
        found = [None, None]
        while found[place] is None:
            found = take(kind)
        return found

    def work():
        for i in range(int(count) // 4):
            client.handle.send_request(SetBool.Request(data=bool(i % 2)))
            request, header = taken(service.handle.service_take_request, SetBool.Request, 1)
            service.send_response(SetBool.Response(message=f"{i} {request.data}"), header)
            _, response = taken(client.handle.take_response, SetBool.Response, 0)
            assert response.message == f"{i} {bool(i % 2)}", response

    work()
    before = resident()
    for _ in range(3):
        work()
    assert resident() - before < 3, (before, resident())


def many_threads():
    rclpy.init()
    node = rclpy.create_node("behaviour")
    executor = MultiThreadedExecutor(4)
    executor.add_node(node)
    group = rclpy.callback_groups.ReentrantCallbackGroup()
    received = {}
    publishers = []
    count, topics = 300, 6
    qos = QoSProfile(depth=count)

    def keep(topic, message):
        assert message.frame_id == f"{topic} {message.stamp.sec}", message
        received[topic].append(message.stamp.sec)

    for topic in map("topic_{}".format, range(topics)):
        received[topic] = []
        publishers.append((topic, node.create_publisher(Header, topic, qos)))
        node.create_subscription(
            Header, topic, lambda m, t=topic: keep(t, m), qos, callback_group=group
        )

    def publish(topic, publisher):
        for number in range(count):
            message = Header(frame_id=f"{topic} {number}")
            message.stamp.sec = number
            publisher.publish(message)

    threads = [threading.Thread(target=publish, args=pair) for pair in publishers]
    threads.append(threading.Thread(target=executor.spin))
    for thread in threads:
        thread.start()
    eventually(lambda: all(len(numbers) == count for numbers in received.values()))
    assert all(sorted(numbers) == list(range(count)) for numbers in received.values())
    executor.shutdown()
    join(*threads)


def ends_with_messages_pending():
    node, publisher = node_and_string()
    node.create_subscription(String, "topic", [].append, LATCHED)
    for _ in range(5):
        publisher.publish(String("pending"))
    # neither destroyed nor shut down


def spins_until_interrupted():
    node, publisher = node_and_string()
    node.create_subscription(String, "topic", publisher.publish, LATCHED)
    publisher.publish(String("round and round"))
    print("ready", flush=True)
    # rclpy's own handler takes the context away: spinning ends by itself, or in an exception
    # of whoever notices first, and an interrupt that came into a callback comes again later
    with contextlib.suppress(KeyboardInterrupt):
        try:
            rclpy.spin(node)
        except (ExternalShutdownException, RCLError):
            if rclpy.ok():
                raise
        time.sleep(0.5)
    print("ended", flush=True)


class Interrupts:
    """Runs `work` again and again until `seconds` are over, whatever interrupts it."""

    def __init__(self, work, seconds):
        self.work, self.end = work, time.monotonic() + seconds
        self.seen, self.others = 0, {}

    def run(self, depth=6):
        """Catch interrupts at several depths: one may come while another is handled."""
        while time.monotonic() < self.end:
            try:
                if depth:
                    self.run(depth - 1)
                else:
                    self.work()
            except KeyboardInterrupt:
                self.seen += 1
            except Exception as error:
                text = f"{type(error).__name__}: {error}"
                self.others[text] = self.others.get(text, 0) + 1


def survives_a_flood_of_interrupts(seconds):
    """Tell at the end how many interrupts were seen, and which other errors."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    node = rclpy.create_node("behaviour")
    text, numbers = String("hello"), UInt8MultiArray(data=array.array("B", bytes(50_000)))
    publishers = [
        node.create_publisher(String, "text", 5),
        node.create_publisher(UInt8MultiArray, "numbers", 5),
    ]
    received = []

    def check(message):
        assert message in (text, numbers), message
        received.append(1)

    node.create_subscription(String, "text", check, 5)
    node.create_subscription(UInt8MultiArray, "numbers", check, 5)
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)

    def work():
        publishers[0].publish(text)
        publishers[1].publish(numbers)
        assert deserialize_message(serialize_message(text), String) == text
        executor.spin_once(timeout_sec=0)

    interrupts = Interrupts(work, float(seconds))
    print("ready", flush=True)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    interrupts.run()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    print(interrupts.seen, len(received), interrupts.others, flush=True)
    # an executor may be in any state after this
    os._exit(0)


def tells_its_type_description():
    """Print what `~/get_type_description` answers about std_msgs/msg/Header."""
    from type_description_interfaces.srv import GetTypeDescription

    node, _ = node_and_string()
    node.create_publisher(Header, "header", 1)
    client = node.create_client(GetTypeDescription, "behaviour/get_type_description")
    assert client.wait_for_service(PATIENCE)
    (info,) = node.get_publishers_info_by_topic("/header")
    request = GetTypeDescription.Request(
        type_name="std_msgs/msg/Header",
        type_hash=str(info.topic_type_hash),
        include_type_sources=True,
    )
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE)
    print(json.dumps(plain(future.result())))


def serves_without_events():
    """Call a service where ROS 2 has no package that its events need, as Humble."""
    from std_srvs.srv import SetBool

    def answer(request, response):
        response.success, response.message = request.data, "done"
        return response

    node, _ = node_and_string()
    # rclpy's own services need it before
    importlib.import_module("std_srvs._idlc.typesupport").has_hashes = lambda: False
    sys.modules["service_msgs"] = sys.modules["service_msgs.msg"] = None
    node.create_service(SetBool, "service", answer)
    client = node.create_client(SetBool, "service")
    assert client.wait_for_service(PATIENCE)
    future = client.call_async(SetBool.Request(data=True))
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE)
    assert future.result() == SetBool.Response(success=True, message="done")


def says_what_to_do(case):
    """Print the error of a surrounding that type support cannot work in."""
    utilities = importlib.import_module("rclpy.utilities")
    fastrtps = importlib.import_module("std_msgs._idlc.fastrtps")
    introspection = importlib.import_module("std_msgs._idlc.introspection")
    c = importlib.import_module("std_msgs._idlc.c")
    if case in {"machine", "memory"}:
        utilities.get_rmw_implementation_identifier = lambda: "rmw_cyclonedds_cpp"
    if case == "machine":
        c.CODE = {}
    elif case == "memory":
        c._MAP_PRIVATE = 0  # the system refuses this, too
    elif case == "middleware":
        utilities.get_rmw_implementation_identifier = lambda: "rmw_connextdds"
    elif case == "layout":
        fastrtps._find = lambda *_: None
    elif case == "symbol":
        for names, (_, *others) in fastrtps._VERSIONS.items():
            fastrtps._VERSIONS[names] = ("no_such_symbol", *others)
    elif case == "fast cdr":
        del fastrtps._VERSIONS[next(iter(fastrtps._VERSIONS))]
    elif case == "tables":
        importlib.import_module("std_msgs._idlc.introspection")._TABLES = ((40, 128, 33),)
    elif case == "library":
        introspection.IDENTIFIER = "rosidl_typesupport_elsewhere_c"
    print(raises(ImportError, serialize_message, String("text")))


def acts_without_a_class_of_rosidls():
    """Act, describe a type and change a managed node's state, all packages being idlc's."""
    action_msgs, lifecycle_msgs = map(importlib.import_module, ("action_msgs", "lifecycle_msgs"))
    from rclpy.action import ActionClient, ActionServer, CancelResponse
    from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
    from trip.action import Go

    assert all(hasattr(package, "_idlc") for package in (action_msgs, lifecycle_msgs))

    def execute(goal):
        goal.publish_feedback(Go.Feedback(at=7))
        if goal.request.far:
            eventually(lambda: goal.is_cancel_requested)
        (goal.canceled if goal.is_cancel_requested else goal.succeed)()
        return Go.Result(done=not goal.request.far)

    rclpy.init()
    node = rclpy.create_node("traveller")
    seen = []
    server = ActionServer(node, Go, "go", execute, cancel_callback=lambda _: CancelResponse.ACCEPT)
    client = ActionClient(node, Go, "go")
    managed = LifecycleNode("managed")
    managed.on_configure = lambda _: TransitionCallbackReturn.SUCCESS
    executor = MultiThreadedExecutor(4)
    for one in (node, managed):
        executor.add_node(one)

    def result(future):
        executor.spin_until_future_complete(future, PATIENCE)
        return future.result()

    assert client.wait_for_server(PATIENCE)
    for far in (False, True):
        goal = result(client.send_goal_async(Go.Goal(far=far), lambda m: seen.append(m.feedback)))
        assert goal.accepted
        if far:
            assert len(result(goal.cancel_goal_async()).goals_canceling) == 1
        answer = result(goal.get_result_async())
        assert (answer.result, answer.status) == (Go.Result(done=not far), 5 if far else 4)
    assert seen == [Go.Feedback(at=7)] * 2
    change = node.create_client(lifecycle_msgs.srv.ChangeState, "managed/change_state")
    events = []
    node.create_subscription(
        lifecycle_msgs.msg.TransitionEvent, "managed/transition_event", events.append, 5
    )
    assert change.wait_for_service(PATIENCE)
    request = change.srv_type.Request()
    request.transition.id = lifecycle_msgs.msg.Transition.TRANSITION_CONFIGURE
    assert result(change.call_async(request)).success
    eventually(lambda: executor.spin_once(0.1) or events)
    assert events[-1].goal_state.label
    executor.shutdown()
    server.destroy()


def uses_the_extension():
    """Print whether the package's own extension module converts."""
    package = importlib.import_module("std_msgs.std_msgs_s__rosidl_typesupport_c")
    for cls, suffix in ((String, "string"), (Header, "header")):
        message = cls()
        assert deserialize_message(serialize_message(message), cls) == message
        extension = getattr(package, f"convert_from_py_msg__msg__{suffix}")
        print(suffix, type(cls)._CONVERT_FROM_PY is extension)


if __name__ == "__main__":
    name, *arguments = sys.argv[1:]
    globals()[name](*arguments)
