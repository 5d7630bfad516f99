"""What an error process is: parameters, spectrum, wavelet variance, state space, simulation."""

from gmwm.process.base import Process as Process, Shape as Shape
from gmwm.process.catalogue import (
    CATALOGUE as CATALOGUE,
    compiled_levels as compiled_levels,
    model_from_list as model_from_list,
    shaped_curve as shaped_curve,
    shaped_slope as shaped_slope,
)
from gmwm.process.kinds.arma import AR as AR, ARIMA as ARIMA, ARMA as ARMA, MA as MA
from gmwm.process.kinds.gauss_markov import GaussMarkov as GaussMarkov, Resonance as Resonance
from gmwm.process.kinds.low_pass import (
    BUTTERWORTH as BUTTERWORTH,
    AveragedNoise as AveragedNoise,
    LowPassNoise as LowPassNoise,
)
from gmwm.process.kinds.noise import (
    BiasInstability as BiasInstability,
    QuantizationNoise as QuantizationNoise,
    RandomWalk as RandomWalk,
    RateRamp as RateRamp,
    WhiteNoise as WhiteNoise,
)
from gmwm.process.kinds.sinusoid import Sinusoid as Sinusoid
from gmwm.process.model import Model as Model, as_model as as_model, simulate as simulate
from gmwm.process.parameter import Parameter as Parameter, parameter as parameter
from gmwm.process.spectral import (
    PSD as PSD,
    Panels as Panels,
    evaluated as evaluated,
    haar_gain as haar_gain,
    in_hertz as in_hertz,
    legendre as legendre,
    node_weights as node_weights,
    quadrature as quadrature,
    resolved_share as resolved_share,
)
from gmwm.process.state_space import StateSpace as StateSpace, block_diagonal as block_diagonal
from gmwm.process.wavelet_gain import pair_weights as pair_weights, unit_legendre as unit_legendre
from gmwm.process.wavelets import (
    ComplexArray as ComplexArray,
    Wavelet as Wavelet,
    wavelet as wavelet,
)
