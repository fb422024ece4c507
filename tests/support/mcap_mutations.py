"""MCAP files that are wrong in one place: mutations that know records, fields, chunks and indexes.

A file is taken apart into records, whose fields are known, and chunks into theirs. After a change
it is put together again, with what others say of places and sizes brought up to date or not.
"""

from __future__ import annotations

import random
import zlib
from collections.abc import Iterator
from struct import pack, unpack_from
from typing import NamedTuple

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, STATISTICS, FOOTER, OFFSET = (
    *(3, 4, 5, 6, 7, 8, 11, 2, 14),
)
#: What a record begins with: numbers of so many bytes, and bytes after a length of as many.
LAYOUTS = {
    1: "s s",
    FOOTER: "8 8 4",
    SCHEMA: "2 s s s",
    CHANNEL: "2 2 s s s",
    MESSAGE: "2 4 8 8",
    CHUNK: "8 8 8 4 s S",
    MESSAGE_INDEX: "2 s",
    CHUNK_INDEX: "8 8 8 8 s 8 s 8 8",
    STATISTICS: "8 2 4 4 4 4 8 8 s",
    OFFSET: "1 8 8",
    15: "4",
}
TEXTS = [
    *(b"", b"zstd", b"lz4", b"none", b"ZSTD", b"br", b"cdr", b"json", b"ros2msg", b"ros2idl"),
    *(b"/imu", b"/x", b"/../../x", b"/\n", b"\xff\xfe", b"sensor_msgs/Imu", b"a/b/c/d", b"x" * 300),
    *(b"std_msgs/msg/String", b"string data\n", b"\0" * 24, b"topic_type_hash", b"unknown"),
]
COMPRESS = {b"": bytes, b"zstd": zstandard.ZstdCompressor(1).compress, b"lz4": lz4.frame.compress}
EXPAND = {
    b"": bytes,
    b"zstd": zstandard.ZstdDecompressor().decompress,
    b"lz4": lz4.frame.decompress,
}


class Field(NamedTuple):
    """Where a number is, or a length; `text` is how many bytes come after it."""

    at: int
    width: int
    text: int | None


class Record:
    """A record, and where it stood."""

    def __init__(self, op: int, content: bytes, at: int) -> None:
        self.op = op
        self.content = bytearray(content)
        self.at = at
        self.size = len(content) + 9

    def fields(self) -> list[Field]:
        """Return the fields that are there as a whole."""
        found, at = [], 0
        for code in LAYOUTS.get(self.op, "").split():
            width = {"s": 4, "S": 8}.get(code) or int(code)
            text = None
            if code in "sS":
                text = int.from_bytes(self.content[at : at + width], "little")
            if at + width + (text or 0) > len(self.content):
                break
            found.append(Field(at, width, text))
            at += width + (text or 0)
        return found

    def packed(self) -> bytes:
        """Return the bytes of the record."""
        return pack("<BQ", self.op & 255, len(self.content)) + self.content


def records(data: bytes, at: int = 0) -> list[Record]:
    """Return the records of a sound file or chunk."""
    found = []
    while at + 9 <= len(data):
        op, size = unpack_from("<BQ", data, at)
        found.append(Record(op, data[at + 9 : at + 9 + size], at))
        at += 9 + size
    return found


def number(rng: random.Random, width: int, size: int) -> int:
    """Return a number where readers that trust numbers go wrong; `size` is that of the file."""
    most = 1 << 8 * width
    edges = [0, 1, 2, 8, 9, 255, 256, 1 << 29, (1 << 29) + 1, rng.randrange(size + 1)]
    edges += [size, size - 1, size - 8, size - 37]
    edges += [most - 1, most - 8, most - 9, most >> 1, (most >> 1) - 1]
    return rng.choice(edges) % most


