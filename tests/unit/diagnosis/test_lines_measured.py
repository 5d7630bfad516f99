"""Lines and resonances, measured in series where they are known."""

import numpy as np
import pytest

from gmwm import GaussMarkov, Resonance
from gmwm.diagnosis import tuning
from gmwm.diagnosis.lines import Line, background, bands, find_lines, line_notices, spectrum
from gmwm.diagnosis.resonances import peaks, resonance_notice

DT, N = 0.01, 20_000
TIME = DT * np.arange(N)


def noise(seed=1, size=1.0):
    return size * np.random.default_rng(seed).normal(size=N)


def lines_of(values):
    power = spectrum(values, DT)
    return power, find_lines(power, background(power, bands(power)))


@pytest.mark.parametrize("frequency", [0.5, 7.0, 7.0013, 49.0])
@pytest.mark.parametrize("amplitude", [0.2, 3.0])
def test_a_line_has_its_frequency_amplitude_and_ratio(frequency, amplitude):
    power, found = lines_of(noise() + amplitude * np.sin(2.0 * np.pi * frequency * TIME + 0.3))
    (line,) = found
    assert line.frequency == pytest.approx(frequency, abs=power.resolution)
    assert line.amplitude == pytest.approx(amplitude, rel=0.12 if amplitude < 1.0 else 0.01)
    area = 0.5 * amplitude**2 / line.width
    assert line.ratio == pytest.approx(1.0 + area / (2.0 * DT), rel=0.3)
    assert line.start * power.resolution < frequency < line.stop * power.resolution
    assert power.resolution < line.width < 4.0 * power.resolution


@pytest.mark.parametrize(("amplitude", "found"), [(0.055, False), (0.13, True)])
def test_a_line_is_found_where_noise_has_none_like_it(amplitude, found):
    # Of 10,000 bins the largest is 2 n A^2/4 / 1.5 above the mean with a chance of 0.1 %: 16.
    for seed in range(5):
        _, lines = lines_of(noise(seed) + amplitude * np.sin(2.0 * np.pi * 13.0 * TIME))
        assert len(lines) == found


def test_lines_are_in_order_of_their_power():
    values = noise() + sum(
        a * np.sin(2.0 * np.pi * f * TIME) for a, f in ((0.3, 5.0), (0.9, 11.0), (0.5, 31.0))
    )
    assert [round(line.frequency) for line in lines_of(values)[1]] == [11, 31, 5]
    slow = noise() + 5.0 * np.sin(2.0 * np.pi * 5.0 / (N * DT) * TIME)
    assert lines_of(slow)[1] == ()  # below bin 20 nothing is told from a drift


def line(frequency, amplitude=1.0, width=0.01):
    return Line(frequency, amplitude, 50.0, width, 0, 1)


def test_families_are_named_by_their_strongest():
    strong = [line(10.0 + 7.1 * k, 10.0 - k) for k in range(tuning.NAMED_LINES)]
    weak = [line(3.17, 0.4), line(4.31, 0.6)]
    found = line_notices("gyro_x", "rad/s", (*strong, line(20.0, 2.0), *weak))
    assert len(found) == tuning.NAMED_LINES + 1
    for notice, each in zip(found, strong, strict=False):
        assert (notice.severity, notice.where) == ("warning", "gyro_x")
        assert notice.values == {
            "frequency": each.frequency, "amplitude": each.amplitude, "ratio": 50.0,
            "width": 0.01, "harmonics": float(each.frequency == 10.0),
        }  # fmt: skip
    assert "with harmonics at 20 Hz" in found[0].text and "harmonics" not in found[1].text
    rest = found[-1]
    assert rest.severity == "note" and "2 weaker periodic lines" in rest.text
    assert rest.values == {"count": 2.0, "frequency": 4.31, "amplitude": 0.6}
    (*_, one) = line_notices("gyro_x", "rad/s", (*strong, weak[0]))
    assert "1 weaker periodic line, the strongest at 3.17 Hz" in one.text
    assert len(line_notices("gyro_x", "rad/s", tuple(strong))) == tuning.NAMED_LINES


@pytest.mark.parametrize(
    ("frequency", "damping", "n"),
    [(5.0, 0.05, N), (20.0, 0.1, N), (30.0, 0.02, N), (31.0, 0.0045, N), (31.0, 0.003, 6 * N)],
)
def test_a_resonance_has_its_frequency_damping_and_size(frequency, damping, n):
    values = np.random.default_rng(2).normal(0.0, 0.3, n) + Resonance(
        1.0, frequency, damping
    ).simulate(n, DT, 3)
    lines, (bump,) = peaks(values, DT)
    assert lines == ()
    assert bump.frequency == pytest.approx(frequency, rel=0.02)
    assert bump.damping == pytest.approx(damping, rel=0.2)
    assert bump.sigma == pytest.approx(1.0, rel=0.1)
    notice = resonance_notice("gyro_x", "rad/s", bump)
    assert notice.values == {
        "frequency": bump.frequency, "damping": bump.damping, "ratio": bump.ratio,
        "sigma": bump.sigma,
    }  # fmt: skip


def test_a_line_of_one_amplitude_that_wanders_is_no_resonance():
    wander = GaussMarkov(0.12, 20.0).simulate(12 * N, DT, 4)
    phase = 2.0 * np.pi * DT * np.cumsum(41.0 + wander)
    noisy = np.random.default_rng(2).normal(0.0, 0.3, phase.size) + np.sin(phase)
    lines, bumps = peaks(noisy, DT)
    assert lines[0].frequency == pytest.approx(41.0, abs=0.2)
    assert not any(bump.damping < tuning.NARROWEST for bump in bumps)


def test_peaks_need_half_of_a_series_that_is_long_enough():
    least = tuning.FEWEST_OF_SPECTRUM
    values = noise()[:least] + 5.0 * np.sin(2.0 * np.pi * 21.0 * TIME[:least])
    assert len(peaks(values, DT)[0]) == 1
    assert peaks(values[1:], DT) == ((), ())
    values = np.tile(values, 2)
    values[:least] = np.nan
    assert len(peaks(values, DT)[0]) >= 1
    values[least] = np.nan
    assert peaks(values, DT) == ((), ())
    assert peaks(np.zeros(2 * least), DT) == ((), ())
