"""Buffers that somebody else made: a value or DecodeError, in memory bounded by the buffer."""

import random
import tracemalloc
from contextlib import suppress

import pytest

from idlc.model import catalog
from tests.support import generated, values
from tests.support.rounds import rounds

pytestmark = pytest.mark.usefixtures("standard")

INTERFACES = catalog.interfaces()
HUGE = [b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\x00\x00\x00\x80", b"\xff\xff\0\0", b"\0\0\0\1"]
#: Bytes of memory that one byte of a buffer may cost: an object for each byte.
PER_BYTE = 400
BULKY = [
    "diagnostic_msgs/msg/DiagnosticArray",
    "sensor_msgs/msg/PointCloud2",
    "nav_msgs/msg/Path",
    "idlc_fixtures/msg/Sequences",
    "idlc_fixtures/msg/WithDeps",
]


def mutated(raw, rng):
    raw = bytearray(raw)
    for _ in range(rng.choice([1, 1, 2, 5])):
        kind = rng.randrange(4)
        at = rng.randrange(4, len(raw)) if len(raw) > 4 else 0
        if kind == 0 and raw:
            raw[at] = rng.randrange(256)
        elif kind == 1:
            del raw[at:]
        elif kind == 2:
            at -= at % 4
            raw[at : at + 4] = rng.choice(HUGE)
        else:
            raw[at:at] = bytes(rng.randrange(256) for _ in range(rng.randrange(1, 9)))
    return bytes(raw)


@pytest.mark.rounds
@pytest.mark.parametrize("name", INTERFACES, ids=str)
def test_mutated_buffers_end_in_a_value_or_in_decode_error(name):
    rng = random.Random(str(name))
    for full_name in generated.structures(name):
        cls = generated.class_of(full_name)
        message = values.randomized(cls(), rng)
        error = __import__(f"{name.package}._idlc")._idlc.DecodeError
        for order in ("little", "big"):
            raw = message.serialize(byteorder=order)
            for _ in range(rounds(20)):
                buffer = mutated(raw, rng)
                try:
                    found, offset = cls.deserialize(buffer), 0
                except error as caught:
                    found, offset = cls(), caught.offset
                assert type(found) is cls
                assert 0 <= offset <= len(buffer) + 16


#: Structures that are much larger than what they take on the wire, or than what is there.
INFLATED = {
    "msg/Empty.msg": "",
    "msg/Thousand.msg": "Empty[1000] e\n",
    "msg/Million.msg": "Thousand[1000] e\n",
    "msg/Billion.msg": "Million[1000] e\n",
    "msg/Counted.msg": "Empty[] e\n",
    "msg/Millions.msg": "Million[] e\n",
    "msg/Counts.msg": "Counted[1000000] e\n",
    "msg/Texts.msg": "string[1000000] t\nwstring[1000000] w\n",
    "msg/Pair.msg": "string k\nstring v\n",
    "msg/Pairs.msg": "Pair[1000000] p\n",
    "msg/Numbers.msg": "float64[1000000] n\nbool[1000000] b\n",
    "msg/Many.msg": "string s\nNumbers[1000] n\nTexts[1000] t\nPairs[1000] p\n",
    "msg/Amid.msg": "Counted c\nMany[] m\nBillion b\n",
    "msg/Outer.msg": "float64 x\nPair[] pairs\n",
    "msg/Outers.msg": "Outer[] o\n",
}


DEPTH = 20
CHAINS = {
    "msg/Deep1.msg": "bool b\n",
    **{f"msg/Deep{n}.msg": f"Deep{n - 1} d\n" for n in range(2, DEPTH + 1)},
    "msg/Chains.msg": f"Deep{DEPTH}[] d\n",
}


@pytest.fixture(scope="module")
def inflated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inflated")
    generated.write_package(folder, "inflated_msgs", INFLATED | CHAINS)
    with generated.importable(folder):
        cls = generated.class_of("inflated_msgs/msg/Pair")
        with suppress(ValueError):  # loads what explains an error, and numpy
            cls.deserialize(b"")
        cls.to_columns([cls().serialize()])
        yield folder


READERS = {
    "deserialize": lambda cls, raw: cls.deserialize(raw),
    "of a view": lambda cls, raw: cls.deserialize(memoryview(raw)),
    "copy=False": lambda cls, raw: cls.deserialize(raw, copy=False),
    "deserialize_many": lambda cls, raw: cls.deserialize_many([raw]),
    "to_columns": lambda cls, raw: cls.to_columns([raw]),
    "ragged": lambda cls, raw: cls.to_columns([raw] * 20),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("path", INFLATED)
def test_no_structure_takes_what_the_buffer_does_not_hold(inflated, path, reader):
    name = path.removeprefix("msg/").removesuffix(".msg")
    cls = generated.class_of(f"inflated_msgs/msg/{name}")
    error = __import__("inflated_msgs._idlc")._idlc.DecodeError
    for size in (8, 800):
        for body in (bytes(size), b"\xff" * size, b"\1\0\0\0" * (size // 4)):
            for head in (b"\0\1\0\0", b"\0\0\0\0", b"\0\1\0\0" + size.to_bytes(4, "little")):
                raw = head + body
                with suppress(error):
                    READERS[reader](cls, raw)  # makes the codec
                tracemalloc.start()
                with suppress(error):
                    READERS[reader](cls, raw)
                peak = tracemalloc.get_traced_memory()[1]
                tracemalloc.stop()
                assert peak < PER_BYTE * len(raw) + 30_000, (len(raw), peak)


def test_the_largest_value_is_an_object_per_byte_and_level(inflated):
    """No message holds more for its bytes than objects that only hold one another."""
    cls = generated.class_of("inflated_msgs/msg/Chains")
    raw = b"\0\1\0\0" + (500).to_bytes(4, "little") + b"\1" * 500
    cls.deserialize(raw)
    tracemalloc.start()
    message = cls.deserialize(raw)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(message.d) == 500
    assert peak < 60 * DEPTH * len(raw) + 30_000


def test_what_prepares_for_many_texts_is_done_once(tmp_path, monkeypatch):
    """It goes over all of the buffer, so doing it for each element would be quadratic."""
    files = {path: INFLATED[f"msg/{path}.msg"] for path in ("Pair", "Pairs", "Outer", "Outers")}
    files = {f"msg/{name}.msg": text for name, text in files.items()}
    generated.write_package(tmp_path, "texts_msgs", {**files, "msg/Plain.msg": "Pair[] pairs\n"})
    with generated.importable(tmp_path):
        module = __import__("texts_msgs._idlc")._idlc
        make, calls = module.strings_reader, []

        def counted(*arguments):
            prepare = make(*arguments)
            return lambda *places: calls.append(1) or prepare(*places)

        monkeypatch.setattr(module, "strings_reader", counted)
        outer, pair = (generated.class_of(f"texts_msgs/msg/{one}") for one in ("Outer", "Pair"))
        for name, items in (("Plain", [pair()] * 100), ("Outers", [outer(1.0, [pair()])] * 100)):
            message = generated.class_of(f"texts_msgs/msg/{name}")(items)
            assert type(message).deserialize(message.serialize()) == message
    assert len(calls) == 1


def test_columns_are_not_made_wide_by_one_text(inflated):
    cls = generated.class_of("inflated_msgs/msg/Pair")
    raws = [cls("x" * 1_000_000).serialize(), *[cls("x").serialize()] * 1000]
    columns = cls.to_columns(raws)
    with pytest.raises(ValueError, match=r"1,00.* bytes for 1,0.* bytes of columns"):
        columns.structured()
    assert columns["k"][0] == "x" * 1_000_000
    assert columns[:20].structured()["k"].dtype == "S1000000"


def test_memory_is_bounded_by_the_buffer():
    rng = random.Random(1)
    for name in BULKY:
        cls = generated.class_of(name)
        raw = values.randomized(cls(), rng).serialize()
        with pytest.raises(ValueError, match="left"):  # loads what explains an error
            cls.deserialize(raw[:6])
        for _ in range(300):
            buffer = mutated(raw, rng)
            tracemalloc.start()
            with suppress(ValueError):
                cls.deserialize(buffer)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            assert peak < PER_BYTE * len(buffer) + 100_000


@pytest.mark.parametrize(
    ("name", "raw", "path", "offset", "words"),
    [
        ("std_msgs/msg/String", "00010000 ffffffff 00", "data", 8, "4294967295 bytes of text"),
        ("std_msgs/msg/String", "00010000 05000000 6162", "data", 8, "5 bytes of text"),
        ("std_msgs/msg/String", "00010000 0500", "data", 4, "number of bytes of text"),
        ("std_msgs/msg/String", "0001", "", 0, "encapsulation header needs 4 bytes"),
        ("std_msgs/msg/String", "", "", 0, "encapsulation header needs 4 bytes"),
        ("std_msgs/msg/String", "00030000 01000000 00", "", 0, "unknown encapsulation 0003"),
        ("std_msgs/msg/String", "01010000 01000000 00", "", 0, "unknown encapsulation 0101"),
        ("std_msgs/msg/Int64", "00010000 0102", "data", 4, "8 bytes expected"),
        ("std_msgs/msg/Empty", "00010000", "std_msgs/msg/Empty", 4, "1 byte expected"),
        ("sensor_msgs/msg/JointState", "00010000" + "00" * 8 + "01000000 00 000000 ffffffff",
         "name", 24, "4294967295 elements"),
        ("nav_msgs/msg/Path", "00000000" + "00" * 8 + "00000001 00 000000 ffffffff",
         "poses", 24, "4294967295 elements"),
        ("geometry_msgs/msg/PoseStamped", "00010000" + "00" * 8 + "01000000 00 000000" + "00" * 12,
         "pose.position.y", 28, "8 bytes expected"),
        ("idlc_fixtures/msg/BoundedSequences", "00010000 04000000 00000000", "bools", 4,
         "4 elements where at most 3 are allowed"),
    ],
)  # fmt: skip
def test_an_error_names_the_field_and_the_byte(name, raw, path, offset, words):
    cls = generated.class_of(name)
    with pytest.raises(ValueError, match=words) as caught:
        cls.deserialize(bytes.fromhex(raw))
    assert type(caught.value).__name__ == "DecodeError"
    assert (caught.value.path, caught.value.offset) == (path, offset)
    assert str(caught.value).startswith(f"{path}: " if path else words.split()[0][:3]) or not path


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        ("00010000 00000000", ""),
        ("00010000 01000000 00", ""),
        ("00010000 02000000 6100", "a"),
        ("00010000 02000000 6162", "ab"),
        ("00010000 04000000 61006200", "a\0b"),
        ("00010000 03000000 61ff00", "a\ufffd"),
        ("00010000 04000000 eda08000", "\ufffd\ufffd\ufffd"),
        ("00000000 00000002 6100 ffffff", "a"),
        ("000100ff 02000000 6100", "a"),
    ],
)
def test_what_middlewares_take_is_taken(raw, text):
    string = generated.class_of("std_msgs/msg/String")
    for buffer in (bytes.fromhex(raw), bytearray.fromhex(raw), memoryview(bytes.fromhex(raw))):
        assert string.deserialize(buffer).data == text


@pytest.mark.parametrize(
    ("units", "text"),
    [
        ("3dd80000 00de0000", "\U0001f600"),
        ("3dd80000", "\ufffd"),
        ("00de0000 41000000", "\ufffdA"),
        ("00000000", "\0"),
        ("00000100", None),
        ("ffffffff", None),
    ],
)
def test_wide_text_is_utf16_in_words(units, text):
    cls = generated.class_of("idlc_fixtures/msg/AllPrimitives")
    body = cls().serialize()[:-4]
    count = len(bytes.fromhex(units)) // 4
    raw = body + count.to_bytes(4, "little") + bytes.fromhex(units)
    if text is None:
        with pytest.raises(ValueError, match="UTF-16") as caught:
            cls.deserialize(raw)
        assert caught.value.path == "a_wstring"
    else:
        assert cls.deserialize(raw).a_wstring == text
