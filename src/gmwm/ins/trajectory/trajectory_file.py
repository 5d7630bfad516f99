"""Trajectories in a delimited text: time, position and attitude, one row an epoch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.trajectory.columns import POSITION_WORDS, LogColumns, by_word, is_time, words_of
from gmwm.readers import TIME

_HEADER = "time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,yaw_deg"
_WORDS = POSITION_WORDS | by_word(
    {"roll": "roll bank", "pitch": "pitch", "yaw": "yaw heading hdg azimuth"}
)
_NOT_THE_VALUE = frozenset(
    {"std", "sigma", "var", "cov", "err", "error", "rate", "ref", "acc", "accuracy", "dot"}
)
_UNEVEN = 0.1  # of the sampling interval: at 20 m/s and 100 Hz, 2 cm
_QUARTER, _MANY_TURNS = 0.5 * np.pi, 1e4  # rad; a log that counts turns stays far below
_LIMITS = {"latitude": _QUARTER, "pitch": _QUARTER}
_LIMITS |= dict.fromkeys(("longitude", "roll", "yaw"), _MANY_TURNS)


@dataclass(frozen=True, eq=False)
class Log:
    """Content of a file.

    dt: Sampling interval, s.
    lla: (n + 1, 3), latitude, longitude, rad, and height, m.
    rpy: (n + 1, 3), roll, pitch and yaw, rad.
    """

    dt: float
    lla: FloatArray
    rpy: FloatArray


def read_log(path: Path) -> Log:
    """Read a log of a trajectory.

    Raises InputError if a column is missing, a value is missing or impossible, or the time stamps
        are not even.
    """
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
    return Log(
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
        raise InputError(f"{log.table.source} has a single row: give two epochs or more")
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
