"""Offsets and sizes are those of real bytes, or a lower bound of them where that is said."""

import re

from idlc.compiler.compiler import compile_package
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.model import catalog, ir
from idlc.wire.layout import Extent, layout
from tests.support import reference_cdr

ODD = """\
Inner[7] inner
uint8 after
Text[2] texts
bool last
Empty nothing
float64 wide
Inner[1000000000] very_many
"""
FILES = {"Odd": ODD, "Inner": "uint8 a\nint64 b\nuint8 c\n", "Text": "uint8 a\nstring s\n"}
FILES |= {"Empty": ""}


def value_of(type_, messages, length):
    match type_:
        case ir.Primitive():
            return 0
        case ir.String():
            return "a" * length
        case ir.Array():
            return [value_of(type_.element, messages, length)] * type_.size
        case ir.Sequence():
            return [value_of(type_.element, messages, length)] * length
    return message_of(messages[type_.target], messages, length)


def message_of(message, messages, length):
    return {field.name: value_of(field.type, messages, length) for field in message.fields}


def places(message, messages, length):
    """Return where each field begins, and where all ends."""
    value = message_of(message, messages, length)
    data, leaves = reference_cdr.encode(message, value, messages)
    found = {}
    for path, (offset, _, _), _ in leaves:
        if path is not None:
            found.setdefault(re.match(r"\.(\w+)", path)[1], offset)
    return found, len(data)


def model(package, sources):
    report = Report()
    found = compile_package(package, sources, catalog, report)
    assert not report.had_errors
    return found


def test_every_standard_message():
    checked = 0
    for package in catalog.packages():
        names = [name for name in catalog.interfaces() if name.package == package]
        messages = model(package, [(name, catalog.source(name)) for name in names]).messages
        for message in messages.values():
            check(message, messages)
            checked += 1
    assert checked > 400


def test_arrays_of_odd_sizes_and_what_is_empty():
    files = {**FILES, "Odd": ODD.replace("1000000000", "1000")}
    sources = [(ir.TypeName("a", "msg", name), Source(name, text)) for name, text in files.items()]
    found = model("a", sources)
    for message in found.messages.values():
        check(message, found.messages)


def test_an_array_is_not_counted_one_by_one():
    sources = [(ir.TypeName("a", "msg", name), Source(name, text)) for name, text in FILES.items()]
    messages = model("a", sources).messages
    fields, _ = layout(messages[ir.TypeName("a", "msg", "Odd")], messages)
    assert fields[-1].size == Extent(17 + 16 * (1_000_000_000 - 1))


def check(message, messages):
    fields, whole = layout(message, messages)
    for length in (0, 1, 2):
        found, size = places(message, messages, length)
        for one in fields:
            offset = found.get(
                one.field.name, one.offset.size
            )  # of an empty message nothing is told
            exact = one.offset.exact or length == 0
            assert offset == one.offset.size if exact else offset >= one.offset.size
        exact = whole.exact or length == 0
        assert size == whole.size if exact else size >= whole.size
