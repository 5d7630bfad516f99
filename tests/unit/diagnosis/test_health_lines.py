"""Periodic lines: frequency, amplitude, harmonics; none where there is only noise."""

import numpy as np
import pytest
from examining import DT, SMOOTH, simulated
from hypothesis import given, settings, strategies as st
from scipy.signal import butter, periodogram, sosfilt
from scipy.stats import binom

from gmwm import GaussMarkov, Resonance, Sinusoid, WhiteNoise
from gmwm.diagnosis import gathered
from gmwm.diagnosis.lines import background, bands, find_lines, line_notices, spectrum
from gmwm.diagnosis.tuning import FALSE_ALARM
from gmwm.issues import Notice
from marks import every

NOISES = SMOOTH | {
    "fast Gauss-Markov": GaussMarkov(1.0, 0.02),
    "resonance": WhiteNoise(0.05) + Resonance(1.0, 20.0, 0.02),
}


def lines(x, dt=DT):
    power = spectrum(x, dt)
    return find_lines(power, background(power, bands(power)))


@pytest.mark.parametrize("n", [1024, 4001, 10_007])
def test_spectrum_is_that_of_scipy(n):
    # An independent library, with the same symmetric window.
    x = np.random.default_rng(n).normal(size=n).cumsum()
    window = np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    f, expected = periodogram(x, 1.0 / DT, window=window, detrend="linear")
    found = spectrum(x, DT)
    np.testing.assert_allclose(found.frequency, f, rtol=1e-12)
    inner = slice(1, (n - 1) // 2)
    np.testing.assert_allclose(found.density[inner], expected[inner], rtol=1e-9)


@settings(max_examples=40, deadline=None)
@given(
    frequency=st.floats(0.8, 48.0),
    amplitude=st.floats(0.3, 50.0),
    n=st.integers(8000, 12_000),
    name=st.sampled_from(["white", "white on walk", "fast Gauss-Markov", "quantization"]),
    seed=st.integers(0, 1000),
)
def test_a_line_is_found_with_frequency_and_amplitude(frequency, amplitude, n, name, seed):
    x = simulated(NOISES[name], n, seed) + simulated(Sinusoid(amplitude, frequency), n, seed + 1)
    found = lines(x)
    assert len(found) == 1
    # Resolution 1/(n dt) = 0.01 Hz; the centre of a line is known to a part of it.
    assert found[0].frequency == pytest.approx(frequency, abs=0.005)
    # White noise of sigma 1 gives amplitudes an error of (2/n)^(1/2) = 0.014; other noises are
    # up to seven times as large at some frequency.
    assert found[0].amplitude == pytest.approx(amplitude, rel=0.05, abs=0.1)
    assert found[0].width < 5.0 / (n * DT)


@pytest.mark.parametrize("name", every(3, NOISES))
def test_clean_noise_has_no_lines(name):
    runs = 60
    count = sum(bool(lines(simulated(NOISES[name], 3000, seed))) for seed in range(runs))
    # One chance in a million that the bound is passed.
    assert count <= binom.isf(1e-6, runs, FALSE_ALARM)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 3.0])
def test_rounded_noise_has_no_lines(ratio):
    for seed in range(40):
        rng = np.random.default_rng(seed)
        slow = rng.normal(size=3000).cumsum() * 0.02
        assert not lines(np.rint((slow + rng.normal(size=3000)) / ratio) * ratio)


@pytest.mark.parametrize("order", [4, 6])
def test_what_a_filter_leaves_beyond_its_band_has_no_lines(order):
    # At 4e-9 of the deviation rounding of double precision has peaks.
    for seed in range(2):
        noise = np.random.default_rng(seed).normal(size=200_000) + 2.0
        x = sosfilt(butter(order, 5.0, fs=200.0, output="sos"), noise)
        assert not lines(x[1000:])
        (found,) = lines(x[1000:] + simulated(Sinusoid(1e-4, 35.0), x.size - 1000, seed))
        assert found.amplitude == pytest.approx(1e-4, rel=0.1)


def test_a_weak_line_in_a_long_record():
    # Half a per cent of the power of the noise; 100 times the noise within its own bins.
    n = 200_000
    x = simulated(NOISES["white"], n, 1) + 0.06 * np.sin(2 * np.pi * 7.123456 * DT * np.arange(n))
    (line,) = lines(x)
    assert line.frequency == pytest.approx(7.123456, abs=2e-4)
    assert line.amplitude == pytest.approx(0.06, rel=0.2)
    assert line.ratio > 50.0


