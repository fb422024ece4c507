"""A plan → functions that convert messages, and bytes, of the old version."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy, deepcopy
from operator import attrgetter
from typing import Any, TypeAlias

from idlc.model import ir
from idlc.recordings.load import TopicType
from idlc.runtime.checked import validate, validate_element
from idlc.runtime.codec import maker
from idlc.runtime.names import ValidationError, public_name, slot_name
from idlc.runtime.typeinfo import FieldInfo, structure_of
from idlc.versions.conversion import ConversionStep, FieldPlan, Plan, Version, is_list

Function: TypeAlias = Callable[[Any], Any]
#: The rules of a file: the function of each field that has one.
Functions: TypeAlias = Mapping[str, Function]
#: Returns the rules in a file.
RunRules: TypeAlias = Callable[[str], Functions]


def kind_of(version: Version) -> Any:
    """Return the class of a version's messages."""
    if version.find is not None:
        return version.find(str(version.name))
    return TopicType(dict(version.models), version.name).kind


def words_of(error: BaseException) -> str:
    """Return the name of an exception and its text, which may raise another one."""
    try:
        text = str(error)
    except Exception:
        text = "an exception without a text"
    return f"{type(error).__name__}: {text[:200]}"


class RuleError(ValueError):
    """A rule raised an exception; `path` leads to the field."""

    def __init__(self, path: str, error: BaseException) -> None:
        super().__init__(path, error)
        self.path = path
        self.error = error

    def __str__(self) -> str:
        return f"{self.path}: the rule raised {words_of(self.error)}"


def rule_result(name: str, rule: Function, old: Any) -> Any:
    """Return what a rule returns for a message; raise RuleError if it raises."""
    try:
        result = rule(old)
        return list(result) if hasattr(result, "__next__") else result
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit would end idlc without a word
        raise RuleError(name, error) from error


class Converters:
    """Makes the function of each plan, once; `functions` runs the rules of a file."""

    def __init__(self, functions: RunRules) -> None:
        self._functions = functions
        self._made: dict[int, Function] = {}

    def message(self, plan: Plan) -> Function:
        """Return the function from an old message to a new one."""
        if id(plan) not in self._made:
            parts = [self.message(part) for part in plan.through]
            self._made[id(plan)] = chained(parts) if parts else self._direct(plan)
        return self._made[id(plan)]

    def _direct(self, plan: Plan) -> Function:
        kind = kind_of(plan.new)
        if plan.alike and kind is kind_of(plan.old):
            return deepcopy
        make = maker(kind)
        ruled = [field for field in plan.fields if field.finding.fate == "rule"]
        names = {field.new.name for field in ruled}
        default = kind()
        setters = tuple(
            (slot_name(field.new.name), self._value(field, default))
            for field in plan.fields
            if field.new.name not in names
        )

        def convert(old: Any) -> Any:
            new = make()
            for slot, value in setters:
                setattr(new, slot, value(old))
            return new

        if not ruled or plan.rules is None:
            return convert
        functions = self._functions(plan.rules.path)
        attributes = sorted(map(public_name, names))
        rules = [(name, functions[name]) for name in attributes]
        infos = {info.public: info for info in structure_of(kind).fields}

        def convert_by_rules(old: Any) -> Any:
            new = convert(old)
            for name, rule in rules:
                setattr(new, name, adopted(rule_result(name, rule, old), infos[name]))
            validate(new)
            return new

        return convert_by_rules

    def _value(self, field: FieldPlan, default: Any) -> Function:
        """Return the function from the old message to the value of a field."""
        if field.old is None or field.step is None:
            value = getattr(default, slot_name(field.new.name))
            if isinstance(value, (bool, int, float, str, bytes)):
                return lambda _: value
            return lambda _: deepcopy(value)
        get = attrgetter(slot_name(field.old.name))
        nested = field.step.nested
        element = value_change(field.step) if nested is None else self.message(nested)
        change = list_change(field.step, field.new.type, element, field.step.same)
        if change is None and is_list(field.new.type):
            change = copy
        if change is None:
            return get
        if nested is not None and nested.uses_rules:
            mark = "[]" if is_list(field.new.type) and not field.step.wraps else ""
            return located(f"{field.new.name}{mark}", lambda old: change(get(old)))
        return lambda old: change(get(old))


