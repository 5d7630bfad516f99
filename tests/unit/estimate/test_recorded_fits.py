"""Whole fits of small series by all methods, all fields and sentences, as they were recorded."""

import numpy as np
import pytest

import gmwm
from classes import assert_dataclasses_keep_the_rules, signatures_of
from gmwm import (
    ARMA,
    GMWM,
    BiasInstability,
    GaussMarkov,
    LowPassNoise,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Resonance,
    Sinusoid,
    WhiteNoise,
)
from gmwm.estimate import EM, MLE, AllanLines, SimulatedMoments, Whittle, estimate
from gmwm.process import as_model
from recorded import Pictures, assert_as_recorded, summed

DT = 0.01
N, K = WhiteNoise(0.01), RandomWalk(0.02)
SLOW, FAST = GaussMarkov(0.05, 1.0), GaussMarkov(0.05, 0.05)


def series(truth, n=3000, seed=1, missing=0.0):
    rng = np.random.default_rng(seed)
    x = truth.simulate(n, DT, rng) + 0.3
    x[rng.random(n) < missing] = np.nan
    return x


CONTENT = (
    "params", "stderr", "objective", "chi_square", "chi_square_allowed", "dof", "discrepancy",
    "log_likelihood", "slope_dof", "regions",
)  # fmt: skip


def all_of(fit):
    content = fit.content()
    found = {
        "content": {key: content[key] for key in CONTENT},
        "covariance": content["covariance"], "trace": summed(content["trace"]),
        "interval": fit.interval(), "growth": dict(fit.error_growth),
        "p": [fit.p_value, fit.p_value_allowed], "notices": fit.notices, "text": str(fit),
        "not": [name for name, holds in fit.reasons.items() if not holds],
        "components": list(fit.components.values()),
    }  # fmt: skip
    if fit.method not in ("allan",):
        at = fit.goodness
        found["goodness"] = {
            "fields": [at.data, at.model, at.misfit, at.residual, at.allowed, at.dof],
            "sentence": at.sentence, "known": at.known_to, "worst": at.worst,
            "beyond": at.beyond_chance, "largest": at.largest, "p": at.largest_p,
            "judged": at.judged,
            "is": [at.is_poor, at.misses_a_level, at.is_excluded, at.describes_all],
        }  # fmt: skip
        found["deviation"] = fit.deviation_interval(np.array([0.01, 0.64, 5.12]), 0.9)
    return found


MOMENTS = {
    "n_gm_k": (N + SLOW + K, None, {}),
    "n_gm_ramp": (N + SLOW + RateRamp(-0.03), None, {}),
    "q_n_2gm": (QuantizationNoise(1e-4) + N + FAST + SLOW, None, {"n": 20_000}),
    "gaps": (N + SLOW + RateRamp(0.01), None, {"missing": 0.03}),
    "needless_term": (N + SLOW, N + SLOW + FAST + K, {}),
    "wrong": (N + Resonance(0.1, 8.0, 0.1), N + K, {}),
    "wrong_slow": (N + K, N + BiasInstability(1.0), {}),
    "arma": (ARMA([0.8], [0.4], 1e-4), None, {"n": 1000}),
    "line": (N + Sinusoid(0.1, 3.0), None, {}),
    "bandwidth": (LowPassNoise(0.01, 20.0, 2.0, 0.7), LowPassNoise(order=2.0, damping=0.7), {}),
    "short": (N, N, {"n": 40}),
}


def fitted(truth, model, method=None, **options):
    model = as_model(model or truth)
    return estimate(
        model if model.is_open else model.opened(), series(truth, **options), DT, method
    )


@pytest.mark.parametrize("name", MOMENTS)
def test_moments(name):
    truth, model, options = MOMENTS[name]
    assert_as_recorded(f"estimate/fit_{name}", all_of(fitted(truth, model, **options)), rtol=1e-4)


@pytest.mark.parametrize(
    "method", [GMWM("data"), GMWM("diagonal"), GMWM("identity"), GMWM(discrepancy=0.05)], ids=repr
)
def test_other_weights(method):
    name = f"fit_weights_{method.weights}{'_given' * (method.discrepancy is not None)}"
    found = fitted(N + SLOW + RateRamp(0.03), None, method)
    assert_as_recorded(f"estimate/{name}", all_of(found), rtol=1e-4)


