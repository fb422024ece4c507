"""How much random tests try: a part in `make test`, all in `make test-long`, more in `make fuzz`.

A test that asks for `rounds` is marked `rounds`, so that `make test-long` runs it again.
"""

import os
from collections.abc import Iterable

import pytest

SEED = int(os.environ.get("IDLC_SEED", "1"))
ROUNDS = float(os.environ.get("IDLC_ROUNDS", "0.25"))
ALL = ROUNDS >= 1
FUZZING = ROUNDS > 1


def rounds(number: int) -> int:
    """Return how many inputs of `number` a test tries in this run."""
    return max(1, round(number * ROUNDS))


def some(values: Iterable[object]) -> list[object]:
    """Return parameters: every fourth value, and the rest only for `make test-long`."""
    return [
        value if number % 4 == 0 else pytest.param(value, marks=pytest.mark.long)
        for number, value in enumerate(values)
    ]
