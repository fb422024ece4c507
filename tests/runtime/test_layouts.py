"""Layouts that nobody would write: random structures against an obvious encoder."""

import random
from functools import cache

import pytest

from tests.support import generated, plain_cdr, values
from tests.support.layouts import NAMES, random_package
from tests.support.rounds import some

SEEDS = range(60)


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("random")

    @cache
    def shapes_of(seed):
        """Generate a random package, and return the shapes of its messages."""
        files, shapes = random_package(random.Random(seed))
        generated.write_package(folder, f"p{seed}_msgs", files)
        return shapes

    with generated.importable(folder):
        yield shapes_of


@pytest.mark.parametrize("seed", some(SEEDS))
def test_any_layout_is_written_and_read_as_cdr_says(packages, seed):
    rng = random.Random(seed)
    for name, shape in packages(seed).items():
        cls = generated.class_of(f"p{seed}_msgs/msg/{name}")
        for _ in range(8):
            message = values.randomized(cls(), rng)
            plain = message.to_dict()
            for order in ("little", "big"):
                raw = message.serialize(byteorder=order)
                assert raw.hex() == plain_cdr.encode(shape, plain, order).hex()
                assert cls.deserialize(raw) == message
                assert cls.deserialize(memoryview(raw + b"\0\0\0")) == message
                viewed = cls.deserialize(raw, copy=False)
                assert viewed == message
                assert viewed == cls.deserialize(bytearray(raw), copy=False)
                assert viewed.to_dict() == plain
                assert viewed.serialize(byteorder=order) == raw
            assert cls._codec_("<").encode(message, b"".join) == message.serialize()


@pytest.mark.parametrize("seed", some(SEEDS))
def test_every_shorter_buffer_is_refused(packages, seed):
    rng = random.Random(seed)
    for name in packages(seed):
        cls = generated.class_of(f"p{seed}_msgs/msg/{name}")
        error = __import__(f"p{seed}_msgs._idlc")._idlc.DecodeError
        raw = values.randomized(cls(), rng).serialize(byteorder=rng.choice(["little", "big"]))
        for size in {*range(min(len(raw), 40)), *(rng.randrange(len(raw)) for _ in range(20))}:
            with pytest.raises(error) as caught:
                cls.deserialize(raw[:size])
            assert caught.value.offset <= max(size, 8) + 8


ALL_OF_A_KIND = ["float64", "string", "wstring", "float64[]", "bool[]", "string[]", "string[2]",
                 "wstring[]", "Words[]", "Inner", "Inner[]", "Inner[9]", "Mixed[]"]  # fmt: skip


def test_no_name_collides_with_what_generated_code_uses(tmp_path):
    inner = [("count", "int32"), ("item", "uint8")]
    words = [("text", "string"), ("size", "string")]
    mixed = [("at", "string"), ("low", ("float64", None)), ("end", inner)]
    shapes = {"Inner": inner, "Words": words, "Mixed": mixed}
    files = {
        "msg/Inner.msg": "int32 count\nuint8 item\n",
        "msg/Words.msg": "string text\nstring size\n",
        "msg/Mixed.msg": "string at\nfloat64[] low\nInner end\n",
    }
    for number, kind in enumerate(ALL_OF_A_KIND):
        element, _, size = kind.removesuffix("]").partition("[")
        type_ = shapes.get(element, element)
        type_ = (type_, int(size) if size else None) if "[" in kind else type_
        # three hundred fields, each as its neighbours are and are not
        every = (f"{name}{suffix}" for name in NAMES for suffix in ("", "_2", "_count", "_size"))
        names = list(dict.fromkeys(every))
        files[f"msg/Of{number}.msg"] = "".join(f"{kind} {name}\n" for name in names)
        shapes[f"Of{number}"] = [(name, type_) for name in names]
    generated.write_package(tmp_path, "names_msgs", files)
    rng = random.Random(1)
    with generated.importable(tmp_path):
        for name, shape in shapes.items():
            cls = generated.class_of(f"names_msgs/msg/{name}")
            message = values.randomized(cls(), rng)
            for order in ("little", "big"):
                raw = message.serialize(byteorder=order)
                assert raw == plain_cdr.encode(shape, message.to_dict(), order), name
                assert cls.deserialize(raw) == message, name
