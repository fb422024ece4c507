"""Values of parameters from the command line: `-p name:=value`, and YAML files of ROS 2.

Values have the types that ROS 2 gives them, which is neither YAML 1.1 nor 1.2: `1:30` and `null`
are strings, `y` is true, `010` is 8, `1e3` is a double.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import yaml

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.nodes.arguments import Arguments
from idlc.robot.parameters.values import Parameter

#: A file has at most this many values, and is nested at most this deep.
MOST_VALUES = 100_000
MOST_DEPTH = 64
_MARK = "ros__parameters"
_PLAIN = "!plain"
_STRING = "tag:yaml.org,2002:str"
_TRUE = {"y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"}
_FALSE = {"n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"}
_INTEGER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_DOUBLE = re.compile(
    r"[-+]?(([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?|\.?inf(inity)?|\.?nan)", re.IGNORECASE
)


class _Loader(yaml.SafeLoader):  # type: ignore[misc] # PyYAML is not typed
    """A loader that does not guess the type of what stands without quotes."""

    yaml_implicit_resolvers = {None: [(_PLAIN, re.compile(""))]}  # noqa: RUF012 - PyYAML's


def overrides_of(arguments: Arguments, node: str) -> dict[str, Parameter]:
    """Return the parameters that the command line sets for a node; `-p` replaces files.

    `node` is the absolute name of the node. Raises RobotError.
    """
    parameters: dict[str, Parameter] = {}
    for path in arguments.parameter_files:
        parameters.update(read_overrides(path, node))
    for only, name, text in arguments.overrides:
        if not only or _matches(only.strip("/").split("/"), node.strip("/").split("/")):
            reader = _Reader(f"-p {name}:={text}")
            parameters[name] = Parameter(name, value=reader.value(reader.compose(text)))
    return parameters


def read_overrides(path: str, node: str) -> dict[str, Parameter]:
    """Return the parameters that a file sets for a node; later entries replace earlier ones.

    `node` is its absolute name; `*` in a file means any name, `**` any names. Raises RobotError.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise RobotError(f"`{one_line(path)}` cannot be read: {one_line(str(error))}") from None
    reader = _Reader(path)
    parts = node.strip("/").split("/")
    return {
        name: parameter
        for pattern, values in reader.nodes(reader.compose(text), "", 0)
        if _matches(pattern.strip("/").split("/"), parts)
        for name, parameter in reader.parameters(values, "", 0)
    }


def _matches(pattern: list[str], name: list[str]) -> bool:
    reached = {0}
    for part in pattern:
        if part == "**":
            reached = {*range(min(reached, default=len(name) + 1), len(name) + 1)}
        else:
            reached = {at + 1 for at in reached if at < len(name) and part in ("*", name[at])}
    return len(name) in reached


class _Reader:
    """Reads the YAML of one source, which errors name; counts its values."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._count = 0

    def compose(self, text: str) -> yaml.Node | None:
        """Return the tree of a text."""
        try:
            return yaml.compose(text, _Loader)
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            raise self._error(error.problem or "it is not YAML", mark) from None
        except (yaml.YAMLError, RecursionError, ValueError) as error:
            raise self._error(f"it is not YAML: {one_line(str(error))}", None) from None

    def nodes(
        self, tree: yaml.Node | None, name: str, depth: int
    ) -> Iterator[tuple[str, yaml.Node]]:
        """Yield the name, which may contain wildcards, and the parameters of each node."""
        for key, value in self._items(tree, depth):
            if key == _MARK:
                yield name, value
            else:
                yield from self.nodes(value, f"{name}/{key.strip('/')}", depth + 1)

    def parameters(
        self, tree: yaml.Node, prefix: str, depth: int
    ) -> Iterator[tuple[str, Parameter]]:
        """Yield the name and value of each parameter; names of nested ones are joined with dots."""
        for key, value in self._items(tree, depth):
            if isinstance(value, yaml.MappingNode):
                yield from self.parameters(value, f"{prefix}{key}.", depth + 1)
            else:
                yield f"{prefix}{key}", Parameter(f"{prefix}{key}", value=self.value(value))

    def _items(self, tree: yaml.Node | None, depth: int) -> Iterator[tuple[str, yaml.Node]]:
        if not isinstance(tree, yaml.MappingNode):
            raise self._error(
                f"expected `node:`, `{_MARK}:` and `name: value`", tree and tree.start_mark
            )
        for key, value in tree.value:
            self._count += 1
            if depth > MOST_DEPTH or self._count > MOST_VALUES:
                raise self._error("it has too many values", key.start_mark)
            if not isinstance(key, yaml.ScalarNode) or not key.value:
                raise self._error("a name is missing", key.start_mark)
            yield key.value, value

    def value(self, tree: yaml.Node | None) -> object:
        """Return a value, or a list of values of one type."""
        if isinstance(tree, yaml.ScalarNode):
            return self._scalar(tree)
        if not isinstance(tree, yaml.SequenceNode):
            raise self._error("expected a value or a list of values", tree and tree.start_mark)
        self._count += len(tree.value)
        if self._count > MOST_VALUES:
            raise self._error("it has too many values", tree.start_mark)
        values: list[object] = []
        for item in tree.value:
            if not isinstance(item, yaml.ScalarNode):
                raise self._error("a list must contain only values", item.start_mark)
            values.append(self._scalar(item))
            if type(values[0]) is not type(values[-1]):
                raise self._error(
                    f"a list contains values of one type; write `{float(values[0])}`"
                    if isinstance(values[0], int) and isinstance(values[-1], float)
                    else "a list contains values of one type",
                    item.start_mark,
                )
        return values

    def _scalar(self, node: yaml.ScalarNode) -> object:
        text: str = node.value
        if node.tag not in (_PLAIN, _STRING):
            raise self._error(f"the tag `{one_line(node.tag)}` is not known", node.start_mark)
        if node.tag == _STRING:
            return text
        if text in _TRUE or text in _FALSE:
            return text in _TRUE
        if (match := _INTEGER.fullmatch(text)) and len(text) < 64:
            digits = match[1]
            base = 16 if digits[:2] in ("0x", "0X") else 8 if digits[0] == "0" else 10
            number = int(digits, base) * (-1 if text[0] == "-" else 1)
            return number if -(2**63) <= number < 2**63 else float(number)
        if _DOUBLE.fullmatch(text):
            return float(text.replace(".inf", "inf").replace(".nan", "nan").lower().lstrip())
        return text

    def _error(self, problem: str, mark: yaml.Mark | None) -> RobotError:
        place = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        return RobotError(f"{one_line(self._source)}{place}: {one_line(problem)}")
