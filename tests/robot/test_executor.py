"""The executor, futures, tasks, timers, clocks, arguments and loggers, without a network."""

import asyncio
import sys
import threading
import time

import pytest

from idlc.robot import (
    Clock,
    ClockType,
    Context,
    Duration,
    Executor,
    ExternalShutdownException,
    Future,
    GuardCondition,
    MultiThreadedExecutor,
    MutuallyExclusiveCallbackGroup,
    RobotError,
    Time,
    Timer,
    get_logger,
    remove_ros_args,
)
from idlc.robot.nodes.arguments import Arguments, parse_arguments
from idlc.robot.nodes.endpoints import MOST_QUEUED, Bounded
from idlc.robot.nodes.logger import LoggingSeverity
from idlc.robot.qos import HistoryPolicy, QoSProfile
from tests.support.waiting import LIMIT

SECOND = 10**9
HOUR = 3600


class Timers:
    """A node that has timers only."""

    executor = None

    def __init__(self, *timers):
        self.timers = timers

    def attach(self, executor):
        self.executor = executor
        for timer in self.timers:
            timer.attach(executor)


@pytest.fixture
def executor():
    context = Context()
    context.init([])
    with context, Executor(context=context) as executor:
        yield executor


def simulated():
    clock = Clock(clock_type=ClockType.ROS_TIME)
    clock.simulated = 0
    return clock


# futures and tasks


def test_asyncio_awaits_futures_while_it_spins_the_executor(executor):
    async def add(future):
        return await future + 1

    async def main():
        first = Future()
        task = asyncio.create_task(add(first))
        other = executor.create_task(add(first))
        for _ in range(3):
            executor.spin_once(timeout_sec=0)
            await asyncio.sleep(0)
        assert (task.done(), other.done()) == (False, False)
        first.set_result(1)
        while not other.done():
            executor.spin_once(timeout_sec=0)
        return await task, other.result()

    assert asyncio.run(asyncio.wait_for(main(), LIMIT)) == (2, 2)


def test_a_coroutine_goes_on_when_what_it_awaits_is_there(executor):
    future, seen = Future(), []

    async def wait(number):
        seen.append(number)
        return await future + number

    task = executor.create_task(wait, 2)
    executor.spin_once(timeout_sec=0)
    executor.spin_once(timeout_sec=0)
    assert (seen, task.done()) == ([2], False)
    future.set_result(1)
    executor.spin_until_future_complete(task)
    assert task.result() == 3
    task.cancel()
    assert task.done()


def test_tasks_await_tasks_functions_and_nothing(executor):
    class Nothing:
        def __await__(self):
            yield

    async def outer():
        await Nothing()
        return await executor.create_task(lambda number: number + 1, 1)

    task = executor.create_task(outer())
    executor.spin_until_future_complete(task)
    assert task.result() == 2


def test_exceptions_are_raised_by_the_spin_and_to_who_awaits(executor):
    async def fail():
        raise KeyError("x")

    task = executor.create_task(fail)
    with pytest.raises(KeyError):
        executor.spin_once()
    with pytest.raises(KeyError):
        task.result()
    assert isinstance(task.exception(), KeyError)


def test_a_function_that_raises_stop_iteration_has_no_result(executor):
    task = executor.create_task(next, iter(()))
    with pytest.raises(RuntimeError):
        executor.spin_once()
    assert isinstance(task.exception(), RuntimeError)


def test_a_cancelled_coroutine_does_not_go_on(executor):
    future, seen = Future(), []

    async def wait():
        await future
        seen.append(True)

    task = executor.create_task(wait)
    executor.spin_once(timeout_sec=0)
    task.cancel()
    assert task.cancelled()
    executor.spin_until_future_complete(task)
    future.set_result(None)
    executor.spin_once(timeout_sec=0)
    assert (seen, task.result()) == ([], None)


def test_callbacks_of_futures_run_once(executor):
    future, seen = Future(), []
    future.add_done_callback(seen.append)
    future.set_result(1)
    future.set_result(2)
    future.cancel()
    future.add_done_callback(seen.append)
    assert seen == [future, future]
    assert future.result() == 1
    failed = Future(executor=executor)
    failed.add_done_callback(lambda each: seen.append(each.exception()))
    error = ValueError()
    failed.set_exception(error)
    assert len(seen) == 2
    executor.spin_once(timeout_sec=0)
    assert seen[2] is error


