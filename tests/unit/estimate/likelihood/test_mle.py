"""Exact maximum likelihood: against statsmodels, against its own statistics, and its errors."""

import json
import warnings
from itertools import product

import numpy as np
import pytest
from scipy.stats import chi2, norm
from statsmodels.tsa.statespace.structural import UnobservedComponents

import gmwm
from gmwm import AR, ARMA, GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, WhiteNoise
from gmwm.errors import InputError
from gmwm.estimate import METHODS, Fit
from gmwm.estimate.likelihood.likelihood import Columns, KalmanLikelihood, defined
from gmwm.process import as_model
from marks import slow

OF_SAMPLES = ("mle", "whittle", "em")


def mle(model, x, dt=1.0, **options):
    return gmwm.fit(model, x, dt=dt, method=gmwm.MLE(**options))


def peer_fit(model, start, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return model.fit(
            start, disp=False, method="lbfgs", pgtol=1e-10, factr=1e3, maxiter=500, **options
        )


# -- statsmodels ------------------------------------------------------------------------------


@pytest.mark.parametrize(("slope", "missing"), [(None, 200), (3e-3, 0)])
def test_walk_and_white_noise_are_the_local_level_of_statsmodels(slope, missing):
    truth = WhiteNoise(0.5) + RandomWalk(0.1)
    x = truth.simulate(2000, 1.0, seed=3) + 7.0
    x[np.random.default_rng(1).choice(2000, missing, replace=False)] = np.nan
    kind = "local level"
    model = truth.opened()
    if slope is not None:
        x += slope * np.arange(2000)
        kind, model = "local linear deterministic trend", model + RateRamp()
    fit = mle(model, x)
    peer = peer_fit(UnobservedComponents(x, kind, use_exact_diffuse=True), [0.2, 0.02])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        errors = np.sqrt(np.diag(peer.cov_params_approx))
    for key, variance, error in zip(("N", "K"), peer.params, errors, strict=True):
        # In units of the standard errors: both are the maximum of the same function.
        assert fit.params[key] == pytest.approx(np.sqrt(variance), abs=5e-3 * fit.stderr[key])
        assert fit.stderr[key] == pytest.approx(0.5 * error / np.sqrt(variance), rel=0.01)
    at_ours = UnobservedComponents(x, kind, use_exact_diffuse=True).loglike(
        [fit.params["N"] ** 2, fit.params["K"] ** 2]
    )
    assert at_ours == pytest.approx(peer.llf, abs=1e-4)
    if slope is not None:
        smoothed = peer.smoothed_state[1, -1], np.sqrt(peer.smoothed_state_cov[1, 1, -1])
        assert fit.params["R"] == pytest.approx(smoothed[0], abs=5e-3 * smoothed[1])
        assert fit.stderr["R"] == pytest.approx(smoothed[1], rel=2e-3)


# -- its own statistics -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("truth", "n"),
    [
        (WhiteNoise(0.3) + RandomWalk(0.05), 1000),
        (WhiteNoise(0.3) + GaussMarkov(0.5, 5.0) + RateRamp(1e-3), 1000),
        slow(as_model(AR([1.2, -0.6], 2.0)), 1000),
    ],
    ids=repr,
)
def test_standard_errors_are_the_spread_of_the_estimates(truth, n):
    runs = 12
    rng = np.random.default_rng(12)
    fits = [
        mle(truth.opened(), truth.simulate(n, 1.0, rng), start=truth)  # `whittle` agrees with it
        for _ in range(runs)
    ]
    # chi-square of the variance over runs, two sides of 1e-3; 10 % more for the spread of the
    # predicted errors and the curvature of the parameters.
    low, high = np.sqrt(chi2.ppf([1e-3, 1.0 - 1e-3], runs - 1) / (runs - 1))
    for key, value in truth.params.items():
        estimates = np.array([fit.params[key] for fit in fits])
        predicted = float(np.sqrt(np.mean([fit.stderr[key] ** 2 for fit in fits])))
        ratio = np.std(estimates, ddof=1) / predicted
        assert low / 1.1 < ratio < high * 1.1, key
        bias = (np.mean(estimates) - value) / predicted
        # 4 errors of the mean, and a bias of the order of the relative error.
        relative = min(predicted / abs(value), 0.3)
        assert abs(bias) < 4.0 / np.sqrt(runs) + relative, key


