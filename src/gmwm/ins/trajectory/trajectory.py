"""Trajectories: position, velocity and attitude at evenly spaced epochs."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline, make_lsq_spline

from gmwm._core.checks import is_number, positive, real_numbers, sampling_interval, shown
from gmwm._core.spool import release, windows
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.geometry import radii_along
from gmwm.ins.trajectory.trajectory_file import read_log

_DEGREE = 3
_LARGEST_TURN = 0.5 * np.pi  # rad from epoch to epoch; beyond, the way round would be a guess
_ATTITUDE_CUTOFF = 5.0  # of that of the track
_HIGHEST_LATITUDE = math.radians(89.0)  # beyond, north-east-down axes turn too fast


def unwrapped_longitudes(lla: FloatArray) -> FloatArray:
    """Positions whose longitude does not jump at the date line, shape (n + 1, 3)."""
    result = np.array(lla, dtype=float)
    result[:, 1] = np.unwrap(result[:, 1])
    return result


def unwrapped_angles(rpy: FloatArray) -> FloatArray:
    """Roll, pitch and yaw, (n + 1, 3), rad, that do not jump at +-180 deg.

    Raises InputError if roll or yaw still turn by more than 90 deg between epochs.
    """
    result = np.unwrap(np.asarray(rpy, dtype=float), axis=0)
    result[:, 1] = rpy[:, 1]
    steps = np.abs(np.diff(result, axis=0))
    if np.any(steps > _LARGEST_TURN):
        row, column = (int(i) for i in np.argwhere(steps > _LARGEST_TURN)[0])
        raise InputError(
            f"{('roll', 'pitch', 'yaw')[column]} turns by "
            f"{np.degrees(steps[row, column]):.0f} deg from epoch {row} to {row + 1}: give "
            "attitudes at a higher rate, with pitch away from +-90 deg"
        )
    return result


def coefficients(values: FloatArray, dt: float) -> FloatArray:
    """Spline through values (n + 1, 3): coefficients (4, 3, n) of 1, t, t^2, t^3 by interval."""
    spline = CubicSpline(np.arange(len(values)) * dt, values, axis=0)
    return np.ascontiguousarray(np.transpose(spline.c[::-1], (0, 2, 1)))


def track_velocity(lla: FloatArray, dt: float) -> FloatArray:
    """Velocity, (n + 1, 3), along a track without jumps of the longitude."""
    # Relative to the first epoch fewer digits are lost in the differences.
    spline = CubicSpline(np.arange(len(lla)) * dt, lla - lla[0], axis=0)
    rate = spline(np.arange(len(lla)) * dt, 1)
    lat, h = lla[:, 0], lla[:, 2]
    meridian, transverse = radii_along(lat)
    return np.stack(
        [(meridian + h) * rate[:, 0], (transverse + h) * np.cos(lat) * rate[:, 1], -rate[:, 2]],
        axis=-1,
    )


def smoothed(values: FloatArray, dt: float, cutoff: float) -> FloatArray:
    """Least-squares cubic spline with evenly spaced knots: what moves faster is left out.

    Knots are half a period of the cutoff (Hz) apart; with less than two samples from knot to knot,
    nothing is left out. de Boor (1978), *A Practical Guide to Splines*, ch. XIV.
    """
    n = len(values) - 1
    spans = max(round(2.0 * cutoff * n * dt), 1)
    if n < 2 * spans + _DEGREE:
        return values
    x = np.linspace(0.0, spans, n + 1)
    knots = np.concatenate([np.zeros(_DEGREE), np.arange(spans + 1.0), np.full(_DEGREE, spans)])
    # The mean is taken out so that a height of 500 m costs no digits.
    mean = np.mean(values, axis=0)
    spline = make_lsq_spline(x, values - mean, knots, _DEGREE)
    return mean + spline(x)


@dataclass(frozen=True, eq=False)
class NavState:
    """Position, velocity and attitude at one epoch.

    Attributes
    ----------
    lla : (3,) ndarray
        Latitude, longitude, rad, and height above the ellipsoid, m.
    velocity : (3,) ndarray
        To the north, east and down, m/s.
    rpy : (3,) ndarray
        Roll, pitch and yaw, rad.
    """

    lla: FloatArray
    velocity: FloatArray
    rpy: FloatArray

    def __post_init__(self) -> None:
        for name in ("lla", "velocity", "rpy"):
            object.__setattr__(self, name, three_numbers(name, getattr(self, name)))


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Position, velocity and attitude at n + 1 epochs, one sampling interval apart.

    Attributes
    ----------
    dt : float
        Sampling interval, s.
    lla : (n + 1, 3) ndarray
        Latitude, longitude, rad, and height above the ellipsoid, m.
    velocity : (n + 1, 3) ndarray
        To the north, east and down, m/s.
    rpy : (n + 1, 3) ndarray
        Roll, pitch and yaw, rad.
    """

    dt: float
    lla: FloatArray
    velocity: FloatArray
    rpy: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "dt", sampling_interval(self.dt))
        for name in ("lla", "velocity", "rpy"):
            values = np.ascontiguousarray(real_numbers(getattr(self, name), name))
            if values.ndim != 2 or values.shape[1] != 3 or len(values) != len(self.lla):
                raise InputError(
                    f"{name} has shape {values.shape}: give lla, velocity and rpy one row of 3 "
                    "numbers for each epoch"
                )
            object.__setattr__(self, name, values)
        if len(self.lla) < 2:
            raise InputError(f"the trajectory has {len(self.lla)} epoch(s): give at least two")

    @classmethod
    def from_arrays(cls, dt: float, lla: FloatArray, rpy: FloatArray) -> Trajectory:
        """Build a trajectory from positions and attitudes; the velocity is that of the splines.

        Raises InputError if a number is not finite or a latitude is beyond 89 deg.

        Parameters
        ----------
        dt : float
            Sampling interval, s.
        lla : (n + 1, 3) array_like
            Latitude, longitude, rad, and height, m; smooth enough to be differentiated twice.
        rpy : (n + 1, 3) array_like
            Roll, pitch and yaw, rad; jumps by a full turn do no harm.
        """
        dt = sampling_interval(dt)
        hint = "two or more epochs, 3 numbers each"
        position, attitude = (
            finite_rows(each, name, hint, 2) for each, name in ((lla, "lla"), (rpy, "rpy"))
        )
        check_latitudes(position, "lla")
        position = unwrapped_longitudes(position)
        return cls(dt, position, track_velocity(position, dt), attitude)

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, smooth: float | None = 1.0) -> Trajectory:
        """Read a logged trajectory, smoothed enough to be differentiated.

        Logs come in coarse steps and hold the jumps of the filter that made them; differentiated
        twice, a step of 1 mm at 100 Hz is a specific force of 10 m/s^2.

        Raises InputError if the file cannot be used; the message names the line.

        Parameters
        ----------
        path : str or path
            Delimited text, plain or gzip, with columns of time, latitude, longitude, height, roll,
            pitch and yaw, known by their names. Units stand at their end (``time_s``, ``lat_deg``,
            ``roll [rad]``); without one, time is in seconds, height in metres, and angles are in
            degrees if a latitude is beyond pi/2.
        smooth : float or None, optional
            What the track does faster than this is left out, Hz; for the attitude, which is
            differentiated only once, five times this. It has no effect from a quarter of the
            sampling rate on. ``None``: leave all as it is.
        """
        _, dt, lla, rpy = read_log(Path(path))
        rpy = unwrapped_angles(rpy)
        if smooth is not None:
            cutoff = positive("smooth", smooth, "give a cutoff in Hz, or None to leave all as is")
            lla = smoothed(unwrapped_longitudes(lla), dt, cutoff)
            rpy = smoothed(rpy, dt, _ATTITUDE_CUTOFF * cutoff)
        return cls.from_arrays(dt, lla, rpy)

    @property
    def n(self) -> int:
        """Number of sampling intervals: one less than epochs."""
        return len(self.lla) - 1

    @property
    def duration(self) -> float:
        """Length, s."""
        return self.n * self.dt

    @property
    def time(self) -> FloatArray:
        """Time since the first epoch, s, shape (n + 1,)."""
        return self.dt * np.arange(self.n + 1, dtype=float)

    def state(self, index: int) -> NavState:
        """Position, velocity and attitude at one epoch, counted from 0, or from the end if < 0."""
        if not -self.n - 1 <= index <= self.n:
            raise InputError(f"index = {shown(index)}: the trajectory has {self.n + 1:,} epochs")
        return NavState(self.lla[index], self.velocity[index], self.rpy[index])

    def segment(self, start: float, end: float) -> Trajectory:
        """The part between two times, s since the first epoch: the nearest epochs, both included.

        Raises InputError if they are not in order or outside the trajectory.
        """
        inside = is_number(start) and is_number(end)
        first, last = (round(start / self.dt), round(end / self.dt)) if inside else (0, 0)
        if not 0 <= first < last <= self.n:
            raise InputError(
                f"segment from {shown(start)} s to {shown(end)} s: give two times in order, "
                f"within 0 to {self.duration:g} s"
            )
        part = slice(first, last + 1)
        return Trajectory(self.dt, self.lla[part], self.velocity[part], self.rpy[part])


