"""Setting messages from plain values and random ones, through their public attributes."""

import random
import struct

from idlc.runtime.names import public_name
from idlc.runtime.typeinfo import structure_of

INTEGERS = {
    f"{sign}int{bits}": (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
}
ALPHABET = "aZ_0 9éß漢😀"


def fields_of(message):
    """Return the fields of a message as the package's own type information has them."""
    return structure_of(type(message)).fields


def fill(message, values):
    """Set fields from recorded values; a byte is a number, a nested message a dictionary."""
    for field in fields_of(message):
        value = values[field.name]

        def one(element, field=field):
            if field.nested:
                return fill(field.nested.find_class()(), element)
            octet = field.primitive is not None and field.primitive.name == "byte"
            return bytes([element]) if octet else element

        if field.is_list and not field.is_numeric:
            value = [one(element) for element in value]
        elif not field.is_list:
            value = one(value)
        setattr(message, public_name(field.name), value)
    return message


def randomized(message, rng, longest=4):
    """Set all fields to random values."""
    for field in fields_of(message):

        def one(field=field):
            if field.nested:
                return randomized(field.nested.find_class()(), rng, longest)
            if field.text:
                size = rng.randrange(min(field.text_bound or 12, 12) + 1)
                return "".join(rng.choice(ALPHABET) for _ in range(size))
            return number(field.primitive.name, rng)

        if field.is_list:
            most = field.size if field.size is not None else rng.randrange(longest)
            value = [one() for _ in range(min(most, field.bound or most))]
        else:
            value = one()
        setattr(message, public_name(field.name), value)
    return message


def number(name, rng: random.Random):
    """Return a random value of a primitive, extremes more often than their share."""
    if name == "bool":
        return rng.random() < 0.5
    if name == "byte":
        return bytes([rng.randrange(256)])
    if name.startswith("float"):
        value = rng.choice([0.0, -0.0, 1.5, float("inf"), rng.uniform(-1e6, 1e6)])
        return struct.unpack("f", struct.pack("f", value))[0] if name == "float32" else value
    low, high = INTEGERS[name]
    return rng.choice([low, high, 0, 1, rng.randint(low, high)])
