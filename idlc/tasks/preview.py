"""Tables of Arrow → text for people: the first rows, and charts of numbers over time.

A preview takes the same memory for any number of messages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from idlc.diagnostics.text import display_width, one_line

if TYPE_CHECKING:
    import pyarrow as pa

FIRST_ROWS = 3
#: Time is divided into at most so many intervals.
INTERVALS = 256
#: The widths of names and of numbers, and the height of a chart that is alone.
NAME_WIDTH, NUMBER_WIDTH, HEIGHT = 32, 11, 8
HEADING = "numbers over time"
BLOCKS = " ▁▂▃▄▅▆▇█"
#: Up to here, two integers are different numbers.
EXACT = 1 << 53


class NumberStatistics:
    """The finite numbers of a column: extremes and mean, and sums for each interval of time."""

    def __init__(self) -> None:
        self.least, self.greatest, self.mean = np.inf, -np.inf, 0.0
        self.count = self.others = 0
        self.sums = np.zeros((2, INTERVALS))  # and the numbers of summands

    def add(self, values: Any, intervals: Any) -> None:
        """Add the numbers of messages, each with its interval."""
        finite = np.isfinite(values)
        values, intervals = values[finite], intervals[finite]
        size = len(values)
        self.others += len(finite) - size
        if not size:
            return
        self.least = min(self.least, float(values.min()))
        self.greatest = max(self.greatest, float(values.max()))
        total = self.count + size
        # each share is finite, where sums of huge numbers are not
        self.mean = self.mean * (self.count / total) + float((values / total).sum())
        self.count = total
        for sums, weights in zip(self.sums, (values, None), strict=True):
            sums += np.bincount(intervals, weights, INTERVALS)

    @property
    def is_constant(self) -> bool:
        """True if there are several numbers, and all are equal."""
        same = self.least == self.greatest and abs(self.least) < EXACT
        return same and self.count > 1 and not self.others

    def double(self) -> None:
        """Make one interval of each two."""
        pairs = self.sums.reshape(2, -1, 2).sum(2)
        self.sums = np.concatenate([pairs, np.zeros_like(pairs)], 1)

    def chart(self, intervals: int, width: int, height: int = 1) -> list[str]:
        """Return the means over time as lines of block characters, blank where there is none."""
        width = max(1, min(width, intervals, (self.count + 1) // 2))
        at = np.arange(INTERVALS) * width // intervals
        sums, counts = (np.bincount(at, row)[:width] for row in self.sums)
        means = np.clip(sums / counts, self.least, self.greatest)
        # the difference of huge numbers would be infinite
        span = self.greatest / 2 - self.least / 2
        shares = (means / 2 - self.least / 2) / span if span else means * 0 + 0.5
        eighths = np.where(counts > 0, np.round(np.nan_to_num(shares) * (8 * height - 1)) + 1, 0)
        return [
            "".join(BLOCKS[int(level)] for level in np.clip(eighths - 8 * row, 0, 8))
            for row in reversed(range(height))
        ]


def _texts(column: pa.Array, plain: Callable[[pa.Array], pa.Array]) -> list[str | None]:
    """Return a column as texts: bytes in hexadecimal digits, durations in seconds."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_large_binary(kind) or pa.types.is_fixed_size_binary(kind):
        return [None if data is None else f"0x{data.hex()}" for data in column.to_pylist()]
    texts: list[str | None] = plain(column).cast(pa.string()).to_pylist()
    if pa.types.is_duration(kind):
        return [None if text is None else f"{int(text) / 1e9:.12g} s" for text in texts]
    return texts


