"""The step of a sensor's output, and what rounding to it does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gmwm._core.distributions import norm
from gmwm._core.text import brief, readable
from gmwm._core.typing import FloatArray, inner
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Examined
from gmwm.issues import Notice, Severity, notice

_SMALLEST = 1e-9  # of the range: what is smaller is the rounding of floating point


def step_size(values: FloatArray) -> float:
    """Largest step that divides all differences between samples; 0 if there is none.

    Text holds steps rounded to some decimals (0.00333, 0.00667, 0.01): places may be off the
    lattice by a tenth of a step (root mean square). No sample may be missing.
    """
    stride = -(-values.size // tuning.LEVELS_SAMPLED)
    part = values[::stride]
    levels = np.unique(part)
    if levels.size < 2:
        return 0.0
    gaps = np.diff(levels)
    differences = gaps[gaps > _SMALLEST * (levels[-1] - levels[0])]
    smallest = float(np.min(differences))
    first = float(np.median(differences[differences <= tuning.ONE_STEP * smallest]))
    # Few levels that come again and again are steps whatever their places.
    if levels.size < tuning.FEWEST_LEVELS and levels.size > part.size / 2:
        return 0.0
    levels -= np.mean(levels)
    for divisor in tuning.DIVISORS:
        step, off = _lattice(levels, gaps, first / divisor)
        if off <= tuning.OFF_LATTICE / (1.0 if divisor == 1 else 3.0):
            return step
    return 0.0


def _lattice(levels: FloatArray, gaps: FloatArray, step: float) -> tuple[float, float]:
    """Step after regression of the levels on their places, and rms distance in steps."""
    places = np.concatenate([[0.0], np.cumsum(np.rint(gaps / step))])
    if places[-1] == 0.0:
        return step, np.inf
    places -= np.mean(places)
    refined = inner(places, levels) / inner(places, places)
    off = gaps / refined
    off -= np.rint(off)
    return refined, float(np.sqrt(np.mean(off**2)))


def widest_step(values: FloatArray, step: float) -> float:
    """Step of the largest values, where numbers of few digits have wider ones from a power on.

    With three decimal digits, or in half precision, steps grow with the value: levels out there
    come often while their neighbours at the smaller ``step``, that of `step_size`, never do. That
    is returned if few samples have wider ones.
    """
    part = values[:: -(-values.size // tuning.LEVELS_SAMPLED)]
    if step == 0.0 and 2 * np.unique(part).size >= part.size:
        return 0.0  # numbers of few digits come again
    # Stuck values count once, so that none of them is a level for its frequency alone.
    begins = values[np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)]
    levels, counts = np.unique(begins, return_counts=True)
    gaps = np.diff(levels)
    gaps[gaps < 0.5 * step] = 0.0  # one level, written in two ways
    nearest = np.minimum(np.append(gaps, np.inf), np.insert(gaps, 0, np.inf))
    often = counts >= tuning.FEWEST_OF_LEVEL
    alone = often & (nearest > 1.5 * step)
    size = np.abs(levels)
    alone &= size > np.max(size[often & ~alone], initial=0.0)
    # Of several steps, as about zero, the widest that enough samples have.
    order = np.argsort(-nearest[alone], kind="stable")
    have = np.cumsum(counts[alone][order]) >= tuning.FEWEST_WIDE * begins.size
    return float(nearest[alone][order][np.argmax(have)]) if np.any(have) else step


def is_coarse(values: FloatArray, step: float) -> bool:
    """Whether the step is more than three times the noise, by how few samples leave two levels.

    Noise about the middle of a step switches between the two levels beside it, and beyond these
    lie, of Gaussian noise of a third of a step, ``2 Q(3)`` of the samples.
    """
    if not values.size:  # all of them belong to events
        return False
    size = min(tuning.BLOCK_OF_LEVELS, values.size)
    blocks = values[: values.size // size * size].reshape(-1, size)
    places = (blocks - blocks[:, :1]) / step
    # Multiples of a step but for rounding: half a step of room on either side.
    below = np.floor(np.mean(places, axis=1, keepdims=True))
    beyond = np.count_nonzero((places < below - 0.5) | (places > below + 1.5))
    return bool(beyond < 2.0 * norm.sf(tuning.COARSE) * places.size)


def rounding(channel: Examined) -> Iterator[Notice]:
    """Say how coarse the step is against the white noise.

    Rounding adds white noise of variance step^2/12 as long as the noise before it is not much
    below half a step (Widrow & Kollar, *Quantization Noise*, 2008, sec. 5).
    """
    unit, step, smallest = channel.unit, channel.step, channel.smallest
    if step == 0.0:
        return
    noise = float(np.sqrt(max(channel.scatter**2 - step**2 / 12.0, 0.0)))
    shown = readable(step, unit)
    if 0.0 < smallest < step:
        shown += f" ({readable(smallest, unit)} where they are smaller)"
    coarse = noise < step / tuning.COARSE or is_coarse(channel.noise, step)
    ratio = step / noise if noise > 0.0 else np.inf
    severity: Severity = "note" if ratio > 0.5 else "good"
    hint = "rounding is treated as white noise: {added:.2g%} of it"
    values = {"lsb": step, "noise": noise}
    if coarse:
        severity = "bad"
        hint = "the noise below the step cannot be estimated; use a finer range"
    elif ratio > 1.0:
        severity = "warning"
        hint = "rounding is treated as white noise: true for steps up to twice the noise"
    words = {"step": shown, "times": brief(ratio), "shown": readable(noise, unit), "hint": hint}
    words["variant"] = "coarse" if coarse else ""
    added = step**2 / 12.0 / (noise**2 + step**2 / 12.0)
    yield notice("rounding", channel.name, values, severity=severity, added=added, **words)
