"""What the interpreter charges for single operations: python -m benchmarks.floors.

A codec in Python is a sequence of these, so their sum is what it cannot be faster than.
"""

import struct
from array import array
from functools import partial

import numpy as np

from benchmarks.measure import Candidate, Repeated, Result, Row, measure


class Slots:
    __slots__ = ("value",)

    def method(self, *, byteorder="little"):
        pass


HEADER = b"\0\1\0\0"
TEXT = "base_link"
DATA = HEADER + struct.pack("<I10s", 10, TEXT.encode()) + bytes(200)
IMAGE = memoryview(bytes(range(256)) * 3600)
NAMES = {
    "made": Slots(),
    "new": partial(object.__new__, Slots),
    "pack": struct.Struct("<4sI").pack,
    "pack_many": struct.Struct("<4siII10sxx7d").pack,
    "unpack": struct.Struct("<I").unpack_from,
    "unpack_many": struct.Struct("<7d").unpack_from,
    "text": bytes.decode,
    "join": b"".join,
    "empty": array("d"),
    "frombuffer": np.frombuffer,
    "float64": np.dtype("<f8"),
} | {"HEADER": HEADER, "TEXT": TEXT, "DATA": DATA, "IMAGE": IMAGE}
OPERATIONS = {
    "nothing": "pass",
    "call a method with a keyword": "made.method()",
    "make an object": "new()",
    "set a slot": "made.value = 1",
    "encode 9 characters": "TEXT.encode()",
    "pack 2 values": "pack(HEADER, 10)",
    "pack 12 values": "pack_many(HEADER, 1, 2, 10, b'', 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)",
    "join 1 part": "join([DATA])",
    "join 5 parts": "join([HEADER, HEADER, HEADER, HEADER, HEADER])",
    "unpack 1 value": "(size,) = unpack(DATA, 4)",
    "unpack 7 values": "unpack_many(DATA, 16)",
    "slice and decode 9 bytes": "text(DATA[8:17])",
    "copy 160 bytes into an array": "made.value = empty[:]; made.value.frombytes(DATA[16:176])",
    "see 160 bytes as a numpy array": "frombuffer(DATA, float64, 20, 16)",
    "memcpy of 640x480x3 bytes": "bytes(IMAGE)",
}
#: How often an operation stands in the function that is timed.
TIMES = 100


def candidate(code: str) -> Candidate:
    """Return the candidate that does an operation many times, without a loop's own cost."""
    lines = [f"    {code}\n"] * TIMES
    namespace: dict[str, object] = dict(NAMES)
    parameters = ", ".join(f"{name}={name}" for name in NAMES)
    exec(f"def function({parameters}):\n" + "".join(lines), namespace)  # noqa: S102
    repeated = Repeated(namespace["function"])
    return lambda: repeated() / TIMES


def operations() -> Result:
    row = Row("floors", "", lambda: {name: candidate(code) for name, code in OPERATIONS.items()})
    return measure(row, None)


if __name__ == "__main__":
    for name, times in operations().times.items():
        print(f"{name:32} {times.median * 1e9:8.0f} ns")
