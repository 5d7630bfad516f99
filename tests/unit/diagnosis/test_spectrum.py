"""The spectrum, its bands and its background: of series whose spectrum is known."""

from itertools import pairwise

import numpy as np
import pytest

from gmwm.diagnosis.lines import background, bands, spectrum

DT = 0.02


@pytest.mark.parametrize("n", [4000, 4001])
@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_the_density_is_that_of_white_noise(n, lost):
    rng = np.random.default_rng(1)
    values = 5.0 + 0.7 * rng.normal(size=n) + 0.01 * np.arange(n)
    values[rng.random(n) < lost] = np.nan
    found = spectrum(values, DT)
    assert found.density.size == n // 2 + 1
    assert found.resolution == pytest.approx(1.0 / (n * DT))
    assert found.frequency[-1] == pytest.approx(0.5 / DT, rel=1e-3)
    if lost == 0.0:
        assert np.mean(found.density[5:-1]) == pytest.approx(2.0 * DT * 0.49, rel=0.03)
        assert np.sum(found.density) * found.resolution == pytest.approx(0.49, rel=0.03)


@pytest.mark.parametrize("cycles", [200, 200.5])
def test_the_area_of_a_line_is_half_its_square(cycles):
    n = 4000
    line = 3.0 * np.cos(2.0 * np.pi * cycles * np.arange(n) / n + 0.4)
    found = spectrum(line + 7.0 - 1e-3 * np.arange(n), DT)
    assert np.sum(found.density[190:212]) * found.resolution == pytest.approx(4.5, rel=1e-4)
    assert np.max(found.density[:150]) < 1e-6 * np.max(found.density)
    assert abs(np.argmax(found.density) - cycles) <= 0.5


def test_a_straight_line_has_no_spectrum():
    found = spectrum(np.linspace(-4.0, 9.0, 1000), DT)
    assert np.max(found.density) < 1e-20


def test_levels_are_mean_logarithms_and_left_out_bins_do_not_count():
    values = np.random.default_rng(3).normal(size=50_000)
    power = spectrum(values, DT)
    found = bands(power)
    edges = found.edges
    logs = np.log(power.density) + np.euler_gamma
    means = [np.mean(logs[a:b]) for a, b in pairwise(edges)]
    np.testing.assert_allclose(found.level, means)
    assert np.mean(found.level) == pytest.approx(np.log(2.0 * DT), abs=0.05)
    centre = np.sqrt(edges[:-1] * (edges[1:] - 1.0)) * power.resolution
    np.testing.assert_allclose(found.frequency, centre)
    # The stated variance is that of the levels of so many bins.
    standard = (found.level - np.log(2.0 * DT)) / np.sqrt(found.variance)
    assert np.var(standard) == pytest.approx(1.0, abs=0.25)
    left_out = np.zeros(power.density.size, dtype=bool)
    left_out[edges[50] : edges[51]] = True
    left_out[edges[60] : edges[60] + 2] = True
    rest = bands(power, left_out)
    assert rest.level[50] == pytest.approx(0.5 * (means[49] + means[51]))
    assert rest.level[60] == pytest.approx(np.mean(logs[edges[60] + 2 : edges[61]]))
    np.testing.assert_allclose(np.delete(rest.level, [50, 60]), np.delete(means, [50, 60]))


def test_the_background_goes_through_the_bands():
    power = spectrum(np.random.default_rng(4).normal(size=20_000), DT)
    found = bands(power)
    density = background(power, found)
    assert density.shape == power.density.shape
    at = np.searchsorted(power.frequency, found.frequency[100])
    nearby = sorted([found.smooth[99], found.smooth[101]])
    assert nearby[0] - 0.05 <= np.log(density[at]) <= nearby[1] + 0.05
    assert density[0] == density[1] == pytest.approx(np.exp(found.smooth[0]))
