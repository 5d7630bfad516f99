"""The numbers of an IMU for a file: found by `gmwm.bound` or `gmwm.reduce`, or given."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from gmwm._core import checks
from gmwm._core.text import brief
from gmwm._core.units import field_units
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.export.imu import LETTERS, SENSORS, Axis, ImuNumbers, Triad
from gmwm.filter_numbers import HORIZON, AxisFilterNumbers, FilterNumbers, usable
from gmwm.issues import Notice

_TOPIC = re.compile(r"/[A-Za-z0-9_/]+")  # a name of ROS, which no file can misread
_COVERED = ("more-than-white-noise", "more-than-random-walk")
_NOT_VALID = "fit-not-valid"


def numbers_of(
    given: Any, form: str, horizon: float | None, tau: str | None = None
) -> FilterNumbers:
    """Those found of a calibration, or given ones if they have the form and the horizon.

    tau: Of those found, as in `gmwm.bound`.
    Raises InputError if there are none.
    """
    if isinstance(given, Calibration):
        return usable(given, form, HORIZON if horizon is None else horizon, tau=tau)
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
    return given


def not_valid(given: Iterable[Any]) -> dict[str, Notice]:
    """Axes that are not valid, each with the notice that says why."""
    found = {}
    for source in given:
        for name, one in source.items() if isinstance(source, Calibration | FilterNumbers) else ():
            notices = [n for n in one.notices if n.severity == "bad" or n.code == _NOT_VALID]
            is_sensor = isinstance(one, AxisFilterNumbers) or one.wv.quantity in SENSORS
            if notices and is_sensor:
                # A departure from noise is why the model misses levels too.
                departures = (n for n in notices if n.issue.topic == "departure")
                found[name] = next(departures, notices[0])
    return found


def reason(notice: Notice) -> str:
    """Why an axis is not valid, in about five words."""
    return notice.issue.reason or notice.code.replace("-", " ")


def refusal(found: Mapping[str, Notice]) -> str:
    """Which axes are not valid, why, and what to do, by the notices of `not_valid`."""
    places = ", ".join(f"{name} ({reason(each)})" for name, each in found.items())
    hints = [each.hint for each in found.values() if each.hint]
    return f"not valid: {places}; {hints[0] if hints else 'read the notices of the calibration'}"


def numbers_for(
    given: Sequence[Any], form: str, horizon: float | None, one_tau: bool = False
) -> list[FilterNumbers]:
    """The numbers of each of several calibrations, or given ones, that make one IMU.

    horizon: s; by default that of the numbers or, of calibrations, `HORIZON`.
    one_tau: Whether they have one correlation time; given numbers lose their predictions with it.
    Raises InputError if a sensor is given twice, or numbers are of another form or horizon.
    """
    if horizon is not None:
        horizon = checks.positive("horizon", horizon, "give a positive time in seconds")
    found = [numbers_of(each, form, horizon, "shared" if one_tau else None) for each in given]
    names = Counter(name for each in found for name in each)
    if not names:
        raise InputError("no numbers to export: give a calibration")
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise InputError(f"{twice[0]} is given twice: give each sensor once")
    horizons = sorted({one.horizon for each in found for one in each.values()})
    if len(horizons) > 1:
        times = ", ".join(f"{each:g} s" for each in horizons)
        raise InputError(f"the numbers are for {times}: give numbers for one horizon")
    if not one_tau or len({one.tau for each in found for one in each.values()}) == 1:
        return found
    models = {n: one if isinstance(one, Fit) else one.model for s in given for n, one in s.items()}
    moved = usable(models, form, horizons[0], tau="shared")
    for place, (source, each) in enumerate(zip(given, found, strict=True)):
        own: dict[str, AxisFilterNumbers] = {name: moved[name] for name in each}
        if not isinstance(source, Calibration):
            own = {n: replace(o, model=moved[n].model, predicted=()) for n, o in each.items()}
        found[place] = replace(each, axes=own)
    return found


def imu_of(
    given: Sequence[Any],
    form: str,
    horizon: float | None = None,
    *,
    shared: bool = False,
    one_tau: bool = False,
) -> ImuNumbers:
    """The numbers of an IMU in a form, of calibrations or of numbers that were found before.

    given: Together they have gyros and accelerometers.
    horizon, one_tau: As of `numbers_for`.
    shared: Whether the axes of a sensor have one value in the file.
    Raises InputError if a sensor is missing or given twice, or numbers are of another form or
        horizon.
    """
    sources = numbers_for(given, form, horizon, one_tau)
    numbers = {name: one for each in sources for name, one in each.items()}
    first = next(iter(numbers.values()))
    calibrations = [each for each in given if isinstance(each, Calibration)]
    fits = {name: fit for each in calibrations for name, fit in each.items()}
    rates = {name: each.rate for each in sources for name in each}
    axes = [axis_of(name, one, rates[name], fits.get(name)) for name, one in numbers.items()]
    gyro, accel = (
        _triad(quantity, [a for a in axes if numbers[a.name].quantity == quantity], form)
        for quantity in SENSORS
    )
    if shared:
        gyro, accel = (_with_shared(each, fits, form, first.horizon) for each in (gyro, accel))
    lengths = [f", {each.duration:.0f} s static" * (each.duration > 0.0) for each in sources]
    return ImuNumbers(
        gyro,
        accel,
        form,
        first.horizon,
        first.method,
        tuple(f"{s.source or 'recording'}{n}" for s, n in zip(sources, lengths, strict=True)),
        {name: reason(each) for name, each in not_valid(given).items()},
        _topic(calibrations),
    )


def _triad(quantity: str, own: Sequence[Axis], form: str) -> Triad:
    """The axes of a quantity; raises InputError if a file could not hold them."""
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
    return Triad(quantity, tuple(own))


def _with_shared(triad: Triad, fits: Mapping[str, Fit], form: str, horizon: float) -> Triad:
    """With one value for all axes, and how consistent each axis is with it."""
    if all(axis.name in fits for axis in triad.axes):
        own = {axis.name: fits[axis.name] for axis in triad.axes}
        together = usable(own, form, horizon, shared=True)
        shared = {name: one.nees for name, one in together.items()}
        return replace(triad, common=next(iter(together.values())), shared_nees=shared)
    alike = (triad.N, triad.K, triad.initial_sd)
    known = [axis.name for axis in triad.axes if (axis.N, axis.K, axis.initial_sd) == alike]
    nees = {axis.name: axis.nees if axis.name in known else {} for axis in triad.axes}
    return replace(triad, shared_nees=nees)


def axis_of(name: str, numbers: AxisFilterNumbers, rate: float, fitted: Fit | None = None) -> Axis:
    """An axis by its numbers; ``rate`` in Hz, NaN for that of the fit."""
    sigma, tau = (values[0] if values else float("nan") for values in (numbers.sigma, numbers.tau))
    if fitted is not None and not rate > 0.0:  # channels of several rates
        rate = 1.0 / fitted.wv.dt
    limits = [key for n in numbers.notices if n.code == "upper-limit" for key in n.values]
    values = (numbers.N, numbers.K, sigma, tau, numbers.initial_sd, dict(numbers.nees), rate)
    return Axis(name, *values, frozenset(limits), numbers.notices, _covered(numbers, fitted))


def _covered(numbers: AxisFilterNumbers, fitted: Fit | None) -> str:
    """The largest term beside white noise and walk that N or K covers, e.g. "resonance 2 mg"."""
    shares: dict[str, float] = {}
    for notice in numbers.notices:
        if notice.code in _COVERED:
            for label, share in notice.values.items():
                shares[label] = max(share, shares.get(label, 0.0))
    if not shares:
        return ""
    label = max(shares, key=lambda each: shares[each])
    labels = fitted.model.term_labels() if fitted is not None else ()
    if fitted is None or label not in labels:
        return label
    term = fitted.model.terms[labels.index(label)]
    size, tau = term.linear_parameter, term.values.get("tau")
    text = label.rstrip(" 0123456789")
    if size is not None:
        units = field_units(size.unit, numbers.quantity)
        scale, unit = (units[0].per_si, units[0].unit) if units else (1.0, numbers.unit)
        text += f" {brief((term.values[size.name] or 0.0) * scale)} {unit}"
    return f"{text}, {brief(tau)} s" if tau else text


def _topic(calibrations: Sequence[Calibration]) -> str:
    """The topic of ROS that all calibrations come from; empty if there is none, or several."""
    notices = [notice for each in calibrations for notice in each.notices]
    names = {str(each.values.get("topic")) for each in notices if each.code == "topic"}
    name = names.pop() if len(names) == 1 else ""
    return name if _TOPIC.fullmatch(name) else ""
