"""Running a program: a file or a module, as Python does it."""

from __future__ import annotations

import re
import runpy
import sys
from importlib.util import find_spec
from pathlib import Path

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.offer.importer import install, not_offered

_NAME = re.compile(r"cannot import name '(\w+)'")


def run(target: str, arguments: list[str], *, is_module: bool) -> None:
    """Run a node of rclpy to its end, without rclpy; raise RobotError if that is impossible.

    A file that belongs to a package runs as a module of it, so that it can import its neighbours.
    Exceptions of the program are its own, SystemExit included.
    """
    module = target if is_module else None
    if module is None:
        path = Path(target)
        if not path.is_file():
            raise RobotError(f"`{one_line(target)}` is not a file", "name a node's .py file")
        folder, name = path.resolve().parent, path.stem
        while (folder / "__init__.py").is_file() and folder.parent != folder:
            folder, name, module = folder.parent, f"{folder.name}.{name}", f"{folder.name}.{name}"
        sys.path.insert(0, str(folder))
    else:
        sys.path.insert(0, str(Path.cwd()))
    _refuse_with_rclpy(target, is_module=is_module)
    install()
    sys.argv = [target, *arguments]
    try:
        if module is None:
            runpy.run_path(target, run_name="__main__")
        else:
            runpy.run_module(module, run_name="__main__", alter_sys=True)
    except ImportError as error:
        # `from rclpy.node import X` loses the message of the module
        match = _NAME.match(str(error))
        if match is None or not f"{error.name}.".startswith("rclpy."):
            raise
        raise ImportError(not_offered(f"{error.name}.{match[1]}"), name=error.name) from error


def _refuse_with_rclpy(target: str, *, is_module: bool) -> None:
    spec = find_spec("rclpy")
    if spec is not None:
        word = f"-m {target}" if is_module else target
        raise RobotError(
            f"rclpy is installed ({one_line(spec.origin or 'as a folder')})",
            f"run the node with it: `{Path(sys.executable).name} {one_line(word)}`",
        )
