"""The built-in processes: a new one is registered here, by its import and its name in `__all__`."""

from gmwm.process.base import Process
from gmwm.process.kinds.arma import AR, ARIMA, ARMA, MA
from gmwm.process.kinds.gauss_markov import GaussMarkov, Resonance
from gmwm.process.kinds.low_pass import AveragedNoise, LowPassNoise
from gmwm.process.kinds.noise import (
    BiasInstability,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Sinusoid,
    WhiteNoise,
)

__all__ = (  # noqa: RUF022 - in the order in which they are listed and tried
    "WhiteNoise",
    "QuantizationNoise",
    "BiasInstability",
    "RandomWalk",
    "RateRamp",
    "GaussMarkov",
    "Resonance",
    "LowPassNoise",
    "AveragedNoise",
    "Sinusoid",
    "AR",
    "MA",
    "ARMA",
    "ARIMA",
)

CATALOGUE: tuple[type[Process], ...] = tuple(globals()[name] for name in __all__)
"""Every built-in process."""
