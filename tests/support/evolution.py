"""Random versions of a package, random values, and what a new codec makes of old bytes."""

import random

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.parse import parse
from idlc.model import catalog, ir
from idlc.model.link import link
from idlc.model.lowering.lower import lower
from tests.support import reference_cdr

TYPES = (
    "bool byte char int8 uint8 int16 uint16 int32 uint32 int64 uint64 float32 float64 "
    "string string wstring string<=4"
).split()
SUFFIXES = ["", "", "", "", "[]", "[2]", "[3]", "[<=1]", "[<=3]", "[<=5]"]
NAMES = [f"f{number}" for number in range(40)]
LONGEST = 7
#: Types that are easily mistaken for each other.
NEAR = [
    ["bool", "byte", "char", "uint8", "int8"],
    ["int16", "uint16"],
    ["int32", "uint32", "float32"],
    ["int64", "uint64", "float64"],
    ["string", "string<=4", "wstring"],
    ["B", "C"],
]


class Evolution:
    """Three messages, of which the earlier may use the later, and one change after another."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.names = iter(())
        self.fields = {name: [] for name in "ABC"}
        for name in "ABC":
            for _ in range(self.random.randrange(4)):
                self.fields[name].append([self.type(name), self.name(name)])

    def name(self, message):
        used = {name for _, name in self.fields[message]}
        return self.random.choice([name for name in NAMES if name not in used])

    def type(self, message):
        messages = [name for name in "ABC" if name > message]
        if messages and self.random.random() < 0.35:
            type_ = self.random.choice(messages)
        else:
            type_ = self.random.choice(TYPES)
        return type_ + self.random.choice(SUFFIXES)

    def edit(self):
        """Change one thing, and say what."""
        message = self.random.choice("ABC")
        fields = self.fields[message]
        kind = self.random.choice(
            ["add", "append", "remove", "cut", "rename", "move", "retype", "similar", "replace"]
        )
        if kind in ("add", "append") or not fields:
            at = len(fields) if kind == "append" else self.random.randrange(len(fields) + 1)
            fields.insert(at, [self.type(message), self.name(message)])
            return "add"
        at = len(fields) - 1 if kind == "cut" else self.random.randrange(len(fields))
        match kind:
            case "remove" | "cut":
                del fields[at]
            case "rename":
                fields[at][1] = self.name(message)
            case "move":
                fields.insert(self.random.randrange(len(fields)), fields.pop(at))
            case "retype":
                fields[at][0] = self.type(message)
            case "replace":
                fields[at] = [self.type(message), self.name(message)]
            case "similar":
                self._similar(message, fields[at])
        if len(fields) > 6:
            del fields[self.random.randrange(len(fields))]
        return kind

    def _similar(self, message, field):
        """Change a type to one that is easily mistaken for it."""
        base, _, array = field[0].partition("[")
        array = array and "[" + array
        if self.random.random() < 0.5:
            field[0] = base + self.random.choice(SUFFIXES)
            return
        near = [group for group in NEAR if base in group]
        others = [one for group in near for one in group if one not in "ABC" or one > message]
        field[0] = self.random.choice(others or [base]) + array

    def texts(self):
        return {
            name: "".join(f"{type_} {field}\n" for type_, field in fields)
            for name, fields in self.fields.items()
        }


def compile_texts(texts, package="p"):
    report = Report()
    own = [
        lower(parse(Source(f"{name}.msg", text)), ir.TypeName(package, "msg", name), report)
        for name, text in texts.items()
    ]
    model = link(package, own, catalog, report)
    assert not report.had_errors, (texts, list(report))
    return model


class Values:
    """Random values that differ wherever they can."""

    def __init__(self, seed, messages):
        self.random = random.Random(seed)
        self.messages = messages

    def message(self, message):
        return {field.name: self.value(field.type) for field in message.fields}

    def value(self, type_):
        match type_:
            case ir.Ref():
                return self.message(self.messages[type_.target])
            case ir.Array():
                return [self.value(type_.element) for _ in range(type_.size)]
            case ir.Sequence():
                most = LONGEST if type_.bound is None else type_.bound
                size = most if self.random.random() < 0.3 else self.random.randrange(most + 1)
                return [self.value(type_.element) for _ in range(size)]
            case ir.String():
                length = self.random.randrange(1, 5)
                return "".join(self.random.choice("abcdefé漢") for _ in range(length))
            case ir.Primitive("bool"):
                return self.random.random() < 0.5
            case ir.Primitive("float32" | "float64"):
                return self.random.choice([-1, 1]) * self.random.randrange(1, 4096) / 8
        info = type_.info
        if self.random.random() < 0.2:
            return self.random.choice([info.low, info.high])
        return self.random.randrange(info.low, info.high + 1)


def old_bytes_are_misread(before, after, name, seed):
    """Whether some old value, as bytes, is not what it was to the new version.

    What is read must have been written at the same place, and under the same name if there was
    such a name.
    """
    value = Values(seed, before.messages).message(before.messages[name])
    data, written = reference_cdr.encode(before.messages[name], value, before.messages)
    try:
        _, read = reference_cdr.decode(after.messages[name], data, after.messages)
    except reference_cdr.ERRORS:
        return True
    by_place = {place: value for _, place, value in written}
    places = {path: place for path, place, _ in written}
    return not all(
        place in by_place and by_place[place] == value and places.get(path, place) == place
        for path, place, value in read
        if path is not None
    )
