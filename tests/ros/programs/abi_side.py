"""What type support finds out about C structures: abi_side.py HOW [LIBRARY]. Prints JSON."""

import ctypes
import importlib
import json
import sys

#: What a word is changed to: nothing, numbers, addresses that there are not.
OTHERS = (0, 1, 2, 7, 0x100, 0x1_0000_0000, 0xDEAD_BEEF_0000, 2**63 - 8, 2**64 - 1)


def measuring():
    return importlib.import_module("std_msgs._idlc.introspection")


def handles_of(library):
    prefix = "rosidl_typesupport_introspection_c__get_message_type_support_handle__"
    for name in ("ParameterValue", "ListParametersResult"):
        function = library[f"{prefix}rcl_interfaces__msg__{name}"]
        function.restype = ctypes.c_void_p
        yield function()


def measure(path):
    return measuring().measure(*handles_of(ctypes.CDLL(path)))


def installed():
    return measuring().abi()


def alter(path):
    """Change each word of the tables to other values; return how many and how many are refused."""
    library = ctypes.CDLL(path)
    handles = list(handles_of(library))
    abi = measuring()
    right = abi.measure(*handles)
    sizes = (ctypes.c_size_t * 6).in_dll(library, "sizes")
    tried = refused = 0
    parts = [
        f"{one}_{part}" for one in ("value", "list") for part in ("handle", "table", "members")
    ]
    for part, size in zip(parts, sizes, strict=True):
        word = (ctypes.c_uint64 * (size // 8)).in_dll(library, part)
        for index, before in enumerate(list(word)):
            for other in {*OTHERS, before + 1, before + 8, before ^ 0x100, handles[0]} - {before}:
                word[index] = other % 2**64
                tried += 1
                try:
                    found = abi.measure(*handles)
                except ImportError:
                    refused += 1
                else:
                    assert found == right, (part, index, hex(before), hex(other))
            word[index] = before
    assert abi.measure(*handles) == right
    return tried, refused


def fast_cdr(path):
    """Find the pointers of an older Fast CDR, which is the only one in this process."""
    ctypes.CDLL(path)
    return importlib.import_module("std_msgs._idlc.fastrtps").fast_cdr()


if __name__ == "__main__":
    print(json.dumps(globals()[sys.argv[1]](*sys.argv[2:])))
