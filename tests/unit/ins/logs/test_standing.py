"""Where a vehicle is steady or stands, and its first heading, from records made by hand."""

import numpy as np
import pytest

from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding, Fixes
from gmwm.ins.geometry import RATE, matrix_from_rpy, ned_difference, offset, rpy_from_matrix
from gmwm.ins.increments import Imu
from gmwm.ins.logs import standstills, steady
from gmwm.ins.logs.attitude import gyrocompass, heading_from_course, turned, velocity_at_rest

DT = 0.1
LLA = np.array([0.8, 0.2, 300.0])
WINDOW = round(tuning.STEADY_WINDOW / DT)


def imu(force, rate=0.0):
    """Means of windows: forwards accelerations in m/s^2, and turning to the right in rad/s."""
    force = np.repeat(np.asarray(force, dtype=float), WINDOW)
    rotation, velocity = np.zeros((2, force.size, 3))
    velocity[:, 0] = DT * force
    rotation[:, 2] = DT * rate
    return Imu(DT, rotation, velocity)


def fixes(kind, time, value, sd=1.0):
    value = np.asarray(value, dtype=float)
    return Fixes(kind, np.asarray(time, dtype=float), value, np.full(value.shape, sd))


def track(time, way, sd=1.0):
    """Position fixes at a way (E, 2) to the north and east, m."""
    way = np.column_stack([way, np.zeros(len(way))])
    return fixes("position", time, offset(np.tile(LLA, (len(way), 1)), way), sd)


@pytest.mark.parametrize(
    ("force", "found"),
    [
        ([0.0] * 4, (0, 4)),
        ([0.0] * 3, None),
        ([1.0, 0.0, 0.0, 0.0, 0.0], (1, 5)),
        ([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 5.0], (2, 6)),
        ([0.0, 0.2, 0.0, 0.0], (0, 4)),  # 0.15 m/s^2 times the root of two
        ([0.0, 0.22, 0.0, 0.0], None),
        ([0.0, 0.0, 0.0, 0.0, 0.17], (0, 4)),
        ([0.0, 0.0, 0.0, 0.0, 0.16], (0, 5)),
        ([0.0] * 70, (0, round(tuning.STEADY_MOST / tuning.STEADY_WINDOW))),
    ],
)
def test_a_stretch_is_steady_as_long_as_its_means_stay(force, found):
    expected = found and (found[0] * WINDOW, found[1] * WINDOW)
    assert next(steady(imu(force)), None) == expected


def test_a_steady_stretch_is_sought_at_the_beginning():
    moving = np.tile([0.0, 5.0], round(0.5 * tuning.SEARCHED / tuning.STEADY_WINDOW))
    assert not list(steady(imu([*moving, *np.zeros(10)])))
    assert list(steady(imu([*moving[4:], *np.zeros(10)])))


@pytest.mark.parametrize(("speed", "rests"), [(0.12, True), (0.13, False), (-0.13, False)])
def test_rest_by_velocities_is_within_five_standard_deviations(speed, rests):
    value = np.zeros((4, 3))
    value[:, 1] = speed
    aiding = Aiding((fixes("velocity", [1.0, 2.0, 3.0, 4.0], value, 0.05),))
    found = velocity_at_rest(aiding, DT, 5, 45)
    if not rests:
        assert found is None
        return
    assert found == pytest.approx(0.025)
    assert velocity_at_rest(aiding, DT, 11, 20) == pytest.approx(0.05)  # the second one alone
    assert velocity_at_rest(aiding, DT, 10, 20) == pytest.approx(np.sqrt(0.5) * 0.05)


@pytest.mark.parametrize(("way", "rests"), [(1.4, True), (1.43, False)])
def test_rest_by_positions_is_within_five_standard_deviations(way, rests):
    aiding = Aiding((track([1.0, 2.0, 5.0], [[0, 0], [99, 0], [0, -way]], 0.2),))
    expected = pytest.approx(np.sqrt(0.08) / 4.0) if rests else None
    assert velocity_at_rest(aiding, DT, 0, 60) == expected
    assert velocity_at_rest(aiding, DT, 25, 60) is None


def test_positions_that_do_not_show_a_start_from_rest_show_no_rest():
    """A car that sped up by 4 m/s^2 in its first 3 s was levelled as if at rest, 23 deg off."""
    vague, clear = (
        Aiding((track(times, np.zeros((times.size, 2)), 1.0),))
        for times in (np.arange(3.0), np.arange(11.0))
    )
    assert velocity_at_rest(vague, DT, 0, 20) is None
    assert velocity_at_rest(clear, DT, 0, 100) == pytest.approx(np.sqrt(2.0) / 10.0)


def test_a_good_velocity_is_not_better_known_than_a_vehicle_stands_still():
    aiding = Aiding((fixes("velocity", [1.0], np.zeros((1, 3)), 1e-3),))
    assert velocity_at_rest(aiding, DT, 0, 20) == 0.02


