"""Action servers: they work on goals, which can be cancelled and replaced."""

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
from idlc.scaffold.samples import constructed


class ActionServerPart(Part, frozen=True, kw_only=True):
    """An action server: the heads of its methods, and the lines that make what it sends."""

    accept_head: str
    begin_head: str
    cancel_head: str
    execute_head: str
    close_head: str
    log: tuple[str, ...]
    feedback: str
    result: str


class ActionServerTest(TestPart, frozen=True, kw_only=True):
    """The test of an action server: how the line begins that it logs, and its goal's constant."""

    logged: str
    goal: str


def _server_node(context: Context) -> ActionServerPart:
    word, type_, lifecycle = context.word, context.type, context.lifecycle
    goal, result, feedback = context.sections
    handle = ["self", "goal_handle: ServerGoalHandle"]
    log = context.log("goal", goal)
    return ActionServerPart(
        **context.names,
        accept_head=signature(
            f"def accept_{word}", ["self", f"goal: {type_}.Goal"], "GoalResponse", depth=1
        ),
        begin_head=signature(f"def begin_{word}", handle, "None", depth=1),
        cancel_head=signature(f"def cancel_{word}", handle, "CancelResponse", depth=1),
        execute_head=signature(f"async def execute_{word}", handle, f"{type_}.Result", depth=1),
        close_head=signature(f"def close_{word}", ["self"], "None", depth=1),
        log=(f"goal: {type_}.Goal = goal_handle.request", *log) if goal.fields else log,
        feedback=constructed(feedback, context.page, head="feedback = ", depth=3),
        result=constructed(result, context.page, head="result = ", depth=2),
        remember=(
            *((f"self.{word}_open = False",) if lifecycle else ()),
            f"self.{word}_goal: ServerGoalHandle | None = None",
        ),
        create=(
            *call(f"self.{word}_server = ActionServer", _words(context), depth=2),
            *context.undo(CONFIGURE, "self.spawn", "self.retire", f"self.{word}_server"),
        ),
        work=(
            *((f"self.{word}_open = True",) if lifecycle else ()),
            *context.undo(ACTIVATE, f"self.close_{word}"),
        ),
    )


def _words(context: Context) -> list[str]:
    """Return what an ActionServer is made with."""
    word = context.word
    return [
        *("self", context.type, repr(context.endpoint.topic)),
        f"execute_callback=self.execute_{word}",
        f"goal_callback=self.accept_{word}",
        f"handle_accepted_callback=self.begin_{word}",
        f"cancel_callback=self.cancel_{word}",
    ]


def _server_test(context: TestContext) -> ActionServerTest:
    words = ["observer", context.type, context.topic]
    return ActionServerTest(
        **context.names("reaches"),
        create=creation("client = ActionClient", words),
        constants=(f"{context.word.upper()}_GOAL = {context.type}.Goal()",),
        logged=context.logged("goal", context.sections[0]),
        goal=f"{context.word.upper()}_GOAL",
    )


ACTION_SERVER = Role(
    name="action_server",
    kind="action",
    metavar="TYPE:NAME",
    help="Work on goals, which can be cancelled and replaced.",
    read=typed,
    answer="act",
    summary="works on goals for {}",
    node=_server_node,
    test=_server_test,
    family="action",
    imports={
        "rclpy.action.server": (
            "ActionServer",
            "CancelResponse",
            "GoalResponse",
            "ServerGoalHandle",
        )
    },
    test_imports={
        "action_msgs.msg": ("GoalStatus",),
        "rclpy.action.client": ("ActionClient",),
    },
    helpers=frozenset({"pause", "retire"}),
)


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


def _client_node(context: Context) -> ActionClientPart:
    word, type_ = context.word, context.type
    _, result, feedback = context.sections
    log_feedback, log_result = context.log("feedback", feedback), context.log("result", result)
    if feedback.fields:
        log_feedback = (f"feedback: {type_}.Feedback = message.feedback", *log_feedback)
    if result.fields:
        log_result = (f"result: {type_}.Result = ending.result().result", *log_result)
    arguments = ["goal", f"feedback_callback=self.follow_{word}"]
    words = ["self", type_, repr(context.endpoint.topic)]
    return ActionClientPart(
        **context.names,
        send_head=signature(
            f"async def send_{word}", ["self", f"goal: {type_}.Goal"], "bool", depth=1
        ),
        follow_head=signature(f"def follow_{word}", ["self", "message: Any"], "None", depth=1),
        cancel_head=signature(f"async def cancel_{word}", ["self"], "None", depth=1),
        drop_head=signature(f"def drop_{word}", ["self"], "None", depth=1),
        send=tuple(call(f"sent = self.{word}_client.send_goal_async", arguments, depth=2)),
        log_feedback=log_feedback,
        log_result=log_result,
        remember=(f"self.{word}_sent: Future | None = None",),
        create=(
            *call(f"self.{word}_client = ActionClient", words, depth=2),
            *context.undo(CONFIGURE, "self.spawn", "self.retire", f"self.{word}_client"),
        ),
        work=context.undo(ACTIVATE, f"self.drop_{word}"),
    )


def _client_test(context: TestContext) -> ActionClientTest:
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
    node=_client_node,
    test=_client_test,
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
