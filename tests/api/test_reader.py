"""`idlc.reader`: what it reads is what `deserialize` reads, or nothing."""

import random
import re
import tracemalloc
from contextlib import suppress

import pytest

import idlc
from idlc.model import catalog
from idlc.runtime.names import slot_name
from idlc.runtime.typeinfo import structure_of
from tests.runtime.test_hostile import mutated
from tests.support import generated, values
from tests.support.layouts import random_package
from tests.support.rounds import rounds, some

pytestmark = pytest.mark.usefixtures("standard")

INDEXES = ["[*]", "[0]", "[-1]", "[1]", "[2]", "[-3]"]
MOST = 40


def paths_of(structure, rng, prefix=""):
    """Yield paths to all fields of a structure, with two ways into each list."""
    for field in structure.fields:
        path = prefix + field.name
        yield path
        places = [path]
        if field.is_list:
            most = field.size or field.bound or 3
            possible = [text for text in INDEXES if text == "[*]" or abs(int(text[1:-1])) < most]
            places = [path + index for index in rng.sample(possible, min(2, len(possible)))]
            yield from places
        if field.nested:
            for place in places:
                yield from paths_of(field.nested, rng, f"{place}.")


def some_paths(cls, rng):
    paths = list(paths_of(structure_of(cls), rng))
    return rng.sample(paths, min(len(paths), MOST))


def value_at(value, path):
    """Return what is at a path of a message, and raise IndexError if nothing is."""
    name, index, rest = re.fullmatch(r"(\w+)(?:\[([^]]+)\])?\.?(.*)", path).groups()
    value = getattr(value, slot_name(name))
    if index is None:
        return value_at(value, rest) if rest else value
    elements = value.tolist() if hasattr(value, "tolist") else value
    if index == "*":
        return [value_at(element, rest) if rest else element for element in elements]
    element = elements[int(index)]
    return value_at(element, rest) if rest else element


