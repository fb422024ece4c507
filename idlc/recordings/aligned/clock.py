"""The ticks of a clock, and the value of a topic at each: of one message, or between two."""

from __future__ import annotations

import re
from datetime import timedelta
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from idlc.recordings.containers.source import RecordingError
from idlc.recordings.times import SECOND, UNITS

#: How the value of a tick is found.
WAYS = ("last", "nearest", "linear")
#: A clock with a period has at most so many ticks, or so many for each message.
TICKS, TICKS_PER_MESSAGE = 1_000_000, 1000
#: The largest difference of two times.
FOREVER = (1 << 63) - 1
_LENGTH = re.compile(r"(\d{1,12}(?:\.\d{1,9})?)\s?(ns|us|ms|s|m|h|Hz)", re.ASCII)


def length(value: Any) -> Fraction:
    """Return the nanoseconds that `50ms`, `30Hz`, a timedelta or an int of nanoseconds means."""
    if isinstance(value, timedelta):
        nanoseconds = Fraction(value // timedelta(microseconds=1) * 1000)
    elif isinstance(value, np.timedelta64):
        nanoseconds = Fraction(int(value.astype("m8[ns]").astype(np.int64)))
    elif isinstance(value, int) and not isinstance(value, bool):
        nanoseconds = Fraction(value)
    else:
        match = _LENGTH.fullmatch(value.strip()) if isinstance(value, str) else None
        if match is None or not Fraction(match[1]):
            raise RecordingError(f"{value!r} is not a length of time", "write `50ms` or `30Hz`")
        number, unit = Fraction(match[1]), match[2]
        nanoseconds = SECOND / number if unit == "Hz" else number * UNITS[unit] * SECOND
    if not 1 <= nanoseconds <= FOREVER or nanoseconds.denominator > SECOND:
        raise RecordingError(
            f"{value!r} is not a length of time that can be counted in nanoseconds"
        )
    return nanoseconds


def grid(first: int, last: int, period: Fraction, messages: int) -> Any:
    """Return the times of ticks from the first message until the last one.

    Raises RecordingError if a wrong time among the messages would make far too many.
    """
    count = int((last - first) / period) + 1
    if count > max(TICKS, TICKS_PER_MESSAGE * messages):
        span = f"{(last - first) // SECOND:,} s"
        what = f"{count:,} rows for {messages:,} messages, whose times span {span}"
        hint = "choose another clock (`log` or `header`), or give `start` and `end`"
        raise RecordingError(f"the table would have {what}", hint)
    whole, rest = divmod(period.numerator, period.denominator)
    steps = np.arange(count, dtype=np.int64)
    return first + steps * whole + steps * rest // period.denominator


class Match(NamedTuple):
    """The messages of ticks, as indexes of the times; -1 stands for none.

    Values between two messages have a `second` one, and its `weight`. An `age` is negative if the
    message is later than the tick.
    """

    first: Any
    age: Any
    second: Any = None
    weight: Any = None

    def at(self, places: Any) -> Match:
        """Return the match with the place of each message instead of its index."""
        places = np.append(places, -1)
        second = None if self.second is None else places[self.second]
        return self._replace(first=places[self.first], second=second)

    def part(self, rows: slice) -> Match:
        """Return the match of some ticks."""
        return Match(*(None if values is None else values[rows] for values in self))


def since(later: Any, earlier: Any) -> Any:
    """Return differences of times, the largest one where they are not int64."""
    difference = later.view(np.uint64) - earlier.view(np.uint64)
    return np.minimum(difference, np.uint64(FOREVER)).astype(np.int64)


def match(ticks: Any, times: Any, how: str, tolerance: int | None) -> Match:
    """Return the messages that belong to ticks; the times of messages are sorted.

    The last of several messages of one time counts. Only `last` takes no message after the tick.
    """
    count = len(times)
    if not count:
        none = np.full(len(ticks), -1)
        between = (none, np.zeros(len(ticks))) if how == "linear" else ()
        return Match(none, np.zeros(len(ticks), np.int64), *between)
    before = np.searchsorted(times, ticks, "right") - 1
    age = since(ticks, times[np.maximum(before, 0)])
    gap = before < 0
    first, second, weight = before, None, None
    if how != "last":
        after = np.searchsorted(times, ticks, "left")
        until = since(times[np.minimum(after, count - 1)], ticks)
        until[after == count] = FOREVER
    if how == "nearest":
        age[gap] = FOREVER
        later = until < age
        first, age = np.where(later, after, before), np.where(later, -until, age)
        gap = np.zeros(len(ticks), bool)
    elif how == "linear":
        gap |= after == count
        second = np.where(age == 0, before, after)
        weight = age / np.maximum(age.astype(float) + until, 1)
        if tolerance is not None:
            gap |= until > tolerance
    if tolerance is not None:
        gap |= np.abs(age) > tolerance
    first[gap] = -1
    if second is not None:
        second[gap] = -1
    return Match(first, age, second, weight)


#: Between quaternions that are so close, a line is more exact than an arc.
CLOSE = 0.9995


def interpolated(first: Any, second: Any, weight: Any) -> Any:
    """Return an Arrow array between two of numbers, or of arrays of as many numbers."""
    import pyarrow as pa

    if not pa.types.is_floating(first.type):
        size = first.type.list_size
        values = interpolated(first.flatten(), second.flatten(), np.repeat(weight, size))
        return pa.FixedSizeListArray.from_arrays(values, size)
    starts, ends = (array.to_numpy(zero_copy_only=False) for array in (first, second))
    gaps, later_gaps = (array.is_null().to_numpy(zero_copy_only=False) for array in (first, second))
    with np.errstate(invalid="ignore"):  # inf - inf is NaN, as elsewhere
        between = np.where(weight == 0, starts, starts * (1 - weight) + ends * weight)
    is_gap = gaps | (later_gaps & (weight != 0))
    return pa.array(between.astype(starts.dtype), first.type, mask=is_gap)


def turned(first: Any, second: Any, weight: Any) -> Any:
    """Return quaternions, a row each, on the shorter arc between two; NaN if one has no length.

    Those at a message are as they were recorded, the others have the length 1.
    """
    weight = weight[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        start, end = (
            each / np.linalg.norm(each, axis=1, keepdims=True) for each in (first, second)
        )
        cosine = (start * end).sum(axis=1, keepdims=True)
        end = np.where(cosine < 0, -end, end)
        angle = np.arccos(np.minimum(np.abs(cosine), 1))
        sine = np.sin(angle)
        arc = (np.sin((1 - weight) * angle) * start + np.sin(weight * angle) * end) / sine
        chord = start * (1 - weight) + end * weight
        chord = chord / np.linalg.norm(chord, axis=1, keepdims=True)
    return np.where(weight == 0, first, np.where(np.abs(cosine) > CLOSE, chord, arc))
