"""Reading the columns of many messages, and saying which message cannot be read."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from types import SimpleNamespace
from typing import Any, NamedTuple, NoReturn

import numpy as np

from idlc.recordings.arguments import texts
from idlc.recordings.columns.elements import selected
from idlc.recordings.columns.plan import PlanLevel, plan_of
from idlc.recordings.columns.scan import (
    Cursors,
    ScanResult,
    UnreadableError,
    VectorScan,
    scan_uniform,
)
from idlc.recordings.columns.source import BytesSource, Flat, Pieces
from idlc.recordings.columns.table import Elements, Table
from idlc.recordings.columns.values import Columns
from idlc.runtime.cdr import order_of
from idlc.runtime.names import DecodeError, owner_of
from idlc.runtime.typeinfo import CarefulReader, Structure, structure_of

#: From this mean size on, messages are not copied into one array.
LARGE = 1 << 15


class MessageBytes(NamedTuple):
    """Serialized messages: where they begin and end in a source, as arrays."""

    source: BytesSource
    starts: Any
    stops: Any

    def part(self, first: int, last: int) -> MessageBytes:
        """Return some of the messages."""
        return self._replace(starts=self.starts[first:last], stops=self.stops[first:last])


def messages_of(messages: Any) -> MessageBytes:
    """Return the messages of a batch, or of an iterable; small ones of that are copied."""
    if all(hasattr(messages, name) for name in ("buffer", "starts", "stops")):
        array = np.frombuffer(memoryview(messages.buffer).cast("B"), np.uint8)
        starts, stops = np.asarray(messages.starts), np.asarray(messages.stops)
        for positions in (starts, stops):
            if positions.size and positions.dtype.kind not in "iu":
                raise TypeError("starts and stops of a batch must be integers")
        starts, stops = starts.astype(np.int64), stops.astype(np.int64)
        if starts.shape != stops.shape or starts.ndim != 1:
            raise ValueError("starts and stops of a batch must be as many")
        if ((starts < 0) | (starts > stops) | (stops > len(array))).any():
            raise ValueError("a message of the batch is not within its buffer")
        return MessageBytes(Flat(array), starts, stops)
    raws = [raw if type(raw) is bytes else memoryview(raw).cast("B") for raw in messages]
    sizes = np.fromiter(map(len, raws), np.int64, len(raws))
    stops = np.cumsum(sizes)
    starts = stops - sizes
    if len(raws) and stops[-1] >= LARGE * len(raws):
        return MessageBytes(Pieces(raws, starts), starts, stops)
    return MessageBytes(Flat(np.frombuffer(b"".join(raws), np.uint8)), starts, stops)


def type_of(kind: type | Structure) -> Structure:
    """Return the type of a class of messages."""
    return kind if isinstance(kind, Structure) else structure_of(kind)


def to_columns(
    kind: type | Structure,
    messages: Any,
    fields: Iterable[str] | None = None,
    datetimes: bool = False,
    on_unread: Callable[[Any], object] | None = None,
) -> Columns:
    """Return the columns of messages, which may have a way of their own; raise DecodeError.

    Elements of lists, such as `position.elbow` or `covariance[0]`, can be among the fields.
    `on_unread` gets the number of bytes that are left in each message, and `None` if that is not
    known, because not all fields are read, or a message cannot be read.
    """
    wanted = None if fields is None else texts(fields, "`fields`")
    judge = on_unread or _ignore
    selection = None
    if wanted is not None:
        selection = selected(type_of(kind), tuple(wanted))
        wanted = selection.needed
    if hasattr(messages, "columns"):
        judge(None)
        columns: Columns = messages.columns(kind, wanted)
    else:
        plan = plan_of(type_of(kind), wanted)
        located = messages_of(messages)
        try:
            table, top, unread = _read(plan, located)
        except UnreadableError:
            judge(None)
            explain(kind, plan, located)
        judge(unread if plan.whole else None)
        columns = table.columns(top)
    if selection is not None and selection.elements:
        columns = selection.columns(columns)
    return columns.dated() if datetimes else columns


def _ignore(_unread: Any) -> None:
    """Judge nothing."""


def unread_bytes(kind: type | Structure, messages: Any) -> Any:
    """Return the number of bytes in each message that its type does not read.

    It is `None` if a message cannot be read.
    """
    try:
        return _read(plan_of(type_of(kind), None), messages_of(messages))[2]
    except UnreadableError:
        return None


def _read(plan: PlanLevel, messages: MessageBytes) -> tuple[Table, Elements, Any]:
    source, result = messages.source, ScanResult()
    if (messages.stops - messages.starts < 4).any():
        raise UnreadableError
    # the byte order, as the encapsulation headers say
    zeros, orders = (source.items(messages.starts + at, "u1") for at in (0, 1))
    if (zeros != 0).any() or (orders > 1).any():
        raise UnreadableError
    big = orders == 0
    mixed = bool(big.any() and not big.all())
    done: list[Any] = []
    unread = np.zeros(len(big), np.int64)
    for order, rows in (("<", np.flatnonzero(~big)), (">", np.flatnonzero(big))):
        starts = messages.starts[rows] + 4
        cursors = Cursors(starts, messages.stops[rows], starts)
        rest = np.ones(len(rows), bool)
        for chosen, left in scan_uniform(plan, source, order, cursors, result):
            done.append(rows[chosen])
            unread[rows[chosen]] = left
            rest[chosen] = False
        if rest.any():
            first = result.count[plan.key]
            result.count[plan.key] += int(rest.sum())
            others = cursors.select(rest)
            VectorScan(source, order, result).level(plan, others, first)
            unread[rows[rest]] = others.end - others.at
            done.append(rows[rest])
    order = ">" if big.any() and not mixed else "<"
    table = Table(source, order, result)
    order_of_rows: Any = None if len(done) < 2 else np.concatenate(done)
    return table, Elements(plan, len(big), order_of_rows, big if mixed else None), unread


def explain(kind: Any, plan: PlanLevel, messages: MessageBytes) -> NoReturn:
    """Raise the DecodeError of a class's package for the first message that is not one of it."""
    first, last = 0, len(messages.starts)
    while last - first > 1:  # the first one that cannot be read is in between
        middle = (first + last) // 2
        try:
            _read(plan, messages.part(first, middle))
            first = middle
        except UnreadableError:
            last = middle
    try:
        broken = messages.part(first, first + 1)
        raw = bytes(messages.source.ranges(broken.starts, broken.stops - broken.starts))
        # classes of other packages need not be installed
        reader = CarefulReader(raw, order_of(raw), lambda _: SimpleNamespace())
        reader.message(type_of(kind), "")
    except DecodeError as error:
        path = f"[{first}].{error.path}" if error.path else f"[{first}]"
        own: Any = DecodeError
        if not isinstance(kind, Structure):  # it comes with a runtime, perhaps of its own
            base = owner_of(kind).__base__
            own = sys.modules[base.__module__.rpartition(".")[0]].DecodeError
        raise own(error.problem, path, error.offset) from error
    raise AssertionError(f"[{first}] can be read by itself")
