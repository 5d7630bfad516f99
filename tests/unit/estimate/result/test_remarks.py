"""What is said of a fit, on either side of where it begins to be said; matrices made by hand."""

import numpy as np
import pytest
from scipy import stats

import gmwm
from gmwm import GaussMarkov, LowPassNoise, RandomWalk, Resonance, WhiteNoise, wavelet_variance
from gmwm.estimate import tuning
from gmwm.estimate.result.conclusion import estimate_notices, misfit_notices, missed_level_notices
from gmwm.estimate.result.goodness import Goodness
from gmwm.process import as_model

DT = 0.01
WV = wavelet_variance(WhiteNoise(1.0).simulate(256, DT, 1), dt=DT)
TWO = WhiteNoise(1.0) + GaussMarkov(1.0, 10.0) + GaussMarkov(1.0, 20.0)
TAUS = ("tau_1", "tau_2")


def reported(code, model, keys, covariance, upper=()):
    notices = estimate_notices(as_model(model), keys, covariance, dict(upper), WV)[0]
    return [notice for notice in notices if notice.code == code]


def bandwidth_notices(model):
    return estimate_notices(as_model(model), (), np.zeros((0, 0)), {}, WV)[1]


def matrix(*errors, correlation=0.0):
    result = np.outer(errors, errors) * correlation
    np.fill_diagonal(result, np.square(errors))
    return result


@pytest.mark.parametrize(
    ("ratio", "error", "correlation", "found"),
    [
        # The error of the logarithm is hypot(e, e); 1.96 of it is the limit.
        (2.0, 0.99 * np.log(2.0) / 1.96 / np.sqrt(2.0), 0.0, False),
        (2.0, 1.01 * np.log(2.0) / 1.96 / np.sqrt(2.0), 0.0, True),
        (2.0, 1.01 * np.log(2.0) / 1.96 / np.sqrt(2.0), 0.5, False),
        (2.0, 0.8 * np.log(2.0) / 1.96 / np.sqrt(2.0), -0.9, True),
        (1.06, 1e-6, 0.0, False),
        (1.04, 1e-6, 0.0, True),
    ],
)
def test_terms_whose_times_do_not_differ(ratio, error, correlation, found):
    model = WhiteNoise(1.0) + GaussMarkov(1.0, 10.0) + GaussMarkov(1.0, 10.0 * ratio)
    covariance = matrix(10.0 * error, 10.0 * ratio * error, correlation=correlation)
    notices = reported("indistinct-terms", model, TAUS, covariance)
    assert len(notices) == found
    for notice in notices:
        assert (notice.where, notice.severity) == ("tau_2", "bad")
        assert notice.values["tau_1"] == 10.0
    assert reported("indistinct-terms", model, TAUS[:1], covariance[:1, :1]) == []


@pytest.mark.parametrize(
    ("correlation", "loose", "found"),
    [(0.9991, 0.11, 1), (-0.9991, 0.11, 1), (0.9989, 0.11, 0), (0.9991, 0.09, 0)],
)
def test_parameters_of_which_one_combination_is_known(correlation, loose, found):
    model = WhiteNoise(2.0) + RandomWalk(3.0)
    notices = reported(
        "confounded", model, ("N", "K"), matrix(0.5, 3.0 * loose, correlation=correlation)
    )
    assert len(notices) == found
    for notice in notices:
        assert notice.where == "K"
        assert notice.values == {"other": "N", "correlation": pytest.approx(correlation)}
    assert reported("confounded", model, ("N", "K"), matrix(0.0, 1.0)) == []
    assert reported("confounded", model, ("N", "K"), matrix(1.0, 0.0)) == []


def test_the_most_correlated_parameters_stand_for_their_term():
    """An ARMA(3, 2) had fifteen notices of its pairs."""
    model, keys = as_model(gmwm.ARMA([0.5, 0.2], [0.3], 1.0)), ("ar_1", "ar_2", "ma_1", "sigma2")
    share = np.array([1.0, -1.0, 1.0, 1.0])
    covariance = np.outer(share, share) + np.diag([1e-5, 2e-5, 3e-5, 4e-5])
    (notice,) = reported("confounded", model, keys, covariance)
    assert (notice.where, notice.values["other"]) == ("ar_2", "ar_1")


