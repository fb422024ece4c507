"""`--ros-args`: names to replace, values of parameters, and levels of loggers."""

from __future__ import annotations

import re
import sys
from argparse import ArgumentError, ArgumentParser
from collections.abc import Sequence
from typing import NamedTuple

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.names import expand_name, expand_namespace
from idlc.robot.nodes.logger import LoggingSeverity, get_logger

_RULE = re.compile(r"(?:(\w+):)?([^:=]+):=(.+)", re.ASCII)
_PARAMETER = re.compile(r"(?:([\w/*]+):)?([^:=]+):=(.*)", re.ASCII | re.DOTALL)
_HINT = "write `-r old:=new` or `-p parameter:=value`; `--` ends the arguments of ROS"


class Arguments(NamedTuple):
    """The arguments after `--ros-args`."""

    #: A node or nothing for all of them, a name or `__node` or `__ns` for the node itself, and the
    #: name that replaces it.
    remaps: tuple[tuple[str, str, str], ...] = ()
    #: A node or nothing for all of them, a parameter, and its value as YAML text.
    overrides: tuple[tuple[str, ...], ...] = ()
    parameter_files: tuple[str, ...] = ()

    def special(self, node: str, source: str) -> str | None:
        """Return the replacement of `__node` or `__ns` for a node that the program calls `node`."""
        rules = (rule for rule in self.remaps if rule[0] in ("", node) and rule[1] == source)
        return next((target for *_, target in rules), None)

    def rename(self, name: str, namespace: str, node: str) -> str:
        """Return the absolute name of a topic or service that a node calls `name`.

        Raises InvalidNameError.
        """
        absolute = expand_name(name, namespace, node)
        for only, source, target in self.remaps:
            if only in ("", node) and absolute == expand_name(source, namespace, node):
                return expand_name(target, namespace, node)
        return absolute


_NONE = Arguments()


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """Return arguments, `sys.argv` by default, without `--ros-args` and the words up to `--`."""
    return _split(sys.argv if args is None else args)[0]


def parse_arguments(args: Sequence[str], others: Arguments = _NONE) -> Arguments:
    """Return the arguments after `--ros-args`, and set the levels of loggers that they name.

    They count before the others. Raises RobotError if an argument is not valid.
    """
    parser = ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    for flags in (("-r", "--remap"), ("-p", "--param"), ("--params-file",), ("--log-level",)):
        parser.add_argument(*flags, action="append", default=[])
    try:
        known, unknown = parser.parse_known_args(_split(args)[1])
        if unknown:
            raise ValueError(f"`{unknown[0]}` is not an argument of ROS that idlc knows")
        for text in known.log_level:
            _set_level(text)
        # the first rule for a name counts, but the last value of a parameter
        remaps = *map(_remap, known.remap), *others.remaps
        overrides = (_match(_PARAMETER, text, "parameter:=value") for text in known.param)
        files = *others.parameter_files, *known.params_file
        return Arguments(remaps, (*others.overrides, *overrides), files)
    except (ArgumentError, ValueError) as error:
        raise RobotError(one_line(str(error)), _HINT) from None


def _split(args: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the other arguments, and those of ROS."""
    parts: tuple[list[str], list[str]] = [], []
    is_ros = False
    for word in args:
        if word == "--ros-args" or (is_ros and word == "--"):
            is_ros = word == "--ros-args"
        else:
            parts[is_ros].append(word)
    return parts


def _remap(text: str) -> tuple[str, str, str]:
    node, source, target = _match(_RULE, text, "old:=new")
    source = "__node" if source == "__name" else source
    expand_name(source, "/", "node")
    if source == "__ns":
        expand_namespace(target)
    else:
        expand_name(target, "/", "node")
    return node, source, target


def _match(pattern: re.Pattern[str], text: str, form: str) -> tuple[str, ...]:
    match = pattern.fullmatch(text)
    if match is None:
        raise ValueError(f"`{text}` is not of the form `{form}`")
    return match.groups(default="")


def _set_level(text: str) -> None:
    name, _, level = text.rpartition(":=")
    if level.upper() not in LoggingSeverity.__members__:
        raise ValueError(f"`{level}` is not a level of loggers, such as `debug` or `warn`")
    get_logger(name).set_level(LoggingSeverity[level.upper()])
