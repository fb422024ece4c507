"""The node translator."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from demo.translator_conversion import (
    new_ask_request,
    new_drive,
    NewAsk,
    NewDrive,
    old_ask_response,
    OldAsk,
    OldDrive,
)
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import (
    ExternalShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.task import Future
from rclpy.utilities import ok


class Translator(Node):
    """
    The node translator.

    It translates drive.
    It translates ask.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('translator')
        drive = self.resolve_topic_name('drive')
        if drive == self.resolve_topic_name('drive_v2'):
            raise ValueError('drive: both versions have the same topic')
        self.drive_publisher = self.create_publisher(
            NewDrive,
            'drive_v2',
            qos_profile_sensor_data,
        )
        ask = self.resolve_service_name('ask')
        if ask == self.resolve_service_name('ask_v2'):
            raise ValueError('ask: both versions have the same service')
        self.ask_client = self.create_client(
            NewAsk,
            'ask_v2',
            callback_group=ReentrantCallbackGroup(),
        )
        self.drive_subscription = self.create_subscription(
            OldDrive,
            'drive',
            self.translate_drive,
            qos_profile_sensor_data,
        )
        # rclpy does not annotate coroutines here
        translate_ask: Any = self.translate_ask
        self.ask_service = self.create_service(
            OldAsk,
            'ask',
            translate_ask,
            # other requests do not wait for this one
            callback_group=ReentrantCallbackGroup(),
        )

    def translate_drive(self, message: OldDrive) -> None:
        """Publish a message from drive in the new version."""
        self.drive_publisher.publish(new_drive(message))

    async def translate_ask(
        self,
        request: OldAsk.Request,
        response: OldAsk.Response,
    ) -> OldAsk.Response:
        """Answer a request to ask with the response of the new version."""
        while not self.ask_client.service_is_ready():
            await self.pause(0.05)
        answer: NewAsk.Response = await self.ask_client.call_async(
            new_ask_request(request),
        )
        return old_ask_response(answer)

    async def pause(self, seconds: float) -> None:
        """Wait without blocking: other callbacks run in the meantime."""
        over: Future = Future()
        timer = self.create_timer(seconds, lambda: over.set_result(None))
        await over
        self.destroy_timer(timer)


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = Translator()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
