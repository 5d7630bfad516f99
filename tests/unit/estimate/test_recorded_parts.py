"""What fits are made of, as recorded: bounds, slopes, first weights, searches, likelihoods."""

import numpy as np
import pytest

import gmwm
from gmwm import BiasInstability, GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, WhiteNoise
from gmwm.estimate.likelihood.scoring import deviations, gradient, maximise, regular_inverse
from gmwm.estimate.likelihood.whittle import _edges
from gmwm.estimate.moments import Design, Profile, dictionary_fit, search
from gmwm.estimate.moments.checks import level_notices, limit_notices
from gmwm.estimate.moments.conclusion import _unrestricted
from gmwm.estimate.moments.discrepancy import suffices
from gmwm.estimate.problem import (
    Coordinates,
    FittedMoments,
    Scales,
    gls_slope,
    ols_slope,
    slope_p_value,
    spectral_information,
    weight_root,
)
from gmwm.estimate.problem.information import error_growth, slope_dof
from gmwm.estimate.result.bound import quantile_above_zero, upper_amplitude
from recorded import assert_as_recorded

DT = 0.1
NOISE = WhiteNoise(0.3) + GaussMarkov(0.5, 8.0)


def variance(truth, n=6000, missing=0.0, seed=1):
    rng = np.random.default_rng(seed)
    x = truth.simulate(n, DT, rng)
    x[rng.random(n) < missing] = np.nan
    return gmwm.wavelet_variance(x, DT)


def test_slopes_and_whether_they_are_any():
    found = {}
    for name, missing in (("complete", 0.0), ("gaps", 0.02)):
        wv = variance(NOISE + RateRamp(2e-3), missing=missing)
        for noise in (WhiteNoise(0.3), NOISE, WhiteNoise(0.3) + RandomWalk(0.05)):
            p = slope_p_value(wv, noise.psd)
            found[f"{name} {noise!r}"] = [gls_slope(wv, noise.psd), p]
        found[name] = ols_slope(wv)
    model = WhiteNoise(0.3) + GaussMarkov(0.5, 8.0)
    found["dof"] = slope_dof(model, ["sigma", "tau"], np.diag([0.01, 1.0]), 6000, DT)
    found["growth"] = error_growth(model, ["N", "sigma", "tau"], 6000, DT)
    assert_as_recorded("estimate/slopes", found, rtol=1e-5)


def test_upper_bounds():
    wv = variance(NOISE)
    walk = (WhiteNoise(0.3), GaussMarkov(0.5, 8.0), RandomWalk(0.02))
    coordinates = Coordinates(WhiteNoise() + GaussMarkov() + RandomWalk())
    found = [
        upper_amplitude(coordinates, walk, 2, centre, deviation, at, wv)
        for centre, deviation, at in (
            (0.0, 1e-3, 0.0), (-1e-3, 1e-3, 0.0), (2e-3, 1e-3, 2e-3), (1e-4, 1e-2, 1e-4),
        )
    ]  # fmt: skip
    found += [upper_amplitude(coordinates, walk, 0, 0.0, 1e-2, 0.0, wv)]
    # Half a normal distribution has its 95 % quantile where the whole one has 97.5 %.
    assert quantile_above_zero(0.0, 2.0) == pytest.approx(2.0 * 1.959963985)
    assert_as_recorded("estimate/upper_bounds", found, rtol=1e-5)


def test_first_weights_and_starts():
    wv = variance(QuantizationNoise(0.05) + NOISE + RandomWalk(0.02))
    reference = dictionary_fit(wv, wv.variance)
    found = {"covariance": reference.covariance, "weights": reference.weights(wv.variance, 0.05),
             "discrepancy": reference.discrepancy}  # fmt: skip
    root = weight_root(reference.covariance)
    for model in (
        WhiteNoise() + 2 * GaussMarkov(), QuantizationNoise() + WhiteNoise() + GaussMarkov(),
        BiasInstability() + WhiteNoise() + GaussMarkov(tau=3.0) + RandomWalk(),
    ):  # fmt: skip
        best = search(Profile(Design(model, Scales.of(wv)), wv.variance, root))
        found[repr(model)] = [list(best.shapes), best.x, best.objective]
    assert_as_recorded("estimate/starts", found, rtol=1e-4)


