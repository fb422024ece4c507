"""Times in recordings, as people and programs write them."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from fractions import Fraction
from math import ceil
from typing import Any

from idlc.recordings.containers.source import RecordingError

SECOND = 10**9
#: Times of numpy and Arrow end here, in the year 2262.
END_OF_TIME = 1 << 63
#: A plain number below this counts seconds from the start of the recording, one above is a time of
#: ROS, in seconds; from the second on, in nanoseconds.
LEAST_TIME = 10**9
LEAST_NANOSECONDS = 10**17
#: No recording needs more.
MOST_DIGITS = 20
#: Seconds of each unit that is always as long, as numpy calls them.
UNITS = {
    "W": Fraction(604800),
    "D": Fraction(86400),
    "h": Fraction(3600),
    "m": Fraction(60),
    **{unit: Fraction(1, 1000**n) for n, unit in enumerate("s ms us ns ps fs as".split())},
}
NUMBER = rf"\d{{1,{MOST_DIGITS}}}(?:\.\d{{0,{MOST_DIGITS}}})?"
_NUMBER = re.compile(NUMBER, re.ASCII)
_LENGTH = re.compile(rf"(?:{NUMBER}[hms])+", re.ASCII)
_PART = re.compile(rf"({NUMBER})([hms])", re.ASCII)
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
_FRACTION = re.compile(r"(T\d\d:\d\d:\d\d|\s\d\d:\d\d:\d\d)\.(\d{1,9})")
HINT = "write `10`, `1m30s`, a ROS time such as `1700000000.5`, or a UTC date"


def moment(value: Any, start: Callable[[], int]) -> int:
    """Return the nanoseconds since 1970 that a value means; relative times are added to `start()`.

    An int is nanoseconds, a timedelta counts from the start, a datetime without a zone is in UTC.
    Those of numpy and pandas are taken to the last digit. Fractions of a nanosecond are rounded
    up: no message lies between.
    """
    if isinstance(value, str):
        return _text(value.strip(), start)
    for precise in ("to_datetime64", "to_timedelta64"):  # pandas' know more than Python's
        if hasattr(value, precise):
            value = getattr(value, precise)()
    if type(value).__module__ == "numpy":
        return _of_numpy(value, start)
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    if isinstance(value, timedelta):
        return start() + value // timedelta(microseconds=1) * 1000
    if isinstance(value, datetime):
        return _nanoseconds(value)
    raise _no_time(value)


def date_text(time: int) -> str:
    """Return a time of a recording, in nanoseconds since 1970, as a date in UTC."""
    seconds, nanoseconds = divmod(time, SECOND)
    try:
        date = _EPOCH + timedelta(seconds=seconds)
    except OverflowError:
        return f"{seconds}.{nanoseconds:09}"
    return f"{date:%Y-%m-%d %H:%M:%S}.{nanoseconds:09}"


def _no_time(value: Any) -> TypeError:
    return TypeError(f"a time is an int in nanoseconds, a text or a datetime, not {value!r}")


def _of_numpy(value: Any, start: Callable[[], int]) -> int:
    """Return the time that a number of numpy is; its own conversions wrap around."""
    from numpy import datetime_data

    kind = value.dtype.kind
    if value.ndim == 0 and kind in "iu":
        return int(value)
    if value.ndim or kind not in "mM" or value != value:  # NaT is not even itself
        raise _no_time(value)
    count, (unit, factor) = int(value.astype("i8")), datetime_data(value.dtype)
    if kind == "M" and unit in ("Y", "M"):
        months = count * factor * (12 if unit == "Y" else 1)
        year = min(max(1970 + months // 12, datetime.min.year), datetime.max.year)
        return _nanoseconds(datetime(year, months % 12 + 1, 1, tzinfo=timezone.utc))
    if unit not in UNITS:  # how long a year is depends on which
        raise _no_time(value)
    length = ceil(count * factor * UNITS[unit] * SECOND)
    return length if kind == "M" else start() + length


def _text(text: str, start: Callable[[], int]) -> int:
    if _NUMBER.fullmatch(text):
        number = Fraction(text)
        if number >= LEAST_NANOSECONDS:
            return ceil(number)
        nanoseconds = ceil(number * SECOND)
        return nanoseconds if number >= LEAST_TIME else start() + nanoseconds
    if _LENGTH.fullmatch(text):
        seconds = sum(Fraction(number) * UNITS[unit] for number, unit in _PART.findall(text))
        return start() + ceil(seconds * SECOND)
    # datetime has six digits, and before Python 3.11 three or six
    fraction = _FRACTION.search(text)
    digits = fraction[2].ljust(9, "0") if fraction else ""
    plain = text[: fraction.end(1)] + text[fraction.end() :] if fraction else text
    try:
        date = datetime.fromisoformat(re.sub(r"[zZ]$", "+00:00", plain))
        return _nanoseconds(date) + int(digits or 0)
    except (ValueError, OverflowError):
        raise RecordingError(f"`{text}` is not a time", HINT) from None


def _nanoseconds(date: datetime) -> int:
    """Return the nanoseconds since 1970; a date without a zone is in UTC."""
    date = date if date.tzinfo else date.replace(tzinfo=timezone.utc)
    return (date - _EPOCH) // timedelta(microseconds=1) * 1000
