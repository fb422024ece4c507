"""Moments of a recording, as people and programs name them → nanoseconds."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from decimal import Decimal
from typing import Any

from idlc.recordings.errors import RecordingError

SECOND = 10**9
#: A plain number below this counts seconds from the start of the recording, one above is a time of
#: ROS, in seconds; from the second on, in nanoseconds.
LEAST_TIME = 10**9
LEAST_NANOSECONDS = 10**17
#: No recording needs more.
MOST_DIGITS = 20

UNITS = {"h": 3600, "m": 60, "s": 1}
NUMBER = rf"\d{{1,{MOST_DIGITS}}}(?:\.\d{{0,{MOST_DIGITS}}})?"
_NUMBER = re.compile(NUMBER, re.ASCII)
_LENGTH = re.compile(rf"(?:{NUMBER}[hms])+", re.ASCII)
_PART = re.compile(rf"({NUMBER})([hms])", re.ASCII)
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
_FRACTION = re.compile(r"(T\d\d:\d\d:\d\d|\s\d\d:\d\d:\d\d)\.(\d{1,9})")

HINT = "write `10`, `1m30s`, a time of ROS such as `1700000000.5`, or a date in UTC"


def moment(value: Any, start: Callable[[], int]) -> int:
    """Return the nanoseconds since 1970 that a value means; `start` is asked for what is relative.

    An int is nanoseconds, a timedelta counts from the start, a datetime without a zone is in UTC.
    """
    if isinstance(value, str):
        return _text(value.strip(), start)
    if isinstance(value, bool):
        raise TypeError("a bool is no time")
    if isinstance(value, int):
        return value
    if isinstance(value, timedelta):
        return start() + _nanoseconds(value)
    if isinstance(value, datetime):
        return _nanoseconds(_in_utc(value) - _EPOCH)
    if type(value).__module__ == "numpy":
        return _of_numpy(value, start)
    raise TypeError(f"a time is an int in nanoseconds, a text or a datetime, not {value!r}")


def _of_numpy(value: Any, start: Callable[[], int]) -> int:
    match value.dtype.kind:
        case "i" | "u":
            return int(value)
        case "M":
            return int(value.astype("M8[ns]").astype("i8"))
        case "m":
            return start() + int(value.astype("m8[ns]").astype("i8"))
    raise TypeError(f"a time is an int in nanoseconds, a text or a datetime, not {value!r}")


def _text(text: str, start: Callable[[], int]) -> int:
    if _NUMBER.fullmatch(text):
        number = Decimal(text)
        if number >= LEAST_NANOSECONDS:
            return int(number)
        nanoseconds = int(number * SECOND)
        return nanoseconds if number >= LEAST_TIME else start() + nanoseconds
    if _LENGTH.fullmatch(text):
        seconds = sum(Decimal(number) * UNITS[unit] for number, unit in _PART.findall(text))
        return start() + int(seconds * SECOND)
    found = _FRACTION.search(text)  # datetime has six digits, and before Python 3.11 three or six
    digits = found[2].ljust(9, "0") if found else ""
    plain = text[: found.end(1)] + text[found.end() :] if found else text
    try:
        date = datetime.fromisoformat(re.sub(r"[zZ]$", "+00:00", plain))
        return _nanoseconds(_in_utc(date) - _EPOCH) + int(digits or 0)
    except (ValueError, OverflowError):
        raise RecordingError(f"`{text}` is no time", HINT) from None


def _in_utc(date: datetime) -> datetime:
    return date if date.tzinfo else date.replace(tzinfo=timezone.utc)


def _nanoseconds(length: timedelta) -> int:
    return (length // timedelta(microseconds=1)) * 1000
