"""Conditions on recorded messages: a field is read and compared, nothing is evaluated."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from datetime import timedelta
from typing import Any, NamedTuple

import numpy as np

from idlc.api.reader import Absent, field_reader, type_at
from idlc.model import ir
from idlc.recordings.columns.elements import MOST_NAMES, ListElement, element_of
from idlc.recordings.containers.messages import Raw
from idlc.recordings.times import moment
from idlc.runtime.typeinfo import structure_of

OPERATORS: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_TEXT = re.compile(r"\s*([^\s=!<>]+)\s*(==|!=|<=|>=|<|>)\s*(.+?)\s*", re.DOTALL)


class Condition(NamedTuple):
    """A field's path, one of the OPERATORS, and what the field is compared with."""

    path: str
    operator: str
    value: Any

    @classmethod
    def parse(cls, text: str) -> Condition:
        """Return the condition that a text such as `width > 640` means; raise ValueError."""
        match = _TEXT.fullmatch(text)
        if match is None:
            hint = "write a field, one of == != < <= > >=, and a value, as in `width >= 640`"
            raise ValueError(f"`{text}` is not a condition: {hint}")
        path, sign, value = match.groups()
        if len(value) > 1 and value[0] == value[-1] and value[0] in "'\"":
            value = value[1:-1]
        return cls(path, sign, value)

    def typed(self, kind: type, start: Callable[[], int]) -> Condition:
        """Return the condition with a value of the field's type in a class.

        Times are nanoseconds, as `between` takes them. Raises ValueError for a path that the class
        does not have, and for a value that no such field equals.
        """
        if not (isinstance(self.operator, str) and self.operator in OPERATORS):
            raise ValueError(f"`{self.operator}` is not one of {' '.join(OPERATORS)}")
        element = named_element(kind, self.path)
        type_ = type_at(kind, f"{element.values}[0]" if element else self.path)
        try:
            return self._replace(value=_comparable(self.value, type_, start))
        except (KeyError, TypeError, ValueError, OverflowError):
            what = "a time" if isinstance(type_, ir.Ref) else f"a {ir.spell(type_)}"
            problem = f"`{self.path}` is {what}, which is not compared with {self.value!r}"
            raise ValueError(problem) from None


def named_element(kind: type, path: str) -> ListElement | None:
    """Return the element that a path names, as in `position.elbow`, or None for other paths."""
    element = element_of(structure_of(kind), path) if isinstance(path, str) else None
    return element if element and element.names else None


class ElementReader:
    """Reads the element that a path names; raises Absent for a message without it."""

    def __init__(self, kind: type, element: ListElement) -> None:
        self.kind = kind
        self.element = element
        self.read = field_reader(kind, (element.names, element.values))
        #: How many messages lacked the name until one had it, and names that they have instead.
        self.lacking = 0
        self.others: dict[str, None] | None = {}

    def __call__(self, view: Raw) -> Any:
        """Return the element; raise Absent if the message lacks it."""
        names, values = self.read(view)
        index = self.element.index_in(names, values)
        if self.element.name in names:
            self.others = None
        elif self.others is not None:
            self.lacking += 1
            if len(self.others) < MOST_NAMES:
                self.others |= dict.fromkeys(names)
        if index is None:
            raise Absent
        return field_reader(self.kind, (f"{self.element.values}[{index}]",))(view)


def _comparable(value: Any, type_: ir.FieldType, start: Callable[[], int]) -> Any:
    """Return a value as what fields of a type are compared with; raise an error for others."""
    match type_:
        case ir.Ref(target) if target.name == "Time":
            return moment(value, start)
        case ir.Ref() if isinstance(value, timedelta):
            return value // timedelta(microseconds=1) * 1000
        case ir.String() if isinstance(value, str):
            return value
        case ir.Primitive("bool"):
            return {"true": True, "false": False, True: True, False: False}[value]
        case ir.Primitive("byte"):
            return value if isinstance(value, bytes) else bytes([int(value)])
        case ir.Primitive("float32"):
            return float(np.float32(_number(value)))  # as the field would hold it
        case ir.Primitive() | ir.Ref():
            return _number(value)
    raise TypeError


def _number(value: Any) -> Any:
    if isinstance(value, str):
        return float(value) if re.search(r"[.einEIN]", value) else int(value)
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.number)):
        raise TypeError
    return value


class Filter:
    """Conditions that are all to hold, for messages of a class.

    `absent` counts the messages that do not match because a list lacks the element of a path.
    """

    def __init__(self, kind: type, conditions: tuple[Condition, ...]) -> None:
        self.absent = 0
        self._elements: list[ElementReader] = []
        self._parts = [
            (self._reader(kind, path), OPERATORS[sign], value) for path, sign, value in conditions
        ]

    def _reader(self, kind: type, path: str) -> Callable[[Raw], Any]:
        element = named_element(kind, path)
        if element is None:
            return field_reader(kind, (path,), True, True)
        self._elements.append(ElementReader(kind, element))
        return self._elements[-1]

    def matches(self, view: Raw) -> bool:
        """Return whether a message matches; raise the DecodeError of a broken one."""
        try:
            return all(compare(read(view), value) for read, compare, value in self._parts)
        except Absent:
            self.absent += 1
            return False

    def warn(self) -> None:
        """Warn of elements that no message has, at the end of the messages."""
        for reader in self._elements:
            if reader.others is not None and reader.lacking:
                reader.element.warn([*reader.others], reader.lacking)
