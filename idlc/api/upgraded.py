"""Messages of an earlier version as columns of the new one, at once where the plan is automatic."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from idlc.recordings.batches import Batch
from idlc.recordings.columns.read import to_columns
from idlc.recordings.columns.values import Columns, Ragged
from idlc.recordings.containers.messages import Raw, TopicMessages
from idlc.versions.conversion import ConversionStep, Plan
from idlc.versions.converters import kind_of


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
