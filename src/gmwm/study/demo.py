"""A demonstration on simulated data: a tactical MEMS IMU."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.units import SI_UNIT, field_units
from gmwm.estimate.result import Fit
from gmwm.ins import SensorModels
from gmwm.ins.spec import sensor_models
from gmwm.process import Model
from gmwm.readers import Channel, Recording

RATE = 100.0
"""Hz."""


DEMO = sensor_models(
    {
        "gyro": {"N": "12 deg/h/sqrt(Hz)", "GM": [["25 deg/h", 20.0]]},
        "accel": {"N": "80 ug/sqrt(Hz)", "K": "120 ug/sqrt(h)"},
    },
    "demo",
)
"""Of the order of a good MEMS IMU: an hour determines every parameter."""


def simulated_imu(
    seconds: float, seed: int, sensors: SensorModels = DEMO
) -> tuple[Recording, dict[str, Model]]:
    """A six-axis static recording and the model of each of its channels.

    seconds: Length.
    Returns: dict, channel name -> Model that made it.
    """
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE)
    truth = sensors.models
    channels = []
    for name, model in truth.items():
        quantity = name.split("_")[0]
        values = model.simulate(n, 1.0 / RATE, rng)
        channels.append(Channel(name, values, 1.0 / RATE, quantity, SI_UNIT[quantity]))
    source = f"simulated IMU, seed {seed}"
    return Recording(tuple(channels), source), truth


@dataclass(frozen=True)
class Comparison:
    """A true value beside its estimate, in the units of the field.

    Attributes
    ----------
    channel, what, unit : str
    truth, estimate, lower, upper : float
        With the 95 % interval.
    """

    channel: str
    what: str
    truth: float
    estimate: float
    lower: float
    upper: float
    unit: str

    @property
    def determined(self) -> bool:
        """Whether the record determines it."""
        return bool(np.isfinite(self.upper))

    @property
    def covered(self) -> bool:
        """Whether the interval holds the truth."""
        return self.lower <= self.truth <= self.upper


def compare(fitted: Fit, truth: Model) -> list[Comparison]:
    """True parameters beside those estimated for a model of the same form."""
    intervals = fitted.interval()
    rows = []
    for item in truth.parameters:
        key, value = item.key, item.value or 0.0
        units = field_units(item.parameter.unit, fitted.wv.quantity)
        unit, scale = (units[0].unit, units[0].per_si) if units else (item.parameter.unit, 1.0)
        low, high = intervals.get(key, (0.0, np.inf))
        rows.append(
            Comparison(
                channel=fitted.wv.name,
                what=key,
                truth=value * scale,
                estimate=fitted.params[key] * scale,
                lower=low * scale,
                upper=high * scale,
                unit=unit,
            )
        )
    return rows
