"""Two versions of a type → the way to each field of the new one, and the fate of the old data."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias

from idlc.diagnostics.source import Span
from idlc.model import derive, ir
from idlc.model.ir import spell, spell_value
from idlc.model.link import Model
from idlc.model.python_names import field as attribute
from idlc.versions.changes import Pairing, pair, tighter
from idlc.versions.meanings import Renumbering, factor, renumbered

#: Returns the class of a type by its full name.
Find: TypeAlias = Callable[[str], Any]
Fate: TypeAlias = Literal["same bytes", "automatic", "rule", "needs a rule", "lost"]

#: The fates, the worst first.
FATES: tuple[Fate, ...] = ("lost", "needs a rule", "rule", "automatic", "same bytes")
#: Those that a person has to decide about first.
OPEN = FATES[:2]


class VersionKey(NamedTuple):
    """A version of a type: its full name and its type hash."""

    type: str
    hash: str

    @property
    def short(self) -> str:
        """The name of the version's class in rules, such as `Drive_8ce00c`."""
        return f"{self.type.rpartition('/')[2]}_{self.hash.rpartition('_')[2][:6]}"


class Version:
    """One version of a structure, with the models of the packages that it needs.

    `find` returns the class of a type by its full name; without it, classes are made in memory.
    """

    def __init__(
        self, models: Mapping[str, Model], name: ir.TypeName, find: Find | None = None
    ) -> None:
        self.models = models
        self.name = name
        self.find = find

    def __repr__(self) -> str:
        return f"<{self.key.short} of {self.name.package}>"

    @property
    def _model(self) -> Model:
        return self.models[self.name.package]

    @property
    def message(self) -> ir.Message:
        """The structure."""
        return self._model.messages[self.name]

    @cached_property
    def key(self) -> VersionKey:
        """The name and type hash."""
        return VersionKey(str(self.name), self._model.describer.hash(str(self.name)))

    @cached_property
    def reached(self) -> set[ir.TypeName]:
        """The structures that it consists of, itself included."""
        messages = self._model.messages
        return derive.closure([self.name], lambda name: messages[name].references)

    def of(self, name: ir.TypeName) -> Version:
        """Return the version of a type that this one refers to."""
        models = self.models
        if name.package not in models:
            models = {**models, name.package: self._model}
        return Version(models, name, self.find)


class FieldFate(NamedTuple):
    """The fate of one field: of the new version, or of the old one if it was removed.

    `path` leads to it from the top, such as `wheels[].radius`; `type` is the structure that holds
    it. `proposal` is the expression of a rule for it, in which `old` is the message.
    """

    fate: Fate
    path: str
    type: str
    field: str
    reason: str
    span: Span | None = None
    old: Span | None = None
    proposal: str = ""


ElementChange: TypeAlias = Literal[
    "as is", "float", "int", "number", "byte as float", "byte", "nested"
]


class ConversionStep(NamedTuple):
    """The way from an old value to a new one.

    `element` says what is done with each element: `as is`, `float`, `int` (of a bool), `number` or
    `byte as float` (of a byte), `byte` (of a number) or `nested`. `wraps` makes an array of one
    value.
    """

    element: ElementChange = "as is"
    nested: Plan | None = None
    wraps: bool = False
    #: The bytes are the same, and so is the value in Python.
    same: bool = True
    alike: bool = True


class FieldPlan(NamedTuple):
    """The value of a field of the new version: from an `old` field, a rule, or its default."""

    new: ir.Field
    old: ir.Field | None
    step: ConversionStep | None
    finding: FieldFate


class RuleFile(Protocol):
    """The rules for one pair of versions, as far as their syntax shows."""

    @property
    def old(self) -> VersionKey:
        """The version that the rules read."""

    @property
    def new(self) -> VersionKey:
        """The version that the rules write."""

    @property
    def units(self) -> Mapping[str, tuple[str, str]]:
        """The units that rules convert, by the field."""

    @property
    def constants(self) -> Mapping[str, tuple[str, str]]:
        """The renumbered constants that rules convert, by the field."""

    @property
    def fields(self) -> frozenset[str]:
        """The fields that have a rule, by their names in Python."""

    @property
    def path(self) -> str:
        """The file, as messages name it."""


