"""Trajectories: position, velocity and attitude at evenly spaced epochs, also from text files."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline, make_lsq_spline

from gmwm._core.checks import is_number, positive, real_numbers, sampling_interval, shown
from gmwm._core.files import existing_file
from gmwm._core.spool import release, windows
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.geometry import radii_along
from gmwm.readers import TIME, CsvTable, label, meaning, stated_seconds


def by_word(**words: str) -> dict[str, str]:
    """Word -> meaning, from words with blanks between them by meaning."""
    return {word: meant for meant, each in words.items() for word in each.split()}


POSITION_WORDS = by_word(
    latitude="latitude lat", longitude="longitude lon long lng", height="height altitude alt h hgt"
)
"""Meaning of the last word of a column's name, if it is a position."""

FACTORS = {"rad": 1.0, "deg": np.pi / 180.0, "m": 1.0, "ft": 0.3048}
"""Units of angles and lengths in SI."""

_UNITS = by_word(
    rad="rad rads radian radians",
    deg="deg degs degree degrees °",
    m="m meter meters metre metres",
    ft="ft feet",
)
_WORD = re.compile(r"°|[A-Z]?[a-z]+|[A-Z]+")


def is_time(name: str) -> bool:
    """Whether a column of this name holds time stamps."""
    return meaning(name).role == TIME


def words_of(name: str) -> list[str]:
    """Words of a column's name in lower case, without its unit if it is an angle or a length."""
    words = [word.lower() for word in _WORD.findall(name)]
    if words and words[-1] in _UNITS:
        words.pop()
    return words


@dataclass(frozen=True, eq=False)
class LogColumns:
    """Columns of a delimited text whose quantities are known by their names."""

    table: CsvTable
    columns: Mapping[str, int]
    unused: tuple[str, ...]

    @classmethod
    def find(
        cls,
        path: Path,
        quantities: Callable[[str], Sequence[str]],
        needed: Sequence[str],
        header: str,
    ) -> LogColumns:
        """Look at the header of a file.

        quantities: Quantities that a column of a name holds; empty if it is something else.
        """
        table = CsvTable.open(existing_file(path))
        columns: dict[str, int] = {}
        unused = []
        for column, name in enumerate(table.names):
            found = quantities(name)
            if not found:
                unused.append(name or str(column))
            for quantity in found:
                if quantity in columns:
                    first, second = (label(table.names, c) for c in (columns[quantity], column))
                    raise InputError(
                        f"{table.source}: columns {first} and {second} both look like {quantity}: "
                        "rename one of them"
                    )
                columns[quantity] = column
        missing = [name for name in needed if name not in columns]
        if missing:
            raise InputError(
                f"{table.source} has no column for {', '.join(missing)}: name the columns in a "
                f"header like {header}"
            )
        return cls(table, columns, tuple(unused))

    def load(self) -> dict[str, FloatArray]:
        """Values of each quantity, in the units of the file."""
        values = self.table.load(sorted(set(self.columns.values())))
        return {name: values[column] for name, column in self.columns.items()}

    def place(self, quantity: str, row: int | None = None) -> str:
        """Where a quantity or a value of it stands, for messages."""
        place = f"{self.table.source}, column {label(self.table.names, self.columns[quantity])}"
        return place if row is None else f"{place}, {self.table.where(row)}"

    def unit(self, quantity: str) -> str | None:
        """One of `FACTORS`, if the name of the column ends with it."""
        words = _WORD.findall(self.table.names[self.columns[quantity]])
        return _UNITS.get(words[-1].lower()) if words else None

    def seconds_per_stamp(self) -> float:
        """Unit of the time stamps, s."""
        return stated_seconds(self.table.source, self.table.names[self.columns[TIME]]) or 1.0

    def check_rising(self, stamps: FloatArray) -> None:
        """Reject time stamps that do not rise; the message names the line of the first."""
        steps = np.diff(stamps)
        bad = np.flatnonzero(steps <= 0.0)
        if bad.size:
            row = int(bad[0]) + 1
            what = "repeats the one before" if steps[row - 1] == 0.0 else "goes back"
            raise InputError(
                f"{self.place(TIME, row)}: time stamp {stamps[row]:.15g} {what}: delete such "
                "rows; if the clock was reset there, remove the jump from the later stamps"
            )

    def metres(self, quantity: str, values: FloatArray) -> FloatArray:
        """Lengths in m; InputError if the column is in another unit than m or ft."""
        unit = self.unit(quantity) or "m"
        if unit not in ("m", "ft"):
            raise InputError(
                f"{self.place(quantity)}: {unit} is not a unit of {quantity}: name it {quantity}_m"
            )
        return FACTORS[unit] * values

    def radians(
        self, values: Mapping[str, FloatArray], limits: Mapping[str, float]
    ) -> dict[str, FloatArray]:
        """Angles in rad.

        Without a unit in its name, an angle has that of the latitude, which is in degrees if one is
        beyond pi/2.

        values: Quantities, with the latitude.
        limits: Quantities that are angles -> largest possible size, rad.
        """
        beyond = bool(np.any(np.abs(values["latitude"]) > 0.5 * np.pi))
        common = self.unit("latitude") or ("deg" if beyond else None)
        found = {}
        for quantity, limit in limits.items():
            unit, hint = self.unit(quantity) or common, f"name it {quantity}_rad or {quantity}_deg"
            if unit not in ("rad", "deg"):
                what = (
                    f"{unit} is not a unit of angle:" if unit else "are its angles in rad or deg?"
                )
                raise InputError(f"{self.place(quantity)}: {what} {hint}")
            angle = FACTORS[unit] * values[quantity]
            bad = np.flatnonzero(np.abs(angle) > limit * (1.0 + 1e-9))
            if bad.size:
                raise InputError(
                    f"{self.place(quantity, int(bad[0]))}: a {quantity} of "
                    f"{np.degrees(angle[bad[0]]):.6g} deg: check the unit in the header"
                )
            found[quantity] = angle
        return found