def test_standstills_are_the_seconds_as_quiet_as_the_first():
    rng = np.random.default_rng(1)
    n, window = 600, round(tuning.ZERO_VELOCITY[1] / DT)
    noise = 1e-3 * rng.normal(size=(n, 6))
    noise[200:400] *= 10.0  # it drives
    noise[200:400, 3] += 1.0
    noise[450:460, 2] += 0.02  # it turns evenly
    found = standstills(
        Imu(DT, DT * noise[:, :3], DT * noise[:, 3:]),
        Aiding((track([0, 8, 50], np.zeros((3, 2))),)),
        0.03,
    )
    still = [k for k in range(n // window) if not 20 <= k < 40 and k != 45]
    np.testing.assert_allclose(found.time, (np.array(still) + 1) * window * DT)
    assert np.all(found.sd == 0.03) and np.all(found.value == 0.0)
    far = Aiding((track([0, 5, 50], [[0, 0], [500, 0], [500, 0]]),))
    assert standstills(Imu(DT, DT * noise[:, :3], DT * noise[:, 3:]), far, 0.03) is None


def headed(*parts, drift=0.0, epoch=0, n=400, rate=0.0):
    """Heading of a level body that turns evenly, from these fixes."""
    record = imu(np.zeros(n // WINDOW), rate)
    return heading_from_course(record, Aiding(parts), np.zeros(3), np.eye(3), epoch, drift)


def test_the_first_velocity_that_is_twenty_times_its_error_gives_the_course():
    value = np.array([[0.0, 19.0, 0.0], [-3.0, 21.0, 50.0], [30.0, 0.0, 0.0]])
    angle, sd, text = headed(fixes("velocity", [2.0, 5.0, 6.0], value), drift=1e-3)
    assert angle == pytest.approx(np.arctan2(21.0, -3.0))
    expected = np.sqrt(1.0 / (21.0**2 + 9.0) + tuning.CRAB_SD**2 + 5e-3**2)
    assert sd == pytest.approx(expected)
    assert "5 s after the start" in text
    # A course before the start does not count.
    late = headed(fixes("velocity", [2.0, 5.0, 6.0], value), epoch=55)
    assert late.yaw == pytest.approx(0.0)


@pytest.mark.parametrize("rate", [0.1, -0.2])
def test_a_course_is_turned_back_by_the_gyros(rate):
    value = np.array([[50.0, 0.0, 0.0]])
    angle, *_ = headed(fixes("velocity", [8.0], value), rate=rate)
    assert np.angle(np.exp(1j * (angle + 8.0 * rate))) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("way", "begin"),
    [
        ([[0, 0], [0, 29], [0, 58], [0, 87]], 1),  # 28.3 m are twenty times the error
        ([[0, 0], [500, 0], [0, 30], [0, 45], [0, 60], [0, 75]], 3),  # an outlier
    ],
)
def test_two_fixes_far_apart_give_the_course(way, begin):
    found = headed(track(1.0 + np.arange(len(way)), way))
    assert found.yaw == pytest.approx(0.5 * np.pi, abs=1e-3)
    assert f"GNSS, {begin} s after" in found.source


def test_two_fixes_must_be_near_in_time_and_if_others_are_aside_the_first_do():
    assert headed(track([1.0, 6.1], [[0, 0], [0, 900]])) is None
    found = headed(track([1.0, 6.0], [[0, 0], [0, 900]]))
    assert found[0] == pytest.approx(0.5 * np.pi, abs=1e-3)
    length = float(np.hypot(*ned_difference(*track([1.0, 6.0], [[0, 900], [0, 0]]).value)[:2]))
    assert found[1] == pytest.approx(np.hypot(np.sqrt(2.0) / length, tuning.CRAB_SD))


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.3), (0.1, -0.2, -2.0)])
def test_the_earths_rate_points_north(rpy):
    C = matrix_from_rpy(np.array(rpy))
    lat = 0.8
    mean = C.T @ (RATE * np.array([np.cos(lat), 0.0, -np.sin(lat)]))
    level = np.array([rpy[0], rpy[1], 0.0])
    least = tuning.COMPASS_SD * RATE * np.cos(lat)
    angle, sd, _ = gyrocompass(mean, level, lat, 0.99 * least)
    assert angle == pytest.approx(rpy[2])
    assert sd == pytest.approx(0.99 * tuning.COMPASS_SD)
    assert gyrocompass(mean, level, lat, 1.01 * least) is None


@pytest.mark.parametrize(("levelled", "epoch"), [(0, 30), (30, 0), (10, 10)])
def test_an_attitude_is_carried_forwards_and_backwards(levelled, epoch):
    start = matrix_from_rpy(np.array([0.0, 0.0, 0.4]))
    moved = turned(imu(np.zeros(20), 0.3), np.array([0.0, 0.0, 0.1]), start, levelled, epoch)
    expected = 0.4 + 0.2 * DT * (epoch - levelled)
    assert rpy_from_matrix(moved)[2] == pytest.approx(expected)
