"""Services: they answer requests."""

from __future__ import annotations

from idlc.scaffold.line_breaks import call, signature
from idlc.scaffold.roles.role import ACTIVATE, Context, Part, Role, TestContext, TestPart, creation
from idlc.scaffold.roles.values import typed
from idlc.scaffold.samples import assigned


class ServicePart(Part, frozen=True, kw_only=True):
    """A service: the head of its callback, the lines that log a request and fill in a response."""

    head: str
    log: tuple[str, ...]
    answer: tuple[str, ...]


class ServiceTest(TestPart, frozen=True, kw_only=True):
    """The test of a service: how the line begins that it logs."""

    logged: str


def _node(context: Context) -> ServicePart:
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


def _test(context: TestContext) -> ServiceTest:
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
    node=_node,
    test=_test,
    family="service",
)
