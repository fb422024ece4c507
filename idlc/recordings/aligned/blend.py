"""Values between those of two messages: lines of numbers, and turns of quaternions."""

from __future__ import annotations

from typing import Any

import numpy as np

#: Between quaternions that are so close, a line is more exact than an arc.
CLOSE = 0.9995


def line(first: Any, second: Any, weight: Any) -> Any:
    """Return an Arrow array between two of numbers, or of arrays of as many numbers."""
    import pyarrow as pa

    if not pa.types.is_floating(first.type):
        size = first.type.list_size
        values = line(first.flatten(), second.flatten(), np.repeat(weight, size))
        return pa.FixedSizeListArray.from_arrays(values, size)
    starts, ends = (array.to_numpy(zero_copy_only=False) for array in (first, second))
    gaps, later_gaps = (array.is_null().to_numpy(zero_copy_only=False) for array in (first, second))
    with np.errstate(invalid="ignore"):  # inf - inf is NaN, as elsewhere
        between = np.where(weight == 0, starts, starts * (1 - weight) + ends * weight)
    is_gap = gaps | (later_gaps & (weight != 0))
    return pa.array(between.astype(starts.dtype), first.type, mask=is_gap)


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
