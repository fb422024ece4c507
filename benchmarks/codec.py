"""Serialize and deserialize, one message at a time."""

from collections.abc import Iterator
from functools import partial

from benchmarks.measure import IDLC, Goal, Repeated, Row
from benchmarks.messages import MESSAGES
from benchmarks.work import Work

#: Every field that is one large array is called `data`.
PAYLOAD = "data"


def rows(work: Work) -> Iterator[Row]:
    for name, message in MESSAGES.items():
        goal = Goal(at_most=1.2, than="memcpy") if message.large else Goal(times=3)
        for group, prepare in (("serialize", encoders), ("deserialize", decoders)):
            yield Row(group, name, partial(prepare, work, name), goal)


def memcpy(work: Work, name: str):
    """Return what every codec of a large message has to do at least."""
    if not MESSAGES[name].large:
        return {}
    payload = getattr(work.message(IDLC, name), PAYLOAD)
    return {"memcpy": Repeated(lambda: bytes(payload))}


def encoders(work: Work, name: str):
    found = {}
    for who, implementation in work.implementations.items():
        message = work.message(who, name)
        if message is not None:
            function = implementation.encoder(name, message)
            work.check_bytes(who, name, function())
            found[who] = Repeated(function)
    return found | memcpy(work, name)


def decoders(work: Work, name: str):
    found = {
        who: Repeated(implementation.decoder(name, work.raw(name)))
        for who, implementation in work.implementations.items()
        if work.message(who, name) is not None
    }
    return found | memcpy(work, name)
