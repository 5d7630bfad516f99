"""What an error process is: parameters, spectrum, wavelet variance, state space, simulation."""

from gmwm.process.arma import AR, ARIMA, ARMA, MA
from gmwm.process.base import Process
from gmwm.process.gauss_markov import GaussMarkov, Resonance
from gmwm.process.model import Model, as_model
from gmwm.process.noise import (
    BiasInstability,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    WhiteNoise,
)
from gmwm.process.parameter import Parameter
from gmwm.process.sinusoid import Sinusoid
from gmwm.process.state_space import StateSpace

CATALOGUE: tuple[type[Process], ...] = (
    QuantizationNoise,
    WhiteNoise,
    BiasInstability,
    RandomWalk,
    RateRamp,
    GaussMarkov,
    Resonance,
    Sinusoid,
    AR,
    MA,
    ARMA,
    ARIMA,
)
"""Every built-in process."""

__all__ = [
    "AR",
    "ARIMA",
    "ARMA",
    "CATALOGUE",
    "MA",
    "BiasInstability",
    "GaussMarkov",
    "Model",
    "Parameter",
    "Process",
    "QuantizationNoise",
    "RandomWalk",
    "RateRamp",
    "Resonance",
    "Sinusoid",
    "StateSpace",
    "WhiteNoise",
    "as_model",
]
