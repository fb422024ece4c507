"""Sessions with a router and with each other, on loopback, over the real Zenoh."""

import queue
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.project.words import is_address
from idlc.robot.errors import RobotError
from idlc.robot.keys import Entity, EntityKind, pack_attachment
from idlc.robot.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from idlc.robot.session import open_router, open_session
from tests.robot.conftest import free_endpoint, start_router
from tests.robot.nodes import Keyed, pass_on
from tests.support.waiting import LIMIT as LONG
from tests.support.waiting import read_line, wait_for

pytest.importorskip("zenoh", reason="eclipse-zenoh has no wheel for this platform")
LATCHED = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def opened(*addresses, **options):
    return open_session(*addresses, **{"environ": {}, "timeout": LONG, **options})


def entity(session, kind=EntityKind.PUBLISHER, **more):
    words = {} if kind is EntityKind.NODE else {"name": "/chatter", "type": "std_msgs/msg/String"}
    return Entity(
        domain=session.domain,
        session=session.id,
        node_id=0,
        id=session.next_id(),
        kind=kind,
        node="talker",
        **words,
        **more,
    )


@pytest.fixture
def sessions(router):
    with opened(router) as left, opened(router) as right:
        yield left, right


def test_nodes_and_endpoints_appear_in_the_other_graph_and_go(sessions):
    left, right = sessions
    node, early, late = entity(left, EntityKind.NODE), entity(left), entity(left)
    for each in (node, early):
        left.transport.announce(each)
    assert right.graph.wait_for(lambda graph: len(graph.entities()) == 2, LONG)
    assert {*right.graph.entities()} == {node, early}
    declaration = left.transport.announce(late)
    assert right.graph.wait_for(
        lambda graph: graph.count(EntityKind.PUBLISHER, "/chatter") == 2, LONG
    )
    declaration.close()
    declaration.close()
    assert right.graph.wait_for(
        lambda graph: graph.count(EntityKind.PUBLISHER, "/chatter") == 1, LONG
    )
    assert right.graph is right.graph
    left.close()
    left.close()
    assert right.graph.wait_for(lambda graph: not graph.entities(), LONG)


def test_malformed_tokens_are_in_no_graph(sessions):
    left, right = sessions
    for rest in ("x", "x/y/MP", "f1/0/0/NN/%/%/no node"):
        left.transport._liveliness.declare_token(f"@ros2_lv/{left.domain}/{rest}")
    last = entity(left)
    left.transport.announce(last)
    assert right.graph.wait_for(lambda graph: graph.entities() == (last,), LONG)
    # for a moment, Zenoh answers with nothing
    wait_for(lambda: [*right.transport.entities(right.domain, LONG)] == [last])


def test_a_session_that_knows_many_tokens_answers_its_own_question(sessions):
    left, right = sessions
    for _ in range(600):
        left.transport.announce(entity(left))
    assert right.graph.wait_for(lambda graph: len(graph.entities()) == 600, LONG)
    known = {*right.graph.entities()}
    # for a moment, Zenoh answers with nothing
    wait_for(lambda: {*right.transport.entities(right.domain, LONG)} == known)


@pytest.mark.parametrize("method", ["announce", "close", "watch", "call"])
def test_ctrl_c_in_a_callback_of_the_main_thread_is_not_lost(sessions, method):
    """Zenoh prints exceptions of callbacks, and goes on."""
    session, _ = sessions
    transport, domain = session.transport, session.domain
    begun, ended = threading.Event(), threading.Event()

    def interrupted(*_):
        if not begun.is_set():
            begun.set()
            signal.raise_signal(signal.SIGINT)
            ended.set()

    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 - at the end, or where a thread hits it
        token = transport.announce(entity(session))
        if method == "call":
            transport.service(Keyed("0/a"), lambda request: (interrupted(), request.drop()))
            transport.call(Keyed("0/a"), b"", b"", lambda _: None, timeout=LONG)
        elif method == "watch":
            transport.watch(domain, interrupted)
        else:
            watched = []
            transport.watch(domain, lambda *_: watched and interrupted())
            watched.append(True)
            transport.announce(entity(session)) if method == "announce" else token.close()
        time.sleep(LONG)
    assert ended.wait(LONG)


