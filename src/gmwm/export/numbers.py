"""The numbers of an IMU for a file: found by `gmwm.bound` or `gmwm.reduce`, or given."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm.calibration import Calibration, upper_limit
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.export.imu import LETTERS, SENSORS, Axis, ImuNumbers, Outlook, Triad
from gmwm.filter_numbers import AxisFilterNumbers, FilterNumbers, bound, judged, reduce
from gmwm.process import Model, RandomWalk, WhiteNoise

OUTLOOK = (10.0, 60.0, 600.0)
"""s: horizons that comments compare."""

OUTAGES = (1.0 / 6.0, 0.5, 1.0)
"""Shares of the horizon for which reduced numbers are found: 10, 30 and 60 s of 60 s."""

_TOPIC = re.compile(r"/[A-Za-z0-9_/]+")  # a name of ROS, which no file can misread


def find_numbers(
    models: Calibration | Mapping[str, Any], form: str, horizon: float, tau: float | str | None
) -> FilterNumbers:
    """Numbers of a form that are never overconfident; ``tau`` as in `gmwm.bound`.

    No stationary process bounds a random walk. So "N+GM" numbers of a model with one are those that
    are consistent at the end of outages.
    """
    if form == "N+GM" and any(map(_has_walk, models.values())):
        return reduce(models, form, [share * horizon for share in OUTAGES], tau=tau)
    return bound(models, form, horizon=horizon, tau=tau)


def numbers_of(
    given: Any, form: str, horizon: float | None, usual: float, tau: float | None = None
) -> FilterNumbers:
    """Those found of a calibration, or given ones if they have the form and the horizon.

    tau: One correlation time for all axes, s; given numbers are then moved to it.
    Raises InputError if there are none.
    """
    if isinstance(given, Calibration):
        return find_numbers(given, form, usual if horizon is None else horizon, tau)
    if not isinstance(given, FilterNumbers):
        raise InputError(
            f"{checks.shown(given)} has no numbers to export: give a calibration, or a "
            "result of gmwm.bound or gmwm.reduce"
        )
    if given.form != form:
        raise InputError(
            f"the numbers have the form {given.form}, the file holds {form}: make numbers of that "
            "form, or export the calibration"
        )
    if horizon is not None and horizon != given.horizon:
        raise InputError(
            f"the numbers are for {given.horizon:g} s: leave the horizon out, or export the "
            "calibration"
        )
    if tau is None or all(one.tau == (tau,) for one in given.values()):
        return given
    moved = find_numbers({name: one.model for name, one in given.items()}, form, given.horizon, tau)
    axes = {
        name: replace(one, model=moved[name].model, predicted=()) for name, one in given.items()
    }
    return replace(given, axes=axes)


def imu_of(
    given: Sequence[Any],
    form: str,
    horizon: float | None,
    usual: float,
    shared: bool,
    outlook: Outlook | None = None,
    one_tau: bool = False,
) -> ImuNumbers:
    """The numbers of an IMU in a form, of calibrations or of numbers that were found before.

    given: Together they have gyros and accelerometers.
    horizon: s; by default that of the numbers or, of calibrations, the usual one.
    shared: Whether the axes of a sensor have one value in the file.
    outlook: N and K at other horizons, if known.
    one_tau: Whether there is one correlation time in the file.
    Raises InputError if a sensor is missing or given twice, or numbers are of another form or
        horizon.
    """
    if horizon is not None:
        horizon = checks.positive("horizon", horizon, "give a positive time in seconds")
    numbers = [numbers_of(each, form, horizon, usual) for each in given]
    names = Counter(name for each in numbers for name in each)
    if not names:
        raise InputError("no numbers to export: give a calibration")
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
    calibrations = [each for each in given if isinstance(each, Calibration)]
    fits = {name: fit for each in calibrations for name, fit in each.items()}
    axes = {
        name: axis_of(name, one, each.rate, fits.get(name), tau)
        for each in numbers
        for name, one in each.items()
    }
    gyro, accel = (_triad(quantity, numbers, axes, form) for quantity in SENSORS)
    if shared:
        gyro, accel = (_with_shared(t, given, numbers, fits, form) for t in (gyro, accel))
    if outlook is None:
        outlook = _outlook(calibrations) if len(calibrations) == len(given) else {}
    method = next(one.method for each in numbers for one in each.values())
    return ImuNumbers(
        gyro,
        accel,
        form,
        horizons[0],
        method,
        sources=tuple(
            f"{each.source or 'recording'}"
            + (f", {each.duration:.0f} s static" if each.duration > 0.0 else "")
            for each in numbers
        ),
        outlook=outlook,
        remarks=_remarks(given, numbers),
        cautions=_remarks(given, numbers, cautions=True),
        topic=_topic(calibrations),
    )


def _triad(
    quantity: str, numbers: Sequence[FilterNumbers], axes: Mapping[str, Axis], form: str
) -> Triad:
    """The axes of a quantity; raises InputError if a file could not hold them."""
    own = tuple(axes[name] for each in numbers for name in each.of(quantity))
    if not own:
        raise InputError(
            f"the file needs gyro and accelerometer, there is no {SENSORS[quantity]}: calibrate "
            "both, or give a second file that has it"
        )
    if len(own) > len(LETTERS):
        raise InputError(
            f"{', '.join(axis.name for axis in own)} are more than three axes: export one IMU at "
            "a time"
        )
    for axis in own:
        for key in ("N", "K" if "K" in form else "sigma"):
            if not getattr(axis, key) > 0.0:
                raise InputError(
                    f"{key} of {axis.name} is zero, and filters divide by it: give a number, "
                    "or export the calibration, which has an upper limit"
                )
    return Triad(quantity, own)


def _with_shared(
    triad: Triad,
    given: Sequence[Any],
    numbers: Sequence[FilterNumbers],
    fits: Mapping[str, Fit],
    form: str,
) -> Triad:
    """With one value for all axes: their common bound, and how consistent each axis is with it."""
    sources = [(s, n) for s, n in zip(given, numbers, strict=True) if n.of(triad.quantity)]
    source, first = sources[0]
    if len(sources) == 1 and isinstance(source, Calibration):
        together = bound(source, form, horizon=first.horizon, shared=True)
        triad = replace(triad, common=together[triad.axes[0].name])
    model = WhiteNoise(triad.N) + RandomWalk(triad.K)
    alike = replace(first[triad.axes[0].name], model=model, initial_sd=triad.initial_sd)
    return replace(triad, shared_nees={axis.name: _nees(axis, alike, fits) for axis in triad.axes})


def _nees(axis: Axis, numbers: AxisFilterNumbers, fits: Mapping[str, Fit]) -> Mapping[float, float]:
    """Consistency of an axis with numbers in place of its own; empty if unknown."""
    if axis.name in fits:
        return judged({axis.name: fits[axis.name]}, numbers).nees
    own = (axis.model.params, axis.initial_sd)
    return axis.nees if own == (numbers.model.params, numbers.initial_sd) else {}


def axis_of(
    name: str, numbers: AxisFilterNumbers, rate: float, fitted: Fit | None, tau: float | None = None
) -> Axis:
    """An axis by its numbers; consumers reject zeros, so upper limits of its fit replace them."""
    sigma, own = (values[0] if values else float("nan") for values in (numbers.sigma, numbers.tau))
    values = (numbers.N, numbers.K, sigma, own, numbers.initial_sd, dict(numbers.nees))
    axis = Axis(name, *values, rate, notices=numbers.notices)
    if fitted is None:
        return axis
    if not rate > 0.0:  # channels of several rates
        axis = replace(axis, rate=1.0 / fitted.wv.dt)
    if axis.N <= 0.0:
        axis = replace(axis, N=upper_limit(fitted, "N"), upper=axis.upper | {"N"})
    if "K" in numbers.form and axis.K <= 0.0:
        axis = replace(axis, K=upper_limit(fitted, "K"), upper=axis.upper | {"K"})
    if "GM" in numbers.form and not axis.sigma > 0.0:
        tau = numbers.horizon if tau is None else tau
        # At high frequencies this process rises as a random walk of this K does.
        sigma = upper_limit(fitted, "K") * float(np.sqrt(tau / 2.0))
        axis = replace(axis, sigma=sigma, tau=tau, upper=axis.upper | {"sigma"})
    if axis.upper:
        filled = replace(numbers, model=axis.model)
        axis = replace(axis, nees=dict(_nees(axis, filled, {name: fitted})))
    return axis


def _common_tau(given: Sequence[Any], numbers: Sequence[FilterNumbers], form: str) -> float:
    """The one correlation time for all axes that costs least over them, s."""
    slow = [one for each in numbers for one in each.values() if one.sigma[0] > 0.0]
    horizon = numbers[0].horizon
    taus = {one.tau[0] for one in slow} or {horizon}
    if len(taus) == 1:
        return taus.pop()
    axes = {name: one for each in given for name, one in each.items()}
    models = {
        n: one.model if isinstance(one, AxisFilterNumbers) else one for n, one in axes.items()
    }
    return next(iter(find_numbers(models, form, horizon, "shared").values())).tau[0]


def _has_walk(axis: Fit | Model) -> bool:
    return any(term.is_walk for term in (axis.model if isinstance(axis, Fit) else axis).terms)


def _outlook(calibrations: Sequence[Calibration]) -> Outlook:
    """N and K for all axes at other horizons."""
    found: dict[str, dict[float, tuple[float, float]]] = {quantity: {} for quantity in SENSORS}
    for horizon in OUTLOOK:
        numbers = [bound(each, "N+K", horizon=horizon, shared=True) for each in calibrations]
        for quantity, by_horizon in found.items():
            own = [one for each in numbers for one in each.of(quantity).values()]
            by_horizon[horizon] = (max(one.N for one in own), max(one.K for one in own))
    return found


def _remarks(
    given: Sequence[Any], numbers: Sequence[FilterNumbers], *, cautions: bool = False
) -> tuple[str, ...]:
    """Each notice once, after its channels: of fits that are not valid, or else the others."""
    places: dict[str, list[str]] = {}
    for source, each in zip(given, numbers, strict=True):
        walks = [name for name, fit in source.items() if isinstance(fit, Fit) and _has_walk(fit)]
        if walks and "K" not in each.form and not cautions:
            text = f"a random walk, which {each.form} cannot bound: gmwm.reduce, not gmwm.bound"
            places[text] = walks
        for notice in each.notices:
            if (notice.code == "fit-not-valid") is cautions:
                places.setdefault(str(replace(notice, where="")), []).append(notice.where)
    return tuple(f"{', '.join(where)}: {text}" for text, where in places.items())


def _topic(calibrations: Sequence[Calibration]) -> str:
    """The topic of ROS that all calibrations come from; empty if there is none, or several."""
    notices = [notice for each in calibrations for notice in each.notices]
    names = {str(each.values.get("topic")) for each in notices if each.code == "topic"}
    name = names.pop() if len(names) == 1 else ""
    return name if _TOPIC.fullmatch(name) else ""
