"""Publish, call and act with types that two versions of idlc generated."""

import rclpy
from earlier_values import Ask, Canvas, Path, Plan, Point2, canvas, path, plan
from logged.msg import Reading
from noted.vendor.std_msgs.msg import Header
from outlines.action import Drive
from outlines.srv import Move
from rclpy.action import ActionClient, ActionServer
from waiting import PATIENCE, eventually


def finish(future):
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE)
    return future.result()


def act(goal):
    goal.publish_feedback(Drive.Feedback(progress=0.5))
    goal.succeed()
    return Drive.Result(path=Path(points=[goal.request.goal]))


rclpy.init()
node = rclpy.create_node("earlier")
reading = Reading(header=Header(frame_id="map"), value=2.0)
for kind, message in ((Path, path), (Canvas, canvas), (Plan, plan), (Reading, reading)):
    name, received = kind.__name__.lower(), []
    node.create_subscription(kind, name, received.append, 10)
    publisher = node.create_publisher(kind, name, 10)
    while not received:
        publisher.publish(message)
        rclpy.spin_once(node, timeout_sec=0.1)
    assert type(received[0]) is kind
    assert received[0] == message
    (information,) = node.get_publishers_info_by_topic(f"/{name}")
    print(information.topic_type)

goal = Point2(x=2.0, label="ä")
node.create_service(Ask, "ask", lambda request, _: Ask.Response(nearest=request.path.points[0]))
ask = node.create_client(Ask, "ask")
assert ask.wait_for_service(PATIENCE)
assert finish(ask.call_async(Ask.Request(path=path))).nearest == path.points[0]
print("robot/srv/Ask")

node.create_service(Move, "move", lambda request, _: Move.Response(reached=request.goal == goal))
move = node.create_client(Move, "move")
assert move.wait_for_service(PATIENCE)
assert finish(move.call_async(Move.Request(goal=goal))).reached
print("outlines/srv/Move")

server = ActionServer(node, Drive, "drive", act)
client = ActionClient(node, Drive, "drive")
assert client.wait_for_server(PATIENCE)
feedback = []
handle = finish(client.send_goal_async(Drive.Goal(goal=goal), feedback_callback=feedback.append))
assert finish(handle.get_result_async()).result.path.points == [goal]
eventually(lambda: feedback, node)
assert feedback[0].feedback == Drive.Feedback(progress=0.5)
print("outlines/action/Drive")
rclpy.shutdown()
