"""Windows of time: every kind of value that means a moment, exact to the nanosecond."""

from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from fractions import Fraction
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pytest

import idlc
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.times import moment
from tests.support import recordings as made

START = 1_700_000_000_000_000_000
TIMES = [START + step * 100 for step in range(-5, 6)]
SECONDS = {"W": 604800, "D": 86400, "h": 3600, "m": 60, "s": 1}
SECONDS |= {unit: Fraction(1, 1000**n) for n, unit in enumerate(("ms", "us", "ns", "ps"), 1)}
EAST = timezone(timedelta(hours=5, minutes=30))


class OfPandas(NamedTuple):
    """A value of pandas and its text; it is made in a test, because pandas is slow to import."""

    text: str
    make: Callable[[Any], object]

    def __str__(self):
        return self.text


def real(value):
    """Return a value itself, made by pandas if it is one of its own."""
    if not isinstance(value, OfPandas):
        return value
    import pandas as pd

    made = value.make(pd)
    assert str(made) == value.text
    return made


def stamp(time, zone):
    """Return a moment of pandas in a time zone, or in none."""
    date = datetime.fromtimestamp(time // 10**9, zone or timezone.utc)
    fraction = f".{time % 10**9:09}" if time % 10**9 else ""
    text = f"{date:%Y-%m-%d %H:%M:%S}{fraction}{str(date)[19:] if zone else ''}"
    return OfPandas(text, lambda pd: pd.Timestamp(time, tz="UTC").tz_convert(zone))


def second(text, unit):
    """Return a moment of pandas that is kept in a unit."""
    return OfPandas(text, lambda pd: pd.Timestamp(text).as_unit(unit))


def absolute():
    """Yield values, and how many nanoseconds after 1970 they are."""
    for offset in (-500, -1, 0, 1, 250, 300):
        time = START + offset
        yield from ((time, time), (np.int64(time), time), (np.uint64(time), time))
        yield np.datetime64(time, "ns"), time
        yield np.array(time, "M8[ns]"), time
        yield np.datetime64(time // 25, "25ns"), time // 25 * 25
        for zone in (None, timezone.utc, EAST):
            yield stamp(time, zone), time
        yield f"{time // 10**9}.{time % 10**9:09}", time
        yield f"{time // 10**9}.{time % 10**9:09}4", time + 1
        yield f"2023-11-14T22:13:{20 + offset // 10**9}.{time % 10**9:09}Z", time
    for unit in ("s", "ms", "us"):
        yield np.datetime64("2023-11-14T22:13:20", unit), START
        yield second("2023-11-14 22:13:20", unit), START
    date = datetime(2023, 11, 14, 22, 13, 20, 7, timezone.utc)
    yield from ((one, START + 7000) for one in (date, date.replace(tzinfo=None)))
    yield date.astimezone(EAST), START + 7000
    for unit, seconds in SECONDS.items():
        for count in (0, 3, -3, (1 << 63) - 1, 1 - (1 << 63)):
            exact = Fraction(count) * seconds * 10**9
            yield np.datetime64(count, unit), -(-exact // 1)
    for text in ("1969", "1970", "2023", "2024-02", "2300-01-01", "1600-12", "9999"):
        date = np.datetime64(text).item()
        yield np.datetime64(text), (date.toordinal() - 719163) * 86400 * 10**9
    yield second("2900-01-01 00:00:00", "s"), 29348006400 * 10**9
    yield datetime.max, moment(datetime.max, int)


def relative():
    """Yield values, and how many nanoseconds after the start of a recording they are."""
    yield from ((timedelta(microseconds=n), n * 1000) for n in (-1, 0, 1))
    yield timedelta(days=10**6), 86400 * 10**15
    yield OfPandas("-1 days +23:59:59.999999999", lambda pd: pd.Timedelta(-1)), -1
    yield OfPandas("0 days 00:00:00", lambda pd: pd.Timedelta(0)), 0
    yield OfPandas("0 days 00:00:00.000000501", lambda pd: pd.Timedelta(501)), 501
    yield from ((f"0.{n:09}", n) for n in (0, 1, 999))
    yield "1h0m0.0000001s", 3600 * 10**9 + 100
    for unit, seconds in SECONDS.items():
        for count in (0, 2, -2, (1 << 63) - 1, 1 - (1 << 63)):
            yield np.timedelta64(count, unit), -(-Fraction(count) * seconds * 10**9 // 1)
    yield np.timedelta64(10**6, "D"), 86400 * 10**15


EVERY = [*absolute(), *((value, exact + TIMES[0]) for value, exact in relative())]


@pytest.fixture(scope="module")
def topic(tmp_path_factory):
    sound = made.messages(1)[0]
    found = [sound._replace(log_time=time, publish_time=time) for time in TIMES]
    path = made.by_mcap(tmp_path_factory.mktemp("times") / "a.mcap", found)
    with idlc.Recording(path) as recording:
        yield recording[sound.topic]


def within(topic, start, end=None):
    """Return the times in a range; none, if the recording says that it has none of these times."""
    try:
        selected = topic.between(start, end)
    except RecordingError as error:
        assert "range of times" in error.message  # noqa: PT017 - other errors are raised
        return []
    return [time for some in selected.batches() for time in some.log_times.tolist()]


@pytest.mark.parametrize(("value", "exact"), EVERY, ids=str)
def test_each_kind_of_time_is_exact(value, exact, topic):
    value = real(value)
    assert within(topic, value) == [time for time in TIMES if time >= exact]
    assert within(topic, None, value) == [time for time in TIMES if time < exact]


@pytest.mark.parametrize(
    "value",
    [
        *(True, np.True_, 5.0, np.float64(5), float("nan"), b"5", ..., [5], np.array([5])),
        OfPandas("NaT", lambda pd: pd.NaT),
        OfPandas("<NA>", lambda pd: pd.NA),
        *(np.datetime64("NaT"), np.timedelta64("NaT", "s"), np.datetime64("NaT")),
        *(np.timedelta64(1, "Y"), np.timedelta64(1, "M"), np.timedelta64(1), Fraction(5)),
        np.array(["2023"], "M8[s]"),
        OfPandas("0    1\ndtype: int64", lambda pd: pd.Series([1])),
        *(np.complex128(1), np.str_("x").encode()),
    ],
    ids=str,
)
def test_what_is_no_moment_is_refused(value, topic):
    value = real(value)
    for window in ((value, None), (None, value)):
        with pytest.raises(TypeError, match="a time is an int in nanoseconds"):
            topic.between(*window)


def test_the_last_moment_that_there_is(tmp_path):
    sound, last = made.messages(1)[0], (1 << 63) - 1
    path = made.by_mcap(tmp_path / "a.mcap", [sound._replace(log_time=last, publish_time=last)])
    with idlc.Recording(path) as recording:
        topic = recording[sound.topic]
        for start, end in product((None, last, last + 1, 1 << 70), (None, last, last + 1)):
            inside = (start is None or last >= start) and (end is None or last < end)
            assert within(topic, start, end) == [last] * inside
