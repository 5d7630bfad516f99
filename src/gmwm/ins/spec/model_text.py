"""Sensor models as people write them: ``{N: 140 deg/h/sqrt(Hz), GM: [[113 deg/h, 2000 s]]}``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from gmwm._core import checks
from gmwm._core.units import SI_UNIT, factor, si_parameter_unit
from gmwm.errors import InputError
from gmwm.ins.imu import AXES, SensorModels
from gmwm.process import (
    BiasInstability,
    GaussMarkov,
    Model,
    Process,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    WhiteNoise,
)

_LETTERS: dict[str, type[Process]] = {
    "N": WhiteNoise,
    "K": RandomWalk,
    "Q": QuantizationNoise,
    "B": BiasInstability,
    "R": RateRamp,
}
_MARKOV, _BIAS = "GM", "bias"
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)")


def value(given: Any, si_unit: str, where: str) -> float:
    """A number in SI units, from a number or from text such as ``"140 deg/h"``.

    Parameters
    ----------
    given : float or str
    si_unit : str
    where : str
        For the message.

    Raises
    ------
    InputError
        If it is no finite number, or its unit is of another dimension.
    """
    if checks.is_number(given):
        return float(given)
    match = _NUMBER.fullmatch(given) if isinstance(given, str) else None
    if match is None:
        raise InputError(
            f"{where}: {checks.shown(given)} is no number: write one, with a unit like {si_unit} "
            "or without for SI"
        )
    number, unit = match.groups()
    try:
        found = float(number) * (factor(unit, si_unit) if unit else 1.0)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    if not checks.is_number(found):
        raise InputError(f"{where}: {checks.shown(given)} is too large: check it")
    return found


def sensor_models(given: Mapping[str, Any], where: str) -> SensorModels:
    """Models of six sensors from a mapping by axis or kind.

    Parameters
    ----------
    given : mapping
        ``gyro``, ``accel`` or an axis such as ``gyro_x`` -> mapping of N, K, Q, B, R to a value,
        GM to a list of [sigma, tau], ``bias`` to the standard deviation of a constant.
    where : str
        For messages.

    Raises
    ------
    InputError
        If something is missing, unknown or no number.
    """
    models: dict[str, Model] = {}
    bias_sd: dict[str, float] = {}
    for name, content in given.items():
        quantity = str(name).partition("_")[0]
        if quantity not in SI_UNIT or (name not in AXES and name != quantity):
            raise InputError(
                f"{where}: {checks.shown(name)} is no sensor: write gyro, accel or one of "
                f"{', '.join(AXES)}"
            )
        place = f"{where}, {name}"
        if not isinstance(content, Mapping):
            raise InputError(f"{place}: {checks.shown(content)}: write N, K, GM, ... with values")
        terms = _terms(content, quantity, place)
        if not terms:
            raise InputError(f"{place}: there is no noise: give N at least")
        try:
            models[name] = Model(tuple(terms))
        except InputError as error:
            raise InputError(f"{place}: {error}") from None
        if _BIAS in content:
            bias_sd[name] = value(content[_BIAS], SI_UNIT[quantity], f"{place}, bias")
    try:
        return SensorModels.of(models, bias_sd)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _terms(content: Mapping[str, Any], quantity: str, where: str) -> list[Process]:
    terms: list[Process] = []
    for letter, given in content.items():
        if letter == _BIAS:
            continue
        if letter == _MARKOV:
            terms += _markov(given, quantity, f"{where}, {_MARKOV}")
        elif letter in _LETTERS:
            kind = _LETTERS[letter]
            unit = si_parameter_unit(kind.parameters[0].unit, quantity).replace(" s", "*s")
            place = f"{where}, {letter}"
            terms.append(_process(kind, place, value(given, unit, place)))
        else:
            raise InputError(
                f"{where}: {checks.shown(letter)} is no term: write {', '.join(_LETTERS)}, "
                f"{_MARKOV} or {_BIAS}"
            )
    return terms


def _markov(given: Any, quantity: str, where: str) -> list[Process]:
    pairs = given if isinstance(given, Sequence) and not isinstance(given, str) else None
    if pairs is None or not all(
        isinstance(pair, Sequence) and not isinstance(pair, str) and len(pair) == 2
        for pair in pairs
    ):
        raise InputError(f"{where}: {checks.shown(given)}: write [[sigma, tau], ...]")
    return [
        _process(GaussMarkov, where, value(sigma, SI_UNIT[quantity], where), value(tau, "s", where))
        for sigma, tau in pairs
    ]


def _process(kind: type[Process], where: str, *parameters: float) -> Process:
    try:
        return kind(*parameters)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
