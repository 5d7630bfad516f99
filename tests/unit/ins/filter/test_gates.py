"""Fixes beyond their gates are rejected and reported; barometers that are off; standstills."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

import gmwm
from error_models import noisy, triads
from gmwm import GaussMarkov, WhiteNoise
from gmwm.ins import Outage, barometer, car_drive, emulate, gnss, navigate, tuning
from gmwm.ins.filter import KINDS, filter_kernels

DT = 0.05
SENSORS = triads(
    WhiteNoise(1e-4) + GaussMarkov(1e-4, 50.0), WhiteNoise(2e-3) + GaussMarkov(5e-3, 50.0)
)


@pytest.fixture(scope="module")
def drive():
    truth = car_drive(duration=150.0, dt=DT)
    return truth, noisy(emulate(truth), SENSORS, np.random.default_rng(1))


@pytest.fixture(scope="module")
def fixes(drive):
    """A position a second with noise of 1 m, the seeds of the tests beside it."""
    return gnss(drive[0], position_sd=1.0).noisy(np.random.default_rng(2))


def test_a_gate_opens_after_so_many_in_a_row_and_closes_after_as_many():
    """Of one kind; others keep their own count."""
    rejected, patience = np.array([7, 0]), tuning.GATE_PATIENCE

    def seen(squares, *, gated=True):
        return filter_kernels._is_accepted(squares, 9.0, gated, 1, rejected), int(rejected[1])

    for count in range(1, patience):
        assert seen(9.1) == (False, count)
    assert seen(9.0) == (True, 0)  # not in a row
    for _ in range(patience - 1):
        seen(9.1)
    assert seen(9.1) == (False, 2 * patience)
    assert seen(9.1, gated=False) == (True, 2 * patience)
    for count in range(2 * patience - 1, patience - 1, -1):
        assert seen(8.9, gated=False) == (True, count)
    assert seen(8.9) == (True, 0)
    assert rejected[0] == 7


def outlying(aiding, rows, size):
    """Some positions moved to the east."""
    position = aiding.fixes[0]
    by = np.zeros_like(position.value)
    by[rows, 1] = size
    return replace(aiding, fixes=(replace(position, value=position.moved(by)),))


def test_those_are_rejected_whose_squares_are_beyond_their_quantile(drive, fixes):
    gated = navigate(drive[1], drive[0].state(0), SENSORS, replace(fixes, gate=0.1)).innovations
    squares = np.sum((gated.value / gated.sd) ** 2, axis=1)
    np.testing.assert_array_equal(gated.used, squares <= chi2.ppf(0.9, 3))
    assert 4 < np.count_nonzero(~gated.used) < 30  # of 150


def test_an_outlier_is_rejected_and_leaves_the_solution_as_without_it(drive, fixes):
    truth, imu = drive
    far = outlying(fixes, [60], 500.0)
    gated = navigate(imu, truth.state(0), SENSORS, replace(far, gate=1e-6))
    kept = np.arange(fixes.fixes[0].time.size) != 60
    without = navigate(imu, truth.state(0), SENSORS, replace(fixes, fixes=(
        fixes.fixes[0].part(kept),)))  # fmt: skip
    np.testing.assert_array_equal(gated.innovations.used, kept)
    np.testing.assert_allclose(gated.lla[-1], without.lla[-1], rtol=1e-12)
    np.testing.assert_allclose(gated.covariance[-1], without.covariance[-1], rtol=1e-6)
    # What was rejected is reported with its size.
    assert gated.innovations.value[60, 1] == pytest.approx(-500.0, abs=10.0)
    ungated = navigate(imu, truth.state(0), SENSORS, far)
    assert np.all(ungated.innovations.used)
    assert np.abs(ungated.errors(truth)[61, :2]).max() > 20.0


def test_a_filter_that_is_wrong_does_not_refuse_fixes_for_ever(drive, fixes):
    """It starts 300 m off, sure of 1 m: after some rejections it uses the fixes."""
    truth, imu = drive
    first = truth.state(0)
    wrong = replace(first, lla=first.lla + np.array([300.0 / 6.37e6, 0.0, 0.0]))
    found = navigate(imu, wrong, SENSORS, replace(fixes, gate=1e-6))
    rejected = np.flatnonzero(~found.innovations.used)
    assert rejected[: tuning.GATE_PATIENCE].tolist() == list(range(tuning.GATE_PATIENCE))
    # It is still a little wrong when the gate is closed again, and then some more are rejected.
    assert rejected.size <= 3 * tuning.GATE_PATIENCE
    assert np.abs(found.errors(truth)[-1, :2]).max() < 3.0


def test_a_standstill_that_is_none_is_never_used(drive, fixes):
    """Of a car at 10 m/s: a wrong recognition must not win by insisting."""
    truth, imu = drive
    speed = np.linalg.norm(truth.velocity, axis=1)
    time = DT * np.flatnonzero(speed > 8.0)[::10]
    false = gmwm.ins.Fixes(
        "standstill", time, np.zeros((time.size, 3)), np.full((time.size, 3), 0.02)
    )
    both = gmwm.ins.Aiding((*fixes.fixes, false))
    found = navigate(imu, truth.state(0), SENSORS, both)
    assert time.size > 100
    assert not np.any(found.innovations.used[found.innovations.kind == KINDS["standstill"]])
    alone = navigate(imu, truth.state(0), SENSORS, fixes)
    np.testing.assert_allclose(found.sd[-1], alone.sd[-1], rtol=1e-6)


def test_a_barometer_that_is_off_keeps_the_height_in_an_outage(drive):
    truth, imu = drive
    rng = np.random.default_rng(6)
    heights = replace(barometer(truth, 1.0, 0.5), barometer_sd=8.0, barometer_tau=2000.0)
    aiding = (gnss(truth, position_sd=1.0) + heights).noisy(rng).without([Outage(60.0, 80.0)])
    assert aiding.barometer_sd == 8.0
    found = navigate(imu, truth.state(0), SENSORS, aiding, before=(140.0,))
    assert found.state_names[-1] == "barometer"
    end = int(np.flatnonzero(found.before)[0])
    assert found.sd[end, 2] < 3.0 < 0.2 * found.sd[end, 0]
    assert abs(found.errors(truth)[end, 2]) < 4.0 * found.sd[end, 2]
    # Without a state for it, the same barometer is believed to the decimetre, and wrongly.
    sure = navigate(imu, truth.state(0), SENSORS, replace(aiding, barometer_sd=0.0),
                    before=(140.0,))  # fmt: skip
    assert found.sd[end, 2] > 2.0 * sure.sd[end, 2]


def test_heights_off_by_a_gauss_markov_process_have_innovations_of_the_expected_size(drive):
    truth, imu = drive
    heights = replace(barometer(truth, 0.5, 0.3), barometer_sd=3.0, barometer_tau=30.0)
    aiding = (gnss(truth, position_sd=1.0) + heights).noisy(np.random.default_rng(7))
    nis = navigate(imu, truth.state(0), SENSORS, aiding).innovations
    squares = nis.standard[nis.kind == KINDS["height"], 0] ** 2
    assert squares.mean() == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / squares.size))
