"""Messages as they are recorded: bytes, and when they came."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from idlc.recordings.errors import RecordingError

#: What numpy and Arrow can say of times ends here, in the year 2262.
END_OF_TIME = 1 << 63


class Window(NamedTuple):
    """From when, and until when, messages are wanted: nanoseconds, the end not included."""

    start: int | None = None
    end: int | None = None

    def overlaps(self, first: int, last: int) -> bool:
        """Return whether messages of these times, the last included, may be in it."""
        before = self.end is not None and first >= self.end
        return not before and (self.start is None or last >= self.start)

    def narrowed(self, start: int | None, end: int | None) -> Window:
        """Return what this and another window have in common."""
        starts = [one for one in (self.start, start) if one is not None]
        ends = [one for one in (self.end, end) if one is not None]
        return Window(max(starts, default=None), min(ends, default=None))

    def holds(self, times: Any) -> Any:
        """Return which of these times are in it, or None if all are."""
        if self.start is None and self.end is None:
            return None
        # numpy compares numbers of 64 bits, and what is asked for may have more
        inside = np.ones(len(times), bool)
        if self.start is not None and self.start > 0:
            inside &= times >= min(self.start, END_OF_TIME - 1)
        if self.end is not None and self.end < END_OF_TIME:
            inside &= times < max(self.end, 0)
        return inside


#: The window that leaves nothing out.
ALWAYS = Window()


@dataclass(frozen=True)
class Messages:
    """Messages of one topic, in the order in which they were recorded, each a part of one buffer.

    Times are int64, in nanoseconds; `publish_times` is None where a recording has none.
    """

    buffer: Any
    starts: Any
    stops: Any
    log_times: Any
    publish_times: Any | None

    def __len__(self) -> int:
        return len(self.starts)

    def within(self, window: Window) -> Messages:
        """Return those of a window."""
        inside = window.holds(self.log_times)
        if inside is None or inside.all():
            return self
        return Messages(
            self.buffer,
            self.starts[inside],
            self.stops[inside],
            self.log_times[inside],
            None if self.publish_times is None else self.publish_times[inside],
        )

    def views(self) -> list[memoryview]:
        """Return each message as a part of the buffer."""
        view = memoryview(self.buffer)
        pairs = zip(self.starts.tolist(), self.stops.tolist(), strict=True)
        return [view[start:stop] for start, stop in pairs]


def times_of(values: Any, what: str) -> Any:
    """Return unsigned times as int64."""
    if len(values) and int(values.max()) >= END_OF_TIME:
        raise RecordingError(f"a message has a {what} after the year 2262")
    return values.astype(np.int64)


def joined(parts: Sequence[Messages]) -> Messages:
    """Return messages of several buffers as parts of one that holds nothing else."""
    if len(parts) == 1:
        return parts[0]
    if not parts:
        none = np.zeros(0, np.int64)
        return Messages(b"", none, none, none, none)
    starts = np.concatenate([part.starts for part in parts])
    stops = np.concatenate([part.stops for part in parts])
    buffer = parts[0].buffer
    if any(part.buffer is not buffer for part in parts):
        buffer = b"".join(view for part in parts for view in part.views())
        sizes = stops - starts
        stops = np.cumsum(sizes)
        starts = stops - sizes
    publish = [part.publish_times for part in parts if part.publish_times is not None]
    return Messages(
        buffer,
        starts,
        stops,
        np.concatenate([part.log_times for part in parts]),
        np.concatenate(publish) if len(publish) == len(parts) else None,
    )
