"""A reference trajectory beside the solution of a log: its errors, and those predicted."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from gmwm._core.text import brief
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter import Solution
from gmwm.ins.simulation import GROUPS, Ratio, serial_ratio
from gmwm.ins.trajectory import Trajectory, read_log, unwrapped_angles, unwrapped_longitudes

_JUDGED = ("position", "velocity", "attitude")


@dataclass(frozen=True, eq=False)
class Reference:
    """Position, velocity and attitude of the IMU that are taken for the truth.

    source: Name of the file.
    start: Time of the first epoch on the clock of the files, s.
    """

    source: str
    start: float
    trajectory: Trajectory

    @classmethod
    def read(cls, path: Path) -> Reference:
        """Read a CSV of time, latitude, longitude, height, roll, pitch and yaw, evenly spaced.

        Raises InputError if it cannot be used.
        """
        start, dt, lla, rpy = read_log(path)
        truth = Trajectory.from_arrays(dt, unwrapped_longitudes(lla), unwrapped_angles(rpy))
        return cls(path.name, start, truth)

    def compared(self, solution: Solution, clock: FloatArray) -> ReferenceErrors:
        """Errors of a solution, whose epochs are at ``clock`` (s) on the clock of the files.

        Raises InputError if the reference has no epoch in its time.
        """
        truth = self.trajectory
        time = clock - self.start
        inside = (time >= 0.0) & (time <= truth.duration) & ~solution.before
        if not np.any(inside):
            raise InputError(
                f"{self.source} lasts from {self.start:.10g} s to "
                f"{self.start + truth.duration:.10g} s, the solution from {clock[0]:.10g} s to "
                f"{clock[-1]:.10g} s: bring both to one clock"
            )
        at = np.arange(truth.n + 1) * truth.dt
        lla, velocity, rpy = (
            each[0] + CubicSpline(at, each - each[0], axis=0)(time[inside])
            for each in (truth.lla, truth.velocity, truth.rpy)
        )
        error = solution.less(lla, velocity, rpy, inside)
        return ReferenceErrors(self.source, error, solution.covariance[inside])


@dataclass(frozen=True, eq=False)
class ReferenceErrors:
    """Errors of a solution at K epochs against a reference.

    source: Of the reference.
    error: (K, 9), of position (north, east, down, m), velocity (m/s) and attitude (rad).
    covariance: (K, 9, 9), that the filter predicted.
    """

    source: str
    error: FloatArray
    covariance: FloatArray

    def nees(self, group: str) -> Ratio:
        """Mean normalised error squared per degree of freedom of a group of errors.

        Its band allows for errors that are correlated from one epoch to the next.
        """
        own = GROUPS[group]
        root = np.linalg.cholesky(self.covariance[:, own, own])
        return serial_ratio(np.linalg.solve(root, self.error[:, own, None])[..., 0])

    @property
    def disagreeing(self) -> dict[str, float]:
        """Errors that contradict the filter's covariance -> how many times as large they are."""
        found = {name: self.nees(name) for name in _JUDGED}
        level = tuning.CONTRADICTED / len(found)
        return {k: float(np.sqrt(each.value)) for k, each in found.items() if each.p_value <= level}

    @property
    def in_words(self) -> str:
        """Whether the errors agree with the filter's covariance."""
        sizes = self.disagreeing
        if not sizes:
            return "the errors agree with the filter's covariance"
        shown = (f"those of {name} are {brief(size)} times" for name, size in sizes.items())
        return f"the errors do not agree with the filter's covariance: {', '.join(shown)} as large"

    def rms(self, *errors: int) -> tuple[float, float]:
        """Root mean square of some of the nine errors together, and as the filter predicted it."""
        mine = list(errors)
        variance = np.diagonal(self.covariance, axis1=1, axis2=2)[:, mine]
        squares = self.error[:, mine] ** 2, variance
        actual, predicted = (float(np.sqrt(np.mean(np.sum(each, axis=1)))) for each in squares)
        return actual, predicted

    def sentence(self) -> str:
        """What people read of it."""
        parts = []
        for name, errors, unit, scale in (
            ("horizontal", (0, 1), "m", 1.0),
            ("vertical", (2,), "m", 1.0),
            ("velocity", (3, 4, 5), "m/s", 1.0),
            ("tilt", (6, 7), "deg", np.degrees(1.0)),
            ("heading", (8,), "deg", np.degrees(1.0)),
        ):
            actual, predicted = (brief(scale * value) for value in self.rms(*errors))
            parts.append(f"{name} {actual} {unit} ({predicted})")
        judged = ", ".join(
            f"{name} {each.value:.3g} ({each.lower:.2g} .. {each.upper:.2g})"
            for name, each in ((name, self.nees(name)) for name in _JUDGED)
        )
        return (
            f"Against {self.source}, {len(self.error):,} epochs, RMS (predicted): "
            f"{', '.join(parts)}; NEES per degree of freedom (95 % band if consistent): {judged}; "
            f"{self.in_words}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Root mean squares and NEES, SI."""
        return {
            "source": self.source,
            "epochs": len(self.error),
            "rms": {name: self.rms(*range(9)[GROUPS[name]])[0] for name in _JUDGED},
            "predicted": {name: self.rms(*range(9)[GROUPS[name]])[1] for name in _JUDGED},
            "nees": {name: asdict(self.nees(name)) for name in _JUDGED},
        }
