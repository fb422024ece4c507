"""Messages as they are recorded: bytes and times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import msgspec
import numpy as np

from idlc.recordings.times import END_OF_TIME

#: Stands for a time from END_OF_TIME on; it is NaT, numpy's null.
NO_TIME = -END_OF_TIME

#: From this mean size on, messages are not copied to be one buffer.
LARGE = 1 << 15

Raw: TypeAlias = bytes | memoryview


class Window(NamedTuple):
    """A range of times in nanoseconds; the end is not included."""

    start: int | None = None
    end: int | None = None

    def overlaps(self, first: int, last: int) -> bool:
        """Return whether messages of these times, the last included, may be in it."""
        before = self.end is not None and first >= self.end
        return not before and (self.start is None or last >= self.start)

    def narrowed(self, start: int | None, end: int | None) -> Window:
        """Return the intersection of this and another window."""
        starts = [time for time in (self.start, start) if time is not None]
        ends = [time for time in (self.end, end) if time is not None]
        return Window(max(starts, default=None), min(ends, default=None))

    def holds(self, times: Any) -> Any:
        """Return a mask of the times that are in it, or None if all are."""
        if self.start is None and self.end is None:
            return None
        # numpy compares numbers of 64 bits, and limits may have more
        inside = times != NO_TIME
        if self.start is not None and self.start >= END_OF_TIME:
            inside[:] = False
        if self.start is not None and 0 < self.start < END_OF_TIME:
            inside &= times >= self.start
        if self.end is not None and self.end < END_OF_TIME:
            inside &= times < max(self.end, 0)
        return inside


#: The window that leaves nothing out.
ALWAYS = Window()


class TopicMessages(msgspec.Struct, frozen=True, eq=False):
    """Messages of one topic, in the order in which they were recorded, for `to_columns` to read.

    Times are int64, in nanoseconds, or NO_TIME; `publish_times` is None where a recording has none.
    """

    log_times: Any
    publish_times: Any | None

    def __len__(self) -> int:
        return len(self.log_times)

    def late(self) -> int:
        """Return how many times are not known because they are after the year 2262."""
        times = (self.log_times, self.publish_times)
        return sum(int(np.count_nonzero(each == NO_TIME)) for each in times if each is not None)

    def views(self) -> list[Raw]:
        """Return the bytes of each message."""
        raise NotImplementedError

    def selected(self, mask: Any) -> TopicMessages:
        """Return the messages for which a mask is true."""
        publish = None if self.publish_times is None else self.publish_times[mask]
        raws = [raw for raw, chosen in zip(self.views(), mask, strict=True) if chosen]
        return Separate(self.log_times[mask], publish, raws)

    def first_views(self, count: int) -> list[Raw]:
        """Return the bytes of the first messages."""
        return self.views()[:count]


class Ranges(TopicMessages, frozen=True, eq=False):
    """Messages that are each a part of one buffer."""

    buffer: Any
    starts: Any
    stops: Any

    def within(self, window: Window) -> Ranges:
        """Return the messages in a window."""
        inside = window.holds(self.log_times)
        if inside is None or inside.all():
            return self
        return self.selected(inside)

    def selected(self, mask: Any) -> Ranges:
        """Return the messages for which a mask is true."""
        publish = None if self.publish_times is None else self.publish_times[mask]
        starts, stops = self.starts[mask], self.stops[mask]
        return Ranges(self.log_times[mask], publish, self.buffer, starts, stops)

    def views(self) -> list[Raw]:
        """Return each message as a part of the buffer."""
        return self.first_views(len(self))

    def first_views(self, count: int) -> list[Raw]:
        """Return each of the first messages as a part of the buffer."""
        view = memoryview(self.buffer)
        pairs = zip(self.starts[:count].tolist(), self.stops[:count].tolist(), strict=True)
        return [view[start:stop] for start, stop in pairs]


class Separate(TopicMessages, frozen=True, eq=False):
    """Messages in buffers of their own: joining large ones would only copy them."""

    raws: list[Raw]

    def __iter__(self) -> Iterator[Raw]:
        return iter(self.raws)

    def views(self) -> list[Raw]:
        """Return the bytes of each message."""
        return self.raws


def times_of(values: Any) -> Any:
    """Return unsigned times as int64, NO_TIME for those after the year 2262."""
    times = values.astype(np.int64)
    if len(times) and times.min() < 0:
        times[times < 0] = NO_TIME
    return times


def in_order(parts: Sequence[TopicMessages]) -> TopicMessages:
    """Return the messages of all parts in the order of their log times."""
    joined = join_messages(parts)
    order = np.argsort(joined.log_times, kind="stable")
    publish = None if joined.publish_times is None else joined.publish_times[order]
    raws = joined.views()
    return Separate(joined.log_times[order], publish, [raws[at] for at in order.tolist()])


def join_messages(parts: Sequence[TopicMessages]) -> TopicMessages:
    """Return the messages of all parts, in memory once more only if they are small."""
    if len(parts) == 1:
        return parts[0]
    none: Any = np.zeros(0, np.int64)
    log = np.concatenate([none, *(part.log_times for part in parts)])
    publish_times = [part.publish_times for part in parts if part.publish_times is not None]
    publish = np.concatenate([none, *publish_times]) if len(publish_times) == len(parts) else None
    raws = [raw for part in parts for raw in part.views()]
    sizes: Any = np.fromiter(map(len, raws), np.int64, len(raws))
    if sizes.sum() >= LARGE * len(raws):
        return Separate(log, publish, raws)
    stops = np.cumsum(sizes)
    return Ranges(log, publish, b"".join(raws), stops - sizes, stops)