def test_a_session_sees_itself_and_no_other_domain(sessions):
    left, right = sessions
    left.transport.announce(entity(left, EntityKind.NODE))
    assert left.graph.wait_for(lambda graph: graph.entities(), LONG)
    right.domain = 7
    other = entity(right, EntityKind.NODE)
    right.transport.announce(other)
    assert right.graph.wait_for(lambda graph: graph.entities(), LONG) == (other,)


@pytest.mark.parametrize("reliability", ["RELIABLE", "BEST_EFFORT"])
@pytest.mark.parametrize("first", ["publisher", "subscriber"])
def test_latched_messages_reach_late_ends(sessions, first, reliability):
    left, right = sessions
    profile = QoSProfile(
        depth=2,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
        reliability=ReliabilityPolicy[reliability],
    )
    received = queue.SimpleQueue()
    if first == "subscriber":
        right.transport.subscriber(Keyed("0/a", profile), received.put)
    publisher = left.transport.publisher(Keyed("0/a", profile))
    for number in range(5):
        publisher.put(b"%d" % number, attachment=pack_attachment(number + 1, 2, bytes(16)))
    if first == "publisher":
        # messages that the router passes on are no longer on their way to it
        pass_on(left, right)
        right.transport.subscriber(Keyed("0/a", profile), received.put)
    payloads = [b""]
    while payloads[-1] != b"4":
        sample = received.get(timeout=LONG)
        assert sample.attachment == pack_attachment(int(sample.payload) + 1, 2, bytes(16))
        payloads.append(sample.payload)
    assert payloads[-2:] == [b"3", b"4"]
    assert first == "subscriber" or len(payloads) == 3
    publisher.close()
    publisher.close()
    with pytest.raises(RuntimeError, match="the publisher is closed"):
        publisher.put(b"", attachment=b"")
    pass_on(left, right)
    late = queue.SimpleQueue()
    right.transport.subscriber(Keyed("0/a", profile), late.put)
    pass_on(left, right)
    assert late.empty()  # the cache is gone, too


def test_volatile_messages_reach_those_that_are_there(sessions):
    left, right = sessions
    profile = QoSProfile(depth=1)
    received, local = queue.SimpleQueue(), queue.SimpleQueue()
    right.transport.subscriber(Keyed("0/a/*", profile), received.put)
    left.transport.subscriber(Keyed("0/a/*", profile), local.put)
    publisher = left.transport.publisher(Keyed("0/a/b", profile))
    sample = None
    while sample is None:  # the declaration of a subscriber takes a moment to arrive
        publisher.put(b"from left", attachment=b"")
        with suppress(queue.Empty):
            sample = received.get(timeout=0.1)
    assert sample == (b"from left", b"")
    assert local.get(timeout=LONG) == sample


def test_a_service_answers_at_once_or_later_or_not_at_all(sessions):
    left, right = sessions
    held = queue.SimpleQueue()

    def answer(request):
        if request.payload == b"drop":
            request.drop()
        elif request.payload == b"later":
            held.put(request)
        else:
            request.reply(request.payload + b"!", request.attachment)

    service = right.transport.service(Keyed("0/add"), answer)

    def call(payload, key="0/add"):
        replies = queue.SimpleQueue()
        left.transport.call(Keyed(key), payload, b"attached", replies.put, timeout=LONG)
        if payload == b"later":
            request = held.get(timeout=LONG)
            threading.Thread(target=request.reply, args=(b"done", request.attachment)).start()
        return [*iter(lambda: replies.get(timeout=LONG), None)]

    replies = []
    while not replies:  # the declaration of a service takes a moment to arrive
        replies = call(b"hi")
    assert replies == [(b"hi!", b"attached")]
    assert call(b"later") == [(b"done", b"attached")]
    assert call(b"drop") == []
    assert call(b"hi", "0/nobody") == []
    service.close()
    service.close()


