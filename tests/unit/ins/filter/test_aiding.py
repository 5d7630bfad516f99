"""Fixes and outages: built from a trajectory, with noise, put in order, refused in a sentence."""

import numpy as np
import pytest

from gmwm._core.distributions import chi2
from gmwm.errors import InputError
from gmwm.ins import Aiding, Fixes, Outage, barometer, car_drive, emulate, gnss, standstills, tuning
from gmwm.ins.filter import KINDS
from gmwm.ins.geometry import matrix_from_rpy, ned_difference


@pytest.fixture(scope="module")
def car():
    return car_drive(duration=60.0, dt=0.05)


def fixes(time, kind="position", value=None, sd=1.0):
    count = len(time)
    value = np.zeros((count, 3)) if value is None else value
    return Fixes(kind, np.asarray(time, dtype=float), value, np.full((count, 3), sd))


def test_fixes_lie_on_the_trajectory(car):
    aiding = gnss(car, 0.5, velocity_sd=0.1)
    position, velocity = aiding.fixes
    np.testing.assert_allclose(position.time, 0.5 * np.arange(1, 121))
    np.testing.assert_array_equal(position.value, car.lla[10::10])
    np.testing.assert_array_equal(velocity.value, car.velocity[10::10])
    assert np.all(position.sd == [1.0, 1.0, 1.5]) and np.all(velocity.sd == 0.1)


def test_an_antenna_is_off_the_imu():
    truth = car_drive(duration=100.0, dt=0.02)
    arm = np.array([3.0, -1.0, -2.0])
    aiding = gnss(truth, 0.1, velocity_sd=0.1, lever_arm=arm, imu=emulate(truth))
    position, velocity = aiding.fixes
    at = np.rint(position.time / truth.dt).astype(int)
    away = np.einsum("kij,j->ki", matrix_from_rpy(truth.rpy[at]), arm)
    # Heights differ by metres: the Earth's curvature makes 1e-6 of them.
    np.testing.assert_allclose(ned_difference(position.value, truth.lla[at]), away, atol=1e-5)
    # The velocity is the derivative of the antenna's position but for the Earth's turn, and for
    # half a sample, in which rates change by some mrad/s.
    moved = ned_difference(position.value[2:], position.value[:-2]) / 0.2
    np.testing.assert_allclose(velocity.value[1:-1], moved, atol=0.03)
    assert np.abs(velocity.value - truth.velocity[at]).max() > 0.2


def test_noise_has_the_deviations_that_are_given(car):
    rng = np.random.default_rng(1)
    aiding = gnss(car, 0.05, position_sd=(1.0, 2.0, 3.0), velocity_sd=0.2) + barometer(
        car, 0.05, 4.0
    )
    drawn = aiding.noisy(rng)
    assert [each.kind for each in drawn.fixes] == ["position", "velocity", "height"]
    position = ned_difference(drawn.fixes[0].value, aiding.fixes[0].value)
    velocity = drawn.fixes[1].value - aiding.fixes[1].value
    height = drawn.fixes[2].value - aiding.fixes[2].value
    # 1200 draws: a standard deviation scatters by 2 %.
    np.testing.assert_allclose(position.std(axis=0), [1.0, 2.0, 3.0], rtol=0.1)
    np.testing.assert_allclose(velocity.std(axis=0), 0.2, rtol=0.1)
    assert height[:, 0].std() == pytest.approx(4.0, rel=0.1)
    assert not np.any(height[:, 1:])


def test_coloured_noise_is_a_gauss_markov_process(car):
    rng = np.random.default_rng(2)
    tau, lag = 4.0, 40
    aiding = gnss(car, 0.05, position_sd=1e-9, coloured_sd=(2.0, 0.0, 5.0), coloured_tau=tau)
    product, square = np.zeros(3), np.zeros(3)
    for _ in range(60):
        noise = ned_difference(aiding.noisy(rng).fixes[0].value, aiding.fixes[0].value)
        product += np.mean(noise[lag:] * noise[:-lag], axis=0) / 60
        square += np.mean(noise**2, axis=0) / 60
    # 60 runs of 60 s with 4 s: some 60 * 60 / 8 independent values.
    scatter = 5.0 * np.sqrt(2.0 / 450.0)
    np.testing.assert_allclose(square[[0, 2]], [4.0, 25.0], rtol=scatter)
    np.testing.assert_allclose(product[[0, 2]], np.exp(-2.0 / tau) * square[[0, 2]], rtol=scatter)
    assert square[1] < 1e-12


@pytest.mark.parametrize(("interval", "start", "duration"), [(1.0, 10.0, 5.0), (0.1, 0.3, 0.6)])
def test_an_outage_keeps_the_fixes_at_both_ends(interval, start, duration):
    truth = car_drive(duration=30.0, dt=0.1)
    whole = gnss(truth, interval, velocity_sd=0.1) + barometer(truth, interval)
    kept = whole.without([Outage(start, duration)])
    lost = round(duration / interval) - 1
    for before, after in zip(whole.fixes[:2], kept.fixes[:2], strict=True):
        assert before.time.size - after.time.size == lost
        assert np.any(np.isclose(after.time, start)) and np.any(
            np.isclose(after.time, start + duration)
        )
    assert kept.fixes[2].time.size == whole.fixes[2].time.size


