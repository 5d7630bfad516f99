"""Times of day that are written as one number, hhmmss.ss, as NMEA 0183 has them."""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.readers import tuning

_DAY = 86400.0


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
    usual = float(np.median(steps[~turns]))
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
