"""Curves of the kinds that the estimator's compiled loops know, by `Process.compiled_kind`."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.process.kinds.gauss_markov import (
    GaussMarkov,
    Resonance,
    real_haar,
    real_slope,
    resonance_haar,
)
from gmwm.process.kinds.low_pass import LowPassNoise, low_pass_haar, on_panels

_GAUSS_MARKOV, _RESONANCE, _LOW_PASS = (
    kind.compiled_kind for kind in (GaussMarkov, Resonance, LowPassNoise)
)


def compiled_levels(tau: FloatArray, dt: float, kinds: Collection[int]) -> tuple[Any, ...]:
    """The averaging times (s) as `shaped_curve` of some kinds takes them."""
    nothing = np.zeros(0), np.zeros((tau.size, 0))
    m = np.ascontiguousarray(tau) / dt
    panels = on_panels(tuple(m.tolist())) if _LOW_PASS in kinds else (nothing, nothing)
    return (m, dt, *panels)


@compiled()
def shaped_curve(kind: int, shape: FloatArray, levels: Any) -> FloatArray:
    """`Process.unit_haar_variance` of a compiled kind, (J,), for inner loops; empty where unknown.

    kind: `Process.compiled_kind`.
    shape: Values of the shape parameters.
    levels: From `compiled_levels`.
    """
    m, dt, wide, narrow = levels
    if kind == _GAUSS_MARKOV:
        return real_haar(dt / shape[0], m)
    if kind == _RESONANCE:
        return resonance_haar(shape[0], shape[1], dt, m)
    return low_pass_haar(shape[0], shape[1], shape[2], dt, wide, narrow)


@compiled()
def shaped_slope(kind: int, shape: FloatArray, levels: Any) -> FloatArray:
    """Derivative of `shaped_curve` by its only shape coordinate; empty without a closed form."""
    if kind == _GAUSS_MARKOV:
        return real_slope(levels[1] / shape[0], levels[0])[:, 0].copy()
    return np.zeros(0)
