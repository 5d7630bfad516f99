"""Resonances: frequency and damping; none in smooth spectra."""

import numpy as np
import pytest
from examining import SMOOTH, simulated
from scipy.signal import butter, lfilter
from scipy.stats import binom

import gmwm
from gmwm import ARMA, QuantizationNoise, RandomWalk, Resonance, Sinusoid, WhiteNoise
from gmwm.diagnosis.tuning import FALSE_ALARM
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
    x = simulated(model, 200_000, 1)
    health = found(record, x)
    ((at, ratio),) = health.resonances("gyro_z")
    # The Fisher information of Whittle's likelihood for n dt = 2000 s gives 0.2 % and 3 %.
    assert at == pytest.approx(frequency, rel=0.01)
    assert ratio == pytest.approx(damping, rel=0.15)
    (notice,) = health.of("gyro_z", "resonance")
    assert notice.values["sigma"] == pytest.approx(sigma, rel=0.1)
    assert not health.lines("gyro_z")


@pytest.mark.parametrize("name", every(3, NOISES))
def test_smooth_spectra_have_none(record, name):
    runs = 12
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


def test_two_resonances_highest_first(record):
    model = WhiteNoise(0.1) + Resonance(0.5, 4.0, 0.05) + Resonance(1.0, 30.0, 0.02)
    x = simulated(model, 200_000, 4)
    health = found(record, x)
    at = [frequency for frequency, _ in health.resonances("gyro_z")]
    heights = [notice.values["ratio"] for notice in health.of("gyro_z", "resonance")]
    assert sorted(at) == [pytest.approx(4.0, rel=0.03), pytest.approx(30.0, rel=0.02)]
    assert heights == sorted(heights, reverse=True)
