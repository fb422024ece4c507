"""Conversions of all pairs of primitives, in all shapes, against an oracle; and bytes that stay."""

import struct
from itertools import product

import pytest

import idlc
from idlc.api.upgrade import UpgradeError
from tests.tasks.test_upgrade import write_package

#: The range of each type's integers, or the bits of its mantissa.
INTEGERS = {
    "bool": (0, 1),
    **dict.fromkeys(("byte", "char", "uint8"), (0, 255)),
    **{f"uint{n}": (0, 2**n - 1) for n in (16, 32, 64)},
    **{f"int{n}": (-(2 ** (n - 1)), 2 ** (n - 1) - 1) for n in (8, 16, 32, 64)},
}
MANTISSA = {"float32": 24, "float64": 53}
OCTETS = {"byte", "char", "uint8"}
SMALL = [*range(256), *range(-128, 0)]
#: A field's type before and after, and the list of values that one value becomes in both.
SHAPES = {
    "": ("{}", "{}"),
    "array": ("{}[2]", "{}[2]"),
    "sequence": ("{}[]", "{}[]"),
    "bounded": ("{}[<=2]", "{}[<=3]"),
    "wrapped": ("{}", "{}[1]"),
    "loosened": ("{}[2]", "{}[]"),
}


def fits(old, new):
    """Return whether each value of one type is one of the other, and of the same kind."""
    if old == new or {old, new} <= OCTETS:
        return True
    if new in ("bool", "byte"):
        return False
    if old in MANTISSA:
        return MANTISSA.get(new, 0) > MANTISSA[old]
    low, high = INTEGERS[old]
    if new in MANTISSA:
        return old != "bool" and high < 2 ** MANTISSA[new]
    return INTEGERS[new][0] <= low and high <= INTEGERS[new][1]


def values_of(name):
    if name in MANTISSA:
        return [-2.5, 0.0, 0.5, *map(float, SMALL[:64])]
    low, high = INTEGERS[name]
    return [value for value in (*SMALL, low, high) if low <= value <= high]


def as_written(name, value):
    if name == "byte":
        return bytes([value])
    return bool(value) if name == "bool" else value


def plain(value):
    """Return a value of messages or columns as numbers in lists."""
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    if isinstance(value, (list, tuple)) or hasattr(value, "tolist"):
        return [plain(part) for part in value] if getattr(value, "shape", None) != () else value
    return value


PAIRS = [*product([*INTEGERS, *MANTISSA], repeat=2)]


@pytest.mark.parametrize("shape", SHAPES)
def test_every_pair_of_primitives(shape, tmp_path):
    """Objects, bytes and columns agree with the oracle, and what may not fit needs a rule."""
    before, after = SHAPES[shape]
    good = [pair for pair in PAIRS if fits(*pair)]
    bad = [pair for pair in PAIRS if not fits(*pair)]

    def package(folder, side, form, pairs):
        lines = (f"{form.format(pair[side])} {pair[0]}_{pair[1]}\n" for pair in pairs)
        return idlc.load(write_package(tmp_path / folder, {"V": "".join(lines)}, "pair_msgs")).V

    with pytest.raises(UpgradeError) as refused:
        idlc.upgrade(package("a", 0, before, bad), package("b", 1, after, bad))
    assert len(refused.value.findings) == len(bad)

    old, new = package("c", 0, before, good), package("d", 1, after, good)
    upgrade = idlc.upgrade(old, new)
    many = "[" in before
    every = {pair: values_of(pair[0]) for pair in good}
    messages, expected = [], []
    for at in range(max(map(len, every.values()))):
        message, right = old(), {}
        for (name, other), values in every.items():
            pair = [values[at % len(values)], values[(at + 1) % len(values)]]
            written = [as_written(name, value) for value in pair]
            field = f"{name}_{other}"
            setattr(message, field, written if many else written[0])
            right[field] = pair if many else [pair[0]] if shape == "wrapped" else pair[0]
        messages.append(message)
        expected.append(right)
    payloads = [message.serialize() for message in messages]
    columns = upgrade.columns(payloads)
    made = upgrade.many(payloads)
    for at, (message, right) in enumerate(zip(messages, expected, strict=True)):
        for result in (upgrade.message(message), new.deserialize(made[at])):
            seen = {field: plain(getattr(result, field)) for field in right}
            assert seen == right
        assert {field: plain(columns[field][at]) for field in right} == right
        big = upgrade.payload(message.serialize(byteorder="big")) if at == 7 else made[at]
        assert big == made[at]


