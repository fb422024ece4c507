"""One side of the drop-in comparison, as a process: drop_in_side.py OUTCOMES NAME...

The same operations on whichever class is imported by a name, rosidl's or idlc's: one JSON line
for each, [key, outcome]. rosidl's classes end the process on some values, so operations run in a
child, and after its death a new one goes on with the next operation.
"""

import hashlib
import json
import operator
import os
import sys
import warnings
from functools import partial
from pathlib import Path

import drop_in_values as catalog
from drop_in_whole import ON_MESSAGES, told_as
from rclpy.serialization import serialize_message
from trees import INTEGERS, Values, class_of, shape_of

warnings.simplefilter("ignore")

#: Whether messages can be sent: rosidl's need compiled code for that.
ON_THE_WIRE = "IDLC_NO_WIRE" not in os.environ


def short(text):
    """Return a text, or the beginning and digest of a long one."""
    if len(text) <= 200:
        return text
    return text[:100] + hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()


def shown(value):
    """Return what a value is: its type, and its content without addresses."""
    kind = type(value)
    if hasattr(kind, "get_fields_and_field_types"):
        return ["message", kind.__name__, short(repr(value))]
    text = repr(value)
    return [kind.__module__, kind.__name__, short(text) if " at 0x" not in text else ""]


def wire(message):
    """Return the bytes that rclpy sends for a message, or why it does not."""
    if not ON_THE_WIRE:
        return {}
    try:
        return {"bytes": serialize_message(message).hex()}
    except Exception as error:
        return {"refused": told_as(error)}


def attempt(operation):
    """Return the outcome of an operation that gives a message and what to look at."""
    try:
        message, look = operation()
        return {"read": shown(look(message))} | wire(message)
    except Exception as error:
        return {"raised": told_as(error)}


class Operations:
    """Makes the operations of messages; `shapes` holds each message's shape by full name."""

    def __init__(self, shapes):
        self.values = Values(shapes, seed=1)

    def good(self, element):
        """Return a right value of an element type, the same on both sides."""
        if isinstance(element, list) and len(element) == 3:
            return class_of(*element)()
        if isinstance(element, list):
            return "good"
        if element == "boolean":
            return True
        if element == "octet":
            return b"g"
        return 2 if element in INTEGERS else 2.5

    def of_field(self, name, field, few):
        """Yield the operations on one field of a message."""
        cls = class_of(*name.split("/"))
        shape = self.values.shapes[name][field]

        def fresh():
            return catalog.for_field(shape, lambda: self.good(shape[2]))

        def read(message):
            return getattr(message, field)

        # each operation has values of its own, because it may change them
        plain, checked, given, aliases = fresh(), fresh(), fresh(), fresh()
        named = [value for value in plain if not few or value in FEW]
        for value in named:
            yield (
                f"{name}.{field} = {value}",
                lambda value=value: assigned(cls(), field, plain[value], read),
            )
            yield (
                f"{name}.{field} = {value}, checked",
                lambda value=value: assigned(cls(check_fields=True), field, checked[value], read),
            )
            if few:
                continue
            yield (
                f"{name}({field}={value})",
                lambda value=value: (
                    cls(**{field: given[value]}),
                    read,
                ),
            )
            if shape[0] != "one":
                yield (
                    f"{name}.{field} aliases {value}",
                    lambda value=value: aliased(cls(), field, aliases[value]),
                )
        if few:
            return
        for change, do in CHANGES.items():
            yield (
                f"{name}.{field} {change}",
                lambda do=do: changed(cls(), field, do, self.good(shape[2]), read),
            )


def assigned(message, field, value, read):
    setattr(message, field, value)
    return message, read


def aliased(message, field, value):
    """Assign a value, then change it: what does the message hold?"""
    setattr(message, field, value)
    for change in (
        lambda: value.__setitem__(0, value[1]),
        lambda: value.pop(),
        lambda: value.clear(),
    ):
        try:
            change()
        except Exception:  # noqa: S112 (what cannot be changed in one way can in another)
            continue
        break
    return message, lambda message: getattr(message, field)


def changed(message, field, do, good, read):
    do(message, field, good)
    return message, read


def _extend(message, field, good):
    getattr(message, field).extend([good, good])


def _first(message, field, good):
    getattr(message, field)[0] = good


def _slice(message, field, good):
    value = getattr(message, field)
    value[:2] = type(value)([good, good]) if isinstance(value, list) else value[:2]


def _add(message, field, good):
    setattr(message, field, operator.add(getattr(message, field), [good]))


#: Changes of what a field holds.
CHANGES = {
    "append": lambda message, field, good: getattr(message, field).append(good),
    "append wrong": lambda message, field, _: getattr(message, field).append(object()),
    "append None": lambda message, field, _: getattr(message, field).append(None),
    "extend": _extend,
    "first": _first,
    "slice": _slice,
    "clear": lambda message, field, _: getattr(message, field).clear(),
    "plus list": _add,
    "delete": lambda message, field, _: delattr(message, field),
    "new attribute": lambda message, _, good: setattr(message, "nonesuch_", good),
}
#: What is tried on every field; everything else on one field of each type.
FEW = {"good", "list", "tuple", "None", "bytes 24", "int 1", "float 1.5", "text plain", "dict"}


class Plan:
    """The operations in groups, the same on both sides."""

    def __init__(self, names):
        classes = {name: class_of(*name.split("/")) for name in names}
        self.operations = Operations({name: shape_of(cls) for name, cls in classes.items()})
        #: A message, a field of it or None, and whether only a few values are tried.
        self.groups = []
        seen = set()
        for name, cls in classes.items():
            self.groups.append((name, None, False))
            for field in cls.get_fields_and_field_types():
                container, size, element = self.operations.values.shapes[name][field]
                nested = isinstance(element, list) and len(element) == 3
                key = (container, size, "message" if nested else str(element))
                self.groups.append((name, field, key in seen))
                seen.add(key)

    def group(self, index):
        """Yield the key of each operation of a group, and what gives its outcome."""
        name, field, few = self.groups[index]
        if field is None:
            for what, operation in ON_MESSAGES.items():
                if not ON_THE_WIRE and what.endswith("as read"):
                    continue
                yield (
                    f"{name} {what}",
                    partial(told, partial(operation, class_of(*name.split("/")))),
                )
            return
        for key, operation in self.operations.of_field(name, field, few):
            yield key, partial(attempt, operation)


def told(operation):
    """Return the outcome of an operation on a whole message: what it returns."""
    try:
        return {"told": operation()}
    except Exception as error:
        return {"raised": told_as(error)}


def run_from(plan, start, out):
    """Run operations in a child and write their outcomes; return where to go on."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read_end)
        for group in range(start[0], len(plan.groups)):
            for index, (key, operation) in enumerate(plan.group(group)):
                if (group, index) >= start:
                    os.write(write_end, f"{json.dumps([group, index, key])}\n".encode())
                    out.write(json.dumps([key, operation()]) + "\n")
                    out.flush()
        os._exit(0)
    os.close(write_end)
    begun = b"\n"
    with os.fdopen(read_end, "rb") as pipe:
        for line in pipe:
            begun = line
    _, status = os.waitpid(child, 0)
    if status == 0:
        return None
    group, index, key = json.loads(begun)
    out.write(json.dumps([key, {"died": True}]) + "\n")
    out.flush()
    return group, index + 1


def main():
    path, *names = sys.argv[1:]
    plan, start = Plan(names), (0, 0)
    with Path(path).open("w", encoding="utf-8") as out:
        while start is not None:
            start = run_from(plan, start, out)


if __name__ == "__main__":
    main()
