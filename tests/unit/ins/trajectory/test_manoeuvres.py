import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.ins import Accelerate, Climb, Stop, Straight, Trajectory, Turn, emulate, perform
from gmwm.ins.geometry import ned_difference
from gmwm.ins.trajectory.manoeuvres import Manoeuvre

START = (math.radians(-40.0), math.pi - 1e-5, 100.0)


def test_each_manoeuvre_does_what_it_says() -> None:
    true = perform(
        [Accelerate(20.0, 1.0), Straight(5.0), Turn(2.0, 0.2), Climb(50.0, 3.0), Stop(10.0, 2.0)],
        start=START,
        heading=0.7,
        dt=0.02,
    )
    speed = np.hypot(true.velocity[:, 0], true.velocity[:, 1])
    assert np.max(speed) == pytest.approx(20.0, abs=1e-4)
    assert true.rpy[-1, 2] == pytest.approx(2.7)
    assert true.lla[-1, 2] == pytest.approx(150.0, abs=1e-6)
    standing = true.time > true.duration - 9.0
    np.testing.assert_allclose(true.velocity[standing], 0.0, atol=1e-6)
    # 20/1 + 2, 5, 2/0.2 + 2, 50/3 + 2, 20/2 + 2 + 10: each change takes its ramp besides.
    assert true.duration == pytest.approx(22 + 5 + 12 + 50 / 3 + 2 + 22, abs=0.02)


def test_a_turn_is_a_circle() -> None:
    true = perform([Turn(8 * math.pi, 0.1)], start=(0.7, 0.0, 0.0), speed=25.0, dt=0.05)
    middle = (true.time > 10.0) & (true.time < true.duration - 10.0)
    ned = ned_difference(true.lla, true.lla[0])[middle]
    # The fit of a circle is linear in centre and r^2 - centre^2.
    design = np.column_stack([2 * ned[:, :2], np.ones(len(ned))])
    x, y, _ = np.linalg.lstsq(design, (ned[:, :2] ** 2).sum(axis=1), rcond=None)[0]
    radius = np.hypot(ned[:, 0] - x, ned[:, 1] - y)
    # Meridians converge: a circle does not close by pi r^2 tan(lat)/a, 2.6 cm, and four by 10 cm.
    np.testing.assert_allclose(radius, 250.0, atol=0.052)


def smoothness(true: Trajectory) -> tuple[float, float]:
    """Largest change from sample to sample of the angular rate and the specific force."""
    imu = emulate(true)
    return (
        float(np.max(np.abs(np.diff(imu.rotation, axis=0)))) / true.dt,
        float(np.max(np.abs(np.diff(imu.velocity, axis=0)))) / true.dt,
    )


def test_rates_and_forces_are_continuous() -> None:
    def largest(dt: float) -> tuple[float, float]:
        return smoothness(
            perform(
                [Accelerate(30.0, 2.0), Turn(1.0, 0.1), Turn(-0.05, 0.1), Climb(40.0, 4.0)],
                start=START,
                dt=dt,
            )
        )

    # Halving the interval halves the largest change; at a jump it would stay.
    coarse, fine = largest(0.04), largest(0.02)
    for a, b in zip(coarse, fine, strict=True):
        assert b < 0.55 * a


@pytest.mark.parametrize("lat", [0.0, -1.0, 1.2])
def test_turns_are_coordinated(lat: float) -> None:
    manoeuvres: list[Manoeuvre] = [Turn(3.0, 0.15), Climb(60.0, 3.0), Turn(-4.0, 0.1)]
    banked = perform(manoeuvres, start=(lat, 0.3, 200.0), speed=30.0, dt=0.02)
    force = emulate(banked).velocity / 0.02
    # Over a curved Earth some v^2/a tan(lat) is left: 4e-4 m/s^2 at 1.2 rad.
    assert np.max(np.abs(force[:, 1])) < 1e-3
    assert np.max(np.abs(banked.rpy[:, 0])) == pytest.approx(math.atan(4.5 / 9.81), rel=0.02)
    flat = perform(manoeuvres, start=(lat, 0.3, 200.0), speed=30.0, dt=0.02, flat=True)
    assert np.all(flat.rpy[:, 0] == 0.0)
    assert np.max(np.abs(emulate(flat).velocity[:, 1] / 0.02)) == pytest.approx(4.5, rel=0.02)


def test_the_nose_follows_the_slope() -> None:
    true = perform([Climb(100.0, 5.0)], start=START, speed=20.0)
    slope = np.arctan2(-true.velocity[:, 2], np.hypot(*true.velocity[:, :2].T))
    np.testing.assert_allclose(true.rpy[:, 1], slope, atol=1e-6)
    level = perform([Climb(100.0, 5.0)], start=START, level=True)
    assert np.all(level.rpy[:, 1] == 0.0)
    np.testing.assert_allclose(ned_difference(level.lla[-1], level.lla[0]), [0, 0, -100], atol=1e-6)


def test_a_duration_cuts_or_goes_on() -> None:
    forever = itertools.cycle([Straight(3.0), Turn(0.3, 0.1)])
    assert perform(forever, start=START, speed=9.0, duration=31.0).duration == pytest.approx(31.0)
    short = perform([Accelerate(10.0)], start=START, duration=100.0)
    assert short.duration == pytest.approx(100.0)
    assert np.hypot(*short.velocity[-1, :2]) == pytest.approx(10.0, abs=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Straight(-1.0), "duration = -1"),
        (lambda: Turn(math.nan, 0.1), "angle = nan"),
        (lambda: Turn(1.0, 0.0), "rate = 0"),
        (lambda: Climb(math.inf, 1.0), "height_change = inf"),
        (lambda: Accelerate(-2.0), "to_speed = -2"),
        (lambda: Accelerate(2.0, -1.0), "acceleration = -1"),
        (lambda: Stop(0.0), "duration = 0"),
        (lambda: perform([], start=START), "a trajectory of 0 steps"),
        (lambda: perform(itertools.repeat(Turn(0.0, 1.0), 10), start=START), "0 steps"),
        (lambda: perform([Straight(9.0)], start=START, duration=1e12), "10,000,000 steps"),
        (lambda: perform([Straight(9.0)], start=(1.0, 2.0)), "start = "),
        (lambda: perform([Straight(9.0)], start=(1.56, 2.0, 3.0)), "too near a pole"),
        (lambda: perform([Straight(9.0)], start=START, speed=-1.0), "speed = -1"),
        (lambda: perform([Straight(9.0)], start=START, heading=math.nan), "heading = nan"),
        (lambda: perform([Straight(9.0)], start=START, ramp=0.0), "ramp = 0"),
        (lambda: perform([Climb(9.0, 1.0)], start=START), "climb at zero speed"),
        (
            lambda: perform([Straight(1e4)], start=(1.55, 0.0, 0.0), speed=100.0, dt=1.0),
            "manoeuvres: latitude .* too near a pole",
        ),
    ],
)
def test_impossible_manoeuvres_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
