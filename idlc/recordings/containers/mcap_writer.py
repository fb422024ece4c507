"""MCAP files, written record by record, with their indexes and summaries."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from functools import cached_property
from importlib.util import find_spec
from struct import pack
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from idlc.recordings.containers import records
from idlc.recordings.containers.compression import DecompressionBudget, compress
from idlc.recordings.containers.mcap_messages import LEAST, MESSAGE
from idlc.recordings.containers.messages import Raw
from idlc.recordings.containers.records import (
    CHANNEL_OP,
    FOOTER,
    HEAD,
    INDEX_OFFSET,
    MAGIC,
    MESSAGE_OP,
    SCHEMA_OP,
    Fields,
    read_records,
)
from idlc.recordings.containers.source import DamageError
from idlc.version import __version__


class Definition(NamedTuple):
    """A schema or a channel among records: its kind and number, and the content of its record."""

    op: int
    at: int
    number: int
    content: memoryview


class Content:
    """Records that are together in a file: where messages begin, and what their heads say."""

    def __init__(self, data: Raw, room: DecompressionBudget | None = None) -> None:
        self.data = memoryview(data)
        self.definitions: list[Definition] = []
        places = []
        every = zip(
            read_records(self.data),
            (room or DecompressionBudget(len(data))).records(),
            strict=False,
        )
        for (op, at, content), _ in every:
            if op == MESSAGE_OP:
                if len(content) < LEAST:
                    raise DamageError("a message is cut off")
                places.append(at)
            elif op in (SCHEMA_OP, CHANNEL_OP):
                number = Fields(content, "a definition").number(2)
                self.definitions.append(Definition(op, at, number, content))
        self.places: Any = np.array(places, np.int64)
        array: Any = np.frombuffer(self.data, np.uint8)
        every_head: Any = np.ndarray(
            (max(0, len(array) - MESSAGE.itemsize + 1),), MESSAGE, array, strides=(1,)
        )
        self.heads = every_head[self.places]

    @cached_property
    def by_channel(self) -> dict[int, Any]:
        """The indexes of the messages of each channel, in the order of the first ones."""
        channels = self.heads["channel"]
        order = np.argsort(channels, kind="stable")
        numbers, starts = np.unique(channels[order], return_index=True)
        groups = zip(numbers.tolist(), np.split(order, starts[1:]), strict=False)
        return dict(sorted(groups, key=lambda group: int(group[1][0])))


def text_field(data: Raw | bytearray) -> bytes:
    """Return a text or a part of a record, with its size in front."""
    return pack("<I", len(data)) + data


def record(op: int, content: Raw) -> bytes:
    """Return a whole record."""
    return HEAD.pack(op, len(content)) + content


def schema(number: int, name: str, encoding: str, text: str) -> bytes:
    """Return the content of a schema's record."""
    parts = (name, encoding, text)
    return pack("<H", number) + b"".join(text_field(part.encode()) for part in parts)


def channel(
    number: int, schema_number: int, topic: bytes, encoding: bytes, metadata: dict[bytes, bytes]
) -> bytes:
    """Return the content of a channel's record."""
    head = pack("<HH", number, schema_number)
    return head + text_field(topic) + text_field(encoding) + _pairs(metadata)


def _pairs(metadata: dict[bytes, bytes]) -> bytes:
    return text_field(b"".join(text_field(part) for pair in metadata.items() for part in pair))


