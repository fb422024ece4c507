"""Action clients: they send one goal, from the command line, and follow it to its end."""

from __future__ import annotations

from idlc.scaffold.line_breaks import call, signature
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
)
from idlc.scaffold.roles.values import typed


class ActionClientPart(Part, frozen=True, kw_only=True):
    """An action client: the heads of its methods, and the lines that send the goal and log."""

    send_head: str
    follow_head: str
    cancel_head: str
    drop_head: str
    send: tuple[str, ...]
    log_feedback: tuple[str, ...]
    log_result: tuple[str, ...]


class ActionClientTest(TestPart, frozen=True, kw_only=True):
    """The test of an action client: how the lines begin that it logs, and whether it then ends.

    `create_cancellable` makes a server that cancels goals.
    """

    create_cancellable: str
    logged_feedback: str
    logged_result: str
    ends: bool


def _node(context: Context) -> ActionClientPart:
    word, type_ = context.word, context.type
    _, result, feedback = context.sections
    log_feedback, log_result = context.log("feedback", feedback), context.log("result", result)
    if feedback.fields:
        log_feedback = (f"feedback: {type_}.Feedback = message.feedback", *log_feedback)
    if result.fields:
        log_result = (f"result: {type_}.Result = ending.result().result", *log_result)
    given = ["goal", f"feedback_callback=self.follow_{word}"]
    words = ["self", type_, repr(context.endpoint.topic)]
    return ActionClientPart(
        **context.names,
        send_head=signature(
            f"async def send_{word}", ["self", f"goal: {type_}.Goal"], "bool", depth=1
        ),
        follow_head=signature(f"def follow_{word}", ["self", "message: Any"], "None", depth=1),
        cancel_head=signature(f"async def cancel_{word}", ["self"], "None", depth=1),
        drop_head=signature(f"def drop_{word}", ["self"], "None", depth=1),
        send=tuple(call(f"sent = self.{word}_client.send_goal_async", given, depth=2)),
        log_feedback=log_feedback,
        log_result=log_result,
        remember=(f"self.{word}_sent: Future | None = None",),
        create=(
            *call(f"self.{word}_client = ActionClient", words, depth=2),
            *context.undo(CONFIGURE, "self.spawn", "self.retire", f"self.{word}_client"),
        ),
        work=context.undo(ACTIVATE, f"self.drop_{word}"),
    )


def _test(context: TestContext) -> ActionClientTest:
    _, result, feedback = context.sections
    server = ["observer", context.type, context.topic, "execute"]
    return ActionClientTest(
        **context.names("sends"),
        create=creation("server = ActionServer", server),
        create_cancellable=creation("server = ActionServer", [*server, "cancel_callback=cancel"]),
        logged_feedback=context.logged("feedback", feedback),
        logged_result=context.logged("result", result),
        ends=context.ends,
        imports={"rclpy.action.server": ("CancelResponse",)} if context.ends else {},
    )


ACTION_CLIENT = Role(
    name="action_client",
    kind="action",
    metavar="TYPE:NAME",
    help="Send a goal; its fields come from the command line.",
    read=typed,
    answer="send goals",
    summary="sends goals to {}",
    node=_node,
    test=_test,
    family="action",
    imports={
        "action_msgs.msg": ("GoalStatus",),
        "rclpy.action.client": ("ActionClient", "ClientGoalHandle"),
        "typing": ("Any",),
    },
    test_imports={
        "rclpy.action.server": ("ActionServer", "ServerGoalHandle"),
        "rclpy.task": ("Future",),
    },
    helpers=frozenset({"pause", "retire", "until"}),
    request=Request("send", "the goal", cancel="cancel"),
)
