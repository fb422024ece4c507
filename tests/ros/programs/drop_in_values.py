"""Values of every kind that somebody may give to a field, made anew at each call.

`for_field(shape, good)` names them; `good` makes a right value of the field's element type. A name
begins with what the value is, so that the list of differences can speak of groups of them.
"""

import collections
import decimal
import enum
import fractions
import types
from array import array

import numpy as np

CODES = "bBhHiIqQfd"
DTYPES = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"]
DTYPES += ["float16", "float32", "float64", "bool"]


class Level(enum.IntEnum):
    LOW = 1
    HIGH = 2


class Name(str, enum.Enum):
    ONE = "one"


class Whole(int):
    pass


class Real(float):
    pass


class Text(str):
    pass


class Row(list):
    pass


class Block(array):
    pass


def numbers():
    """Return single numbers, and what is not one."""
    edges = [1 << bits for bits in (7, 8, 15, 16, 31, 32, 63, 64, 70)]
    found = {f"int {n}": n for n in (0, 1, -1, 5, 127)}
    found |= {f"int {n}": n for edge in edges for n in (edge - 1, edge, -edge, -edge - 1)}
    found |= {f"float {n}": float(n) for n in ("0", "-0.0", "1.5", "nan", "inf", "-inf", "1e300")}
    found |= {f"numpy {name}": np.dtype(name).type(1) for name in DTYPES}
    found |= {
        "bool True": True,
        "bool False": False,
        "enum": Level.HIGH,
        "int subclass": Whole(3),
        "float subclass": Real(2.5),
        "other fraction": fractions.Fraction(1, 2),
        "other decimal": decimal.Decimal("1.5"),
        "other complex": 1j,
        "numpy 0-d": np.array(1),
        "numpy one element": np.array([1]),
    }
    return found


def texts():
    """Return single texts."""
    return {
        "text empty": "",
        "text plain": "plain",
        "text unicode": "é漢🤖\u200b",
        "text NUL": "a\0b",
        "text surrogate": "\ud800",
        "text long": "x" * 300,
        "text subclass": Text("sub"),
        "text enum": Name.ONE,
        "text numpy": np.str_("numpy"),
        "text user": collections.UserString("user"),
    }


def raw():
    """Return bytes and other buffers that say nothing of numbers."""
    return {
        "bytes empty": b"",
        "bytes 1": b"\x01",
        "bytes 3": b"\x01\x02\xff",
        "bytes 16": bytes(range(16)),
        "bytes 24": bytes(range(24)),
        "bytearray 3": bytearray(b"\x01\x02\xff"),
        "bytearray 24": bytearray(range(24)),
        "memoryview of bytes": memoryview(bytes(range(24))),
    }


def oddities():
    """Return what hardly any field takes."""
    return {"None": None, "dict empty": {}, "dict": {"data": 1}, "object": object(), "class": int}


def lists(elements):
    """Return the same elements in everything that holds elements."""
    found = {
        "list": list(elements),
        "tuple": tuple(elements),
        "list subclass": Row(elements),
        "other deque": collections.deque(elements),
        "list user": collections.UserList(elements),
        "other iterator": iter(elements),
        "other generator": (one for one in elements),
        "other dict values": dict(enumerate(elements)).values(),
    }
    try:
        found["set"] = set(elements)
        found["set frozen"] = frozenset(elements)
    except TypeError:  # messages cannot be hashed
        pass
    return found


def arrays(count):
    """Return numbers in arrays of all types and forms."""
    small = list(range(count))
    found = {"range": range(count), "list of numbers": small}
    found |= {f"array {code}": array(code, small) for code in CODES}
    found["array subclass"] = Block("d", small)
    found |= {f"memoryview {code}": memoryview(array(code, small)) for code in CODES}
    found |= {
        f"memoryview {code} strided": memoryview(array(code, small * 2))[::2] for code in CODES
    }
    found |= {f"numpy {name}": np.array(small).astype(name) for name in DTYPES}
    for name in DTYPES:
        # no two values share memory
        some, double = (np.array(each).astype(name) for each in (small, small * 2))
        found[f"numpy {name} strided"] = double[::2]
        found[f"numpy {name} reversed"] = some.copy()[::-1]
        found[f"numpy {name} swapped"] = some.astype(some.dtype.newbyteorder(">"))
        found[f"numpy {name} read-only"] = np.frombuffer(some.tobytes(), some.dtype)
        found[f"numpy 2-D {name} column"] = some.copy().reshape(-1, 1)
        found[f"numpy 2-D {name} row"] = some.copy().reshape(1, -1)
        found[f"numpy 2-D {name} two rows"] = double.copy().reshape(2, -1)
    found |= {
        "numpy object": np.array(small, object),
        "numpy text": np.array([str(one) for one in small]),
        "numpy masked": np.ma.array(small),
        "numpy 0-d": np.array(1.0),
        "list of floats": [one + 0.5 for one in small],
        "list of bools": [one % 2 == 1 for one in small],
        "list of enums": [Level.LOW for _ in small],
        "list of numpy numbers": list(np.array(small, "float32")),
        "list of numpy integers": list(np.array(small, "int64")),
        "list with nan": [float("nan")] * count,
        "list with None": [None] * count,
        "list with text": ["1"] * count,
        "list with large": [2**70] * count,
        "list with 300": [300] * count,
        "list with negative": [-1] * count,
        "list with 1e300": [1e300] * count,
        "list with list": [[1.0]] * count,
    }
    return found


def for_field(shape, good):
    """Return the values for a field, by name; `good()` makes an element."""
    container, size, _ = shape
    if container == "one":
        return (
            numbers()
            | texts()
            | raw()
            | oddities()
            | {
                "good": good(),
                "list empty": [],
                "list of text": ["a"],
                "namespace": types.SimpleNamespace(x=1.0),
            }
        )
    count = 3 if size is None or container == "sequence" else size
    many = {"int 1": 1, "float 1.5": 1.5, "text empty": "", "text plain": "plain"}
    many |= raw() | oddities() | lists([good() for _ in range(count)])
    many |= {f"sized {n}": [good() for _ in range(n)] for n in (0, 1, count - 1, count + 1, 40)}
    many |= {"numpy of objects": object_array([good() for _ in range(count)])}
    many |= {"list wrong element": [object() for _ in range(count)]}
    return many | arrays(count)


def object_array(elements):
    found = np.empty(len(elements), object)
    found[:] = elements
    return found
