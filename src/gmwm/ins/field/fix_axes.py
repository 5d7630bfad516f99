"""Whether the velocities of fixes are those of their positions, or columns are exchanged."""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.geometry import ned_difference


def check_axes(source: str, time: FloatArray, position: FloatArray, velocity: FloatArray) -> None:
    """Refuse positions and velocities that go together with two columns exchanged only.

    A filter would blame the sensors. How far the vehicle went by the positions is compared with the
    integral of the velocities.

    time: (E,), s.
    position, velocity: (E, 3), latitude, longitude (rad), height (m); north, east, down (m/s); NaN
        where there is none.
    Raises InputError if the way by the velocities fits far better with an exchange.
    """
    there = np.all(np.isfinite(position) & np.isfinite(velocity), axis=1)
    time, position, velocity = time[there], position[there], velocity[there]
    if time.size < 2:
        return
    step = np.diff(time)[:, None]
    gone = np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * step, axis=0)
    gone = np.concatenate([np.zeros((1, 3)), gone])
    holes = np.concatenate([[0], np.cumsum(step[:, 0] > tuning.CHORD)])
    marks = np.searchsorted(time, np.arange(time[0], time[-1], tuning.WAY))
    first, last = marks[:-1], marks[1:]
    whole = holes[first] == holes[last]
    first, last = first[whole], last[whole]
    if first.size < tuning.FEWEST_WAYS:
        return
    by_velocity = gone[last] - gone[first]

    def apart(place: FloatArray, way: FloatArray, part: slice) -> float:
        off = (ned_difference(place[last], place[first]) - way)[:, part]
        return float(np.median(np.sum(off**2, axis=1)))

    level, vertical = slice(0, 2), slice(2, 3)
    other = position[:, [1, 0, 2]]
    tried = [
        ("velocity north and east", level, position, by_velocity[:, [1, 0, 2]]),
        ("velocity down and up", vertical, position, -by_velocity),
    ]
    if np.all(np.abs(other[:, 0]) < 0.5 * np.pi):
        tried.append(("latitude and longitude", level, other, by_velocity))
    for what, part, place, way in tried:
        if apart(position, by_velocity, part) > tuning.MIXED_UP**2 * apart(place, way, part):
            raise InputError(
                f"{source}: positions go with velocities only if {what} are exchanged: check which "
                "column is which"
            )
