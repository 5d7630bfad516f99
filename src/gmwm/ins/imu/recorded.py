"""Sensor errors from real static recordings: stretches that do not overlap."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.imu.sensors import AXES, SensorErrors
from gmwm.readers import Recording

_RATE_TOLERANCE = 1e-3


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

    stretches: tuple[FloatArray, ...]
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
            raise InputError("recordings: there is none: give one at least")
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

    def __repr__(self) -> str:
        size = self.stretches[0].shape[0]
        digest = hashlib.sha256()
        for each in self.stretches:
            digest.update(np.ascontiguousarray(each).tobytes())
        return (
            f"Recorded({self.source!r}, {len(self.stretches)} x {size}, dt={self.dt!r}, "
            f"sha256={digest.hexdigest()})"
        )

    def draw(self, run: int, n: int, dt: float, rng: np.random.Generator) -> SensorErrors:
        """The stretch of a run.

        Raises InputError if the trajectory has another sampling interval, or is longer than a
        stretch.
        """
        if abs(dt / self.dt - 1.0) > _RATE_TOLERANCE or n > len(self.stretches[run]):
            raise InputError(
                f"{self.source}: stretches of {len(self.stretches[run])} samples at "
                f"{1.0 / self.dt:g} Hz do not fit a trajectory of {n} at {1.0 / dt:g} Hz: cut them "
                "for it"
            )
        return SensorErrors(self.stretches[run][:n])


def _errors(recording: Recording) -> FloatArray:
    """Samples of all six sensors less their mean, without gaps."""
    missing = [axis for axis in AXES if axis not in recording.names]
    if missing:
        raise InputError(
            f"{recording.source}: there is no channel {missing[0]}: an IMU has {', '.join(AXES)}"
        )
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
