"""What an error process is: parameters, spectrum, wavelet variance, state space, simulation."""

from gmwm.process.base import Process as Process, Shape as Shape
from gmwm.process.kinds import *  # noqa: F403 - the table of built-in processes
from gmwm.process.kinds import CATALOGUE as CATALOGUE
from gmwm.process.kinds.low_pass import BUTTERWORTH as BUTTERWORTH
from gmwm.process.model import Model as Model, as_model as as_model, simulate as simulate
from gmwm.process.parameter import Parameter as Parameter, parameter as parameter
from gmwm.process.spectral import (
    PANEL as PANEL,
    PSD as PSD,
    Panels as Panels,
    evaluated as evaluated,
    in_hertz as in_hertz,
    legendre as legendre,
    node_weights as node_weights,
    quadrature as quadrature,
    resolved_share as resolved_share,
    wavelet_variance as wavelet_variance,
)
from gmwm.process.state_space import StateSpace as StateSpace, block_diagonal as block_diagonal
from gmwm.process.wavelets import (
    ComplexArray as ComplexArray,
    gain_weights as gain_weights,
    unit_legendre as unit_legendre,
    wavelet as wavelet,
)
