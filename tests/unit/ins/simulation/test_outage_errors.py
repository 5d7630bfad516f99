"""Errors at the end of an outage: sizes and spreads against numpy, intervals by simulation."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.stats import binom, ttest_rel

from gmwm.errors import InputError
from gmwm.ins import FilterErrors, MonteCarlo, Outage, difference, spread
from gmwm.ins.simulation import QUANTITIES
from gmwm.ins.simulation.consistency import sizes
from gmwm.ins.simulation.trials import pooled_sizes

TIME = np.array([0.0, 30.0, 30.0, 60.0, 60.0])
BEFORE = np.array([False, True, False, True, False])


def runs_of(error, sd=None):
    """Runs of which only the errors matter, (R, K, 9)."""
    error = np.asarray(error, dtype=float)
    none = np.zeros((*error.shape[:2], 4))
    return FilterErrors(
        time=TIME, before=BEFORE, error=error, sd=np.ones_like(error) if sd is None else sd,
        nees=none, log_det=none, sensor_error=none, sensor_sd=none, sensor_nees=none[..., 0],
        nis=np.ones((len(error), 2)), whiteness=np.zeros(len(error)),
    )  # fmt: skip


def drawn(seed, runs=50):
    return np.random.default_rng(seed).standard_normal((runs, TIME.size, 9)) * np.arange(1, 10)


def study(**filters):
    return MonteCarlo(
        filters=filters,
        outages=(Outage(10.0, 20.0), Outage(40.0, 20.0)),
        example={},
        truth=SimpleNamespace(),
    )


def test_sizes_are_those_before_the_first_fix():
    error = np.zeros((1, TIME.size, 9))
    error[0, 3] = [3.0, -4.0, -7.0, 2.0, -3.0, 6.0, *np.radians([0.2, 0.3, -0.6])]
    error[0, 4] = 99.0
    found = sizes(runs_of(error), 60.0)
    assert {name: float(value[0]) for name, value in found.items()} == pytest.approx(
        {"horizontal": 5.0, "vertical": 7.0, "velocity": 7.0, "attitude": 0.7}
    )
    with pytest.raises(InputError, match="no errors were kept at 45 s"):
        sizes(runs_of(error), 45.0)


@given(st.integers(1, 60), st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_spread_against_numpy(runs, seed):
    error = drawn(seed, runs)
    sd = np.abs(drawn(seed + 1, runs))
    horizontal = np.linalg.norm(error[:, 1, :2], axis=1)
    found = spread(runs_of(error, sd), 30.0)
    assert list(found) == list(QUANTITIES)
    assert found["horizontal"].mean == pytest.approx(horizontal.mean())
    assert found["horizontal"].rms ** 2 == pytest.approx(np.mean(horizontal**2))
    assert found["horizontal"].median == pytest.approx(np.median(horizontal))
    assert found["horizontal"].p95 == pytest.approx(np.percentile(horizontal, 95))
    assert found["horizontal"].predicted ** 2 == pytest.approx(
        np.mean(sd[:, 1, 0] ** 2 + sd[:, 1, 1] ** 2)
    )
    assert found["vertical"].rms == pytest.approx(np.sqrt(np.mean(error[:, 1, 2] ** 2)))


def test_difference_of_known_values():
    a = {"horizontal": np.array([2.0, 4.0, 6.0])}
    b = {"horizontal": np.array([1.0, 2.0, 3.0])}
    found = difference(a, b, "horizontal")
    assert found.value == 2.0
    assert (found.ratio, found.ratio_lower, found.ratio_upper) == pytest.approx((2.0, 2.0, 2.0))
    assert 1.0 <= found.lower <= found.value <= found.upper <= 3.0
    assert found.significant
    same = difference(a, a, "horizontal")
    assert (same.value, same.lower, same.upper, same.ratio) == (0.0, 0.0, 0.0, 1.0)
    assert not same.significant


def test_runs_in_which_either_filter_diverged_are_left_out():
    a, b = np.arange(1.0, 9.0), np.arange(1.0, 9.0)[::-1].copy()
    kept = difference({"vertical": a[2:]}, {"vertical": b[2:]}, "vertical")
    a[0], b[1] = np.nan, np.nan
    assert difference({"vertical": a}, {"vertical": b}, "vertical") == kept
    with pytest.raises(InputError, match="in every run one of the two filters diverged"):
        difference({"vertical": a[:1]}, {"vertical": b[:1]}, "vertical")
    with pytest.raises(InputError, match="8 and 3 runs cannot be paired"):
        difference({"vertical": a}, {"vertical": b[:3]}, "vertical")
    with pytest.raises(InputError, match="choose from horizontal"):
        difference({"vertical": a}, {"vertical": b}, "height")


@pytest.mark.parametrize("correlation", [0.0, 0.95])
def test_bootstrap_interval_covers_the_difference(correlation):
    """The percentile bootstrap of a mean of 60 covers some 94 %."""
    rng = np.random.default_rng(7)
    draws, runs = 120, 60
    hits = ratio_hits = 0
    for _ in range(draws):
        common = rng.standard_normal((runs, 2))
        own = rng.standard_normal((2, runs, 2))
        mixed = np.sqrt(correlation) * common + np.sqrt(1.0 - correlation) * own
        a, b = np.linalg.norm(mixed[0] * 1.5, axis=1), np.linalg.norm(mixed[1], axis=1)
        found = difference({"horizontal": a}, {"horizontal": b}, "horizontal")
        # The mean of a Rayleigh variable is sqrt(pi / 2).
        hits += found.lower <= 0.5 * np.sqrt(np.pi / 2.0) <= found.upper
        ratio_hits += found.ratio_lower <= 1.5 <= found.ratio_upper
    low, high = binom.ppf([1e-4, 1.0 - 1e-4], draws, [0.935, 0.955])
    assert low <= hits <= high
    assert low <= ratio_hits <= high


def test_pairing_narrows_the_interval_of_correlated_runs():
    rng = np.random.default_rng(8)
    common = 10.0 + rng.standard_normal(200) * 3.0
    a, b = common + 0.3 * rng.standard_normal(200), common + 0.3 * rng.standard_normal(200) - 0.2
    paired = difference({"vertical": a}, {"vertical": b}, "vertical")
    parted = difference({"vertical": a}, {"vertical": rng.permutation(b)}, "vertical")
    assert parted.value == pytest.approx(paired.value)
    assert paired.upper - paired.lower < 0.2 * (parted.upper - parted.lower)
    assert paired.significant
    assert not parted.significant
    # Of many runs, Student's interval for paired samples is nearly the same.
    student = ttest_rel(a, b).confidence_interval(0.95)
    assert (paired.lower, paired.upper) == pytest.approx(tuple(student), abs=0.01)


def test_sizes_pooled_over_outages():
    error = drawn(9)
    found = pooled_sizes(study(one=runs_of(error)), "one")
    expected = np.sqrt(0.5 * (error[:, 1, 2] ** 2 + error[:, 3, 2] ** 2))
    np.testing.assert_allclose(found["vertical"], expected)
    with pytest.raises(InputError, match="no filter 'two': choose from one"):
        pooled_sizes(study(one=runs_of(error)), "two")
    none = MonteCarlo({"one": runs_of(error)}, (), {}, SimpleNamespace())
    with pytest.raises(InputError, match="no outage"):
        pooled_sizes(none, "one")