def test_a_call_ends_after_its_timeout(sessions):
    left, right = sessions
    requests, replies = queue.SimpleQueue(), queue.SimpleQueue()
    right.transport.service(Keyed("0/slow"), requests.put)
    while requests.empty():
        left.transport.call(Keyed("0/slow"), b"hi", b"", replies.put, timeout=1)
        assert replies.get(timeout=LONG) is None


def test_peers_need_no_router():
    endpoint = free_endpoint()
    override = f'connect/endpoints=["{free_endpoint()}"];listen/endpoints=["{endpoint}"]'
    alone = {"ZENOH_CONFIG_OVERRIDE": override}
    with opened(environ=alone) as left, opened(endpoint) as right:
        node = entity(left, EntityKind.NODE)
        left.transport.announce(node)
        assert right.graph.wait_for(lambda graph: graph.entities(), LONG) == (node,)


def test_peers_meet_at_a_router_that_starts_later():
    endpoint = free_endpoint()
    environ = {"ZENOH_CONFIG_OVERRIDE": f'connect/endpoints=["{endpoint}"]', "ROS_DOMAIN_ID": "3"}
    with open_session(environ=environ) as left, open_session(environ=environ) as right:
        assert left.domain == 3
        node = entity(left, EntityKind.NODE)
        left.transport.announce(node)
        with open_router([endpoint], environ={}):
            assert right.graph.wait_for(lambda graph: graph.entities(), LONG) == (node,)


def test_a_lost_connection_comes_back():
    router, endpoint = start_router()
    with opened(endpoint) as left, opened(endpoint) as right:
        node = entity(left, EntityKind.NODE)
        left.transport.announce(node)
        assert right.graph.wait_for(lambda graph: graph.entities(), LONG)
        router.close()
        assert right.graph.wait_for(lambda graph: not graph.entities(), LONG)
        with open_router([endpoint], environ={}):
            assert right.graph.wait_for(lambda graph: graph.entities(), LONG) == (node,)


def test_a_configuration_file_is_used_and_opens_nothing_more(router, tmp_path):
    file = tmp_path / "session.json5"
    file.write_text(f'{{mode: "peer", connect: {{endpoints: ["{router}"]}}}}')
    environ = {"ZENOH_SESSION_CONFIG_URI": str(file)}
    with opened(f"zenoh:{file}") as left, open_session(environ=environ) as right:
        node = entity(left, EntityKind.NODE)
        left.transport.announce(node)
        assert right.graph.wait_for(lambda graph: graph.entities(), LONG) == (node,)
        assert {address for address in listening() if not address.startswith("127.")} == set()


def listening():
    """Yield the addresses on which this process accepts connections (Linux; elsewhere none)."""
    folder, tables = Path("/proc/self/fd"), Path("/proc/self/net")
    sockets = set()
    for descriptor in folder.iterdir() if tables.exists() else ():
        with suppress(OSError):
            sockets.add(str(descriptor.readlink()))
    for table in tables.glob("tcp*"):
        for line in table.read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == "0A" and f"socket:[{words[9]}]" in sockets:
                address = bytes.fromhex(words[1].partition(":")[0])
                yield ".".join(map(str, address[::-1]))


