"""The functions `spin`, `spin_once` and `spin_until_future_complete`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from idlc.robot.nodes.executor import Executor

if TYPE_CHECKING:
    from idlc.robot.nodes.node import Node
    from idlc.robot.nodes.tasks import Future


def _executor_of(node: Node, executor: Executor | None) -> Executor:
    chosen = executor or node.executor or Executor(context=node.context)
    chosen.add_node(node)
    return chosen


def create_node(node_name: str, **options: Any) -> Node:
    """Return a node; options are those of `Node`."""
    from idlc.robot.nodes.node import Node

    return Node(node_name, **options)


def spin(node: Node, executor: Executor | None = None) -> None:
    """Run the callbacks of a node until the context is shut down.

    Raises what callbacks raise, and ExternalShutdownException after SIGTERM.
    """
    _executor_of(node, executor).spin()


def spin_once(
    node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Run one callback of a node, or wait for one for at most `timeout_sec` seconds."""
    _executor_of(node, executor).spin_once(timeout_sec)


def spin_until_future_complete(
    node: Node,
    future: Future[Any],
    executor: Executor | None = None,
    timeout_sec: float | None = None,
) -> None:
    """Run callbacks until the future is done or cancelled, or the time is over."""
    _executor_of(node, executor).spin_until_future_complete(future, timeout_sec)
