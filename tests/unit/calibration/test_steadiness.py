"""Slow noise that changes its size within a record."""

import numpy as np
import pytest
from scipy import stats

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.calibration import tuning
from gmwm.calibration.departures import Departure
from gmwm.calibration.steadiness import Means, _rest, _Test, steadiness_notice
from marks import every

N, RATE, HOUR = 1e-4, 25.0, 90_000
TIME = np.arange(HOUR) / RATE
WALK = WhiteNoise() + RandomWalk()
MARKOV = WhiteNoise() + GaussMarkov()


def white(seed, n=HOUR):
    return WhiteNoise(N).simulate(n, dt=1.0 / RATE, seed=seed)


def walk(seed, size=6e-6, n=HOUR):
    return RandomWalk(size).simulate(n, dt=1.0 / RATE, seed=[seed, 1])


def markov(seed, tau=20.0, sigma=1.5e-4):
    return GaussMarkov(sigma, tau).simulate(HOUR, dt=1.0 / RATE, seed=[seed, 2])


def begins_halfway(seed):
    late = np.where(TIME > 1800.0, walk(seed), 0.0)
    late[TIME > 1800.0] -= late[TIME > 1800.0][0]
    return white(seed) + late


def found(model, values, **more):
    return steadiness_notice(fitted(model, values), **more)


def fitted(model, values):
    return gmwm.fit(model, gmwm.wavelet_variance(values, dt=1.0 / RATE))


CHANGES = {
    "walk begins": (WALK, begins_halfway, (1800.0, 3600.0)),
    "process grows": (
        MARKOV,
        lambda seed: white(seed) + markov(seed) * np.where(TIME > 2520.0, 3.0, 1.0),
        (2520.0, 3600.0),
    ),
    "process ends": (
        MARKOV,
        lambda seed: white(seed) + markov(seed, 5.0, 6e-4) * np.where(TIME > 540.0, 0.2, 1.0),
        (0.0, 540.0),
    ),
}


@pytest.mark.parametrize(("model", "simulated", "loud"), CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("seed", [1, 3, 4])
def test_noise_that_is_larger_in_a_part_is_not_valid(model, simulated, loud, seed):
    notice = found(model, simulated(seed))
    assert notice is not None
    assert notice.severity == "bad"
    assert notice.values["loud"] > 2.0 * notice.values["quiet"]
    middle = 0.5 * (notice.values["start"] + notice.values["stop"])
    assert loud[0] < middle < loud[1]


STEADY = {
    "walk": (WALK, lambda seed: white(seed) + walk(seed)),
    "fast walk": (WALK, lambda seed: white(seed) + walk(seed, 1e-4)),
    "slow process": (MARKOV, lambda seed: white(seed) + markov(seed, 100.0)),
    # The model lacks a term, and is of the wrong size where that is.
    "two processes": (WALK, lambda seed: white(seed) + markov(seed) + walk(seed)),
}


@pytest.mark.parametrize(("model", "simulated"), every(2, STEADY.values()), ids=STEADY)
def test_stationary_noise_has_no_notice_more_often_than_promised(model, simulated, monkeypatch):
    """At a level of 5 %, of 10 records 2 at most (99 % of a binomial law)."""
    monkeypatch.setattr(tuning, "FALSE_ALARM", 0.05)
    monkeypatch.setattr(tuning, "UNSTEADY", 0.0)
    alarms = sum(found(model, simulated(seed)) is not None for seed in range(10))
    assert alarms <= stats.binom.ppf(0.99, 10, 0.05)


def test_sizes_are_compared_as_bartlett_does():
    samples = np.random.default_rng(1).normal(size=(4, 11)) * [[1.0], [1.5], [0.7], [1.0]]
    sizes = np.var(samples, axis=1, ddof=1)
    test = _Test(sizes, np.full(4, 10.0), 1.0)
    assert test.p_value == pytest.approx(stats.bartlett(*samples).pvalue, rel=1e-9)


def test_white_noise_alone_has_no_slow_noise():
    assert found(WhiteNoise(), white(1)) is None


def test_a_gap_changes_nothing():
    values = begins_halfway(1)
    values[20_000:24_000] = np.nan
    notice = found(WALK, values)
    assert notice is not None
    assert notice.severity == "bad"
    values = white(1) + walk(1)
    values[20_000:60_000] = np.nan
    assert found(WALK, values) is None


def test_a_line_of_the_model_is_no_slow_noise():
    """One that is there in half of the record is: the model has it all the time."""
    line = 3e-4 * np.sin(2.0 * np.pi * TIME / 170.3)
    model = WALK + gmwm.Sinusoid(3e-4, 1.0 / 170.3)
    assert found(model, white(1) + walk(1) + line) is None


def test_a_line_is_subtracted_from_the_block_means_whatever_its_phase():
    line = 3e-3 * np.sin(2.0 * np.pi * TIME / 170.3 + 0.7)
    means = Means.of(gmwm.wavelet_variance(white(1) + line, dt=1.0 / RATE), 512)
    assert np.std(_rest(means, [1.0 / 170.3], ()).blocks) < 0.05 * np.std(means.blocks)


def test_a_step_that_was_found_is_no_slow_noise():
    values = white(2) + walk(2, 2e-6) + 3e-4 * (TIME > 1234.0)
    known = Departure("step", (1234.0, 1230.0, 1238.0), (3e-4, 2.9e-4, 3.1e-4), 1e9, 0.5)
    fit = fitted(WALK, values)
    assert steadiness_notice(fit) is not None
    assert steadiness_notice(fit, known=[known]) is None


def test_a_calibration_says_so_of_the_channel():
    rec = gmwm.Recording.from_arrays({"gyro_x": begins_halfway(3)}, RATE, {"gyro": "rad/s"})
    fit = gmwm.calibrate(rec)["gyro_x"]
    assert not fit.valid
    assert "noise_steady" in fit.reasons
    assert "unsteady" in {notice.code for notice in fit.notices}


def test_the_excess_is_that_over_the_quiet_quarter():
    many = np.full(8, 1e9)
    sizes = np.array([0.25] * 4 + [1.75] * 4)
    assert _Test(sizes, many, 1.0).excess == pytest.approx(1.0, rel=1e-3)
    assert _Test(np.ones(8) + 1e-9 * np.arange(8), many, 1.0).excess == pytest.approx(0.0, abs=1e-6)


def test_only_the_place_of_a_step_is_left_out():
    means = Means.of(gmwm.wavelet_variance(white(1), dt=1.0 / RATE), 512)
    step = Departure("step", (1800.0, 1780.0, 1820.0), (1e-4, 5e-5, 2e-4), 1e6, 0.1)
    gone = np.isnan(_rest(means, (), (step,)).blocks)
    inside = (means.time > 1780.0 - 0.5 * means.step) & (means.time < 1820.0 + 0.5 * means.step)
    np.testing.assert_array_equal(gone, inside)
    assert 0 < np.count_nonzero(gone) < 10
