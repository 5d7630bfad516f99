"""The largest spectrum of a confidence region, against models drawn from it."""

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, Resonance, WhiteNoise
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.spectra.region import ParameterRegion, region_spectra
from gmwm.filter_numbers.spectra.required import RequiredSpectrum

DT, HORIZON = 0.01, 0.1
"""So short a horizon that the peak of a resonance counts."""


@pytest.fixture(scope="module")
def resonant():
    truth = WhiteNoise(1e-4) + GaussMarkov(2e-4, 3.0) + Resonance(3e-4, 8.0, 0.1)
    return gmwm.fit(truth.opened(), truth.simulate(100_000, DT, 5), DT)


def test_no_model_of_the_region_is_far_above_those_found(resonant):
    found = region_spectra(RequiredSpectrum.of(resonant.model, DT, HORIZON), resonant, 0.95)
    region = ParameterRegion.of(resonant, 0.95)
    f = np.append(np.geomspace(1e-4, 50.0, 200), np.linspace(7.0, 9.0, 200))
    largest = np.max([each.psd(f) for each in found], axis=0)
    drawn = [
        region.model_at(point).psd(f, DT) for point in region.draws(150, np.random.default_rng(7))
    ]
    assert np.max(np.max(drawn, axis=0) / largest) < tuning.ENVELOPE
    estimate = RequiredSpectrum.of(resonant.model, DT, HORIZON).psd(f)
    assert np.max(largest / estimate) > 1.1


def test_a_parameter_goes_to_the_ends_of_its_interval_in_even_ratios(resonant):
    region = ParameterRegion.of(resonant, 0.95)
    for i, key in enumerate(region.keys):
        centre, low, high = resonant.params[key], region.lower[i], region.upper[i]
        assert 0.0 < low < centre < high
        ways = [region.value(i, along) for along in (-1.0, -0.5, 0.0, 0.5, 1.0)]
        between = [np.sqrt(centre * low), centre, np.sqrt(centre * high)]
        assert ways == pytest.approx([low, *between, high])
