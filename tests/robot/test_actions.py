"""Actions, both ends, over the real Zenoh on loopback."""

import random
from types import SimpleNamespace

import pytest

import idlc
from idlc.robot import (
    ActionClient,
    ActionServer,
    CancelResponse,
    GoalResponse,
    Parameter,
    Service,
)
from idlc.robot.actions import ClientGoalHandle, GoalState
from idlc.robot.errors import RobotError
from idlc.robot.nodes.executor import Future
from idlc.robot.nodes.interfaces import standard
from idlc.robot.qos import qos_profile_action_status_default
from tests.robot.nodes import LONG, node_at, spin_until

Fibonacci = idlc.load("example_interfaces/action/Fibonacci").Fibonacci
CancelGoal = standard("action_msgs/srv/CancelGoal").kind
CancelCode = CancelGoal.Response
NEW = Fibonacci.Impl.SendGoalService
LATCHED = qos_profile_action_status_default
RESULT = Fibonacci.Impl.GetResultService


@pytest.fixture
def pair(address):
    """The nodes of a server and of a client, in two sessions."""
    with node_at(address, "server") as server, node_at(address, "client") as client:
        yield server, client


class Ends:
    """A server whose goals wait until `release`, and a client."""

    def __init__(self, pair, **options):
        self.nodes = pair
        self.goals = []
        self.feedback = []
        self.release = Future()
        self.finish = "succeed"
        server, client = pair
        options.setdefault("execute_callback", self.execute)
        self.server = ActionServer(server, Fibonacci, "count", **options)
        self.client = ActionClient(client, Fibonacci, "count")
        self.until(self.client.server_is_ready)

    async def execute(self, goal):
        self.goals.append(goal)
        for number in range(goal.request.order):
            goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
        await self.release
        getattr(goal, "canceled" if goal.is_cancel_requested else self.finish)()
        return Fibonacci.Result(sequence=[goal.request.order])

    def until(self, condition):
        spin_until(condition, *self.nodes)

    def result(self, future):
        self.until(lambda: future.done())
        return future.result()

    def send(self, order=3):
        goal = Fibonacci.Goal(order=order)
        return self.result(self.client.send_goal_async(goal, self.feedback.append))


def test_a_goal_is_reached_with_feedback_in_order(pair):
    ends = Ends(pair)
    handle = ends.send(order=7)
    assert handle.accepted
    assert handle.stamp.sec > 0
    ends.until(lambda: len(ends.feedback) == 7)
    assert [message.feedback.sequence[0] for message in ends.feedback] == [*range(7)]
    assert ends.goals[0].status == GoalState.EXECUTING
    future = handle.get_result_async()
    ends.release.set_result(None)
    response = ends.result(future)
    assert (response.status, [*response.result.sequence]) == (GoalState.SUCCEEDED, [7])
    # the result is kept
    assert ends.result(handle.get_result_async()) == response


def test_a_client_knows_that_a_goal_is_accepted_before_it_begins(pair):
    futures = []

    def begin(goal):
        spin_until(futures[0].done, pair[1])
        goal.execute()

    ends = Ends(pair, handle_accepted_callback=begin)
    futures.append(ends.client.send_goal_async(Fibonacci.Goal()))
    spin_until(lambda: ends.goals, pair[0])
    assert futures[0].result().accepted


def test_ctrl_c_ends_a_goal_at_its_next_feedback(pair):
    ends = Ends(pair)
    ends.send()
    ends.until(lambda: ends.goals)
    pair[0].context.invalidate()
    with pytest.raises(RobotError, match="the context is shut down"):
        ends.goals[0].publish_feedback(Fibonacci.Feedback())