def test_robust_and_other_wavelets_and_simulated_moments():
    x = series(N + SLOW)
    model = (N + SLOW).opened()
    found = {
        "robust": estimate(model, gmwm.wavelet_variance(x, DT, robust=True)),
        "simulated": estimate(model, x[:600], DT, SimulatedMoments(replications=2)),
    }
    assert_as_recorded("estimate/fit_other", {k: all_of(v) for k, v in found.items()}, rtol=1e-4)


@pytest.mark.parametrize("method", [MLE(), Whittle()], ids=lambda m: m.name)
def test_likelihoods(method):
    cases = {}
    if method.name == "mle":
        cases["gaps"] = (N + FAST + K, None, {"missing": 0.05})
    cases["needless"] = (N + FAST, N + FAST + K, {})
    cases["ramp"] = (N + RateRamp(0.2), None, {})
    cases["quantized"] = (QuantizationNoise(1e-4) + N + FAST, None, {})
    found = {
        name: all_of(fitted(truth, model, method, n=200, **options))
        for name, (truth, model, options) in cases.items()
    }
    assert_as_recorded(f"estimate/fit_by_{method.name}", found, rtol=2e-3)


def test_likelihood_by_em():
    """Of a maximum that is reached: how many steps that takes is not the same on every machine."""
    found = all_of(fitted(N + GaussMarkov(0.05, 0.2), None, EM(), n=400, missing=0.05))
    del found["trace"], found["text"]
    assert_as_recorded("estimate/fit_by_em", found, rtol=2e-3)


def test_lines_of_the_allan_plot():
    x = series(QuantizationNoise(3e-4) + N + K + RateRamp(0.01), 20_000)
    every = QuantizationNoise() + N + BiasInstability() + K + RateRamp()
    given = AllanLines({"N": (0.02, 0.16), "K": (10.24, 40.96)})
    found = {
        "all": estimate(every.opened(), x, DT, AllanLines()),
        "given": estimate((N + K).opened(), x, DT, given),
        "white": estimate(every.opened(), series(N), DT, AllanLines()),
    }
    assert_as_recorded("estimate/fit_lines", {k: all_of(v) for k, v in found.items()}, rtol=1e-5)


def test_draws_of_a_bootstrap():
    fit = fitted(N + SLOW + RateRamp(0.01), None)
    drawn = gmwm.bootstrap(fit, runs=2, seed=2)
    whole = gmwm.bootstrap(fit, runs=2, seed=2, full=True)
    small = fitted(N, None, n=1000)
    found = {
        "draws": drawn.draws,
        "interval": drawn.interval(0.5),
        "stderr": drawn.stderr,
        "full": whole.draws,
        "p": gmwm.bootstrap_test(small, (N + K).opened(), runs=3),
    }
    assert_as_recorded("estimate/bootstrap", found, rtol=1e-3)


def test_bounds_on_errors():
    models = {
        "n_k": (N + K, 200), "n_k_long": (N + SLOW + K, 1_000_000),
        "long_ramp": (N + K + RateRamp(0.01), 30_000),
        "arma": (ARMA([0.8], [0.4], 1e-4), 200),
    }  # fmt: skip
    found = {}
    for name, (model, n) in models.items():
        bound = gmwm.cramer_rao(model, n, DT)
        found[name] = [bound.content(), bound.stderr, bound.wavelet_stderr, str(bound)]
    assert_as_recorded("estimate/cramer_rao", found, rtol=1e-5)


def test_several_recordings():
    parts = [series(N + SLOW, n, seed) for n, seed in ((2000, 1), (1500, 2))]
    parts.append(series(WhiteNoise(0.013) + SLOW, 1800, 4))
    fit = estimate((N + SLOW + K).opened(), parts, DT)
    found = [all_of(fit), fit.agreement, fit.equality_p, fit.curves_p, fit.spread]
    assert_as_recorded("estimate/fit_joint", found, rtol=1e-4)


def test_no_estimate_dataclass_changes():
    assert_dataclasses_keep_the_rules("estimate", "Series Moments")


def test_arguments_of_the_estimate_room_and_their_defaults():
    assert_as_recorded("estimate/interface_estimate", signatures_of("estimate"))


def test_what_is_drawn_of_fits(monkeypatch):
    pictures = Pictures(monkeypatch)
    fit = fitted(N + SLOW, None)
    fit.plot()
    fit.plot(units="si")
    fit.goodness.plot()
    lines = AllanLines({"N": (0.02, 0.16), "K": (2.56, 10.24)})
    fitted(N + K, None, lines, n=8000).plot()
    assert_as_recorded("estimate/drawn_fits", pictures.asked, rtol=1e-4)