@pytest.mark.parametrize(("error", "found"), [(9.9, []), (10.1, ["tau_1"]), (21.0, [*TAUS])])
def test_shapes_that_are_not_determined(error, found):
    notices = reported("undetermined", TWO, ("N", *TAUS), matrix(50.0, error, error))
    assert [notice.where for notice in notices] == found
    assert all(notice.values == {"stderr": pytest.approx(error)} for notice in notices)


def test_bounds_are_named_by_their_parameter():
    (notice,) = reported("amplitude-bound", TWO, (), np.zeros((0, 0)), {"K": 0.5})
    assert (notice.where, notice.values) == ("K", {"upper": 0.5})


def goodness(residual, misfit=0.01, tau=None, allowed=None, **options):
    residual = np.asarray(residual, dtype=float)
    size = residual.size
    misfit = np.broadcast_to(np.asarray(misfit, dtype=float), size).copy()
    tau = 2.0 ** np.arange(size) if tau is None else np.asarray(tau)
    return Goodness(
        tau, 1.0 + misfit, np.ones(size), misfit, residual,
        residual if allowed is None else np.asarray(allowed), np.geomspace(3000.0, 2.0, size),
        **options,
    )  # fmt: skip


def test_the_largest_residual_has_the_probability_of_the_largest_of_so_many():
    found = goodness([0.3, -3.3, np.nan, 1.0, 2.0])
    assert found.largest == (-3.3, 2.0)
    one = 2.0 * stats.norm.sf(3.3)
    assert found.largest_p == pytest.approx(1.0 - (1.0 - one) ** 4)
    nothing = goodness([np.nan, np.nan])
    assert nothing.largest is None and np.isnan(nothing.largest_p)
    assert goodness([9.0], is_tested=False).largest is None


@pytest.mark.parametrize(
    ("p", "excluded", "misses"),
    [(0.0009, True, True), (0.0011, False, True), (0.0099, False, True), (0.011, False, False)],
)
def test_levels_that_few_right_models_miss(p, excluded, misses):
    size = 6
    one = -np.expm1(np.log1p(-p) / size)
    found = goodness([0.0] * (size - 1) + [stats.norm.isf(0.5 * one)], misfit=0.05)
    assert found.largest_p == pytest.approx(p)
    assert (found.is_excluded, found.misses_a_level) == (excluded, misses)
    assert found.missed.tolist() == [False] * (size - 1) + [misses]
    right = goodness([0.1] * size)
    assert found.loses_to(right) is misses and not right.loses_to(found)
    assert not found.loses_to(found)
    notices = missed_level_notices(found)
    assert len(notices) == excluded
    for notice in notices:
        assert notice.values["tau"] == 2.0 ** (size - 1)
        assert notice.values["p_value"] == pytest.approx(p) and "above the model" in notice.text
        (below,) = missed_level_notices(goodness(-found.residual, misfit=0.05))
        assert "below the model" in below.text


def test_a_level_that_both_models_miss_by_chance_decides_nothing():
    """At 1.28 s by 3.8 errors, and N alone lies by that much lower there: K was not needed."""
    without, both = goodness([0.0, 2.5, 0.0, 3.9]), goodness([0.0, 3.5, 0.0, 1.0])
    assert without.loses_to(both)
    assert not without.loses_to(goodness([0.0, 4.5, 0.0, 1.0]))  # which is excluded


@pytest.mark.parametrize(
    ("residual", "misfit", "beyond", "poor"),
    [
        ([0.0, 2.6, 2.7], [0.3, 0.09, 0.05], (0.09, 2.0, 2.6), False),
        ([0.0, 2.6, -2.7], [0.3, 0.05, -0.11], (-0.11, 4.0, -2.7), True),
        ([0.0, 2.4, -2.4], [0.3, 0.3, -0.3], None, False),
    ],
)
def test_misfits_that_are_no_chance(residual, misfit, beyond, poor):
    found = goodness(residual, misfit)
    assert found.beyond_chance == beyond
    assert found.is_poor is poor and (not poor or found.misses_a_level)
    assert goodness(residual, misfit, is_tested=False).beyond_chance is None


