"""What cannot be predicted of each sample from those before it.

Spikes, stuck values and changes of the noise are distinguished from the noise of a sensor where
that noise is white. An autoregression of the first differences makes it so, whether it was white, a
random walk or a resonance; outliers are clipped before it is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import solve_toeplitz

from gmwm._core.typing import BoolArray, FloatArray, inner
from gmwm.diagnosis import tuning

_CLIPPED = 0.99892  # variance of the normal distribution within tuning.CLIP
_NORMAL_MAD = 1.482602  # standard deviation over median absolute value
_ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Innovations:
    """Prediction errors of a series.

    values: (n,), u; 0 where there is none.
    known: (n,) of bool, whether there is one: not where samples are missing on both sides.
    scale: (n,), robust standard deviation around each sample, u.
    rounding: The most that rounding can add to a prediction error, u.
    """

    values: FloatArray
    known: BoolArray
    scale: FloatArray
    rounding: float

    @cached_property
    def level(self) -> float:
        """Usual standard deviation, u."""
        return float(np.median(self.scale[self.known]))


def innovations(values: FloatArray, step: float) -> Innovations | None:
    """Prediction errors of a series, forwards, or backwards where nothing stands before.

    values: (n,), samples, NaN where missing.
    step: To which they are rounded, u; 0 if they are not.
    Returns: None if the series is too short or too broken.
    """
    n = values.size
    differences = np.diff(values)
    known = ~np.isnan(differences)
    if np.count_nonzero(known) < tuning.FEWEST_KNOWN:
        return None
    filled = np.where(known, differences, 0.0)
    floor = step / np.sqrt(12.0)
    clipped = np.where(known, np.clip(filled, *_limits(filled, known, floor)), 0.0)
    coefficients = _autoregression(clipped, int(np.count_nonzero(known)))
    order = coefficients.size - 1
    forward = np.convolve(coefficients, filled)[: n - 1]
    # Differences of the reversed series have the other sign.
    backward = np.convolve(coefficients, -filled[::-1])[: n - 1][::-1]
    has_past = _complete(known, order)
    has_future = _complete(known[::-1], order)[::-1]
    errors, present = np.zeros(n), np.zeros(n, dtype=bool)
    errors[:-1], present[:-1] = np.where(has_future, backward, 0.0), has_future
    errors[1:] = np.where(has_past, forward, errors[1:])
    present[1:] |= has_past
    if np.count_nonzero(present) < tuning.FEWEST_KNOWN:
        return None
    scale = np.ones(n) * floor
    scale[present] = running_scale(errors[present], floor)
    on_samples = np.convolve(coefficients, [1.0, -1.0])
    return Innovations(errors, present, scale, 0.5 * step * float(np.sum(np.abs(on_samples))))


def robust_scale(values: FloatArray, floor: float) -> float:
    """Standard deviation of the values within four of them, at least ``floor``.

    The median absolute value starts it; it alone would see the steps of rounded data.
    """
    size = np.abs(values)
    scale = max(_NORMAL_MAD * float(np.median(size)), floor)
    for _ in range(_ROUNDS):
        inner = size[size <= tuning.CLIP * scale]
        new = max(float(np.sqrt(np.mean(inner**2) / _CLIPPED)), floor) if inner.size else scale
        if abs(new - scale) <= 1e-3 * scale:
            break
        scale = new
    return scale


def _limits(differences: FloatArray, known: BoolArray, floor: float) -> tuple[float, float]:
    scale = robust_scale(differences[known], floor)
    return -tuning.CLIP * scale, tuning.CLIP * scale


def _autoregression(differences: FloatArray, known: int) -> FloatArray:
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
    """Whether a difference and the ``order`` before it are known."""
    count = np.concatenate([[0], np.cumsum(known)])
    complete = np.zeros(known.size, dtype=bool)
    complete[order:] = count[order + 1 :] - count[: known.size - order] == order + 1
    return complete


def running_scale(errors: FloatArray, floor: float) -> FloatArray:
    """Scale in blocks, each replaced by the median of itself and its four neighbours.

    A shock may fill a block; it does not fill three of five.
    """
    blocks = max(errors.size // tuning.SCALE_BLOCK, 1)
    edges = np.linspace(0, errors.size, blocks + 1).astype(int)
    scales = [robust_scale(errors[a:b], floor) for a, b in pairwise(edges)]
    padded = np.pad(np.array(scales), 2, mode="reflect" if blocks > 2 else "edge")
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    return np.repeat(smooth, np.diff(edges))
