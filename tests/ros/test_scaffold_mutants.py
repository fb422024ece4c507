"""The generated test of a node notices what a person, or a changed interface, breaks in the node.

Each mutant is a generated node with one thing broken. Its test must fail, and show what the
node printed. `make test-long` takes every sixth mutant, `make fuzz` all of them.
"""

import os
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support import programs
from tests.support.nodes import next_without_drop
from tests.support.rounds import FUZZING

pytestmark = pytest.mark.long

EVERY = 1 if FUZZING else 6
AT_ONCE = 4
MARK = "this is the mutant"
#: How long a mutant's test waits for what never happens.
PATIENCE = "6.0"
NODES = {
    "publisher": ["--publisher", "std_msgs/String:chatter@10"],
    "subscriber": ["--subscriber", "std_msgs/String:chatter"],
    "service": ["--service", "std_srvs/SetBool:switch"],
    "client": ["--client", "std_srvs/SetBool:switch"],
    "action_server": ["--action-server", "test_msgs/Fibonacci:count"],
    "action_client": ["--action-client", "test_msgs/Fibonacci:count"],
    "timed": ["--timer", "0.1", "--param", "speed:double=0.5", "--param", "names:string[]=a,b"],
    "managed": [
        *("--publisher", "std_msgs/String:chatter@10", "--subscriber", "std_msgs/String:heard"),
        *("--service", "std_srvs/SetBool:switch", "--timer", "0.1", "--lifecycle"),
    ],
    "managed_client": [
        *("--client", "std_srvs/SetBool:switch", "--lifecycle"),
        *("--action-client", "test_msgs/Fibonacci:count"),
    ],
    "managed_actor": ["--action-server", "test_msgs/Fibonacci:count", "--lifecycle"],
}
SHORT = ("publisher", "subscriber", "service", "client", "action_server", "action_client", "timed")
RAISES = "raise RuntimeError('broken')"
ENDS = "                raise\n"
ENDING = {
    "dies at its start": (
        "        super().__init__(",
        f"        {RAISES}\n        super().__init__(",
    ),
    "does not end": (ENDS, f"{ENDS}    __import__('time').sleep(99)\n"),
    "ends with a traceback": ("suppress(KeyboardInterrupt, ", "suppress("),
    "ends with another status": (ENDS, f"{ENDS}    raise SystemExit(3)\n"),
    "has another name": ("        super().__init__('", "        super().__init__('x"),
}
ENDING_ONCE = {
    "dies at its start": ENDING["dies at its start"],
    "does not end": ("interrupted.set()", "None"),
    "always fails": ("return 0 if all(task.result() for task in tasks) else 1", "return 1"),
    "never fails": ("return 0 if all(task.result() for task in tasks) else 1", "return 0"),
    "hides that it was interrupted": ("return 130", "return 0"),
}
PUBLISHING = {
    "uses a field that is gone": ("data='hello'", "data=String.HELLO"),
    "has a typing error": ("_publisher.publish(", "_publisher.publsh("),
    "raises": ("        message = String(", f"        {RAISES}\n        message = String("),
    "publishes elsewhere": ("'chatter'", "'chatter2'"),
    "publishes once": (
        "_publisher.publish(message)",
        "_publisher.publish(message)\n        self.chatter_timer.cancel()",
    ),
    "never publishes": ("        self.chatter_publisher.publish(message)\n", ""),
}
SAYS = "        self.get_logger().info(f'"
SUBSCRIBING = {
    "uses a field that is gone": ("message.data", "message.date"),
    "raises": (SAYS, f"        {RAISES}\n{SAYS}"),
    "raises after the first message": ("{message.data=}')\n", f"message')\n        {RAISES}\n"),
    "listens elsewhere": ("'chatter'", "'chatter2'"),
    "listens to another type": ("std_msgs.msg import", "std_msgs.msg import Header as String #"),
    "ignores messages": (SAYS, f"        return\n{SAYS}"),
}
SERVING = {
    "uses a field that is gone": ("request.data", "request.date"),
    "raises": ("        return response\n", f"        {RAISES}\n"),
    "answers something else": ("        return response\n", "        return request\n"),
    "answers nothing": ("        return response\n", "        pass\n"),
    "serves another name": ("'switch',", "'xswitch',"),
    "serves another type": ("import SetBool", "import Trigger as SetBool"),
    "says nothing": (SAYS, f"        return response\n{SAYS}"),
}
CALLING = {
    "uses a field that is gone": ("{response=}", "{response.succes=}"),
    "never calls": ("self.switch_client.call_async(request)", "Future()"),
    "calls another name": ("'switch'", "'xswitch'"),
    "calls another type": ("import SetBool", "import Trigger as SetBool"),
    "ignores the answer": ("f'switch: ", "f'something"),
    "makes no request": ("return SetBool.Request(", "return SetBool.Response("),
}
ACTING = {
    "uses a field that is gone": ("goal.order", "goal.ordr"),
    "raises": ("        for _ in range(5):\n", f"        {RAISES}\n        for _ in range(5):\n"),
    "acts on another name": ("'count'", "'count2'"),
    "rejects goals": ("GoalResponse.ACCEPT", "GoalResponse.REJECT"),
    "never begins": ("        goal_handle.execute()\n", ""),
    "ignores the goal": (SAYS, f"        return result\n{SAYS}"),
    "reports nothing": ("            goal_handle.publish_feedback(feedback)\n", ""),
    "never succeeds": ("        goal_handle.succeed()\n", "        goal_handle.abort()\n"),
    "refuses to cancel": ("CancelResponse.ACCEPT", "CancelResponse.REJECT"),
    "does not stop when cancelled": ("if goal_handle.is_cancel_requested", "if False"),
    "goes on with the goal before": ("            before.abort()\n", ""),
}
SENDING = {
    "uses a field that is gone": ("{feedback=}", "{feedback.order=}"),
    "sends no goal": ("        sent = self.", "        return True\n        sent = self."),
    "sends to another name": ("'count'", "'count2'"),
    "ignores reports": ("            feedback_callback=self.follow_count_goal,\n", ""),
    "ignores the result": ("{result=}", ""),
    "raises at the end": ("return bool(ending.result().status", "return bool(ending.status"),
}
SHUT = "        self.undo_configure.close()\n        return super().on_shutdown(state)\n"
MANAGED = {
    "cannot be configured": (
        "        return super().on_configure(state)\n",
        "        return TransitionCallbackReturn.FAILURE\n",
    ),
    "raises when activated": ("        return super().on_activate(state)\n", f"        {RAISES}\n"),
    "goes on after a shutdown": (SHUT, SHUT.replace("configure.close()", "configure.pop_all()")),
    "goes on after a clean-up": (
        "        self.undo_configure.close()\n        return super().on_cleanup",
        "        return super().on_cleanup",
    ),
}
TIMED = {
    "never ticks": ("            0.1,\n", "            1e6,\n"),
    "raises at the first tick": ("info('tick')", "inform('tick')"),
    "raises after the first tick": ("info('tick')\n", f"info('tick')\n        {RAISES}\n"),
    "does not declare a parameter": ("self.declare_parameter('speed', 0.5)", "pass"),
    "has another default": ("'speed', 0.5", "'speed', 0.25"),
    "has a default of another type": ("'names', ['a', 'b']", "'names', 'a, b'"),
    "has a parameter of another name": ("_parameter('speed'", "_parameter('sped'"),
}
ENDED = "        if ok() and not isinstance(error, KeyboardInterrupt):"
SHORT_ENDING = {
    "dies at its start": ENDING["dies at its start"],
    "does not end": (ENDED, f"        __import__('time').sleep(99)\n{ENDED}"),
    "ends with a traceback": (ENDED, "        if True:"),
    "ends with another status": (ENDED, f"        raise SystemExit(3)\n{ENDED}"),
    "has another name": ENDING["has another name"],
}
#: In a short node, this code is elsewhere or is not there.
GONE = {"rejects goals", "never begins", "goes on with the goal before", "raises at the end"}
SHORT_CALLING = {"makes no request": ("SetBool.Request(data", "SetBool.Response(data")}
SHORT_SENDING = {"ignores reports": (", feedback_callback=self.follow_count_goal", "")}
SHORT_TIMED = {"never ticks": ("create_timer(0.1,", "create_timer(1e6,")}