@pytest.mark.parametrize("method", ["mle", slow("whittle")])
def test_an_amplitude_of_zero_has_an_upper_bound(method):
    zero = bounded = 0
    runs = 8
    rng = np.random.default_rng(21)
    for _ in range(runs):
        x = WhiteNoise(1.0).simulate(1000, 1.0, rng)
        fit = gmwm.fit(WhiteNoise() + RandomWalk(), x, dt=1.0, method=method)
        assert fit.params["N"] == pytest.approx(1.0, abs=4.0 / np.sqrt(2000))
        if fit.params["K"] == 0.0:
            zero += 1
            assert "K" not in fit.stderr
        if "K" in fit.upper_bounds:
            bounded += 1
            assert not fit.valid
            assert "K: not significantly above zero" in fit.message
            assert 0.0 < fit.upper_bounds["K"] < 0.05
            assert fit.interval()["K"] == (0.0, fit.upper_bounds["K"])
    # The score at zero is negative in more than half of the runs (it is a skewed sum of squares:
    # 0.66 for the local level, Shephard & Harvey 1990), and significant in few.
    assert 0.35 * runs < zero < 0.95 * runs
    assert bounded >= 0.8 * runs


@pytest.mark.parametrize(
    ("K", "method", "runs"), [(1.5e-3, "mle", 12), slow(6e-3, "mle", 12), slow(1.5e-3, "em", 10)]
)
@pytest.mark.slow
def test_intervals_of_a_walk_that_can_hardly_be_seen_cover_it(K, method, runs):
    rng = np.random.default_rng(22)
    truth = WhiteNoise(1.0) + RandomWalk(K)
    held = 0
    for _ in range(runs):
        x = truth.simulate(1500, 1.0, rng)
        fit = gmwm.fit(truth.opened(), x, dt=1.0, method=METHODS[method](start=truth))
        low, high = fit.interval()["K"]
        held += low <= K <= high
    assert held >= 0.75 * runs  # less than 1 of 100 at a coverage of 0.93


