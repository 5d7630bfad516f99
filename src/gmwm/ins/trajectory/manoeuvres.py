"""Trajectories from lists of manoeuvres or through waypoints.

Speed is horizontal, over ground; heading is counted from north to the east. Rates of change rise
and fall smoothly, so that angular rates and specific forces are continuous.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypedDict, Unpack

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import simpson

from gmwm._core.checks import is_number, positive, sampling_interval, shown
from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.geometry import RATE, gravity_along, ned_difference, radii_at
from gmwm.ins.trajectory.trajectory import Trajectory, check_latitudes, finite_rows, three_numbers

Lla = Sequence[float] | FloatArray
"""Latitude, longitude, rad, and height, m."""

_LONGEST = 10_000_000  # steps: 2 GB while the trajectory is built
_SHORTEST = 1e-6  # m
_HALF_TURN = math.radians(179.0)  # the corner of a U-turn lies at infinity
_TURN_POINTS = 1001


_STEP = Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
"""From 0 to 1; two derivatives vanish at both ends."""
_AREA, _BELL = _STEP.integ(), _STEP.deriv()


@dataclass(frozen=True)
class Pulse:
    """A change of a quantity.

    change: By how much, signed.
    limit: Largest rate, unit of the quantity per second; a change too small for it has a lower one.
    ramp: Time in which the rate comes up smoothly, and goes down, s.
    """

    change: float
    limit: float
    ramp: float

    @property
    def rate(self) -> float:
        """Rate between the ramps, signed."""
        return float(np.clip(self.change / self.ramp, -self.limit, self.limit))

    @property
    def hold(self) -> float:
        """Time between the ramps, s."""
        return max(abs(self.change) / self.limit - self.ramp, 0.0) if self.change else 0.0

    @property
    def duration(self) -> float:
        """From the begin of the first ramp to the end of the last one, s; 0 without a change."""
        return 2.0 * self.ramp + self.hold if self.change else 0.0

    def value(self, time: FloatArray) -> FloatArray:
        """What has changed some time after the begin, s."""
        area = self.ramp * self._ramps(_AREA, time)
        # After a ramp its step goes on at 1.
        past_up = np.maximum(time - self.ramp, 0.0)
        past_down = np.maximum(time - 2.0 * self.ramp - self.hold, 0.0)
        found = self.rate * (area + past_up - past_down)
        return np.where(time >= self.duration, self.change, found)

    def slope(self, time: FloatArray) -> FloatArray:
        """Its rate some time after the begin, s."""
        return self.rate * self._ramps(_STEP, time)

    def curvature(self, time: FloatArray) -> FloatArray:
        """Derivative of the rate some time after the begin, s."""
        return self.rate / self.ramp * self._ramps(_BELL, time)

    def _ramps(self, of: Polynomial, time: FloatArray) -> FloatArray:
        """A polynomial on the ramp up less that on the ramp down."""
        up = np.clip(time / self.ramp, 0.0, 1.0)
        down = np.clip((time - self.ramp - self.hold) / self.ramp, 0.0, 1.0)
        return np.asarray(of(up) - of(down))


class Plan(NamedTuple):
    """What a manoeuvre does in ``duration`` (s): changes that begin with it, in m/s, rad and m."""

    duration: float
    speed: Pulse | None = None
    heading: Pulse | None = None
    height: Pulse | None = None


class Manoeuvre(Protocol):
    """Something a vehicle does for a while."""

    def plan(self, speed: float, ramp: float) -> Plan:
        """Lay it out for a vehicle that comes with some speed, m/s; ramps take ``ramp`` s."""


@dataclass(frozen=True)
class Straight:
    """Go on with the same speed, heading and height for some time, s."""

    duration: float

    def __post_init__(self) -> None:
        positive("duration", self.duration)

    def plan(self, speed: float, ramp: float) -> Plan:
        """Nothing changes."""
        return Plan(self.duration)


@dataclass(frozen=True)
class Accelerate:
    """Come to another speed, m/s, with at most an acceleration, m/s^2."""

    to_speed: float
    acceleration: float = 1.0

    def __post_init__(self) -> None:
        _check_speed("to_speed", self.to_speed)
        positive("acceleration", self.acceleration)

    def plan(self, speed: float, ramp: float) -> Plan:
        """The speed changes."""
        pulse = Pulse(self.to_speed - speed, self.acceleration, ramp)
        return Plan(pulse.duration, speed=pulse)


@dataclass(frozen=True)
class Stop:
    """Brake with at most a deceleration, m/s^2, and stand still for some time, s."""

    duration: float
    deceleration: float = 1.5

    def __post_init__(self) -> None:
        positive("duration", self.duration)
        positive("deceleration", self.deceleration)

    def plan(self, speed: float, ramp: float) -> Plan:
        """The speed goes to zero and stays there."""
        pulse = Pulse(-speed, self.deceleration, ramp)
        return Plan(pulse.duration + self.duration, speed=pulse)


@dataclass(frozen=True)
class Turn:
    """Change the heading by an angle, rad, positive to the right, with at most a rate, rad/s."""

    angle: float
    rate: float

    def __post_init__(self) -> None:
        _check_number("angle", self.angle, "rad")
        positive("rate", self.rate)

    def plan(self, speed: float, ramp: float) -> Plan:
        """The heading changes."""
        pulse = Pulse(self.angle, self.rate, ramp)
        return Plan(pulse.duration, heading=pulse)


@dataclass(frozen=True)
class Climb:
    """Change the height by some metres, negative to descend, with at most a rate, m/s."""

    height_change: float
    rate: float

    def __post_init__(self) -> None:
        _check_number("height_change", self.height_change, "m")
        positive("rate", self.rate)

    def plan(self, speed: float, ramp: float) -> Plan:
        """The height changes."""
        pulse = Pulse(self.height_change, self.rate, ramp)
        return Plan(pulse.duration, height=pulse)


def _check_speed(name: str, value: float) -> None:
    if not is_number(value) or value < 0.0:
        raise InputError(f"{name} = {shown(value)}: give a speed, zero or more")


def _check_number(name: str, value: float, unit: str) -> None:
    if not is_number(value):
        raise InputError(f"{name} = {shown(value)}: give a number in {unit}")


class Body(TypedDict, total=False):
    """How the body is turned; see `perform`."""

    flat: bool
    level: bool


def perform(
    manoeuvres: Iterable[Manoeuvre],
    *,
    start: Lla,
    heading: float = 0.0,
    speed: float = 0.0,
    dt: float = 0.01,
    ramp: float = 2.0,
    duration: float | None = None,
    **body: Unpack[Body],
) -> Trajectory:
    """The trajectory of a vehicle that does one manoeuvre after the other; its yaw is not wrapped.

    Raises InputError if nothing is to be done, a body that is not level climbs at no speed, or the
    way leads to a pole.

    Parameters
    ----------
    manoeuvres : iterable of Straight, Accelerate, Stop, Turn or Climb
        May go on forever if a duration is given.
    start : (3,) sequence
        Latitude, longitude, rad, and height, m.
    heading, speed : float, optional
        At the start: rad, m/s.
    dt : float, optional
        Sampling interval, s.
    ramp : float, optional
        Time in which a rate or an acceleration comes up, s.
    duration : float, optional
        Length of the trajectory, s; manoeuvres are cut there, or the last state goes on. By
        default, as long as they take.
    flat : bool, optional
        True for a body that does not bank, as a car; by default turns are banked so that the
        specific force stays in the body's plane of symmetry.
    level : bool, optional
        True for a body that does not pitch, as a helicopter that climbs vertically; by default it
        points where it goes.
    """
    dt, ramp = sampling_interval(dt), positive("ramp", ramp)
    origin = three_numbers("start", start)
    check_latitudes(origin[None, :], "start")
    _check_speed("speed", speed)
    _check_number("heading", heading, "rad")
    limit = dt * _LONGEST if duration is None else positive("duration", duration)
    plans, elapsed, now = [], 0.0, speed
    for manoeuvre in manoeuvres:
        plan = manoeuvre.plan(now, ramp)
        plans.append(plan)
        elapsed += plan.duration
        now = max(now + plan.speed.change, 0.0) if plan.speed is not None else now
        if elapsed > min(limit, dt * _LONGEST):
            break
    n = math.floor((elapsed if duration is None else limit) / dt + 1e-6)
    if not 1 <= n <= _LONGEST:
        raise InputError(f"a trajectory of {n:,} steps of {dt:g} s: give 1 to {_LONGEST:,} steps")
    course = _course(plans, 0.5 * dt * np.arange(2 * n + 1, dtype=float), speed, heading)
    lla = np.tile(origin, (n + 1, 1))
    _walk(course.speed, course.heading, course.climb, dt, lla)
    check_latitudes(lla, "manoeuvres")
    return Trajectory.from_arrays(dt, lla, _attitude(course, lla, **body))


class _Course(NamedTuple):
    """Speed, heading and rate of climb, and their derivatives, at epochs and half-way."""

    speed: FloatArray
    acceleration: FloatArray
    heading: FloatArray
    turn_rate: FloatArray
    climb: FloatArray
    climb_rate: FloatArray


def _course(plans: Sequence[Plan], time: FloatArray, speed: float, heading: float) -> _Course:
    course = _Course(*np.zeros((6, time.size)))
    course.speed[:], course.heading[:] = speed, heading
    begin = 0.0
    for plan in plans:
        first = int(np.searchsorted(time, begin))
        since = time[first:] - begin
        if plan.speed is not None:
            course.speed[first:] += plan.speed.value(since)
            course.acceleration[first:] += plan.speed.slope(since)
        if plan.heading is not None:
            course.heading[first:] += plan.heading.value(since)
            course.turn_rate[first:] += plan.heading.slope(since)
        if plan.height is not None:
            course.climb[first:] += plan.height.slope(since)
            course.climb_rate[first:] += plan.height.curvature(since)
        begin += plan.duration
    # Sums of changes leave rounding errors where a vehicle should stand still.
    course.speed[course.speed < 1e-12] = 0.0
    return course


def _attitude(
    course: _Course, lla: FloatArray, *, flat: bool = False, level: bool = False
) -> FloatArray:
    """Roll, pitch and yaw at the epochs; banked for Coriolis too, not for the curved way."""
    speed, heading, climb = course.speed[::2], course.heading[::2], course.climb[::2]
    pitch, roll = np.zeros(speed.size), np.zeros(speed.size)
    if not level:
        if np.any((np.abs(climb) > 0.0) & ~(speed > 0.0)):
            raise InputError(
                "manoeuvres climb at zero speed: accelerate first, or give level=True for a body "
                "that stays level"
            )
        pitch = np.arctan2(climb, speed)
    if not flat:
        # The Earth's axis, and the specific force, in a level frame with the body's heading.
        ahead, across = np.cos(lla[:, 0]) * np.cos(heading), -np.cos(lla[:, 0]) * np.sin(heading)
        below = -np.sin(lla[:, 0])
        forward = course.acceleration[::2] - 2.0 * RATE * across * climb
        right = speed * course.turn_rate[::2] + 2.0 * RATE * (below * speed + ahead * climb)
        down = -course.climb_rate[::2] - 2.0 * RATE * across * speed
        down -= gravity_along(lla[:, 0], lla[:, 2])
        roll = np.arctan2(right, -(forward * np.sin(pitch) + down * np.cos(pitch)))
    return np.stack([roll, pitch, heading], axis=-1)


@compiled()
def _walk(
    speed: FloatArray, heading: FloatArray, climb: FloatArray, dt: float, lla: FloatArray
) -> None:
    """Integrate the way by the fourth-order Runge-Kutta rule; inputs at epochs and half-way."""
    for i in range(lla.shape[0] - 1):
        a, b, c = 2 * i, 2 * i + 1, 2 * i + 2
        h = lla[i, 2]
        h_mid = h + dt / 24.0 * (5.0 * climb[a] + 8.0 * climb[b] - climb[c])
        h_end = h + dt / 6.0 * (climb[a] + 4.0 * climb[b] + climb[c])
        lat = lla[i, 0]
        lat_1, lon_1 = _angular_speed(lat, h, speed[a], heading[a])
        lat_2, lon_2 = _angular_speed(lat + 0.5 * dt * lat_1, h_mid, speed[b], heading[b])
        lat_3, lon_3 = _angular_speed(lat + 0.5 * dt * lat_2, h_mid, speed[b], heading[b])
        lat_4, lon_4 = _angular_speed(lat + dt * lat_3, h_end, speed[c], heading[c])
        lla[i + 1, 0] = lat + dt / 6.0 * (lat_1 + 2.0 * lat_2 + 2.0 * lat_3 + lat_4)
        lla[i + 1, 1] = lla[i, 1] + dt / 6.0 * (lon_1 + 2.0 * lon_2 + 2.0 * lon_3 + lon_4)
        lla[i + 1, 2] = h_end


@compiled()
def _angular_speed(lat: float, h: float, speed: float, heading: float) -> tuple[float, float]:
    """Rates of latitude and longitude, rad/s."""
    meridian, transverse = radii_at(math.sin(lat))
    north, east = speed * math.cos(heading), speed * math.sin(heading)
    return north / (meridian + h), east / ((transverse + h) * math.cos(lat))


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
    hint = "two or more, each of latitude, longitude and height"
    points = finite_rows(waypoints, "waypoints", hint, 2)
    speed, ramp = positive("speed", speed), positive("ramp", ramp)
    turn_rate = positive("turn_rate", turn_rate)
    legs = ned_difference(points[1:], points[:-1])
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    if np.any(lengths < _SHORTEST):
        i = int(np.argmin(lengths))
        raise InputError(f"waypoints {i} and {i + 1} coincide: leave one out")
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    turns = (np.diff(headings) + np.pi) % (2.0 * np.pi) - np.pi
    if np.any(np.abs(turns) > _HALF_TURN):
        i = int(np.argmax(np.abs(turns) > _HALF_TURN)) + 1
        raise InputError(f"path turns back at waypoint {i}: put two waypoints there, side by side")
    cuts = [0.0]  # how far before a waypoint a turn begins, and behind it ends, m
    for turn in map(float, turns):
        base = displacement(Pulse(turn, turn_rate, ramp), -0.5 * turn, speed)[0] if turn else 0.0
        cuts.append(base / (2.0 * math.cos(0.5 * turn)))
    cuts.append(0.0)
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
                f"waypoints {i} and {i + 1} leave only {time:.4g} s to climb {rise:.4g} m: set "
                "them farther apart, or at one height"
            )
        if rise:
            manoeuvres.append(Climb(rise, abs(rise) / (time - ramp)))
        elif time > 0.0:
            manoeuvres.append(Straight(time))
        if i < turns.size and turns[i]:
            manoeuvres.append(Turn(float(turns[i]), turn_rate))
    body: Body = {"flat": flat, "level": level}
    motion = {"heading": float(headings[0]), "speed": speed}
    return perform(manoeuvres, start=points[0], dt=dt, ramp=ramp, **motion, **body)


def displacement(turn: Pulse, heading: float, speed: float) -> tuple[float, float]:
    """How far a turn from a heading (rad) at a speed (m/s) leads to the north and east, m."""
    time = np.linspace(0.0, turn.duration, _TURN_POINTS)
    along = heading + turn.value(time)
    north, east = (float(simpson(each, x=time)) for each in (np.cos(along), np.sin(along)))
    return speed * north, speed * east
