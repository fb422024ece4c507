"""Generated classes against what real rosidl made of the same interfaces (golden/rosidl)."""

import json

import pytest

from tests.support import generated, values
from tests.support.paths import GOLDEN

FOLDER = GOLDEN / "rosidl"
CLASSES = [json.loads(line) for line in (FOLDER / "classes.jsonl").open(encoding="utf-8")]
DUMPS = [json.loads(line) for line in (FOLDER / "cdr.jsonl").open(encoding="utf-8")]
EACH = pytest.mark.parametrize("fact", CLASSES, ids=[fact["name"] for fact in CLASSES])


def test_every_structure_of_the_recorded_packages_is_there():
    kinds = {fact["name"].split("/")[1] for fact in CLASSES}
    assert kinds == {"msg", "srv", "action"}
    assert len(CLASSES) > 40


@EACH
@pytest.mark.usefixtures("standard")
def test_a_class_looks_as_rosidls(fact):
    cls = generated.class_of(fact["name"])
    message = cls()
    assert f"{cls.__module__}.{cls.__name__}" == fact["python_class"]
    assert cls.get_fields_and_field_types() == fact["fields_and_field_types"]
    assert [*cls.__slots__, "_check_fields"] == fact["slots"]
    assert repr(message) == fact["default_repr"]
    for slot, (name, kind) in zip(cls.__slots__, fact["default_python_types"].items(), strict=True):
        assert python_type(getattr(message, slot)) == kind, name


def python_type(value):
    """Return the type in the words of the recording."""
    kind = f"{type(value).__module__}.{type(value).__qualname__}"
    if kind == "numpy.ndarray":
        return f"{kind}[{value.dtype}]"
    return f"{kind}[{value.typecode}]" if kind == "array.array" else kind


def plain(value):
    """Return a value as the recording writes it."""
    if isinstance(value, bytes):
        return value[0]
    if hasattr(value, "to_dict"):
        return {key: plain(getattr(value, "_" + key)) for key in value._fields_and_field_types}
    if hasattr(value, "tolist"):
        return value.tolist()
    return [plain(element) for element in value] if isinstance(value, list) else value


@EACH
@pytest.mark.usefixtures("standard")
def test_defaults_and_constants_are_rosidls(fact):
    cls = generated.class_of(fact["name"])
    message = cls()
    assert plain(message) == fact["default_values"]
    assert message.to_dict() == fact["default_values"]
    for name, value in fact["constants"].items():
        assert plain(getattr(cls, name)) == value
        assert plain(getattr(message, name)) == value
        assert type(getattr(cls, name)).__name__ == fact["constant_python_types"][name]
        for owner in (cls, message):
            with pytest.raises(AttributeError):
                setattr(owner, name, value)
    for name, value in fact["default_constants"].items():
        found = getattr(cls, name)
        assert plain(found) == value
        assert plain(getattr(message, name)) == value
        if isinstance(value, list):
            assert getattr(cls, name) is not found
    assert not [
        n for n in dir(cls) if n.endswith("__DEFAULT") and n not in fact["default_constants"]
    ]


@EACH
@pytest.mark.usefixtures("standard")
def test_bytes_are_equal_both_ways(fact):
    cls = generated.class_of(fact["name"])
    assert cls().serialize().hex() == fact["default_cdr"]
    assert cls.deserialize(bytes.fromhex(fact["default_cdr"])) == cls()
    for sample in fact["samples"]:
        message = values.fill(cls(), sample["value"])
        raw = bytes.fromhex(sample["cdr"])
        assert message.serialize().hex() == sample["cdr"]
        assert cls.deserialize(raw) == message
        assert cls.deserialize(raw).serialize() == raw
        swapped = message.serialize(byteorder="big")
        assert swapped[:4] == b"\0\0\0\0"
        for buffer in (swapped, bytearray(swapped), memoryview(swapped)):
            assert cls.deserialize(buffer) == message
        assert cls.from_dict(json.loads(json.dumps(message.to_dict()))) == message


@EACH
def test_type_data_has_the_recorded_hash(standard, fact):
    cls = generated.class_of(fact["name"])
    package = fact["name"].partition("/")[0]
    types = generated.type_data(standard / package)
    assert types["hashes"][fact["name"]] == fact["hash"]
    assert [f["name"] for f in types["descriptions"][fact["name"]]["fields"]] == (
        list(cls.get_fields_and_field_types()) or ["structure_needs_at_least_one_member"]
    )


@pytest.fixture(scope="module")
def dumped(tmp_path_factory):
    """The definitions of golden/rosidl/cdr.jsonl as one package."""
    folder = tmp_path_factory.mktemp("dumped")
    files = {}
    for dump in DUMPS:
        for name, text in {dump["type"]: dump["definition"], **dump["definitions_used"]}.items():
            files[f"msg/{name}.msg"] = text
    generated.write_package(folder, "dumped_msgs", files)
    with generated.importable(folder):
        yield


@pytest.mark.parametrize("dump", DUMPS, ids=[f"{d['type']}-{d['endian']}" for d in DUMPS])
@pytest.mark.usefixtures("dumped")
def test_fast_cdrs_bytes_are_equal_both_ways(dump):
    cls = generated.class_of(f"dumped_msgs/msg/{dump['type']}")
    message = values.fill(cls(), dump["value"])
    raw = bytes.fromhex(dump["hex"])
    order = {"LE": "little", "BE": "big"}[dump["endian"]]
    assert message.serialize(byteorder=order).hex() == raw.hex()
    assert cls.deserialize(raw) == message
    assert cls.deserialize(raw + b"more") == message
