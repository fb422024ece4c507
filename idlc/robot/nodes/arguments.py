"""`--ros-args`: names to replace, values of parameters, and levels of loggers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.names import InvalidNameError, expand_name, expand_namespace

_START, _END = "--ros-args", "--"
_RULE = re.compile(
    r"(?:([A-Za-z_]\w*):(?!//))?(?:(rostopic|rosservice)://)?([^:=]+):=(.+)", re.ASCII
)
_PARAMETER = re.compile(r"(?:([\w/*]+):)?([^:=]+):=(.*)", re.ASCII | re.DOTALL)
#: Flags that idlc reads and that have no effect here, and the number of their values.
_WITHOUT_EFFECT = {
    "--enclave": 1,
    "-e": 1,
    "--log-config-file": 1,
    "--log-file-name": 1,
    **{
        f"--{word}-{what}": 0
        for word in ("enable", "disable")
        for what in ("stdout-logs", "external-lib-logs")
    },
}


class Remap(NamedTuple):
    """A rule: the name `source`, of the node called `node` or of all, is `target` instead.

    `scheme` restricts it to topics or services. `__node` and `__ns` stand for the node itself.
    """

    node: str
    scheme: str
    source: str
    target: str


class Override(NamedTuple):
    """A value for a parameter, as YAML text; of the node called `node`, or of all if empty."""

    node: str
    name: str
    value: str


class Arguments(NamedTuple):
    """The arguments after `--ros-args`."""

    remaps: tuple[Remap, ...] = ()
    overrides: tuple[Override, ...] = ()
    parameter_files: tuple[str, ...] = ()
    #: Levels by the name of a logger; the empty name is the default.
    log_levels: tuple[tuple[str, str], ...] = ()
    enable_rosout: bool = True

    def __add__(self, other: object) -> Arguments:
        """Return both; where they differ, the first of them counts for names."""
        assert isinstance(other, Arguments)
        return Arguments(
            self.remaps + other.remaps,
            other.overrides + self.overrides,
            other.parameter_files + self.parameter_files,
            other.log_levels + self.log_levels,
            self.enable_rosout and other.enable_rosout,
        )

    def special(self, node: str, *sources: str) -> str | None:
        """Return the replacement of `__node` or `__ns` for a node that the program calls `node`."""
        rules = (rule for rule in self.remaps if rule.source in sources)
        return next((rule.target for rule in rules if rule.node in ("", node)), None)

    def rename(self, name: str, namespace: str, node: str, scheme: str) -> str:
        """Return the absolute name of a topic or service that a node calls `name`.

        Raises InvalidNameError.
        """
        absolute = expand_name(name, namespace, node)
        for rule in self.remaps:
            if rule.source.startswith("__") or rule.node not in ("", node):
                continue
            if rule.scheme in ("", scheme) and absolute == expand_name(
                rule.source, namespace, node
            ):
                return expand_name(rule.target, namespace, node)
        return absolute


def _split(args: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the other arguments, and those of ROS."""
    others: list[str] = []
    ros: list[str] = []
    is_ros = False
    for word in args:
        if word == _START:
            is_ros = True
        elif is_ros and word == _END:
            is_ros = False
        else:
            (ros if is_ros else others).append(word)
    return others, ros


def remove_ros_args(args: Sequence[str]) -> list[str]:
    """Return arguments without `--ros-args`, and the words between it and `--`."""
    return _split(args)[0]


def parse_arguments(args: Sequence[str]) -> Arguments:
    """Return the arguments after `--ros-args`; raise RobotError for one that is not valid."""
    return _parse(iter(_split(args)[1]))


def _parse(words: Iterator[str]) -> Arguments:
    remaps: list[Remap] = []
    overrides: list[Override] = []
    files: list[str] = []
    levels: list[tuple[str, str]] = []
    rosout = True
    for flag in words:
        if flag in ("-r", "--remap"):
            remaps.append(_remap(_value(flag, words)))
        elif flag in ("-p", "--param"):
            overrides.append(_override(_value(flag, words)))
        elif flag == "--params-file":
            files.append(_value(flag, words))
        elif flag == "--log-level":
            name, separator, level = _value(flag, words).rpartition(":=")
            levels.append((name if separator else "", level))
        elif flag in ("--enable-rosout-logs", "--disable-rosout-logs"):
            rosout = flag.startswith("--enable")
        elif flag in _WITHOUT_EFFECT:
            for _ in range(_WITHOUT_EFFECT[flag]):
                _value(flag, words)
        else:
            raise RobotError(
                f"`{one_line(flag)}` is not an argument of ROS",
                f"write `{_END}` before arguments of the program that follow `{_START}`",
            )
    return Arguments(tuple(remaps), tuple(overrides), tuple(files), tuple(levels), rosout)


def _value(flag: str, words: Iterator[str]) -> str:
    for word in words:
        return word
    raise RobotError(f"`{flag}` has no value", f"write it after `{flag}`")


def _remap(text: str) -> Remap:
    match = _RULE.fullmatch(text)
    try:
        if match is None:
            raise InvalidNameError("it is not of the form `old:=new`")
        node, scheme, source, target = match.groups(default="")
        target = target.removeprefix(f"{scheme}://") if scheme else target
        if source in ("__name", "__node"):
            expand_name(target, "/", "node")
            source = "__node"
        elif source == "__ns":
            expand_namespace(target)
        else:
            expand_name(source, "/", "node")
            expand_name(target, "/", "node")
    except InvalidNameError as error:
        raise RobotError(
            f"`{one_line(text)}` does not replace a name: {one_line(str(error))}",
            "write `-r old:=new`, `-r __node:=name` or `-r __ns:=/name`",
        ) from None
    return Remap(node, scheme, source, target)


def _override(text: str) -> Override:
    match = _PARAMETER.fullmatch(text)
    if match is None:
        raise RobotError(f"`{one_line(text)}` does not set a parameter", "write `-p name:=value`")
    return Override(*match.groups(default=""))
