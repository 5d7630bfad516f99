"""One structure for a lot: chosen jointly, fitted to every unit, rejected by some."""

from dataclasses import replace

import numpy as np
import pytest

from gmwm import GaussMarkov, RandomWalk, Sinusoid, WhiteNoise
from gmwm.calibration import axis_numbers
from gmwm.estimate import estimate
from gmwm.issues import Notice
from gmwm.population import unit
from gmwm.population.spread import spreads_of
from gmwm.population.unit import Choice

TRUTH = WhiteNoise(1.0) + GaussMarkov(2.0, 0.5)
N, DT = 12_000, 0.01


def fitted(truth, seed, model=None):
    return estimate(model or truth.opened(), truth.simulate(N, DT, seed), DT)


def chosen(fits, is_given=False):
    return Choice({"gyro_x": fits}, is_given)("gyro_x")


@pytest.fixture(scope="module")
def lot():
    """Of two units a larger model was selected, which their data do not need."""
    more = WhiteNoise() + 2 * GaussMarkov()
    return {f"u{i}": fitted(TRUTH, i, more if i < 2 else None) for i in range(5)}


def test_units_with_another_selection_get_the_model_of_the_lot(lot):
    found = chosen(lot)
    assert found.model == "white noise + Gauss-Markov"
    assert list(found.counts) == ["white noise + Gauss-Markov", "white noise + 2 Gauss-Markov"]
    assert (found.own, found.invalid) == ((), ())
    own = axis_numbers(lot["u4"])
    assert found.numbers["u4"]["N"].value == pytest.approx(own.N.value, rel=1e-3)
    assert spreads_of([found])[0].sd < 0.03
    assert all(each.outliers == () for each in spreads_of([found]))


def test_the_unit_that_prevents_a_structure_is_named(lot, monkeypatch):
    usual = unit.estimate
    monkeypatch.setattr(unit, "estimate", lambda m, wv: 1 / 0 if wv is odd else usual(m, wv))
    odd = lot["u3"].wv
    found = Choice({"gyro_x": lot}, is_given=False).attempt("gyro_x")
    assert (found.code, found.where) == ("unexpected", "u3")
    assert found.text == "ZeroDivisionError: division by zero"


def test_a_unit_that_contradicts_the_model_keeps_its_own_numbers(lot):
    odd = fitted(WhiteNoise(1.0) + GaussMarkov(2.0, 0.5) + GaussMarkov(4.0, 20.0), 50)
    found = chosen(lot | {"odd": odd})
    assert found.model == "white noise + Gauss-Markov"
    assert found.own == ("odd",)
    assert found.numbers["odd"]["N"].value == axis_numbers(odd).N.value


def test_a_term_that_every_unit_needs_is_in_the_model():
    truth = TRUTH + RandomWalk(0.6)
    lot = {f"u{i}": fitted(truth, i, TRUTH.opened() if i < 2 else None) for i in range(5)}
    found = chosen(lot)
    assert found.model == "white noise + random walk + Gauss-Markov"
    assert sum(own["K"].value is not None for own in found.numbers.values()) >= 3


def test_a_unit_with_a_fault_is_not_valid_and_counts_for_nothing(lot):
    step = Notice("step", "bad", "", "a step")
    faulty = replace(fitted(WhiteNoise(2.0) + RandomWalk(9.0), 60), notices=(step,))
    found = chosen(lot | {"faulty": faulty})
    assert found.invalid == ("faulty",)
    assert "faulty" in found.numbers and "faulty" not in found.usable
    assert spreads_of([found])[0].n == len(lot)
    alone = chosen({"faulty": faulty})
    assert (alone.model, alone.invalid, spreads_of([alone])) == ("", ("faulty",), ())


def test_a_line_stays_with_its_unit(lot):
    line = Sinusoid(amplitude=3.0, frequency=3.0)
    model = WhiteNoise() + GaussMarkov() + Sinusoid(frequency=3.0)
    found = chosen(lot | {"shaken": fitted(TRUTH + line, 70, model)})
    assert found.model == "white noise + Gauss-Markov"
    assert (found.own, found.invalid) == ((), ())
    assert found.numbers["shaken"]["N"].value == pytest.approx(1.0, rel=0.05)


def test_given_models_are_kept():
    fits = {f"u{i}": fitted(TRUTH, i, WhiteNoise() + GaussMarkov()) for i in range(2)}
    found = chosen(fits, is_given=True)
    assert (found.model, found.own) == ("white noise + Gauss-Markov", ())
    assert found.numbers["u1"]["N"].value == axis_numbers(fits["u1"]).N.value
    assert np.isfinite(found.numbers["u1"]["N"].error)