_HEADER = "time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,yaw_deg"
_WORDS = POSITION_WORDS | by_word(roll="roll bank", pitch="pitch", yaw="yaw heading hdg azimuth")
_NOT_THE_VALUE = frozenset(
    {"std", "sigma", "var", "cov", "err", "error", "rate", "ref", "acc", "accuracy", "dot"}
)
_UNEVEN = 0.1  # of the sampling interval: at 20 m/s and 100 Hz, 2 cm
_QUARTER, _MANY_TURNS = 0.5 * np.pi, 1e4  # rad; a log that counts turns stays far below
_LIMITS = {"latitude": _QUARTER, "pitch": _QUARTER}
_LIMITS |= dict.fromkeys(("longitude", "roll", "yaw"), _MANY_TURNS)


def read_log(path: Path) -> tuple[float, float, FloatArray, FloatArray]:
    """First time stamp, sampling interval, s, positions and attitudes, (n + 1, 3), of a log."""
    log = LogColumns.find(path, _quantities, (TIME, *_LIMITS, "height"), _HEADER)
    values = log.load()
    for name, column in values.items():
        bad = np.flatnonzero(np.isnan(column))
        if bad.size:
            raise InputError(
                f"{log.place(name, int(bad[0]))}: no value: fill the gap, or use the part of "
                "the file before or after it"
            )
    dt = _interval(log, values[TIME])
    found = log.radians(values, _LIMITS) | {"height": log.metres("height", values["height"])}
    return (
        float(values[TIME][0]) * log.seconds_per_stamp(),
        dt,
        np.stack([found[name] for name in ("latitude", "longitude", "height")], axis=-1),
        np.stack([found[name] for name in ("roll", "pitch", "yaw")], axis=-1),
    )


def _quantities(name: str) -> tuple[str, ...]:
    """Time, latitude, ... or none if the column is something else."""
    if is_time(name):
        return (TIME,)
    words = words_of(name)
    if not words or not _NOT_THE_VALUE.isdisjoint(words) or words[-1] not in _WORDS:
        return ()
    return (_WORDS[words[-1]],)


def _interval(log: LogColumns, stamps: FloatArray) -> float:
    """Sampling interval of evenly spaced time stamps, s."""
    n = stamps.size - 1
    if n < 1:
        raise InputError(f"{log.table.source} has a single row: give at least two epochs")
    log.check_rising(stamps)
    steps = np.diff(stamps)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(np.abs(steps - usual) > 0.5 * usual)
    dt = float(stamps[-1] - stamps[0]) / n
    late = np.flatnonzero(np.abs(stamps - stamps[0] - dt * np.arange(n + 1)) > _UNEVEN * dt)
    if gaps.size or late.size:
        row = int(gaps[0]) + 1 if gaps.size else int(late[0])
        raise InputError(
            f"{log.place(TIME, row)}: time stamp {stamps[row]:.15g} is off the even spacing "
            f"of {usual:.6g}: resample the log to even steps, or use the part before or after"
        )
    return dt * log.seconds_per_stamp()


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
    """Roll, pitch and yaw, (n + 1, 3), rad, that do not jump at +-180 deg."""
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
        # Relative to the first epoch fewer digits are lost in the differences.
        time, (lat, _, height) = np.arange(len(position)) * dt, position.T
        rate = CubicSpline(time, position - position[0], axis=0)(time, 1)
        meridian, transverse = radii_along(lat)
        rate[:, 0] *= meridian + height
        rate[:, 1] *= (transverse + height) * np.cos(lat)
        rate[:, 2] *= -1.0
        return cls(dt, position, rate, attitude)

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