def test_missing_samples_cost_only_what_they_knew():
    truth = WhiteNoise(0.3) + GaussMarkov(0.5, 20.0) + RateRamp(1e-4)
    n = 5_000
    x = truth.simulate(n, 1.0, seed=9)
    gappy = x.copy()
    rng = np.random.default_rng(2)
    gappy[rng.choice(n, n // 10, replace=False)] = np.nan
    gappy[[0, -1]] = np.nan
    whole, part = mle(truth.opened(), x), mle(truth.opened(), gappy)
    for key, error in whole.stderr.items():
        # The difference of an efficient estimate and one of fewer data has the difference of the
        # variances (Hausman 1978).
        assert 0.98 * error < part.stderr[key] < 1.2 * error
        spread = np.sqrt(max(part.stderr[key] ** 2 - error**2, (0.2 * error) ** 2))
        assert abs(part.params[key] - whole.params[key]) < norm.isf(1e-4) * spread


def test_estimates_are_where_the_likelihood_is_flat():
    truth = QuantizationNoise(0.4) + WhiteNoise(0.2) + GaussMarkov(0.5, 20.0) + RandomWalk(0.02)
    x = truth.simulate(8_000, 1.0, seed=11)
    fit = mle(truth.opened(), x)
    likelihood = KalmanLikelihood(Columns(x, 1.0, None, False))
    for key, error in fit.stderr.items():
        step = 0.05 * min(error, 0.5 * fit.params[key])
        up, down = (
            likelihood(fit.model.with_params({key: fit.params[key] + s * step}).terms)
            for s in (1.0, -1.0)
        )
        # The slope over the curvature of a single parameter, in its conditional error.
        curvature = (2.0 * fit.log_likelihood - up - down) / step**2
        distance = (up - down) / (2.0 * step) / curvature
        assert abs(distance) * np.sqrt(curvature) < 0.02, key


# -- invariances ----------------------------------------------------------------------------------


def test_offset_scale_and_units_do_not_matter():
    truth = WhiteNoise(0.2) + GaussMarkov(0.5, 20.0)
    x = truth.simulate(2000, 1.0, seed=2)
    plain = mle(truth.opened(), x)
    for scale, offset in ((1e-7, 3e-5), (1e4, 1e9), (1.0, 1e6)):
        scaled = mle(truth.opened(), scale * x + offset)
        assert scaled.params["tau"] == pytest.approx(plain.params["tau"], rel=1e-4)
        for key in ("N", "sigma"):
            assert scaled.params[key] == pytest.approx(scale * plain.params[key], rel=1e-4)
            assert scaled.stderr[key] == pytest.approx(scale * plain.stderr[key], rel=1e-3)
    faster = mle(truth.opened(), x, dt=0.01)
    assert faster.params["tau"] == pytest.approx(0.01 * plain.params["tau"], rel=1e-4)
    assert faster.params["N"] == pytest.approx(0.1 * plain.params["N"], rel=1e-4)


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_a_steep_ramp_does_not_matter_where_the_drift_is_free(method):
    truth = WhiteNoise(0.2) + RandomWalk(0.01)
    n = 2000
    x = truth.simulate(n, 1.0, seed=3)
    model = truth.opened() + RateRamp()
    plain = gmwm.fit(model, x, dt=1.0, method=method)
    slope = 10.0
    steep = gmwm.fit(model, x + slope * np.arange(n), dt=1.0, method=method)
    assert steep.valid, steep.message
    assert steep.params["R"] - slope == pytest.approx(
        plain.params["R"], abs=0.01 * plain.stderr["R"]
    )
    for key in ("N", "K"):
        error = plain.stderr[key]
        assert steep.params[key] == pytest.approx(plain.params[key], abs=0.02 * error)
        assert steep.stderr[key] == pytest.approx(error, rel=0.02)


# -- what is given --------------------------------------------------------------------------------


@pytest.mark.parametrize("method", OF_SAMPLES)
@pytest.mark.parametrize(
    "model",
    [
        WhiteNoise() + GaussMarkov(tau=20.0),
        WhiteNoise() + GaussMarkov(sigma=0.5),
        WhiteNoise(0.2) + GaussMarkov(),
        WhiteNoise() + GaussMarkov(0.5, 20.0),
        WhiteNoise() + GaussMarkov() + RateRamp(1e-4),
        WhiteNoise(0.2) + GaussMarkov(0.5, 20.0) + RateRamp(),
    ],
    ids=repr,
)
def test_given_parameters_stay_as_they_are(method, model):
    truth = WhiteNoise(0.2) + GaussMarkov(0.5, 20.0) + RateRamp(1e-4)
    x = truth.simulate(2000, 1.0, seed=1)
    if not any(isinstance(term, RateRamp) for term in model.terms):
        x = x - 1e-4 * np.arange(2000)
    fit = gmwm.fit(model, x, dt=1.0, method=method)
    for key, value in model.params.items():
        if value is None:
            assert abs(fit.params[key] - truth.params[key]) < norm.isf(1e-4) * fit.stderr[key]
        else:
            assert fit.params[key] == value
            assert key not in fit.stderr


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_gauss_markov_terms_come_by_rising_time(method):
    truth = GaussMarkov(1.0, 3.0) + GaussMarkov(0.7, 100.0)
    x = truth.simulate(2000, 1.0, seed=6)
    turned = GaussMarkov(0.7, 100.0) + WhiteNoise(0.1) + GaussMarkov(1.0, 3.0)
    fit = gmwm.fit(2 * GaussMarkov(), x, dt=1.0, method=method)
    assert fit.params["tau_1"] < fit.params["tau_2"]
    half_given = gmwm.fit(GaussMarkov(tau=100.0) + GaussMarkov(), x, dt=1.0, method=method)
    assert half_given.params["tau_2"] == 100.0
    assert set(half_given.stderr) == {"sigma_1", "tau_1", "sigma_2"}
    for key, error in half_given.stderr.items():
        assert abs(half_given.params[key] - truth.params[key]) < norm.isf(1e-4) * error
    assert turned.params["tau_1"] == 3.0


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_the_start_does_not_matter(method):
    truth = WhiteNoise(0.2) + GaussMarkov(0.5, 20.0)
    x = truth.simulate(1000, 1.0, seed=7)
    plain = gmwm.fit(truth.opened(), x, dt=1.0, method=method)
    for start in (
        WhiteNoise(0.4) + GaussMarkov(0.3, 60.0),
        GaussMarkov(1.0, 8.0) + WhiteNoise(0.1),
    ):
        other = gmwm.fit(truth.opened(), x, dt=1.0, method=METHODS[method](start=start))
        assert other.valid, other.message
        for key, error in plain.stderr.items():
            assert other.params[key] == pytest.approx(plain.params[key], abs=0.05 * error)


# -- looks and files ------------------------------------------------------------------------------


@pytest.mark.parametrize("method", OF_SAMPLES)
@pytest.mark.parametrize("model", [WhiteNoise() + RandomWalk() + RateRamp()], ids=repr)
def test_fits_come_back_from_json(method, model):
    for truth in (WhiteNoise(0.3) + RandomWalk(0.05) + RateRamp(1e-3), as_model(WhiteNoise(1.0))):
        x = truth.simulate(500, 1.0, seed=4)
        options = {"max_iterations": 50} if method == "em" else {}
        fit = gmwm.fit(model, x, dt=1.0, method=METHODS[method](**options))
        text = json.dumps(fit.to_dict())
        again = Fit.from_dict(json.loads(text))
        assert str(again) == str(fit)
        assert json.dumps(again.to_dict()) == text
        assert again.params == fit.params
        assert again.trace == fit.trace
        assert again.log_likelihood == fit.log_likelihood


@pytest.mark.parametrize(
    ("method", "how"),
    [
        ("mle", "exact maximum likelihood"),
        ("whittle", "debiased Whittle likelihood"),
        ("em", "EM, "),
    ],
)
def test_a_fit_says_how_it_was_made(method, how):
    x = (WhiteNoise(0.3) + RandomWalk(0.05)).simulate(1000, 0.01, seed=5)
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), x, dt=0.01, method=method)
    first, second, third, head, *rest = str(fit).splitlines()
    assert first == "series: white noise + random walk"
    assert second.startswith(f"1,000 samples at 100 Hz, {fit.wv.tau.size} levels; {how}")
    assert third == ""
    assert head.split() == ["parameter", "estimate", "std.", "error", "95", "%", "interval", "unit"]
    assert [line.split()[0] for line in rest[:2]] == ["N", "K"]
    assert rest[3] == f"log-likelihood {fit.log_likelihood:.8g}"
    assert rest[4].startswith("of the wavelet variances: objective ")
    assert rest[5].startswith("largest misfit")
    assert ("valid" if fit.valid else "NOT VALID") in rest[6:8]


