"""Ready-made trajectories: a helicopter that maps, a car, a small fixed-wing aircraft."""

import math
from collections.abc import Iterator
from itertools import cycle

from scipy.optimize import brentq

from gmwm._core.checks import positive
from gmwm.ins.trajectory.manoeuvres import (
    Accelerate,
    Climb,
    Lla,
    Manoeuvre,
    Pulse,
    Stop,
    Straight,
    Turn,
    displacement,
    perform,
)
from gmwm.ins.trajectory.trajectory import Trajectory

_START = (math.radians(46.52), math.radians(6.57), 400.0)
_RAMP, _SPACING = 2.0, 300.0  # s, of the helicopter's turns; m, between its strips
_CORNER, _CORNER_RATE = 0.5 * math.pi, math.radians(22.0)  # of streets
_BLOCKS = ((12.0, 15.0, 1.0), (20.0, 0.0, 1.0), (8.0, 35.0, -1.0), (15.0, 5.0, 1.0))
"""Streets of a town: s straight on, s at a light, side of the corner."""
_BENDS = ((35.0, 30.0), (-60.0, -12.0), (25.0, 15.0), (-15.0, -33.0))
"""An open road: deg of a bend, m of a rise after it."""
_BEND_RATE = math.radians(4.0)


def helicopter_mapping(
    *,
    duration: float = 1800.0,
    dt: float = 0.01,
    start: Lla = _START,
    heading: float = 0.5,
    strip: float = 3000.0,
) -> Trajectory:
    """Airborne laser scanning: a vertical climb, then parallel strips flown to and fro.

    Raises InputError if an argument is not positive.

    Parameters
    ----------
    duration, dt : float, optional
        s.
    start : (3,) sequence, optional
        Latitude, longitude, rad, and height, m.
    heading : float, optional
        Of the first strip, rad.
    strip : float, optional
        Length that each strip and the next have beside each other, m.
    """
    rate, speed, strip = math.radians(6.0), 30.0, positive("strip", strip)

    def end_of_turn(away: float) -> tuple[float, float]:
        """How far out and aside a turn ends that first turns away, m."""
        ahead, aside = displacement(Pulse(-away, rate, _RAMP), 0.0, speed)
        more, back = displacement(Pulse(math.pi + away, rate, _RAMP), -away, speed)
        return ahead + more, aside + back

    # Strips are closer than a turn is wide, which therefore begins to the other side.
    away = float(brentq(lambda angle: end_of_turn(angle)[1] - _SPACING, 0.0, 0.75 * math.pi))
    # A turn ends farther out than it began by the overshoot, and so does every other strip.
    length = strip + max(end_of_turn(away)[0], 0.0)

    def manoeuvres() -> Iterator[Manoeuvre]:
        yield from (Straight(30.0), Climb(150.0, 4.0), Accelerate(speed, 1.5))
        for side in cycle((1.0, -1.0)):
            yield Straight(length / speed)
            yield Turn(-side * away, rate)
            yield Turn(side * (math.pi + away), rate)

    return perform(
        manoeuvres(), start=start, heading=heading, dt=dt, ramp=_RAMP, level=True, duration=duration
    )


def car_drive(
    *, duration: float = 1200.0, dt: float = 0.01, start: Lla = _START, heading: float = 1.0
) -> Trajectory:
    """A car: streets with right-angled turns and stops at lights, then a winding open road.

    The arguments are those of `helicopter_mapping`.
    """

    def manoeuvres() -> Iterator[Manoeuvre]:
        yield Stop(20.0)
        for side in cycle((1.0, -1.0)):
            for block, wait, turn in _BLOCKS:
                yield from (Accelerate(13.0, 1.8), Straight(block))
                if wait:
                    yield Stop(wait, 2.0)
                yield from (Accelerate(5.5, 1.5), Turn(side * turn * _CORNER, _CORNER_RATE))
            yield Accelerate(24.0, 1.2)
            for bend, rise in _BENDS:
                yield from (Straight(9.0), Turn(side * math.radians(bend), _BEND_RATE))
                yield Climb(rise, 1.2)

    return perform(
        manoeuvres(), start=start, heading=heading, dt=dt, ramp=1.0, flat=True, duration=duration
    )


def fixed_wing_loiter(
    *,
    duration: float = 1200.0,
    dt: float = 0.01,
    start: Lla = _START,
    heading: float = 0.0,
) -> Trajectory:
    """A small fixed-wing aircraft that circles, now right, now left, with climbs between.

    The arguments are those of `helicopter_mapping`.
    """
    speed, rate = 22.0, 0.11  # m/s, rad/s: circles of 200 m

    def manoeuvres() -> Iterator[Manoeuvre]:
        yield from (Straight(20.0), Climb(60.0, 2.0))
        for side in cycle((1.0, -1.0)):
            yield from (Turn(side * 6.5 * math.pi, rate), Straight(15.0), Climb(side * 20.0, 1.5))

    return perform(
        manoeuvres(), start=start, heading=heading, speed=speed, dt=dt, duration=duration
    )
