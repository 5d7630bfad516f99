"""Times as people have them: of day, as hhmmss.ss of NMEA 0183, and set for summer by an hour."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray, median
from gmwm.readers import tuning

_DAY, _HOUR = 86400.0, 3600.0


def is_time_of_day(stamps: FloatArray) -> bool:
    """Whether stamps (n,) jump from 59 to 100 as minutes do, and by a usual step so read."""
    minutes, seconds = np.divmod(stamps, 100.0)
    if not np.all((stamps >= 0.0) & (stamps < 240000.0) & (seconds < 60.0) & (minutes % 100 < 60)):
        return False
    turns = np.diff(minutes) != 0.0
    count = int(np.count_nonzero(turns))
    if not 0 < count < tuning.MOST_TURNS * turns.size:
        return False
    steps = np.diff(seconds_of_day(stamps))
    usual = median(steps[~turns], overwrite=True)
    even = np.abs(steps[turns] - usual) < 0.5 * abs(usual)
    return int(np.count_nonzero(even)) > 0.5 * count


def seconds_of_day(stamps: FloatArray) -> FloatArray:
    """Times of day (n,) in seconds since the first midnight."""
    minutes, seconds = np.divmod(stamps, 100.0)
    hours, minutes = np.divmod(minutes, 100.0)
    # To the microsecond, which is what is left of hhmmss.ss.
    found = np.round(3600.0 * hours + 60.0 * minutes + seconds, 6)
    midnights = np.diff(found, prepend=found[:1]) < -0.5 * _DAY
    return np.asarray(found + _DAY * np.cumsum(midnights))


def without_summer_time(
    stamps: FloatArray, where: Callable[[int], str]
) -> tuple[FloatArray, list[Notice]]:
    """Take off the hour by which a clock without a zone is set twice a year, and report it.

    That is a step of an hour more or less than usual, to two steps, or a quarter of a second if
    that is more. Losses have hardly ever that length.

    stamps: (n,), s, of dates without a zone.
    where: Row -> where that is in the file.
    Returns: a copy if the clock was set, else ``stamps``; list of Notice, of code "summer-time".
    """
    steps = np.diff(stamps)
    known = steps[~np.isnan(steps)]
    if not known.size:
        return stamps, []
    usual = median(known)
    near = max(tuning.STEPS_OF_HOUR * abs(usual), tuning.NEAR_HOUR)
    beyond = steps - usual
    rows = np.flatnonzero(np.abs(np.abs(beyond) - _HOUR) < min(near, 0.1 * _HOUR)) + 1
    if not rows.size or rows.size > tuning.MOST_HOURS:
        return stamps, []
    shift = np.zeros(stamps.size)
    shift[rows] = np.sign(beyond[rows - 1]) * _HOUR
    forward = bool(shift[rows[0]] > 0.0)
    text = (
        f"dates without a zone {'jump by an hour' if forward else 'go back by an hour'} at "
        f"{where(int(rows[0]))}: taken as the change of summer time, so that no sample is missing"
    )
    hint = "write the zone beside the dates, or UTC"
    values = {"row": int(rows[0]), "changes": int(rows.size), "hour": float(shift[rows[0]])}
    return stamps - np.cumsum(shift), [Notice("summer-time", "warning", "", text, values, hint)]
