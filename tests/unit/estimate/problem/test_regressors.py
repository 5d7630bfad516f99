"""Regression beside the noise: the ramp is its case X = t, and what it takes is given back."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import gmwm
from gmwm import RandomWalk, RateRamp, WhiteNoise
from gmwm.estimate.problem import Moments, pilot
from gmwm.estimate.result import CurveCoefficients
from gmwm.process import as_model
from gmwm.variance import PooledVariance, Regressors

N, K, DT, SIZE = 1.0, 0.05, 1.0, 2048
NOISE = WhiteNoise(N) + RandomWalk(K)
MODEL = WhiteNoise() + RandomWalk()


def with_columns(x, columns, removed=None):
    wv = gmwm.wavelet_variance(x, DT)
    at = DT * wv.block * (np.arange(wv.blocks.size) + 0.5)
    rows = [column(at) for column in columns]
    removed = np.zeros(len(columns)) if removed is None else removed
    return replace(wv, regressors=Regressors.of(wv, rows, removed))


def in_units_of_the_record(t):
    return t / (SIZE * DT) - 0.5


CUBIC = [lambda t, k=k: in_units_of_the_record(t) ** k for k in (1, 2, 3)]


@pytest.mark.parametrize("seed", [1, 2])
def test_a_ramp_is_the_regressor_time(seed):
    x = (NOISE + RateRamp(0.01)).simulate(SIZE, DT, seed)
    ramp = gmwm.fit(MODEL + RateRamp(), x, DT)
    wv = with_columns(x, [lambda t: t])
    fit = gmwm.fit(MODEL, wv)
    found = CurveCoefficients.of(fit)
    # Means of four samples take the place of samples.
    assert found.values[0] == pytest.approx(ramp.params["R"], abs=0.02 * ramp.stderr["R"])
    low, high = ramp.interval()["R"]
    assert 2.0 * found.errors(np.eye(1), 0.95)[0] == pytest.approx(high - low, rel=0.02)
    for key in "NK":
        assert fit.params[key] == pytest.approx(ramp.params[key], abs=0.05 * ramp.stderr[key])
        assert fit.stderr[key] == pytest.approx(ramp.stderr[key], rel=0.05)
    assert fit.dof == ramp.dof
    assert fit.chi_square == pytest.approx(ramp.chi_square, abs=0.3)


def test_what_a_curve_takes_is_given_back():
    """On average, level by level; the coarsest level loses most of its variance."""
    truth = NOISE.wavelet_variance(with_columns(NOISE.simulate(SIZE, DT, 0), CUBIC).tau, DT)
    runs = 60
    left, back, spread = [], [], []
    for seed in range(runs):
        wv = with_columns(NOISE.simulate(SIZE, DT, [4, seed]), CUBIC)
        moments = Moments.of(wv, as_model(NOISE)).under(as_model(NOISE))
        left.append(moments.detrended)
        back.append(moments.target)
        spread.append(np.diag(moments.covariance(as_model(NOISE))))
    error = np.std(back, axis=0) / np.sqrt(runs)
    assert np.all(np.abs(np.mean(back, axis=0) - truth) < 4.0 * error)
    assert np.mean(left, axis=0)[-1] < 0.3 * truth[-1]
    # Relative error of a variance of some degrees of freedom among 60: 4 of its deviations.
    ratio = np.var(back, axis=0) / np.mean(spread, axis=0)
    assert np.all(np.abs(ratio[:-1] - 1.0) < 4.0 * np.sqrt(2.0 / runs) * 1.5)


def test_terms_share_the_covariance_of_the_coefficients():
    wv = with_columns(NOISE.simulate(SIZE, DT, 1), CUBIC)
    terms = [WhiteNoise(N), RandomWalk(K)]
    moments = Moments.of(wv, as_model(NOISE)).under(as_model(NOISE))
    shares = moments.coefficient_covariances(terms)
    np.testing.assert_allclose(
        np.sum(shares, axis=0), moments.found.covariance, rtol=1e-6, atol=1e-9
    )


def test_a_curve_that_was_removed_before_does_not_matter():
    t = DT * np.arange(SIZE)
    x = NOISE.simulate(SIZE, DT, 3)
    curve = np.array([column(t + 0.5 * DT) for column in CUBIC])
    size = np.array([40.0, -30.0, 20.0])
    whole = CurveCoefficients.of(gmwm.fit(MODEL, with_columns(x + size @ curve, CUBIC, 0 * size)))
    left = CurveCoefficients.of(gmwm.fit(MODEL, with_columns(x, CUBIC, size)))
    deviation = np.sqrt(np.diag(left.covariance))
    assert np.all(np.abs(whole.values - left.values) < 0.1 * deviation)


def test_recordings_have_common_coefficients_and_own_levels():
    columns, found = [CUBIC[0]], []
    for parts in (1, 4):
        each = []
        for seed in range(parts):
            x = NOISE.simulate(SIZE, DT, [5, seed]) + 100.0 * seed
            each.append(with_columns(x, columns))
        wv = each[0] if parts == 1 else PooledVariance.of(each)
        found.append(CurveCoefficients.of(gmwm.fit(MODEL, wv)).covariance[0, 0])
    assert found[1] == pytest.approx(found[0] / 4.0, rel=0.4)


def test_a_walk_that_a_model_may_lack_is_in_the_errors():
    """Of two axes alike one was given +-0.0006 and the other +-0.0014, by the model chosen."""
    wv = with_columns(WhiteNoise(N).simulate(SIZE, DT, 1), CUBIC)
    white, both = gmwm.fit(WhiteNoise(), wv), gmwm.fit(MODEL, wv)
    lacking, open_walk = CurveCoefficients.of(white, may_lack=True), CurveCoefficients.of(both)
    line = np.array([[1.0, 0.0, 0.0]])
    error = lacking.errors(line, 0.95)
    assert error == pytest.approx(open_walk.errors(line, 0.95), rel=0.1)
    assert error > 1.2 * CurveCoefficients.of(white).errors(line, 0.95)
    # The mixture of normal numbers holds its probability.
    deviation = np.sqrt(lacking.covariance[0, 0] + lacking.spread[:, 0])
    held = lacking.weights @ (2.0 * stats.norm.cdf(error[0] / deviation) - 1.0)
    assert held == pytest.approx(0.95, abs=1e-6)


def test_a_regressor_that_does_not_change_has_no_variance():
    wv = with_columns(NOISE.simulate(SIZE, DT, 1), [CUBIC[0], lambda t: 0.0 * t])
    found = CurveCoefficients.of(gmwm.fit(MODEL, wv))
    assert found.covariance[1, 1] == 0.0
    assert found.covariance[0, 0] > 0.0


@pytest.mark.parametrize("missing", [0, 100])
def test_a_pilot_is_near_the_coefficients_under_the_noise(missing):
    x = NOISE.simulate(SIZE, DT, 7)
    x[700 : 700 + missing] = np.nan
    wv = with_columns(x, CUBIC)
    exact = Moments.of(wv, as_model(NOISE)).under(as_model(NOISE)).found
    found, _ = pilot(wv.regressors)
    deviation = np.sqrt(np.diag(exact.covariance))
    assert np.all(np.abs(found.values - exact.values) < 0.5 * deviation)


def test_a_ramp_beside_a_curve_is_refused():
    wv = with_columns(NOISE.simulate(SIZE, DT, 1), CUBIC)
    with pytest.raises(gmwm.InputError, match="add time as a covariate"):
        gmwm.fit(MODEL + RateRamp(), wv)