class RuleFiles(Protocol):
    """Rules for several pairs of versions."""

    def starting(self, old: VersionKey) -> Iterable[RuleFile]:
        """Return the rules that read a version."""

    def version(self, rules: RuleFile) -> Version | None:
        """Return the version that rules write, as it was when they were written."""


class _NoRules:
    """The rules of nobody."""

    def starting(self, _: VersionKey) -> Iterable[RuleFile]:
        return ()

    def version(self, _: RuleFile) -> Version | None:
        return None


NO_RULES: RuleFiles = _NoRules()


class Plan:
    """The way from one version of a structure to another.

    It has `fields`, in the new order, and the `dropped` ones of the old version; or else `through`:
    plans that lead through versions in between.
    """

    def __init__(self, old: Version, new: Version) -> None:
        self.old = old
        self.new = new
        self.fields: tuple[FieldPlan, ...] = ()
        self.dropped: tuple[FieldFate, ...] = ()
        self.through: tuple[Plan, ...] = ()
        self.rules: RuleFile | None = None
        self.notes: tuple[FieldFate, ...] = ()
        self.in_order = True

    @cached_property
    def same(self) -> bool:
        """True if the bytes of every message are those of the new version."""
        if self.through or self.dropped or not self.in_order:
            return False
        return all(field.step is not None and field.step.same for field in self.fields)

    @cached_property
    def alike(self) -> bool:
        """True if the values of the old fields are those of the new ones, in Python, too."""
        return self.same and all(field.step and field.step.alike for field in self.fields)

    @cached_property
    def uses_rules(self) -> bool:
        """True if a rule is a part of it, at any depth."""
        nested = [field.step.nested for field in self.fields if field.step and field.step.nested]
        return bool(self.rules) or any(part.uses_rules for part in (*self.through, *nested))

    def findings(
        self, prefix: str = "", seen: set[int | tuple[str, str, str]] | None = None
    ) -> list[FieldFate]:
        """Return the findings at any depth, each with the first path to it."""
        seen = set() if seen is None else seen
        findings: list[FieldFate] = []
        if id(self) in seen:  # otherwise exponential for structures that hold each other twice
            return findings
        seen.add(id(self))
        for part in self.through:
            findings += part.findings(prefix, seen)
        for own in (*(field.finding for field in self.fields), *self.dropped, *self.notes):
            key = own.type, own.field, own.reason
            if key not in seen and own.reason:
                seen.add(key)
                findings.append(own._replace(path=prefix + own.path))
        for field in self.fields:
            if field.step and field.step.nested:
                mark = "" if field.step.wraps or not is_list(field.new.type) else "[]"
                findings += field.step.nested.findings(f"{prefix}{field.new.name}{mark}.", seen)
        return findings

    @property
    def fate(self) -> Fate:
        """The worst fate of any field."""
        worst: Fate = "same bytes" if self.same else "automatic"
        fates = {worst, *(finding.fate for finding in self.findings())}
        return next(fate for fate in FATES if fate in fates)

    @cached_property
    def missing(self) -> list[FieldFate]:
        """The findings that need rules, or that no rule could help."""
        return [each for each in self.findings() if each.fate in OPEN]

    def walk(self) -> Iterator[Plan]:
        """Yield this plan, its parts and those of nested structures, each once."""
        plans = {id(self): self}
        waiting = [self]
        for plan in waiting:
            yield plan
            nested = [each.step.nested for each in plan.fields if each.step and each.step.nested]
            for part in (*plan.through, *nested):
                if id(part) not in plans:
                    plans[id(part)] = part
                    waiting.append(part)


def is_list(type_: ir.FieldType) -> bool:
    """Return whether a field has several values."""
    return isinstance(type_, (ir.Array, ir.Sequence))