def test_standstills_are_where_the_car_stands(car):
    found = standstills(car, 0.5, 0.02).fixes[0]
    speed = np.linalg.norm(car.velocity[np.rint(found.time / car.dt).astype(int)], axis=1)
    assert found.time[0] == 0.5 and np.all(speed < 1e-3)
    assert found.time.size >= 30
    shaken = Aiding((found,)).noisy(np.random.default_rng(1)).fixes[0]
    assert shaken.value.std() == pytest.approx(0.02, rel=0.5)


def test_events_come_in_order_of_time():
    n, dt = 1000, 0.01
    aiding = Aiding(
        (
            fixes([0.0, 5.004, 10.0], "velocity"),
            fixes([], "height"),
            fixes([0.0, 0.0, 5.0, 10.0049]),
        )
    )
    events = aiding.events(dt, n)
    assert events.epoch.tolist() == [0, 0, 0, 500, 500, 1000, 1000]
    p, v = KINDS["position"], KINDS["velocity"]
    assert events.kind.tolist() == [p, p, v, p, v, v, p]
    np.testing.assert_allclose(events.offset, [0, 0, 0, 0, 0.004, 0, 0.0049], atol=1e-12)
    assert Aiding().events(dt, n).value.shape == (0, 3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fixes([2.0, 1.0]), "number 1 at 1 s is earlier than the one before it: sort them"),
        (lambda: fixes([1.0], sd=-1.0), "a standard deviation is negative"),
        (lambda: fixes([np.nan]), "number 0 is not finite"),
        (lambda: fixes([1.0], value=np.array([[np.inf, 0.0, 0.0]])), "number 0 is not finite"),
        (lambda: fixes([1.0], value=np.zeros((1, 2))), "give E times and E x 3 values"),
        (
            lambda: fixes([1.0], kind="speedometer"),
            "choose from position, velocity, height, standstill",
        ),
        (lambda: Outage(-1.0, 5.0), "outage start -1.0"),
        (lambda: Outage(np.nan, 5.0), "outage start nan"),
        (lambda: Outage("10", 5.0), "outage start '10'"),
        (lambda: Outage(1.0, 0.0), "outage duration = 0.0"),
        (lambda: Aiding(lever_arm=(1.0, 2.0)), "lever_arm = .*give three finite numbers"),
        (lambda: Aiding(coloured_sd=(1.0, -2.0, 0.0)), "coloured_sd: give 0 or more"),
        (lambda: Aiding(coloured_tau=0.0), "coloured_tau = 0.0"),
        (
            lambda: Aiding((fixes([11.0]),)).events(0.01, 1000),
            "position fix at 11 s: the IMU record",
        ),
        (lambda: Aiding((fixes([-1.0]),)).events(0.01, 1000), "position fix at -1 s"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_sentence(make, words):
    with pytest.raises(InputError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"interval": 0.07}, "interval = 0.07 s: give a multiple"),
        ({"interval": 0.0}, "interval = 0.0"),
        ({"position_sd": 0.0}, "give positive numbers"),
        ({"position_sd": (1.0, 2.0)}, "standard deviation"),
        ({"velocity_sd": -0.1}, "give positive numbers"),
        ({"velocity_sd": 0.1, "lever_arm": (1.0, 0.0, 0.0)}, "need rates: give imu"),
    ],
)
def test_wrong_options_of_gnss(car, options, words):
    with pytest.raises(InputError, match=words):
        gnss(car, **options)


def test_the_least_and_the_most_that_can_be_used():
    assert Outage(0.0, 1.0).end == 1.0
    same = fixes([1.0, 1.0], sd=0.0)
    assert same.time.tolist() == [1.0, 1.0]
    Aiding(coloured_sd=(0.0, 0.0, 1.0), barometer_sd=0.0, gate=0.999)
    for gate in (0.0, 1.0, -0.1, "no"):
        with pytest.raises(InputError, match="gate = "):
            Aiding(gate=gate)
    for wrong in (-1.0, np.inf, None):
        with pytest.raises(InputError, match="barometer_sd = "):
            Aiding(barometer_sd=wrong)
    events = Aiding((fixes([-0.004, 0.0, 9.996, 10.004]),)).events(0.01, 1000)
    assert events.epoch.tolist() == [0, 0, 1000, 1000]
    np.testing.assert_allclose(events.offset, [-0.004, 0.0, -0.004, 0.004], atol=1e-12)
    for late in (-0.006, 10.006):
        with pytest.raises(InputError, match="the IMU record goes from 0 to 10 s"):
            Aiding((fixes([late]),)).events(0.01, 1000)


def test_a_gate_has_the_degrees_of_freedom_of_its_fix():
    flat = fixes([1.0])
    flat.sd[0, 2] = 0.0
    height = fixes([2.0], "height", sd=0.0)
    height.sd[0, 0] = 1.0
    still = fixes([3.0], "standstill")
    given = (flat, fixes([1.5]), height, still)
    found = Aiding(given, gate=0.01).events(1.0, 10).gate
    np.testing.assert_allclose(found, chi2.isf(0.01, np.array([2, 3, 1, 3])))
    found = Aiding(given).events(1.0, 10).gate
    np.testing.assert_allclose(found[[0, 1, 2]], np.inf)
    assert found[3] == pytest.approx(float(chi2.isf(tuning.GATE, 3)))
