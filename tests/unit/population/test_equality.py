"""Equality of curves: its size, its power, and what it does not depend on."""

import numpy as np
import pytest

from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise
from gmwm.estimate import estimate
from gmwm.population.curves import Equality

TRUTH = WhiteNoise(1.0) + RandomWalk(0.3)
N, DT = 6000, 0.01


def fitted(truth, seed, n=N, model=None):
    return estimate(model or truth.opened(), truth.simulate(n, DT, seed), DT)


@pytest.fixture(scope="module")
def equal():
    return [fitted(TRUTH, seed) for seed in range(20)]


def part(test, name):
    return next(each for each in test.differences if each.part == name)


def test_equal_recordings_agree_about_as_often_as_the_level_says(equal):
    p = [Equality.of(equal[i : i + 2]).p_value for i in range(0, 20, 2)]
    assert sum(each < 0.05 for each in p) <= 3  # more has a probability of 0.002
    assert max(p) > 0.3


def test_a_fifth_in_white_noise_is_found_where_it_is(equal):
    for seed, one in zip(range(100, 103), equal, strict=False):
        test = Equality.of([one, fitted(WhiteNoise(1.2) + RandomWalk(0.3), seed)])
        assert test.p_value < 1e-4
        found = part(test, "N")
        assert found in test.evident
        assert 0.1 < found.extent < 0.32
        assert found.sigma > 2.5


def test_two_recordings_differ_by_their_difference_over_its_error(equal):
    found = part(Equality.of(equal[:2]), "N")
    apart = abs(np.diff(np.log(found.ratios))[0])
    assert found.sigma == pytest.approx(apart / np.hypot(*found.errors), rel=1e-6)
    assert found.resolution == pytest.approx(3.24 * np.hypot(*found.errors), rel=1e-2)


def test_the_order_of_recordings_changes_nothing(equal):
    there, back = Equality.of(equal[:4]), Equality.of(equal[:4][::-1])
    assert there.chi_square == pytest.approx(back.chi_square, rel=1e-6)
    assert there.dof == back.dof
    assert [d.part for d in there.differences] == [d.part for d in back.differences]


def test_structures_do_not_matter(equal):
    wide = [estimate(WhiteNoise() + GaussMarkov() + RandomWalk(), fit.wv) for fit in equal[:2]]
    p = [Equality.of(fits).p_value for fits in (equal[:2], wide)]
    assert abs(p[0] - p[1]) < 0.15


def test_recordings_of_other_lengths_and_many_of_them_are_compared(equal):
    short = [fitted(TRUTH, seed, n=1500) for seed in (200, 201)]
    test = Equality.of([*equal[:18], *short])
    assert test.ratios.shape == (20, test.tau.size)
    assert np.isnan(test.ratios[-1, -1])
    assert test.p_value > 0.01


def test_a_drift_of_one_recording_is_taken_from_all(equal):
    model = WhiteNoise() + RandomWalk() + RateRamp()
    drifting = fitted(TRUTH + RateRamp(1.0), 300, model=model)
    assert Equality.of([equal[0], drifting]).p_value > 0.01
    kept = Equality.of([equal[0], estimate(TRUTH.opened(), drifting.wv)])
    assert kept.p_value < 0.01
