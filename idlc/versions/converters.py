"""A plan → functions that convert messages, and bytes, of the old version."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy, deepcopy
from operator import attrgetter
from typing import Any, NamedTuple, TypeAlias

from idlc.model import ir
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.load import TopicType
from idlc.runtime.checked import validate, validate_element
from idlc.runtime.codec import FAILURES, maker
from idlc.runtime.names import ValidationError, public_name, slot_name
from idlc.runtime.typeinfo import FieldInfo, structure_of
from idlc.versions.conversion import FieldPlan, Plan, Step, Version, is_list

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


class Converters:
    """Makes the function of each plan, once.

    `functions` runs the rules of a file. With `shares`, new messages may hold objects of the old
    ones, of the old classes, where a codec writes them alike; they are for writing only.
    """

    def __init__(self, functions: RunRules, *, shares: bool) -> None:
        self._functions = functions
        self._shares = shares
        self._made: dict[int, Function] = {}

    def message(self, plan: Plan) -> Function:
        """Return the function from an old message to a new one."""
        if id(plan) not in self._made:
            parts = [self.message(part) for part in plan.through]
            self._made[id(plan)] = _chained(parts) if parts else self._direct(plan)
        return self._made[id(plan)]

    def _direct(self, plan: Plan) -> Function:
        kind = kind_of(plan.new)
        if plan.alike and (self._shares or kind is kind_of(plan.old)):
            return _same if self._shares else deepcopy
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
            new = make()
            for slot, value in setters:
                setattr(new, slot, value(old))
            for name, rule in rules:
                try:
                    result = rule(old)
                    result = list(result) if hasattr(result, "__next__") else result
                except KeyboardInterrupt:
                    raise
                except BaseException as error:  # SystemExit would end idlc without a word
                    raise RuleError(name, error) from error
                setattr(new, name, _adopted(result, infos[name]))
            validate(new)
            return new

        return convert_by_rules

    def _value(self, field: FieldPlan, default: Any) -> Function:
        """Return the function from the old message to the value of a field."""
        if field.old is None or field.step is None:
            value = getattr(default, slot_name(field.new.name))
            if self._shares or isinstance(value, (bool, int, float, str, bytes)):
                return lambda _: value
            return lambda _: deepcopy(value)
        get = attrgetter(slot_name(field.old.name))
        change = self._step(field.step, field.new.type)
        if change is None:
            return get
        if field.step.nested and field.step.nested.uses_rules:
            mark = "[]" if is_list(field.new.type) and not field.step.wraps else ""
            return _located(f"{field.new.name}{mark}", lambda old: change(get(old)))
        return lambda old: change(get(old))

    def _step(self, step: Step, new: ir.FieldType) -> Function | None:
        """Return the function from an old value to a new one; `None` for the value itself."""
        element = self._element(step)
        if not is_list(new):
            return element
        if step.wraps:
            listed = _listing(new)
            return lambda value: listed([element(value) if element else value])
        numeric = _numeric(new)
        if element is None and step.same:
            return None if self._shares else copy
        listed = _listing(new)
        if numeric and step.element == "number":
            return lambda values: listed(b"".join(values))
        if element is None or (numeric and step.element != "nested"):
            return listed
        return lambda values: [element(value) for value in values]

    def _element(self, step: Step) -> Function | None:
        match step.element:
            case "nested":
                assert step.nested is not None
                if step.nested.alike and self._shares:
                    return None
                return self.message(step.nested)
            case "number":
                return _first
            case "byte":
                return _byte
            case "int":
                return int
            case "float":
                return float
        return None


def _located(path: str, convert: Function) -> Function:
    """Return a function whose errors of rules lead to the field from the top."""

    def located(message: Any) -> Any:
        try:
            return convert(message)
        except (RuleError, ValidationError) as error:
            error.path = f"{path}.{error.path}"
            raise

    return located


def _same(message: Any) -> Any:
    return message


def _first(value: bytes) -> int:
    return value[0]


def _byte(value: int) -> bytes:
    return bytes((value,))


def _chained(parts: Sequence[Function]) -> Function:
    def convert(message: Any) -> Any:
        for part in parts:
            message = part(message)
        return message

    return convert


def _numeric(type_: ir.FieldType) -> bool:
    element = ir.element_of(type_)
    return isinstance(element, ir.Primitive) and element.name not in ("bool", "byte")


def _listing(type_: ir.FieldType) -> Function:
    """Return the function that makes the value of a list's field, of other values that fit."""
    element = ir.element_of(type_)
    if not isinstance(element, ir.Primitive) or not _numeric(type_):
        return list
    info = element.info
    if isinstance(type_, ir.Sequence):
        # of an array of numpy, the numbers of another type
        return lambda values: (
            array(info.code, values.tolist() if hasattr(values, "dtype") else values)
            if not isinstance(values, bytes)
            else array(info.code, list(values))
        )
    from numpy import array as numpy_array

    return lambda values: numpy_array(
        list(values) if isinstance(values, bytes) else values, info.dtype
    )


def _adopted(value: Any, field: FieldInfo) -> Any:
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


class Payloads(NamedTuple):
    """The way of bytes: decode, convert, encode."""

    kind: Any
    new_kind: Any
    convert: Function

    @classmethod
    def of(cls, plan: Plan, functions: RunRules) -> Payloads:
        """Return the way that a plan describes."""
        convert = Converters(functions, shares=True).message(plan)
        return cls(kind_of(plan.old), kind_of(plan.new), convert)

    def many(self, payloads: Iterable[Any], place: Callable[[int], str] = str) -> list[bytes]:
        """Return new bytes; `place` says in errors which of them it was."""
        decode = self.kind._codec_("<").decode
        encode = self.new_kind._codec_("<").encode
        convert, join = self.convert, b"".join
        result: list[bytes] = []
        put = result.append
        for payload in payloads:
            data = payload if type(payload) is bytes else bytes(payload)
            try:
                # the common case; the rest finds the words for what is wrong
                if data[1] == 1 and not data[0]:
                    put(encode(convert(decode(data)), join))
                    continue
            except (*FAILURES, TypeError, AttributeError):
                pass
            put(self._carefully(data, place(len(result))))
        return result

    def _carefully(self, data: bytes, place: str) -> bytes:
        try:
            encoded: bytes = self.convert(self.kind.deserialize(data)).serialize()
        except ValueError as error:  # of this runtime, or of a package that has its own
            raise RecordingError(f"{place}: {error}") from error
        return encoded
