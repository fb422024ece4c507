"""`python -m idlc.robot my_node.py`: run a node of rclpy where there is no rclpy."""

from __future__ import annotations

import sys

_USAGE = """\
Usage: python -m idlc.robot [FILE | -m MODULE] [ARGUMENTS]...

  Run a node that was written for rclpy, on a machine without rclpy. The
  node speaks the protocol of rmw_zenoh. ARGUMENTS are arguments for the
  node, such as `--ros-args -r a:=b`.
  docs/robot-nodes.md lists the names of rclpy that idlc offers.
"""


def main(words: list[str]) -> int:
    """Run the node that the command line names; return the exit status."""
    is_module = words[:1] == ["-m"]
    words = words[is_module:]
    if words[:1] in (["-h"], ["--help"]):
        sys.stdout.write(_USAGE)
        return 0
    if not words or words[0].startswith("-"):
        return _refuse("FILE or MODULE is missing", "write `python -m idlc.robot my_node.py`")
    from idlc.robot.errors import RobotError
    from idlc.robot.offer.program import run

    try:
        run(words[0], words[1:], is_module=is_module)
    except RobotError as error:
        return _refuse(error.message, error.hint or "see docs/robot-nodes.md")
    return 0


def _refuse(message: str, hint: str) -> int:
    sys.stderr.write(f"error: {message}\n  = hint: {hint}\n")
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
