"""Message values as plain trees that survive JSON, and a generator of such values.

A shape tells a message's fields: name -> (container, size, element), where container is "one",
"array" (exactly `size`) or "sequence" (at most `size`, or any number if it is None), and element
is a primitive's IDL name, ["string" | "wstring", bound] or [package, kind, name]. In a tree,
floats are `float.hex()` texts (exact, NaN equals itself) and a byte is a number.
"""

import importlib
import random
import struct
from functools import cache

INTEGERS = {f"{sign}int{bits}": (sign, bits) for sign in ("", "u") for bits in (8, 16, 32, 64)}
FLOATS = {"float": "f", "double": "d"}
#: The largest, the smallest normal and the smallest number of each width.
SPECIAL_FLOATS = {
    "float": [(2 - 2**-23) * 2.0**127, 2.0**-126, 2.0**-149],
    "double": [(2 - 2**-52) * 2.0**1023, 2.0**-1022, 2.0**-1074],
}
TEXTS = [
    "",
    "a",
    "plain text",
    "tab\tand\nnewline",
    "quote ' \" \\",
    "é",
    "漢字",
    "🤖",
    "a\u0301\u200b",
]
PARTS = {"_Goal": "Goal", "_Result": "Result", "_Feedback": "Feedback"}


@cache
def class_of(package, kind, name):
    """Return a message class by its full name, the parts of actions included."""
    module = importlib.import_module(f"{package}.{kind}")
    for suffix, part in PARTS.items():
        if kind == "action" and name.endswith(suffix):
            return getattr(getattr(module, name.removesuffix(suffix)), part)
    if kind == "action" and name.endswith("_FeedbackMessage"):
        return getattr(module, name.removesuffix("_FeedbackMessage")).Impl.FeedbackMessage
    return getattr(module, name)


def methods(message):
    """Return an object with the methods of idlc's class, which a field may hide."""
    return super(type(message), message)


def attribute(cls, field):
    """Return a field's name in Python: idlc puts an underscore after keywords."""
    clash = field + "_"
    return clash if hasattr(cls, clash) else field


def _element(type_):
    from rosidl_parser import definition as idl

    if isinstance(type_, idl.NamespacedType):
        return [*type_.namespaces, type_.name]
    if isinstance(type_, idl.AbstractGenericString):
        word = "string" if isinstance(type_, idl.AbstractString) else "wstring"
        return [word, type_.maximum_size if type_.has_maximum_size() else None]
    return type_.typename


def shape_of(cls):
    """Return the shape of a message class, from what ROS 2's tools read."""
    from rosidl_parser import definition as idl

    shape = {}
    for slot, type_ in zip(cls.get_fields_and_field_types(), cls.SLOT_TYPES, strict=True):
        if isinstance(type_, idl.Array):
            shape[slot] = ["array", type_.size, _element(type_.value_type)]
        elif isinstance(type_, idl.AbstractSequence):
            bound = type_.maximum_size if type_.has_maximum_size() else None
            shape[slot] = ["sequence", bound, _element(type_.value_type)]
        else:
            shape[slot] = ["one", None, _element(type_)]
    return shape


class Values:
    """Builds, reads and invents values; `shapes` holds each message's shape by full name."""

    def __init__(self, shapes, seed=0):
        self.shapes = shapes
        self.random = random.Random(seed)

    # plain tree -> object
    def build(self, name, tree):
        cls = class_of(*name.split("/"))
        fields = self.shapes[name].items()
        return cls(
            **{attribute(cls, field): self._build(shape, tree[field]) for field, shape in fields}
        )

    def _build(self, shape, tree):
        container, _, element = shape
        if container == "one":
            return self._build_one(element, tree)
        return [self._build_one(element, item) for item in tree]

    def _build_one(self, element, tree):
        if isinstance(element, list):
            return self.build("/".join(element), tree) if len(element) == 3 else tree
        if element in FLOATS:
            return float.fromhex(tree)
        return bytes([tree]) if element == "octet" else tree

    # object -> plain tree
    def plain(self, name, message):
        return {
            field: self._plain(shape, getattr(message, attribute(type(message), field)))
            for field, shape in self.shapes[name].items()
        }

    def _plain(self, shape, value):
        container, _, element = shape
        if container == "one":
            return self._plain_one(element, value)
        items = value.tolist() if hasattr(value, "tolist") else value
        return [self._plain_one(element, item) for item in items]

    def _plain_one(self, element, value):
        if isinstance(element, list):
            return self.plain("/".join(element), value) if len(element) == 3 else value
        if element in FLOATS:
            return float(value).hex()
        if element == "octet":
            (number,) = value
            return number
        return value

    # invention
    def invent(self, name, depth=0):
        return {f: self._invent(shape, depth) for f, shape in self.shapes[name].items()}

    def _invent(self, shape, depth):
        container, size, element = shape
        if container == "one":
            return self._invent_one(element, depth)
        count = size if container == "array" else self._length(size, element, depth)
        return [self._invent_one(element, depth + 1) for _ in range(count)]

    def _length(self, bound, element, depth):
        lengths = [0, 1, 2, 3]
        if depth == 0:
            lengths += [7] if isinstance(element, list) else [7, 1000]
        length = self.random.choice(lengths)
        return length if bound is None else self.random.choice([0, bound, min(length, bound)])

    def _invent_one(self, element, depth):
        if isinstance(element, list):
            if len(element) == 3:
                return self.invent("/".join(element), depth + 1)
            return self._text(*element)
        if element == "boolean":
            return self.random.random() < 0.5
        if element == "octet":
            return self.random.choice([0, 255, self.random.randrange(256)])
        if element in FLOATS:
            return self._float(element)
        sign, bits = INTEGERS[element]
        low, high = (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        return self.random.choice([low, high, 0, 1, self.random.randint(low, high)])

    def _float(self, element):
        code = FLOATS[element]
        bits = self.random.randbytes(struct.calcsize(code))
        (anything,) = struct.unpack(f"<{code}", bits)
        common = [0.0, -0.0, 1.5, float("inf"), float("-inf"), float("nan")]
        special = [sign * number for number in SPECIAL_FLOATS[element] for sign in (1, -1)]
        return self.random.choice(
            [anything, *self.random.choice([common, special, [anything]])]
        ).hex()

    def _text(self, word, bound):
        """Return a text within `bound`, counted in the widest way that anyone counts."""
        text = "".join(self.random.choices(TEXTS, k=self.random.randrange(3)))
        if self.random.random() < 0.05:
            text *= 200
        code, unit = ("utf-8", 1) if word == "string" else ("utf-16-le", 2)
        while bound is not None and len(text.encode(code)) // unit > bound:
            text = text[:-1]
        return text