def without_gone(mutants: dict[str, tuple[str, str]]) -> dict[str, tuple[str, str]]:
    return {name: change for name, change in mutants.items() if name not in GONE}


MUTANTS = {
    "short_publisher": {**PUBLISHING, **SHORT_ENDING},
    "short_subscriber": {**SUBSCRIBING, **SHORT_ENDING},
    "short_service": {**SERVING, **SHORT_ENDING},
    "short_client": {**CALLING, **SHORT_CALLING, **SHORT_ENDING},
    "short_action_server": {**without_gone(ACTING), **SHORT_ENDING},
    "short_action_client": {**without_gone(SENDING), **SHORT_SENDING, **SHORT_ENDING},
    "short_timed": {**TIMED, **SHORT_TIMED, **SHORT_ENDING},
    "publisher": {**ENDING, **PUBLISHING},
    "subscriber": {**SUBSCRIBING, **ENDING},
    "service": {**SERVING, **ENDING},
    "client": {**CALLING, **ENDING_ONCE},
    "action_server": {**ACTING, **ENDING},
    "action_client": {
        **SENDING,
        **ENDING_ONCE,
        "leaves its goal alone when it ends": ("sent.result().cancel_goal_async()", "Future()"),
    },
    "timed": {**TIMED, **ENDING},
    "managed": {**MANAGED, **PUBLISHING},
    "managed_client": {**MANAGED, **CALLING},
    "managed_actor": {**MANAGED, **ACTING},
}


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """Return a package with a node for each role."""
    folder = tmp_path_factory.mktemp("mutants")
    here = Path.cwd()
    try:
        os.chdir(folder)
        assert main(["scaffold", "package", "demo"]) == 0
        os.chdir("demo")
        for name, words in NODES.items():
            assert main(["scaffold", "node", f"{name}_node", "--robust", *words]) == 0
        for name in SHORT:
            assert main(["scaffold", "node", f"short_{name}_node", *NODES[name]]) == 0
    finally:
        os.chdir(here)
    return folder / "demo"


