"""The numbers of an IMU, as they are found for a file: bounded, reduced or given."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm.calibration import Calibration, noise_density, random_walk
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.export import tuning
from gmwm.export.imu import LETTERS, SENSORS, Axis, Imu, Outlook, Triad
from gmwm.filter_numbers import FilterNumbers, SensorNumbers, bound, judged, reduce
from gmwm.process import Model, RandomWalk, WhiteNoise

_TOPIC = re.compile(r"/[A-Za-z0-9_/]+")  # a name of ROS, which no file can misread


def imu_of(
    given: Sequence[Any],
    form: str,
    horizon: float | None,
    usual: float,
    shared: bool,
    outlook: Outlook | None = None,
    one_tau: bool = False,
) -> Imu:
    """The numbers of an IMU in a form, of calibrations or of numbers that were found before.

    given: Together they have gyros and accelerometers.
    horizon: s; by default that of the numbers or, of calibrations, the usual one.
    shared: Whether the axes of a sensor have one value in the file.
    outlook: That of `Imu`, where it is known.
    one_tau: Whether there is one correlation time in the file.
    Raises InputError if a sensor is missing or given twice, or numbers are of another form or
        horizon.
    """
    if horizon is not None:
        horizon = checks.positive("horizon", horizon, "give a positive time in seconds")
    numbers = [numbers_of(each, form, horizon, usual) for each in given]
    names = Counter(name for each in numbers for name in each)
    if not names:
        raise InputError("there are no numbers to export: give a calibration")
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise InputError(f"{twice[0]} is given twice: give each sensor once")
    horizons = sorted({one.horizon for each in numbers for one in each.values()})
    if len(horizons) > 1:
        times = ", ".join(f"{each:g} s" for each in horizons)
        raise InputError(f"the numbers are for {times}: give numbers for one horizon")
    tau = None
    if one_tau:
        tau = _common_tau(given, numbers, form)
        numbers = [numbers_of(each, form, horizon, usual, tau) for each in given]
    # The axes of a file that has one value for them are judged by that.
    together = [
        bound(each, form, horizon=horizons[0], shared=True)
        if shared and isinstance(each, Calibration)
        else None
        for each in given
    ]
    sources = list(zip(given, numbers, together, strict=True))
    fits = {
        name: fit for each in given if isinstance(each, Calibration) for name, fit in each.items()
    }
    triads = {each: _triad(each, sources, fits, form, shared, tau) for each in SENSORS}
    return Imu(
        triads["gyro"], triads["accel"], form, horizons[0],
        next(one.method for each in numbers for one in each.values()),
        sources=tuple(map(_source, numbers)),
        outlook=_outlook(given) if outlook is None else outlook,
        remarks=_remarks(given, numbers),
        cautions=_remarks(given, numbers, cautions=True),
        topic=_topic(given),
    )  # fmt: skip


def _triad(
    quantity: str,
    sources: Sequence[tuple[Any, SensorNumbers, SensorNumbers | None]],
    fits: Mapping[str, Fit],
    form: str,
    shared: bool,
    tau: float | None,
) -> Triad:
    """The axes of a quantity, of what was given, its numbers and those that its axes share."""
    axes: list[Axis] = []
    common = None
    holding = [each for each in sources if each[1].of(quantity)]
    for source, numbers, together in holding:
        for name, one in numbers.of(quantity).items():
            rate = numbers.rate
            if isinstance(source, Calibration) and not source.has_one_rate:
                rate = 1.0 / source[name].wv.dt
            axes.append(axis_of(name, one, rate, fits.get(name), tau))
            if together is not None and len(holding) == 1:
                common = together[name]
    sensor = SENSORS[quantity]
    if not axes:
        raise InputError(
            f"the file needs gyro and accelerometer, there is no {sensor}: calibrate both, or "
            "give a second file that has it"
        )
    if len(axes) > len(LETTERS):
        raise InputError(
            f"{', '.join(axis.name for axis in axes)} are more than three axes: export one IMU at "
            "a time"
        )
    for axis in axes:
        for key in ("N", "K" if "K" in form else "sigma"):
            if not getattr(axis, key) > 0.0:
                raise InputError(
                    f"{key} of {axis.name} is zero, by which filters divide: give numbers with "
                    "one, or export the calibration, which knows an upper bound"
                )
    triad = Triad(quantity, tuple(axes), common)
    if not shared:
        return triad
    alike = next(iter(holding[0][1].of(quantity).values()))
    model = WhiteNoise(triad.N) + RandomWalk(triad.K)
    alike = replace(alike, model=model, initial_sd=triad.initial_sd)
    return replace(triad, shared_nees={axis.name: _nees(axis, alike, fits) for axis in axes})


def _nees(axis: Axis, numbers: FilterNumbers, fits: Mapping[str, Fit]) -> Mapping[float, float]:
    """Consistency of an axis with numbers in place of its own; empty if that is not known."""
    if axis.name in fits:
        return judged({axis.name: fits[axis.name]}, numbers).nees
    own = (axis.model.params, axis.initial_sd)
    return axis.nees if own == (numbers.model.params, numbers.initial_sd) else {}


def numbers_of(
    given: Any, form: str, horizon: float | None, usual: float, tau: float | None = None
) -> SensorNumbers:
    """Numbers of a form: those that bound a calibration, or given ones if they have it.

    Where a calibration has a random walk and the form none, they are those of `gmwm.reduce`. Those
    with one correlation time for all axes, where it is given (s), bound the given ones.

    Raises InputError if they have not.
    """
    if isinstance(given, Calibration):
        return _found(given, form, usual if horizon is None else horizon, tau)
    if not isinstance(given, SensorNumbers):
        raise InputError(
            f"{checks.shown(given)} has no numbers to export: give a calibration, or what "
            "gmwm.bound or gmwm.reduce made of one"
        )
    if given.form != form:
        raise InputError(f"the numbers have the form {given.form}, the file holds {form}: make "
                         f"numbers of that form, or export the calibration")  # fmt: skip
    if horizon is not None and horizon != given.horizon:
        raise InputError(
            f"the numbers are for {given.horizon:g} s: leave the horizon out, or export the "
            "calibration"
        )
    if tau is None or all(one.tau == (tau,) for one in given.values()):
        return given
    moved = _found({name: one.model for name, one in given.items()}, form, given.horizon, tau)
    axes = {
        name: replace(one, model=moved[name].model, predicted=()) for name, one in given.items()
    }
    return replace(given, axes=axes)


def _found(
    source: Calibration | Mapping[str, Any], form: str, horizon: float, tau: float | str | None
) -> SensorNumbers:
    """Those of `gmwm.bound`, or of `gmwm.reduce` where no number of the form is a bound."""
    if form == "N+GM" and any(_walks(each) for each in source.values()):
        # No stationary process bounds a random walk; the best one for outages is found.
        return reduce(source, form, [share * horizon for share in tuning.OUTAGES], tau=tau)
    return bound(source, form, horizon=horizon, tau=tau)


def _common_tau(given: Sequence[Any], numbers: Sequence[SensorNumbers], form: str) -> float:
    """The one correlation time for all axes that costs least over them, s."""
    slow = [one for each in numbers for one in each.values() if one.sigma[0] > 0.0]
    horizon = numbers[0].horizon
    taus = {one.tau[0] for one in slow} or {horizon}
    if len(taus) == 1:
        return taus.pop()
    models = {
        name: one.model if isinstance(one, FilterNumbers) else one
        for each in given
        for name, one in each.items()
    }
    return next(iter(_found(models, form, horizon, "shared").values())).tau[0]


def axis_of(
    name: str, numbers: FilterNumbers, rate: float, fitted: Fit | None, tau: float | None = None
) -> Axis:
    """An axis by its numbers, with upper bounds of its fit in place of zeros."""
    sigma, own = (values[0] if values else float("nan") for values in (numbers.sigma, numbers.tau))
    axis = Axis(
        name, numbers.N, numbers.K, sigma, own, numbers.initial_sd, dict(numbers.nees), rate,
        notices=numbers.notices,
    )  # fmt: skip
    if fitted is None:
        return axis
    # A term that the model does not have is given by its upper bound: consumers refuse zeros.
    if axis.N <= 0.0:
        axis = replace(axis, N=noise_density(fitted).value, upper=axis.upper | {"N"})
    if "K" in numbers.form and axis.K <= 0.0:
        axis = replace(axis, K=random_walk(fitted).value, upper=axis.upper | {"K"})
    if "GM" in numbers.form and not axis.sigma > 0.0:
        tau = numbers.horizon if tau is None else tau
        # The random walk of this K rises at high frequencies as this process does.
        sigma = random_walk(fitted).value * float(np.sqrt(tau / 2.0))
        axis = replace(axis, sigma=sigma, tau=tau, upper=axis.upper | {"sigma"})
    if axis.upper:
        filled = replace(numbers, model=axis.model)
        axis = replace(axis, nees=dict(_nees(axis, filled, {name: fitted})))
    return axis


def _walks(axis: Fit | Model) -> bool:
    return any(term.is_walk for term in (axis.model if isinstance(axis, Fit) else axis).terms)


def _outlook(given: Sequence[Any]) -> Outlook:
    """N and K for all axes at other horizons, where the models are known."""
    if not all(isinstance(each, Calibration) for each in given):
        return {}
    found: dict[str, dict[float, tuple[float, float]]] = {quantity: {} for quantity in SENSORS}
    for horizon in tuning.OUTLOOK:
        numbers = [bound(each, "N+K", horizon=horizon, shared=True) for each in given]
        for quantity, by_horizon in found.items():
            own = [one for each in numbers for one in each.of(quantity).values()]
            by_horizon[horizon] = (max(one.N for one in own), max(one.K for one in own))
    return found


def _remarks(
    given: Sequence[Any], numbers: Sequence[SensorNumbers], *, cautions: bool = False
) -> tuple[str, ...]:
    """Each notice once, after the channels that it is about: of fits that are not valid, or else
    the others.
    """
    places: dict[str, list[str]] = {}
    for source, each in zip(given, numbers, strict=True):
        walks = [name for name, fit in source.items() if isinstance(fit, Fit) and _walks(fit)]
        if walks and "K" not in each.form and not cautions:
            text = f"a random walk, which {each.form} cannot bound: gmwm.reduce, not gmwm.bound"
            places[text] = walks
        for notice in each.notices:
            if (notice.code == "fit-not-valid") is cautions:
                places.setdefault(str(replace(notice, where="")), []).append(notice.where)
    return tuple(f"{', '.join(where)}: {text}" for text, where in places.items())


def _topic(given: Sequence[Any]) -> str:
    """The one topic of ROS that calibrations are of; empty where there is none, or several."""
    names = {
        str(notice.values.get("topic"))
        for each in given
        if isinstance(each, Calibration)
        for notice in each.notices
        if notice.code == "topic"
    }
    name = names.pop() if len(names) == 1 else ""
    return name if _TOPIC.fullmatch(name) else ""


def _source(numbers: SensorNumbers) -> str:
    source = numbers.source or "recording"
    return f"{source}, {numbers.duration:.0f} s static" if numbers.duration > 0.0 else source