def test_all_feedback_comes_before_the_result(pair):
    server, client = pair
    ends = Ends(pair)
    result = ends.send(order=0).get_result_async()
    ends.until(lambda: ends.goals)
    for number in range(8):
        ends.goals[0].publish_feedback(Fibonacci.Feedback(sequence=[number]))
    ends.release.set_result(None)
    spin_until(lambda: ends.goals[0].response.done(), server)
    for _ in range(5):
        server.executor.spin_once(timeout_sec=0.01)
    client.executor.spin_until_future_complete(result, LONG)
    assert result.result().status == GoalState.SUCCEEDED
    assert [message.feedback.sequence[0] for message in ends.feedback] == [*range(8)]


def test_a_callback_of_a_goal_that_fails_is_not_silent(pair):
    ends = Ends(pair)
    failed = ends.client.send_goal_async(Fibonacci.Goal())
    failed.add_done_callback(lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        ends.until(lambda: False)


def test_a_goal_can_be_rejected(pair):
    ends = Ends(pair, goal_callback=lambda goal: [*GoalResponse][goal.order])
    assert not ends.send(order=0).accepted
    assert ends.send(order=1).accepted
    ends.until(lambda: len(ends.goals) == 1)


def test_a_callback_that_decides_nothing_rejects(pair):
    ends = Ends(pair, goal_callback=lambda _: True)
    assert not ends.send().accepted


def test_a_goal_can_be_cancelled(pair):
    ends = Ends(pair, cancel_callback=lambda _: CancelResponse.ACCEPT)
    handle = ends.send()
    answer = ends.result(handle.cancel_goal_async())
    assert answer.return_code == CancelCode.ERROR_NONE
    assert [[*each.goal_id.uuid] for each in answer.goals_canceling] == [[*handle.goal_id.uuid]]
    assert ends.goals[0].status == GoalState.CANCELING
    assert ends.goals[0].is_cancel_requested
    ends.release.set_result(None)
    assert ends.result(handle.get_result_async()).status == GoalState.CANCELED
    # a goal that has ended is not cancelled again
    assert ends.result(handle.cancel_goal_async()).return_code == CancelCode.ERROR_GOAL_TERMINATED


def test_a_server_rejects_cancelling_unless_it_is_told_to_accept(pair):
    ends = Ends(pair)
    handle = ends.send()
    answer = ends.result(handle.cancel_goal_async())
    assert (answer.return_code, answer.goals_canceling) == (CancelCode.ERROR_REJECTED, [])
    assert not ends.goals[0].is_cancel_requested
    ends.release.set_result(None)
    assert ends.result(handle.get_result_async()).status == GoalState.SUCCEEDED


def test_all_goals_or_those_before_a_time_can_be_cancelled(pair):
    ends = Ends(pair, cancel_callback=lambda _: CancelResponse.ACCEPT)
    first, second, third = ends.send(), ends.send(), ends.send()
    client = pair[1].create_client(CancelGoal, "count/_action/cancel_goal")
    request = CancelGoal.Request()
    request.goal_info.stamp = second.stamp
    answer = ends.result(client.call_async(request))
    cancelled = [bytes(each.goal_id.uuid) for each in answer.goals_canceling]
    assert cancelled == [bytes(each.goal_id.uuid) for each in (first, second)]
    answer = ends.result(client.call_async(CancelGoal.Request()))
    assert [bytes(each.goal_id.uuid) for each in answer.goals_canceling] == [
        bytes(third.goal_id.uuid)
    ]


def test_one_goal_is_cancelled_when_a_simulation_begins(pair):
    pair[0].set_parameters([Parameter("use_sim_time", value=True)])
    ends = Ends(pair, cancel_callback=lambda _: CancelResponse.ACCEPT)
    first, second = ends.send(), ends.send()
    assert first.stamp == second.stamp == type(first.stamp)()
    answer = ends.result(second.cancel_goal_async())
    assert [[*each.goal_id.uuid] for each in answer.goals_canceling] == [[*second.goal_id.uuid]]


def test_a_goal_can_be_aborted(pair):
    ends = Ends(pair)
    ends.finish = "abort"
    handle = ends.send()
    ends.release.set_result(None)
    response = ends.result(handle.get_result_async())
    assert (response.status, [*response.result.sequence]) == (GoalState.ABORTED, [3])


@pytest.mark.parametrize("outcome", [None, 3, "raise"])
def test_a_callback_without_a_result_aborts_the_goal(pair, outcome, capfd):
    def execute(goal):
        if outcome == "raise":
            raise ZeroDivisionError
        return outcome

    ends = Ends(pair, execute_callback=execute)
    response = ends.result(ends.send().get_result_async())
    assert (response.status, [*response.result.sequence]) == (GoalState.ABORTED, [])
    assert "the callback that executes goals" in capfd.readouterr().err


def test_a_goal_that_ended_cannot_end_again(pair):
    ends = Ends(pair)
    handle = ends.send()
    ends.release.set_result(None)
    ends.result(handle.get_result_async())
    with pytest.raises(RuntimeError, match="SUCCEEDED cannot become ABORTED"):
        ends.goals[0].abort()
    with pytest.raises(RuntimeError, match="SUCCEEDED cannot become CANCELED"):
        ends.goals[0].canceled()


def test_several_goals_run_at_once_and_keep_their_feedback(pair):
    ends = Ends(pair)
    feedback = [[] for _ in range(4)]
    futures = [
        ends.client.send_goal_async(Fibonacci.Goal(order=order), feedback[order].append)
        for order in range(4)
    ]
    handles = [ends.result(future) for future in futures]
    results = [handle.get_result_async() for handle in handles]
    ends.until(lambda: [*map(len, feedback)] == [0, 1, 2, 3])
    ends.release.set_result(None)
    assert [ends.result(future).result.sequence[0] for future in results] == [0, 1, 2, 3]


def test_a_deferred_goal_begins_when_the_node_wants(pair):
    accepted = []
    ends = Ends(pair, handle_accepted_callback=accepted.append)
    handle = ends.send()
    ends.until(lambda: accepted)
    assert not ends.goals
    assert accepted[0].status == GoalState.ACCEPTED
    accepted[0].execute()
    ends.until(lambda: ends.goals)
    ends.release.set_result(None)
    assert ends.result(handle.get_result_async()).status == GoalState.SUCCEEDED


def test_late_clients_get_the_states_of_goals(pair, address):
    ends = Ends(pair)
    ends.send()
    ends.until(lambda: ends.goals)
    states = []
    with node_at(address, "late") as late:
        kind = standard("action_msgs/msg/GoalStatusArray").kind
        late.create_subscription(kind, "count/_action/status", states.append, LATCHED)
        spin_until(
            lambda: (
                states and [goal.status for goal in states[-1].status_list] == [GoalState.EXECUTING]
            ),
            late,
        )


def test_results_are_forgotten_after_their_time(pair):
    ends = Ends(pair, result_timeout=0)
    handle = ends.send()
    ends.release.set_result(None)
    ends.until(lambda: ends.goals and ends.goals[0].status == GoalState.SUCCEEDED)
    assert ends.result(handle.get_result_async()).status == GoalState.UNKNOWN


def test_a_server_that_goes_is_noticed(address):
    with node_at(address, "client") as client:
        with node_at(address, "server") as server:
            ends = Ends((server, client))
            handle = ends.send()
            future = handle.get_result_async()
        spin_until(lambda: not ends.client.server_is_ready(), client)
        assert not ends.client.wait_for_server(timeout_sec=0)
        assert not future.done() or future.exception()


def test_a_client_that_goes_disturbs_nobody(address):
    with node_at(address, "server") as server:
        with node_at(address, "client") as client:
            ends = Ends((server, client))
            ends.send().get_result_async()
            ends.until(lambda: ends.goals)
        with node_at(address, "another") as another:
            other = ActionClient(another, Fibonacci, "count")
            spin_until(other.server_is_ready, server, another)
            ends.release.set_result(None)
            sent = other.send_goal_async(Fibonacci.Goal(order=1))
            spin_until(sent.done, server, another)
            future = sent.result().get_result_async()
            spin_until(future.done, server, another)
            assert future.result().status == GoalState.SUCCEEDED


def test_names_of_actions_are_replaced(address):
    arguments = ["--ros-args", "-r", "count:=/other/count"]
    with (
        node_at(address, "server", cli_args=arguments) as server,
        node_at(address, "client") as client,
    ):
        ActionServer(server, Fibonacci, "count", lambda _: Fibonacci.Result())
        spin_until(ActionClient(client, Fibonacci, "/other/count").server_is_ready, client)


def test_other_types_are_errors(pair):
    ends = Ends(pair)
    with pytest.raises(TypeError, match=r"not a Fibonacci\.Goal"):
        ends.client.send_goal_async(Fibonacci.Result())
    ends.send()
    ends.until(lambda: ends.goals)
    with pytest.raises(TypeError, match=r"not a Fibonacci\.Feedback"):
        ends.goals[0].publish_feedback(Fibonacci.Goal())
    with pytest.raises(TypeError, match="not callable"):
        ActionServer(pair[0], Fibonacci, "other", None)


# hostile


def test_an_id_can_be_used_once(pair):
    ends = Ends(pair)
    client = pair[1].create_client(NEW, "count/_action/send_goal")
    request = NEW.Request(goal=Fibonacci.Goal(order=1))
    request.goal_id.uuid = [7] * 16
    assert ends.result(client.call_async(request)).accepted
    assert not ends.result(client.call_async(request)).accepted
    ends.until(lambda: ends.goals)
    assert len(ends.goals) == 1


def test_unknown_goals_have_no_result_and_cannot_be_cancelled(pair):
    ends = Ends(pair)
    goal_id = RESULT.Request().goal_id
    goal_id.uuid = [9] * 16
    stranger = ClientGoalHandle(ends.client, goal_id, NEW.Response(accepted=True))
    response = ends.result(stranger.get_result_async())
    assert response.status == GoalState.UNKNOWN
    answer = ends.result(stranger.cancel_goal_async())
    assert answer.return_code == CancelCode.ERROR_UNKNOWN_GOAL_ID


def test_mutated_requests_neither_crash_nor_stop_a_server(pair):
    ends = Ends(
        pair,
        execute_callback=lambda _: Fibonacci.Result(),  # `order` may be large
        cancel_callback=lambda _: CancelResponse.ACCEPT,
        result_timeout=0,
    )
    source = random.Random(29)
    requests = [NEW.Request(goal=Fibonacci.Goal(order=2)), RESULT.Request(), CancelGoal.Request()]
    services = [each for each in pair[0].endpoints if isinstance(each, Service)]
    services = [each for each in services if each.srv_name.startswith("/count/_action/")]
    dropped = []
    for number in range(10_000):
        service = services[number % 3]
        kind = requests[[NEW, CancelGoal, RESULT].index(service.interface.kind) * 2 % 3]
        data = bytearray(kind.serialize())
        for _ in range(source.randint(1, 4)):
            data[source.randrange(len(data))] = source.randrange(256)
        cut = bytes(data[: source.randrange(len(data) + 1)] if source.random() < 0.2 else data)
        # as the transport hands it over: a round trip of each would test Zenoh
        attachment = number.to_bytes(8, "little") + bytes(8) + b"\x10" + bytes(16)
        service._receive(
            SimpleNamespace(
                payload=cut,
                attachment=attachment if source.random() < 0.9 else attachment[: number % 33],
                reply=lambda *_: dropped.append("reply"),
                drop=lambda: dropped.append("drop"),
            )
        )
        if number % 30 == 29:  # each queue holds ten
            spin_until(lambda: not any(service._queue for service in services), pair[0])
    spin_until(lambda: len(dropped) == 10_000, pair[0])
    assert {*dropped} == {"reply", "drop"}
    assert ends.send().accepted
