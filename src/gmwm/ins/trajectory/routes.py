"""Routes: trajectories through waypoints."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.integrate import simpson

from gmwm._core.checks import positive
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.geometry import ned_difference
from gmwm.ins.trajectory.manoeuvres import (
    Body,
    Climb,
    Lla,
    Manoeuvre,
    Pulse,
    Straight,
    Turn,
    perform,
)
from gmwm.ins.trajectory.trajectory import Trajectory, finite_numbers

_SHORTEST = 1e-6  # m
_HALF_TURN = math.radians(179.0)  # the corner of a U-turn lies at infinity
_TURN_POINTS = 1001


def through(
    waypoints: Sequence[Lla] | FloatArray,
    *,
    speed: float,
    turn_rate: float,
    dt: float = 0.01,
    ramp: float = 2.0,
    flat: bool = False,
    level: bool = False,
) -> Trajectory:
    """The trajectory of a vehicle that follows straight legs and cuts the corners.

    It starts at the first waypoint in the direction of the second and ends at the last one. Legs
    have a constant heading. Heights change on the straight parts; corners are level.

    Raises InputError if legs are too short for the turns at their ends or for the climb, or one
    turns back.

    Parameters
    ----------
    waypoints : (k, 3) array_like
        Latitude, longitude, rad, and height, m.
    speed : float
        Horizontal speed over ground, m/s.
    turn_rate : float
        Highest rate of turn, rad/s.
    dt, ramp, flat, level : optional
        See `perform`.
    """
    points = finite_numbers(waypoints, "waypoints")
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2:
        raise InputError(
            f"waypoints has shape {points.shape}: give two or more, each of latitude, longitude "
            "and height"
        )
    speed, ramp = positive("speed", speed), positive("ramp", ramp)
    turn_rate = positive("turn_rate", turn_rate)
    legs = ned_difference(points[1:], points[:-1])
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    if np.any(lengths < _SHORTEST):
        i = int(np.argmin(lengths))
        raise InputError(f"waypoints {i} and {i + 1} lie over each other: leave one out")
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    turns = (np.diff(headings) + np.pi) % (2.0 * np.pi) - np.pi
    corners = [Pulse(float(turn), turn_rate, ramp) for turn in turns]
    cuts = [0.0, *(_cut(corner, speed, i) for i, corner in enumerate(corners, start=1)), 0.0]
    manoeuvres: list[Manoeuvre] = []
    for i, length in enumerate(lengths):
        time, rise = (float(length) - cuts[i] - cuts[i + 1]) / speed, -float(legs[i, 2])
        if time < 0.0:
            raise InputError(
                f"waypoints {i} and {i + 1} are {length:.4g} m apart where turns take "
                f"{cuts[i] + cuts[i + 1]:.4g} m: set them farther apart, turn faster or go slower"
            )
        if rise and time < 2.0 * ramp:
            raise InputError(
                f"waypoints {i} and {i + 1} leave {time:.4g} s to climb {rise:.4g} m: set them "
                "farther apart, or at one height"
            )
        if rise:
            manoeuvres.append(Climb(rise, abs(rise) / (time - ramp)))
        elif time > 0.0:
            manoeuvres.append(Straight(time))
        if i < len(corners) and corners[i].change:
            manoeuvres.append(Turn(corners[i].change, turn_rate))
    body: Body = {"flat": flat, "level": level}
    motion = {"heading": float(headings[0]), "speed": speed}
    return perform(manoeuvres, start=points[0], dt=dt, ramp=ramp, **motion, **body)


def _cut(corner: Pulse, speed: float, waypoint: int) -> float:
    """How far before a waypoint a turn begins, and behind it ends, m.

    A turn with ramps is symmetric, so its begin, the waypoint and its end make an isosceles
    triangle.
    """
    if abs(corner.change) > _HALF_TURN:
        raise InputError(
            f"waypoint {waypoint} asks to turn back: put two waypoints there, side by side"
        )
    if not corner.change:
        return 0.0
    base, _ = displacement(corner, -0.5 * corner.change, speed)
    return base / (2.0 * math.cos(0.5 * corner.change))


def displacement(turn: Pulse, heading: float, speed: float) -> tuple[float, float]:
    """How far a turn leads to the north and east, m.

    turn: Change of the heading, rad.
    heading: Before the turn, rad.
    speed: m/s.
    """
    time = np.linspace(0.0, turn.duration, _TURN_POINTS)
    along = heading + turn.value(time)
    north, east = (float(simpson(each, x=time)) for each in (np.cos(along), np.sin(along)))
    return speed * north, speed * east
