"""Reading many serialized messages of one type: the whole of it, up to a table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import numpy as np

from ...errors import DecodeError
from ..batches import failed
from ..field_reader import check
from ..typeinfo import type_name
from .build import plan_of
from .lanes import Found, Lanes, UnreadableError
from .plan import Level
from .scan import Scan
from .table import Elements, Table
from .values import Batch


def batch_of(messages: Any) -> Batch:
    """Return messages as arrays of bytes and of positions; an iterable's are copied."""
    if all(hasattr(messages, name) for name in ("buffer", "starts", "stops")):
        return _checked(messages)
    raws = [
        raw if type(raw) is bytes else memoryview(raw).cast("B") for raw in messages
    ]
    sizes = np.fromiter(map(len, raws), np.int64, len(raws))
    stops = np.cumsum(sizes)
    return Batch(np.frombuffer(b"".join(raws), np.uint8), stops - sizes, stops)


def _checked(batch: Any) -> Batch:
    buffer = np.frombuffer(memoryview(batch.buffer).cast("B"), np.uint8)
    starts, stops = (
        np.asarray(one).astype(np.int64, casting="same_kind")
        for one in (batch.starts, batch.stops)
    )
    if starts.shape != stops.shape or starts.ndim != 1:
        raise ValueError("starts and stops of a batch must be as many")
    if ((starts < 0) | (starts > stops) | (stops > len(buffer))).any():
        raise ValueError("a message of the batch is not within its buffer")
    return Batch(buffer, starts, stops)


@contextmanager
def reading(
    kind: type, messages: Any, fields: Iterable[str] | None, datetimes: bool
) -> Iterator[tuple[Table, Elements]]:
    """Give what is in messages, and the rows of the table; raise DecodeError."""
    name = type_name(kind)
    wanted = (fields,) if isinstance(fields, str) else fields
    plan = plan_of(name, None if wanted is None else tuple(wanted), datetimes)
    batch = batch_of(messages)
    try:
        yield _read(plan, batch)
    except UnreadableError:
        explain(name, batch)


def _read(plan: Level, batch: Batch) -> tuple[Table, Elements]:
    big = orders(batch)
    found = Found()
    done, mixed = [], bool(big.any() and not big.all())
    for order, rows in (("<", np.flatnonzero(~big)), (">", np.flatnonzero(big))):
        if len(rows):
            starts = batch.starts[rows]
            lanes = Lanes(starts + 4, batch.stops[rows], starts + 4)
            first = found.count[plan.key]
            found.count[plan.key] += len(rows)
            Scan(batch.buffer, order, found).level(plan, lanes, first)
            done.append(rows)
    order_of_rows = np.concatenate(done) if mixed else None
    order = ">" if big.any() and not mixed else "<"
    top = Elements(plan, len(big), order_of_rows, big if mixed else None)
    return Table(batch, order, found), top


def orders(batch: Batch) -> Any:
    """Return which messages are big-endian, as their encapsulation headers say."""
    if (batch.stops - batch.starts < 4).any():
        raise UnreadableError
    first, second = batch.buffer[batch.starts], batch.buffer[batch.starts + 1]
    if (first != 0).any() or (second > 1).any():
        raise UnreadableError
    return second == 0


def explain(name: str, batch: Batch) -> NoReturn:
    """Raise DecodeError for the first message that is not of a type."""
    for index, raw in enumerate(batch):
        try:
            check(name, bytes(raw))
        except DecodeError as error:
            failed(error, index)
    raise AssertionError("all messages can be read one by one")
