"""Conversion of bytes in which an unchanged field keeps its bytes, whether they are valid or not.

A value of Python does not keep each byte of a text in another encoding, of a bool that is 2, or of
a signalling NaN. Therefore messages are decoded as structures of the same layout, in which bytes
and integers take the place of all that does not change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any

from idlc.diagnostics.source import Source
from idlc.model import ir
from idlc.model.link import Model
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.load import TopicType
from idlc.runtime.checked import validate
from idlc.runtime.codec import FAILURES, maker
from idlc.runtime.names import public_name, slot_name
from idlc.runtime.typeinfo import structure_of
from idlc.versions.conversion import OCTETS, ConversionStep, FieldPlan, Plan, Version, is_list
from idlc.versions.converters import (
    Function,
    RunRules,
    adopted,
    chained,
    kind_of,
    list_change,
    located,
    rule_result,
    value_change,
)

PACKAGE = "idlc_exact"
#: Integers of the same size and alignment.
_INTEGERS = {"bool": "uint8", "byte": "uint8", "float32": "uint32", "float64": "uint64"}


def is_same(step: ConversionStep, before: ir.Element, after: ir.Element) -> bool:
    """Return whether the elements of a field have the same bytes in both versions."""
    if step.nested is not None:
        return step.nested.same
    if isinstance(before, ir.String) and isinstance(after, ir.String):
        return before.wide == after.wide
    names = {element.name for element in (before, after) if isinstance(element, ir.Primitive)}
    return len(names) == 1 or names <= {*OCTETS, "byte"}


def _listed(type_: ir.FieldType, element: ir.Element) -> ir.FieldType:
    """Return a type with another element."""
    if isinstance(type_, ir.Array):
        return ir.Array(element, type_.size)
    if isinstance(type_, ir.Sequence):
        return ir.Sequence(element, type_.bound)
    return element


class _Layouts:
    """The structures that messages are decoded as, and encoded from."""

    def __init__(self) -> None:
        self._messages: list[ir.Message] = []
        self._names: dict[object, ir.Ref] = {}
        self._plans: dict[int, tuple[ir.Ref, ir.Ref]] = {}

    def _add(self, fields: Iterable[tuple[str, ir.FieldType]]) -> ir.Ref:
        made = tuple(ir.Field(name=field, type=type_) for field, type_ in fields)
        name = ir.TypeName(PACKAGE, "msg", f"T{len(self._messages)}")
        text = "\n".join(f"{ir.spell(field.type, PACKAGE)} {field.name}" for field in made)
        self._messages.append(ir.Message(name=name, fields=made, source=Source(str(name), text)))
        return ir.Ref(name)

    def _bytes_of(self, version: Version, element: ir.Element) -> ir.Element:
        """Return the element of the same layout that keeps all bytes."""
        if isinstance(element, ir.Primitive):
            return ir.Primitive(_INTEGERS.get(element.name, element.name))
        if isinstance(element, ir.String):
            unit = ir.Primitive("uint32" if element.wide else "uint8")
            if element.wide not in self._names:
                self._names[element.wide] = self._add([("units", ir.Sequence(unit, None))])
            return self._names[element.wide]
        assert isinstance(element, ir.Ref)
        key = version.key, element.target
        if key not in self._names:
            fields = version.of(element.target).message.wire_fields
            self._names[key] = self._add(
                (f"f{at}", self._kept(version, field.type)) for at, field in enumerate(fields)
            )
        return self._names[key]

    def _kept(self, version: Version, type_: ir.FieldType) -> ir.FieldType:
        return _listed(type_, self._bytes_of(version, ir.element_of(type_)))

    def _values_of(self, version: Version, type_: ir.FieldType) -> ir.FieldType:
        """Return the type that values of the version's own classes can be encoded as."""
        element = ir.element_of(type_)
        if not isinstance(element, ir.Ref):
            return type_
        key = version.key, element.target, "values"
        if key not in self._names:
            fields = version.of(element.target).message.fields
            self._names[key] = self._add(
                (field.name, self._values_of(version, field.type)) for field in fields
            )
        return _listed(type_, self._names[key])

    def of(self, plan: Plan) -> tuple[ir.Ref, ir.Ref]:
        """Return the structures of a plan's old and new messages."""
        if id(plan) not in self._plans:
            parts = [self.of(part) for part in plan.through]
            self._plans[id(plan)] = (parts[0][0], parts[-1][1]) if parts else self._direct(plan)
        return self._plans[id(plan)]

    def _direct(self, plan: Plan) -> tuple[ir.Ref, ir.Ref]:
        old_types: dict[str, ir.FieldType] = {}
        new_types: list[tuple[str, ir.FieldType]] = []
        for at, field in enumerate(plan.fields):
            if field.old is not None and field.step is not None:
                old, new = self._field(plan, field.old.type, field.new.type, field.step)
                old_types[field.old.name] = old
            else:
                new = self._values_of(plan.new, field.new.type)
            new_types.append((f"f{at}", new))
        if not new_types:
            new_types = [("f0", ir.Primitive("uint8"))]
        before = [
            (f"f{at}", old_types.get(field.name) or self._kept(plan.old, field.type))
            for at, field in enumerate(plan.old.message.wire_fields)
        ]
        return self._add(before), self._add(new_types)

    def _field(
        self, plan: Plan, before: ir.FieldType, after: ir.FieldType, step: ConversionStep
    ) -> tuple[ir.FieldType, ir.FieldType]:
        """Return the types of a field of both versions."""
        elements = ir.element_of(before), ir.element_of(after)
        if is_same(step, *elements):
            element = self._bytes_of(plan.old, elements[0])
            elements = element, element
        elif step.nested is not None:
            elements = self.of(step.nested)
        return _listed(before, elements[0]), _listed(after, elements[1])

    def classes(self) -> dict[ir.TypeName, Any]:
        """Return the classes of all structures."""
        messages = {message.name: message for message in self._messages}
        models = {PACKAGE: Model(PACKAGE, tuple(self._messages), messages)}
        return {name: TopicType(models, name).kind for name in messages}