def make_plan(old: Version, new: Version, rules: RuleFiles = NO_RULES) -> Plan:
    """Return the plan from one version to another, with these rules."""
    return _Planner(rules).plan(old, new)


def direct_plan(old: Version, new: Version, rules: RuleFile) -> Plan:
    """Return the plan between the two versions of a file of rules, with no other rules."""
    return _Planner(NO_RULES).direct(old, new, rules)


class _Planner:
    """Makes the plan of each pair of versions once."""

    def __init__(self, rules: RuleFiles) -> None:
        self._rules = rules
        self._plans: dict[tuple[VersionKey, VersionKey, int, int], Plan] = {}

    def plan(self, old: Version, new: Version) -> Plan:
        """Return the plan from one version to another."""
        # comments, and with them units, are no part of a hash
        key = old.key, new.key, id(old.message), id(new.message)
        if key not in self._plans:
            chain = self._chain(old, new)
            if len(chain) > 1:
                plan = Plan(old, new)
                plan.through = tuple(
                    self.direct(first, second, rules) for first, second, rules in chain
                )
            else:
                plan = self.direct(old, new, chain[0][2] if chain else None)
            self._plans[key] = plan
        return self._plans[key]

    def _chain(self, old: Version, new: Version) -> list[tuple[Version, Version, RuleFile | None]]:
        """Return the shortest way over pairs of versions that have rules.

        It ends at the new version, or at one from which the rest needs no rule.
        """
        ways: dict[VersionKey, list[tuple[Version, Version, RuleFile | None]]] = {old.key: []}
        order = [(old.key, old)]
        for key, version in order:
            for rules in self._rules.starting(key):
                if rules.new == new.key:
                    return [*ways[key], (version, new, rules)]
                following = self._rules.version(rules)
                if following is not None and rules.new not in ways:
                    ways[rules.new] = [*ways[key], (version, following, rules)]
                    order.append((rules.new, following))
        for key, version in order[1:]:
            if not self.direct(version, new, None).missing:
                return [*ways[key], (version, new, None)]
        return []

    def direct(self, old: Version, new: Version, rules: RuleFile | None) -> Plan:
        """Return the plan that leads over no other version."""
        plan = Plan(old, new)
        plan.rules = rules
        before, after = old.message, new.message
        pairing = pair(before.fields, after.fields, lambda field: field.type)
        replaced = _replaced(before.fields, after.fields, pairing)
        changes = renumbered(before, after)
        fields = self._fields(plan, pairing, replaced, changes)
        plan.fields = tuple(_with_rule(entry, plan, changes) for entry in fields)
        ruled = {field.name for field in after.fields if _rule(plan, field)}
        plan.dropped = tuple(
            _dropped(field, plan)
            for field in pairing.removed
            if not replaced_by(field, replaced) & ruled
        )
        plan.in_order = not (pairing.moved or pairing.added or pairing.removed or pairing.renamed)
        listed = {name for change in changes.values() for name in change.constants}
        plan.notes = tuple(note for note in _constants(before, after) if note.field not in listed)
        return plan

    def _fields(
        self,
        plan: Plan,
        pairing: Pairing[ir.Field],
        replaced: Mapping[str, Sequence[ir.Field]],
        changes: Mapping[str, Renumbering],
    ) -> Iterator[FieldPlan]:
        """Yield the plan of each field of the new version, as it is without rules."""
        kept = {later.name: earlier for earlier, later in pairing.kept}
        renamed = {later.name: earlier for earlier, later in pairing.renamed}
        for field in plan.new.message.fields:
            name, earlier = field.name, kept.get(field.name)
            is_moved = name in pairing.moved
            entry = self._field(plan.old, plan.new, field, earlier, is_moved=is_moved)
            if earlier is None:
                entry = self._without_counterpart(entry, renamed.get(name), replaced.get(name))
            elif name in changes and entry.step is not None:
                entry = _renumbered_field(entry, changes[name])
            yield entry

    def _field(
        self,
        old: Version,
        new: Version,
        field: ir.Field,
        before: ir.Field | None,
        *,
        is_moved: bool,
    ) -> FieldPlan:
        """Return the plan of a field that both versions have, or of an added one."""

        def finding(fate: Fate, reason: str, proposal: str = "") -> FieldFate:
            span, earlier = field.name_span, before.name_span if before else None
            holder = str(new.name)
            return FieldFate(fate, field.name, holder, field.name, reason, span, earlier, proposal)

        if before is None:
            default = "" if field.default is None else f", {spell_value(field.default.value)}"
            reason = f"field `{field.name}` was added: it gets its default{default or ' value'}"
            return FieldPlan(field, None, None, finding("automatic", reason))
        step = self._step(old, new, before.type, field.type)
        if isinstance(step, str):
            was, now = (spell(each.type, new.name.package) for each in (before, field))
            reason = f"field `{field.name}` changed from `{was}` to `{now}`: {step}"
            return FieldPlan(field, before, None, finding("needs a rule", reason))
        if _unit_changed(before, field):
            reason = f"the unit of `{field.name}` changed from [{before.unit}] to [{field.unit}]"
            proposal = _scaled(before, field)
            return FieldPlan(field, before, None, finding("needs a rule", reason, proposal))
        if step.element != "nested" and before.type != field.type:
            was, now = (spell(each.type, new.name.package) for each in (before, field))
            fate: Fate = "same bytes" if step.same else "automatic"
            reason = f"field `{field.name}` changed from `{was}` to `{now}`, without loss"
            return FieldPlan(field, before, step, finding(fate, reason))
        if is_moved:
            return FieldPlan(field, before, step, finding("automatic", f"`{field.name}` was moved"))
        return FieldPlan(field, before, step, finding("same bytes", ""))

    def _without_counterpart(
        self,
        entry: FieldPlan,
        renamed: ir.Field | None,
        replaced: Sequence[ir.Field] | None,
    ) -> FieldPlan:
        """Return the plan of a field whose value may be in one of another name or type."""
        field, finding = entry.new, entry.finding
        if renamed is not None:
            reason = f"field `{renamed.name}` was renamed to `{field.name}`"
            if _unit_changed(renamed, field):
                reason += f", and its unit changed from [{renamed.unit}] to [{field.unit}]"
            finding = finding._replace(
                fate="needs a rule",
                reason=reason,
                old=renamed.name_span,
                proposal=_scaled(renamed, field) or _attribute(renamed),
            )
        elif replaced:
            names = " and ".join(f"`{each.name}`" for each in replaced)
            finding = finding._replace(
                fate="needs a rule",
                reason=f"field `{field.name}` is where {names} was, and may replace it",
                old=replaced[0].name_span,
            )
        return entry._replace(finding=finding)

    def _step(
        self, old: Version, new: Version, before: ir.FieldType, after: ir.FieldType
    ) -> ConversionStep | str:
        """Return the way from a value of one type to one of another, or why there is none."""
        step = self._element(old, new, ir.element_of(before), ir.element_of(after))
        if isinstance(step, str):
            return step
        match before, after:
            case ir.Array(), ir.Array():
                return step if before.size == after.size else "the number of elements differs"
            case ir.Array(), ir.Sequence():
                if after.bound is not None and before.size > after.bound:
                    return "the elements do not fit"
                return step._replace(same=False, alike=False)
            case ir.Sequence(), ir.Sequence():
                fits = after.bound is None or (
                    before.bound is not None and before.bound <= after.bound
                )
                return step if fits else "old messages may contain more elements than fit"
            case (ir.Array() | ir.Sequence(), _) | (_, ir.Sequence()):
                return "the number of elements differs"
            case _, ir.Array():
                if after.size != 1:
                    return "the number of elements differs"
                return step._replace(wraps=True, alike=False)
        return step

    def _element(
        self, old: Version, new: Version, before: ir.Element, after: ir.Element
    ) -> ConversionStep | str:
        match before, after:
            case ir.Ref(), ir.Ref():
                if before.target != after.target:
                    return "it is another type"
                nested = self.plan(old.of(before.target), new.of(after.target))
                return ConversionStep("nested", nested, same=nested.same, alike=nested.alike)
            case ir.String(), ir.String():
                if tighter(before, after):
                    return "old messages may contain text that is too long"
                if before.wide and not after.wide:
                    return "a string cannot hold every text of a wstring"
                same = before.wide == after.wide
                return ConversionStep(same=same, alike=same)
            case ir.Primitive(), ir.Primitive():
                return _number(before.name, after.name)
        return "the values are of another kind"


