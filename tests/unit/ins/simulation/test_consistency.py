"""Consistency figures on synthetic runs: their bands hold what they claim, and flag what is wrong.

Counts of repeated draws are judged by their binomial law at 1e-4, so that a test that passes by
chance or fails by chance is rare; seeds are fixed all the same.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.signal import lfilter
from scipy.stats import binom, chi2, multivariate_normal, norm
from statsmodels.stats.proportion import proportion_confint

from gmwm.ins import Consistency, FilterErrors, at_epoch, innovation_test, over_time
from gmwm.ins.simulation import GROUPS
from gmwm.ins.simulation.consistency import (
    LEVELS,
    chi_square_ratio,
    coverage_of,
    mean_ratio,
    serial_ratio,
)
from marks import slow

SIZES = {name: part.stop - part.start for name, part in GROUPS.items()} | {"sensors": 6}


@pytest.mark.parametrize("memory", [0.0, 0.8, 0.95])
def test_one_run_is_judged_by_the_epochs_that_its_correlation_leaves(memory):
    rng, within, seen, runs = np.random.default_rng(5), 0, 0, 300
    for _ in range(runs):
        errors = rng.standard_normal((500, 3))
        errors[1:] *= np.sqrt(1.0 - memory**2)
        errors = lfilter([1.0], [1.0, -memory], errors, axis=0)
        within += serial_ratio(errors).within
        seen += serial_ratio(1.5 * errors).p_value < 1e-3
    assert binom.ppf(1e-4, runs, 0.94) <= within <= binom.ppf(1.0 - 1e-4, runs, 0.96)
    assert seen > 0.9 * runs


def test_an_error_that_stays_counts_once():
    found = serial_ratio(np.full((200, 3), 1.2))
    assert found.value == pytest.approx(1.44)
    assert (found.lower, found.upper) == pytest.approx(chi2.ppf([0.025, 0.975], 3) / 3)


def covariances(rng, size):
    """A covariance with strong correlations and units that differ by orders of magnitude."""
    root = rng.standard_normal((size, size + 1)) * np.geomspace(1e-3, 10.0, size)[:, None]
    return root @ root.T


def synthetic(rng, runs, epochs=1, *, true=1.0, memory=0.0):
    """Runs whose errors have ``true`` times the predicted covariance; AR(1) from epoch to epoch."""
    P, S = covariances(rng, 9), covariances(rng, 6)
    error = ar_one(rng, runs, epochs, P, memory) * np.sqrt(true)
    sensor = ar_one(rng, runs, epochs, S, memory) * np.sqrt(true)
    nees, log_det = np.empty((2, runs, epochs, len(GROUPS)))
    for i, part in enumerate(GROUPS.values()):
        block = P[part, part]
        nees[..., i] = np.einsum(
            "...i,ij,...j", error[..., part], np.linalg.inv(block), error[..., part]
        )
        log_det[..., i] = np.log(np.linalg.det(block))
    return FilterErrors(
        time=np.arange(epochs, dtype=float),
        before=np.zeros(epochs, dtype=bool),
        error=error,
        sd=np.broadcast_to(np.sqrt(np.diag(P)), error.shape).copy(),
        nees=nees,
        log_det=log_det,
        sensor_error=sensor,
        sensor_sd=np.broadcast_to(np.sqrt(np.diag(S)), sensor.shape).copy(),
        sensor_nees=np.einsum("...i,ij,...j", sensor, np.linalg.inv(S), sensor),
        nis=np.column_stack([rng.chisquare(300, runs), np.full(runs, 300.0)]),
        whiteness=rng.standard_normal(runs),
    )


def ar_one(rng, runs, epochs, covariance, memory):
    white = rng.standard_normal((runs, epochs, len(covariance)))
    series = np.empty_like(white)
    series[:, 0] = white[:, 0]
    for k in range(1, epochs):
        series[:, k] = memory * series[:, k - 1] + np.sqrt(1.0 - memory**2) * white[:, k]
    return series @ np.linalg.cholesky(covariance).T


def diverged(runs, which):
    """Some runs lost from the second epoch on."""
    changed = {}
    for key in ("error", "sd", "nees", "log_det", "sensor_error", "sensor_sd", "sensor_nees"):
        values = getattr(runs, key).copy()
        values[which, min(1, values.shape[1] - 1) :] = np.nan
        changed[key] = values
    return replace(runs, **changed)


def least(draws, probability, chance=1e-4):
    return binom.ppf(chance, draws, probability) / draws


def most(draws, probability, chance=1e-4):
    return binom.ppf(1.0 - chance, draws, probability) / draws


# ---- A consistent filter ----


def test_bands_of_one_epoch_hold_95_percent_of_consistent_draws():
    rng = np.random.default_rng(1)
    draws = 250
    found = [at_epoch(synthetic(rng, 30), 0) for _ in range(draws)]
    for name in SIZES:
        fraction = np.mean([each.nees[name].within for each in found])
        assert least(draws, 0.95) <= fraction <= most(draws, 0.95), name
        p_values = np.sort([each.nees[name].p_value for each in found])
        uniform = np.arange(1, draws + 1) / draws
        assert np.max(np.abs(p_values - uniform)) < 2.3 / np.sqrt(draws), name  # Kolmogorov, 5e-5


def test_a_consistent_filter_is_called_so():
    """One in a thousand is not, over all five groups."""
    rng = np.random.default_rng(2)
    draws = 100
    flagged = sum(not at_epoch(synthetic(rng, 20), 0).consistent for _ in range(draws))
    assert flagged <= binom.ppf(1.0 - 1e-4, draws, 1e-3)


def test_bands_over_time_hold_95_percent_of_correlated_draws():
    rng = np.random.default_rng(3)
    draws = 80
    found = [over_time(synthetic(rng, 30, 20, memory=0.9)) for _ in range(draws)]
    for name in SIZES:
        # Student's t with some skewness left: 93 % to 96 %.
        fraction = np.mean([each.nees[name].within for each in found])
        assert least(draws, 0.93) <= fraction <= most(draws, 0.96), name
    assert np.mean([each.consistent for each in found]) >= least(draws, 0.985)


@pytest.mark.parametrize("correlation", [0.0, 0.7, 0.999])
@pytest.mark.parametrize("size", [3, 9])
def test_interval_of_coverage_is_honest_whatever_the_correlation_of_components(size, correlation):
    rng = np.random.default_rng(4)
    draws, runs = 300, 40
    common = rng.standard_normal((draws, runs, 1))
    standard = np.sqrt(correlation) * common + np.sqrt(1.0 - correlation) * rng.standard_normal(
        (draws, runs, size)
    )
    found = [coverage_of(each[:, None], single=True) for each in standard]
    for i in range(len(LEVELS)):
        assert np.mean([each[i].within for each in found]) >= least(draws, 0.95)


@pytest.mark.parametrize("memory", [0.0, slow(0.9), 0.99])
def test_interval_of_coverage_over_time_is_honest(memory):
    rng = np.random.default_rng(5)
    draws = 100
    found = [over_time(synthetic(rng, 40, 15, memory=memory)) for _ in range(draws)]
    for name in ("position", "navigation", "sensors"):
        for i, level in enumerate(LEVELS):
            fraction = np.mean([each.coverage[name][i].within for each in found])
            # Nominal 95 %; at 99.7 % a few runs make the count, and the law is approximate.
            assert fraction >= least(draws, 0.95 if level < 0.99 else 0.93), (name, level)


def test_interval_of_coverage_over_time_tightens_with_what_the_runs_are_worth():
    rng = np.random.default_rng(6)
    widths = {}
    for memory in (0.0, 0.999):
        interval = over_time(synthetic(rng, 60, 40, memory=memory)).coverage["position"][2]
        widths[memory] = interval.upper - interval.lower
    assert widths[0.0] < 0.5 * widths[0.999]


# ---- An inconsistent one ----


@pytest.mark.parametrize("true", [1.6, 1.0 / 1.6])
@pytest.mark.parametrize("judge", [lambda runs: at_epoch(runs, 0), over_time])
def test_covariance_wrong_by_a_factor_is_flagged(true, judge):
    found = judge(synthetic(np.random.default_rng(7), 200, 5, true=true))
    assert not found.consistent
    for name in SIZES:
        ratio = found.nees[name]
        assert not ratio.within
        assert ratio.p_value < 1e-3
        assert (ratio.value > 1.0) == (true > 1.0)
        assert found.rms[name] == pytest.approx(np.sqrt(true), rel=0.1)
        fraction = norm.cdf(norm.ppf(0.975) / np.sqrt(true)) * 2.0 - 1.0
        assert found.coverage[name][2].fraction == pytest.approx(fraction, abs=0.1)
        assert all(
            (each.fraction < each.level) == (true > 1.0) for each in found.coverage[name][:3]
        )


@given(st.floats(0.1, 0.9), st.floats(1.1, 10.0))
@settings(max_examples=20, deadline=None)
def test_score_is_least_at_the_true_covariance(less, more):
    """A proper score: errors fixed, predictions scaled; 2,000 errors leave it no doubt."""
    runs = synthetic(np.random.default_rng(8), 2000)

    def score(factor):
        scaled = replace(
            runs,
            nees=runs.nees / factor,
            log_det=runs.log_det + np.log(factor) * np.array(list(SIZES.values())[:-1]),
        )
        return at_epoch(scaled, 0).score

    true, low, high = score(1.0), score(less), score(more)
    for name in GROUPS:
        assert true[name] < low[name]
        assert true[name] < high[name]


def test_score_is_the_logarithm_of_the_density():
    runs = synthetic(np.random.default_rng(9), 50)
    rng = np.random.default_rng(9)
    P = covariances(rng, 9)
    for name, part in GROUPS.items():
        law = multivariate_normal(np.zeros(part.stop - part.start), P[part, part])
        expected = -np.mean(law.logpdf(runs.error[:, 0, part]))
        assert at_epoch(runs, 0).score[name] == pytest.approx(expected, rel=1e-6)


# ---- Figures against other libraries ----


@given(st.integers(1, 400), st.data())
@settings(max_examples=60, deadline=None)
def test_interval_of_coverage_is_that_of_clopper_and_pearson(runs, data):
    inside = data.draw(st.integers(0, runs))
    standard = np.where(np.arange(runs) < inside, 0.0, 99.0)[:, None]
    expected = proportion_confint(inside, runs, 0.05, "beta")
    for coverage in coverage_of(standard[:, None], single=True):
        assert coverage.fraction == pytest.approx(inside / runs)
        np.testing.assert_allclose([coverage.lower, coverage.upper], expected, atol=1e-12)


def test_chi_square_ratio_of_known_values():
    ratio = chi_square_ratio(np.array([3.0, 1.0, 5.0]), 3)
    assert ratio.value == 1.0
    np.testing.assert_allclose(
        [ratio.lower, ratio.upper], chi2.interval(0.95, 9) / np.array(9.0), rtol=1e-12
    )
    assert chi_square_ratio(np.array([chi2.isf(1e-3, 2)]), 2).p_value == pytest.approx(2e-3)
    assert chi_square_ratio(np.array([chi2.ppf(1e-3, 2)]), 2).p_value == pytest.approx(2e-3)


def test_innovations():
    rng = np.random.default_rng(10)
    draws = 300
    found = [innovation_test(synthetic(rng, 10)) for _ in range(draws)]
    assert least(draws, 0.95) <= np.mean([each.nis.within for each in found]) <= most(draws, 0.95)
    small = np.mean([each.whiteness < 0.05 for each in found])
    assert least(draws, 0.05) <= small <= most(draws, 0.05)
    coloured = replace(synthetic(rng, 10), whiteness=np.full(10, 2.0))
    assert innovation_test(coloured).whiteness < 1e-9


# ---- Degenerate sizes ----


def assert_unknown(found: Consistency):
    assert not found.consistent
    for name in GROUPS:
        assert np.isnan(found.nees[name].value)
        assert not found.nees[name].within
        assert np.isnan(found.rms[name])
        assert np.isnan(found.score[name])
        assert all(np.isnan(each.fraction) and not each.within for each in found.coverage[name])


@pytest.mark.parametrize("judge", [lambda runs: at_epoch(runs, 1), over_time])
def test_nothing_is_claimed_where_every_run_diverged(judge):
    runs = diverged(synthetic(np.random.default_rng(11), 4, 3), slice(None))
    assert runs.diverged == 4
    assert_unknown(judge(runs))


def test_runs_that_diverged_are_left_out():
    runs = synthetic(np.random.default_rng(13), 30, 4)
    some = diverged(runs, [3, 17])
    others = np.delete(np.arange(30), [3, 17])
    kept = replace(
        runs,
        **{
            key: getattr(runs, key)[others]
            for key in ("error", "sd", "nees", "log_det", "sensor_error", "sensor_sd")
        },
        sensor_nees=runs.sensor_nees[others],
    )
    assert some.diverged == 2
    assert at_epoch(some, 2) == at_epoch(kept, 2)
    assert over_time(some) == over_time(kept)
    # Before they diverged, they count.
    assert at_epoch(some, 0) == at_epoch(runs, 0)


def test_one_run_has_bands_at_an_epoch_but_none_over_time():
    runs = synthetic(np.random.default_rng(14), 1, 5)
    nees = at_epoch(runs, 2).nees["position"]
    np.testing.assert_allclose([nees.lower, nees.upper], chi2.interval(0.95, 3) / np.array(3.0))
    found = over_time(runs)
    assert np.isfinite(found.nees["position"].value)
    assert np.isnan(found.nees["position"].upper)
    assert found.coverage["position"][0].lower < found.coverage["position"][0].upper


def test_sensors_without_states_do_not_count():
    runs = synthetic(np.random.default_rng(15), 200, 3)
    none = replace(
        runs, sensor_sd=np.zeros_like(runs.sensor_sd), sensor_nees=np.full((200, 3), np.nan)
    )
    for found in (at_epoch(none, 1), over_time(none)):
        assert "sensors" not in found.nees
        assert "sensors" not in found.coverage
        assert found.consistent
    # Accelerometers without states: three degrees of freedom.
    sd = runs.sensor_sd.copy()
    sd[..., 3:] = 0.0
    error = np.where(np.arange(6) < 3, np.random.default_rng(16).standard_normal(sd.shape), 5.0)
    half = replace(
        runs,
        sensor_sd=sd,
        sensor_error=error * np.where(sd > 0.0, sd, 1.0),
        sensor_nees=np.sum(error[..., :3] ** 2, axis=-1),
    )
    for found in (at_epoch(half, 1), over_time(half)):
        assert found.nees["sensors"].value == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 600))
        assert found.coverage["sensors"][2].fraction == pytest.approx(0.95, abs=0.04)


def test_mean_ratio_of_few_values():
    assert np.isnan(mean_ratio(np.zeros(0)).value)
    assert np.isnan(mean_ratio(np.array([1.3])).p_value)
    assert mean_ratio(np.array([0.9, 1.1])).p_value == pytest.approx(1.0)