#: Bytes that no value of Python keeps.
LATIN, TRUE, SIGNALLING = b"\x05\0\0\0caf\xe9\0", b"\x02", bytes.fromhex("0100a07f")
WIDE = struct.pack("<II", 1, 0xD800)


@pytest.mark.parametrize(
    ("fields", "raw"),
    [
        ("string s", LATIN),
        ("string<=9 s", b"\x01\0\0\0\xff"),  # without the zero at its end
        ("string s", bytes(4)),
        ("bool b", TRUE),
        ("float32 f", SIGNALLING),
        ("float64 f", bytes.fromhex("010000000000f47f")),
        ("wstring w", WIDE),
        ("string[] s", struct.pack("<I", 1) + LATIN),
        ("bool[2] b", b"\x02\x03"),
        ("bool[<=3] b", struct.pack("<I", 2) + b"\x02\xff"),
        ("float32[2] f", SIGNALLING * 2),
        ("In[] i", struct.pack("<I", 1) + TRUE + bytes(3) + LATIN + bytes(3) + SIGNALLING),
        ("Nothing n", b"\x07"),
    ],
)
@pytest.mark.parametrize("inside", [False, True])
def test_what_does_not_change_keeps_its_bytes(fields, raw, inside, tmp_path):
    inner = {"In": "bool b\nstring s\nfloat32 f\n", "Nothing": ""}
    texts = []
    for more in ("uint8 end", "uint8 end\nuint8 extra 9"):
        top = f"{fields}\n{more}\n"
        texts.append({**inner, **({"Part": top, "V": "Part part\n"} if inside else {"V": top})})
    old, new = (
        idlc.load(write_package(tmp_path / side, text, "kept_msgs")).V
        for side, text in zip("ab", texts, strict=True)
    )
    upgrade = idlc.upgrade(old, new)
    # a float64 aligns to the header's end
    data = b"\0\1\0\0" + raw + b"\x2a"
    assert upgrade.payload(data) == data + b"\x09"


def test_rules_do_not_change_the_bytes_of_other_fields(tmp_path):
    texts = [
        {"V": "string s\nuint8 n\nbool b\nIn[] i\n", "In": "string s\nuint8 n\n"},
        {"V": "string s\nuint8 m\nbool b\nIn[] i\n", "In": "string s\nuint8 m\n"},
    ]
    old, new = (
        idlc.load(write_package(tmp_path / side, text, "ruled_msgs"))
        for side, text in zip("ab", texts, strict=True)
    )
    rules = []
    for name in ("V", "In"):
        keys = (
            str((f"ruled_msgs/msg/{name}", idlc.upgrade(kind, kind).plan.old.key.hash))
            for kind in (getattr(old, name), getattr(new, name))
        )
        rules.append(tmp_path / f"{name}.py")
        text = "OLD = {}\nNEW = {}\n\n\ndef m(old):\n    return old.n + len(old.s)\n"
        rules[-1].write_text(text.format(*keys))
    upgrade = idlc.upgrade(old.V, new.V, rules)

    def payload(first, second):
        inner = struct.pack("<I", 1) + LATIN + bytes([second])
        return b"\0\1\0\0" + LATIN + bytes([first, 2]) + b"\0" + inner

    assert upgrade.payload(payload(3, 4)) == payload(7, 8)