OCTETS = frozenset({"uint8", "char"})


def _number(before: str, after: str) -> ConversionStep | str:
    """Return the way from one primitive to another, or the reason why values may not fit."""
    if before == after or {before, after} <= OCTETS:
        return ConversionStep()
    if before == "byte" and after in OCTETS:
        return ConversionStep("number", alike=False)
    if after == "byte" and before in OCTETS:
        return ConversionStep("byte", alike=False)
    if before == "bool":
        is_integer = after in _INTEGERS and after != "byte"
        step = ConversionStep("int", same=False, alike=False)
        return step if is_integer else "a bool is not such a number"
    if after in ("bool", "byte"):
        return "not every number fits"
    if not _holds_all(after, before):
        is_float = before in _INTEGERS and after not in _INTEGERS
        return "not every number fits exactly" if is_float else "not every number fits"
    element: ElementChange = "number" if before == "byte" else "as is"
    if before in _INTEGERS and after not in _INTEGERS:
        element = "byte as float" if before == "byte" else "float"
    return ConversionStep(element, same=False, alike=False)


#: The least and the greatest value of each type of integers.
_INTEGERS = {
    name: (info.low, info.high)
    for name, info in ir.PRIMITIVES.items()
    if info.low is not None and info.high is not None
}
#: The integers that a float holds exactly are as long as its mantissa.
_EXACT = {"float32": (-(1 << 24), 1 << 24), "float64": (-(1 << 53), 1 << 53)}


