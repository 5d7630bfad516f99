"""The box "for your filter": certified numbers, their consistency, and the text to copy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import yaml

from gmwm._core.notices import Notice
from gmwm.calibration import Calibration, noise_density, random_walk
from gmwm.errors import InputError
from gmwm.export import TARGETS, export
from gmwm.filter_numbers import FilterNumbers, SensorNumbers, bound
from gmwm.process import RandomWalk, WhiteNoise

HORIZONS = (1.0, 10.0, 60.0, 600.0)
"""s: keyframes, a bridge, a tunnel, a long outage."""

SHOWN = 60.0
"""s: the horizon that a page opens with."""

_TARGETS = {"kalibr": True, "gtsam": False, "gtsam-cpp": False, "matlab": False}
"""Program -> whether its file has one value for all axes of a sensor."""

_LANGUAGES = {"kalibr": "YAML", "gtsam": "Python", "gtsam-cpp": "C++", "matlab": "MATLAB"}

Bounds = dict[str, dict[str, float]]
"""Channel -> letter -> upper bound of a term that its model does not have."""


@dataclass(frozen=True)
class Certified:
    """What a filter should believe for one time without aiding.

    Attributes
    ----------
    horizon : float
        s.
    axes : dict of str to FilterNumbers
        Channels whose numbers were found.
    upper : dict of str to dict
        Which of the numbers are upper bounds of 95 %, as ``upper[channel][letter]``.
    problem : str
        Why there are none, if there are none.
    texts : dict of str to str
        Title -> text for the clipboard.
    notes : tuple of str
        Why there is no text for some program.
    """

    horizon: float
    axes: Mapping[str, FilterNumbers]
    upper: Bounds
    problem: str
    texts: Mapping[str, str]
    notes: tuple[str, ...]

    def is_upper(self, name: str, letter: str) -> bool:
        return letter in self.upper.get(name, {})


def certified(calibration: Calibration) -> dict[float, Certified]:
    """The numbers by horizon; a horizon shorter than two samples is left out."""
    upper: Bounds = {}
    longest = max((fit.wv.dt for fit in calibration.values()), default=0.0)
    return {
        horizon: _at(calibration, horizon, upper)
        for horizon in HORIZONS
        if horizon >= 2.0 * longest or horizon == SHOWN
    }


def _at(calibration: Calibration, horizon: float, upper: Bounds) -> Certified:
    found: dict[str, FilterNumbers] = {}
    problem = ""
    for name, fitted in calibration.items():
        try:
            found[name] = _filled(bound(fitted, horizon=horizon), name, calibration, upper)
        except InputError as error:
            problem = f"{name}: {error}"
    own = _sensor(calibration, found)
    texts, notes = _by_axis(own), []
    try:
        inertial = replace(calibration, fits={
            name: fit for name, fit in calibration.items() if fit.wv.quantity and name in found
        })  # fmt: skip
        joint = bound(inertial, horizon=horizon, shared=True) if inertial.fits else own
        shared = _sensor(calibration, _together(joint, found, upper))
        inertial_own = _sensor(calibration, {name: found[name] for name in inertial})
        for target, is_shared in _TARGETS.items():
            program = TARGETS[target].title
            language = _LANGUAGES[target]
            title = program if program == language else f"{language}, {program}"
            texts[title] = export(shared if is_shared else inertial_own, target)
    except InputError as error:
        notes.append(str(error))
    return Certified(horizon, found, upper, problem, texts, tuple(notes))


def _sensor(calibration: Calibration, axes: Mapping[str, FilterNumbers]) -> SensorNumbers:
    return SensorNumbers(axes, calibration.source, calibration.rate, calibration.duration)


def _filled(
    numbers: FilterNumbers, name: str, calibration: Calibration, upper: Bounds
) -> FilterNumbers:
    """With upper bounds in place of zeros, by which filters divide."""
    fitted = calibration[name]
    notices = []
    values = {"N": numbers.N, "K": numbers.K}
    for letter, level, term in (
        ("N", noise_density, "white noise"), ("K", random_walk, "random walk"),
    ):  # fmt: skip
        if values[letter] > 0.0:
            continue
        known = upper.setdefault(name, {})
        if letter not in known:
            known[letter] = level(fitted).value
        values[letter] = known[letter]
        text = f"no {term} was found: {letter} is its 95 % upper bound"
        notices.append(Notice("upper-bound", "note", "", text))
    if not notices:
        return numbers
    model = WhiteNoise(values["N"]) + RandomWalk(values["K"])
    return replace(numbers, model=model, notices=(*numbers.notices, *notices))


def _together(
    joint: SensorNumbers, own: Mapping[str, FilterNumbers], upper: Bounds
) -> dict[str, FilterNumbers]:
    """The numbers that axes of a sensor share; of a term that none has, the largest bound."""
    shared = {}
    for name, each in joint.items():
        values = {"N": each.N, "K": each.K}
        for letter in values:
            group = joint.of(each.quantity)
            if all(letter in upper.get(other, {}) for other in group):
                values[letter] = max(getattr(own[other], letter) for other in group)
        model = WhiteNoise(values["N"]) + RandomWalk(values["K"])
        shared[name] = replace(each, model=model, notices=own[name].notices)
    return shared


def _by_axis(numbers: SensorNumbers) -> dict[str, str]:
    """Plain numbers of each axis, for a filter of one's own."""
    if not numbers:
        return {}
    axes = {
        name: {
            "N": float(f"{each.N:.6e}"),
            "K": float(f"{each.K:.6e}"),
            "initial_sd": float(f"{each.initial_sd:.6e}"),
        }
        for name, each in numbers.items()
    }
    about = (
        f"N [u/sqrt(Hz)], K [u/s/sqrt(Hz)], bias at the start [u]; u: rad/s, m/s^2; for "
        f"{numbers.horizon:g} s without aiding"
    )
    lines = [f"    {name!r}: {values!r}," for name, values in axes.items()]
    return {
        "YAML, axis by axis": f"# {about}\n{_yaml(axes)}",
        "Python, axis by axis": "\n".join([f"# {about}", "imu_noise = {", *lines, "}", ""]),
    }


def _yaml(content: Mapping[str, Any]) -> str:
    text: str = yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True)
    return text
