"""Publishers: they publish a message again and again."""

from __future__ import annotations

from idlc.scaffold.line_breaks import call, signature
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
)
from idlc.scaffold.roles.values import interval, positive, typed
from idlc.scaffold.samples import constructed


class PublisherPart(Part, frozen=True, kw_only=True):
    """A publisher: the head of its method, and the lines that make a message."""

    head: str
    message: str


class PublisherTest(TestPart, frozen=True, kw_only=True):
    """The test of a publisher: how many seconds to wait for two messages."""

    patience: float


def _read(text: str) -> Value:
    """Return what `TYPE:TOPIC[@HZ]` means."""
    type_, colon, rest = text.partition(":")
    topic, at, hertz = rest.partition("@")
    value = typed(f"{type_}{colon}{topic}", "TYPE:TOPIC[@HZ]")
    rate = positive(hertz, f"the rate of `{topic}`", "Hz") if at else 1.0
    return value._replace(period=1.0 / rate)


def _node(context: Context) -> PublisherPart:
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


def _test(context: TestContext) -> PublisherTest:
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
    read=_read,
    answer="publish",
    question=Question("Rate in Hz", "1", separator="@"),
    summary="publishes {}",
    node=_node,
    test=_test,
    family="timer",
)
