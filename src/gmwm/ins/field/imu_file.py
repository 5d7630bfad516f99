"""IMU logs: angular rates and specific forces in a delimited text, as increments."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.geometry import STANDARD_GRAVITY
from gmwm.ins.imu import AXES, Imu
from gmwm.ins.logs import is_time, open_log
from gmwm.readers import Recording, bare, is_text, read

Columns = Mapping[str, str | int] | None

_CLOCKS = (1.0, 1e-3, 1e-6, 1e-9)  # s


@dataclass(frozen=True, eq=False)
class ImuLog:
    """An IMU record with the clock that it was stamped by.

    Attributes
    ----------
    imu : Imu
    start : float
        Time of the first epoch on that clock, s; 0 without time stamps.
    source : str
    notices : tuple of Notice
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
    format, layout : str, optional
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
    log = read_imu_log(path, rate, units, channels, time, start, format=format, layout=layout)
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
) -> ImuLog:
    """Read an IMU record with its clock; see `read_imu`."""
    columns, turned = _signs(channels)
    recording = read(path, rate, units, columns, time, layout, format=format)
    recording = recording.of_one_rate("navigation")
    missing = [axis for axis in AXES if axis not in recording.names]
    if missing:
        raise InputError(
            f"{recording.source}: there is no channel {missing[0]}: an IMU has {', '.join(AXES)}"
        )
    samples = np.column_stack([recording[axis].values for axis in AXES])
    samples[:, [axis in turned for axis in AXES]] *= -1.0
    filled = _fill(samples, recording)
    force = float(np.linalg.norm(np.mean(samples[:, 3:], axis=0)))
    least, most = tuning.SPECIFIC_FORCE
    if not least * STANDARD_GRAVITY < force < most * STANDARD_GRAVITY:
        raise InputError(
            f"{recording.source}: the mean specific force is {force:.4g} m/s^2, far from gravity: "
            "check the unit of the accelerometers, and that gravity is not subtracted"
        )
    imu = Imu(recording.dt, samples[:, :3] * recording.dt, samples[:, 3:] * recording.dt)
    is_log = layout is None and (is_text(Path(path)) if format is None else format == "text")
    first, notices = _clock(Path(path), recording, time if is_log else False, start)
    notices = (*notices, *filled)
    if np.mean(samples[:, 5]) > 0.0:
        text = "its mean is positive: the axis points up, and roll is near 180 deg"
        notices = (*notices, Notice("axis-up", "warning", "accel_z", text))
    return ImuLog(imu, first, recording.source, (*recording.notices, *notices))


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


def _fill(samples: FloatArray, recording: Recording) -> tuple[Notice, ...]:
    """Fill short holes along straight lines, in place.

    Raises
    ------
    InputError
        If one is too long, or at an end.
    """
    holes = np.isnan(samples)
    if not np.any(holes):
        return ()
    most = max(round(tuning.LONGEST_FILLED / recording.dt), 1)
    longest = 0
    for column, name in enumerate(AXES):
        edges = np.flatnonzero(np.diff(holes[:, column].astype(np.int8), prepend=0, append=0))
        for begin, end in edges.reshape(-1, 2):
            longest = max(longest, int(end - begin))
            if end - begin > most or begin == 0 or end == len(samples):
                raise InputError(
                    f"{recording.source}: sample {begin + 1:,} of {name}, "
                    f"{begin * recording.dt:.6g} s after the first, is missing, {end - begin:,} in "
                    f"a row: up to {most} between others are filled; use the part before or after"
                )
        there = np.flatnonzero(~holes[:, column])
        missing = np.flatnonzero(holes[:, column])
        samples[missing, column] = np.interp(missing, there, samples[there, column])
    count = int(np.count_nonzero(np.any(holes, axis=1)))
    text = (
        f"{count:,} missing samples, at most {longest} in a row, are filled from those beside them"
    )
    values = {"count": count, "longest": longest}
    return (Notice("samples-filled", "warning", "", text, values),)


def _clock(
    path: Path, recording: Recording, time: str | int | bool | None, start: float | None
) -> tuple[float, tuple[Notice, ...]]:
    """Time of the first epoch, s, and its notices."""
    text = "the IMU has no time stamps: fixes are timed from its first sample"
    none: tuple[float, tuple[Notice, ...]] = 0.0, (Notice("no-time-stamps", "note", "", text),)
    if start is not None:
        none = start - recording.dt, ()
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
        raise InputError(f"{recording.source} has time stamps: leave its start out")
    stamps = table.load(found[:1])[found[0]]
    span = (recording.n - 1) * recording.dt
    ratio = np.array(_CLOCKS) * (stamps[-1] - stamps[0]) / span
    unit = _CLOCKS[int(np.argmin(np.abs(np.log(ratio))))]
    # One stamp may come late: the grid is where most of them are.
    elapsed = (stamps - stamps[0]) * unit
    late = float(np.median(elapsed - np.rint(elapsed / recording.dt) * recording.dt))
    return float(stamps[0]) * unit + late - recording.dt, ()
