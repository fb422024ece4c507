"""Plain CDR written the obvious way, one value after the other: the oracle for the codecs.

A shape is a list of (name, type); a type is a primitive's name, "string", "wstring", a shape, or
(type, size or None) for an array or sequence. Values are plain: dictionaries, lists, numbers.
"""

import struct

CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "float32": "f",
    "float64": "d",
    "int8": "b",
    "int16": "h",
    "int32": "i",
    "int64": "q",
    "uint8": "B",
    "uint16": "H",
    "uint32": "I",
    "uint64": "Q",
}


class Writer:
    def __init__(self, order):
        self.order = order
        self.body = bytearray()

    def number(self, code, value):
        size = struct.calcsize("<" + code)
        self.body += bytes(-len(self.body) % size) + struct.pack(self.order + code, value)

    def write(self, type_, value):
        if isinstance(type_, list):
            for name, inner in type_:
                self.write(inner, value[name])
            if not type_:
                self.number("B", 0)
        elif isinstance(type_, tuple):
            element, size = type_
            if size is None:
                self.number("I", len(value))
            for one in value:
                self.write(element, one)
        elif type_ == "string":
            raw = value.encode() + b"\0"
            self.number("I", len(raw))
            self.body += raw
        elif type_ == "wstring":
            raw = value.encode("utf-16-le")
            units = struct.unpack(f"<{len(raw) // 2}H", raw)
            self.number("I", len(units))
            for unit in units:
                self.number("I", unit)
        else:
            self.number(CODES[type_], value)


def encode(shape, value, order):
    writer = Writer({"little": "<", "big": ">"}[order])
    writer.write(shape, value)
    return {"little": b"\0\1\0\0", "big": b"\0\0\0\0"}[order] + bytes(writer.body)
