"""`idlc.upgrade(old, new)`: a converter between two classes, and what it makes of recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from idlc.diagnostics.report import Report
from idlc.project.root import Root
from idlc.recordings.arguments import message_class, texts
from idlc.recordings.batches import Batch
from idlc.recordings.columns import to_arrow, to_columns
from idlc.recordings.columns.values import Columns, Ragged
from idlc.recordings.containers.messages import Raw, Separate, TopicMessages
from idlc.versions.classes import version_of
from idlc.versions.conversion import NO_RULES, ConversionStep, FieldFate, Plan, RuleFiles, make_plan
from idlc.versions.converters import Converters, Functions, kind_of, words_of
from idlc.versions.exact import Payloads
from idlc.versions.rules import Known, read_rules, rule_files, run_rules


class Upgraded(TopicMessages, frozen=True, eq=False):
    """Messages that are read as another version by an `Upgrade`.

    Errors count from `first` and name the topic.
    """

    recorded: TopicMessages
    upgrade: Any
    topic: str = ""
    first: int = 0

    def __iter__(self) -> Iterator[Raw]:
        return iter(self.views())

    def views(self) -> list[Raw]:
        """Return the bytes of each message in the new version."""
        of = f" of `{self.topic}`" if self.topic else ""
        first, views = self.first, self.recorded.views()
        return [*self.upgrade.many(views, lambda number: f"message {first + number}{of}")]

    def columns(self, kind: Any, fields: Iterable[str] | None) -> Columns:
        """Return columns of a type, the new version's."""
        plan = self.upgrade.plan
        if plan.through or plan.uses_rules:
            return to_columns(kind, self.views(), fields)
        wanted = to_columns(kind, (), fields)
        kept = [field.old.name for field in plan.fields if field.old and field.new.name in wanted]
        return _columns(plan, to_columns(self.upgrade.old, self.recorded, kept), wanted)


def _columns(plan: Plan, old: Columns, wanted: Columns) -> Columns:
    """Return the columns that are `wanted`, which has no rows, from those of the old version."""
    columns: dict[str, Any] = {}
    defaults: Columns | None = None
    for field in plan.fields:
        name = field.new.name
        if name not in wanted:
            continue
        if field.old is not None and field.step is not None:
            columns[name] = _column(field.step, old[field.old.name], wanted[name])
            continue
        if defaults is None:
            kind, count = kind_of(plan.new), len(old)
            data = kind().serialize()
            every = Batch(data, np.zeros(count, np.int64), np.full(count, len(data)))
            defaults = to_columns(kind, every)
        columns[name] = _picked(defaults[name], wanted[name])
    return Columns(columns, len(old), wanted.times)


def _picked(column: Any, wanted: Any) -> Any:
    """Return a column with only the wanted fields."""
    if isinstance(wanted, Ragged):
        return Ragged(column.offsets, _picked(column.values, wanted.values), wanted.size)
    if not isinstance(wanted, Columns):
        return column
    columns = {name: _picked(column[name], wanted[name]) for name in wanted.keys()}  # noqa: SIM118
    return Columns(columns, len(column), wanted.times)


def _column(step: ConversionStep, old: Any, wanted: Any) -> Any:
    """Return the column of a field."""
    if not isinstance(wanted, Ragged):
        values = _elements(step, old, wanted)
        return values[:, None] if step.wraps and isinstance(values, np.ndarray) else values
    if step.wraps:
        offsets, values = np.arange(len(old) + 1), old
    elif isinstance(old, Ragged):
        offsets, values = old.offsets, old.values
    else:  # an array of numbers
        offsets, values = np.arange(len(old) + 1) * old.shape[1], old.reshape(-1)
    return Ragged(offsets, _elements(step, values, wanted.values), wanted.size)


def _elements(step: ConversionStep, old: Any, wanted: Any) -> Any:
    """Return the column of elements."""
    if isinstance(wanted, Columns):
        assert step.nested is not None
        return _columns(step.nested, old, wanted)
    return old.astype(wanted.dtype, copy=False) if isinstance(wanted, np.ndarray) else old


class UpgradeError(ValueError):
    """Two versions of a type between which nobody has said how to convert.

    `findings` are the fields that need a rule.
    """

    def __init__(self, message: str, findings: Iterable[FieldFate] = ()) -> None:
        super().__init__(message)
        self.findings = tuple(findings)


