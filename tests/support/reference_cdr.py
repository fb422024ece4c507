"""Plain CDR in the most obvious way: values are dicts, lists, numbers and texts.

Both directions also tell where each number, text and count stood: (path, place, value). A
place is the offset, the size, and which elements of sequences it is in. The dummy member of an
empty structure has no path.
"""

import struct

from idlc.model import ir

ERRORS = (ValueError, IndexError, struct.error)


def encode(message, value, messages):
    """Return the bytes of a value, garbage in the padding, and what stands where."""
    writer = _Writer(messages)
    writer.message(message, value, "")
    return bytes(writer.out), writer.leaves


def decode(message, data, messages):
    """Return the value that `data` holds and what stands where; raises one of ERRORS."""
    reader = _Reader(data, messages)
    return reader.message(message, ""), reader.leaves


class _Writer:
    def __init__(self, messages):
        self.out = bytearray()
        self.messages = messages
        self.leaves = []
        self.within = ()

    def put(self, path, size, raw, value):
        self.out += b"\xa5" * (-len(self.out) % size)
        self.leaves.append((path, (len(self.out), size, self.within), value))
        self.out += raw

    def message(self, message, value, path):
        if not message.fields:
            self.put(None, 1, b"\0", 0)
        for field in message.fields:
            self.value(field.type, value[field.name], f"{path}.{field.name}")

    def value(self, type_, value, path):
        match type_:
            case ir.Primitive():
                raw = struct.pack("<" + type_.info.code, value)
                self.put(path, type_.info.size, raw, value)
            case ir.String():
                raw = value.encode("utf-32-le" if type_.wide else "utf-8")
                count = len(raw) // 4 if type_.wide else len(raw) + 1
                whole = struct.pack("<I", count) + raw + b"\0" * (not type_.wide)
                self.put(path, 4, whole, value)
            case ir.Ref():
                self.message(self.messages[type_.target], value, path)
            case _:
                if isinstance(type_, ir.Sequence):
                    self.put(path, 4, struct.pack("<I", len(value)), ["count", len(value)])
                within = self.within
                for number, element in enumerate(value):
                    if isinstance(type_, ir.Sequence):
                        self.within = (*within, number)
                    self.value(type_.element, element, f"{path}[{number}]")
                self.within = within


class _Reader:
    def __init__(self, data, messages):
        self.data = data
        self.at = 0
        self.messages = messages
        self.leaves = []
        self.within = ()

    def take(self, path, code, size):
        self.at += -self.at % size
        (value,) = struct.unpack_from("<" + code, self.data, self.at)
        self.leaves.append((path, (self.at, size, self.within), value))
        self.at += size
        return value

    def message(self, message, path):
        if not message.fields:
            self.take(None, "B", 1)
        return {
            field.name: self.value(field.type, f"{path}.{field.name}") for field in message.fields
        }

    def value(self, type_, path):
        match type_:
            case ir.Primitive():
                return self.take(path, type_.info.code, type_.info.size)
            case ir.String():
                return self.text(path, type_.wide)
            case ir.Ref():
                return self.message(self.messages[type_.target], path)
            case ir.Array():
                size = type_.size
            case ir.Sequence():
                size = self.take(path, "I", 4)
                self.leaves[-1] = (*self.leaves[-1][:2], ["count", size])
                if size > len(self.data) or (type_.bound is not None and size > type_.bound):
                    raise ValueError("too many elements")
        within, values = self.within, []
        for number in range(size):
            if isinstance(type_, ir.Sequence):
                self.within = (*within, number)
            values.append(self.value(type_.element, f"{path}[{number}]"))
        self.within = within
        return values

    def text(self, path, wide):
        count = self.take(path, "I", 4)
        size = 4 * count if wide else count
        if self.at + size > len(self.data):
            raise ValueError("not enough bytes")
        raw = bytes(self.data[self.at : self.at + size])
        if not wide and raw[-1:] not in (b"", b"\0"):
            raise ValueError("no NUL")
        text = raw.decode("utf-32-le") if wide else raw[:-1].decode("utf-8")
        self.at += size
        self.leaves[-1] = (*self.leaves[-1][:2], text)
        return text
