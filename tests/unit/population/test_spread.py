"""How units differ: what is compared, who stands apart, what could be promised."""

import numpy as np
import pytest

from gmwm.population import SCHEMA, Spread, outlier_distance, spreads_of, structures_of


def row(device, parameter, value, kind="estimated", **more):
    usual = dict.fromkeys(SCHEMA.names) | {
        "device": device, "channel": "gyro_x", "quantity": "gyro", "model": "white noise",
        "parameter": parameter, "kind": kind, "value": value, "unit": "rad/s", "valid": True,
    }  # fmt: skip
    return usual | more


def spread(values, parameter="filter_N", **more):
    n = len(values)
    usual = {
        "channel": "gyro_x", "quantity": "gyro", "parameter": parameter, "of": 1, "unit": "rad/s",
        "devices": tuple(f"unit-{i}" for i in range(n)), "values": np.asarray(values, dtype=float),
        "stderr": np.full(n, np.nan), "found": np.ones(n, dtype=bool), "without": 0,
    }  # fmt: skip
    return Spread(**(usual | more))


def test_only_models_with_equally_many_terms_are_compared():
    rows = [row("a", "tau", 1.0), row("b", "tau", 2.0), row("a", "N", 5.0), row("b", "N", 6.0)]
    for device, value in (("c", 3.0), ("d", 4.0)):
        rows += [row(device, f"tau_{i}", value * i) for i in (1, 2)]
    found = {(each.parameter, each.of): each for each in spreads_of(rows)}
    assert found["tau", 1].devices == ("a", "b")
    assert found["tau_1", 2].values.tolist() == [3.0, 4.0]
    assert found["tau_2", 2].without == 2
    assert found["N", 1].without == 2


def test_what_is_not_valid_or_not_found_is_no_value():
    """But an upper bound of a number that every unit has counts as that."""
    rows = [
        row("a", "K", 1.0), row("b", "K", None, "bound", upper=9.0),
        row("c", "K", 3.0, valid=False),
        row("a", "filter_K", 1.0, "derived"), row("b", "filter_K", None, "bound", upper=2.0),
        row("b", "tau", 1.0, "undefined"), row("d", None, None, None, valid=False, model=None),
    ]  # fmt: skip
    found = {each.parameter: each for each in spreads_of(rows)}
    assert found.keys() == {"K", "filter_K"}
    assert (found["K"].devices, found["K"].without) == (("a",), 1)
    assert found["filter_K"].values.tolist() == [1.0, 2.0]
    assert found["filter_K"].found.tolist() == [True, False]


def test_structures_are_counted_by_axis():
    models = dict.fromkeys("abc", "white noise") | {"d": "random walk"}
    rows = [row(device, "N", 1.0, model=model) for device, model in models.items()]
    rows += [row("e", "N", 1.0, valid=False), row("a", "N", 1.0, channel="gyro_y")]
    found, other = structures_of(rows)
    assert found.counts == {"white noise": 3, "random walk": 1}
    assert (found.different, found.invalid, found.missing) == (1, ("e",), ())
    assert other.missing == ("b", "c", "d", "e")


def test_a_unit_apart_is_named_with_its_value():
    values = np.exp(0.1 * np.random.default_rng(1).standard_normal(12))
    values[7] *= 4.0
    (found,) = spread(values).outliers
    assert (found.device, found.value) == ("unit-7", values[7])
    assert found.distance > outlier_distance(12)
    assert spread(values[4:8]).outliers == ()  # of four units, who is odd?


@pytest.mark.parametrize("n", [5, 10, 40])
def test_a_fleet_without_outliers_names_one_in_a_hundred(n):
    rng = np.random.default_rng([2, n])
    runs = 1500
    named = sum(bool(spread(np.exp(x)).outliers) for x in rng.standard_normal((runs, n)))
    assert abs(named / runs - 0.01) < 4.0 * np.sqrt(0.01 * 0.99 / runs)


def test_limits_are_of_logarithms_but_of_a_signed_parameter():
    values = np.exp([0.0, 1.0, 2.0])
    low, high = spread(values).normal_limits
    assert low * high == pytest.approx(np.exp(2.0))
    low, high = spread([1.0, 2.0, 3.0], "R").normal_limits
    assert low + high == pytest.approx(4.0)


def test_a_single_unit_and_equal_ones_promise_nothing_more():
    alone, equal = spread([2.0]), spread([2.0] * 8)
    assert np.isnan([alone.sd, alone.normal_limit, *alone.normal_limits, alone.normality]).all()
    assert equal.normal_limit == pytest.approx(2.0)
    assert equal.outliers == () == alone.outliers
    assert np.isnan(equal.of_estimation)
    assert alone.free_limit is None
    assert alone.free_limits is None


def test_limits_without_a_distribution_are_values_and_what_is_not_normal_is_reported():
    values = np.random.default_rng(3).permutation(np.arange(1.0, 101.0))
    assert spread(values).free_limit == 99.0
    assert spread(values).free_limits == (1.0, 100.0)
    normal = np.random.default_rng(4).standard_normal(50)
    assert spread(np.exp(normal)).is_normal
    assert not spread(np.exp(normal**3)).is_normal


def test_errors_of_estimation_are_a_fraction_of_the_variance():
    values = np.exp(0.2 * np.random.default_rng(5).standard_normal(400))
    found = spread(values, stderr=0.1 * values)
    assert found.of_estimation == pytest.approx(0.25, rel=0.3)
