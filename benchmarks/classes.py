"""Construct with defaults, copy and compare: what programs do to messages all day."""

import copy
from collections.abc import Iterator
from functools import partial

from benchmarks.measure import IDLC, Goal, Repeated, Row
from benchmarks.messages import MESSAGES
from benchmarks.work import Work

NAMES = (
    "String",
    "PoseStamped",
    "Imu",
    "JointState(20)",
    "DiagnosticArray(20x10)",
    "Image(640x480x3)",
)
#: The others have no defaults.
WITH_DEFAULTS = (IDLC, "rclpy")
#: Copies of its messages have lost their fields.
NOT_COPIED = "mcap-ros2"


def rows(work: Work) -> Iterator[Row]:
    ahead = Goal(times=1)
    for name in NAMES:
        yield Row("construct", name, partial(constructors, work, name), Goal(times=2))
        yield Row("copy.copy", name, partial(copies, work, name, copy.copy), ahead)
        yield Row("copy.deepcopy", name, partial(copies, work, name, copy.deepcopy), ahead)
        yield Row("compare", name, partial(comparisons, work, name), ahead)


def constructors(work: Work, name: str):
    classes = {
        who: work.implementations[who].class_of(*MESSAGES[name].parts)
        for who in WITH_DEFAULTS
        if who in work.implementations and work.message(who, name) is not None
    }
    return {who: Repeated(kind) for who, kind in classes.items()}


def copies(work: Work, name: str, how):
    found = {}
    for who, implementation in work.implementations.items():
        message = work.message(who, name)
        if message is not None and who != NOT_COPIED:
            work.check_bytes(who, name, implementation.encoder(name, how(message))())
            found[who] = Repeated(partial(how, message))
    return found


def comparisons(work: Work, name: str):
    """Return candidates that compare two equal messages, which share no value."""
    found = {}
    for who, implementation in work.implementations.items():
        if work.message(who, name) is not None:
            read = implementation.decoder(name, work.raw(name))
            one, other = read(), read()
            try:
                assert (one == other) is True, (who, name)
            except ValueError:  # a dataclass that holds numpy arrays
                continue
            found[who] = Repeated(partial(lambda a, b: a == b, one, other))
    return found
