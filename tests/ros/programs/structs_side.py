"""The introspection type support on messages: structs_side.py FILE OFFICIAL NAME...

FILE holds the shapes; OFFICIAL says "official" where rosidl's libraries know the types, too.
Prints one line per disagreement and, last, how many messages were looked at.
"""

import ctypes
import gc
import importlib
import json
import os
import sys
import zlib
from ctypes import PYFUNCTYPE, c_bool, c_void_p, py_object
from itertools import product
from pathlib import Path

from middleware import Official, Walker, interface_of, members_of, official_handle, table
from trees import Values, methods

COUNT = 5


class Memory:
    """The functions of message memory, as rclpy calls them."""

    def __init__(self, support):
        create, destroy, store, fetch, self.handle = support
        self.create = PYFUNCTYPE(c_void_p)(create)
        self.destroy = PYFUNCTYPE(None, c_void_p)(destroy)
        self.store = PYFUNCTYPE(c_bool, py_object, c_void_p)(store)
        self.fetch = PYFUNCTYPE(py_object, c_void_p)(fetch)


def rosidls(name):
    """Return the functions that rosidl generated to make and free a message."""
    package, kind, short = name.split("/")
    library = ctypes.CDLL(f"lib{package}__rosidl_generator_c.so")
    prefix = f"{package}__{kind}__{short}"
    create, destroy = (getattr(library, f"{prefix}__{end}") for end in ("create", "destroy"))
    create.restype = c_void_p
    destroy.argtypes = (c_void_p,)
    return create, destroy


def support_of(name):
    cls = interface_of(name)
    package = cls.__module__.split(".")[0]
    structs, typeinfo = (
        importlib.import_module(f"{package}._idlc.{module}") for module in ("structs", "typeinfo")
    )
    return structs.message(cls, typeinfo.structure_of(cls))


def look_at(name, values, official):
    cls = interface_of(name)
    memory = Memory(support_of(name))
    parties = [Walker(memory.handle)]
    makers, takers = [memory.create], [memory.destroy]
    if official:
        theirs = official_handle(name)
        if table(members_of(memory.handle)) != table(members_of(theirs)):
            print(f"{name}: other introspection members than rosidl's")
        parties += [Walker(theirs), Official(name)]
        create, destroy = rosidls(name)
        makers.append(create)
        takers.append(destroy)
    for tree in [values.plain(name, cls()), *(values.invent(name) for _ in range(COUNT))]:
        message = values.build(name, tree)
        for party, create, destroy in product(parties, makers, takers):
            check(name, party, memory, create, destroy, message)


def check(name, party, memory, create, destroy, message):
    """Let a middleware read what Python wrote, and Python what a middleware wrote."""
    who = type(party).__name__
    data = methods(message).serialize()
    place = create()
    for _ in range(2):  # twice, as for memory that is used again
        assert memory.store(message, place)
        found = party.read(place, len(data) + 64)
        if found != data[4:]:
            print(f"{name}: {who} reads {found.hex()}, not {data[4:].hex()}"[:500])
    destroy(place)
    place = create()
    party.write(data[4:], place)
    again = methods(memory.fetch(place)).serialize()
    if again != data:
        print(f"{name}: {who} wrote what is read as {again.hex()}, not {data.hex()}"[:500])
    destroy(place)


def resident():
    gc.collect()
    return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * 4096 / 1e6


def look_at_memory(name, values):
    """Fill, read and drop much memory; only the first rounds may make the process grow."""
    memory = Memory(support_of(name))
    walker = Walker(memory.handle)
    message = values.build(name, values.invent(name))
    data = methods(message).serialize()[4:]
    sizes = []
    for _ in range(4):
        for _ in range(300):
            place = memory.create()
            assert memory.store(message, place)
            memory.destroy(place)
            place = memory.create()
            walker.write(data, place)
            methods(memory.fetch(place)).serialize()
            memory.destroy(place)
        sizes.append(resident())
    if sizes[-1] - sizes[0] > 2:
        print(f"{name}: memory grew: {sizes}")


def main(file, official, *names):
    shapes = json.loads(Path(file).read_text(encoding="utf-8"))
    for name in names:
        values = Values(shapes, seed=zlib.crc32(name.encode()))
        look_at(name, values, official == "official")
    look_at_memory(names[0], values)
    print("looked at", len(names))


if __name__ == "__main__":
    if "TABLES" in os.environ:  # of another version of ROS 2, instead of the installed ones
        ctypes.CDLL(os.environ["TABLES"])
    # loads the middleware, and with it Fast CDR
    importlib.import_module("rclpy.utilities").get_rmw_implementation_identifier()
    main(*sys.argv[1:])