def change(rng: random.Random, record: Record, size: int) -> None:
    """Change one field of a record."""
    fields = record.fields()
    if not fields or rng.random() < 0.05:
        at = rng.randrange(len(record.content) + 1)
        record.content[at : at + rng.randrange(3)] = rng.randbytes(rng.randrange(4))
        return
    field = rng.choice(fields)
    at, end = field.at, field.at + field.width
    was = int.from_bytes(record.content[at:end], "little")
    if field.text is None or rng.random() < 0.4:
        new = rng.choice([was + 1, was - 1, number(rng, field.width, size)])
        record.content[at:end] = (new % (1 << 8 * field.width)).to_bytes(field.width, "little")
        return
    text = bytearray(record.content[end : end + field.text])
    match rng.randrange(4):
        case 0:
            text = bytearray(rng.choice(TEXTS))
        case 1:
            place = rng.randrange(len(text) + 1)
            text[place : place + 8] = number(rng, 8, size).to_bytes(8, "little")
        case 2:
            del text[rng.randrange(len(text) + 1) :]
        case _:
            text *= 2
    record.content[at : end + field.text] = len(text).to_bytes(field.width, "little") + text


def rearrange(rng: random.Random, found: list[Record], size: int) -> None:
    """Change one record, or their order."""
    if not found:
        return
    at = rng.randrange(len(found))
    match rng.randrange(8):
        case 0:
            del found[at]
        case 1:
            found.insert(rng.randrange(len(found) + 1), found[at])
        case 2:
            other = rng.randrange(len(found))
            found[at], found[other] = found[other], found[at]
        case 3:
            found[at].op = rng.choice([*LAYOUTS, 0, 9, 10, 12, 13, 0x80, 255])
        case _:
            change(rng, found[at], size)


def compression(chunk: Record) -> bytes:
    """Return how a chunk is compressed."""
    return bytes(chunk.content[32 : 32 + (chunk.fields()[4].text or 0)])


def in_chunk(chunk: Record) -> list[Record]:
    """Return the records of a chunk."""
    return records(EXPAND[compression(chunk)](bytes(chunk.content[chunk.fields()[5].at + 8 :])))


def inside(rng: random.Random, chunk: Record, size: int) -> None:
    """Change what stands in a chunk, and what its head says of that."""
    found = in_chunk(chunk)
    rearrange(rng, found, size)
    data = b"".join(one.packed() for one in found)
    name = rng.choice([*COMPRESS]) if rng.random() < 0.2 else compression(chunk)
    crc = zlib.crc32(data) if rng.random() < 0.8 else 0
    stored = COMPRESS[name](data)
    head = bytes(chunk.content[:16]) + pack("<QII", len(data), crc, len(name)) + name
    chunk.content[:] = head + pack("<Q", len(stored)) + stored


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Return a file with few changes, each of which readers might trip over."""
    found = records(data[: -len(MAGIC)], len(MAGIC))
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        chunks = [one for one in found if one.op == CHUNK and len(one.fields()) == 6]
        if chunks and rng.random() < 0.4:
            try:
                inside(rng, rng.choice(chunks), len(data))
            except (KeyError, RuntimeError, zstandard.ZstdError):
                continue  # an earlier change went there
        else:
            rearrange(rng, found, len(data))
    made = joined(found, up_to_date=rng.random() < 0.8)
    if rng.random() < 0.1:
        made = made[: rng.randrange(len(made) + 1)]
    return made


def joined(found: list[Record], up_to_date: bool) -> bytes:
    """Return a file of records, whose places are told where those before were told."""
    places, at = {}, len(MAGIC)
    for one in found:
        places[one.at] = (at, len(one.content) + 9)
        at += len(one.content) + 9
    if up_to_date:
        for one in found:
            for field, size in _places(one):
                was = int.from_bytes(one.content[field : field + 8], "little")
                if was in places:
                    new, length = places[was]
                    one.content[field : field + 8] = pack("<Q", new)
                    if size:
                        one.content[size : size + 8] = pack("<Q", length)
    return MAGIC + b"".join(one.packed() for one in found) + MAGIC


def _places(one: Record) -> Iterator[tuple[int, int | None]]:
    """Yield where a record names places, and the sizes of what is there."""
    if one.op == FOOTER and len(one.content) == 20:
        yield from ((0, None), (8, None))
    if one.op == CHUNK_INDEX and len(one.fields()) >= 5:
        yield 16, 24
        offsets = one.fields()[4]
        yield from ((at + 2, None) for at in range(36, 36 + (offsets.text or 0) - 9, 10))
