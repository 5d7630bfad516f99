"""Trajectories logged in a delimited text: time, position and attitude, one row an epoch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.logs.log_columns import (
    POSITION_WORDS,
    angle_factor,
    angle_unit,
    by_word,
    check_angles,
    check_rising,
    find_columns,
    is_time,
    length_factor,
    open_log,
    place,
    words_of,
)
from gmwm.readers import TIME, CsvTable, stated_seconds

_HEADER = "time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,yaw_deg"
_ANGLES = ("latitude", "longitude", "roll", "pitch", "yaw")
_WORDS = POSITION_WORDS | by_word(
    {"roll": "roll bank", "pitch": "pitch", "yaw": "yaw heading hdg azimuth"}
)
_NOT_THE_VALUE = frozenset(
    {"std", "sigma", "var", "cov", "err", "error", "rate", "ref", "acc", "accuracy", "dot"}
)
_UNEVEN = 0.1  # of the sampling interval: at 20 m/s and 100 Hz, 2 cm
_LARGEST_ANGLE = 1e4  # rad; a log that counts turns stays far below


@dataclass(frozen=True, eq=False)
class Log:
    """What a file says.

    dt: Sampling interval, s.
    lla: (n + 1, 3), latitude, longitude, rad, and height, m.
    rpy: (n + 1, 3), roll, pitch and yaw, rad.
    """

    dt: float
    lla: FloatArray
    rpy: FloatArray


def read_log(path: Path) -> Log:
    """Read a log of a trajectory.

    Raises InputError if a column is missing, a value is missing or impossible, or the clock is not
        even.
    """
    table = open_log(path)
    columns, _ = find_columns(table, _quantities, (TIME, *_ANGLES, "height"), _HEADER)
    found = table.load(list(columns.values()))
    values = {name: found[column] for name, column in columns.items()}
    for name, column in columns.items():
        _check_complete(table, column, values[name])
    dt = _interval(table, columns[TIME], values[TIME])
    factors = _factors(table, columns, values["latitude"])
    scaled = {name: factor * values[name] for name, factor in factors.items()}
    _check_angles(table, columns, scaled)
    return Log(
        dt,
        np.stack([scaled[name] for name in ("latitude", "longitude", "height")], axis=-1),
        np.stack([scaled[name] for name in ("roll", "pitch", "yaw")], axis=-1),
    )


def _quantities(name: str) -> tuple[str, ...]:
    """Time, latitude, ... or none if the column is something else."""
    if is_time(name):
        return (TIME,)
    words = words_of(name)
    if not words or not _NOT_THE_VALUE.isdisjoint(words) or words[-1] not in _WORDS:
        return ()
    return (_WORDS[words[-1]],)


def _check_complete(table: CsvTable, column: int, values: FloatArray) -> None:
    bad = np.flatnonzero(np.isnan(values))
    if bad.size:
        raise InputError(
            f"{place(table, column, int(bad[0]))}: no value: fill the gap, or use the part of "
            "the file before or after it"
        )


def _interval(table: CsvTable, column: int, stamps: FloatArray) -> float:
    """Sampling interval of time stamps that are evenly spaced, s."""
    n = stamps.size - 1
    if n < 1:
        raise InputError(f"{table.source} has a single row: give two epochs or more")
    check_rising(table, column, stamps)
    steps = np.diff(stamps)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(np.abs(steps - usual) > 0.5 * usual)
    dt = float(stamps[-1] - stamps[0]) / n
    late = np.flatnonzero(np.abs(stamps - stamps[0] - dt * np.arange(n + 1)) > _UNEVEN * dt)
    if gaps.size or late.size:
        row = int(gaps[0]) + 1 if gaps.size else int(late[0])
        raise InputError(
            f"{place(table, column, row)}: time stamp {stamps[row]:.15g} is off the even spacing "
            f"of {usual:.6g}: resample the log to even steps, or use the part before or after"
        )
    return dt * (stated_seconds(table.source, table.names[column]) or 1.0)


def _factors(table: CsvTable, columns: Mapping[str, int], latitude: FloatArray) -> dict[str, float]:
    """What each quantity is to be multiplied by to come to rad or m."""
    common = angle_unit(table.names[columns["latitude"]], latitude)
    factors = {name: angle_factor(table, columns[name], name, common) for name in _ANGLES}
    return {**factors, "height": length_factor(table, columns["height"], "height")}


def _check_angles(
    table: CsvTable, columns: Mapping[str, int], angles: Mapping[str, FloatArray]
) -> None:
    """Refuse what no latitude or pitch can be, nor any other angle."""
    for name in ("latitude", "pitch"):
        check_angles(table, columns[name], name, angles[name])
    for name in ("longitude", "roll", "yaw"):
        check_angles(table, columns[name], name, angles[name], _LARGEST_ANGLE)
