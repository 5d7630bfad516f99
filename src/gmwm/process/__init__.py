"""What an error process is: parameters, spectrum, wavelet variance, state space, simulation."""

from gmwm.process.arma import AR, ARIMA, ARMA, MA
from gmwm.process.base import Process, Shape
from gmwm.process.catalogue import (
    CATALOGUE,
    compiled_levels,
    model_from_list,
    shaped_curve,
    shaped_slope,
)
from gmwm.process.gauss_markov import GaussMarkov, Resonance
from gmwm.process.low_pass import BUTTERWORTH, AveragedNoise, LowPassNoise
from gmwm.process.model import Model, as_model, simulate
from gmwm.process.noise import (
    BiasInstability,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    WhiteNoise,
)
from gmwm.process.parameter import Parameter, parameter
from gmwm.process.sinusoid import Sinusoid
from gmwm.process.spectral import PSD, Panels, evaluated, haar_gain, legendre, quadrature
from gmwm.process.state_space import StateSpace, block_diagonal
from gmwm.process.wavelet_gain import pair_weights, unit_legendre
from gmwm.process.wavelets import ComplexArray, Wavelet, wavelet

__all__ = [
    "AR",
    "ARIMA",
    "ARMA",
    "BUTTERWORTH",
    "CATALOGUE",
    "MA",
    "PSD",
    "AveragedNoise",
    "BiasInstability",
    "ComplexArray",
    "GaussMarkov",
    "LowPassNoise",
    "Model",
    "Panels",
    "Parameter",
    "Process",
    "QuantizationNoise",
    "RandomWalk",
    "RateRamp",
    "Resonance",
    "Shape",
    "Sinusoid",
    "StateSpace",
    "Wavelet",
    "WhiteNoise",
    "as_model",
    "block_diagonal",
    "compiled_levels",
    "evaluated",
    "haar_gain",
    "legendre",
    "model_from_list",
    "pair_weights",
    "parameter",
    "quadrature",
    "shaped_curve",
    "shaped_slope",
    "simulate",
    "unit_legendre",
    "wavelet",
]