def plain(value):
    """Return a value so that those that are equal have one `repr`, NaN among them."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list):
        return list(map(plain, value))
    if hasattr(value, "__slots__"):
        return {name: plain(getattr(value, name)) for name in type(value).__slots__}
    return value


def readable(message, paths):
    """Return the paths that lead to a value of a message."""
    there = []
    for path in paths:
        with suppress(IndexError):
            value_at(message, path)
            there.append(path)
    return there


def check_broken(cls, buffer, readers, error):
    """Compare readers with `deserialize`, on a buffer that may be broken."""
    try:
        whole = cls.deserialize(buffer)
    except error:
        whole = None
    for path, reader in readers.items():
        expected = whole is not None and path in readable(whole, [path])
        try:
            value = reader(buffer)
        except error:
            assert not expected, (path, buffer)
        else:  # what it passes over may be broken
            assert whole is None or expected, (path, buffer)
            assert whole is None or repr(plain(value)) == repr(plain(value_at(whole, path)))


def check(cls, rng, error):
    """Compare readers of one path and of many with `deserialize`, on whole and broken buffers."""
    message = values.randomized(cls(), rng)
    paths = some_paths(cls, rng)
    there = readable(message, paths)
    if not there:
        return
    read_all = idlc.reader(cls, *there)
    singles = {path: idlc.reader(cls, path) for path in rng.sample(paths, min(8, len(paths)))}
    for order in ("little", "big"):
        raw = message.serialize(byteorder=order)
        for buffer in (raw, memoryview(bytearray(raw) + b"\0" * 7)):
            read = read_all(buffer) if len(there) > 1 else (read_all(buffer),)
            assert repr(plain(list(read))) == repr(plain([value_at(message, p) for p in there]))
        for path, reader in singles.items():
            if path in there:
                assert repr(plain(reader(raw))) == repr(plain(value_at(message, path)))
            else:
                with pytest.raises(error, match="no such element"):
                    reader(raw)
        for _ in range(rounds(12)):
            check_broken(cls, mutated(raw, rng), singles, error)


@pytest.mark.rounds
@pytest.mark.parametrize("name", catalog.interfaces(), ids=str)
def test_each_path_of_the_catalogue_is_read_as_deserialize_reads_it(name):
    rng = random.Random(str(name))
    for full_name in generated.structures(name):
        error = __import__(f"{name.package}._idlc")._idlc.DecodeError
        check(generated.class_of(full_name), rng, error)


@pytest.mark.parametrize("seed", some(range(90)))
def test_each_path_of_random_types_is_read_as_deserialize_reads_it(tmp_path, seed):
    rng = random.Random(seed)
    package = f"r{seed}_msgs"
    files, shapes = random_package(rng)
    generated.write_package(tmp_path, package, files)
    with generated.importable(tmp_path):
        error = __import__(f"{package}._idlc")._idlc.DecodeError
        for name in shapes:
            check(generated.class_of(f"{package}/msg/{name}"), rng, error)


@pytest.fixture
def imu(standard):
    message = generated.class_of("sensor_msgs/msg/Imu")()
    message.header.frame_id = "imu"
    message.orientation_covariance = range(9)
    return message


PROBLEMS = {
    "header.stap.sec": "std_msgs/msg/Header has no field `stap`; did you mean `stamp`?",
    "orientation_covariance[9]": "has at most 9 elements",
    "orientation_covariance[-10]": "has at most 9 elements",
    "orientation_covariance.x": "is a list: write `orientation_covariance[0]` or `",
    "header[0]": "`header` is not a list",
    "header.frame_id.x": "there is no `x` in a string",
    "": "is not a path",
    "header..stamp": "is not a path",
    "header.stamp]": "is not a path",
    "__class__": "has no field",
    "header.stamp);import os": "is not a path",
}


@pytest.mark.parametrize("path", PROBLEMS)
def test_a_wrong_path_is_refused_when_the_reader_is_made(imu, path):
    with pytest.raises(ValueError, match=re.escape(PROBLEMS[path])):
        idlc.reader(type(imu), "header.stamp", path)


def test_all_wrong_paths_are_named_at_once(imu):
    with pytest.raises(ValueError, match=r"(?s)no field `a`.*no field `b`"):
        idlc.reader(type(imu), "a", "header.b")
    with pytest.raises(ValueError, match="needs the path"):
        idlc.reader(type(imu))


def test_times_can_be_nanoseconds(imu):
    imu.header.stamp.sec, imu.header.stamp.nanosec = -1, 999_999_999
    read = idlc.reader(type(imu), "header.stamp", "header.frame_id", nanoseconds=True)
    for order in ("little", "big"):
        assert read(imu.serialize(byteorder=order)) == (-1, "imu")


def test_numbers_are_views_that_cannot_be_written(imu):
    raw = bytearray(imu.serialize())
    view = idlc.reader(type(imu), "orientation_covariance")(raw)
    assert view.tolist() == list(range(9))
    with pytest.raises(ValueError, match="read-only"):
        view[0] = 1
    raw[-8:] = raw[:8]
    raw[16 + 4 + 4 + 32 : 16 + 4 + 4 + 40] = bytes(8)
    assert view[0] == 0


def test_what_middlewares_take_is_read_as_deserialize_reads_it(imu):
    cls = type(imu)
    broken = imu.serialize().replace(b"imu\0", b"im\xffu")
    read = idlc.reader(cls, "header.frame_id", "header", "orientation_covariance")
    frame, header, covariance = read(broken)
    assert frame == header.frame_id == cls.deserialize(broken).header.frame_id
    assert covariance.tolist() == list(range(9))
    assert not covariance.flags.writeable
    # what is behind the text, and what nobody wants, is not judged
    assert idlc.reader(cls, "header.frame_id")(imu.serialize()[:20]) == "imu"


def test_readers_are_kept_and_not_without_end(imu):
    from idlc.api import reader

    assert idlc.reader(type(imu), "header") is idlc.reader(type(imu), "header")
    assert reader.field_reader.cache_info().maxsize == reader.MOST


LISTS = {
    "msg/Empty.msg": "",
    "msg/Loose.msg": "bool b\nfloat64 x\n",
    "msg/Pair.msg": "string k\nstring v\n",
    "msg/Lists.msg": "Empty[] e\nLoose[] l\nPair[] p\nstring[] s\nwstring[] w\nint64[] n\n"
    "bool[] b\nuint8 last\n",
}
WAYS = ["e[*]", "e[3000000000]", "l[*].x", "l[3000000000]", "l[-1].b", "p[*].k", "p[7].v", "s",
        "s[-1]", "w[*]", "w[4000000000]", "n", "n[-1]", "n[*]", "b", "last"]  # fmt: skip


@pytest.mark.parametrize("path", WAYS)
def test_no_count_takes_time_or_memory_that_the_buffer_does_not_hold(tmp_path, path):
    generated.write_package(tmp_path, "lists_msgs", LISTS)
    with generated.importable(tmp_path):
        cls = generated.class_of("lists_msgs/msg/Lists")
        error = __import__("lists_msgs._idlc")._idlc.DecodeError
        read = idlc.reader(cls, path)
        raw = bytes(cls().serialize())
        with suppress(error):
            read(raw[:4])  # imports what broken buffers need
        tracemalloc.start()
        try:
            for at in range(4, len(raw) - 4, 4):
                for count in (b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80"):
                    with suppress(error):
                        read(raw[:at] + count + raw[at + 4 :])
            assert tracemalloc.get_traced_memory()[1] < 1 << 20
        finally:
            tracemalloc.stop()


PATCHES = {
    "header.stamp.sec": 5,
    "orientation": {"x": 1.0, "y": 2.0, "z": 3.0, "w": 4},
    "angular_velocity_covariance": tuple(range(9)),
    "angular_velocity_covariance[-1]": 0.5,
    "header.stamp": 7_000_000_008,
}


def test_a_patch_is_what_decoding_and_encoding_gives(imu):
    cls = type(imu)
    for order in ("little", "big"):
        raw = imu.serialize(byteorder=order) + b"after"
        patched = cls.deserialize(idlc.patch(cls, raw, PATCHES))
        expected = cls.deserialize(raw)
        stamp, turn = expected.header.stamp, expected.orientation
        stamp.sec, stamp.nanosec = 7, 8
        turn.x, turn.y, turn.z, turn.w = 1.0, 2.0, 3.0, 4.0
        expected.angular_velocity_covariance = [*range(8), 0.5]
        assert patched == expected
        changed = idlc.patch(cls, memoryview(raw), {"header.stamp": stamp, "orientation": turn})
        assert changed == idlc.patch(
            cls, bytearray(raw), {"header.stamp": 7_000_000_008, "orientation": turn}
        )
        assert changed[-5:] == b"after"


REFUSED = [
    ("header.frame_id", "x", "no fixed size"),
    ("header", {}, "no fixed size"),
    ("orientation_covariance[*]", 1, "not one place"),
    ("header.stamp.sec", 1 << 31, "header.stamp.sec"),
    ("header.stamp.sec", 1.5, "header.stamp.sec"),
    ("header.stamp", {"sec": 1}, "a dictionary of sec, nanosec"),
    ("header.stamp", 1 << 80, "header.stamp.sec"),
    ("header.stamp", True, "must be a builtin_interfaces/msg/Time"),
    ("orientation_covariance", [1.0], "needs 9"),
    ("orientation.x", "1", "orientation.x"),
    ("orientation.x", None, "orientation.x"),
    ("nothing", 1, "no field"),
]


@pytest.mark.parametrize(("path", "value", "words"), REFUSED)
def test_a_patch_of_what_cannot_be_is_refused(imu, path, value, words):
    with pytest.raises(ValueError, match=words):
        idlc.patch(type(imu), imu.serialize(), {path: value})


def test_a_patch_never_grows_a_message(imu):
    from sensor_msgs._idlc import DecodeError

    cls, raw = type(imu), imu.serialize()
    for size in range(len(raw)):
        with pytest.raises(DecodeError):
            idlc.patch(cls, raw[:size], {"linear_acceleration_covariance": [1.0] * 9})