@pytest.mark.parametrize(
    ("addresses", "environ", "message"),
    [
        (["tcp/robot"], {}, "`tcp/robot` is not an endpoint (write `tcp/robot:7447`)"),
        (["tcp/"], {}, "`tcp/` is not an endpoint (write `tcp/localhost:7447`)"),
        (["robot:7447"], {}, "`robot:7447` is not an endpoint (write `tcp/robot:7447`)"),
        (["10.0.0.7"], {}, "`10.0.0.7` is not an endpoint (write `tcp/10.0.0.7:7447`)"),
        (["tcp/a:1,tcp/b:1"], {}, "`tcp/a:1,tcp/b:1` is not an endpoint"),
        (["tcp/127.0.0.1:99999"], {}, "`tcp/127.0.0.1:99999` does not answer: "),
        (["abc/127.0.0.1:1"], {}, "`abc/127.0.0.1:1` does not answer: "),
        (["tcp/127.0.0.1:1?x"], {}, "`tcp/127.0.0.1:1?x` does not answer: "),
        (["tcp/a\nb:1"], {}, "`tcp/a␊b:1` is not an endpoint"),
        (["zenoh:no.json5"], {}, "`no.json5` is not a configuration of Zenoh: "),
        (["zenoh:"], {}, "`zenoh:` is not an endpoint"),
        ([], {"ZENOH_SESSION_CONFIG_URI": "x"}, "`x` is not a configuration of Zenoh"),
        (
            [],
            {"ROS_DOMAIN_ID": "x"},
            "`x` is not a domain (set ROS_DOMAIN_ID to 0)",
        ),
        ([], {"ROS_DOMAIN_ID": "-1"}, "`-1` is not a domain"),
        (
            [],
            {"ZENOH_CONFIG_OVERRIDE": "no/such=1"},
            "ZENOH_CONFIG_OVERRIDE has `no/such=1`: unknown key",
        ),
        ([], {"ZENOH_CONFIG_OVERRIDE": "mode"}, "ZENOH_CONFIG_OVERRIDE has `mode`: expected"),
        ([], {"ZENOH_CONFIG_OVERRIDE": "mode=x"}, "ZENOH_CONFIG_OVERRIDE has `mode=x`: expected"),
    ],
)
def test_what_cannot_be_opened_is_one_sentence(addresses, environ, message):
    with pytest.raises(RobotError) as caught:
        open_session(*addresses, environ=environ, timeout=0.1)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)
    assert ".rs" not in str(caught.value)


def test_a_robot_that_does_not_answer_is_one_sentence():
    endpoint = free_endpoint()
    with pytest.raises(RobotError) as caught:
        opened(endpoint, timeout=0.3)
    assert caught.value.message.startswith(f"`{endpoint}` does not answer: ")
    assert "idlc waited 0.3 s" in caught.value.hint
    assert ".rs" not in str(caught.value)


@pytest.mark.parametrize("module", ["zenoh", "xxhash"])
def test_a_missing_library_is_one_sentence(monkeypatch, module):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(RobotError) as caught:
        open_session("tcp/127.0.0.1:1")
    assert caught.value.message.startswith("eclipse-zenoh and xxhash are required: ")
    assert module in caught.value.message.partition(": ")[2]
    assert caught.value.hint == 'install it: `pip install "idlc[zenoh]"`'


def test_a_path_that_exists_is_no_robot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["tcp/robot:7447", "tls/[::1]:7447", "tcp/robot", "zenoh:x.json5"]
    assert [*map(is_address, words)] == [True] * 4
    assert [*map(is_address, ["robot:7447", "rec.mcap", "tcp", "interfaces/tcp/x"])][::2] == [
        False
    ] * 2
    (tmp_path / "tcp").mkdir()
    (tmp_path / "tcp/robot").touch()
    assert not is_address("tcp/robot")


def test_two_routers_cannot_have_one_port(router):
    with pytest.raises(RobotError, match=r"no router can listen on .*: .*another router"):
        open_router([router], environ={})


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_router_command_runs_until_it_is_stopped(number):
    endpoint = free_endpoint()
    command = [sys.executable, "-m", "idlc", "router", "--listen", endpoint]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert read_line(process.stdout) == f"listening on {endpoint}; press Ctrl-C to stop\n"
            opened(endpoint).close()
            process.send_signal(number)
            assert process.wait(LONG) == 0
        finally:
            process.kill()


def test_the_router_command_reports_a_bad_endpoint(capsys):
    assert main(["router", "--listen", "tcp/robot"]) == 2
    assert capsys.readouterr().err == (
        "error: `tcp/robot` is not an endpoint\n  = hint: write `tcp/robot:7447`\n"
    )


def test_nothing_of_zenoh_is_imported_before_it_is_used():
    code = "import sys, idlc.robot as r; r.QoSProfile; r.Node; r.open_session; "
    code += "print('zenoh' in sys.modules, sorted(dir(r))[:2])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split()[0] == "False"
