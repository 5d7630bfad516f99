"""From error models to the error budget of an unaided inertial navigation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from gmwm._core.typing import BoolArray
from gmwm._core.units import factor
from gmwm.budget.budget import HORIZONTAL, QUANTITIES, ErrorBudget, ErrorRow, axis
from gmwm.budget.integrals import integral_rms
from gmwm.errors import InputError
from gmwm.estimate.result import Fit
from gmwm.process import Model, Process, as_model

TIMES = (1.0, 10.0, 60.0, 600.0)
"""Coasting times that people ask for, s."""

LONGEST = 600.0
"""Coasting time up to which the formulas hold to within 10 %, s."""

_GRAVITY = factor("g", "m/s^2")
_SMALL_ANGLE = np.radians(10.0)
_RECORD_SHARE = 0.1  # of a record: errors over longer times are seen fewer than ten times
_CURVE_POINTS = 33
_SENSORS = ("gyro", "accel")
_HORIZONTAL_CHANNELS = ("gyro_x", "gyro_y", "accel_x", "accel_y")


class _Fits(Protocol):
    @property
    def fits(self) -> Mapping[str, Fit]: ...


Source = Fit | _Fits | Mapping[str, Process | Model | Fit]
"""A calibration, a fit, or channel name -> model."""


def error_budget(
    source: Source,
    times: Sequence[float] = TIMES,
    *,
    dt: float | None = None,
    calibrated: bool = True,
) -> ErrorBudget:
    """Predicted growth of attitude, velocity and position errors without aiding.

    A platform stays level and does not manoeuvre; its initial attitude, velocity and position are
    right. A gyro's error is integrated to an attitude error; the tilt times gravity is an
    acceleration, integrated to velocity and position. An accelerometer's error is integrated to
    velocity and position. A gyro named ``..._z`` is the heading's and tilts nothing.

    Short-term only: no Schuler oscillation (84 min) and no Earth rate. Up to 600 s constant errors
    come out at most 10 % too large; beyond, the numbers are no longer what a navigator shows.

    Parameters
    ----------
    source : Calibration, Fit or mapping
        A mapping takes channel names that begin with "gyro" or "accel" to a `Process`, `Model` or
        `Fit`.
    times : sequence of float, optional
        Coasting times, s.
    dt : float, optional
        Sampling interval of models that are not fitted, s.
    calibrated : bool, optional
        True: the initial value of every state of the models is known, as from a filter before an
        outage; its covariance is zero. False: nothing is known, stationary processes start in their
        stationary state. In both cases a random walk starts at zero, a line has a random phase, and
        flicker noise, of which True knows the past, is counted from its first sample by False. A
        constant bias is not part of a model: False counts what varies about the mean of the
        recording.

    Returns
    -------
    ErrorBudget
        Terms are independent: their squares add up. A rate ramp counts by its absolute value.

    Raises
    ------
    InputError
        If a model has free parameters or is known by simulation only, no channel is a gyro or an
        accelerometer, or a time is shorter than the sampling interval.

    Notes
    -----
    Titterton & Weston, *Strapdown Inertial Navigation Technology*, 2nd ed. 2004, ch. 12; Groves,
    *Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems*, 2nd ed. 2013,
    sec. 5.7. White noise N gives an angle N t^(1/2), as an accelerometer's a position
    N t^(3/2)/3^(1/2), as a gyro's g N t^(5/2)/20^(1/2). See `gmwm.budget.integrals`.
    """
    channels = _channels(source)
    known = {name: item for name, item in channels.items() if _quantity(name, item) is not None}
    if not known:
        raise InputError(
            "the error budget needs a gyro or an accelerometer: give channels of that quantity, or "
            "models by names such as gyro_x and accel_z"
        )
    steps = {name: _interval(name, item, dt) for name, item in known.items()}
    chosen = _checked(times, max(steps.values()))
    grid = _grid(chosen, max(steps.values()))
    rows = [
        row
        for name, item in known.items()
        for row in _channel_rows(name, item, steps[name], chosen, grid, calibrated)
    ]
    budget = ErrorBudget(chosen, tuple(rows), calibrated, grid)
    return replace(budget, notes=tuple(_notes(channels, budget)))


def _channels(source: Source) -> Mapping[str, Process | Model | Fit]:
    if isinstance(source, Fit):
        return {source.wv.name or "channel": source}
    fits = getattr(source, "fits", source)
    if not isinstance(fits, Mapping):
        raise InputError(
            f"{type(source).__name__} has no channels: give a Calibration, a Fit, or models by "
            "channel name"
        )
    return fits


def _quantity(name: str, item: Process | Model | Fit) -> str | None:
    if isinstance(item, Fit) and item.wv.quantity is not None:
        return item.wv.quantity
    return next((sensor for sensor in _SENSORS if name.startswith(sensor)), None)


def _interval(name: str, item: Process | Model | Fit, dt: float | None) -> float:
    if isinstance(item, Fit):
        return item.wv.dt
    if dt is None:
        raise InputError(f"{name} is a model without data: give its sampling interval, dt=0.01")
    if not (np.isfinite(dt) and dt > 0.0):
        raise InputError(f"dt = {dt!r}: give a positive sampling interval in seconds")
    return float(dt)


def _checked(times: Sequence[float], dt: float) -> tuple[float, ...]:
    try:
        values = np.unique(np.asarray(times, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"times = {times!r}: give numbers of seconds, e.g. (1, 60)") from None
    if values.size == 0 or not np.all(np.isfinite(values)):
        raise InputError(f"times = {times!r}: give numbers of seconds, e.g. (1, 60)")
    if values[0] < dt * (1.0 - 1e-6):
        raise InputError(
            f"a coasting time of {values[0]:g} s is shorter than the sampling interval of {dt:g} "
            "s: give longer times"
        )
    return tuple(values.tolist())


def _grid(times: tuple[float, ...], dt: float) -> tuple[float, ...]:
    first = times[0] if len(times) > 1 else max(0.01 * times[0], min(dt, times[0]))
    return tuple(np.geomspace(first, times[-1], _CURVE_POINTS).tolist())


def _notes(channels: Mapping[str, Process | Model | Fit], budget: ErrorBudget) -> list[str]:
    notes = []
    skipped = [name for name in channels if name not in budget.channels]
    if skipped:
        notes.append(f"neither gyro nor accelerometer, left out: {', '.join(skipped)}")
    doubtful = [
        name
        for name, item in channels.items()
        if name in budget.channels and isinstance(item, Fit) and not item.valid
    ]
    if doubtful:
        model, are = ("models", "are") if doubtful[1:] else ("model", "is")
        of = ", ".join(doubtful)
        notes.append(f"the {model} of {of} {are} not valid: read the notices first")
    lengths = [item.wv.n * item.wv.dt for item in channels.values() if isinstance(item, Fit)]
    if lengths and budget.times[-1] > _RECORD_SHARE * min(lengths):
        notes.append(
            f"a record of {min(lengths):.4g} s shows little of what happens over more than "
            f"{_RECORD_SHARE * min(lengths):.3g} s"
        )
    present = {f"{_quantity(name, channels[name])}_{axis(name)}" for name in budget.channels}
    missing = [name for name in _HORIZONTAL_CHANNELS if name not in present]
    if HORIZONTAL in budget.groups and missing:
        notes.append(f"the horizontal total lacks {', '.join(missing)}")
    steep = is_steep(budget)
    if np.any(steep):
        notes.append(
            f"at {budget.times[int(np.argmax(steep))]:g} s the tilt exceeds "
            f"{np.degrees(_SMALL_ANGLE):.0f} deg: from there on take velocity and position for "
            "orders of magnitude"
        )
    if budget.times[-1] > LONGEST:
        notes.append(
            f"beyond {LONGEST:g} s the Schuler oscillation (84 min) bounds what grows here without "
            "end"
        )
    return notes


def _channel_rows(
    name: str,
    item: Process | Model | Fit,
    dt: float,
    times: tuple[float, ...],
    grid: tuple[float, ...],
    calibrated: bool,
) -> list[ErrorRow]:
    model = item.model if isinstance(item, Fit) else as_model(item)
    if model.is_open:
        raise InputError(f"{name}: {model!r} has free parameters, give them a value or fit it")
    if _quantity(name, item) == "accel":
        scales = {"velocity": 1.0, "position": 1.0}
    elif axis(name) == "z":
        scales = {"attitude": 1.0}
    else:
        scales = {"attitude": 1.0, "velocity": _GRAVITY, "position": _GRAVITY}
    labels = [
        f"{label}, |R|" if term.is_drift else label
        for label, term in zip(model.term_labels(), model.terms, strict=True)
    ]
    growths = [
        integral_rms(term, (*times, *grid), dt, known_start=calibrated) for term in model.terms
    ]
    rows = []
    for order, (quantity, scale) in enumerate(scales.items()):
        for label, growth in zip(labels, growths, strict=True):
            values = tuple((scale * growth[order]).tolist())
            unit, cut = QUANTITIES[quantity], len(times)
            rows.append(ErrorRow(name, label, quantity, unit, values[:cut], values[cut:]))
    return rows


def is_steep(budget: ErrorBudget) -> BoolArray:
    """At which of its times the tilt is beyond a small angle: orders of magnitude from there on."""
    tilts = [
        budget.total(of)["attitude"]
        for of in budget.groups
        if axis(of) != "z" and "attitude" in budget.quantities(of)
    ]
    largest = np.max(tilts, axis=0, initial=0.0) * np.ones(len(budget.times))
    return np.maximum.accumulate(largest) > _SMALL_ANGLE
