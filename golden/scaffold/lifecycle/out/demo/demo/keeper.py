"""The lifecycle node keeper."""

from __future__ import annotations

import argparse
from collections.abc import (
    Callable,
    Coroutine,
)
from contextlib import (
    ExitStack,
    suppress,
)
import sys
import time
from typing import Any

import rclpy
from rclpy.executors import (
    ExternalShutdownException,
    SingleThreadedExecutor,
)
from rclpy.lifecycle import (
    LifecycleNode,
    LifecycleState,
    TransitionCallbackReturn,
)
from rclpy.task import Future
from rclpy.utilities import (
    ok,
    remove_ros_args,
)
from std_msgs.msg import Empty
from std_srvs.srv import Empty as std_srvs_srv_Empty
from std_srvs.srv import SetBool


class Keeper(LifecycleNode):
    """
    The lifecycle node keeper.

    Publishes to beat.
    Listens to beat.
    Serves reset.
    Calls switch.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        """Create the node; `on_configure` creates its endpoints."""
        super().__init__('keeper')
        self.options = options
        self.timeout: float = options.server_timeout
        self.undo_configure = ExitStack()
        self.undo_activate = ExitStack()
        self.activation: object = None
        self.pauses: set[Future] = set()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Create publishers, clients and action servers."""
        self.beat_publisher = self.create_lifecycle_publisher(
            Empty,
            'beat',
            10,
        )
        self.undo_configure.callback(
            self.destroy_lifecycle_publisher,
            self.beat_publisher,
        )
        self.switch_client = self.create_client(
            SetBool,
            'switch',
        )
        self.undo_configure.callback(
            self.destroy_client,
            self.switch_client,
        )
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the timers, subscriptions and services."""
        self.activation = object()
        self.undo_activate.callback(self.wake)
        self.beat_timer = self.create_timer(
            1.0,
            self.publish_beat,
        )
        self.undo_activate.callback(
            self.destroy_timer,
            self.beat_timer,
        )
        self.beat_subscription = self.create_subscription(
            Empty,
            'beat',
            self.receive_beat,
            10,
        )
        self.undo_activate.callback(
            self.destroy_subscription,
            self.beat_subscription,
        )
        self.reset_service = self.create_service(
            std_srvs_srv_Empty,
            'reset',
            self.handle_reset,
        )
        self.undo_activate.callback(
            self.destroy_service,
            self.reset_service,
        )
        self.tick_timer = self.create_timer(
            3.0,
            self.tick,
        )
        self.undo_activate.callback(
            self.destroy_timer,
            self.tick_timer,
        )
        self.spawn(
            self.call_switch,
            switch_request(self.options),
        )
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop working."""
        self.undo_activate.close()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy what `on_configure` created."""
        self.undo_configure.close()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop working and destroy everything, in any state."""
        self.undo_activate.close()
        self.undo_configure.close()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Undo everything after a transition that failed."""
        self.get_logger().error(f'a transition from {state.label} failed')
        self.undo_activate.close()
        self.undo_configure.close()
        return super().on_error(state)

    def publish_beat(self) -> None:
        """Publish a message on beat."""
        message = Empty()
        self.beat_publisher.publish(message)

    def receive_beat(self, message: Empty) -> None:
        """Handle a message from beat."""
        self.get_logger().info(f'beat: {message=}')

    def handle_reset(
        self,
        request: std_srvs_srv_Empty.Request,
        response: std_srvs_srv_Empty.Response,
    ) -> std_srvs_srv_Empty.Response:
        """Answer a request to reset."""
        self.get_logger().info(f'reset: {request=}')
        return response

    async def call_switch(self, request: SetBool.Request) -> bool:
        """Call switch once; return whether it answered in time."""
        if not await self.until(self.switch_client.service_is_ready):
            self.get_logger().error('switch: gave up waiting for a server')
            return False
        answer = self.switch_client.call_async(request)
        if not await self.until(answer.done):
            self.get_logger().error('switch: gave up waiting for an answer')
            return False
        response: SetBool.Response | None = answer.result()
        if response is None:
            return False
        self.get_logger().info(f'switch: {response=}')
        return True

    def tick(self) -> None:
        """Run once per timer period."""
        self.get_logger().info('tick')

    async def until(self, condition: Callable[[], bool]) -> bool:
        """Wait until a condition holds; return whether it did so in time and while active."""
        activation = self.activation
        deadline = time.monotonic() + self.timeout
        while activation is not None and activation is self.activation:
            if condition():
                return True
            if time.monotonic() > deadline:
                return False
            await self.pause(0.05)
        return False

    async def pause(self, seconds: float) -> None:
        """Wait without blocking, until the node is deactivated at the latest."""
        over: Future = Future()
        self.pauses.add(over)
        timer = self.create_timer(seconds, lambda: over.set_result(None))
        await over
        self.pauses.remove(over)
        self.destroy_timer(timer)

    def wake(self) -> None:
        """End all pauses, so that coroutines see that the node is no longer active."""
        self.activation = None
        for over in self.pauses:
            over.set_result(None)

    def spawn(self, work: Callable[[Any], Coroutine[Any, Any, object]], what: Any) -> None:
        """Run a coroutine concurrently with the callbacks."""
        if self.executor is not None:
            self.executor.create_task(work, what)


def parse_arguments(args: list[str] | None) -> argparse.Namespace:
    """Parse the command line, without ROS 2's own arguments."""
    parser = argparse.ArgumentParser(
        description=Keeper.__doc__,
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument(
        '--server-timeout',
        type=float,
        default=5.0,
        metavar='SECONDS',
        help='How long to wait for a server and for its answer.',
    )
    parser.add_argument(
        '--data',
        action=argparse.BooleanOptionalAction,
        default=False,
        help='data',
    )
    words = remove_ros_args(sys.argv if args is None else args)
    return parser.parse_args(words[1:])


def switch_request(options: argparse.Namespace) -> SetBool.Request:
    """Return the request that the command line describes."""
    return SetBool.Request(
        data=options.data,
    )


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    options = parse_arguments(args)
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = Keeper(options)
            executor.add_node(node)
            while ok():
                # Wake up every second: rclpy can miss a signal that arrives during startup.
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
