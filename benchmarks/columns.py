"""Columns of messages whose sequences differ in length, as real recordings have them.

Times are per message. Peers make one message after the other, and no columns of them yet.
"""

from collections.abc import Iterator
from copy import copy
from functools import partial
from random import Random
from typing import NamedTuple

import numpy as np

from benchmarks.batches import decoders, each
from benchmarks.measure import IDLC, Goal, Row
from benchmarks.messages import MESSAGES
from benchmarks.work import Work


class Varied(NamedTuple):
    """A row: the message that all are shorter than, and how many there are."""

    message: str
    count: int
    goal: Goal


ROWS = {
    "JointState(3..20)": Varied("JointState(20)", 10_000, Goal(at_most=5e-6)),
    "TFMessage(1..10)": Varied("TFMessage(50)", 5_000, Goal(at_most=10e-6)),
    "DiagnosticArray(1..10x1..8)": Varied("DiagnosticArray(20x10)", 3_000, Goal(at_most=40e-6)),
    "PointCloud2(5k..20k)": Varied("PointCloud2(100k)", 200, Goal(at_most=1.2, than="copy")),
}


def rows(work: Work) -> Iterator[Row]:
    for name, varied in ROWS.items():
        yield Row("ragged columns", name, partial(columns, work, varied), varied.goal, rounds=9)


def columns(work: Work, varied: Varied):
    kind = work.implementations[IDLC].class_of(*MESSAGES[varied.message].parts)
    count = varied.count // 10 if work.quick else varied.count
    whole, rng = work.message(IDLC, varied.message), Random(1)
    messages = [shortened(whole, rng) for _ in range(count)]
    buffers = kind.serialize_many(messages)
    assert kind.to_columns(buffers)[-1] == messages[-1].to_dict()
    memory = np.frombuffer(b"".join(buffers), np.uint8)
    return {
        IDLC: each(lambda: kind.to_columns(buffers), count),
        "to_arrow": each(lambda: kind.to_arrow(buffers), count),
        "deserialize_many": each(lambda: kind.deserialize_many(buffers), count),
        **decoders(work, varied.message, buffers[:1000]),
        # what a result of this size costs at least, as it is memory that nobody had yet
        "copy": each(lambda: memory.copy(), count),
    }


def shortened(whole, rng: Random):
    """Return a copy of a message with fewer elements in what differs from one to another."""
    result = copy(whole)
    match type(whole).__name__:
        case "JointState":
            count = rng.randint(3, 20)
            for field in ("name", "position", "velocity", "effort"):
                setattr(result, field, getattr(whole, field)[:count])
        case "TFMessage":
            result.transforms = whole.transforms[: rng.randint(1, 10)]
        case "DiagnosticArray":
            result.status = [copy(one) for one in whole.status[: rng.randint(1, 10)]]
            for one in result.status:
                one.values = one.values[: rng.randint(1, 8)]
        case "PointCloud2":
            result.width = rng.randint(5_000, 20_000)
            result.row_step = 16 * result.width
            result.data = whole.data[: result.row_step]
    return result
