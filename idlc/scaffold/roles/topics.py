"""Publishers: they publish a message again and again."""

from __future__ import annotations

from idlc.scaffold.layout import call, signature
from idlc.scaffold.roles.role import (
    ACTIVATE,
    CONFIGURE,
    Context,
    Part,
    Question,
    Role,
    TestContext,
    TestPart,
    Value,
    creation,
    interval,
    positive,
    typed,
)
from idlc.scaffold.samples import constructed


class PublisherPart(Part, frozen=True, kw_only=True):
    """A publisher: the head of its method, and the lines that make a message."""

    head: str
    message: str


class PublisherTest(TestPart, frozen=True, kw_only=True):
    """The test of a publisher: how many seconds to wait for two messages."""

    patience: float


def _read_publisher(text: str) -> Value:
    """Return what `TYPE:TOPIC[@HZ]` means."""
    type_, colon, rest = text.partition(":")
    topic, at, hertz = rest.partition("@")
    value = typed(f"{type_}{colon}{topic}", "TYPE:TOPIC[@HZ]")
    rate = positive(hertz, f"the rate of `{topic}`", "Hz") if at else 1.0
    return value._replace(period=1.0 / rate)


def _publisher_node(context: Context) -> PublisherPart:
    endpoint, word = context.endpoint, context.word
    method = "create_lifecycle_publisher" if context.lifecycle else "create_publisher"
    words = [context.type, repr(endpoint.topic), endpoint.qos.source]
    publisher, timer = f"self.{word}_publisher", f"self.{word}_timer"
    every = [interval(endpoint.period or 1.0), f"self.publish_{word}"]
    return PublisherPart(
        **context.names,
        head=signature(f"def publish_{word}", ["self"], "None", depth=1),
        message=constructed(context.sections[0], context.page, head="message = ", depth=2),
        create=(
            *call(f"{publisher} = self.{method}", words, depth=2),
            *context.undo(CONFIGURE, "self.destroy_lifecycle_publisher", publisher),
        ),
        work=(
            *call(f"{timer} = self.create_timer", every, depth=2),
            *context.undo(ACTIVATE, "self.destroy_timer", timer),
        ),
    )


def _publisher_test(context: TestContext) -> PublisherTest:
    words = [context.type, context.topic, "received.append", context.endpoint.qos.source]
    return PublisherTest(
        **context.names("publishes"),
        create=creation("observer.create_subscription", words),
        patience=context.patience,
    )


PUBLISHER = Role(
    name="publisher",
    kind="msg",
    metavar="TYPE:TOPIC[@HZ]",
    help="Publish, by default once a second.",
    read=_read_publisher,
    answer="publish",
    question=Question("Rate in Hz", "1", separator="@"),
    summary="publishes {}",
    node=_publisher_node,
    test=_publisher_test,
    family="timer",
)


class SubscriberPart(Part, frozen=True, kw_only=True):
    """A subscriber: the head of its callback, and the lines that log a message."""

    head: str
    log: tuple[str, ...]


class SubscriberTest(TestPart, frozen=True, kw_only=True):
    """The test of a subscriber: how the line begins that it logs."""

    logged: str


def _subscriber_node(context: Context) -> SubscriberPart:
    endpoint, word = context.endpoint, context.word
    callback, subscription = f"self.receive_{word}", f"self.{word}_subscription"
    words = [context.type, repr(endpoint.topic), callback, endpoint.qos.source]
    parameters = ["self", f"message: {context.type}"]
    return SubscriberPart(
        **context.names,
        head=signature(f"def receive_{word}", parameters, "None", depth=1),
        log=context.log("message", context.sections[0]),
        work=(
            *call(f"{subscription} = self.create_subscription", words, depth=2),
            *context.undo(ACTIVATE, "self.destroy_subscription", subscription),
        ),
    )


def _subscriber_test(context: TestContext) -> SubscriberTest:
    words = [context.type, context.topic, context.endpoint.qos.source]
    return SubscriberTest(
        **context.names("receives"),
        create=creation("publisher = observer.create_publisher", words),
        logged=context.logged("message", context.sections[0]),
    )


SUBSCRIBER = Role(
    name="subscriber",
    kind="msg",
    metavar="TYPE:TOPIC",
    help="Receive messages.",
    read=typed,
    answer="subscribe",
    summary="listens to {}",
    node=_subscriber_node,
    test=_subscriber_test,
    family="subscriber",
)


class TimerTest(TestPart, frozen=True, kw_only=True):
    """The test of a timer: how many seconds to wait for two calls."""

    patience: float


def _read_timer(text: str) -> Value:
    return Value("", "tick", positive(text, "the period of a timer", "seconds"))


def _timer_node(context: Context) -> Part:
    timer = f"self.{context.word}_timer"
    words = [interval(context.endpoint.period or 1.0), f"self.{context.word}"]
    return Part(
        **context.names,
        work=(
            *call(f"{timer} = self.create_timer", words, depth=2),
            *context.undo(ACTIVATE, "self.destroy_timer", timer),
        ),
    )


def _timer_test(context: TestContext) -> TimerTest:
    return TimerTest(**context.names("goes_on_with"), patience=context.patience)


TIMER = Role(
    name="timer",
    kind=None,
    metavar="SECONDS",
    help="Call a method regularly.",
    read=_read_timer,
    answer="timer",
    question=Question("Period in seconds", "1.0"),
    summary="",
    node=_timer_node,
    test=_timer_test,
    family="timer",
)
