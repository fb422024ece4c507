"""Looks at a library of type support: native_load.py LIBRARY IDENTIFIER

Standard input holds {symbol: names of fields}. What the loader made of each part of the library is
compared with what the part is for.
"""

import ctypes
import json
import sys
from ctypes import POINTER, c_char_p, c_void_p, cast
from pathlib import Path

FIELDS = {"rosidl_typesupport_cpp": b"rosidl_typesupport_introspection_c"}
POINTERS = POINTER(c_void_p)
FIND = ctypes.CFUNCTYPE(POINTERS, POINTERS, c_char_p)
MEMBER = 112


def mapped(path):
    """Return where the library lies in memory: what may be done there, by ranges of addresses."""
    found = {}
    for line in Path("/proc/self/maps").read_text("utf-8").splitlines():
        addresses, allowed, *_ = line.split()
        if line.endswith(path) and allowed != "---p":
            found[range(*(int(one, 16) for one in addresses.split("-")))] = allowed
    return found


def main(path, identifier):
    library = ctypes.CDLL(path)
    ranges = mapped(path)
    assert set(ranges.values()) == {"r--p", "r-xp", "rw-p"}, ranges

    def may(pointer):
        address = cast(pointer, c_void_p).value
        return next(allowed for known, allowed in ranges.items() if address in known)

    for symbol, names in json.load(sys.stdin).items():
        get = library[symbol]
        get.restype = POINTERS
        handle = get()
        assert cast(handle[0], c_char_p).value.decode() == identifier, symbol
        fields = FIELDS.get(identifier, identifier.encode())
        handle = FIND(handle[2])(handle, fields)
        members = cast(handle[1], POINTERS)
        parts = (get, handle[2], handle, members, members[0])
        assert list(map(may, parts)) == ["r-xp", "r-xp", "rw-p", "r--p", "r--p"], symbol
        assert members[2] & 0xFFFFFFFF == len(names)
        for index, name in enumerate(names):
            assert c_char_p.from_address(members[5] + MEMBER * index).value.decode() == name, symbol


if __name__ == "__main__":
    main(*sys.argv[1:])
