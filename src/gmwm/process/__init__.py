"""What an error process is: parameters, spectrum, wavelet variance, state space, simulation."""

from collections.abc import Mapping, Sequence
from typing import Any

from gmwm.errors import InputError
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
from gmwm.process.simulated import SimulatedProcess
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


def model_from_list(content: Sequence[Mapping[str, Any]]) -> Model:
    """The model whose terms were written with ``to_dict``.

    Raises
    ------
    InputError
        For a process that is neither built in nor defined in a module imported so far, or
        parameters it does not have.
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
    "SimulatedProcess",
    "Sinusoid",
    "StateSpace",
    "WhiteNoise",
    "as_model",
    "model_from_list",
]
