"""Errors that static data cannot show and motion brings, as terms of an error model."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from gmwm._core import checks
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.process import GaussMarkov, Process, WhiteNoise
from gmwm.readers import Recording


@dataclass(frozen=True)
class Motion:
    """Size and memory of a vehicle's motion about its mean.

    Attributes
    ----------
    rate, accel : float
        Root mean square of the angular rate (rad/s) and of the specific force (m/s^2) of an axis.
    memory : float
        Correlation time of both, s.
    """

    rate: float
    accel: float
    memory: float

    @classmethod
    def of(cls, motion: str | Self | Recording) -> Self:
        """A usual motion by name, or the motion of a recording.

        Raises
        ------
        InputError
            If there is no such name, or the recording has no gyro and accelerometer.
        """
        if isinstance(motion, Motion):
            return motion
        if isinstance(motion, str) and motion in tuning.MOTIONS:
            return cls(*tuning.MOTIONS[motion])
        if not isinstance(motion, Recording):
            raise InputError(
                f"motion {checks.shown(motion)} is not known: write {', '.join(tuning.MOTIONS)}, "
                "or give a recording"
            )
        sizes, memories = [], []
        for kind in ("gyro", "accel"):
            found = [c.values for c in motion.inertial if c.quantity == kind]
            if not found:
                raise InputError(
                    f"{motion.source}: has no {kind} channel: give a recording of both"
                )
            sizes.append(float(np.sqrt(np.mean([np.nanvar(values) for values in found]))))
            for values in found:  # time after which the autocorrelation has fallen to 1/e
                x = np.nan_to_num(values - np.nanmean(values))
                correlation = np.fft.irfft(np.abs(np.fft.rfft(x, 2 * x.size)) ** 2)[: x.size]
                below = np.flatnonzero(correlation < np.exp(-1.0) * correlation[0])
                lag = float(below[0] if below.size else x.size)
                memories.append(lag * (1.0 / motion.rate))
        return cls(sizes[0], sizes[1], float(np.median(memories)))


@dataclass(frozen=True)
class Imperfections:
    """Errors of a calibration and of a mounting; zero where unknown.

    Attributes
    ----------
    scale_error : float
        Of both sensors, as a fraction.
    misalignment : float
        Of the axes, rad.
    g_sensitivity : float
        Of gyros, rad/s per m/s^2.
    time_offset : float
        Of the IMU against what it is fused with, s.
    vibration_rectification : float
        Of accelerometers, m/s^2 per (m/s^2)^2.
    vibration : float
        Root mean square of the vibration, m/s^2.
    """

    scale_error: float = 0.0
    misalignment: float = 0.0
    g_sensitivity: float = 0.0
    time_offset: float = 0.0
    vibration_rectification: float = 0.0
    vibration: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            checks.plausible(field.name, getattr(self, field.name))

    @property
    def needs_motion(self) -> bool:
        """Whether one of them has no effect without motion."""
        return any((self.scale_error, self.misalignment, self.g_sensitivity, self.time_offset))

    def terms(self, quantity: str, motion: Motion | None) -> Mapping[str, Process]:
        """Error terms of a gyro or an accelerometer by cause.

        An error in proportion to the motion has its correlation time. One of a time offset d is d
        times the derivative of the motion: of a spectrum 2 s^2 tau/(1 + (2 pi f tau)^2), that is
        below white noise of density 2 s^2 d^2/tau.
        """
        found: dict[str, Process] = {}
        if motion is not None:
            size = motion.rate if quantity == "gyro" else motion.accel
            # Each cause has a correlation time of its own: processes of one would be one.
            sizes = {
                "scale error": self.scale_error * size,
                "misalignment": np.sqrt(2.0) * self.misalignment * size,
                "g-sensitivity": self.g_sensitivity * motion.accel * (quantity == "gyro"),
            }
            for i, (cause, sd) in enumerate(sizes.items()):
                if sd > 0.0:
                    found[cause] = GaussMarkov(float(sd), motion.memory * (1.0 + 1e-6 * i))
            if self.time_offset > 0.0:
                density = size * self.time_offset * np.sqrt(2.0 / motion.memory)
                found["time offset"] = WhiteNoise(float(density))
        rectified = self.vibration_rectification * self.vibration**2
        if quantity == "accel" and rectified > 0.0:
            found["vibration rectification"] = GaussMarkov(rectified, tuning.VIBRATION_MEMORY)
        return found
