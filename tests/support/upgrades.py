"""Random pairs of types and values, and the upgrade as a reader of JSON by field names makes it."""

from typing import NamedTuple

import idlc
from idlc.model.ir import PRIMITIVES
from tests.support.examples import st

#: Wider types of each primitive, by hand.
WIDER = {
    "bool": "uint8 int8 int32 uint64",
    "byte": "uint8 char uint16 int64",
    "char": "uint8 int16 float32",
    "uint8": "char byte uint16 int16 float32 float64",
    "int8": "int16 int64 float32",
    "int16": "int32 float32 float64",
    "uint16": "uint32 int32 float32",
    "int32": "int64 float64",
    "uint32": "uint64 int64 float64",
    "float32": "float64",
    "string": "wstring",
}
TEXTS = st.text(st.characters(exclude_categories=("Cs",), max_codepoint=0xFFFF), max_size=6)
NAMES = [f"{letter}{digit}" for digit in range(3) for letter in "abcdef"]
DEPTH = 3


class Field(NamedTuple):
    """A field: `element` is a primitive, string type or message; `shape` as it is written."""

    name: str
    element: str
    bound: int | None = None
    shape: str = ""
    count: int | None = None
    default: object = None

    @property
    def line(self):
        bound = f"<={self.bound}" if self.bound is not None else ""
        default = "" if self.default is None else f" {self.default}"
        return f"{self.element}{bound}{self.shape} {self.name}{default}\n"


@st.composite
def fields(draw, name, depth):
    choices = [
        *PRIMITIVES,
        "byte",
        "bool",
        "string",
        "wstring",
        *([f"M{depth + 1}"] * 6 if depth < DEPTH else ()),
    ]
    element = draw(st.sampled_from(choices))
    bound = draw(st.sampled_from([None, 4, 6])) if element == "string" else None
    shape, count = draw(
        st.sampled_from([("", None), ("", None), ("[2]", 2), ("[]", None), ("[<=3]", 3)])
    )
    return Field(name, element, bound, shape, count)


def values_of(field):
    """Return the values of a field's elements as JSON has them."""
    if field.element in ("string", "wstring"):
        return TEXTS.map(lambda text: text[: field.bound])
    if field.element == "bool":
        return st.booleans()
    if field.element == "byte":
        return st.integers(0, 255)
    if field.element.startswith("float"):
        return st.floats(allow_nan=False, allow_infinity=False, width=int(field.element[5:]))
    info = PRIMITIVES[field.element]
    return st.integers(info.low, info.high)


@st.composite
def messages(draw, types, name):
    """Return a message as JSON."""
    result = {}
    for field in types[name]:
        is_nested = field.element in types
        element = messages(types, field.element) if is_nested else values_of(field)
        if not field.shape:
            result[field.name] = draw(element)
        elif field.shape == "[2]":
            result[field.name] = draw(st.lists(element, min_size=2, max_size=2))
        else:
            result[field.name] = draw(st.lists(element, max_size=field.count or 3))
    return result


@st.composite
def edited(draw, field):
    """Return a field that takes all values of another, as by hand."""
    edit = draw(st.sampled_from(["", *["widen"] * 5, "wrap", "list", "bound", "count"]))
    # ROS 2 reads the bound of a wstring in a list as that of the list
    if edit == "widen" and field.element in WIDER and not (field.bound and field.shape):
        field = field._replace(element=draw(st.sampled_from(WIDER[field.element].split())))
    elif edit == "wrap" and not field.shape and field.element != "wstring":
        field = field._replace(shape="[1]", count=1)
    elif edit == "list" and field.shape == "[2]":
        field = field._replace(shape=draw(st.sampled_from(["[]", "[<=2]", "[<=5]"])), count=None)
    elif edit == "bound" and field.bound is not None:
        field = field._replace(bound=draw(st.sampled_from([None, 8])))
    elif edit == "count" and field.shape == "[<=3]":
        field = field._replace(shape=draw(st.sampled_from(["[]", "[<=4]"])))
    return field


class Pair(NamedTuple):
    """Two versions of types by name, whose top is M0."""

    old: dict
    new: dict


@st.composite
def pairs(draw):
    """Return types, and the same after edits at any depth that need no rule."""
    old, new = {}, {}
    for depth in range(DEPTH + 1):
        names = draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=4, unique=True))
        mine = [draw(fields(name, depth)) for name in names]
        if depth < DEPTH and not any(field.element.startswith("M") for field in mine):
            mine.append(Field("inner", f"M{depth + 1}", None, "[]"))
        theirs = [draw(edited(field)) for field in mine]
        # fields that go where others come may be renamed ones, and need a rule
        change = draw(st.sampled_from(["", "add", "add", "remove", "move"]))
        if change == "add":
            for number in range(draw(st.integers(1, 2))):
                added = draw(fields(f"new{number}", DEPTH))
                if (
                    not added.shape
                    and added.element in PRIMITIVES
                    and added.element not in ("bool", "byte")
                ):
                    added = added._replace(default=draw(st.sampled_from([None, 3])))
                theirs.insert(draw(st.integers(0, len(theirs))), added)
        elif change == "remove" and len(theirs) > 1:
            theirs.pop(draw(st.integers(0, len(theirs) - 1)))
        elif change == "move":
            theirs = draw(st.permutations(theirs))
        old[f"M{depth}"], new[f"M{depth}"] = mine, list(theirs)
    return Pair(old, new)


def load(folder, types):
    """Write a package, and return the class of M0."""
    return idlc.load(package(folder, types)).M0


def package(folder, types):
    """Write a package, and return its path."""
    place = folder / "demo_msgs" / "msg"
    place.mkdir(parents=True, exist_ok=True)
    for name, own in types.items():
        text = "".join(field.line for field in own)
        (place / f"{name}.msg").write_text(text, encoding="utf-8")
    return str(folder / "demo_msgs")


def by_names(pair, name, values):
    """Return what a reader of JSON makes of an old message: fields by their names."""
    old = {field.name: field for field in pair.old[name]}
    return {
        field.name: (
            _converted(pair, old[field.name], field, values[field.name])
            if field.name in old
            else _default(pair, field)
        )
        for field in pair.new[name]
    }


def _converted(pair, old, new, value):
    def element(value):
        if old.element in pair.old:
            return by_names(pair, old.element, value)
        if new.element.startswith("float"):
            return float(value)
        return int(value) if old.element == "bool" and new.element != "bool" else value

    if not old.shape:
        return [element(value)] if new.shape else element(value)
    return [element(each) for each in value]


def _default(pair, field):
    def element():
        if field.element in pair.new:
            return {each.name: _default(pair, each) for each in pair.new[field.element]}
        if field.element.startswith("float"):
            return float(field.default or 0)
        if field.element in ("string", "wstring"):
            return ""
        return False if field.element == "bool" else field.default or 0

    if not field.shape:
        return element()
    return [element() for _ in range(field.count)] if field.shape in ("[1]", "[2]") else []
