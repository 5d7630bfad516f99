"""What candidates are made of, what they cost, and which of them is chosen."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import LowPassNoise, QuantizationNoise, RandomWalk, RateRamp, Sinusoid, WhiteNoise
from gmwm.process import as_model
from gmwm.selection.bandwidth import Bandwidth
from gmwm.selection.ranking import Candidate, Choices, candidate_of, rank_key
from gmwm.selection.select import _SHOWN, Selection, _simplest_of_ties

FILTER = Bandwidth(
    LowPassNoise(bandwidth=20.0, order=2.0, damping=0.7), LowPassNoise(order=2.0, damping=0.7), 2
)


def candidate(criterion, size=2, model=None):
    model = as_model(WhiteNoise()) if model is None else model
    return Candidate(model, criterion, criterion, criterion, size, 8)


@pytest.mark.parametrize("most", [-1, 6, 2.5, "2", None, True])
def test_a_number_of_terms_that_none_is(most):
    with pytest.raises(gmwm.InputError, match="from 0 to 5"):
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
    rows = [line.split()[-3:] for line in str(selection).splitlines()[1:]]
    assert [float(row[0]) for row in rows] == pytest.approx([1.9, 0.0, 1.0, 2.1])  # chosen first
    assert str(selection).count("fits equally well") == 2
    assert "- chosen: simpler" in str(replace(selection, chosen=ranking[3]))


def test_more_candidates_than_are_shown_are_counted():
    fit = gmwm.fit(WhiteNoise(), WhiteNoise(1.0).simulate(100, 1.0, 1), dt=1.0)
    for extra in (0, 1, 3):
        ranking = tuple(candidate(5.0 * k) for k in range(_SHOWN + extra))
        text = str(Selection(ranking, ranking[0], fit))
        assert (f"{extra} more models" in text) is (extra > 0)
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


PLAIN = WhiteNoise() + RandomWalk()
RAMPED = WhiteNoise() + RateRamp()


@pytest.mark.parametrize(("lead", "ramp_wins"), [(5.5, False), (6.5, True)])
def test_a_ramp_wins_by_six_or_not_at_all(lead, ramp_wins):
    both = [candidate(20.0, model=PLAIN), candidate(20.0 - lead, model=RAMPED)]
    assert (min(both, key=rank_key).model == RAMPED) is ramp_wins


@pytest.mark.parametrize("n", [1000, 50_000])
def test_each_parameter_costs_three_times_the_logarithm_of_the_logarithm(n):
    x = PLAIN.with_params({"N": 1.0, "K": 0.02}).simulate(n, 1.0, 2)
    selection = gmwm.select(x + np.arange(n) * 30.0 / n, dt=1.0)
    assert any("ramp" in item.model.title() for item in selection)
    for item in selection:
        price = (item.criterion - item.chi_square) / item.n_parameters
        assert price == pytest.approx(3.0 * np.log(np.log(n)))
