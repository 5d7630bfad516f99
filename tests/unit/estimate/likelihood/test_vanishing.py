"""Terms that are not there: whether they are left out, and how large they may be."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import minimize_scalar

import gmwm
from gmwm import RandomWalk, WhiteNoise
from gmwm.estimate.likelihood.likelihood import Columns, KalmanLikelihood
from marks import slow


@pytest.fixture(scope="module")
def bound():
    """The quantile of the profile likelihood of K, of a series of white noise."""
    x = WhiteNoise(1.0).simulate(800, 1.0, seed=7)
    likelihood = KalmanLikelihood(Columns(x, 1.0, None, False))

    def profile(walk):
        search = minimize_scalar(
            lambda white: -likelihood((WhiteNoise(white), RandomWalk(walk))),
            bounds=(0.8, 1.2),
            method="bounded",
        )
        return -search.fun

    scale = np.linspace(0.0, 0.06, 101)
    heights = np.array([profile(k) for k in scale])
    share = cumulative_trapezoid(np.exp(heights - np.max(heights)), initial=0.0)
    return x, np.interp(0.95, share / share[-1], scale)


@pytest.mark.parametrize("method", ["mle", slow("em")])
def test_the_bound_is_the_quantile_of_the_profile_likelihood(bound, method):
    x, expected = bound
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), x, dt=1.0, method=method)
    assert fit.params["K"] == 0.0
    assert fit.upper_bounds["K"] == pytest.approx(expected, rel=0.03)


def test_a_bound_has_the_unit_of_its_parameter():
    x = WhiteNoise(1.0).simulate(800, 1.0, seed=7)
    plain = gmwm.fit(WhiteNoise() + RandomWalk(), x, dt=1.0, method="mle")
    scaled = gmwm.fit(WhiteNoise() + RandomWalk(), 1e-5 * x, dt=0.01, method="mle")
    assert scaled.upper_bounds["K"] == pytest.approx(1e-4 * plain.upper_bounds["K"], rel=1e-2)
