"""IMU logs: angular rates and specific forces in a delimited text, as increments."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from gmwm._core.notices import Notice
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.geometry import STANDARD_GRAVITY
from gmwm.ins.imu import AXES, Imu
from gmwm.ins.logs import is_time, open_log
from gmwm.readers import Recording, bare, is_text, read

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
        See `gmwm.read`.

    Returns
    -------
    Imu

    Raises
    ------
    InputError
        If the file cannot be used, an axis is missing, a sample is missing, or the specific force
        is far from gravity: most often a wrong unit.
    """
    return read_imu_log(path, rate, units, channels, time).imu


def read_imu_log(
    path: str | os.PathLike[str],
    rate: float | None = None,
    units: Mapping[str, str] | None = None,
    channels: Mapping[str, str | int] | None = None,
    time: str | int | Literal[False] | None = None,
) -> ImuLog:
    """Read an IMU record with its clock; see `read_imu`."""
    recording = read(path, rate, units, channels, time).of_one_rate("navigation")
    missing = [axis for axis in AXES if axis not in recording.names]
    if missing:
        raise InputError(
            f"{recording.source}: there is no channel {missing[0]}: an IMU has {', '.join(AXES)}"
        )
    samples = np.column_stack([recording[axis].values for axis in AXES])
    holes = np.argwhere(np.isnan(samples))
    if holes.size:
        row, column = (int(each) for each in holes[0])
        raise InputError(
            f"{recording.source}: sample {row + 1:,} of {AXES[column]}, {row * recording.dt:.6g} s "
            "after the first, is missing: fill the gap, or use the part before or after it"
        )
    force = float(np.linalg.norm(np.mean(samples[:, 3:], axis=0)))
    least, most = tuning.SPECIFIC_FORCE
    if not least * STANDARD_GRAVITY < force < most * STANDARD_GRAVITY:
        raise InputError(
            f"{recording.source}: the mean specific force is {force:.4g} m/s^2, far from gravity: "
            "check the unit of the accelerometers, and that gravity is not subtracted"
        )
    imu = Imu(recording.dt, samples[:, :3] * recording.dt, samples[:, 3:] * recording.dt)
    start, notices = _clock(Path(path), recording, time)
    if np.mean(samples[:, 5]) > 0.0:
        text = "its mean is positive: the axis points up, and roll is near 180 deg"
        notices = (*notices, Notice("axis-up", "warning", "accel_z", text))
    return ImuLog(imu, start, recording.source, (*recording.notices, *notices))


def _clock(
    path: Path, recording: Recording, time: str | int | bool | None
) -> tuple[float, tuple[Notice, ...]]:
    """Time of the first epoch, s, and its notices."""
    text = "the IMU has no time stamps: fixes are timed from its first sample"
    none = 0.0, (Notice("no-time-stamps", "note", "", text),)
    if time is False or not is_text(path):
        return none
    table = open_log(path)
    found = [i for i, name in enumerate(table.names) if is_time(name)]
    if isinstance(time, int):
        found = [time]
    elif isinstance(time, str):
        found = [i for i, name in enumerate(table.names) if time in (name, bare(name))]
    if not found:
        return none
    stamps = table.load(found[:1])[found[0]]
    span = (recording.n - 1) * recording.dt
    ratio = np.array(_CLOCKS) * (stamps[-1] - stamps[0]) / span
    unit = _CLOCKS[int(np.argmin(np.abs(np.log(ratio))))]
    return float(stamps[0]) * unit - recording.dt, ()
