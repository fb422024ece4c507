"""Messages of one topic as objects, as columns of numpy and as tables of Arrow."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, overload

from idlc.recordings.compression import missing
from idlc.recordings.container import Topic
from idlc.recordings.encapsulation import CDR, START, unread
from idlc.recordings.errors import RecordingError
from idlc.recordings.messages import Messages, Raw, joined

if TYPE_CHECKING:
    import pyarrow as pa

Kind = TypeVar("Kind")
#: How errors name a message of many, and what is in it.
_INDEXED = re.compile(r"\[(\d+)\]\.?(.*)")
#: What is known of a message besides its fields.
TIMES = ("log_time", "publish_time")


if TYPE_CHECKING:

    class Stamped(tuple[int, Kind]):
        """What type checkers see: named tuples can be generic from Python 3.11 on."""

        log_time: int
        message: Kind

        def __new__(cls, log_time: int, message: Kind) -> Stamped[Kind]: ...  # noqa: D102

else:

    class Stamped(NamedTuple):
        """A message, and when it was recorded, in nanoseconds."""

        log_time: int
        message: Any


class Selection:
    """Messages of one topic.

    They are of the type that was recorded, compiled when it is first needed, unless a class that
    idlc generated is given; that must be of the same type as the recorded one. `include` are
    folders in which types are looked for that the recording does not define.
    """

    def __init__(self, topic: Topic, include: tuple[str, ...] = ()) -> None:
        self.topic = topic
        self.include = include

    def batches(self) -> Iterator[Messages]:
        """Yield the messages as they are recorded, many at a time."""
        raise NotImplementedError

    @cached_property
    def kind(self) -> Any:
        """The class of the messages, compiled from what was recorded."""
        from idlc.driver.recordings.load import class_of

        return class_of(self.topic, self.include)

    def _kind(self, given: Any) -> Any:
        """Return the class to read with: what was recorded, or one of the same type."""
        if self.topic.encoding != CDR:
            what = f"messages of `{self.topic.name}` are written as `{self.topic.encoding}`"
            raise RecordingError(f"{what}, not as ROS 2 writes them, `{CDR}`")
        if given is None:
            return self.kind
        from idlc.driver.recordings.load import accepted

        return accepted(given, self.topic, self.include)

    def __iter__(self) -> Iterator[Stamped[Any]]:
        return self.messages()

    @overload
    def messages(self, kind: None = None) -> Iterator[Stamped[Any]]: ...

    @overload
    def messages(self, kind: type[Kind]) -> Iterator[Stamped[Kind]]: ...

    def messages(self, kind: Any = None) -> Iterator[Stamped[Any]]:
        """Yield each message with its time, in the order in which they were recorded."""
        kind, done = self._kind(kind), 0
        for batch in self.batches():
            for time, view in zip(batch.log_times.tolist(), batch.views(), strict=True):
                with _at(self.topic, lambda: [view], done):  # noqa: B023 # called at once
                    message = kind.deserialize(view)
                yield Stamped(time, message)
                done += 1

    def to_columns(
        self, kind: Any = None, *, fields: Iterable[str] | None = None, datetimes: bool = False
    ) -> Any:
        """Return columns of numpy: log_time, publish_time and those of the messages.

        `fields` are those that are wanted, such as "header.stamp". With `datetimes`, times are
        datetime64, log_time and publish_time included, which are nanoseconds otherwise.
        """
        kind = self._kind(kind)
        batch = joined(list(self.batches()))
        with _at(self.topic, batch.views):
            made = kind.to_columns(batch, fields=fields, ragged=True, datetimes=datetimes)
        times = zip(_names(made.keys()), (batch.log_times, batch.publish_times), strict=True)
        columns = {
            name: values.view("M8[ns]") if datetimes else values
            for name, values in times
            if values is not None
        }
        return type(made)({**columns, **{name: made[name] for name in made.keys()}}, len(made))  # noqa: SIM118

    def to_arrow(self, kind: Any = None, **options: Any) -> pa.Table:
        """Return a table of Arrow: log_time, publish_time and the fields of the messages.

        Options are those of `to_arrow` of messages: `fields`, `flat`, `datetimes`, `dictionary`.
        """
        pa = arrow()
        kind = self._kind(kind)
        found = list(self._tables(kind, options))
        return pa.concat_tables(found) if found else _empty(kind, options)

    def to_reader(self, kind: Any = None, **options: Any) -> pa.RecordBatchReader:
        """Return the same piece by piece, for what need not be in memory as a whole."""
        pa = arrow()
        kind = self._kind(kind)
        batches = (batch for one in self._tables(kind, options) for batch in one.to_batches())
        return pa.RecordBatchReader.from_batches(_empty(kind, options).schema, batches)

    def _tables(self, kind: Any, options: Any) -> Iterator[pa.Table]:
        done = 0
        for batch in self.batches():
            with _at(self.topic, batch.views, done):
                made = kind.to_arrow(batch, **options)
            yield _with_times(made, batch)
            done += len(batch)


def _names(taken: Iterable[str]) -> list[str]:
    """Return names for the times of messages that no field has: none begins with an underscore."""
    fields = set(taken)
    return [f"_{name}" if name in fields else name for name in TIMES]


def _empty(kind: Any, options: Any) -> pa.Table:
    """Return the table of no messages."""
    return _with_times(kind.to_arrow([], **options), joined([]))


def _with_times(table: pa.Table, batch: Messages) -> pa.Table:
    """Return a table with the times of its messages in front."""
    pa = arrow()
    kind = pa.timestamp("ns")
    names = _names(table.column_names)
    for name, times in zip(names[::-1], (batch.publish_times, batch.log_times), strict=True):
        if times is None:
            made = pa.nulls(len(batch), kind)
        else:
            made = pa.Array.from_buffers(kind, len(batch), [None, pa.py_buffer(times)])
        table = table.add_column(0, pa.field(name, kind), made)
    return table


def arrow() -> Any:
    """Return pyarrow, or say how to install it."""
    try:
        import pyarrow
    except ImportError:
        raise missing("pyarrow", "tables are made by Arrow") from None
    return pyarrow


@contextmanager
def _at(topic: Topic, views: Callable[[], list[Raw]], done: int = 0) -> Iterator[None]:
    """Have errors in messages say which message of the recording it is."""
    try:
        yield
    except ValueError as caught:
        error: Any = caught
        if not hasattr(error, "problem"):  # each package has a DecodeError of its own
            raise
        found = _INDEXED.match(error.path)
        number, path = (int(found[1]), found[2]) if found else (0, error.path)
        why = unread(topic.name, bytes(views()[number][:START]))
        if why:
            raise RecordingError(*why) from error
        where = f"{path}: " if path else ""
        raise RecordingError(
            f"message {done + number} of `{topic.name}` is broken: "
            f"{where}{error.problem} at byte {error.offset}"
        ) from error
