"""Run a node that was written for rclpy, on a machine without rclpy.

  Usage: python -m idlc.robot [FILE | -m MODULE] [ARGUMENTS]...

The node speaks DDS, or Zenoh if RMW_IMPLEMENTATION is rmw_zenoh_cpp. ARGUMENTS are arguments for
the node, such as `--ros-args -r a:=b`. docs/robot-nodes.md lists the names of rclpy that idlc
offers.
"""

from __future__ import annotations

import runpy
import shlex
import sys
from importlib.util import find_spec
from pathlib import Path

from idlc.diagnostics.text import one_line
from idlc.project.files import near_path
from idlc.robot.errors import RobotError
from idlc.robot.offer import Importer


def main(words: list[str]) -> int:
    """Run the node that the command line names; return the exit status."""
    if words[:1] in (["-h"], ["--help"]):
        sys.stdout.write(__doc__)
        return 0
    try:
        run(words)
    except RobotError as error:
        hint = error.hint or "see docs/robot-nodes.md"
        sys.stderr.write(f"error: {error.message}\n  = hint: {hint}\n")
        return 2
    return 0


def run(words: list[str]) -> None:
    """Run a node of rclpy to its end, without rclpy; raise RobotError if that is impossible.

    A file that belongs to a package runs as a module of it, so that it can import its neighbours.
    Exceptions of the program are its own, SystemExit included.
    """
    is_module = words[:1] == ["-m"]
    words = words[is_module:]
    if not words or words[0].startswith("-"):
        raise RobotError("FILE or MODULE is missing", "write `python -m idlc.robot my_node.py`")
    target = words[0]
    folder, module = Path.cwd(), target
    if not is_module:
        path = Path(target).resolve()
        if not path.is_file():
            hint = near_path(target, Path(target).absolute()) or "name a node's .py file"
            raise RobotError(f"`{one_line(target)}` is not a file", hint)
        folder, module = path.parent, path.stem
        while (folder / "__init__.py").is_file() and folder.parent != folder:
            folder, module = folder.parent, f"{folder.name}.{module}"
            is_module = True
    elif target.endswith(".py"):  # to look for it would run it
        hint = f"write `python -m idlc.robot {shlex.quote(one_line(target))}`"
        raise RobotError(f"`{one_line(target)}` is the name of a file, not of a module", hint)
    sys.path.insert(0, str(folder))
    if (spec := find_spec("rclpy")) is not None:
        problem = f"rclpy is installed ({one_line(spec.origin or 'as a folder')})"
        command = shlex.join(["python", *sys.argv[1:]])
        raise RobotError(problem, f"run the node with it: `{one_line(command)}`")
    sys.meta_path.append(Importer())
    sys.argv = words
    if is_module:
        _check(module)
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    else:
        runpy.run_path(target, run_name="__main__")


def _check(module: str) -> None:
    """Raise RobotError for a module that does not exist."""
    parent = module.rpartition(".")[0]
    try:
        is_there = find_spec(module) is not None
    except ModuleNotFoundError as error:
        if error.name is None or not f"{parent}.".startswith(f"{error.name}."):
            raise  # the package cannot import another
        is_there = False
    if not is_there:
        hint = "change to the folder that contains it, or name its .py file"
        raise RobotError(f"there is no module `{one_line(module)}` here", hint)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