def test_a_callback_can_spin(executor):
    future = Future()

    def outer():
        executor.create_task(future.set_result, 1)
        executor.spin_until_future_complete(future)
        return future.result()

    task = executor.create_task(outer)
    executor.spin_until_future_complete(task)
    assert task.result() == 1


def test_callbacks_of_a_group_wait_while_one_spins(executor):
    clock, calls = simulated(), []

    def spin():
        calls.append("begin")
        for _ in range(3):
            executor.spin_once(timeout_sec=0)
        calls.append("end")

    group = MutuallyExclusiveCallbackGroup()
    timers = Timer(spin, group, 10, clock), Timer(lambda: calls.append("other"), group, 10, clock)
    executor.add_node(Timers(*timers))
    clock.simulated = 10
    executor.spin_once(timeout_sec=0)
    executor.spin_once(timeout_sec=0)
    assert calls == ["begin", "end", "other"]


def test_a_group_goes_on_after_an_interrupt(executor):
    clock, calls = simulated(), []

    def interrupt():
        calls.append(clock.elapsed())
        raise KeyboardInterrupt

    timer = Timer(interrupt, MutuallyExclusiveCallbackGroup(), 10, clock)
    executor.add_node(Timers(timer))
    for now in (10, 20):
        clock.simulated = now
        with pytest.raises(KeyboardInterrupt):
            executor.spin_once(timeout_sec=0)
    assert calls == [10, 20]


def test_waits_end(executor):
    executor.spin_once(timeout_sec=0)
    executor.spin_until_future_complete(Future(), timeout_sec=0.001)
    executor.create_task(executor.context.invalidate)
    executor.spin()
    with pytest.raises(ExternalShutdownException):
        executor.spin_once()
    executor.shutdown()
    executor.spin_once()


def test_shutdown_ends_a_thread_that_spins(executor):
    thread = threading.Thread(target=executor.spin, daemon=True)
    spins = threading.Event()
    executor.create_task(spins.set)
    thread.start()
    assert spins.wait(LIMIT)
    executor.shutdown()
    thread.join(LIMIT)
    assert not thread.is_alive()


# threads


def test_threads_run_callbacks_that_wait_for_each_other():
    """One thread cannot; a mutually exclusive group has one callback at a time all the same."""
    context, barrier, running, most = Context(), threading.Barrier(2), [], []
    context.init([])
    group = MutuallyExclusiveCallbackGroup()

    def exclusive():
        running.append(1)
        most.append(len(running))
        time.sleep(0.001)
        running.pop()

    with context, MultiThreadedExecutor(2, context=context) as executor:
        tasks = [executor.create_task(barrier.wait, LIMIT) for _ in range(2)]
        for task in tasks:
            executor.spin_until_future_complete(task, LIMIT)
        assert sorted(task.result() for task in tasks) == [0, 1]
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        executor.add_node(Timers(*(Timer(exclusive, group, 0, clock) for _ in range(3))))
        while len(most) < 20:
            executor.spin_once(timeout_sec=LIMIT)
        assert set(most) == {1}
        executor.create_task(int, "x")
        with pytest.raises(ValueError, match="invalid literal"):
            executor.spin()


def test_a_condition_calls_back_once_for_triggers_from_any_thread(executor):
    calls = []
    condition = GuardCondition(lambda: calls.append(1), None, Clock())
    executor.add_node(Timers(condition))
    executor.spin_once(timeout_sec=0)
    assert calls == []
    for count in (1, 2):
        for _ in range(2):
            threading.Thread(target=condition.trigger).run()
        executor.spin_once(timeout_sec=LIMIT)
        executor.spin_once(timeout_sec=0)
        assert len(calls) == count


# timers and clocks


