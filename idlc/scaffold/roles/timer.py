"""Timers: they call a method again and again."""

from __future__ import annotations

from idlc.scaffold.line_breaks import call
from idlc.scaffold.roles.role import (
    ACTIVATE,
    Context,
    Part,
    Question,
    Role,
    TestContext,
    TestPart,
    Value,
)
from idlc.scaffold.roles.values import interval, positive


class TimerTest(TestPart, frozen=True, kw_only=True):
    """The test of a timer: how many seconds to wait for two calls."""

    patience: float


def _read(text: str) -> Value:
    return Value("", "tick", positive(text, "the period of a timer", "seconds"))


def _node(context: Context) -> Part:
    timer = f"self.{context.word}_timer"
    words = [interval(context.endpoint.period or 1.0), f"self.{context.word}"]
    return Part(
        **context.names,
        work=(
            *call(f"{timer} = self.create_timer", words, depth=2),
            *context.undo(ACTIVATE, "self.destroy_timer", timer),
        ),
    )


def _test(context: TestContext) -> TimerTest:
    return TimerTest(**context.names("goes_on_with"), patience=context.patience)


TIMER = Role(
    name="timer",
    kind=None,
    metavar="SECONDS",
    help="Call a method regularly.",
    read=_read,
    answer="timer",
    question=Question("Period in seconds", "1.0"),
    summary="",
    node=_node,
    test=_test,
    family="timer",
)
