"""Errors of the six inertial sensors: models, and static recordings cut into stretches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.calibration import BiasCurve, Calibration, with_noise
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process, as_model
from gmwm.readers import Recording

AXES = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
"""The sensors, in the order of all arrays."""

_KINDS = ("gyro", "accel")
_RATE_TOLERANCE = 1e-3


@dataclass(frozen=True)
class SensorModels:
    """One error model an axis, and how well constant biases are known before.

    Attributes
    ----------
    models : dict
        Axis of `AXES` -> model with given parameters, rad/s and m/s^2.
    bias_sd : dict
        Axis -> standard deviation of a constant bias, in the axis' unit; zero for none.
    not_valid : tuple of str
        Axes whose models come from fits that are not valid.
    curves : dict
        Axis -> `BiasCurve` of a calibration against a temperature.
    """

    models: dict[str, Model]
    bias_sd: dict[str, float] = field(default_factory=lambda: dict.fromkeys(AXES, 0.0))
    not_valid: tuple[str, ...] = field(default=(), repr=False)
    curves: dict[str, BiasCurve] = field(default_factory=dict, repr=False)

    @classmethod
    def of(
        cls,
        source: SensorModels | Calibration | Mapping[str, Any],
        bias_sd: Mapping[str, float] | None = None,
    ) -> SensorModels:
        """Models of all six axes from what there is.

        Raises InputError if an axis has no model, a parameter is open, or a name is unknown.

        Parameters
        ----------
        source : SensorModels, Calibration, FilterNumbers or mapping
            A mapping has models by axis (``"gyro_x"``) or by kind (``"gyro"`` and ``"accel"``, the
            same for its three axes); an axis goes before its kind.
        bias_sd : mapping of str to float, optional
            By axis or kind, in rad/s and m/s^2; by default those of filter numbers, or none.
        """
        if isinstance(source, SensorModels):
            if bias_sd is None:
                return source
            return replace(source, bias_sd=_standard_deviations(bias_sd))
        not_valid: tuple[str, ...] = ()
        curves: dict[str, BiasCurve] = {}
        if isinstance(source, Calibration):
            curves = {name: each for name, each in source.curves.items() if name in AXES}
            not_valid = tuple(axis for axis in AXES if axis in source and not source[axis].valid)
            source = {name: fit.model for name, fit in source.fits.items() if name in AXES}
        if not isinstance(source, Mapping):
            raise InputError(
                f"sensor models: {checks.shown(source)}: give a calibration, or models as in "
                '{"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)}'
            )
        if all(hasattr(each, "initial_sd") for each in source.values()):  # filter numbers
            known: dict[str, Any] = {name: each for name, each in source.items() if name in AXES}
            bias_sd = bias_sd or {name: each.initial_sd for name, each in known.items()}
            source = {name: each.model for name, each in known.items()}
        given = _by_axis(source, "models")
        for axis in AXES:
            if axis not in given:
                raise InputError(f"sensor models: {axis} has none: give one to each axis")
        models = {axis: _model(axis, given[axis]) for axis in AXES}
        return cls(models, _standard_deviations(bias_sd or {}), not_valid, curves)

    def with_noise(self, factors: Mapping[str, float]) -> SensorModels:
        """The same with the fast noise of axes so many times as large."""
        models = {axis: with_noise(m, factors.get(axis, 1.0)) for axis, m in self.models.items()}
        return replace(self, models=models)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """That models come from fits that are not valid."""
        if not self.not_valid:
            return ()
        axes, count = ", ".join(self.not_valid), len(self.not_valid)
        hint = "read the notices of the calibration first"
        are = "are" if count > 1 else "is"
        return (notice("fit-not-valid", axes, variant="filter", hint=hint, count=count, are=are),)

    def simulate(
        self,
        n: int,
        dt: float,
        rng: np.random.Generator,
        covariates: Mapping[str, FloatArray] | None = None,
    ) -> SensorErrors:
        """Draw errors of all axes, n samples of ``dt`` (s); constant biases are drawn too.

        covariates: Values of the curves' covariates at all samples, such as ``{"temperature": t}``:
            the curves are added, and the fast noise grows as it does.
        Raises InputError if a curve is not known there.
        """
        total, slow = np.empty((n, 6)), np.zeros((n, 6))
        for i, axis in enumerate(AXES):
            filtered = np.zeros(n)
            for term in self.models[axis].terms:
                if not term.is_white:
                    part = filtered if term.is_band_limited else slow[:, i]
                    part += term.simulate(n, dt, rng)
            curve, factor = self.curves.get(axis), np.ones(1)
            if curve is not None and covariates is not None:
                slow[:, i] += curve.along(covariates, dt)
                if curve.scaling is not None and curve.covariates:
                    factor = curve.noise_factor(covariates[curve.covariates[0].name])
            filtered *= factor
            if self.bias_sd[axis] > 0.0:
                slow[:, i] += self.bias_sd[axis] * rng.standard_normal()
            total[:, i] = slow[:, i] + filtered
            density = self.models[axis].white_density()
            if density > 0.0:
                total[:, i] += factor * np.sqrt(density / dt) * rng.standard_normal(n)
        return SensorErrors(total, slow)


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """Errors of the six sensors along a record.

    Attributes
    ----------
    total : (n, 6) ndarray
        What is measured less what is true, rad/s and m/s^2, mean over each interval.
    slow : (n, 6) ndarray or None
        The part that a filter can estimate: all but white noise, filtered or not; ``None`` where it
        is not known, as of a real recording.
    """

    total: FloatArray
    slow: FloatArray | None = None


def _by_axis(given: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Values by axis, from values by axis or kind."""
    for name in given:
        if name not in AXES and name not in _KINDS:
            raise InputError(
                f"{what}: {checks.shown(name)} is not a sensor: write gyro, accel, or one of "
                f"{', '.join(AXES)}"
            )
    names = {axis: axis if axis in given else axis.partition("_")[0] for axis in AXES}
    return {axis: given[name] for axis, name in names.items() if name in given}


