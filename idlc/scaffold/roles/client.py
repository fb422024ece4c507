"""Clients: they call a service once, with a request from the command line."""

from __future__ import annotations

from idlc.scaffold.line_breaks import call, signature
from idlc.scaffold.roles.role import (
    CONFIGURE,
    Context,
    Part,
    Request,
    Role,
    TestContext,
    TestPart,
    creation,
)
from idlc.scaffold.roles.values import typed


class ClientPart(Part, frozen=True, kw_only=True):
    """A client: the head of its coroutine, and the lines that log a response."""

    head: str
    log: tuple[str, ...]


class ClientTest(TestPart, frozen=True, kw_only=True):
    """The test of a client: how the line begins that it logs, and whether the node then ends."""

    logged: str
    ends: bool


def _node(context: Context) -> ClientPart:
    word = context.word
    parameters = ["self", f"request: {context.type}.Request"]
    words = [context.type, repr(context.endpoint.topic)]
    return ClientPart(
        **context.names,
        head=signature(f"async def call_{word}", parameters, "bool", depth=1),
        log=context.log("response", context.sections[1]),
        create=(
            *call(f"self.{word}_client = self.create_client", words, depth=2),
            *context.undo(CONFIGURE, "self.destroy_client", f"self.{word}_client"),
        ),
    )


def _test(context: TestContext) -> ClientTest:
    return ClientTest(
        **context.names("calls"),
        create=creation("observer.create_service", [context.type, context.topic, "answer"]),
        logged=context.logged("response", context.sections[1]),
        ends=context.ends,
    )


CLIENT = Role(
    name="client",
    kind="srv",
    metavar="TYPE:NAME",
    help="Call a service; the request's fields come from the command line.",
    read=typed,
    answer="call",
    summary="calls {}",
    node=_node,
    test=_test,
    family="action",
    helpers=frozenset({"pause", "until"}),
    request=Request("call", "the request"),
)
