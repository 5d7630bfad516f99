"""Resonances: frequency and damping; none in smooth spectra."""

import numpy as np
import pytest
from examining import SMOOTH, simulated
from scipy.signal import butter, lfilter
from scipy.stats import binom

import gmwm
from gmwm import ARMA, QuantizationNoise, RandomWalk, Resonance, Sinusoid, WhiteNoise
from gmwm.diagnosis.tuning import FALSE_ALARM
from gmwm.process import as_model
from marks import every

NOISES = SMOOTH | {
    "valley": RandomWalk(0.1) + QuantizationNoise(0.01),
    "moving average": ARMA((), (0.6, 0.3), 1.0),
}


def found(record, x):
    return gmwm.health(record(gyro_z=x))


@pytest.mark.parametrize(
    ("frequency", "damping", "sigma"),
    [(20.0, 0.02, 0.8), (20.0, 0.01, 0.5), (5.0, 0.05, 0.8), (40.0, 0.05, 1.0), (10.0, 0.12, 1.5)],
)
@pytest.mark.parametrize("background", ["white", "white on walk"])
def test_frequency_and_damping(record, frequency, damping, sigma, background):
    model = SMOOTH[background] + Resonance(sigma, frequency, damping)
    x = simulated(model, 100_000, 1)
    health = found(record, x)
    ((at, ratio),) = health.resonances("gyro_z")
    # The Fisher information of Whittle's likelihood for n dt = 1000 s gives 0.3 % and 4 %.
    assert at == pytest.approx(frequency, rel=0.01)
    assert ratio == pytest.approx(damping, rel=0.15)
    (notice,) = health.of("gyro_z", "resonance")
    assert notice.values["sigma"] == pytest.approx(sigma, rel=0.1)
    assert not health.lines("gyro_z")


@pytest.mark.parametrize("name", every(3, NOISES))
def test_smooth_spectra_have_none(record, name):
    runs = 8
    count = sum(
        bool(found(record, simulated(NOISES[name], 8000, seed)).resonances("gyro_z"))
        for seed in range(runs)
    )
    assert count <= binom.isf(1e-6, runs, FALSE_ALARM)


def test_a_low_pass_has_none(record):
    x = np.random.default_rng(2).normal(size=100_000)
    smooth = lfilter(*butter(2, 0.3), x)
    assert found(record, smooth + 0.01 * x).resonances("gyro_z") == ()


def test_a_line_is_no_resonance(record):
    x = simulated(WhiteNoise(0.1) + Sinusoid(1.0, 3.0), 100_000, 3)
    health = found(record, x)
    assert len(health.lines("gyro_z")) == 1
    assert health.resonances("gyro_z") == ()


def test_each_of_four_is_found_with_its_values_and_the_highest_comes_first(record):
    """At the maximum of the likelihood, not where the search for it began."""
    sigmas = {2.0: 2.0, 8.0: 2.0, 20.0: 2.5, 40.0: 3.0}
    model = as_model(WhiteNoise(0.1))
    for frequency, sigma in sigmas.items():
        model += Resonance(sigma, frequency, 0.1)
    notices = found(record, simulated(model, 100_000, 1)).of("gyro_z", "resonance")
    heights = [each.values["ratio"] for each in notices]
    assert heights == sorted(heights, reverse=True)
    at = sorted(notices, key=lambda each: each.values["frequency"])
    assert [each.values["frequency"] for each in at] == pytest.approx([*sigmas], rel=0.01)
    assert [each.values["damping"] for each in at] == pytest.approx([0.1] * 4, rel=0.15)
    assert [each.values["sigma"] for each in at] == pytest.approx([*sigmas.values()], rel=0.1)