class Preview:
    """The first rows of a table, the number of rows and their times, and its columns of numbers.

    A `noun` says what a row is.
    """

    def __init__(self, title: str, names: list[str], noun: str) -> None:
        self.title = title
        self.noun = noun
        self.rows = 0
        self.firsts: dict[str, list[str]] = {name: [] for name in names}
        self.numbers: dict[str, NumberStatistics] = {}
        self.start = self.end = 0
        self.origin, self.interval = 0, 1  # of the intervals, in nanoseconds

    def add(self, batch: pa.RecordBatch, plain: Callable[[pa.Array], pa.Array]) -> None:
        """Add rows, which have their time in front; `plain` makes text of nested values."""
        import pyarrow as pa

        if not len(batch):
            return
        intervals = self._intervals(batch.column(0).to_numpy(zero_copy_only=False).view(np.int64))
        missing = max(0, FIRST_ROWS - self.rows)
        self.rows += len(batch)
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            kind = column.type
            mark = '"' if pa.types.is_large_string(kind) else ""
            first = _texts(column.slice(0, missing), plain)
            self.firsts[name] += ["" if text is None else f"{mark}{text}{mark}" for text in first]
            if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
                numbers = column.cast(pa.float64(), safe=False)
                values = numbers.to_numpy(zero_copy_only=False)
                with np.errstate(over="ignore", invalid="ignore"):
                    self.numbers.setdefault(name, NumberStatistics()).add(values, intervals)

    def _intervals(self, times: Any) -> Any:
        """Return the interval of each time, after there are intervals for all."""
        first, last = int(times.min()), int(times.max())
        if not self.rows:
            self.origin = self.start = first
            self.end = last
        self.start, self.end = min(self.start, first), max(self.end, last)
        # less one, since the origin moves by whole intervals
        while self.end - self.start >= self.interval * (INTERVALS - 1):
            self.interval *= 2
            for numbers in self.numbers.values():
                numbers.double()
        moved = max(0, -((self.start - self.origin) // self.interval))
        self.origin -= moved * self.interval
        for numbers in self.numbers.values() if moved else ():
            numbers.sums = np.roll(numbers.sums, moved, 1)
        # unsigned, since 64 bits with a sign do not hold every difference
        since = times.view(np.uint64) - np.uint64(self.origin % (1 << 64))
        return (since // np.uint64(self.interval)).astype(np.int64)

    def text(self, width: int) -> Iterator[str]:
        """Yield lines for a terminal of so many columns."""
        seconds = (self.end - self.start) / 1e9
        span = f"s in {seconds:.6g} s" if self.rows > 1 else "s" * (self.rows == 0)
        yield f"{one_line(self.title)}  {self.rows:,} {self.noun}{span}"
        names = min(NAME_WIDTH, max(1, width // 2), max(map(len, (HEADING, *self.firsts))))
        more = ", …" if self.rows > FIRST_ROWS else ""
        yield f"\n{_fitted('column', names)}  first rows"
        for name, texts in self.firsts.items():
            row = ", ".join(text[:width] for text in texts) + more
            yield f"{_fitted(name, names)}  {_fitted(row, max(1, width - names - 2))}".rstrip()
        constants = {name: each.least for name, each in self.numbers.items() if each.is_constant}
        if constants:
            pairs = (f"{one_line(name)}={value:.15g}" for name, value in constants.items())
            yield f"\nconstant: {', '.join(pairs)}"
        charted = {
            name: numbers
            for name, numbers in self.numbers.items()
            if numbers.count and not numbers.is_constant
        }
        if not charted:
            return
        intervals = (self.end - self.origin) // self.interval + 1
        heads = "".join(head.rjust(NUMBER_WIDTH) for head in ("min", "mean", "max"))
        yield f"\n{_fitted(HEADING, names)}{heads}"
        alone = len(charted) == 1
        with np.errstate(all="ignore"):
            for name, numbers in charted.items():
                values = (numbers.least, numbers.mean, numbers.greatest)
                cells = "".join(f" {value:{NUMBER_WIDTH - 1}.5g}" for value in values)
                line = f"{_fitted(name, names)}{cells}"
                note = f"  {numbers.others:,} not finite" if numbers.others else ""
                room = max(10, width - len(line) - len(note) - 2)
                chart = "" if alone else f"  {numbers.chart(intervals, room)[0]}"
                yield f"{line}{chart}{note}"
                if alone:
                    lines = numbers.chart(intervals, width, HEIGHT)
                    axis = f"0{f'{seconds:.6g} s':>{len(lines[0]) - 1}}"
                    yield "\n".join(["", *map(str.rstrip, lines), axis])


def _fitted(text: str, width: int) -> str:
    """Return text as long as some columns of a terminal, without control characters."""
    shown = one_line(text[: width + 1])
    while display_width(shown) > width:
        shown = f"{shown[:-2]}…"
    return shown + " " * (width - display_width(shown))
