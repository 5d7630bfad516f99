"""One model for several recordings."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise
from gmwm.estimate.result import fit_joint
from gmwm.estimate.result.joint import between
from gmwm.variance import PooledVariance

TRUTH = WhiteNoise(1.0) + GaussMarkov(0.7, 30.0)


def recordings(lengths, seed, truth=TRUTH):
    rng = np.random.default_rng(seed)
    return [gmwm.wavelet_variance(truth.simulate(n, 1.0, rng), dt=1.0) for n in lengths]


def test_one_recording_is_no_different():
    (wv,) = recordings([5000], 1)
    alone, joint = gmwm.fit(TRUTH.opened(), wv), gmwm.fit(TRUTH.opened(), [wv])
    assert joint.params == pytest.approx(alone.params, rel=1e-6)
    assert joint.stderr == pytest.approx(alone.stderr, rel=1e-6)
    assert np.isnan(joint.equality_p)
    assert joint.valid


def test_errors_fall_as_in_one_long_recording():
    parts = recordings([4000] * 9, 2)
    joint = gmwm.fit(TRUTH.opened(), parts)
    assert joint.valid, joint.message
    each = np.mean([list(part.stderr.values()) for part in joint.parts], axis=0)
    np.testing.assert_allclose(list(joint.stderr.values()), each / 3.0, rtol=0.15)


def test_standard_errors_and_the_test_of_equality_are_right():
    """Standardised errors and p-values of 8 joint fits of unequal recordings."""
    errors, p_values = [], []
    for seed in range(8):
        joint = gmwm.fit(TRUTH.opened(), recordings([2000, 5000, 3000], seed))
        errors.append([(joint.params[k] - v) / joint.stderr[k] for k, v in TRUTH.params.items()])
        p_values.append(joint.equality_p)
    # The mean of 8 squares of normal variables is within 0.03 .. 4.0 in all but 2e-4 of cases.
    squares = np.mean(np.square(errors), axis=0)
    assert np.all(squares > 0.03) and np.all(squares < 4.0), squares
    assert kstest(p_values, "uniform").pvalue > 0.001


def test_the_curves_of_like_recordings_are_those_of_the_joint_model():
    p_values = [
        gmwm.fit(TRUTH.opened(), recordings([2000, 5000, 3000], seed)).curves_p
        for seed in range(50, 54)
    ]
    assert kstest(p_values, "uniform").pvalue > 0.001


def test_where_parameters_cannot_be_compared_the_curves_are():
    """A walk that no recording determines, and white noise of other size in one."""
    model = WhiteNoise() + RandomWalk()
    parts = recordings([4000] * 2, 7, WhiteNoise(1.0))
    parts += recordings([4000], 8, WhiteNoise(1.3))
    joint = gmwm.fit(model, parts)
    assert joint.curves_p < 1e-6
    assert not joint.valid
    if np.isnan(joint.equality_p):
        assert "not those of the joint model" in joint.message
        assert "as the joint model has it: p = " in joint.agreement


def test_recordings_that_differ_are_said_to():
    parts = recordings([20_000] * 2, 4) + recordings([20_000], 5, WhiteNoise(1.2) + TRUTH.terms[1])
    joint = gmwm.fit(TRUTH.opened(), parts)
    assert joint.equality_p < 1e-6
    assert not joint.valid
    assert "have different parameters" in joint.message
    assert joint.spread["N"] == pytest.approx(np.std(np.log([1.0, 1.0, 1.2]), ddof=1), rel=0.2)
    assert "3 recordings" in str(joint)
    assert max(map(len, str(joint).splitlines()[:8])) <= 80


def test_the_pooled_covariance_is_that_of_the_pooled_mean():
    parts = recordings([3000, 12_000], 6)
    pooled = PooledVariance.of(parts)
    draws = []
    for seed in range(150):
        values = [part.variance for part in recordings([3000, 12_000], 1000 + seed)]
        total = np.zeros(pooled.tau.size)
        for value, share in zip(values, pooled.shares, strict=True):
            total[: value.size] += share[: value.size] * value
        draws.append(total)
    expected = np.diag(pooled.covariance_under(TRUTH.psd))
    # A sample variance of 150 has a relative deviation of 0.12; coarse levels are far from normal.
    np.testing.assert_allclose(np.var(draws, axis=0)[:-3], expected[:-3], rtol=0.35)


def test_what_does_not_belong_together_is_refused():
    one = gmwm.wavelet_variance(TRUTH.simulate(1000, 1.0, 1), dt=1.0)
    other = gmwm.wavelet_variance(TRUTH.simulate(1000, 0.5, 1), dt=0.5)
    with pytest.raises(gmwm.InputError, match="need the same dt, not"):
        gmwm.fit(TRUTH.opened(), [one, other])
    with pytest.raises(gmwm.InputError, match="one recording at a time"):
        gmwm.fit(TRUTH.opened(), [one, one], method="allan")
    with pytest.raises(gmwm.InputError, match="belongs to one recording"):
        gmwm.fit(WhiteNoise() + RateRamp(), [one, one])
    with pytest.raises(gmwm.InputError, match="no recording"):
        PooledVariance.of([])


def test_a_recording_may_determine_more_than_all_of_them_together():
    """A walk is not significant in all recordings together: the other parameters are compared."""
    model, parts = (
        WhiteNoise() + RandomWalk(),
        recordings([3000, 3000], 5, WhiteNoise(1.0) + RandomWalk(0.05)),
    )
    whole = gmwm.fit(model, PooledVariance.of(parts))
    bounded = replace(whole, upper_bounds={"K": 0.1})
    joint = fit_joint(model, parts, gmwm.fit, bounded)
    assert all("K" not in part.upper_bounds for part in joint.parts)
    assert 0.0 < joint.equality_p <= 1.0
    assert joint.spread.keys() == {"N"}


@pytest.mark.parametrize("small", [1e-3, 1e-6, 1e-9, 1e-12, 1e-40])
@pytest.mark.parametrize("others", [[2.0], [2.0, 5.0], [2.0, 5.0, 3.0]])
def test_where_one_recording_has_all_the_weight_the_spread_is_unknown(small, others):
    values = np.array([1.0, *others])
    errors = np.array([small, *np.full(len(others), 0.5)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spread, p_value = between(values, errors**2)
    if small < 1e-4:
        assert np.isnan(spread)
        assert np.isnan(p_value)
    else:
        assert 0.5 < spread < 5.0
        assert p_value < 0.1


@pytest.mark.parametrize("copies", [1, 2, 5])
def test_the_curves_of_copies_have_as_many_times_the_chi_square_and_the_levels(copies):
    (wv,) = recordings([3000], 10)
    alone = gmwm.fit(TRUTH.opened(), wv)
    joint = fit_joint(TRUTH.opened(), [wv] * copies, gmwm.fit)
    dof = copies * wv.tau.size - len(alone.keys)
    assert joint.curves_p == pytest.approx(chi2.sf(copies * alone.chi_square, dof), rel=1e-6)
