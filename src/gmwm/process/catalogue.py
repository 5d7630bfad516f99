"""Every built-in process, and models from what was stored of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process.base import Process
from gmwm.process.kinds.arma import AR, ARIMA, ARMA, MA
from gmwm.process.kinds.gauss_markov import (
    GaussMarkov,
    Resonance,
    real_haar,
    real_slope,
    resonance_haar,
)
from gmwm.process.kinds.low_pass import AveragedNoise, LowPassNoise, low_pass_haar, on_panels
from gmwm.process.kinds.noise import (
    BiasInstability,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    WhiteNoise,
)
from gmwm.process.kinds.sinusoid import Sinusoid
from gmwm.process.model import Model

CATALOGUE: tuple[type[Process], ...] = (
    QuantizationNoise,
    WhiteNoise,
    BiasInstability,
    RandomWalk,
    RateRamp,
    GaussMarkov,
    Resonance,
    LowPassNoise,
    AveragedNoise,
    Sinusoid,
    AR,
    MA,
    ARMA,
    ARIMA,
)
"""Every built-in process."""


_GAUSS_MARKOV, _RESONANCE, _LOW_PASS = (
    kind.compiled_kind for kind in (GaussMarkov, Resonance, LowPassNoise)
)


def compiled_levels(tau: FloatArray, dt: float, kinds: Collection[int]) -> tuple[Any, ...]:
    """What curves of some kinds need to know of averaging times (s) in `shaped_curve`."""
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
    """Its derivative by the coordinate of the only shape parameter; empty if not in closed form."""
    if kind == _GAUSS_MARKOV:
        return real_slope(levels[1] / shape[0], levels[0])[:, 0].copy()
    return np.zeros(0)


def model_from_list(content: Sequence[Mapping[str, Any]]) -> Model:
    """The model whose terms were written with ``to_dict``.

    Raises InputError for a process that is neither built in nor defined in a module imported so
        far, or parameters it does not have.
    """
    kinds = {kind.__name__: kind for kind in _subclasses(Process)}
    terms = []
    for item in content:
        arguments = dict(item)
        name = arguments.pop("process", None)
        if name not in kinds:
            raise InputError(
                f"unknown process {name!r}: import the module that defines it first (built in are "
                f"{', '.join(kind.__name__ for kind in CATALOGUE)})"
            )
        try:
            terms.append(kinds[name](**arguments))
        except TypeError as error:
            raise InputError(f"{name}: {error}") from None
    return Model(tuple(terms))


def _subclasses(kind: type[Any]) -> list[type[Any]]:
    direct = kind.__subclasses__()
    return [*direct, *(child for item in direct for child in _subclasses(item))]
