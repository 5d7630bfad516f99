"""Stretches in which a sensor scatters more than elsewhere, with a sudden begin or end.

The logarithms of the scatter of blocks have one level for a sensor at rest, which may drift as it
warms up; vibration lifts them within seconds. Their fluctuation is measured by themselves, so that
noise of heavy tails, walks, resonances and coarse rounding, whose scatter varies, has no stretches.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from gmwm._core.distributions import norm
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.diagnosis import tuning


@dataclass(frozen=True, eq=False)
class Loudness:
    """When some axes scatter more than at their quietest.

    loud: (blocks,) of bool.
    ratio: Largest standard deviation in a loud stretch over that at rest, of any axis.
    """

    loud: BoolArray
    ratio: float


def loudness(scatter: FloatArray, step: FloatArray) -> Loudness:
    """Find the loud stretches of a recording from the scatter of its blocks.

    scatter: (blocks, axes), variance within each block, u^2; NaN where it is not known.
    step: (axes,), to which samples are rounded, u; 0 where they are not.
    Returns: no loud block where their scatter does no harm.
    """
    nothing = Loudness(np.zeros(scatter.shape[0], dtype=bool), 1.0)
    # A block that does not scatter at all is dead, not quiet, if all others do by more than a step.
    smallest = np.nanmin(np.where(scatter > 0.0, scatter, np.inf), axis=0, initial=np.inf)
    dead = (scatter == 0.0) & (step**2 < smallest)
    known = np.flatnonzero(~np.any(np.isnan(scatter) | dead, axis=1))
    count = known.size // tuning.BLOCKS_OF_LEVEL
    if count < tuning.FEWEST_BLOCKS:
        return nothing
    # Noise below a step scatters by up to half of it, only where the level is between two steps.
    values = np.maximum(scatter[known], step**2 / 4.0)
    least = np.array([np.min(each[each > 0.0], initial=np.inf) for each in values.T])
    logs = np.log(np.maximum(values, least)[:, np.isfinite(least)])
    if not logs.size:
        return nothing
    found = [_loud_blocks(series) for series in (*logs.T, np.mean(logs, axis=1))]
    axes = [axis for axis, (where, _) in enumerate(found[:-1]) if where.any()]
    # The axes that vibrate know together when they do; else those that do not at the same time.
    together, _ = _loud_blocks(np.mean(logs[:, axes], axis=1)) if axes else found[-1]
    chosen = together if together.any() else np.any([where for where, _ in found], axis=0)
    loud = nothing.loud.copy()
    loud[known] = chosen
    level = max((level for where, level in found if where.any()), default=0.0)
    return Loudness(loud, float(np.exp(0.5 * level)))


def _loud_blocks(logs: FloatArray) -> tuple[BoolArray, float]:
    """Those blocks of one axis that are loud, and the highest of their levels above the lowest."""
    ends = _changes(logs)
    levels = np.array([np.median(logs[a:b]) for a, b in pairwise(ends)])
    lengths = np.diff(ends)
    long = lengths >= tuning.BLOCKS_OF_LEVEL * tuning.MEDIAN_BLOCKS
    above = levels - np.min(levels[long]) if np.any(long) else np.zeros(levels.size)
    loud = above > np.log(tuning.LOUDER_THAN_REST)
    share = lengths[loud] / logs.size
    added = float(np.sum(share * np.expm1(above[loud])))
    lasts = np.max(lengths[loud], initial=0) >= tuning.SHORTEST_STILL / tuning.STILL_BLOCK
    harms = added > tuning.HARMFUL_SCATTER and (lasts or np.sum(share) > tuning.LEAST_SHAKEN)
    if not harms:
        return np.zeros(logs.size, dtype=bool), 0.0
    # A change that was missed leaves something at rest in a loud stretch.
    smooth = scipy.ndimage.median_filter(logs, tuning.BLOCKS_OF_FLOOR + 1, mode="nearest")
    half = np.repeat(np.where(loud, 0.5 * above, np.inf), lengths)
    return smooth - np.min(levels[long]) > half, float(np.max(above[loud]))


def _changes(logs: FloatArray) -> list[int]:
    """Begin, sudden changes of the level, end: block numbers."""
    width, lag = tuning.BLOCKS_OF_LEVEL, tuning.MEDIAN_BLOCKS
    seconds = logs[: logs.size // width * width].reshape(-1, width).mean(axis=1)
    padded = np.pad(seconds, lag // 2, mode="edge")
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(padded, lag), axis=1)
    change = smooth[lag:] - smooth[:-lag]
    scale = float(np.quantile(np.abs(change), tuning.QUIET)) / norm.ppf(0.5 + 0.5 * tuning.QUIET)
    # The scale is known the less, the shorter the recording.
    unsure = 1.0 + tuning.FEW_SECONDS / np.sqrt(seconds.size)
    far = norm.isf(0.5 * tuning.FALSE_ALARM / seconds.size) * tuning.BEYOND_NOISE * unsure
    sign = np.sign(change) * (np.abs(change) > max(np.log(tuning.LOUDER_THAN_REST), far * scale))
    edges = np.flatnonzero(np.diff(sign, prepend=0.0, append=0.0))
    ends = [0]
    for a, b in pairwise(edges.tolist()):
        if sign[a]:
            middle = (a + int(np.argmax(np.abs(change[a:b]))) + lag // 2 + 1) * width
            split = _split(logs, max(ends[-1], middle - lag * width), middle + lag * width)
            if split > ends[-1]:
                ends.append(split)
    return [*ends, logs.size]


def _split(logs: FloatArray, start: int, stop: int) -> int:
    """Where two levels describe a few seconds best."""
    part = logs[start:stop]
    before = np.arange(1, part.size)
    sums = np.cumsum(part)[:-1]
    explained = sums**2 / before + (np.sum(part) - sums) ** 2 / (part.size - before)
    return start + 1 + int(np.argmax(explained))
