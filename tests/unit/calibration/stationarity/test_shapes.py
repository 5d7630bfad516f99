"""Shapes of departures against integrals of what they are called."""

import numpy as np
import pytest

from gmwm.calibration import tuning
from gmwm.calibration.stationarity.shapes import families

BLOCKS, STEP, FINE = 40, 0.5, 400
T = (np.arange(BLOCKS * FINE) + 0.5) / FINE  # in blocks
FAMILIES = {
    "pulse" if family.is_pulse else family.kind: family for family in families(BLOCKS, STEP)
}

SHAPES = {
    "step": lambda at: [at < T],
    "pulse": lambda at, until: [(at < T) & (until > T)],
    "transient": lambda tau: [np.exp(-T / tau)],
    "drift-at-start": lambda end: [np.where(end > T, T / end - 1.0, 0.0)],
    "slow-period": lambda length: [
        wave(2.0 * np.pi * T / length) for wave in (np.cos, np.sin)
    ],
    "drift": lambda length: [T / length],
}  # fmt: skip


@pytest.mark.parametrize("kind", SHAPES)
def test_block_means_are_those_of_the_shape(kind):
    family = FAMILIES[kind]
    assert len(family.members) == len(family.times)
    for member, times in enumerate(family.times):
        curves = family.curves[family.members[member]]
        curves = curves[:1] - curves[1:] if kind == "pulse" else curves
        expected = np.array(SHAPES[kind](*times / STEP), dtype=float).reshape(-1, BLOCKS, FINE)
        expected = expected.mean(axis=2)
        if kind == "drift-at-start":  # up to a sign and a level, as a slope
            curves, expected = (each / np.ptp(each) for each in (curves, np.abs(expected)))
            curves = np.abs(curves)
        np.testing.assert_allclose(curves, expected, atol=2e-3)


@pytest.mark.parametrize(
    ("kind", "low", "high"),
    [("step", 1.0, 39.0), ("pulse", 1.0, 39.0),
     ("transient", 1.0, 40 / 3), ("drift-at-start", 4.0, 80 / 3),
     ("slow-period", 40 / (tuning.MOST_CYCLES - 0.25), 80.0), ("drift", 40.0, 40.0)],
)  # fmt: skip
def test_times_reach_over_the_record(kind, low, high):
    times = FAMILIES[kind].times[:, 0] / STEP
    if kind == "pulse":
        times = np.unique(FAMILIES[kind].times / STEP)
        assert len(FAMILIES[kind].times) == times.size * (times.size - 1) // 2
    assert np.min(times) == pytest.approx(low) and np.max(times) == pytest.approx(high)
    if kind in ("transient", "drift-at-start"):
        ratios = times[1:] / times[:-1]
        np.testing.assert_allclose(ratios, ratios[0])
        assert ratios[0] == pytest.approx(tuning.RATIO_OF_TIMES, rel=0.3)
    elif kind == "step":
        np.testing.assert_allclose(np.diff(times), 0.5)
    elif kind == "pulse":
        np.testing.assert_allclose(np.diff(times), 1.0)