def run(package: Path, folder: Path, node: str, change: tuple[str, str]) -> tuple[int, str]:
    """Return the status of a node's test after a change, and what it printed."""
    short = node.startswith("short_")
    tests = "test" if short else "test/robust"
    module, test = f"demo/{node}_node.py", f"{tests}/test_{node}_node.py"
    for path in ("demo/__init__.py", module, f"{tests}/conftest.py", test):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(package / path, folder / path)
    text = (folder / module).read_text()
    assert change[0] in text, f"{node}: nothing to break: {change[0]}"
    if change[0]:
        text = text.replace(*change)
        (folder / module).write_text(
            text.replace("\nimport rclpy\n", f"\nprint('{MARK}')\nimport rclpy\n", 1)
        )
        conftest = (folder / tests / "conftest.py").read_text()
        patience = "seconds: float = " if short else "PATIENCE = "
        assert f"{patience}20.0" in conftest
        shorter = conftest.replace(f"{patience}20.0", f"{patience}{PATIENCE}")
        (folder / tests / "conftest.py").write_text(shorter)
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", test]
    plain = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return programs.ended(*command, cwd=folder, environment={**os.environ, **plain})


def test_nodes_that_nobody_broke_pass(package, tmp_path):
    def one(node):
        attempts = (run(package, tmp_path / f"{node}{n}", node, ("", "")) for n in range(3))
        return next_without_drop(attempts)

    with ThreadPoolExecutor(AT_ONCE) as pool:
        everything = [*NODES, *(f"short_{node}" for node in SHORT)]
        for node, (status, said) in zip(everything, pool.map(one, everything), strict=True):
            assert status == 0, f"{node}: {said}"


@pytest.mark.parametrize("node", MUTANTS)
def test_what_is_broken_is_noticed(package, tmp_path, node):
    turn = list(MUTANTS).index(node)
    chosen = [one for n, one in enumerate(MUTANTS[node].items()) if (n + turn) % EVERY == 0]

    def one(mutant):
        name, change = mutant
        return run(package, tmp_path / name.replace(" ", "_"), node, change)

    unnoticed = []
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for (name, _), (status, said) in zip(chosen, pool.map(one, chosen), strict=True):
            if status != 1 or MARK not in said:
                unnoticed.append(f"a {node} that {name}: {status}\n{said}")
    assert unnoticed == [], "\n".join(unnoticed)