def test_a_line_that_wanders_is_one_line():
    # A random walk of the phase smears it over 0.01 Hz, 20 bins.
    n = 200_000
    rng = np.random.default_rng(2)
    phase = 2 * np.pi * 2.0 * DT * np.arange(n) + np.cumsum(rng.normal(size=n)) * np.sqrt(
        2 * np.pi * 0.01 * DT
    )
    (line,) = lines(rng.normal(size=n) + 0.5 * np.sin(phase))
    assert line.frequency == pytest.approx(2.0, abs=0.005)
    assert line.amplitude == pytest.approx(0.5, rel=0.1)
    assert line.width > 5.0 / (n * DT)


def test_harmonics_belong_to_their_line():
    n = 50_000
    t = DT * np.arange(n)
    x = np.random.default_rng(3).normal(size=n) + 0.2 * np.sin(2 * np.pi * 11.3 * t)
    x += 0.5 * np.sign(np.sin(2 * np.pi * 1.7 * t))  # odd harmonics: 1.7, 5.1, 8.5, ...
    found = lines(x)
    frequencies = sorted(line.frequency for line in found)
    for expected in (1.7, 5.1, 8.5, 11.3, 11.9):
        assert min(abs(f - expected) for f in frequencies) < 0.002
    notices = line_notices("accel_x", "m/s^2", found)
    assert [round(f.values["frequency"], 2) for f in notices] == [1.7, 11.3]
    assert notices[0].values["harmonics"] >= 3
    assert "harmonics at 5.1" in notices[0].text


def test_twice_the_frequency_is_a_harmonic_and_the_golden_ratio_is_none():
    t = DT * np.arange(50_000)
    x = np.random.default_rng(5).normal(size=t.size)
    for frequency in (3.1, 6.2, 3.1 * 1.618):
        x += 0.3 * np.sin(2 * np.pi * frequency * t)
    notices = line_notices("accel_x", "m/s^2", lines(x))
    assert {round(f.values["frequency"], 2): f.values["harmonics"] for f in notices} == {
        3.1: 1,
        5.02: 0,
    }


def test_a_line_on_a_resonance():
    x = simulated(NOISES["resonance"], 60_000, 5)
    x += 0.5 * np.sin(2 * np.pi * 20.5 * DT * np.arange(x.size))
    (line,) = lines(x)
    assert line.frequency == pytest.approx(20.5, abs=0.005)


def test_gaps_do_not_hide_or_make_lines():
    rng = np.random.default_rng(6)
    n = 50_000
    noise = rng.normal(size=n)
    gone = rng.random(n) < 0.02
    gone[20_000:21_000] = True
    noise[gone] = np.nan
    assert not lines(noise)
    (line,) = lines(noise + 0.5 * np.sin(2 * np.pi * 3.3 * DT * np.arange(n)))
    assert line.frequency == pytest.approx(3.3, abs=0.002)
    assert line.amplitude == pytest.approx(0.5, rel=0.1)


def test_a_line_of_three_axes_is_reported_once():
    def line(where, frequency, ratio, **more):
        values = {"frequency": frequency, "amplitude": 1.0, "ratio": ratio, **more}
        return Notice("line", "warning", where, f"a line of {where}", values, "find what hums")

    other = Notice("event", "warning", "accel_x", "a shock")
    weaker = line("accel_z", 50.0, 1.0, count=2.0)
    found = gathered([
        line("accel_x", 50.0, 20.0), other, line("accel_x", 50.2, 5.0),
        line("accel_y", 50.01, 30.0), line("accel_z", 49.99, 9.0), line("gyro_x", 52.0, 9.0),
        weaker,
    ])  # fmt: skip
    assert [each.where for each in found] == [
        "accel_x, accel_y, accel_z", "accel_x", "accel_x", "gyro_x", "accel_z",
    ]  # fmt: skip
    assert found[0].text.startswith("a line of accel_y (in accel_y); 3 channels have it")
    assert found[0].hint == "find what hums; check the mounting and the power supply"
    assert found[1] is other and found[-1] is weaker
