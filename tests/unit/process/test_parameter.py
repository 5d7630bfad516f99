"""Ranges of parameters: their maps to the real line, and grids all over them."""

import numpy as np
import pytest

from gmwm.process import CATALOGUE
from gmwm.process.parameter import Parameter

SHAPED = [kind for kind in CATALOGUE if kind.examples()[0].shape_parameters]


def of(lower, upper=np.inf, unit="-"):
    return Parameter("p", unit, "shape", lower, upper)


@pytest.mark.parametrize(
    ("parameter", "value", "free"),
    [(of(0.0), np.e, 1.0), (of(2.0), 3.0, 0.0), (of(-np.inf), -4.0, -4.0),
     (of(0.0, 1.0), 0.5, 0.0), (of(1.0, 4.0), 2.0, -np.log(2.0))],
)  # fmt: skip
def test_a_value_goes_to_the_real_line_and_back(parameter, value, free):
    assert parameter.to_free(value) == pytest.approx(free)
    assert parameter.from_free(free) == pytest.approx(value)


@pytest.mark.parametrize(
    ("parameter", "low", "high"),
    [(of(0.0, unit="s"), 0.005, 10.0), (of(0.5, 3.0, "s"), 0.5, 3.0),
     (of(0.0, unit="Hz"), 0.1, 50.0), (of(1.0, 20.0, "Hz"), 1.0, 20.0), (of(0.0), 1.0, 1e3),
     (of(5.0), 5.0, 5e3), (of(0.2), 0.2, 1e3), (of(0.2, unit="u/s"), 0.2, 1e3)],
)  # fmt: skip
def test_a_grid_reaches_over_what_a_record_shows(parameter, low, high):
    ratio = (high / low) ** (1.0 / 9.0)
    found = parameter.grid(0.01, 1000, points=8)
    np.testing.assert_allclose(found, low * ratio ** np.arange(1, 9))
    assert parameter.grid(0.01, 1000).size == 16


def test_a_grid_of_both_signs_is_even():
    np.testing.assert_allclose(of(-1.0, 1.0).grid(0.01, 1000, points=3), [-0.5, 0.0, 0.5])


@pytest.mark.parametrize("kind", SHAPED, ids=lambda kind: kind.__name__)
def test_a_grid_of_shapes_is_in_range_and_knows_no_unit_of_time(kind):
    process = kind.examples()[0]
    n = 20_000
    grid, scaled = (np.array(process.shape_grid(dt, n)) for dt in (1.0, 0.01))
    per_second = {"s": 0.01, "Hz": 100.0}
    for column, each in enumerate(process.shape_parameters):
        values = grid[:, column]
        assert all(map(each.admits, values.tolist()))
        if each.unit in per_second:
            np.testing.assert_allclose(scaled[:, column], per_second[each.unit] * values, rtol=1e-9)
            steps = np.unique(values)
            assert np.max(steps[1:] / steps[:-1]) < 2.1
        if each.unit == "Hz":
            assert 0.3 < np.max(values) <= 0.5


@pytest.mark.parametrize(
    ("name", "low", "high", "n"),
    [("GaussMarkov", 0.3, 10_000 / 3, 10_000), ("GaussMarkov", 0.3, 1.0, 2),
     ("Resonance", 4e-4, 0.45, 10_000), ("LowPassNoise", 0.004, 0.45, 10_000),
     ("AveragedNoise", 2.0, 125.0, 10_000), ("AveragedNoise", 2.0, 100.0, 800),
     ("AveragedNoise", 2.0, 2.0, 5)],
)  # fmt: skip
def test_where_grids_begin_and_end(name, low, high, n):
    (kind,) = (each for each in CATALOGUE if each.__name__ == name)
    first = np.array(kind.examples()[0].shape_grid(1.0, n))[:, 0]
    assert (np.min(first), np.max(first)) == pytest.approx((low, high))
