"""Weights of IMUs that are read together."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, InputError, MissingNameError, Recording, WhiteNoise

N, DT = 16_384, 0.1


def imu(gyro, dt=DT, **more):
    return Recording.from_arrays({"gyro_x": gyro, **more}, 1.0 / dt, {"gyro": "rad/s"})


def white(rng, *sizes, n=N, dt=DT):
    return [WhiteNoise(size).simulate(n, dt, rng) for size in sizes]


def test_independent_white_noise_is_weighed_by_its_inverse_variance():
    found = gmwm.array([imu(x) for x in white(np.random.default_rng(1), 1e-4, 2e-4, 4e-4)])
    axis, expected = found["gyro_x"], np.array([16.0, 4.0, 1.0]) / 21.0
    assert np.sum(axis.weights) == pytest.approx(1.0)
    assert np.all((axis.lower < expected) & (expected < axis.upper))
    assert axis.best == pytest.approx(1e-4 * np.sqrt(60.0 * 16.0 / 21.0), rel=0.1)
    assert axis.mean == pytest.approx(1e-4 * np.sqrt(60.0 * 21.0 / 9.0), rel=0.1)
    np.testing.assert_allclose(axis.alone, np.array([1, 2, 4]) * 1e-4 * np.sqrt(60.0), rtol=0.2)


def test_shared_slow_errors_turn_the_weights_where_they_dominate():
    """Least noise with most of the shared error is best after 1 s, and worst after 60 s."""
    rng = np.random.default_rng(2)
    shared = GaussMarkov(1.0, 200.0).simulate(N, DT, rng)
    own = white(rng, 0.5e-4, 1e-4, 1e-4)
    gains = (4e-4, 1e-5, 1e-5)
    imus = {f"imu{k}": imu(x + gain * shared) for k, (x, gain) in
            enumerate(zip(own, gains, strict=True))}  # fmt: skip
    short, long = (gmwm.array(imus, horizon=horizon)["gyro_x"] for horizon in (1.0, 60.0))
    assert short.weights[0] > 0.5 and long.weights[0] < 0.1
    assert long.inverse > 1.5 * long.mean > 1.5 * long.best
    assert short.best <= short.inverse <= short.mean


@pytest.mark.filterwarnings("error::gmwm.errors.FitWarning")
def test_equal_sensors_are_left_to_the_mean():
    found = gmwm.array([imu(x) for x in white(np.random.default_rng(3), *[1e-4] * 3)])
    assert [notice.code for notice in found.notices] == ["array-mean"]
    different = gmwm.array([imu(x) for x in white(np.random.default_rng(4), 1e-4, 5e-4)])
    assert different.notices == ()


def test_rates_may_differ():
    rng = np.random.default_rng(5)
    (fast,), (slow,) = white(rng, 1e-4, n=2 * N, dt=0.5 * DT), white(rng, 2e-4)
    axis = gmwm.array({"fast": imu(fast, 0.5 * DT), "slow": imu(slow)})["gyro_x"]
    assert axis.lower[0] < 0.8 < axis.upper[0]
    assert axis.upper[0] - axis.lower[0] < 0.3


def test_the_unit_of_a_gyro_changes_no_weight():
    own = white(np.random.default_rng(6), 1e-4, 2e-4)
    one, other = (gmwm.array([imu(x * k) for x in own])["gyro_x"] for k in (1.0, 1e-3))
    np.testing.assert_allclose(one.weights, other.weights, rtol=1e-4)
    assert other.best == pytest.approx(1e-3 * one.best, rel=1e-3)


def test_the_text_and_the_file_have_what_was_found(tmp_path):
    found = gmwm.array([imu(x) for x in white(np.random.default_rng(7), 1e-4, 2e-4)])
    text = str(found)
    assert "Weights for outages of 60 s, from 1638.4 s of 2 IMUs" in text
    assert len(text.splitlines()) < 20 and max(map(len, text.splitlines())) <= 80
    found.save(tmp_path / "array.json")
    loaded = gmwm.load(tmp_path / "array.json")
    np.testing.assert_allclose(loaded["gyro_x"].weights, found["gyro_x"].weights)
    with pytest.raises(MissingNameError, match="no channel 'accel_x': it has gyro_x"):
        found["accel_x"]


def test_what_is_no_array_is_rejected():
    one, other = (imu(x) for x in white(np.random.default_rng(8), 1e-4, 2e-4))
    rotating = imu(other["gyro_x"].values + np.where(np.arange(N) // 300 % 2, 0.5, 0.0))
    accel = Recording.from_arrays({"accel_x": one["gyro_x"].values}, 10.0, {"accel": "m/s^2"})
    for given, message in (
        ([one], "two IMUs or more"),
        ([one, one], "have the same samples"),
        ([one, accel], "no gyro or accelerometer axis in common"),
        ([one, rotating], "not static"),
        ([one, one["gyro_x"].values], "not a recording"),
        ([one, other.part(0.0, 500.0)], "outages of 60 s need 960 s"),
    ):
        with pytest.raises(InputError, match=message):
            gmwm.array(given)


def test_one_shock_changes_no_weight():
    own = white(np.random.default_rng(9), 1e-4, 1e-4)
    own[0][5000] += 1.0
    axis = gmwm.array([imu(x) for x in own])["gyro_x"]
    assert axis.lower[0] < 0.5 < axis.upper[0]


def test_a_step_of_the_bias_is_named():
    own = white(np.random.default_rng(10), 1e-4, 1e-4)
    own[1][N // 2 :] += 1e-3
    found = gmwm.array({"one": imu(own[0]), "two": imu(own[1])})
    assert ("step", "two, gyro_x") in [(each.code, each.where) for each in found.notices]


@pytest.mark.parametrize("value", [0.0, 1e-3])
def test_a_stuck_imu_is_rejected(value):
    own = white(np.random.default_rng(11), 1e-4, 1e-4)
    own[0][N // 2 :] = value
    with pytest.raises(InputError, match=r"one, gyro_x: stuck at .*: leave out this IMU"):
        gmwm.array({"one": imu(own[0]), "two": imu(own[1])})
    with pytest.raises(InputError, match="the channel is dead: leave out this IMU"):
        gmwm.array({"one": imu(np.full(N, value)), "two": imu(own[1])})


def test_recordings_are_cut_to_what_their_stamps_have_in_common():
    rng = np.random.default_rng(12)
    common = GaussMarkov(3e-5, 60.0).simulate(N, DT, rng)
    one, other = (imu(x + common) for x in white(rng, 1e-5, 1e-5))
    late = other.part(100.0)
    assert late.start == 100.0
    found, apart = gmwm.array([one, late]), gmwm.array([one, replace(late, start=0.0)])
    assert found.duration == pytest.approx(N * DT - 100.0)
    assert found["gyro_x"].correlation[0, 1] > 0.8 > apart["gyro_x"].correlation[0, 1]
    with pytest.raises(InputError, match="do not overlap in time"):
        gmwm.array([one, replace(late, start=1e6)])


def test_errors_of_a_few_blocks_are_weighed_by_their_slow_part():
    """Correlated over 3 s, where means of 1.9 s are compared: equal to white noise after 60 s."""
    rng, weights = np.random.default_rng(13), []
    fast = WhiteNoise(0.5e-4) + GaussMarkov(np.sqrt(0.75e-8 / 6.0), 3.0)
    for _ in range(4):
        (plain,) = white(rng, 1e-4, n=2 * N)
        axis = gmwm.array([imu(plain), imu(fast.simulate(2 * N, DT, rng))])["gyro_x"]
        weights.append(axis.weights[0])
    error = 0.5 * (axis.upper[0] - axis.lower[0]) / 1.96
    assert np.mean(weights) == pytest.approx(0.5, abs=3.0 * error / 2.0)


def test_a_short_record_promises_no_more_than_its_weights_keep():
    """Five equal IMUs over 16 horizons: no sum is better than the mean, and none is promised."""
    rng = np.random.default_rng(14)
    gains = []
    for _ in range(2):
        own = white(rng, *[1e-4] * 5, n=9_700)
        axis = gmwm.array([imu(x) for x in own])["gyro_x"]
        gains.append(axis.best / axis.mean)
    assert np.mean(gains) > 0.98


def test_a_horizon_of_few_samples_is_rejected():
    one, other = (imu(x) for x in white(np.random.default_rng(15), 1e-4, 2e-4))
    with pytest.raises(InputError, match=r"these rates need outages of 0.8 s or more"):
        gmwm.array([one, other], horizon=0.5)