def _holds_all(new: str, old: str) -> bool:
    """Return whether every number of the type `old` is one of the type `new`, without rounding."""
    if old not in _INTEGERS:
        return new not in _INTEGERS and ir.PRIMITIVES[new].size >= ir.PRIMITIVES[old].size
    low, high = _INTEGERS[new] if new in _INTEGERS else _EXACT[new]
    least, greatest = _INTEGERS[old]
    return low <= least and greatest <= high


def changed_meanings(old: Version, new: Version) -> Iterator[str]:
    """Yield the units and constants that differ between versions of one hash, as sentences."""
    for name in sorted(old.reached & new.reached):
        before, after = old.of(name).message, new.of(name).message
        fields = {field.name: field for field in before.fields}
        for field in after.fields:
            if field.name in fields and _unit_changed(fields[field.name], field):
                units = f"[{fields[field.name].unit}] to [{field.unit}]"
                yield f"the unit of `{field.name}` changed from {units}"
        for field_name, change in renumbered(before, after).items():
            yield f"`{field_name}`: {change.reason}"


def _unit_changed(old: ir.Field, new: ir.Field) -> bool:
    units = old.unit, new.unit
    return all(unit and not ir.is_range(unit) for unit in units) and old.unit != new.unit


def _rule(plan: Plan, field: ir.Field) -> RuleFile | None:
    """Return the plan's rules if one of them is for a field."""
    rules = plan.rules
    return rules if rules and attribute(field.name) in rules.fields else None


