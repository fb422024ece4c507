"""Events of endpoints, QoS that parameters override, and levels that services set."""

import pytest

import idlc
from idlc.robot import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    PublisherEventCallbacks,
    QoSProfile,
    ReliabilityPolicy,
    SubscriptionEventCallbacks,
)
from idlc.robot.keys import pack_attachment
from idlc.robot.nodes.events import UnsupportedEventTypeError
from idlc.robot.nodes.overrides import (
    InvalidQosOverridesError,
    QosCallbackResult,
    QoSOverridingOptions,
)
from idlc.robot.qos import QoSPolicyKind
from idlc.robot.transport import Sample
from tests.robot.nodes import LONG, String, node_at, spin_until
from tests.support.domains import held_domain

LATCHED = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def lone():
    """A node beside which there is no other."""
    with held_domain() as domain, node_at(f"dds:{domain}", "lone", cli_args=ARGUMENTS) as node:
        yield node


def test_ends_that_come_and_go_are_reported(address):
    sent, received, alive, unfit = [], [], [], []

    async def match(info):
        received.append(info)

    with node_at(address, "left") as left, node_at(address, "right") as right:
        events = PublisherEventCallbacks(matched=sent.append, incompatible_qos=unfit.append)
        publisher = left.create_publisher(String, "words", 10, event_callbacks=events)
        events = SubscriptionEventCallbacks(
            matched=match, liveliness=alive.append, incompatible_qos=unfit.append
        )
        first = right.create_subscription(String, "words", print, 10, event_callbacks=events)
        spin_until(lambda: sent and alive, left, right)
        second = right.create_subscription(String, "words", print, LATCHED)
        is_zenoh = left.transport.connects_all
        spin_until(lambda: len(sent) == 2 if is_zenoh else unfit, left, right)
        # on Zenoh, volatile publishers and latched subscriptions are connected
        assert unfit == ([] if is_zenoh else [(1, 1, QoSPolicyKind.DURABILITY)])
        names = [f"{info.last_policy_kind}" for info in unfit]
        assert names == ["rmw_qos_policy_kind_t.RMW_QOS_POLICY_DURABILITY"][: len(unfit)]
        for number, end in ((1, second), (0, first)):
            right.destroy_subscription(end)
            spin_until(lambda n=number: sent[-1].current_count == n, left, right)
        assert sent == ([(1, 1, 1, 1), (2, 1, 2, 1), (2, 0, 1, -1), (2, 0, 0, -1)] if is_zenoh
                        else [(1, 1, 1, 1), (1, 0, 0, -1)])  # fmt: skip
        left.destroy_publisher(publisher)
        assert (received, alive) == ([(1, 1, 1, 1)], [(1, 0, 1, 0)])
        assert (left.timers, left.graph.watchers, right.graph.watchers) == ([], set(), set())


def test_lost_messages_are_counted_by_publisher(lone):
    lost = []
    events = SubscriptionEventCallbacks(message_lost=lost.append)
    subscription = lone.create_subscription(String, "words", print, 100, event_callbacks=events)

    def receive(source, *numbers):
        for number in numbers:
            subscription._receive(Sample(b"", pack_attachment(number, 0, source * 16)))

    # the first message of a publisher, those in order, and late ones are no loss
    receive(b"a", 7, 8, 9)
    receive(b"b", 1, 2, 1)
    spin_until(lambda: not len(subscription._queue), lone)
    assert lost == []
    receive(b"a", 12)
    spin_until(lambda: lost, lone)
    receive(b"b", 4, 3, 6)
    spin_until(lambda: len(lost) == 2, lone)
    assert lost == [(2, 2), (4, 2)]
    for number in range(1100):
        receive(number.to_bytes(2, "big") * 8, 5)
    assert len(subscription.events._numbers) <= 1000