def _model(axis: str, given: Any) -> Model:
    if not isinstance(given, (Process, Model, str)):
        raise InputError(f"sensor models: {axis} is {checks.shown(given)}: give a process or model")
    model = as_model(given)
    model.require_given(f"sensor models: {axis}")
    return model


def _standard_deviations(given: Mapping[str, float]) -> dict[str, float]:
    values = dict.fromkeys(AXES, 0.0)
    for axis, value in _by_axis(given, "bias_sd").items():
        if value != 0.0:
            values[axis] = checks.positive(f"bias_sd of {axis}", value)
    return values


@dataclass(frozen=True, eq=False)
class Recorded:
    """Errors of a real IMU at rest, cut into independent stretches.

    Attributes
    ----------
    stretches : tuple of (n, 6) ndarray
        Errors in the order of `AXES`, rad/s and m/s^2, less the mean of each recording.
    dt : float
        Sampling interval, s.
    source : str
    bias_sd : dict
        Axis -> root mean square of the errors averaged over a minute: what a filter should expect
        of its bias when it starts anywhere in the recording.
    """

    stretches: tuple[FloatArray, ...] = field(repr=False)
    dt: float
    source: str
    bias_sd: dict[str, float]

    @classmethod
    def of(cls, recordings: Recording | Sequence[Recording], duration: float) -> Recorded:
        """Cut recordings into stretches of ``duration`` (s).

        Missing samples take the value before them; those before the first sample take its value.

        Raises InputError if there is no recording, an axis is missing, the rates differ, or none is
        long enough.
        """
        given = [recordings] if isinstance(recordings, Recording) else list(recordings)
        if not given:
            raise InputError("no recordings given: give at least one")
        checks.positive("duration", duration, "give seconds above zero")
        stretches: list[FloatArray] = []
        slow: list[FloatArray] = []
        for recording in given:
            recording.of_one_rate("noise as it was recorded")
            if abs(recording.dt / given[0].dt - 1.0) > _RATE_TOLERANCE:
                raise InputError(
                    f"{recording.source} has {recording.rate:g} Hz and {given[0].source} "
                    f"{given[0].rate:g} Hz: give recordings of one rate"
                )
            errors = _errors(recording)
            window = max(min(round(tuning.BIAS_WINDOW / recording.dt), len(errors)), 1)
            whole = len(errors) // window * window
            slow.append(errors[:whole].reshape(-1, window, 6).mean(axis=1))
            n = max(round(duration / recording.dt), 1)
            stretches += [errors[i : i + n] for i in range(0, len(errors) - n + 1, n)]
        source = ", ".join(each.source for each in given)
        if not stretches:
            longest = max(each.duration for each in given)
            raise InputError(
                f"{source}: the longest recording has {longest:g} s, less than the {duration:g} s "
                "of the trajectory: shorten it or record longer"
            )
        rms = np.sqrt(np.mean(np.concatenate(slow) ** 2, axis=0))
        bias_sd = dict(zip(AXES, map(float, rms), strict=True))
        return cls(tuple(stretches), given[0].dt, source, bias_sd)

    @property
    def available(self) -> int | None:
        """Number of independent stretches."""
        return len(self.stretches)

    def draw(self, run: int, n: int, dt: float, rng: np.random.Generator) -> SensorErrors:
        """The stretch of a run.

        Raises InputError if the trajectory has another sampling interval, or is longer than a
        stretch.
        """
        if abs(dt / self.dt - 1.0) > _RATE_TOLERANCE or n > len(self.stretches[run]):
            raise InputError(
                f"{self.source}: stretches of {len(self.stretches[run])} samples at "
                f"{1.0 / self.dt:g} Hz do not fit a trajectory of {n} at {1.0 / dt:g} Hz: cut "
                "stretches of that length and rate"
            )
        return SensorErrors(self.stretches[run][:n])


def require_axes(recording: Recording) -> None:
    """Reject a recording that lacks one of the six sensors."""
    for axis in AXES:
        if axis not in recording.names:
            raise InputError(
                f"{recording.source}: there is no channel {axis}: an IMU has {', '.join(AXES)}"
            )


def _errors(recording: Recording) -> FloatArray:
    """Samples of all six sensors less their mean, without gaps."""
    require_axes(recording)
    columns = []
    for axis in AXES:
        values = np.array(recording[axis].values, dtype=float)
        holes = ~np.isfinite(values)
        if np.all(holes):
            raise InputError(f"{recording.source}: {axis} has no samples: leave the recording out")
        if np.any(holes):
            first = int(np.argmin(holes))
            last = np.maximum.accumulate(np.where(holes, first, np.arange(values.size)))
            values = values[last]
        columns.append(values - np.mean(values))
    return np.column_stack(columns)
