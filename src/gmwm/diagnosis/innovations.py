"""A channel as its checks see it, with the errors of predicting each sample from those before.

An autoregression of the first differences, with outliers clipped, whitens the noise of a sensor, so
that spikes, stuck values and changes of the noise stand out.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_toeplitz

from gmwm._core.distributions import norm
from gmwm._core.spool import moved
from gmwm._core.typing import BoolArray, FloatArray, inner, known_of
from gmwm.diagnosis import tuning
from gmwm.issues import Notice, Severity, notice

if TYPE_CHECKING:
    from gmwm.diagnosis.events import Tails

_CLIPPED = 0.99892  # variance of the normal distribution within tuning.CLIP
_NORMAL_MAD = 1.482602  # standard deviation over median absolute value
_ROUNDS = 20

Spans = tuple[tuple[int, int], ...]  # the first sample, and the one after the last


@dataclass(frozen=True, eq=False)
class Innovations:
    """Prediction errors of a series of n samples."""

    values: FloatArray  # (n,), u; 0 where there is none
    known: BoolArray  # (n,), whether there is one: not where samples on both sides are missing
    scale: FloatArray  # (n,), robust standard deviation around each sample, u
    rounding: float  # the most that rounding can add to a prediction error, u

    @cached_property
    def level(self) -> float:
        """Usual standard deviation, u."""
        return float(np.median(self.scale[self.known]))


class Held(NamedTuple):
    """Samples that repeat the one before without being measured."""

    share: float = 0.0  # of the samples that do
    chance: float = 0.0  # share that chance explains
    is_even: bool = False  # whether they come at a regular interval


@dataclass(frozen=True, eq=False)
class Examined:
    """A channel with its prediction errors and what was found first."""

    name: str
    unit: str
    dt: float
    values: FloatArray  # (n,), samples, NaN where missing
    step: float  # to which the largest samples are rounded, u; 0 if not
    smallest: float  # to which the smallest are
    errors: Innovations
    events: Spans  # spikes and shocks
    shocks: Spans  # those that do not touch a move of the whole sensor
    outliers: float  # share of outliers spread over the record
    tails: Tails | None  # law of the noise if its tails are heavy
    usable: BoolArray  # (n,), prediction errors outside events
    quiet: FloatArray  # (n,), samples, NaN in events too
    held: Held = field(default_factory=Held)

    @property
    def scatter(self) -> float:
        """Usual standard deviation of what cannot be predicted of a sample, u."""
        return self.errors.level

    @cached_property
    def present(self) -> FloatArray:
        """Samples in their order, none missing."""
        return known_of(self.values)

    @cached_property
    def noise(self) -> FloatArray:
        """Samples outside events in their order, none missing."""
        return known_of(self.quiet)


def innovations(values: FloatArray, step: float) -> Innovations | None:
    """Prediction errors of a series, forwards, or backwards where nothing stands before.

    None if the series is too short or too broken. Samples are rounded to ``step`` (u), if not 0.
    """
    n = values.size
    differences = np.diff(values)
    known = ~np.isnan(differences)
    if np.count_nonzero(known) < tuning.FEWEST_KNOWN:
        return None
    floor = step / np.sqrt(12.0)
    limit = tuning.CLIP * robust_scale(known_of(differences), floor)
    differences[~known] = 0.0
    coefficients = _prediction_filter(np.clip(differences, -limit, limit), int(np.sum(known)))
    order = coefficients.size - 1
    errors, present = np.zeros(n), np.zeros(n, dtype=bool)
    errors[1:] = np.convolve(coefficients, differences)[: n - 1]
    present[1:] = _complete(known, order)
    errors[~present] = 0.0
    rows = np.flatnonzero(_complete(known[::-1], order)[::-1] & ~present[:-1])
    for k, coefficient in enumerate(coefficients):
        # Differences of the reversed series have the other sign.
        errors[rows] -= coefficient * differences[rows + k]
    present[rows] = True
    del differences
    if np.count_nonzero(present) < tuning.FEWEST_KNOWN:
        return None
    scale = np.full(n, floor)
    scale[present] = running_scale(errors[present], floor)
    on_samples = np.convolve(coefficients, [1.0, -1.0])
    rounding = 0.5 * step * float(np.sum(np.abs(on_samples)))
    return Innovations(moved(errors, values), present, moved(scale, values), rounding)


def robust_scale(values: FloatArray, floor: float) -> float:
    """Standard deviation of the values within four of them, from a median; at least ``floor``."""
    size = np.abs(values)
    scale = max(_NORMAL_MAD * float(np.median(size, overwrite_input=True)), floor)
    size *= size
    for _ in range(_ROUNDS):
        within = size <= (tuning.CLIP * scale) ** 2
        count = np.count_nonzero(within)
        new = max(np.sqrt(inner(size, within) / (count * _CLIPPED)), floor) if count else scale
        if abs(new - scale) <= 1e-3 * scale:
            break
        scale = new
    return scale


def _prediction_filter(differences: FloatArray, known: int) -> FloatArray:
    """Prediction error filter by the Yule-Walker equations, missing differences being zero."""
    order = min(tuning.ORDER, known // tuning.SAMPLES_PER_COEFFICIENT)
    n = differences.size
    covariance = np.array([inner(differences[: n - k], differences[k:]) for k in range(order + 1)])
    if not covariance[0] > 0.0:
        return np.ones(1)
    covariance[0] *= 1.0 + 1e-9
    weights = solve_toeplitz(covariance[:-1], covariance[1:])
    return np.concatenate([[1.0], -weights])


def _complete(known: BoolArray, order: int) -> BoolArray:
    """Mark differences that are known together with the ``order`` before them."""
    complete = known.copy()
    complete[:order] = False
    if np.all(known):
        return complete
    for k in range(1, order + 1):
        complete[k:] &= known[:-k]
    return complete


def running_scale(errors: FloatArray, floor: float) -> FloatArray:
    """Scale in blocks, by the median of five: a shock does not fill three of them."""
    blocks = max(errors.size // tuning.SCALE_BLOCK, 1)
    edges = np.linspace(0, errors.size, blocks + 1).astype(int)
    scales = [robust_scale(errors[a:b], floor) for a, b in pairwise(edges)]
    padded = np.pad(np.array(scales), 2, mode="reflect" if blocks > 2 else "edge")
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    return np.repeat(smooth, np.diff(edges))


def crosstalk_notices(errors: dict[str, npt.NDArray[np.float32]]) -> list[Notice]:
    """Find pairs of channels whose prediction errors are correlated.

    The correlation of two white series has the variance 1/n. Errors are in standard deviations,
    clipped, and 0 where they are unknown, which adds nothing to a sum of products.
    """
    pairs, notices = list(combinations(errors, 2)), []
    for one, other in pairs:
        a, b = errors[one], errors[other]
        n = int(np.count_nonzero((a != 0.0) & (b != 0.0)))
        if n < tuning.FEWEST_KNOWN:
            continue
        r = inner(a, b) / np.sqrt(inner(a, a) * inner(b, b))
        if abs(r) * np.sqrt(n) <= norm.isf(0.5 * tuning.FALSE_ALARM / len(pairs)):
            continue
        if abs(r) > tuning.CORRELATED:
            severity: Severity = "warning" if abs(r) > tuning.STRONGLY_CORRELATED else "note"
            values = {"correlation": r, "samples": float(n), "channels": f"{one}, {other}"}
            both = f"{one} and {other}"
            notices.append(notice("crosstalk", "", values, severity=severity, both=both))
    return notices
