"""The hash against the library of its inventor."""

import random

import pytest
import xxhash

from idlc.robot.xxh3 import xxh3_128

BLOCK = 1024


@pytest.mark.parametrize(
    "size", [*range(300), *(BLOCK * n + d for n in (1, 2, 5) for d in (-1, 0, 1, 63, 64, 65))]
)
def test_it_is_that_of_the_library(size):
    data = random.Random(size).randbytes(size)
    assert xxh3_128(data) == xxhash.xxh3_128_intdigest(data)
    assert xxh3_128(bytes(size)) == xxhash.xxh3_128_intdigest(bytes(size))
    assert xxh3_128(b"\xff" * size) == xxhash.xxh3_128_intdigest(b"\xff" * size)
