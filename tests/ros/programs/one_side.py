"""One side of the agreement on the wire, as a process: one_side.py STEP FILE [NAME...]

invent  official classes: write each message's shape, values and official bytes to FILE
check   idlc's classes: read FILE's bytes, compare with its values, add idlc's own bytes to FILE
read    official classes: read the bytes that idlc wrote, compare with the values

Prints one line per disagreement and, last, how many messages were looked at.
"""

import json
import sys
import zlib
from pathlib import Path

from trees import Values, class_of, shape_of

RANDOM_VALUES = 10


def invent(path, names):
    from rclpy.serialization import serialize_message

    shapes = {name: shape_of(class_of(*name.split("/"))) for name in names}
    record = {}
    for name in names:
        values = Values(shapes, seed=zlib.crc32(name.encode()))
        cls = class_of(*name.split("/"))
        trees = [values.plain(name, cls())]
        trees += [values.invent(name) for _ in range(RANDOM_VALUES)]
        record[name] = {
            "shape": shapes[name],
            "types": cls.get_fields_and_field_types(),
            "trees": trees,
            "official": [serialize_message(values.build(name, tree)).hex() for tree in trees],
        }
    path.write_text(json.dumps(record), encoding="utf-8")


def check(path, names):
    record = json.loads(path.read_text(encoding="utf-8"))
    values = Values({name: entry["shape"] for name, entry in record.items()})
    for name in names:
        entry = record[name]
        cls = class_of(*name.split("/"))
        if not hasattr(cls, "deserialize"):
            complain(name, "is not one of idlc's classes")
            continue
        compare(name, "field types", cls.get_fields_and_field_types(), entry["types"])
        compare(name, "SLOT_TYPES", shape_of(cls), entry["shape"])
        compare(name, "default", values.plain(name, cls()), entry["trees"][0])
        entry["idlc"] = []
        for tree, data in zip(entry["trees"], entry["official"], strict=True):
            received = cls.deserialize(bytes.fromhex(data))
            compare(name, "value read from rclpy's bytes", values.plain(name, received), tree)
            message = values.build(name, tree)
            orders = [message.serialize(), message.serialize(byteorder="big")]
            compare(name, "length in the other order", len(orders[1]), len(orders[0]))
            compare(name, "bytes written again", received.serialize(), orders[0])
            for order in orders:
                again = values.plain(name, cls.deserialize(order))
                compare(name, "value read from own bytes", again, tree)
                entry["idlc"].append(order.hex())
    path.write_text(json.dumps(record), encoding="utf-8")


def read(path, names):
    from rclpy.serialization import deserialize_message

    record = json.loads(path.read_text(encoding="utf-8"))
    values = Values({name: entry["shape"] for name, entry in record.items()})
    for name in names:
        entry = record[name]
        cls = class_of(*name.split("/"))
        both_orders = [tree for tree in entry["trees"] for _ in ("little", "big")]
        for tree, data in zip(both_orders, entry["idlc"], strict=True):
            received = deserialize_message(bytes.fromhex(data), cls)
            compare(name, "value read by rclpy", values.plain(name, received), tree)


def complain(name, what):
    print(f"{name}: {what}"[:500])


def compare(name, what, found, expected):
    if found != expected:
        complain(name, f"{what}: {difference(found, expected)}")


def difference(found, expected, path=""):
    """Return the first place where two trees differ."""
    if isinstance(found, dict) and isinstance(expected, dict) and list(found) == list(expected):
        pairs = [(f"{path}.{key}", found[key], expected[key]) for key in found]
    elif isinstance(found, list) and isinstance(expected, list) and len(found) == len(expected):
        pairs = [(f"{path}[{i}]", found[i], expected[i]) for i in range(len(found))]
    else:
        return f"{path} is {found!r}, not {expected!r}"
    return next((difference(a, b, place) for place, a, b in pairs if a != b), "equal")


if __name__ == "__main__":
    step, file, *chosen = sys.argv[1:]
    {"invent": invent, "check": check, "read": read}[step](Path(file), chosen)
    print("looked at", len(chosen))
