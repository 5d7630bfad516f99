"""The smallest error models that are nowhere below a curve in motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import linprog

from gmwm._core.typing import FloatArray
from gmwm.motion import tuning
from gmwm.process import Model, Process, QuantizationNoise, RandomWalk, WhiteNoise

BOUNDED = (QuantizationNoise, WhiteNoise, RandomWalk)
"""Bounded angle (differenced white noise of the rate), angle and rate random walk."""

FILTER = (WhiteNoise, RandomWalk)


def dominating(
    tau: FloatArray, variance: FloatArray, kinds: Sequence[Callable[[float], Process]], dt: float
) -> Model:
    """The smallest sum of processes of one parameter whose Allan variance is nowhere below a curve.

    The mean ratio to the curve is least (a linear programme in the squares). A walk has 1 % of the
    last variance or more, and white noise of a filter, which divides by both, of the first.
    """
    units = [kind(1.0) for kind in kinds]
    shares = np.column_stack([2.0 * each.haar_variance(tau, dt) for each in units])
    shares /= variance[:, None]
    walks = np.array([each.is_walk for each in units])
    # In parts of what each needs alone: squares of SI units are beyond the solver's tolerances.
    scale = 1.0 / shares.min(axis=0)
    white = np.zeros(len(units)) if kinds is BOUNDED else 1.0 / (shares[0] * scale)
    least = np.where(walks, 1.0 / (shares[-1] * scale), white)
    found = linprog(
        shares.mean(axis=0) * scale,
        A_ub=-shares * scale,
        b_ub=-np.ones(tau.size),
        bounds=[(low, None) for low in tuning.LEAST_WALK * least],
    )
    squares = zip(kinds, found.x * scale, strict=True)
    return Model(tuple(kind(float(np.sqrt(x))) for kind, x in squares if x > 0.0))


def between(tau: FloatArray, variance: FloatArray, times: FloatArray) -> FloatArray:
    """Allan variances at times, on lines between those of a curve in logarithms."""
    return np.asarray(np.exp(np.interp(np.log(times), np.log(tau), np.log(variance))))
