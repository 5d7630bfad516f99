"""Sensor numbers of a fit: noise density, lowest Allan deviation, and random walk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from gmwm._core.text import brief
from gmwm._core.typing import FloatArray
from gmwm._core.units import customary_unit
from gmwm.calibration import tuning
from gmwm.errors import InputError
from gmwm.estimate import estimate
from gmwm.estimate.result import Fit
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process, RandomWalk, WhiteNoise

if TYPE_CHECKING:
    from gmwm.calibration.calibration import Calibration

_BOUNDS: WeakKeyDictionary[Fit, dict[str, float]] = WeakKeyDictionary()
"""Upper bounds of terms by fit, which does not change: each takes a fit of its own."""

_PLATEAU = np.sqrt(2.0 * np.log(2.0) / np.pi)


@dataclass(frozen=True)
class Floor:
    """Lowest point of the Allan deviation.

    deviation: SI.
    tau: Averaging time, s.
    falls: Whether the model still falls at the last averaging time: there may be no floor.
    """

    deviation: float
    tau: float
    falls: bool

    @property
    def bias_instability(self) -> float:
        """The B that would make a plateau of this height, by the convention of IEEE Std 952."""
        return float(self.deviation / _PLATEAU)


def white_density(fitted: Fit) -> float:
    """Density of the white noise that acts like the fast terms at averaging times of 1 s and more.

    The spectral density, far below the frequency of a second, of the terms that average out: white
    noise, Gauss-Markov processes of short correlation time, the foot of a resonance. Quantization
    noise and periodic lines leave none: their integrals stay bounded.

    Returns: in u/sqrt(Hz); zero if no term of the model is fast.
    """
    tau = np.array([1.0, 2.0]) * max(tuning.REFERENCE_TIME, 4.0 * fitted.wv.dt)
    total = 0.0
    low = tuning.LOW_FREQUENCY / tau
    for term in fitted.model.terms:
        if term.is_line:
            continue
        first, second = term.haar_variance(tau, fitted.wv.dt)
        if first > 0.0 and second < tuning.WHITE_RATIO * first:
            total += _foot(term, low, fitted.wv.dt) if term.has_spectrum() else 2.0 * tau[0] * first
    return float(np.sqrt(total))


def _foot(term: Process, frequency: FloatArray, dt: float) -> float:
    """Spectral density of a term at two low frequencies, zero where it is not flat, u^2/Hz."""
    density, lower = term.psd(frequency, dt)
    return float(density) if lower > tuning.FLAT * density else 0.0


def floor(fitted: Fit) -> Floor:
    """Lowest point of the fitted Allan deviation at averaging times with data.

    A model that runs below the data is not believed: where it does, the lower end of the data's
    interval (95 %) counts; and where it is lowest below all the data, the lowest of these.
    """
    at, wv = fitted.goodness, fitted.wv
    share = np.sqrt(wv.lower / np.maximum(wv.variance, np.finfo(float).tiny))
    deviation = np.fmax(np.sqrt(2.0 * fitted.implied), at.data * share)
    lowest = int(np.argmin(deviation))
    falls, seen = lowest == wv.tau.size - 1, int(np.argmin(at.data))
    if deviation[lowest] < at.data[seen]:
        return Floor(float(at.data[seen]), float(wv.tau[seen]), falls)
    return Floor(float(deviation[lowest]), float(wv.tau[lowest]), falls)


@dataclass(frozen=True)
class Level:
    """A noise level, or how large it may be.

    value: In the unit of the parameter.
    found: Whether the model has it; otherwise ``value`` is an upper bound of 95 %.
    """

    value: float
    found: bool


def noise_density(fitted: Fit) -> Level:
    """`white_density`, or the upper bound of a white noise where no term is fast."""
    density = white_density(fitted)
    return (
        Level(density, True) if density > 0.0 else Level(_bound(fitted, WhiteNoise(), "N"), False)
    )


def random_walk(fitted: Fit) -> Level:
    """The random walk of a model, or its upper bound where it has none."""
    present = fitted.params.get("K", 0.0)
    if present > 0.0 and "K" not in fitted.upper_bounds:
        return Level(present, True)
    return Level(_bound(fitted, RandomWalk(), "K"), False)


def _bound(fitted: Fit, process: Process, key: str) -> float:
    """Upper bound of a term added to the model and fitted together with it.

    Raises InputError if the data do not bound it.
    """
    # Given shapes, such as that of a line or of a low-pass, stay as they are.
    known = _BOUNDS.setdefault(fitted, {})
    if key in known:
        return known[key]
    opened = fitted.model.with_params(dict.fromkeys([*fitted.keys, *fitted.upper_bounds]))
    again = estimate(opened if key in fitted.params else opened + process, fitted.wv)
    bound = float(again.interval()[key][1])
    if not np.isfinite(bound):
        raise InputError(
            f"channel {fitted.wv.name!r}: {key} cannot be bounded by this record: record longer"
        )
    known[key] = bound
    return bound


def sentence(fitted: Fit) -> str:
    """The sensor's noise in a sentence, in data-sheet units."""
    density, low = white_density(fitted), floor(fitted)

    def shown(value: float, unit: str) -> str:
        label, per_si = customary_unit(unit, fitted.wv.quantity, fitted.wv.unit)
        return f"{value * per_si:.3g} {label}"

    noise = "No white noise"
    if density > 0.0:
        noise = f"Total white noise of {shown(density, 'u/sqrt(Hz)')}"
    end = " (the model still falls at the end of the record)" if low.falls else ""
    return (
        f"{noise}; averaging helps up to {low.tau:.4g} s, down to {shown(low.deviation, 'u')}{end}."
    )


