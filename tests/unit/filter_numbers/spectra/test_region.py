"""The largest spectrum of a confidence region, against models drawn from it."""

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, LowPassNoise, Resonance, WhiteNoise
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.spectra import region as module
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
        region.model_at(point).psd(f, DT) for point in region.draws(1000, np.random.default_rng(7))
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


def test_the_gradient_is_that_of_the_density(resonant):
    region = ParameterRegion.of(resonant, 0.95)
    spectrum = module._Spectrum.of(region, DT)
    for point in region.draws(4, np.random.default_rng(2)) * np.array([[0.5], [0.9], [1.3], [2]]):
        f = np.array([7.9])
        value, gradient = spectrum.least(point, f)
        inside = point / max(1.0, np.linalg.norm(point))
        assert value == pytest.approx(-np.log(region.model_at(inside).psd(f, DT)[0]), rel=1e-9)
        for i, step in enumerate(1e-5 * np.eye(point.size)):
            ahead, behind = spectrum.least(point + step, f)[0], spectrum.least(point - step, f)[0]
            assert gradient[i] == pytest.approx((ahead - behind) / 2e-5, rel=1e-3, abs=1e-5)


def test_what_has_no_peak_costs_no_search_of_one(monkeypatch):
    """The corner of a low-pass was searched at four hundred frequencies, as a resonance is."""
    truth = LowPassNoise(1e-4, 10.0, 1.0, 0.7) + GaussMarkov(2e-4, 3.0)
    free = LowPassNoise(order=1.0, damping=0.7) + GaussMarkov()
    fit = gmwm.fit(free, truth.simulate(100_000, DT, 5), DT)
    searched = []
    plain = module.minimize
    monkeypatch.setattr(module, "minimize", lambda *a, **k: searched.append(1) or plain(*a, **k))
    target = RequiredSpectrum.of(fit.model, DT, HORIZON)
    region_spectra(target, fit, 0.95)
    decades = np.log10(50.0 / target.lowest)
    assert len(searched) < tuning.REGION_POINTS * decades + 20