# -- awkward starts and gaps ----------------------------------------------------------------------


def ramped():
    """A walk on a ramp, which no stationary model describes."""
    truth = WhiteNoise(0.2) + RandomWalk(0.02) + RateRamp(0.003)
    return truth.simulate(6000, 1.0, seed=1)[:1500]


@pytest.mark.parametrize("method", ["mle", "whittle"])
def test_a_start_in_a_corner_is_left(method):
    x = ramped()
    good = gmwm.fit(GaussMarkov(), x, 1.0, method=gmwm.MLE(start=GaussMarkov(1.0, 50.0)))
    for start in (None, GaussMarkov(1.0, 3e-4)):
        fit = gmwm.fit(GaussMarkov(), x, 1.0, method=METHODS[method](start=start))
        assert fit.params["tau"] == pytest.approx(good.params["tau"], rel=0.02)
        assert fit.log_likelihood > good.log_likelihood - 0.01


@pytest.mark.parametrize(
    "model",
    [
        GaussMarkov() + RateRamp(),
        WhiteNoise(0.2) + GaussMarkov(),
        GaussMarkov(sigma=1.0) + WhiteNoise(),
        RandomWalk() + WhiteNoise(),
        ARMA(1, 1),
    ],
)
def test_it_is_never_below_any_grid_point(model):
    """Of times and amplitudes, by brute force."""
    x = ramped()[:400]
    fit = mle(model, x)
    model = as_model(model)
    columns = Columns(x, 1.0, None, any(isinstance(t, RateRamp) for t in model.terms))
    likelihood = KalmanLikelihood(columns)
    grids = []
    for term in model.terms:
        if isinstance(term, RateRamp):
            continue
        free = [name for name, value in term.values.items() if value is None]
        axis = [
            np.linspace(-0.9, 0.999, 5) if name[:2] in ("ar", "ma") else np.geomspace(1e-3, 1e3, 9)
            for name in free
        ]
        points = [dict(zip(free, map(float, v), strict=True)) for v in product(*axis)]
        grids.append([term.with_values(**point) for point in points])
    best = max(defined(likelihood, processes) for processes in product(*grids))
    assert fit.log_likelihood > best - 1e-3


@pytest.mark.parametrize(
    ("kept", "method"),
    [(lambda k: k % 2 == 1, "mle"), slow(lambda k: k % 2 == 1, "em"),
     slow(lambda k: k * 7 % 10 < 4, "mle"), (lambda k: k * 7 % 10 < 4, "em")],
)  # fmt: skip
def test_gaps_may_be_anywhere(method, kept):
    truth = WhiteNoise(0.2) + GaussMarkov(0.5, 20.0)
    x = truth.simulate(2000, 1.0, seed=3)
    gappy = np.where(kept(np.arange(x.size)), x, np.nan)
    fit = gmwm.fit(truth.opened(), gappy, 1.0, method=method)
    for key, value in truth.params.items():
        assert fit.params[key] == pytest.approx(value, abs=4.0 * fit.stderr[key])
    assert fit.valid
    assert np.isnan(fit.p_value)
    assert "no-test" in [notice.code for notice in fit.notices]
    assert Fit.from_dict(fit.to_dict()).params == fit.params


def test_hardly_any_sample_is_refused():
    x = np.where(np.arange(100) % 20 == 0, 1.0, np.nan) * np.arange(100)
    for method in ("mle", "em"):
        with pytest.raises(InputError, match="5 samples that are not missing: give 8 or more"):
            gmwm.fit(WhiteNoise(), x, 1.0, method=method)
        x[1] = np.inf
        with pytest.raises(InputError, match="infinite samples, the first at index 1"):
            gmwm.fit(WhiteNoise(), x, 1.0, method=method)
        x[1] = np.nan
