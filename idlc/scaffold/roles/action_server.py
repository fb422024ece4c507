"""Action servers: they work on goals, which can be cancelled and replaced."""

from __future__ import annotations

from idlc.scaffold.line_breaks import call, signature
from idlc.scaffold.roles.role import (
    ACTIVATE,
    CONFIGURE,
    Context,
    Part,
    Role,
    TestContext,
    TestPart,
    creation,
)
from idlc.scaffold.roles.values import typed
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


def _node(context: Context) -> ActionServerPart:
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


def _test(context: TestContext) -> ActionServerTest:
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
    node=_node,
    test=_test,
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