class McapWriter:
    """Appends to an MCAP file; `write` takes its bytes. `close` adds the summary.

    `checksum` asks for one of the whole data section. The first record is to be the header.
    """

    def __init__(self, write: Callable[[Raw], object], checksum: bool = False) -> None:
        self._write = write
        self._crc: int | None = 0 if checksum else None
        self.at = 0
        #: By kind and number, what was first defined.
        self.definitions: dict[tuple[int, int], bytes] = {}
        #: By channel.
        self.counts: dict[int, int] = {}
        self.sizes: dict[int, int] = {}
        self._first, self._last = (1 << 64) - 1, 0
        self._summary: dict[int, list[bytes]] = {}
        self.write(MAGIC)

    def write(self, data: Raw) -> None:
        """Append bytes of records, of which no index is made."""
        self._write(data)
        self.at += len(data)
        if self._crc is not None:
            self._crc = zlib.crc32(data, self._crc)

    def add(self, content: Content) -> None:
        """Append records outside of any chunk."""
        self.write(content.data)
        self._count(content)

    def add_chunk(self, content: Content, compression: str, stored: Raw, crc: int) -> None:
        """Append records as a chunk, whose compressed bytes are `stored`, with its indexes."""
        self._count(content)
        at, name, times = self.at, text_field(compression.encode()), content.heads["log"]
        first, last = (int(times.min()), int(times.max())) if len(times) else (0, 0)
        size = len(content.data)
        head = pack("<QQQI", first, last, size, crc) + name + pack("<Q", len(stored))
        self.write(HEAD.pack(records.CHUNK_OP, len(head) + len(stored)) + head)
        self.write(stored)
        end, offsets = self.at, bytearray()
        for number, mine in content.by_channel.items():
            entries = np.empty((len(mine), 2), "<u8")
            entries[:, 0], entries[:, 1] = times[mine], content.places[mine]
            offsets += INDEX_OFFSET.pack(number, self.at)
            index = pack("<H", number) + text_field(entries.tobytes())
            self.write(record(records.MESSAGE_INDEX_OP, index))
        places = pack("<QQQQ", first, last, at, end - at) + text_field(offsets)
        sizes = pack("<Q", self.at - end) + name + pack("<QQ", len(stored), size)
        self._index(records.CHUNK_INDEX_OP, places + sizes)

    def index_other(self, op: int, head: memoryview, size: int) -> None:
        """Index the attachment or metadata of so many bytes that is next, by its beginning."""
        place = pack("<QQ", self.at, HEAD.size + size)
        if op == records.ATTACHMENT_OP:
            fields = Fields(head, "an attachment")
            times = bytes(fields.read(16))
            names = [bytes(fields.part().data) for _ in range(2)]
            length = bytes(fields.read(8))
            if int.from_bytes(length, "little") + fields.at + 4 > size:
                raise DamageError("an attachment is cut off")
            what = place + times + length + b"".join(map(text_field, names))
            self._index(records.ATTACHMENT_INDEX_OP, what)
        elif op == records.METADATA_OP:
            name = bytes(Fields(head, "metadata").part().data)
            self._index(records.METADATA_INDEX_OP, place + text_field(name))

    def close(self) -> None:
        """Append the summary."""
        end = record(records.DATA_END_OP, pack("<I", self._crc or 0))
        self.write(end)
        start, groups = self.at, dict[int, bytes]()
        for op in (SCHEMA_OP, CHANNEL_OP):
            mine = (content for (kind, _), content in self.definitions.items() if kind == op)
            groups[op] = b"".join(record(op, content) for content in mine)
        groups[records.STATISTICS_OP] = record(records.STATISTICS_OP, self._statistics())
        for op, contents in self._summary.items():
            groups[op] = b"".join(record(op, content) for content in contents)
        summary, offsets = b"", b""
        for op, group in groups.items():
            if group:
                place = pack("<BQQ", op, start + len(summary), len(group))
                offsets += record(records.SUMMARY_OFFSET_OP, place)
                summary += group
        size = FOOTER.size - HEAD.size
        footer = FOOTER.pack(records.FOOTER_OP, size, start, start + len(summary), 0)[:-4]
        crc = zlib.crc32(footer, zlib.crc32(offsets, zlib.crc32(summary)))
        self.write(summary + offsets + footer + pack("<I", crc) + MAGIC)

    def _index(self, op: int, content: bytes) -> None:
        self._summary.setdefault(op, []).append(content)

    def _count(self, content: Content) -> None:
        for op, _, number, data in content.definitions:
            self.definitions.setdefault((op, number), bytes(data))
        heads = content.heads
        if not len(heads):
            return
        self._first = min(self._first, int(heads["log"].min()))
        self._last = max(self._last, int(heads["log"].max()))
        for number, mine in content.by_channel.items():
            self.counts[number] = self.counts.get(number, 0) + len(mine)
            size = int(heads["size"][mine].sum()) - LEAST * len(mine)
            self.sizes[number] = self.sizes.get(number, 0) + size

    def _statistics(self) -> bytes:
        kinds = [kind for kind, _ in self.definitions]
        indexes = (
            records.ATTACHMENT_INDEX_OP,
            records.METADATA_INDEX_OP,
            records.CHUNK_INDEX_OP,
        )
        of_kind = [len(self._summary.get(op, ())) for op in indexes]
        total, first = sum(self.counts.values()), self._first if self.counts else 0
        # numbers have two bytes, and the first is none
        schemas = min(kinds.count(SCHEMA_OP), (1 << 16) - 1)
        head = pack("<QHI", total, schemas, kinds.count(CHANNEL_OP))
        counts = b"".join(map(INDEX_OFFSET.pack, self.counts, self.counts.values()))
        return head + pack("<IIIQQ", *of_kind, first, self._last) + text_field(counts)


#: Bytes of records in a chunk of a new file.
CHUNK = 1 << 20


class ChunkWriter(McapWriter):
    """Writes a new file of ROS 2, whose records are collected into chunks.

    The file is complete after `close`; before, it lacks the records since the last `flush`.
    """

    def __init__(self, file: BinaryIO) -> None:
        super().__init__(file.write)
        self._file = file
        self._records = bytearray()
        self._compression = "zstd" if find_spec("zstandard") else ""
        library = f"idlc {__version__}".encode()
        self.write(record(records.HEADER_OP, text_field(b"ros2") + text_field(library)))

    def append(self, op: int, content: Raw) -> None:
        """Append a definition or a message."""
        self._records += record(op, content)
        if len(self._records) >= CHUNK:
            self.flush()

    def add_metadata(self, name: str, values: dict[bytes, bytes]) -> None:
        """Append named facts."""
        self.flush()
        content = text_field(name.encode()) + _pairs(values)
        self.index_other(records.METADATA_OP, memoryview(content), len(content))
        self.write(record(records.METADATA_OP, content))

    def flush(self) -> None:
        """Write the records that were collected."""
        if self._records:
            data, self._records = bytes(self._records), bytearray()
            stored = compress(data, self._compression)
            self.add_chunk(Content(data), self._compression, stored, zlib.crc32(data))
            self._file.flush()

    def close(self) -> None:
        """Write what was collected, and the summary."""
        self.flush()
        super().close()