def check_latitudes(lla: FloatArray, name: str) -> None:
    """Raise InputError for positions near the poles, where north and east turn too fast."""
    bad = np.flatnonzero(~(np.abs(lla[:, 0]) <= _HIGHEST_LATITUDE))
    if bad.size:
        raise InputError(
            f"{name}: latitude {math.degrees(lla[bad[0], 0]):.6g} deg at index {bad[0]} is too "
            "near a pole for north-east-down axes: stay within 89 deg of the equator"
        )


def finite_numbers(values: object, name: str) -> FloatArray:
    """An array of finite numbers; InputError names the row of the first that is not."""
    array = np.ascontiguousarray(real_numbers(values, name))
    for part in windows(len(array)):
        if not np.all(np.isfinite(array[part])):
            row = part.start + int(np.argwhere(~np.isfinite(array[part]))[0][0])
            raise InputError(f"{name} is not finite at index {row}: give a number for every epoch")
        release(array)
    return array


def three_numbers(name: str, values: object) -> FloatArray:
    """An array of three finite numbers."""
    array = real_numbers(values, name)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise InputError(f"{name} = {shown(values)}: give three finite numbers")
    return array


def finite_rows(
    values: object, name: str, hint: str, least: int = 0, n: int | None = None
) -> FloatArray:
    """Rows of three finite numbers: ``least`` or more, or exactly ``n``."""
    array = finite_numbers(values, name)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) < least or n not in (None, len(array)):
        raise InputError(f"{name} has shape {array.shape}: give {hint}")
    return array
