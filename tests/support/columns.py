"""What columns must hold: what the messages hold, one by one."""

from contextlib import suppress
from copy import deepcopy

import numpy as np

from idlc import Batch
from idlc.runtime.names import public_name
from tests.support import values


def messages_of(cls, rng, count, longest):
    """Return random messages, whose sequences are shorter than `longest`."""
    return [values.randomized(cls(), rng, longest) for _ in range(count)]


def buffers_of(messages, rng, orders=("little", "big")):
    """Return the bytes of messages, each in one of some orders and with bytes after it."""
    return [
        message.serialize(byteorder=rng.choice(orders)) + bytes(rng.choice([0, 0, 3]))
        for message in messages
    ]


def make_even(plain, messages):
    """Give all sequences as many elements as they have in one message, given as a dictionary."""
    for name in plain:
        if isinstance(plain[name], list):
            for message in messages[1:]:
                setattr(
                    message, public_name(name), deepcopy(getattr(messages[0], public_name(name)))
                )
        elif isinstance(plain[name], dict) and plain[name]:
            make_even(plain[name], [getattr(message, public_name(name)) for message in messages])


def batch_of(buffers, rng):
    """Return a Batch of buffers that lie anywhere, in any order and with anything between."""
    memory, places = bytearray(), {}
    for index in rng.sample(range(len(buffers)), len(buffers)):
        memory += rng.randbytes(rng.randrange(9))
        places[index] = (len(memory), len(memory) + len(buffers[index]))
        memory += buffers[index]
    starts, stops = zip(*(places[index] for index in range(len(buffers))), strict=True)
    return Batch(memory, np.array(starts), stops)


def plain_row(row):
    """Return a row of a structured array as `to_dict` has it, but for texts."""
    if row.dtype.names is not None or row.dtype.kind == "V":
        if row.ndim:
            return [plain_row(one) for one in row]
        return {name: plain_row(row[name]) for name in row.dtype.names or ()}
    return row.tolist()


def short_texts(plain):
    """Return what `to_dict` returns with texts as numpy keeps them: bytes, no zeros at the end."""
    if isinstance(plain, dict):
        return {name: short_texts(value) for name, value in plain.items()}
    if isinstance(plain, list):
        return [short_texts(value) for value in plain]
    return plain.encode().rstrip(b"\0") if isinstance(plain, str) else plain


def from_arrow(value):
    """Return a value of Arrow as `to_dict` has it."""
    if isinstance(value, dict):
        return {name: from_arrow(one) for name, one in value.items()}
    if isinstance(value, list):
        return list(map(from_arrow, value))
    return list(value) if isinstance(value, bytes) else value


def check(cls, buffers, rng):
    """Check all kinds of columns of some messages against the messages."""
    wanted = [cls.deserialize(buffer).to_dict() for buffer in buffers]
    columns = cls.to_columns(buffers)
    assert len(columns) == len(buffers)
    assert repr(columns.to_list()) == repr(wanted)
    if buffers:
        columns = cls.to_columns(batch_of(buffers, rng))
        assert repr(columns.to_list()) == repr(wanted)
    with suppress(ValueError):  # not all columns fit into one array
        rows = cls.to_columns(buffers).structured()
        assert repr([plain_row(row) for row in rows]) == repr(short_texts(wanted))
    table = cls.to_arrow(iter(map(memoryview, buffers)))
    table.validate(full=True)
    assert repr(from_arrow(table.to_pylist())) == repr(wanted)


def dotted(plain, rng, prefix=""):
    """Yield the dotted names of some fields, at any depth."""
    for name, value in plain.items():
        inner = value[0] if isinstance(value, list) and value else value
        if isinstance(inner, dict) and inner and rng.random() < 0.6:
            yield from dotted(inner, rng, f"{prefix}{name}.")
        elif rng.random() < 0.4:
            yield prefix + name


def selected(plain, names):
    """Return what a value is when only the fields of these names are wanted."""
    if isinstance(plain, list):
        return [selected(one, names) for one in plain]
    result = {}
    for name, value in plain.items():
        below = [one.partition(".")[2] for one in names if one.partition(".")[0] == name]
        if below:
            result[name] = value if "" in below else selected(value, below)
    return result
