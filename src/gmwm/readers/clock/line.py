"""The robust straight line through time stamps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gmwm._core.typing import BoolArray, FloatArray, IntArray, median
from gmwm.readers import tuning


def interval_of(stamps: FloatArray, number: IntArray, starts: BoolArray) -> float:
    """Sampling interval: slope of the line through the stamps over their sample numbers.

    From the median slope of rows half of the record apart, least squares with the residuals bounded
    at three robust standard deviations: a stamp that comes late has no more weight than one of the
    usual jitter. From independent errors of the stamps of s intervals the slope has a relative
    error of ``s sqrt(12 / n^3)``, that from the first to the last stamp ``s sqrt(2) / n``.

    stamps: (n,).
    number: (n,) of int.
    starts: (n,) of bool, where a part begins whose clock has an offset of its own.
    Returns: a number in the unit of the stamps.
    """
    edges = [0, *np.flatnonzero(starts), stamps.size]
    parts = [slice(a, b) for a, b in pairwise(edges) if b > a]
    lever = np.subtract(number, number[0], dtype=float)
    half = max(max(part.stop - part.start for part in parts) // 2, 1)
    pairs = [(slice(p.start, p.stop - half), slice(p.start + half, p.stop)) for p in parts]
    slopes = [
        (stamps[then] - stamps[first]) / (lever[then] - lever[first])
        for first, then in pairs
        if first.stop > first.start
    ]
    slope = median(np.concatenate(slopes), overwrite=True)
    for part in parts:
        lever[part] -= np.mean(lever[part])
    scale = float(lever @ lever)
    if not scale > 0.0:
        return 0.0
    late = np.empty(stamps.size)
    for _ in range(tuning.ROUNDS_OF_LINE):
        for part in parts:
            np.subtract(stamps[part], stamps[part.start], out=late[part])
            late[part] -= slope * lever[part]
            late[part] -= median(late[part])
        bound = 3.0 * 1.4826 * median(np.abs(late), overwrite=True)
        change = float(lever @ np.clip(late, -bound, bound)) / scale
        slope += change
        if abs(change) < tuning.LINE_SETTLED * abs(slope):
            break
    return slope