def _with_rule(entry: FieldPlan, plan: Plan, changes: Mapping[str, Renumbering]) -> FieldPlan:
    """Return the plan of a field by its rule, if it has one for what changed."""
    field, rules = entry.new, _rule(plan, entry.new)
    if rules is None:
        return entry
    is_about_it = (
        plan.old.key != plan.new.key
        or _covers_unit(rules, entry)
        or _covers_constants(rules, field.name, changes)
    )
    if not is_about_it:
        return entry
    reason = f"{entry.finding.reason or 'set'}, by the rule in {rules.path}"
    finding = entry.finding._replace(fate="rule", reason=reason, proposal="")
    return FieldPlan(field, None, None, finding)


def _dropped(field: ir.Field, plan: Plan) -> FieldFate:
    """Return the finding of a field that only the old version has."""
    source = plan.new.message.source
    return FieldFate(
        "automatic",
        field.name,
        str(plan.old.message.name),
        field.name,
        f"field `{field.name}` was removed: its data is dropped",
        Span(source, 0, 0) if source else None,
        field.name_span,
    )


def _renumbered_field(entry: FieldPlan, change: Renumbering) -> FieldPlan:
    """Return the plan of a field whose values have another meaning in the new version."""
    reason = f"`{entry.new.name}`: {change.reason}"
    finding = entry.finding._replace(fate="needs a rule", reason=reason, proposal=change.proposal)
    return FieldPlan(entry.new, entry.old, None, finding)


def _covers_constants(rules: RuleFile, field: str, changes: Mapping[str, Renumbering]) -> bool:
    """Return whether rules between versions of one hash are about renumbered constants."""
    pairs = [(change.old, change.new) for change in changes.values()]
    return rules.constants.get(field) in pairs


def _covers_unit(rules: RuleFile, entry: FieldPlan) -> bool:
    """Return whether rules between versions of one hash are about this change of a unit."""
    if entry.old is None or entry.finding.fate != "needs a rule":
        return False
    return rules.units.get(entry.new.name) == (entry.old.unit, entry.new.unit)


def _attribute(field: ir.Field) -> str:
    return f"old.{attribute(field.name)}"


def _scaled(old: ir.Field, new: ir.Field) -> str:
    """Return the expression of a value in another unit, empty if the units say no factor."""
    expression = factor(old.unit or "", new.unit or "")
    if not expression or not _unit_changed(old, new):
        return ""
    if is_list(old.type):
        return f"[{expression.format('value')} for value in {_attribute(old)}]"
    return expression.format(_attribute(old))


def _replaced(
    old: Sequence[ir.Field], new: Sequence[ir.Field], pairing: Pairing[ir.Field]
) -> dict[str, list[ir.Field]]:
    """Return the removed fields in whose place each added field is."""
    steady = {field.name for field, _ in pairing.kept} - pairing.moved

    def gaps(
        fields: Sequence[ir.Field], wanted: Sequence[ir.Field]
    ) -> Iterator[tuple[int, ir.Field]]:
        names, gap = {field.name for field in wanted}, 0
        for field in fields:
            gap += field.name in steady
            if field.name in names:
                yield gap, field

    removed: dict[int, list[ir.Field]] = {}
    for gap, field in gaps(old, pairing.removed):
        removed.setdefault(gap, []).append(field)
    return {field.name: removed[gap] for gap, field in gaps(new, pairing.added) if gap in removed}


def replaced_by(field: ir.Field, replaced: Mapping[str, Sequence[ir.Field]]) -> set[str]:
    """Return the names of the added fields that may replace a removed one."""
    return {name for name, fields in replaced.items() if field in fields}


def _constants(old: ir.Message, new: ir.Message) -> Iterator[FieldFate]:
    """Yield a finding for each constant whose value is another now: recorded values stay."""
    values = {constant.name: constant for constant in new.constants}
    for constant in old.constants:
        later = values.get(constant.name)
        if later is not None and repr(later.value) != repr(constant.value):
            was, now = spell_value(constant.value), spell_value(later.value)
            reason = f"constant `{constant.name}` changed from {was} to {now}: recorded values stay"
            yield FieldFate(
                "same bytes",
                constant.name,
                str(new.name),
                constant.name,
                reason,
                later.value_span,
                constant.value_span,
            )
