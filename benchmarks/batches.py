"""Many messages of one type at once: lists, columns, and arrays that stay where they are.

Times are per message. Peers that have no such thing read or write one message after the other.
"""

from collections.abc import Iterator
from functools import partial

from benchmarks.measure import IDLC, Candidate, Goal, Repeated, Row
from benchmarks.messages import MESSAGES
from benchmarks.work import Work

#: Messages in a list, and rows in columns.
COUNT, ROWS = 1000, 10_000
NAMES = ("String", "PoseStamped", "Imu", "JointState(20)", "LaserScan(720)")


def rows(work: Work) -> Iterator[Row]:
    ahead = Goal(times=3)
    for name in NAMES:
        yield Row("serialize_many", name, partial(writing, work, name), ahead, rounds=21)
        yield Row("deserialize_many", name, partial(reading, work, name), ahead, rounds=21)
    for name in NAMES[1:]:
        yield Row("to_columns", name, partial(columns, work, name), ahead, rounds=15)
    nothing = Goal(at_most=0.2, than="memcpy")
    for name, message in MESSAGES.items():
        if message.large:
            yield Row("copy=False", name, partial(views, work, name), nothing)


def each(function, count: int = COUNT) -> Candidate:
    """Return the candidate of a function that handles many messages; its time is of one."""
    whole = Repeated(function)
    return lambda: whole() / count


def one_by_one(functions) -> Candidate:
    return each(lambda: [function() for function in functions])


def writing(work: Work, name: str):
    kind = work.implementations[IDLC].class_of(*MESSAGES[name].parts)
    messages = [work.message(IDLC, name)] * COUNT
    found = {IDLC: each(lambda: kind.serialize_many(messages))}
    for who, implementation in work.implementations.items():
        message = work.message(who, name)
        encoders = [implementation.encoder(name, message)] * COUNT
        found[label(who, "serialize")] = one_by_one(encoders)
    return found


def reading(work: Work, name: str):
    kind = work.implementations[IDLC].class_of(*MESSAGES[name].parts)
    buffers = copies(work, name)
    assert kind.deserialize_many(buffers) == [work.message(IDLC, name)] * COUNT
    return {IDLC: each(lambda: kind.deserialize_many(buffers))} | decoders(work, name, buffers)


def columns(work: Work, name: str):
    kind = work.implementations[IDLC].class_of(*MESSAGES[name].parts)
    count = COUNT if work.quick else ROWS
    buffers = copies(work, name, count)
    assert len(kind.to_columns(buffers)) == count
    found = {IDLC: each(lambda: kind.to_columns(buffers), count)}
    found |= decoders(work, name, buffers[:COUNT])
    return found | {"join of the buffers": each(lambda: bytearray().join(buffers), count)}


def views(work: Work, name: str):
    kind = work.implementations[IDLC].class_of(*MESSAGES[name].parts)
    raw = work.raw(name)
    payload = work.message(IDLC, name).data
    others = {
        label(who, "deserialize"): Repeated(implementation.decoder(name, raw))
        for who, implementation in work.implementations.items()
        if work.message(who, name) is not None
    }
    memcpy = {"memcpy": Repeated(lambda: bytes(payload))}
    return {IDLC: Repeated(lambda: kind.deserialize(raw, copy=False))} | others | memcpy


def copies(work: Work, name: str, count: int = COUNT) -> list[bytes]:
    """Return as many buffers, each of its own memory."""
    return [bytes(bytearray(work.raw(name))) for _ in range(count)]


def decoders(work: Work, name: str, buffers: list[bytes]) -> dict[str, Candidate]:
    return {
        label(who, "deserialize"): one_by_one([implementation.decoder(name, b) for b in buffers])
        for who, implementation in work.implementations.items()
        if work.message(who, name) is not None
    }


def label(who: str, function: str) -> str:
    """Return what a peer's time is called; idlc's, one by one, is no peer's."""
    return function if who == IDLC else who