class ExactConversion:
    """The conversion of a plan: decode as `old`, `convert`, encode as `new`."""

    def __init__(self, plan: Plan, functions: RunRules) -> None:
        self._functions = functions
        self._layouts = _Layouts()
        self._layouts.of(plan)
        self._classes = self._layouts.classes()
        self._made: dict[int, Function] = {}
        self.old, self.new = self._of(plan)
        self.convert = self._message(plan)

    def _of(self, plan: Plan) -> tuple[Any, Any]:
        old, new = self._layouts.of(plan)
        return self._classes[old.target], self._classes[new.target]

    def _message(self, plan: Plan) -> Function:
        """Return the function from a message of one layout to one of the other."""
        if id(plan) not in self._made:
            steps: list[Function] = []
            for before, part in zip((None, *plan.through), plan.through, strict=False):
                if before is not None:
                    steps.append(_recoded(self._of(before)[1], self._of(part)[0]))
                steps.append(self._message(part))
            self._made[id(plan)] = chained(steps) if steps else self._direct(plan)
        return self._made[id(plan)]

    def _direct(self, plan: Plan) -> Function:
        old_kind, new_kind = self._of(plan)
        make = maker(new_kind)
        slots = {
            field.name: slot_name(f"f{at}") for at, field in enumerate(plan.old.message.fields)
        }
        default = kind_of(plan.new)()
        setters: list[tuple[str, Function]] = []
        ruled: dict[str, str] = {}
        for at, field in enumerate(plan.fields):
            slot, name = slot_name(f"f{at}"), field.new.name
            if field.finding.fate == "rule":
                ruled[public_name(name)] = slot
            elif field.old is None or field.step is None:
                setters.append((slot, _constant(getattr(default, slot_name(name)))))
            else:
                setters.append((slot, self._value(field, attrgetter(slots[field.old.name]))))
        if not plan.fields:
            setters = [("_f0", _constant(0))]

        def convert(old: Any) -> Any:
            new = make()
            for slot, value in setters:
                setattr(new, slot, value(old))
            return new

        if not ruled or plan.rules is None:
            return convert
        functions = self._functions(plan.rules.path)
        rules = [(name, functions[name], slot) for name, slot in sorted(ruled.items())]
        infos = {info.public: info for info in structure_of(kind_of(plan.new)).fields}
        kind, decoded = kind_of(plan.new), _recoded(old_kind, kind_of(plan.old))

        def convert_by_rules(old: Any) -> Any:
            new, values, message = convert(old), kind(), decoded(old)
            for name, rule, _ in rules:
                setattr(values, name, adopted(rule_result(name, rule, message), infos[name]))
            validate(values)
            for name, _, slot in rules:
                setattr(new, slot, getattr(values, slot_name(infos[name].name)))
            return new

        return convert_by_rules

    def _value(self, field: FieldPlan, get: Function) -> Function:
        """Return the function from the old message to the value of a field."""
        assert field.old is not None
        assert field.step is not None
        step, after = field.step, field.new.type
        element: Function | None = None
        is_kept = is_same(step, ir.element_of(field.old.type), ir.element_of(after))
        if step.nested is not None and not is_kept:
            element = self._message(step.nested)
        elif not is_kept:
            element = value_change(step)
        if is_kept:
            step, after = ConversionStep(wraps=step.wraps), _integers(field.old.type, after)
        change = list_change(step, after, element, field.step.same)
        if change is None:
            return get
        if step.nested is not None and step.nested.uses_rules:
            mark = "[]" if is_list(after) and not step.wraps else ""
            return located(f"{field.new.name}{mark}", lambda old: change(get(old)))
        return lambda old: change(get(old))


def _integers(before: ir.FieldType, after: ir.FieldType) -> ir.FieldType:
    """Return the new type of a field with the elements that keep the bytes of primitives."""
    element = ir.element_of(before)
    if isinstance(element, ir.Primitive):
        element = ir.Primitive(_INTEGERS.get(element.name, element.name))
    return _listed(after, element)


def _constant(value: Any) -> Function:
    return lambda _: value


def _recoded(kind: Any, other: Any) -> Function:
    """Return the function from a message to one of a class of the same layout."""
    encode, decode, join = kind._codec_("<").encode, other.deserialize, b"".join
    return lambda message: decode(encode(message, join))


class Payloads:
    """The conversion of serialized messages."""

    def __init__(self, plan: Plan, functions: RunRules) -> None:
        self._kind = kind_of(plan.old)
        self._exact = ExactConversion(plan, functions)

    def many(self, payloads: Iterable[Any], place: Callable[[int], str] = str) -> list[bytes]:
        """Return new bytes; `place` says in errors which of them it was."""
        decode = self._exact.old._codec_("<").decode
        encode = self._exact.new._codec_("<").encode
        convert, join = self._exact.convert, b"".join
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
        exact = self._exact
        try:
            try:
                encoded: bytes = exact.convert(exact.old.deserialize(data)).serialize()
            except ValueError:
                self._kind.deserialize(data)  # its errors have the names of fields
                raise
        except ValueError as error:  # of this runtime, or of a package that has its own
            raise RecordingError(f"{place}: {error}") from error
        return encoded
