"""The introspection road on messages: structs_side.py FILE OFFICIAL NAME...

FILE holds the shapes; OFFICIAL says "official" where rosidl's libraries know the types, too.
Prints one line per disagreement and, last, how many messages were looked at.
"""

import gc
import importlib
import json
import sys
import zlib
from pathlib import Path

from middleware import Official, Walker, interface_of, members_of, official_members, table
from trees import Values, methods

COUNT = 5
#: Where a `bytes` object has its content: there the C structure lies.
SHIFT = bytes.__basicsize__ - 1


def look_at(name, values, official):
    cls = interface_of(name)
    package = cls.__module__.split(".")[0]
    structs = importlib.import_module(f"{package}._idlc.typesupport_structs")
    introspection = importlib.import_module(f"{package}._idlc.typesupport_introspection")
    support = structs.message(cls, name)
    if official and table(members_of(introspection.handle(name))) != table(official_members(name)):
        print(f"{name}: other introspection members than rosidl's")
    parties = [(Walker(support.handle), 0)]
    if official:
        parties.append((Official(name), SHIFT))
    for tree in [values.plain(name, cls()), *(values.invent(name) for _ in range(COUNT))]:
        message = values.build(name, tree)
        data = methods(message).serialize()
        for party, shift in parties:
            check(name, party, shift, support.memory, message, data)


def check(name, party, shift, new_memory, message, data):
    """Let a middleware read what Python wrote, and Python what a middleware wrote."""
    who = type(party).__name__
    memory = new_memory()
    message @ memory
    found = party.read(id(memory) + shift, len(data) + 64)
    if found != data[4:]:
        print(f"{name}: {who} reads {found.hex()}, not {data[4:].hex()}"[:500])
    memory = new_memory()
    party.write(data[4:], id(memory) + shift)
    again = methods(+memory).serialize()
    if again != data:
        print(f"{name}: {who} wrote what is read as {again.hex()}, not {data.hex()}"[:500])


def resident():
    gc.collect()
    return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * 4096 / 1e6


def look_at_memory(name, values):
    """Fill, read and drop much memory; only the first rounds may make the process grow."""
    cls = interface_of(name)
    structs = importlib.import_module(f"{cls.__module__.split('.')[0]}._idlc.typesupport_structs")
    support = structs.message(cls, name)
    walker = Walker(support.handle)
    message = values.build(name, values.invent(name))
    data = methods(message).serialize()[4:]
    sizes = []
    for _ in range(4):
        for _ in range(300):
            memory = support.memory()
            message @ memory
            memory = support.memory()
            walker.write(data, id(memory))
            methods(+memory).serialize()
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
    # loads the middleware, and with it Fast CDR
    importlib.import_module("rclpy.utilities").get_rmw_implementation_identifier()
    main(*sys.argv[1:])
