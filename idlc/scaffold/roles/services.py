"""Clients: they call a service once, with a request from the command line."""

from __future__ import annotations

from idlc.scaffold.layout import call, signature
from idlc.scaffold.roles.role import (
    ACTIVATE,
    CONFIGURE,
    Context,
    Part,
    Request,
    Role,
    TestContext,
    TestPart,
    creation,
    typed,
)
from idlc.scaffold.samples import assigned


class ServicePart(Part, frozen=True, kw_only=True):
    """A service: the head of its callback, the lines that log a request and fill in a response."""

    head: str
    log: tuple[str, ...]
    answer: tuple[str, ...]


class ServiceTest(TestPart, frozen=True, kw_only=True):
    """The test of a service: how the line begins that it logs."""

    logged: str


def _service_node(context: Context) -> ServicePart:
    word, type_ = context.word, context.type
    request, response = context.sections
    parameters = ["self", f"request: {type_}.Request", f"response: {type_}.Response"]
    words = [type_, repr(context.endpoint.topic), f"self.handle_{word}"]
    return ServicePart(
        **context.names,
        head=signature(f"def handle_{word}", parameters, f"{type_}.Response", depth=1),
        log=context.log("request", request),
        answer=tuple(assigned(response, context.page, "response", depth=2)),
        work=(
            *call(f"self.{word}_service = self.create_service", words, depth=2),
            *context.undo(ACTIVATE, "self.destroy_service", f"self.{word}_service"),
        ),
    )


def _service_test(context: TestContext) -> ServiceTest:
    return ServiceTest(
        **context.names("answers"),
        create=creation("client = observer.create_client", [context.type, context.topic]),
        logged=context.logged("request", context.sections[0]),
    )


SERVICE = Role(
    name="service",
    kind="srv",
    metavar="TYPE:NAME",
    help="Answer requests.",
    read=typed,
    answer="serve",
    summary="serves {}",
    node=_service_node,
    test=_service_test,
    family="service",
)


class ClientPart(Part, frozen=True, kw_only=True):
    """A client: the head of its coroutine, and the lines that log a response."""

    head: str
    log: tuple[str, ...]


class ClientTest(TestPart, frozen=True, kw_only=True):
    """The test of a client: how the line begins that it logs, and whether the node then ends."""

    logged: str
    ends: bool


def _client_node(context: Context) -> ClientPart:
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


def _client_test(context: TestContext) -> ClientTest:
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
    node=_client_node,
    test=_client_test,
    family="action",
    helpers=frozenset({"pause", "until"}),
    request=Request("call", "the request"),
)
