"""Structures of strings, of which many are written and read at once."""

import random

import pytest

from tests.support import generated, plain_cdr

FILES = {
    "msg/Pair.msg": "string key\nstring value\n",
    "msg/One.msg": "string text\n",
    "msg/Note.msg": "uint8 level\nstring name\nPair[] pairs\nuint32 number\nstring last\n",
    "msg/Notes.msg": "uint8 before\nNote[] notes\nOne[] ones\nPair[<=9] some\nPair[6] six\n"
    "Pair[<=2] few\nstring text\nuint8 after\n",
    "msg/Log.msg": "string text\nfloat32[] many\nint16[3] three\n",
}
PAIR = [("key", "string"), ("value", "string")]
ONE = [("text", "string")]
NOTE = [
    ("level", "uint8"),
    ("name", "string"),
    ("pairs", (PAIR, None)),
    ("number", "uint32"),
    ("last", "string"),
]
NOTES = [
    ("before", "uint8"),
    ("notes", (NOTE, None)),
    ("ones", (ONE, None)),
    ("some", (PAIR, None)),
    ("six", (PAIR, 6)),
    ("few", (PAIR, None)),
    ("text", "string"),
    ("after", "uint8"),
]
#: Strings around every limit that the codecs know, and what they must not confuse.
ASCII = ["", "a", "ab", "abc", "abcd", "\0", "\0\0\0\0", "x" * 126, "\x7f" * 9]
ALL = [*ASCII, "é", "漢字", "😀", "x" * 127, "x" * 128, "é" * 70, "x" * 1025, "é" * 600]


@pytest.fixture(scope="module")
def notes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("texts")
    generated.write_package(folder, "texts_msgs", FILES)
    with generated.importable(folder):
        yield generated.class_of("texts_msgs/msg/Notes")


def plain(rng, strings, shape=NOTES):
    """Return random values of a shape, with numbers whose bytes are ASCII."""
    found = {}
    for name, type_ in shape:
        if isinstance(type_, tuple):
            element, size = type_
            most = {"some": 9, "few": 2}.get(name, 12)
            count = rng.randrange(most + 1) if size is None else size
            found[name] = [plain(rng, strings, element) for _ in range(count)]
        else:
            found[name] = rng.choice(strings) if type_ == "string" else rng.randrange(128)
    return found


@pytest.mark.parametrize("strings", [ASCII, ALL], ids=["ascii", "all"])
@pytest.mark.parametrize("order", ["little", "big"])
def test_they_are_written_and_read_as_cdr_says(notes, order, strings):
    rng = random.Random(order)
    for _ in range(150):
        values = plain(rng, strings)
        message = notes.from_dict(values)
        raw = message.serialize(byteorder=order)
        assert raw == plain_cdr.encode(NOTES, values, order)
        for buffer in (raw, bytearray(raw), memoryview(raw), raw + b"\0", raw + b"\xff\xff"):
            assert notes.deserialize(buffer).to_dict() == values
            assert notes.deserialize(buffer, copy=False).to_dict() == values


@pytest.mark.usefixtures("notes")
@pytest.mark.parametrize("order", ["little", "big"])
def test_numbers_after_text_that_does_not_end_are_read(order):
    """Middlewares accept such text, and the fast codecs do not: CarefulReader reads the message."""
    message = generated.class_of("texts_msgs/msg/Log")(
        text="text!", many=[1.5, -2.0], three=[1, -2, 3]
    )
    raw = message.serialize(byteorder=order).replace(b"text!\0", b"text!!")
    again = type(message).deserialize(raw)
    assert again.text == "text!!"
    message.text = again.text
    assert again == message
    assert type(again.many) is type(message.many)


def test_a_large_message_is_read_like_a_small_one(notes):
    values = plain(random.Random(1), ASCII)
    values["notes"] = [dict(values["notes"][0], name="long" * 25)] * 2000
    raw = notes.from_dict(values).serialize()
    assert len(raw) > 1 << 17
    assert notes.deserialize(raw).to_dict() == values


@pytest.mark.parametrize("strings", [ASCII, ALL], ids=["ascii", "all"])
def test_every_shorter_buffer_is_refused(notes, strings):
    rng = random.Random(2)
    error = __import__("texts_msgs._idlc")._idlc.DecodeError
    for _ in range(3):
        raw = notes.from_dict(plain(rng, strings)).serialize()
        for size in {*range(40), *rng.sample(range(len(raw)), 300), len(raw) - 1}:
            with pytest.raises(error):
                notes.deserialize(raw[:size])


@pytest.mark.parametrize("wrong", [None, 5, b"ab", ["a"], "\ud800", "\ud800" * 200])
@pytest.mark.parametrize("place", ["notes", "some", "six", "few"])
def test_what_is_no_string_is_named(notes, place, wrong):
    message = notes.from_dict(plain(random.Random(3), ASCII))
    if place == "notes":
        message.notes[0].pairs[0].value = wrong
        path = r"notes\[0\]\.pairs\[0\]\.value"
    else:
        getattr(message, place)[0].value = wrong
        path = rf"{place}\[0\]\.value"
    with pytest.raises(ValueError, match=f"{path}: must be a str"):
        message.serialize()
