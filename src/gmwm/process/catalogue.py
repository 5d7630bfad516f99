"""Every built-in process, and models from what was stored of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gmwm.errors import InputError
from gmwm.process.arma import AR, ARIMA, ARMA, MA
from gmwm.process.base import Process
from gmwm.process.gauss_markov import GaussMarkov, Resonance
from gmwm.process.low_pass import AveragedNoise, LowPassNoise
from gmwm.process.model import Model
from gmwm.process.noise import BiasInstability, QuantizationNoise, RandomWalk, RateRamp, WhiteNoise
from gmwm.process.sinusoid import Sinusoid

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
