"""A live robot: its graph and types, and nodes without ROS, over DDS or Zenoh."""

from idlc.robot.actions import ActionClient as ActionClient
from idlc.robot.actions import ActionServer as ActionServer
from idlc.robot.actions import CancelResponse as CancelResponse
from idlc.robot.actions import ClientGoalHandle as ClientGoalHandle
from idlc.robot.actions import GoalResponse as GoalResponse
from idlc.robot.actions import ServerGoalHandle as ServerGoalHandle
from idlc.robot.errors import RobotError as RobotError
from idlc.robot.nodes.arguments import remove_ros_args as remove_ros_args
from idlc.robot.nodes.clock import Clock as Clock
from idlc.robot.nodes.clock import ClockType as ClockType
from idlc.robot.nodes.clock import Duration as Duration
from idlc.robot.nodes.clock import GuardCondition as GuardCondition
from idlc.robot.nodes.clock import Time as Time
from idlc.robot.nodes.clock import Timer as Timer
from idlc.robot.nodes.context import Context as Context
from idlc.robot.nodes.context import SignalHandlerOptions as SignalHandlerOptions
from idlc.robot.nodes.context import init as init
from idlc.robot.nodes.context import ok as ok
from idlc.robot.nodes.context import shutdown as shutdown
from idlc.robot.nodes.endpoints import Publisher as Publisher
from idlc.robot.nodes.endpoints import Subscription as Subscription
from idlc.robot.nodes.events import PublisherEventCallbacks as PublisherEventCallbacks
from idlc.robot.nodes.events import SubscriptionEventCallbacks as SubscriptionEventCallbacks
from idlc.robot.nodes.executor import Executor as Executor
from idlc.robot.nodes.executor import ExternalShutdownException as ExternalShutdownException
from idlc.robot.nodes.executor import Future as Future
from idlc.robot.nodes.executor import MultiThreadedExecutor as MultiThreadedExecutor
from idlc.robot.nodes.executor import (
    MutuallyExclusiveCallbackGroup as MutuallyExclusiveCallbackGroup,
)
from idlc.robot.nodes.executor import ReentrantCallbackGroup as ReentrantCallbackGroup
from idlc.robot.nodes.executor import SingleThreadedExecutor as SingleThreadedExecutor
from idlc.robot.nodes.executor import spin as spin
from idlc.robot.nodes.executor import spin_once as spin_once
from idlc.robot.nodes.executor import spin_until_future_complete as spin_until_future_complete
from idlc.robot.nodes.logger import LoggingSeverity as LoggingSeverity
from idlc.robot.nodes.logger import get_logger as get_logger
from idlc.robot.nodes.node import Node as Node
from idlc.robot.nodes.services import Client as Client
from idlc.robot.nodes.services import Service as Service
from idlc.robot.parameters import Parameter as Parameter
from idlc.robot.qos import DurabilityPolicy as DurabilityPolicy
from idlc.robot.qos import HistoryPolicy as HistoryPolicy
from idlc.robot.qos import LivelinessPolicy as LivelinessPolicy
from idlc.robot.qos import QoSProfile as QoSProfile
from idlc.robot.qos import ReliabilityPolicy as ReliabilityPolicy
from idlc.robot.session import open_router as open_router
from idlc.robot.session import open_session as open_session