def test_information_of_a_spectrum():
    found = {}
    for truth in (NOISE, NOISE + RandomWalk(0.02), WhiteNoise(0.1) + BiasInstability(0.2)):
        coordinates = Coordinates(truth.opened())
        information = spectral_information(coordinates, truth.terms, 3000, DT)
        found[repr(truth)] = [information, deviations(information), regular_inverse(information)]
    assert_as_recorded("estimate/information", found)


def test_a_maximum_of_a_curved_ridge():
    """Rosenbrock's, upside down: the steps are short, and turn."""

    def objective(z):
        return -float((1.0 - z[0]) ** 2 + 20.0 * (z[1] - z[0] ** 2) ** 2)

    found = maximise(objective, np.array([-1.0, 1.2]), np.diag([10.0, 30.0]))
    np.testing.assert_allclose(found.z, 1.0, atol=5e-3)
    slope = gradient(objective, np.array([0.5, 0.3]), np.full(2, 1e-3))
    np.testing.assert_allclose(slope, [1.0 + 40.0 * 0.05, -40.0 * 0.05], rtol=1e-3)
    short = maximise(objective, np.array([-1.0, 1.2]), np.diag([10.0, 30.0]), max_steps=4)
    assert not short.converged
    assert_as_recorded("estimate/ridge", [found, short.z], rtol=1e-4)


def test_edges_of_bands():
    assert_as_recorded("estimate/edges", [_edges(count) for count in (1, 5, 8, 9, 16, 100, 4097)])


def test_what_an_estimation_is_judged_by():
    wv = variance(NOISE)
    at = FittedMoments.of(NOISE, wv, ("N", "sigma", "tau"), 0.0, 0.02)
    assert_as_recorded("estimate/fitted_moments", at)


def test_more_parameters_than_levels():
    assert level_notices(4, 4) == []
    (notice,) = level_notices(3, 4)
    assert (notice.code, notice.severity) == ("too-few-levels", "bad")
    assert notice.text.startswith("3 levels cannot determine 4 parameters")


def test_shapes_at_the_limit_of_the_search():
    design = Design(WhiteNoise() + GaussMarkov(), Scales.of(variance(NOISE)))
    (low,), (high,) = design.bounds
    for z, found in (
        (low + 0.049, 1), (low + 0.051, 0), (high - 0.049, 1), (high - 0.051, 0),
        (0.5 * (low + high), 0),
    ):  # fmt: skip
        shapes = design.unpack(np.array([z]), [(), (1.0,)])
        assert len(limit_notices(design, shapes, np.array([1.0, 1.0]))) == found
        assert limit_notices(design, shapes, np.array([1.0, 0.0])) == []


def test_an_amplitude_that_is_zero_were_it_free():
    """Regression: on one column, and on what another one leaves of it."""
    rng = np.random.default_rng(2)
    curve, other, residual = rng.normal(size=(3, 8))
    root = rng.normal(size=(8, 8))
    covariance = root @ root.T + np.eye(8)
    inverse = np.linalg.inv(covariance)
    alone = _unrestricted(np.zeros((8, 0)), curve, residual, covariance)
    information = curve @ inverse @ curve
    assert alone == pytest.approx((curve @ inverse @ residual / information, information**-0.5))
    columns = np.column_stack([curve, other])
    normal = np.linalg.inv(columns.T @ inverse @ columns)
    # What is left of the residual is orthogonal to the other column already.
    left = residual - other * (other @ inverse @ residual) / (other @ inverse @ other)
    beside = _unrestricted(other[:, None], curve, left, covariance)
    expected = (normal @ columns.T @ inverse @ left)[0]
    assert beside == pytest.approx((expected, np.sqrt(normal[0, 0])))
    assert _unrestricted(np.zeros((8, 0)), np.zeros(8), residual, covariance) == (0.0, np.inf)


def test_a_discrepancy_that_suffices():
    """One as large as the misfit at each of many levels makes the sum of squares their number."""
    target, residual = np.full(20, 2.0), np.full(20, 0.2)
    covariance = 1e-8 * np.eye(20)
    assert suffices(0.11, residual, covariance, target, target, 20)
    assert not suffices(0.09, residual, covariance, target, target, 20)
    assert not suffices(0.0, residual, covariance, target, target, 20)
    assert suffices(0.0, 1e-4 * np.ones(20), covariance, target, target, 20)
    assert not suffices(0.0, np.full(20, 2.1), covariance, target, target, 20)