def test_an_event_that_never_comes_is_refused(lone):
    manual = QoSProfile(liveliness=LivelinessPolicy.MANUAL_BY_TOPIC)
    events = PublisherEventCallbacks(liveliness=print)
    with pytest.raises(UnsupportedEventTypeError, match="liveliness"):
        lone.create_publisher(String, "words", manual, event_callbacks=events)


# overrides

ARGUMENTS = [
    *("-p", "qos_overrides./ns/words.publisher.depth:=3"),
    *("-p", "qos_overrides./ns/words.publisher.history:=keep_all"),
    *("-p", "qos_overrides./ns/words.subscription_slow.reliability:=best_effort"),
    *("-p", "qos_overrides./bad.publisher.reliability:=often"),
    *("-p", "qos_overrides./bad.subscription.depth:=-1"),
    *("-p", "qos_overrides./typed.publisher.depth:=many"),
]


def test_parameters_override_profiles(lone):
    options = QoSOverridingOptions.with_default_policies()
    profile = QoSProfile(depth=10)
    publisher = lone.create_publisher(String, "/ns/words", profile, qos_overriding_options=options)
    assert publisher.qos_profile == QoSProfile(depth=3, history=HistoryPolicy.KEEP_ALL)
    assert profile == QoSProfile(depth=10)
    # the parameters exist already
    again = lone.create_publisher(String, "/ns/words", 7, qos_overriding_options=options)
    assert again.qos_profile == publisher.qos_profile
    kinds = [QoSPolicyKind.RELIABILITY, QoSPolicyKind.LIFESPAN, QoSPolicyKind.DEADLINE]
    checked = []
    slow = QoSOverridingOptions(
        kinds, lambda it: checked.append(it) or QosCallbackResult(successful=True), "slow"
    )
    end = lone.create_subscription(String, "/ns/words", print, 10, qos_overriding_options=slow)
    assert end.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
    assert checked == [end.qos_profile]
    names = [f"qos_overrides./ns/words.{name}" for name in (
        "publisher.history", "publisher.depth", "publisher.reliability",
        "subscription_slow.reliability", "subscription_slow.deadline",
    )]  # fmt: skip
    assert [name for name in names if lone.has_parameter(name)] == names
    assert not lone.has_parameter("qos_overrides./ns/words.subscription_slow.lifespan")
    assert lone.describe_parameter(names[0]).read_only
    refused = QoSOverridingOptions(kinds, lambda _: QosCallbackResult(reason="too slow"))
    for create, topic, chosen, message in (
        (lone.create_publisher, "/ns/other", refused, "`/ns/other` .*too slow"),
        (lone.create_publisher, "/bad", options, "`.*reliability` cannot be 'often'"),
        (lone.create_subscription, "/bad", options, "`.*depth` cannot be -1: .*between"),
    ):
        callback = () if create == lone.create_publisher else (print,)
        with pytest.raises(InvalidQosOverridesError, match=message):
            create(String, topic, *callback, 10, qos_overriding_options=chosen)


def test_levels_are_set_by_services(address):
    ros = idlc.load("rcl_interfaces").rcl_interfaces
    with node_at(address, "talker", enable_logger_service=True) as node:
        call = {}
        for verb in ("get", "set"):
            kind = getattr(ros.srv, f"{verb.title()}LoggerLevels")
            call[verb] = kind, node.create_client(kind, f"talker/{verb}_logger_levels")
            assert call[verb][1].wait_for_service(LONG)

        def ask(verb, **fields):
            kind, client = call[verb]
            future = client.call_async(kind.Request(**fields))
            spin_until(future.done, node)
            return future.result()

        level = ros.msg.LoggerLevel
        levels = [level(name="talker.x", level=40), level(name="y", level=7)]
        results = ask("set", levels=levels).results
        assert [each.successful for each in results] == [True, False]
        assert results[1].reason == "Failed reason: Invalid logger level."
        answers = ask("get", names=["talker.x", "y"]).levels
        assert [(each.name, each.level) for each in answers] == [("talker.x", 40), ("y", 0)]
        assert not node.get_logger().get_child("x").info("quiet")
