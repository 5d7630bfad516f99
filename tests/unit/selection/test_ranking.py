"""Prices of parameters and of a ramp: what they promise, not how they are computed."""

import numpy as np
import pytest

import gmwm
from gmwm import RandomWalk, RateRamp, WhiteNoise
from gmwm.selection.ranking import Candidate, rank_key

PLAIN = WhiteNoise() + RandomWalk()
RAMPED = WhiteNoise() + RateRamp()


def candidate(model, criterion):
    return Candidate(model, criterion, criterion, criterion, 2, 8)


@pytest.mark.parametrize(("lead", "ramp_wins"), [(5.5, False), (6.5, True)])
def test_a_ramp_wins_by_six_or_not_at_all(lead, ramp_wins):
    both = [candidate(PLAIN, 20.0), candidate(RAMPED, 20.0 - lead)]
    assert (min(both, key=rank_key).model == RAMPED) is ramp_wins


@pytest.mark.parametrize("n", [1000, 50_000])
def test_each_parameter_costs_three_times_the_logarithm_of_the_logarithm(n):
    x = PLAIN.with_params({"N": 1.0, "K": 0.02}).simulate(n, 1.0, 2)
    selection = gmwm.select(x + np.arange(n) * 30.0 / n, dt=1.0)
    assert any("ramp" in item.model.title() for item in selection)
    for item in selection:
        price = (item.criterion - item.chi_square) / item.n_parameters
        assert price == pytest.approx(3.0 * np.log(np.log(n)))
