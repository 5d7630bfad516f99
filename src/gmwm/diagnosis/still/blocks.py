"""Means and scatter of short blocks of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.text import brief
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.motion import is_moved_with, remembered
from gmwm.diagnosis.resolution import step_size
from gmwm.diagnosis.still.loudness import Loudness, loudness
from gmwm.readers import Channel, Recording

_LISTED = 3


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of a quarter of a second, of the channels that motion can be seen in.

    size: Samples of a block.
    means, scatter: (blocks, axes), mean and variance of each block, u and u^2; NaN where half is
        missing.
    """

    channels: tuple[Channel, ...]
    size: int
    means: FloatArray
    scatter: FloatArray

    @property
    def length(self) -> float:
        """Of a block, s."""
        return self.size * self.channels[0].dt

    @property
    def is_gyro(self) -> BoolArray:
        """Which axes are gyros."""
        return np.array([channel.quantity == "gyro" for channel in self.channels])

    @cached_property
    def loudness(self) -> Loudness:
        """When axes scatter more than at their quietest."""
        step = [step_size(channel.values[~np.isnan(channel.values)]) for channel in self.channels]
        return loudness(self.scatter, np.array(step))

    @property
    def loud_stretches(self) -> tuple[tuple[float, float], ...]:
        """Begin and end of each, s."""
        edges = np.flatnonzero(np.diff(self.loudness.loud, prepend=False, append=False))
        times = (self.length * edges).tolist()
        return tuple(zip(times[::2], times[1::2], strict=True))


def vibration_notice(recording: Recording) -> Notice | None:
    """When a recording vibrates, if it does."""
    blocks = blocks_of(recording)
    stretches = blocks.loud_stretches if blocks is not None else ()
    if blocks is None or not stretches:
        return None
    total, ratio = sum(stop - start for start, stop in stretches), blocks.loudness.ratio
    longest = sorted(stretches, key=lambda each: each[0] - each[1])[:_LISTED]
    listed = ", ".join(f"{start:.4g} to {stop:.4g} s" for start, stop in sorted(longest))
    more = f" and {len(stretches) - _LISTED} more" if len(stretches) > _LISTED else ""
    text = (
        f"it vibrates for {total:.4g} s: samples scatter up to {brief(ratio)} times more than at "
        f"rest from {listed}{more}"
    )
    values = {"stretches": len(stretches), "total": total, "ratio": ratio}
    hint = "use what is at rest: gmwm.find_still has the stretches"
    return Notice("vibration", "warning", "", text, values, hint)


@remembered
def blocks_of(recording: Recording) -> Blocks | None:
    """The blocks of a recording; None if there are too few, or no channel to be seen in."""
    size = max(round(tuning.STILL_BLOCK * recording.rate), tuning.FEWEST_OF_MOTION)
    channels = tuple(
        channel
        for channel in recording.inertial
        if channel.is_of_a_sensor and is_moved_with(channel)
    )
    count = recording.n // size
    if not channels or count < tuning.FEWEST_STILL:
        return None
    means, scatter = np.full((2, count, len(channels)), np.nan)
    for axis, channel in enumerate(channels):
        blocks = np.asarray(channel.values[: count * size], dtype=float).reshape(count, size)
        known = np.count_nonzero(~np.isnan(blocks), axis=1)
        enough = known > size // 2
        means[enough, axis] = np.nanmean(blocks[enough], axis=1)
        squares = np.nansum((blocks - means[:, [axis]]) ** 2, axis=1)
        scatter[enough, axis] = squares[enough] / (known[enough] - 1)
    seen = np.flatnonzero(np.any(scatter > 0.0, axis=0))
    if not seen.size:
        return None
    return Blocks(tuple(channels[i] for i in seen), size, means[:, seen], scatter[:, seen])
