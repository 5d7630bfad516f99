"""How units differ: what is compared, who stands apart, what could be promised."""

import numpy as np
import pytest

from gmwm.population import Number, Spread, outlier_distance
from gmwm.population.spread import spreads_of
from gmwm.population.unit import Structure

LEVEL = 0.01


def spread(values, parameter="N", errors=0.0, found=True):
    n = len(values)
    return Spread(
        "gyro_x", "gyro", parameter, tuple(f"unit-{i}" for i in range(n)),
        np.asarray(values, dtype=float), np.where(found, errors, np.nan) + np.zeros(n),
        np.zeros(n, dtype=bool) | found, LEVEL,
    )  # fmt: skip


def lot(n, seed=1, size=0.1):
    return np.exp(size * np.random.default_rng(seed).standard_normal(n))


def test_numbers_of_valid_units_are_compared_and_limits_count_as_values():
    known, limit = Number(2.0, 0.1, 1.8, 2.2), Number(None, None, 0.0, 3.0)
    open_end = Number(None, None, 0.0, np.inf)
    numbers = {
        "a": {"N": known, "B": limit, "K": limit},
        "b": {"N": known, "B": known, "K": open_end},
        "c": {"N": known, "B": known, "K": known},
    }
    structure = Structure("gyro_x", "gyro", "white noise", {}, (), ("c",), numbers)
    found = {each.parameter: each for each in spreads_of([structure])}
    assert list(found) == ["N", "B", "K"]
    assert found["N"].devices == ("a", "b")
    assert found["B"].values.tolist() == [3.0, 2.0]
    assert found["B"].found.tolist() == [False, True]
    assert found["N"].errors[0] == pytest.approx(np.log(2.2 / 1.8) / 3.92)
    assert found["K"].devices == ("a",)
    assert found["K"].is_limit and not found["N"].is_limit


def test_a_unit_apart_is_named_with_its_value():
    values = lot(12)
    values[7] *= 4.0
    (found,) = spread(values).outliers
    assert (found.device, found.value) == ("unit-7", values[7])
    assert found.distance > outlier_distance(12, LEVEL)
    assert spread(values[4:8]).outliers == ()  # of four units, who is odd?


def test_the_error_of_a_unit_excuses_it():
    values, errors = lot(12), np.full(12, 0.05)
    values[7] *= 4.0
    errors[7] = 1.0
    assert spread(values, errors=errors).outliers == ()
    # Nor is a lot narrower than what is known of its units.
    assert spread(lot(12, size=1e-3), errors=0.1).outliers == ()


def test_a_limit_is_apart_only_where_it_contradicts():
    values, found = lot(20), np.arange(20) != 3
    errors = np.full(20, 0.1)
    for factor, names in ((5.0, []), (1.0, []), (0.7, []), (0.1, ["unit-3"])):
        changed = np.where(found, values, factor)
        each = spread(changed, "K", errors, found)
        assert [unit.device for unit in each.outliers] == names


def test_a_unit_above_the_limits_of_the_others_is_found():
    found = np.arange(10) == 3
    values = np.where(found, 8.0, lot(10))
    (outlier,) = spread(values, "K", 0.1, found).outliers
    assert (outlier.device, outlier.found) == ("unit-3", True)


@pytest.mark.parametrize("n", [5, 10, 40])
@pytest.mark.parametrize("error", [0.0, 1.0])
def test_equal_units_have_an_outlier_as_often_as_the_level_says(n, error):
    rng = np.random.default_rng([2, n])
    runs = 1500
    made = rng.standard_normal((runs, n))
    named = sum(bool(spread(np.exp(0.1 * x), errors=0.1 * error).outliers) for x in made)
    if error:
        assert named / runs < LEVEL + 4.0 * np.sqrt(LEVEL / runs)
    else:
        assert abs(named / runs - LEVEL) < 4.0 * np.sqrt(LEVEL * (1.0 - LEVEL) / runs)


def test_a_single_unit_and_equal_ones_promise_nothing_more():
    alone, equal = spread([2.0]), spread([2.0] * 8)
    assert np.isnan([alone.sd, alone.normal_limit]).all()
    assert equal.normal_limit == pytest.approx(2.0)
    assert equal.outliers == () == alone.outliers
    assert np.isnan(equal.of_estimation)
    assert alone.free_limit is None


def test_a_limit_without_a_distribution_is_a_value():
    values = np.random.default_rng(3).permutation(np.arange(1.0, 101.0))
    assert spread(values).free_limit == 99.0


def test_errors_of_estimation_are_a_fraction_of_the_variance():
    found = spread(lot(400, 5, 0.2), errors=0.1)
    assert found.of_estimation == pytest.approx(0.25, rel=0.3)