@pytest.mark.parametrize("hours", [1, pytest.param(24, marks=pytest.mark.long)])
def test_timers_are_called_on_time(executor, hours):
    clock = simulated()
    calls = {1: 0, 7: 0, 3600: 0}

    def count(period):
        calls[period] += 1
        assert clock.now().nanoseconds % (period * SECOND) == 0

    group = MutuallyExclusiveCallbackGroup()
    timers = [
        Timer(lambda period=period: count(period), group, period * SECOND, clock)
        for period in calls
    ]
    node = Timers(*timers)
    executor.add_node(node)
    for second in range(1, hours * HOUR + 1):
        clock.simulated = second * SECOND
        while any(timer.nanoseconds_left() <= 0 for timer in timers):
            executor.spin_once(timeout_sec=0)
    assert calls == {period: hours * HOUR // period for period in calls}
    assert executor._queue.qsize() == 0


def test_late_calls_are_left_out(executor):
    clock, calls = simulated(), []
    timer = Timer(lambda: calls.append(clock.now().nanoseconds), None, 10, clock)
    executor.add_node(Timers(timer))
    for now in (9, 10, 35, 39, 40):
        clock.simulated = now
        executor.spin_once(timeout_sec=0)
        executor.spin_once(timeout_sec=0)
    assert calls == [10, 35, 40]
    assert timer.nanoseconds_left() == 10


def test_timers_stop_and_begin_again(executor):
    clock, calls = simulated(), []
    timer = Timer(lambda: calls.append(1), None, 10, clock)
    timer.cancel()
    executor.add_node(Timers(timer))
    clock.simulated = 100
    assert timer.is_canceled()
    executor.spin_once(timeout_sec=0)
    timer.reset()
    clock.simulated = 109
    assert timer.nanoseconds_left() == 1
    clock.simulated = 110
    executor.spin_once(timeout_sec=0)
    assert calls == [1]
    clock.simulated = 5  # time moved back: a period begins
    assert timer.nanoseconds_left() == 10
    timer.destroy()
    timer.destroy()
    with pytest.raises(ValueError, match="must not be negative"):
        Timer(None, None, -1, clock)


def test_times_and_durations_are_numbers():
    time = Time(seconds=1, nanoseconds=5)
    assert (time - Time(nanoseconds=5)) == Duration(seconds=1)
    assert (time - Duration(nanoseconds=5)) == Time(seconds=1)
    assert (time + Duration(nanoseconds=1)).nanoseconds == SECOND + 6
    assert time.seconds_nanoseconds() == (1, 5)
    assert Time(nanoseconds=1) < time
    assert Duration(nanoseconds=1) < Duration(nanoseconds=2)
    assert len({time, Time(seconds=1, nanoseconds=5), Duration(seconds=1)}) == 2
    assert Time.from_msg(time.to_msg(), ClockType.SYSTEM_TIME) == time
    before = Duration(nanoseconds=-1).to_msg()
    assert (before.sec, before.nanosec) == (-1, SECOND - 1)
    assert repr(time) == "Time(nanoseconds=1000000005)"
    assert repr(Duration(nanoseconds=1)) == "Duration(nanoseconds=1)"
    with pytest.raises(TypeError, match="are of different clocks"):
        time < Time(clock_type=ClockType.ROS_TIME)  # noqa: B015
    with pytest.raises(ValueError, match="a time must be between"):
        Time(nanoseconds=-1)
    assert Clock(clock_type=ClockType.STEADY_TIME).now().nanoseconds > 0


# queues


def test_queues_are_bounded_in_number_and_bytes():
    queue = Bounded(QoSProfile(depth=2))
    assert [queue.append(item, 10) for item in "abc"] == [[], [], ["a"]]
    assert queue.append("large", MOST_QUEUED * 2) == ["b", "c"]
    assert len(queue) == 1
    assert queue.append("d", 1) == ["large"]
    assert (queue.pop(), queue.pop(), len(queue)) == ("d", None, 0)
    everything = Bounded(QoSProfile(history=HistoryPolicy.KEEP_ALL, depth=1))
    dropped = [everything.append(item, MOST_QUEUED // 4) for item in range(5)]
    assert dropped == [[], [], [], [0], [1]]


# arguments


@pytest.fixture
def lines(monkeypatch, capsys):
    monkeypatch.setattr("idlc.robot.nodes.logger._levels", {})
    return lambda: [line.partition("]: ")[2] for line in capsys.readouterr().err.splitlines()]


def test_arguments_of_ros_are_read(lines, monkeypatch):
    words = ["prog", "a", "--ros-args", "-r", "x:=y", "--remap", "n:__node:=m", "-p", "k:=1", "--"]
    words += ["b", "--ros-args", "-r", "c:=/d", "-r", "__ns:=/e"]
    words += ["--param", "n:k.l:=[1, 2]", "--params-file", "f.yaml", "--log-level", "debug"]
    words += ["--log-level", "a.b:=WARN", "-r", "__name:=z"]
    assert remove_ros_args(words) == ["prog", "a", "b"]
    monkeypatch.setattr("sys.argv", words)
    assert remove_ros_args() == ["prog", "a", "b"]
    arguments = parse_arguments(words)
    assert arguments == Arguments(
        (
            ("", "x", "y"),
            ("n", "__node", "m"),
            ("", "c", "/d"),
            ("", "__ns", "/e"),
            ("", "__node", "z"),
        ),
        (("", "k", "1"), ("n", "k.l", "[1, 2]")),
        ("f.yaml",),
    )
    assert get_logger("c").is_enabled_for(LoggingSeverity.DEBUG)
    assert not get_logger("a.b.c").is_enabled_for(LoggingSeverity.INFO)
    assert arguments.special("n", "__node") == "m"
    assert arguments.special("other", "__node") == "z"
    assert arguments.rename("x", "/s", "n") == "/s/y"
    assert arguments.rename("c", "/", "n") == "/d"
    own = parse_arguments(["--ros-args", "-r", "x:=first", "-p", "k:=2"], arguments)
    assert own.rename("x", "/", "n") == "/first"
    assert own.overrides[-1] == ("", "k", "2")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-r"], "argument -r/--remap: expected one argument ("),
        (["-r", "a b:=c"], "`a b` is not a name; write at most"),
        (["-r", "a"], "`a` is not of the form `old:=new` (write `-r old:=new` or "),
        (["-r", "__node:=a b"], "`a b` is not a name"),
        (["-r", "__ns:=//"], "`//` is not a name"),
        (["-r", "rostopic://a:=b"], "`//a` is not a name; write at most"),
        (["-p", "a"], "`a` is not of the form `parameter:=value` ("),
        (["--log-level", "x"], "`x` is not a level of loggers, such as `debug` or `warn` ("),
        (["--enclave", "/"], "`--enclave` is not an argument of ROS that idlc knows"),
        (["x\n"], "`x\u240a` is not an argument of ROS"),
    ],
)
def test_a_bad_argument_is_one_sentence(words, message):
    with pytest.raises(RobotError) as caught:
        parse_arguments(["--ros-args", *words])
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


# loggers


def test_messages_are_logged_by_level(lines):
    logger = get_logger("a").get_child("b")
    logger.debug("hidden")
    assert logger.info("shown")
    get_logger("a").set_level(LoggingSeverity.ERROR)
    assert not logger.warn("hidden")
    assert logger.fatal("shown")
    assert not logger.is_enabled_for(LoggingSeverity.WARN)
    get_logger("a.b").set_level(LoggingSeverity.DEBUG)
    get_logger("").set_level(LoggingSeverity.WARN)
    assert logger.debug("shown")
    assert not get_logger("c").info("hidden")
    assert lines() == ["shown"] * 3


def test_a_line_can_log_once_or_now_and_then(lines, monkeypatch):
    logger, seconds = get_logger("a"), 0
    monkeypatch.setattr("time.monotonic", lambda: seconds)
    for now in range(5):
        seconds = now
        logger.info(f"once {now}", once=True)
        logger.info(f"now {now}", throttle_duration_sec=2)
    logger.info("x", throttle_duration_sec=10**9)
    assert lines() == ["once 0", "now 0", "now 2", "now 4", "x"]


def test_the_format_is_that_of_ros(capsys, monkeypatch):
    get_logger("a").error("x")
    text = capsys.readouterr().err
    assert text.startswith("[ERROR] [")
    assert text.endswith("] [a]: x\n")
    monkeypatch.setattr(sys, "stderr", None)
    assert get_logger("a").error("x")
