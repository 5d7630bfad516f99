"""Fixes that come between the samples of the IMU are used at their own time."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from error_models import noisy, triads
from gmwm import GaussMarkov, WhiteNoise
from gmwm.ins import Imu, car_drive, emulate, gnss, navigate
from gmwm.ins.geometry import ned_difference

FINE, EVERY = 0.005, 4
COARSE = FINE * EVERY
INTERVAL = 0.505  # s: 0, 5, 10 and 15 ms after an epoch of the coarse grid in turn
ARM = (0.8, -0.3, -1.1)
SENSORS = triads(
    WhiteNoise(5e-5) + GaussMarkov(1e-4, 50.0), WhiteNoise(1e-3) + GaussMarkov(2e-3, 50.0)
)


@pytest.fixture(scope="module")
def drive():
    """A car in motion, and its error-free IMU on a fine and on a coarse grid."""
    whole = car_drive(duration=110.0, dt=FINE)
    truth = whole.segment(70.0, 110.0)
    fine = emulate(truth)
    return truth, fine, every(fine)


def every(fine):
    """The same increments on the coarse grid."""
    sums = (each.reshape(-1, EVERY, 3).sum(axis=1) for each in (fine.rotation, fine.velocity))
    return Imu(COARSE, *sums)


def test_error_free_fixes_agree_at_any_time(drive):
    truth, _, coarse = drive
    speed = np.linalg.norm(truth.velocity, axis=1)
    turning = np.abs(coarse.rotation[:, 2]) / COARSE
    assert speed.max() > 10.0 and turning.max() > 0.2
    aiding = gnss(truth, INTERVAL, position_sd=1.0, lever_arm=ARM)
    late = replace(aiding, fixes=tuple(each.part(each.time > 0.1) for each in aiding.fixes))
    events = late.events(COARSE, coarse.n)
    assert set(np.round(1e3 * np.abs(events.offset), 6)) == {0.0, 5.0, 10.0}
    found = navigate(coarse, truth.state(0), SENSORS, late, second_order=False).innovations
    assert np.abs(found.value).max() < 2e-4
    np.testing.assert_allclose(found.time, late.fixes[0].time, rtol=0, atol=1e-6)


def test_precise_fixes_off_the_grid_have_innovations_of_the_expected_size(drive):
    """At 15 m/s, 5 ms are 75 mm: a filter that used the nearest epoch had a NIS of about 3."""
    truth, _, coarse = drive
    rng = np.random.default_rng(3)
    imu = noisy(coarse, SENSORS, rng)
    aiding = gnss(truth, INTERVAL, position_sd=0.05).noisy(rng)
    squares = navigate(imu, truth.state(0), SENSORS, aiding).innovations.standard.ravel() ** 2
    low, high = stats.chi2.ppf([1e-4, 1.0 - 1e-4], squares.size) / squares.size
    assert low < squares.mean() < high


def test_the_same_solution_as_with_a_grid_that_has_the_fixes(drive):
    truth, fine, _ = drive
    rng = np.random.default_rng(5)
    imu = noisy(fine, SENSORS, rng)
    aiding = gnss(truth, INTERVAL, position_sd=0.1, velocity_sd=0.05, lever_arm=ARM,
                  imu=fine).noisy(rng)  # fmt: skip
    on_grid = navigate(imu, truth.state(0), SENSORS, aiding)
    off_grid = navigate(every(imu), truth.state(0), SENSORS, aiding)
    ours, theirs = off_grid.innovations, on_grid.innovations
    np.testing.assert_allclose(ours.time, theirs.time, atol=1e-6)
    # With the lever arm, velocities need the rate, which the coarse grid has as a mean.
    assert np.abs((ours.value - theirs.value) / theirs.sd).max() < 0.1
    np.testing.assert_allclose(ours.sd, theirs.sd, rtol=1e-3)
    assert np.abs(ned_difference(off_grid.lla[-1:], on_grid.lla[-1:])).max() < 2e-3
    np.testing.assert_allclose(off_grid.sd[-1], on_grid.sd[-1], rtol=1e-3)


def test_fixes_shortly_before_the_start_and_after_the_end_are_reached(drive):
    truth, _, coarse = drive
    fixes = gnss(truth, 1.0).fixes[0]
    time = fixes.time.copy()
    time[[0, -1]] = -0.4 * COARSE, coarse.n * COARSE + 0.4 * COARSE
    ends = ned_difference(fixes.value, truth.lla[np.rint(time / FINE).astype(int).clip(0, truth.n)])
    assert np.hypot(*ends[0, :2]) > 1.0  # the first value is of another time
    aiding = gnss(truth, 1.0)
    moved = replace(fixes, time=time)
    events = replace(aiding, fixes=(moved,)).events(COARSE, coarse.n)
    assert events.epoch[0] == 0 and events.epoch[-1] == coarse.n
    assert events.offset[0] == pytest.approx(-0.4 * COARSE)
    assert events.offset[-1] == pytest.approx(0.4 * COARSE)
    found = navigate(coarse, truth.state(0), SENSORS, replace(aiding, fixes=(moved,)))
    assert np.all(np.isfinite(found.innovations.value))
