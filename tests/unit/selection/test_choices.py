"""What candidates are made of, what they cost, and which of them is chosen."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import (
    AveragedNoise,
    GaussMarkov,
    InputError,
    LowPassNoise,
    QuantizationNoise,
    RandomWalk,
    Sinusoid,
    WhiteNoise,
)
from gmwm.estimate.moments import dictionary_fit
from gmwm.process import as_model
from gmwm.selection import tuning
from gmwm.selection.bandwidth import Bandwidth, _Beside
from gmwm.selection.ranking import Candidate, Choices, candidate_of
from gmwm.selection.select import _SHOWN, Selection, _simplest_of_ties

FILTER = Bandwidth(
    LowPassNoise(bandwidth=20.0, order=2.0, damping=0.7), LowPassNoise(order=2.0, damping=0.7), 2
)


def candidate(criterion, size=2, model=None):
    model = as_model(WhiteNoise()) if model is None else model
    return Candidate(model, criterion, criterion, criterion, size, 8)


@pytest.mark.parametrize("most", [-1, 6, 2.5, "2", None, True])
def test_a_number_of_terms_that_none_is(most):
    with pytest.raises(InputError, match="from 0 to 5"):
        Choices(most)


@pytest.mark.parametrize("most", [0, 5])
def test_the_least_and_the_most_terms(most):
    assert Choices(most).max_gauss_markov == most


def test_candidates_are_all_sums_of_what_has_a_shape():
    line = Sinusoid(frequency=0.1)
    kinds = [WhiteNoise(), QuantizationNoise(), RandomWalk(), line]
    found = list(Choices(extra=(line,)).bases())
    assert len(found) == len({frozenset(each) for each in found}) == 16
    assert found[0] == () and set(found[-1]) == set(kinds)
    filtered = list(Choices(extra=(line,), bandwidth=FILTER).bases())
    assert filtered == [(*each, FILTER.given) for each in found]
    assert Choices(extra=(line,), bandwidth=FILTER).given == (line, FILTER.given)
    assert Choices(extra=(line,)).given == (line,)


def test_the_shape_of_a_low_pass_has_the_price_of_its_parameters():
    plain = candidate(20.0)
    choices = Choices(bandwidth=FILTER)
    assert choices.opened(plain, 1000) is plain
    assert Choices().opened(plain, 1000) is plain
    given = replace(plain, model=FILTER.given + RandomWalk())
    found = choices.opened(given, 1000)
    assert found.model == FILTER.free + RandomWalk()
    assert found.criterion == pytest.approx(20.0 + 2 * 3.0 * np.log(np.log(1000)))
    assert (found.n_parameters, found.dof) == (4, 6)
    assert (found.chi_square, found.objective) == (20.0, 20.0)


def test_a_probability_needs_degrees_of_freedom():
    assert np.isnan(replace(candidate(3.0), dof=0).p_value)
    # Of one degree of freedom, 3.8415 is exceeded with a chance of 5 %.
    assert replace(candidate(3.8415), dof=1).p_value == pytest.approx(0.05, rel=1e-3)


def test_the_smallest_of_those_within_two_comes_first_and_the_rest_stays():
    ranking = [candidate(1.0, 4), candidate(2.0, 3), candidate(2.9, 2), candidate(3.1, 1)]
    order = [item.n_parameters for item in _simplest_of_ties(ranking)]
    assert order == [2, 3, 4, 1]
    fit = gmwm.fit(WhiteNoise(), WhiteNoise(1.0).simulate(100, 1.0, 1), dt=1.0)
    selection = Selection(tuple(ranking), ranking[2], fit)
    assert selection.ties == tuple(ranking[:3])
    assert replace(selection, ranking=(candidate(1.0), candidate(3.0))).ties[1].criterion == 3.0
    lines = str(selection).splitlines()
    assert [line[:2] for line in lines[1:5]] == [" =", " =", ">=", "  "]
    assert [float(line[2:12]) for line in lines[1:5]] == pytest.approx([0.0, 1.0, 1.9, 2.1])
    assert "fit equally well" in lines[5] and len(lines) == 6
    other = str(replace(selection, chosen=ranking[3]))
    assert "chosen: simpler" in other and "> " in other


def test_more_candidates_than_are_shown_are_counted():
    fit = gmwm.fit(WhiteNoise(), WhiteNoise(1.0).simulate(100, 1.0, 1), dt=1.0)
    for extra in (0, 1, 3):
        ranking = tuple(candidate(5.0 * k) for k in range(_SHOWN + extra))
        text = str(Selection(ranking, ranking[0], fit))
        assert (f"and {extra} more" in text) is (extra > 0)
        assert text.count("white noise") == _SHOWN
        assert "equally" not in text


def test_a_candidate_of_a_fit_has_its_statistic_and_price():
    x = (WhiteNoise(1.0) + RandomWalk(0.02)).simulate(2000, 1.0, 1)
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), x, dt=1.0)
    found = candidate_of(fit)
    assert found.model == WhiteNoise() + RandomWalk()
    assert (found.n_parameters, found.dof) == (2, fit.dof)
    assert found.chi_square == fit.chi_square_allowed > 0.0
    price = 2 * 3.0 * np.log(np.log(2000))
    assert found.criterion == pytest.approx(fit.chi_square_allowed + price)
    for dof, statistic in ((1, fit.chi_square_allowed), (0, 0.0)):
        assert candidate_of(replace(fit, dof=dof)).chi_square == statistic


# -- the sensor's low-pass ------------------------------------------------------------------------

DT = 0.01


@pytest.fixture(scope="module")
def averaged():
    """Wavelet variances of a moving average of 30 samples, and the covariance of their fit."""
    rng = np.random.default_rng(3)
    x = np.convolve(rng.normal(size=40_000), np.ones(30) / 30, "valid")
    wv = gmwm.wavelet_variance(x, dt=DT)
    return wv, dictionary_fit(wv, wv.variance, ()).covariance


def test_the_best_window_is_the_best_of_all(averaged):
    problem = _Beside.of(averaged[0], (), averaged[1], tuning.FILTER_LIKE)
    found, objective = problem.best(AveragedNoise())
    curve = problem.scales.unit_curves(AveragedNoise())
    each = problem.squares(np.stack([curve((m * DT,)) for m in range(2, 60)], axis=1))
    assert objective == pytest.approx(np.min(each))
    assert found.given.window == pytest.approx(DT * (2 + int(np.argmin(each))))
    assert found.given.window == pytest.approx(30 * DT, abs=2 * DT)
    assert (found.free, found.n_shapes) == (found.given, 1)


@pytest.mark.parametrize(("start", "first", "last"), [(2, 2, 4), (27, 23, 31), (33, 28, 38)])
def test_windows_up_to_an_eighth_and_one_away_are_tried(averaged, monkeypatch, start, first, last):
    problem = _Beside.of(averaged[0], (), averaged[1], tuning.FILTER_LIKE)
    for sign, expected in ((1.0, first), (-1.0, last)):
        monkeypatch.setattr(
            _Beside, "squares", lambda _, curves, sign=sign: sign * np.arange(curves.shape[1])
        )
        found, _ = problem._whole_window(AveragedNoise(), (start * DT,))
        assert found.given.window == pytest.approx(expected * DT)


def test_processes_as_fast_as_a_filter_and_a_kind_are_left_out(averaged):
    whole = _Beside.of(averaged[0], (), averaged[1], fastest=0.0)
    slow = _Beside.of(averaged[0], (), averaged[1], fastest=5.0)
    without = _Beside.of(averaged[0], (), averaged[1], 0.0, QuantizationNoise)
    assert without.curves.shape[1] == whole.curves.shape[1] - 1
    gone = [c for c in whole.curves.T if not np.any(np.all(c == slow.curves.T, axis=1))]
    assert gone
    tau = averaged[0].tau
    fast = max(t for t in GaussMarkov().shape_grid(DT, averaged[0].n) if t[0] < 5 * DT)
    next_one = min(t for t in GaussMarkov().shape_grid(DT, averaged[0].n) if t[0] >= 5 * DT)
    for shape, kept in ((fast, False), (next_one, True)):
        curve = GaussMarkov().unit_haar_variance(shape, tau, DT)
        assert np.any(np.all(np.isclose(slow.curves.T, curve, rtol=1e-6), axis=1)) == kept
    assert whole.objective <= slow.objective