# -- what a record leaves open ---------------------------------------------------------------------


UNRESOLVED = "unresolved-walk"
"""Code of the notice that a walk may be there that the model lacks."""


def with_largest_walk(fitted: Fit) -> Model | None:
    """The model with the random walk that is its upper bound (95 %), fitted beside it.

    None where the model has a walk or a ramp, or the walk would change little at `tuning.OPEN_AT`.
    """
    if any(term.is_drift for term in fitted.model.terms):
        return None
    try:
        walk = random_walk(fitted)
        if walk.found:
            return None
        noise = Model(tuple(t for t in fitted.model.terms if not isinstance(t, RandomWalk)))
        free = [key for key in (*fitted.keys, *fitted.upper_bounds) if key in noise.params]
        largest = estimate(
            noise.with_params(dict.fromkeys(free)) + RandomWalk(walk.value), fitted.wv
        ).model
    except InputError:  # of a record so short that nothing bounds it
        return None
    return largest if _growth(fitted, largest) > tuning.OPEN else None


def unresolved_notice(name: str, fitted: Fit, largest: Model) -> Notice:
    """Say how large the walk and its effect may be."""
    walk, tau = largest.params["K"] or 0.0, _time(fitted)
    value, unit = _shown(walk, fitted)
    growth = _growth(fitted, largest)
    values = {"K": walk, "tau": tau, "growth": growth}
    return notice(UNRESOLVED, name, values, shown=f"{value:.2g} {unit}", times=brief(growth))


def left_open(calibration: Calibration) -> dict[str, tuple[float, str]]:
    """By channel whose model has no walk, the largest K that the record leaves open; its unit."""
    open_walks = (notice for notice in calibration.notices if notice.code == UNRESOLVED)
    return {each.where: _shown(each.values["K"], calibration[each.where]) for each in open_walks}


def _shown(walk: float, fitted: Fit) -> tuple[float, str]:
    """K in its data-sheet unit, or SI."""
    unit, per_si = customary_unit("u/s/sqrt(Hz)", fitted.wv.quantity, fitted.wv.unit)
    return walk * per_si, unit


def _time(fitted: Fit) -> float:
    return max(tuning.OPEN_AT, fitted.wv.dt)


def _growth(fitted: Fit, largest: Model) -> float:
    """Ratio of the deviations of two models at the time that is looked at."""
    tau = np.array([_time(fitted)])
    there, least = (
        float(model.haar_variance(tau, fitted.wv.dt)[0]) for model in (largest, fitted.model)
    )
    return float(np.sqrt(there / least)) if least > 0.0 else float("inf")
