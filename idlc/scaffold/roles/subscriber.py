"""Subscribers: they log each message."""

from __future__ import annotations

from idlc.scaffold.line_breaks import call, signature
from idlc.scaffold.roles.role import ACTIVATE, Context, Part, Role, TestContext, TestPart, creation
from idlc.scaffold.roles.values import typed


class SubscriberPart(Part, frozen=True, kw_only=True):
    """A subscriber: the head of its callback, and the lines that log a message."""

    head: str
    log: tuple[str, ...]


class SubscriberTest(TestPart, frozen=True, kw_only=True):
    """The test of a subscriber: how the line begins that it logs."""

    logged: str


def _node(context: Context) -> SubscriberPart:
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


def _test(context: TestContext) -> SubscriberTest:
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
    node=_node,
    test=_test,
    family="subscriber",
)
