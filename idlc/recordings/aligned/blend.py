"""Values between those of two messages: lines of numbers, and turns of quaternions."""

from __future__ import annotations

from typing import Any

import numpy as np

from idlc.recordings.containers.source import RecordingError

#: Between quaternions that are so close, a line is more exact than an arc.
CLOSE = 0.9995


def is_blendable(pa: Any, type_: Any) -> bool:
    """Return whether a column has floating-point numbers, or lists of these."""
    if pa.types.is_fixed_size_list(type_) or pa.types.is_large_list(type_):
        type_ = type_.value_type
    return bool(pa.types.is_floating(type_))


def line(name: str, first: Any, second: Any, weight: Any) -> Any:
    """Return an Arrow array between two of numbers or of lists; only numbers can be null."""
    import pyarrow as pa

    if pa.types.is_floating(first.type):
        starts, ends = (array.to_numpy(zero_copy_only=False) for array in (first, second))
        gaps, ends_gaps = (array.is_null().to_numpy(False) for array in (first, second))
        gaps = gaps | (ends_gaps & (weight != 0))
        return pa.array(_numbers(starts, ends, weight), first.type, mask=gaps)
    if pa.types.is_fixed_size_list(first.type):
        size = first.type.list_size
        values = line(name, first.flatten(), second.flatten(), np.repeat(weight, size))
        return pa.FixedSizeListArray.from_arrays(values, size)
    sizes, other = (np.diff(array.offsets.to_numpy()) for array in (first, second))
    if (sizes != other).any():
        row = int(np.flatnonzero(sizes != other)[0])
        what = f"`{name}` has {sizes[row]} elements in a message, and {other[row]} in the next"
        raise RecordingError(f"{what}: no value lies between", "use how='last' for this topic")
    values = line(name, first.flatten(), second.flatten(), np.repeat(weight, sizes))
    offsets = np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])
    return pa.LargeListArray.from_arrays(pa.array(offsets), values)


def _numbers(first: Any, second: Any, weight: Any) -> Any:
    with np.errstate(invalid="ignore"):  # inf - inf is NaN, as elsewhere
        between = first * (1 - weight) + second * weight
    return np.where(weight == 0, first, between).astype(first.dtype)


def turn(first: Any, second: Any, weight: Any) -> Any:
    """Return quaternions, a row each, on the shorter arc between two; NaN if one has no length.

    Those at a message are as they were recorded, the others have the length 1.
    """
    weight = weight[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        start, end = (
            each / np.linalg.norm(each, axis=1, keepdims=True) for each in (first, second)
        )
        cosine = (start * end).sum(axis=1, keepdims=True)
        end = np.where(cosine < 0, -end, end)
        angle = np.arccos(np.minimum(np.abs(cosine), 1))
        sine = np.sin(angle)
        arc = (np.sin((1 - weight) * angle) * start + np.sin(weight * angle) * end) / sine
        chord = start * (1 - weight) + end * weight
        chord = chord / np.linalg.norm(chord, axis=1, keepdims=True)
    return np.where(weight == 0, first, np.where(np.abs(cosine) > CLOSE, chord, arc))
