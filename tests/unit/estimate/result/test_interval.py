"""Confidence intervals from standard errors that grow with the parameter."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.stats import chi2, norm

from gmwm import GaussMarkov, Model, RandomWalk, Sinusoid, WhiteNoise
from gmwm.estimate.problem.information import error_growth
from gmwm.estimate.result import confidence_interval
from gmwm.estimate.result.estimate import estimates_of
from gmwm.process import Parameter

TAU = Parameter("tau", "s")
SIGMA = Parameter("sigma", "u", role="scale")
SIGMA2 = Parameter("sigma2", "u^2", role="variance")


@given(error=st.floats(1e-4, 0.3), growth=st.floats(-1.0, 1.0), level=st.floats(0.5, 0.999))
def test_ends_are_as_far_as_their_own_standard_errors_allow(error, growth, level):
    """At an end, the estimate is a quantile of the standard error at that end away."""
    low, high = confidence_interval(TAU, 1.0, error, level, growth=growth)
    without = np.log(confidence_interval(TAU, 1.0, error, level)[1])
    assert low < 1.0 < high
    for end, sign in ((low, -1.0), (high, 1.0)):
        if np.isfinite(end) and end > 0.0 and growth * sign * without < np.exp(-1.0):
            assert np.log(end) == pytest.approx(sign * without * end**growth, rel=1e-6)


@given(growth=st.floats(-1.0, 1.0), level=st.floats(0.5, 0.99))
def test_ends_move_outwards_with_the_error(growth, level):
    ends = [
        confidence_interval(TAU, 2.0, 2.0 * error, level, growth=growth)
        for error in np.geomspace(1e-3, 0.99, 60)
    ]
    low, high = np.array(ends).T
    assert np.all(low[1:] <= low[:-1]) and np.all(high[1:] >= high[:-1])
    assert np.all(low >= 0.0)


def test_a_variance_and_its_root_have_the_same_interval():
    low, high = confidence_interval(SIGMA, 3.0, 0.3, 0.95, growth=0.8)
    low2, high2 = confidence_interval(SIGMA2, 9.0, 1.8, 0.95, growth=0.4)
    assert low**2 == pytest.approx(low2)
    assert high**2 == pytest.approx(high2)


@pytest.mark.parametrize("dof", [8, 20, 100])
def test_a_variance_of_few_degrees_of_freedom_is_covered(dof):
    """Normal theory in the logarithm with Student's t stands in for chi-square."""
    covered = np.zeros(2)
    quantiles = chi2.ppf((np.arange(2_000) + 0.5) / 2_000, dof) / dof
    for value in quantiles:
        low, high = confidence_interval(SIGMA2, value, value * np.sqrt(2.0 / dof), 0.95)
        covered += np.array([low > 1.0, high < 1.0])
    assert np.sum(covered) / quantiles.size == pytest.approx(0.05, abs=0.015)


def test_what_is_not_determined_goes_from_zero_to_infinity():
    assert confidence_interval(TAU, 1.0, 1.01, 0.95) == (0.0, np.inf)


def test_a_slope_may_have_either_sign():
    slope = Parameter("R", "u/s", role="slope", lower=-np.inf)
    low, high = confidence_interval(slope, 1.0, 2.0, 0.95)
    assert (low, high) == pytest.approx((1.0 - 2.0 * norm.ppf(0.975), 1.0 + 2.0 * norm.ppf(0.975)))
    wide = confidence_interval(slope, 1.0, 2.0, 0.95, slope_dof=3.0)
    assert wide[0] < low < high < wide[1]


def test_the_error_of_white_noise_does_not_grow():
    assert error_growth(Model((WhiteNoise(N=2.0),)), ["N"], 1000, 0.1) == pytest.approx(
        {"N": 0.0}, abs=1e-9
    )


def test_the_error_of_a_slow_process_grows_with_its_correlation_time():
    """The record holds T / tau independent pieces: the error goes with the root of tau."""
    model = Model((GaussMarkov(sigma=1.0, tau=50.0),))
    growth = error_growth(model, ["sigma", "tau"], 100_000, 1.0)
    assert growth["tau"] == pytest.approx(0.5, abs=0.05)
    assert growth["sigma"] == pytest.approx(1.0, abs=0.1)


def test_a_walk_that_stands_out_more_is_known_better():
    model = WhiteNoise(N=1.0) + RandomWalk(K=0.01)
    growth = error_growth(model, ["N", "K"], 100_000, 1.0)
    assert -0.6 < growth["K"] < -0.2


def test_a_line_has_no_growth():
    model = WhiteNoise(N=1.0) + Sinusoid(amplitude=0.5, frequency=0.1)
    assert error_growth(model, ["N", "sinusoid_amplitude"], 1000, 1.0) == {}


@pytest.mark.parametrize(("sigma", "kind"), [(0.0, "undefined"), (1.0, "fixed")])
def test_a_given_shape_is_fixed_where_its_term_is_there(sigma, kind):
    model = WhiteNoise(1.0) + GaussMarkov(sigma, 10.0)
    rows = {row.key: row for row in estimates_of(model, "", {"N": 0.1}, {"N": (0.9, 1.1)}, {})}
    assert rows["tau"].kind == kind
    assert rows["sigma"].kind == "fixed"  # zero is as given as any other
    assert rows["N"].kind == "estimated"
    stderr, intervals = {"sigma": 0.1, "tau": 2.0}, {"sigma": (0.0, 0.3), "tau": (5.0, 20.0)}
    rows = {row.key: row for row in estimates_of(model, "", stderr, intervals, {"sigma": 0.3})}
    assert [row.kind for row in rows.values()] == ["fixed", "bound", "estimated"]
    assert (rows["N"].lower, rows["N"].upper, rows["N"].stderr) == (1.0, 1.0, None)
