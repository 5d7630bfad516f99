"""IMU logs: angular rates and specific forces in a delimited text, as increments."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.spool import ROWS, alike, is_spooled, release, windows
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.geometry import STANDARD_GRAVITY
from gmwm.ins.imu import AXES, Imu
from gmwm.ins.logs import is_time, open_log
from gmwm.readers import (
    Recording,
    bare,
    is_text,
    read,
)

Columns = Mapping[str, str | int] | None

_CLOCKS = (1.0, 1e-3, 1e-6, 1e-9)  # s


@dataclass(frozen=True, eq=False)
class ImuLog:
    """An IMU record with the clock that it was stamped by.

    start: Time of the first epoch on that clock, s; 0 without time stamps.
    """

    imu: Imu
    start: float
    source: str
    notices: tuple[Notice, ...] = ()


def read_imu(
    path: str | os.PathLike[str],
    rate: float | None = None,
    units: Mapping[str, str] | None = None,
    channels: Mapping[str, str | int] | None = None,
    time: str | int | Literal[False] | None = None,
    start: float | None = None,
    *,
    format: str | None = None,
    layout: str | None = None,
    damaged: bool = False,
) -> Imu:
    """Read an IMU record as increments.

    A sample is the mean over the sampling interval that ends at its time stamp, so that the first
    epoch is one interval before the first stamp.

    Parameters
    ----------
    path : str or path
        What `gmwm.read` reads: angular rates and specific forces about and along the body's
        forward, right and down axes (at rest ``accel_z`` is -9.8 m/s^2).
    rate, units, channels, time : optional
        See `gmwm.read`. A column of ``channels`` with a minus sign before its name or number, as in
        ``{"accel_z": "-az"}``, has the opposite sign.
    start : float, optional
        Time of the first sample, s, of a record without time stamps.
    format, layout, damaged : optional
        See `gmwm.read`.

    Returns
    -------
    Imu

    Raises
    ------
    InputError
        If the file cannot be used, an axis or more than `gmwm.ins.tuning.LONGEST_FILLED` of samples
        is missing, or the specific force is far from gravity: most often a wrong unit.
    """
    log = read_imu_log(
        path, rate, units, channels, time, start, format=format, layout=layout, damaged=damaged
    )
    return log.imu


def read_imu_log(
    path: str | os.PathLike[str],
    rate: float | None = None,
    units: Mapping[str, str] | None = None,
    channels: Mapping[str, str | int] | None = None,
    time: str | int | Literal[False] | None = None,
    start: float | None = None,
    *,
    format: str | None = None,
    layout: str | None = None,
    damaged: bool = False,
) -> ImuLog:
    """Read an IMU record with its clock; see `read_imu`."""
    columns, turned = _signs(channels)
    is_log = layout is None and (is_text(Path(path)) if format is None else format == "text")
    found = read(path, rate, units, columns, time, layout, format=format, damaged=damaged)
    record = _Record.of(found, turned)
    clock = _clock(Path(path), record, time if is_log else False, start)
    filled = _fill(record)
    mean = record.mean()
    force = float(np.linalg.norm(mean))
    least, most = tuning.SPECIFIC_FORCE
    if not least * STANDARD_GRAVITY < force < most * STANDARD_GRAVITY:
        raise InputError(
            f"{record.source}: the mean specific force is {force:.4g} m/s^2, far from gravity: "
            "check the unit of the accelerometers, and that gravity is not subtracted"
        )
    held = _held(record, clock)
    imu = record.imu(clock.dt)
    notices = (*clock.notices, *filled, *held)
    if mean[2] > 0.0:
        text = "its mean is positive: the axis points up, and roll is near 180 deg"
        # A right-handed triad whose z axis points up has its y axis to the left.
        hint = (
            "if it is mounted upside down, fine; else turn gyro_z and accel_z round, and gyro_y "
            "and accel_y too if y points left"
        )
        notices = (*notices, Notice("axis-up", "warning", "accel_z", text, {}, hint))
    return ImuLog(imu, clock.start, record.source, (*record.notices, *notices))


@dataclass(frozen=True, eq=False)
class _Record:
    """Samples, (n, 3) each, rad/s and m/s^2, NaN where missing; on disk if there are many."""

    rate: FloatArray
    force: FloatArray
    dt: float
    source: str
    notices: tuple[Notice, ...]

    n = property(lambda self: len(self.rate))

    @classmethod
    def of(cls, recording: Recording, turned: frozenset[str]) -> _Record:
        """Samples of a recording; ``turned`` channels with the opposite sign."""
        recording = _checked(recording)
        triads = list[FloatArray]()
        for axes in (AXES[:3], AXES[3:]):
            first = recording[axes[0]].values
            triad = alike(first, 3 * first.size).reshape(-1, 3)
            for column, axis in enumerate(axes):
                values = recording[axis].values
                sign = -1.0 if axis in turned else 1.0
                for part in windows(values.size):
                    np.multiply(values[part], sign, out=triad[part, column])
                    release(values)
                    release(triad)
            triads.append(triad)
        return cls(triads[0], triads[1], recording.dt, recording.source, recording.notices)

    def column(self, name: str) -> FloatArray:
        """Samples of an axis, to be changed in place."""
        axis = AXES.index(name)
        return np.asarray((self.rate if axis < 3 else self.force)[:, axis % 3])

    def mean(self) -> FloatArray:
        """Mean specific force, (3,)."""
        total = np.zeros(3)
        for part in windows(self.n):
            total += np.sum(self.force[part], axis=0)
            release(self.force)
        return total / self.n

    def imu(self, dt: float) -> Imu:
        """As increments; the samples become those."""
        for each in (self.rate, self.force):
            for part in windows(self.n):
                each[part] *= dt
                release(each)
        return Imu(dt, self.rate, self.force)


def _checked(recording: Recording) -> Recording:
    """A recording of all axes at one rate."""
    recording = recording.of_one_rate("navigation")
    missing = [axis for axis in AXES if axis not in recording.names]
    if missing:
        raise InputError(
            f"{recording.source}: there is no channel {missing[0]}: an IMU has {', '.join(AXES)}"
        )
    return recording


def _signs(channels: Columns) -> tuple[Columns, frozenset[str]]:
    """The columns without their signs, and the channels that have a minus."""
    if channels is None:
        return None, frozenset()
    columns: dict[str, str | int] = {}
    turned = set()
    for name, column in channels.items():
        if isinstance(column, str) and column.startswith("-") and len(column) > 1:
            turned.add(name)
            bare_column = column[1:]
            column = int(bare_column) if bare_column.isascii() and bare_column.isdigit() else (
                bare_column
            )  # fmt: skip
        columns[name] = column
    return columns, frozenset(turned)


def _fill(record: _Record) -> tuple[Notice, ...]:
    """Fill short holes along straight lines, in place.

    Raises InputError if one is too long, or at an end.
    """
    most = max(round(tuning.LONGEST_FILLED / record.dt), 1)
    longest = 0
    rows = []
    for name in AXES:
        samples = record.column(name)
        found = []
        for part in windows(record.n):
            found.append(part.start + np.flatnonzero(np.isnan(samples[part])))
            release(samples)
        missing = np.concatenate(found)
        for hole in np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1):
            if not hole.size:
                continue
            begin, end = int(hole[0]), int(hole[-1]) + 1
            longest = max(longest, end - begin)
            if end - begin > most or begin == 0 or end == record.n:
                raise InputError(
                    f"{record.source}: sample {begin + 1:,} of {name}, "
                    f"{begin * record.dt:.6g} s after the first, is missing, {end - begin:,} in "
                    f"a row: up to {most} between others are filled; use the part before or after, "
                    "or take the step out of the times if a clock was set there"
                )
            samples[begin:end] = np.interp(hole, [begin - 1, end], samples[[begin - 1, end]])
        rows.append(missing)
    count = np.unique(np.concatenate(rows)).size
    if not count:
        return ()
    text = (
        f"{count:,} missing samples, at most {longest} in a row, are filled from those beside them"
    )
    values = {"count": count, "longest": longest}
    return (Notice("samples-filled", "warning", "", text, values),)


def _held(record: _Record, clock: _Clock) -> tuple[Notice, ...]:
    """Channels that have one value for long."""
    notices = []
    for name in AXES:
        first, count = _longest_run(record.column(name))
        length = count * clock.dt
        if length <= tuning.LONGEST_HELD or count == 1:
            continue
        start = clock.start + (first + 1) * clock.dt  # an increment ends at its stamp
        text = f"one value for {length:.4g} s from {start:.10g} s on: the sensor is stuck there"
        values = {"start": start, "length": length}
        hint = "leave that part of the log out, or check what is in the column"
        notices.append(Notice("stuck", "warning", name, text, values, hint))
    return tuple(notices)


def _longest_run(samples: FloatArray) -> tuple[int, int]:
    """First sample, and number, of most equal values in a row."""
    first, most, begin, last = 0, 0, 0, np.nan
    for part in windows(samples.size):
        own = samples[part]
        changes = part.start + np.flatnonzero(np.diff(own, prepend=last) != 0.0)
        starts = np.concatenate([[begin], changes])
        lengths = np.diff(np.append(starts, part.stop))
        longest = int(np.argmax(lengths))
        if lengths[longest] > most:
            first, most = int(starts[longest]), int(lengths[longest])
        begin, last = int(starts[-1]), own[-1]
        release(samples)
    return first, most


@dataclass(frozen=True)
class _Clock:
    """Time of the first epoch and sampling interval, s."""

    start: float
    dt: float
    notices: tuple[Notice, ...] = ()


def _clock(
    path: Path, record: _Record, time: str | int | bool | None, start: float | None
) -> _Clock:
    """Of a record with time stamps, or without."""
    text = "the IMU has no time stamps: fixes are timed from its first sample"
    none = _Clock(0.0, record.dt, (Notice("no-time-stamps", "note", "", text),))
    if start is not None:
        none = _Clock(start - record.dt, record.dt)
    if time is False:
        return none
    table = open_log(path)
    found = [i for i, name in enumerate(table.names) if is_time(name)]
    if isinstance(time, int):
        found = [time]
    elif isinstance(time, str):
        found = [i for i, name in enumerate(table.names) if time in (name, bare(name))]
    if not found:
        return none
    if start is not None:
        raise InputError(f"{record.source} has time stamps: leave its start out")
    first = last = np.nan
    for part in table.segments(found[:1], ROWS):
        stamps = part[found[0]]
        first, last = first if np.isfinite(first) else float(stamps[0]), float(stamps[-1])
    ratio = np.array(_CLOCKS) * (last - first) / ((record.n - 1) * record.dt)
    unit = _CLOCKS[int(np.argmin(np.abs(np.log(ratio))))]
    # What one block shows of the interval adds up over hours: all of them show it.
    dt = unit * (last - first) / (record.n - 1) if is_spooled(record.rate) else record.dt
    middle, late = [], []
    for part in table.segments(found[:1], ROWS):
        elapsed = (part[found[0]] - first) * unit
        epoch = np.rint(elapsed / dt)
        # One stamp may come late: the grid is where most of them are.
        middle.append(float(np.median(epoch)))
        late.append(float(np.median(elapsed - epoch * dt)))
    begin = float(np.median(late))
    if is_spooled(record.rate):
        slope, begin = (float(each) for each in np.polyfit(middle, late, 1))
        dt += slope
    return _Clock(first * unit + begin - dt, dt)