def named_rules(rules: Any) -> tuple[RuleFiles, dict[str, Path]]:
    """Return the rules in a file or folder, or several of them, and the files by their names."""
    if rules is None:
        return NO_RULES, {}
    paths = texts(rules, "the files of `rules`")
    root, report = Root.here(), Report()
    files, bad = read_rules(rule_files(paths, root), root, report)
    for error in bad:
        line, _ = error.span.source.position(error.span.start)
        raise UpgradeError(f"{error.span.source.path}:{line}: {error}")
    for problem in report.errors:
        raise UpgradeError(problem.message)
    return Known(files), {file.path: file.file for file in files}


class Runner:
    """Runs files of rules that were named, each once."""

    def __init__(self, files: dict[str, Path]) -> None:
        self._files = files
        self._functions: dict[str, Functions] = {}

    def __call__(self, path: str) -> Functions:
        """Return the functions in a file."""
        if path not in self._functions:
            try:
                self._functions[path] = run_rules(self._files[path])
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # SystemExit would end idlc without a word
                raise UpgradeError(f"{path} cannot be run: {words_of(error)}") from error
        return self._functions[path]


def complete(plan: Plan) -> Plan:
    """Return a plan; raise UpgradeError if a field in it needs a rule."""
    if plan.missing:
        lines = "; ".join(f"{each.path}: {each.reason}" for each in plan.missing)
        message = f"{plan.old.key.short} needs rules to become {plan.new.key.short}: {lines}"
        raise UpgradeError(message, plan.missing)
    return plan


class Upgrade:
    """Converts messages of one version of a type to another: objects, bytes and columns.

    It can be pickled, with the paths of its rules.
    """

    def __init__(self, old: Any, new: Any, rules: Any = None) -> None:
        known, files = named_rules(rules)
        self._arguments = old, new, rules
        self._run = Runner(files)
        before, after = (version_of(message_class(kind)) for kind in (old, new))
        self.plan = complete(make_plan(before, after, known))

    def __repr__(self) -> str:
        return f"<Upgrade from {self.plan.old.key.short} to {self.plan.new.key.short}>"

    def __reduce__(self) -> Any:
        return Upgrade, self._arguments

    @property
    def old(self) -> Any:
        """The class of the earlier version."""
        return self._arguments[0]

    @property
    def findings(self) -> list[FieldFate]:
        """The changed fields, at any depth."""
        return self.plan.findings()

    @cached_property
    def _message(self) -> Any:
        return Converters(self._run).message(self.plan)

    @cached_property
    def _payloads(self) -> Payloads:
        return Payloads(self.plan, self._run)

    def message(self, message: Any) -> Any:
        """Return the message of the new class; it shares nothing with the old one.

        Raises ValidationError for a value of a rule that does not fit.
        """
        fields = self.old._fields_and_field_types  # noqa: SLF001
        if getattr(type(message), "_fields_and_field_types", None) != fields:
            raise TypeError(f"{message!r} is not a message of {self.plan.old.key.short}")
        return self._message(message)

    def payload(self, payload: Any) -> bytes:
        """Return the new bytes of one serialized message; see `many`."""
        return self.many([payload])[0]

    def many(
        self,
        payloads: Iterable[Any],
        place: Callable[[int], str] = lambda number: f"message {number}",
    ) -> list[bytes]:
        """Return the new bytes of serialized messages; copies where the versions are alike.

        Raises idlc's RecordingError, in which `place` names the message.
        """
        if self.plan.same:
            return [each if type(each) is bytes else bytes(memoryview(each)) for each in payloads]
        return self._payloads.many(payloads, place)

    def columns(self, payloads: Iterable[Any], **options: Any) -> Any:
        """Return serialized messages as columns of the new type, as its `to_columns` does."""
        return to_columns(self._arguments[1], self._upgraded(payloads), **options)

    def arrow(self, payloads: Iterable[Any], **options: Any) -> Any:
        """Return serialized messages as a table of the new type, as its `to_arrow` does."""
        return to_arrow(self._arguments[1], self._upgraded(payloads), **options)

    def _upgraded(self, payloads: Iterable[Any]) -> Upgraded:
        return Upgraded(None, None, Separate(None, None, list(payloads)), self)


def upgrade(old: Any, new: Any, rules: Any = None) -> Upgrade:
    """Return the converter from one version of a message class to another.

    `rules` is a file or folder of rules, or several of them, which are run. Raises UpgradeError if
    the classes differ in a way that needs a rule that is not there.
    """
    return Upgrade(old, new, rules)
