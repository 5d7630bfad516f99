"""Stamps that are early and late in turns, as of a host that reads a sensor in a rhythm of two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray, median
from gmwm.readers import tuning


@dataclass(frozen=True, eq=False)
class Beat:
    """Stamps without their rhythm.

    stamps: (n,).
    share: By how much of a sampling interval they were early and late.
    """

    stamps: FloatArray
    share: float


def without_beat(stamps: FloatArray) -> Beat | None:
    """Take out a rhythm of two; None if there is none.

    Of two steps one is short and one long, and their sum is always the same. A long step of about
    twice the short one is left alone: it may be a sample of three that is lost.

    stamps: (n,).
    """
    if stamps.size < tuning.FEWEST_SAMPLES:
        return None
    steps = np.diff(stamps)
    interval = 0.5 * median(stamps[2:] - stamps[:-2], overwrite=True)
    is_short, is_long = steps < interval, (steps > interval) & (steps < 2.0 * interval)
    if not (interval > 0.0 and np.any(is_short) and np.any(is_long)):
        return None
    short, long = (median(steps[rows], overwrite=True) for rows in (is_short, is_long))
    share = (long - short) / (4.0 * interval)
    near = np.minimum(np.abs(steps - short), np.abs(steps - long)) < tuning.IN_BEAT * interval
    if (
        np.mean(near) < tuning.MOST_IN_BEAT
        or np.mean(is_short[1:] & is_short[:-1]) > 1.0 - tuning.MOST_IN_BEAT
        or np.any(steps < 0.5 * short)
        or not tuning.BEATS[0] < share < tuning.BEATS[1]
        or abs(short + long - 2.0 * interval) > tuning.IN_BEAT * interval
        or abs(long / short - 2.0) < tuning.OFF_GRID
    ):
        return None
    # The row before a short step is late, the one after it early.
    even = stamps.copy()
    even[:-1][is_short] -= share * interval
    even[1:][is_short] += share * interval
    # Of rows that lost their partner, that side which is nearer to the grid of the row before.
    alone = np.ones(stamps.size, dtype=bool)
    alone[:-1] &= ~is_short
    alone[1:] &= ~is_short
    for row in np.flatnonzero(alone).tolist():
        near_to = row - 1 if row else 1
        away = (stamps[row] - even[near_to]) / interval + share * np.array([-1.0, 1.0])
        even[row] += (-1, 1)[int(np.argmin(np.abs(away - np.rint(away))))] * share * interval
    return Beat(even, share)
