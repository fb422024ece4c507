"""The content of an MCAP file, as the mcap library reads it record after record."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, Header, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk


class Content(NamedTuple):
    """All records of a file; `chunks` has how each is compressed, its bytes and its records."""

    header: Header
    messages: list[Message]
    schemas: dict[int, Schema]
    channels: dict[int, Channel]
    others: list[Any]
    chunks: list[tuple[str, bytes, list[Any]]]

    def topic(self, message: Message) -> str:
        return self.channels[message.channel_id].topic

    def used(self) -> set[int]:
        """Return the schemas that channels refer to."""
        return {channel.schema_id for channel in self.channels.values()}


def content(path: Path) -> Content:
    """Read a file, whose checksums must be right."""
    with path.open("rb") as file:
        list(StreamReader(file, validate_crcs=True).records)
        file.seek(0)
        found: Content | None = None
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Header):
                found = Content(record, [], {}, {}, [], [])
            assert found is not None
            inside = breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else ()
            if isinstance(record, Chunk):
                found.chunks.append((record.compression, record.data, inside))
            for one in inside or [record]:
                match one:
                    case Message():
                        found.messages.append(one)
                    case Schema():
                        assert found.schemas.setdefault(one.id, one) == one
                    case Channel():
                        assert found.channels.setdefault(one.id, one) == one
                    case Attachment() | Metadata():
                        found.others.append(one)
    return found


def check_indexes(path: Path, expected: Content) -> None:
    """Fail unless the summary says what is in a file, and messages are found by its indexes."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        counts: dict[int, int] = {}
        for message in expected.messages:
            counts[message.channel_id] = counts.get(message.channel_id, 0) + 1
        times = [message.log_time for message in expected.messages]
        statistics = summary.statistics
        assert statistics.message_count == len(expected.messages)
        assert statistics.channel_message_counts == counts
        assert statistics.message_start_time == min(times, default=0)
        assert statistics.message_end_time == max(times, default=0)
        assert statistics.chunk_count == len(summary.chunk_indexes) == len(expected.chunks)
        assert statistics.schema_count == len(summary.schemas)
        assert statistics.channel_count == len(summary.channels)
        assert summary.schemas == expected.schemas
        assert summary.channels == expected.channels
        others = (len(summary.attachment_indexes), len(summary.metadata_indexes))
        assert others == (statistics.attachment_count, statistics.metadata_count)
        assert sum(others) == len(expected.others)
        found = [*reader.iter_attachments(), *reader.iter_metadata()]
        assert sorted(map(repr, found)) == sorted(map(repr, expected.others))
        if expected.chunks and len(expected.messages) == sum(
            isinstance(one, Message) for _, _, inside in expected.chunks for one in inside
        ):
            topics = {channel.topic for channel in expected.channels.values()}
            for topic in topics:
                some = [one for _, _, one in reader.iter_messages(topics=[topic])]
                mine = [one for one in expected.messages if expected.topic(one) == topic]
                assert some == sorted(mine, key=lambda one: one.log_time)