def list_change(
    step: ConversionStep, new: ir.FieldType, element: Function | None, is_same: bool
) -> Function | None:
    """Return the function from the old value of a field to the new one; `None` for the value.

    `element` is the function of an element, and `is_same` says that lists are of the same kind.
    """
    if not is_list(new):
        return element
    listed = _listing(new)
    if step.wraps:
        return lambda value: listed([element(value) if element else value])
    if element is None and is_same:
        return None
    if _numeric(new) and step.element in ("number", "byte as float"):
        return lambda values: listed(b"".join(values))
    if element is None or (_numeric(new) and step.element != "nested"):
        return listed
    return lambda values: [element(value) for value in values]


def value_change(step: ConversionStep) -> Function | None:
    """Return the function of an element that is no message; `None` for the element itself."""
    return _CHANGES.get(step.element)


def located(path: str, convert: Function) -> Function:
    """Return a function whose errors of rules lead to the field from the top."""

    def at_path(message: Any) -> Any:
        try:
            return convert(message)
        except (RuleError, ValidationError) as error:
            error.path = f"{path}.{error.path}"
            raise

    return at_path


_CHANGES: dict[str, Function] = {
    "number": lambda value: value[0],
    "byte as float": lambda value: float(value[0]),
    "byte": lambda value: bytes((value,)),
    "int": int,
    "float": float,
}


def chained(parts: Sequence[Function]) -> Function:
    """Return a function that applies others, one after the other."""

    def convert(message: Any) -> Any:
        for part in parts:
            message = part(message)
        return message

    return convert


def _numeric(type_: ir.FieldType) -> bool:
    element = ir.element_of(type_)
    return isinstance(element, ir.Primitive) and element.name not in ("bool", "byte")


def _numbers(values: Any) -> Iterable[Any]:
    """Return the numbers of bytes, or of an array of numpy, which may have another type."""
    if isinstance(values, bytes):
        return list(values)
    numbers: Iterable[Any] = values.tolist() if hasattr(values, "dtype") else values
    return numbers


def _listing(type_: ir.FieldType) -> Function:
    """Return the function that makes the value of a list's field, of other values that fit."""
    element = ir.element_of(type_)
    if not isinstance(element, ir.Primitive) or not _numeric(type_):
        return list
    info = element.info
    if isinstance(type_, ir.Sequence):
        return lambda values: array(info.code, _numbers(values))
    from numpy import array as numpy_array

    return lambda values: numpy_array(
        list(values) if isinstance(values, bytes) else values, info.dtype
    )


def adopted(value: Any, field: FieldInfo) -> Any:
    """Return what a rule returned, with messages of the new version's class."""
    name = field.public
    if field.is_list and (isinstance(value, (str, dict)) or not hasattr(value, "__iter__")):
        raise ValidationError(name, "a sequence", value)
    if field.nested is None:
        # what an array of Python makes of these is infinite
        if field.is_list and field.primitive and field.primitive.code == "f":
            for index, number in enumerate(value):
                validate_element(number, field, f"{name}[{index}]")
        return value
    kind = field.nested.find_class()

    def adopt(message: Any, path: str) -> Any:
        if isinstance(message, kind):
            return message
        if not isinstance(message, dict) and not hasattr(message, "to_dict"):
            raise ValidationError(path, f"a {kind.__name__}", message)
        values = message if isinstance(message, dict) else message.to_dict()
        try:
            return kind.from_dict(values)
        except ValueError as error:
            raise ValidationError(path, f"a {kind.__name__}", message, str(error)) from None

    if field.is_list:
        return [adopt(message, f"{name}[{index}]") for index, message in enumerate(value)]
    return adopt(value, name)
