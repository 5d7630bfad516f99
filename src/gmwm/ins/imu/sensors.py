"""Error models of the six inertial sensors, as a navigation filter and a simulation take them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process, as_model

AXES = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
"""The sensors, in the order of all arrays."""

_KINDS = ("gyro", "accel")


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
    """

    models: dict[str, Model]
    bias_sd: dict[str, float] = field(default_factory=lambda: dict.fromkeys(AXES, 0.0))
    not_valid: tuple[str, ...] = field(default=(), repr=False)

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
        source : SensorModels, Calibration or mapping
            A mapping has models by axis (``"gyro_x"``) or by kind (``"gyro"`` and ``"accel"``, the
            same for its three axes); an axis goes before its kind.
        bias_sd : mapping of str to float, optional
            By axis or kind, in rad/s and m/s^2.
        """
        if isinstance(source, SensorModels):
            if bias_sd is None:
                return source
            return replace(source, bias_sd=_standard_deviations(bias_sd))
        not_valid: tuple[str, ...] = ()
        if isinstance(source, Calibration):
            not_valid = tuple(axis for axis in AXES if axis in source and not source[axis].valid)
            source = {name: fit.model for name, fit in source.fits.items() if name in AXES}
        if not isinstance(source, Mapping):
            raise InputError(
                f"sensor models: {checks.shown(source)}: give a calibration, or models as in "
                '{"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)}'
            )
        given = _by_axis(source, "models")
        for axis in AXES:
            if axis not in given:
                raise InputError(f"sensor models: {axis} has none: give one to each axis")
        models = {axis: _model(axis, given[axis]) for axis in AXES}
        return cls(models, _standard_deviations(bias_sd or {}), not_valid)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """That models come from fits that are not valid."""
        if not self.not_valid:
            return ()
        fit, are = ("fits", "are") if self.not_valid[1:] else ("fit", "is")
        text = f"the {fit} {are} not valid: do not use these numbers in a filter"
        hint = "read the notices of the calibration first"
        axes = ", ".join(self.not_valid)
        return (notice("fit-not-valid", axes, severity="warning", hint=hint, text=text),)

    def simulate(self, n: int, dt: float, rng: np.random.Generator) -> SensorErrors:
        """Draw the errors of all axes over ``n`` samples; constant biases are drawn too.

        Parameters
        ----------
        n : int
        dt : float
            Sampling interval, s.
        rng : numpy.random.Generator
        """
        total, slow = np.empty((n, 6)), np.zeros((n, 6))
        for i, axis in enumerate(AXES):
            filtered = np.zeros(n)
            for term in self.models[axis].terms:
                if not term.is_white:
                    part = filtered if term.is_band_limited else slow[:, i]
                    part += term.simulate(n, dt, rng)
            if self.bias_sd[axis] > 0.0:
                slow[:, i] += self.bias_sd[axis] * rng.standard_normal()
            total[:, i] = slow[:, i] + filtered
            density = self.models[axis].white_density()
            if density > 0.0:
                total[:, i] += np.sqrt(density / dt) * rng.standard_normal(n)
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
    if not isinstance(given, (Process, Model)):
        raise InputError(f"sensor models: {axis} is {checks.shown(given)}: give a process or model")
    model = as_model(given)
    missing = [key for key, value in model.params.items() if value is None]
    if missing:
        raise InputError(
            f"sensor models: {axis} has free parameters ({', '.join(missing)}): give them a value, "
            "or estimate them with gmwm.fit"
        )
    return model


def _standard_deviations(given: Mapping[str, float]) -> dict[str, float]:
    values = dict.fromkeys(AXES, 0.0)
    for axis, value in _by_axis(given, "bias_sd").items():
        if value != 0.0:
            values[axis] = checks.positive(f"bias_sd of {axis}", value)
    return values