@pytest.mark.parametrize(
    ("first", "finest"), [(0.001, 0.1), (0.0099, 0.1), (0.02, 0.2), (1.0, 10.0)]
)
def test_finest_levels_are_judged_with_what_is_allowed(first, finest):
    tau = first * 2.0 ** np.arange(12)
    found = goodness(np.full(12, 5.0), tau=tau, allowed=np.full(12, 1.0))
    np.testing.assert_array_equal(found.judged, np.where(tau < finest, 1.0, 5.0))


def test_the_worst_is_among_levels_that_are_known_well():
    found = goodness([0.0] * 7, [0.0, -0.2, 0.1, 0.0, 0.4, 0.0, 0.0])
    known = found.dof > tuning.WELL_KNOWN_DOF
    assert known.tolist() == [True] * 4 + [False] * 3
    assert found.worst == (-0.2, 2.0)
    assert found.known_to == 8.0
    assert "20 % of the deviation at tau = 2 s" in found.sentence
    few = goodness([0.0])
    few.dof[:] = 30.0
    assert few.worst is None and np.isnan(few.known_to) and few.sentence == ""


@pytest.mark.parametrize(
    ("residual", "misfit", "failed", "severity", "words"),
    [
        ([0.0, 2.6], 0.11, False, "note", "may be chance"),
        ([0.0, 2.6], 0.11, True, "bad", "over 2 s are too small: there the data lie 11 %"),
        ([0.0, -2.6], -0.11, True, "bad", "too large: there the data lie 11 % below"),
        ([0.0, 3.5], 0.11, False, "bad", "by 3.5 standard errors"),
        ([0.0, 2.6], 0.09, True, "note", "within 9 % of the Allan deviation"),
    ],
)
def test_what_a_misfit_means(residual, misfit, failed, severity, words):
    residual, misfits = (np.pad(each, (0, 6)) for each in (residual, [0.0, misfit]))
    found = goodness(residual, misfits)
    (notice,) = misfit_notices(found, 0.0, failed=failed)
    assert notice.severity == severity and words in notice.text
    assert notice.values["misfit"] == misfit and notice.values["tau"] == 2.0
    (allowed,) = misfit_notices(found, 0.03, failed=failed)
    assert ("intervals allow for" in allowed.text) is (abs(misfit) < 0.1)
    assert misfit_notices(goodness([0.0, 1.0]), 0.0, failed=failed) == []


@pytest.mark.parametrize(
    ("process", "bandwidth"),
    [
        (LowPassNoise(0.3, 12.0, 2.0, 0.7), 12.0),
        (LowPassNoise(0.3, 5.0, 4.0, 0.9), 5.0),
        (gmwm.AveragedNoise(0.3, 0.1), 4.43),  # sinc is 0.7071 at 0.443
        (GaussMarkov(1.0, 0.09), 1.0 / (2.0 * np.pi * 0.09)),
    ],
)
def test_the_bandwidth_of_the_sensor_is_named(process, bandwidth):
    (notice,) = bandwidth_notices(process + RandomWalk(1e-3))
    assert notice.values["bandwidth"] == pytest.approx(bandwidth, rel=0.02)
    density = getattr(process, "N", np.sqrt(2.0 * 0.09))
    assert notice.values["density"] == pytest.approx(density, rel=0.01)


def test_a_process_is_no_filter_beside_white_noise_or_if_it_is_slow():
    fast, slow = GaussMarkov(1.0, 0.099), GaussMarkov(1.0, 0.101)
    assert len(bandwidth_notices(fast)) == 1
    assert bandwidth_notices(slow) == []
    assert bandwidth_notices(fast + WhiteNoise(1.0)) == []
    assert bandwidth_notices(Resonance(1.0, 3.0, 0.1)) == []
    both = bandwidth_notices(LowPassNoise(0.3, 12.0, 2.0, 0.7) + WhiteNoise(1.0))
    assert len(both) == 1
