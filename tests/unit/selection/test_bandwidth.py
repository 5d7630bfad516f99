"""The sensor's own low-pass: found where it is, named as what it is, not where it is not."""

import numpy as np
import pytest
from scipy import signal

import gmwm
from gmwm import AveragedNoise, Channel, LowPassNoise, RandomWalk, WhiteNoise
from gmwm.calibration import axis_numbers
from gmwm.selection import tuning
from gmwm.selection.bandwidth import sensor_bandwidth
from marks import slow

DT, N = 0.01, 1e-3


def filtered(b, a, seed, n=100_000, slow=None):
    rng = np.random.default_rng(seed)
    x = signal.lfilter(b, a, rng.standard_normal(n + 2000) * N / np.sqrt(DT))[2000:]
    return x if slow is None else x + slow.simulate(n, DT, rng)


FILTERS = {
    "butterworth 1": signal.butter(1, 0.3),
    "butterworth 2": signal.butter(2, 0.4),
    "butterworth 4": signal.butter(4, 0.1),
    "bessel 2": signal.bessel(2, 0.2, norm="mag"),
    "chebyshev 2": signal.cheby1(2, 0.5, 0.2),
    "mean of 5": (np.ones(5) / 5, [1.0]),
}


@pytest.mark.parametrize(
    "name",
    ["butterworth 4", "mean of 5",
     *map(slow, ("butterworth 1", "butterworth 2", "bessel 2", "chebyshev 2"))],
)  # fmt: skip
def test_a_filtered_white_noise_is_valid_and_named(name):
    # Each of these made no valid fit: "no white noise, Gauss-Markov of 7 ms".
    selection = gmwm.select(Channel("gyro_x", filtered(*FILTERS[name], 1), DT, "gyro", "rad/s"))
    fit = selection.fit
    assert fit.valid, fit.message
    assert fit.discrepancy == 0.0
    assert any(term.is_band_limited for term in fit.model.terms)
    (named,) = (notice for notice in fit.notices if notice.code == "sensor-bandwidth")
    gain = 0.944 if name == "chebyshev 2" else 1.0  # its gain at zero frequency is the ripple's
    assert named.values["density"] == pytest.approx(gain * N, rel=0.03)
    assert axis_numbers(fit).N.value == pytest.approx(gain * N, rel=0.03)


def test_the_walk_beside_a_filtered_noise_is_found():
    truth = RandomWalk(1e-4)
    fit = gmwm.select(filtered(*FILTERS["butterworth 2"], 3, slow=truth), dt=DT).fit
    assert fit.valid, fit.message
    assert {type(term) for term in fit.model.terms} == {LowPassNoise, RandomWalk}
    low, high = fit.interval(0.999)["K"]
    assert low < truth.K < high
    low, high = fit.interval(0.999)["lowpass_bandwidth"]
    assert low < 20.0 < high


def test_a_single_pole_is_a_gauss_markov_process_and_named_too():
    left = np.exp(-2.0 * np.pi * 0.1)
    fit = gmwm.select(filtered([1.0 - left], [1.0, -left], 1), dt=DT).fit
    assert fit.valid and fit.model.title() == "Gauss-Markov"
    (named,) = (notice for notice in fit.notices if notice.code == "sensor-bandwidth")
    assert named.where == "tau"
    assert named.values["density"] == pytest.approx(N, rel=0.03)


def test_no_bandwidth_is_named_where_white_noise_is():
    fit = gmwm.select(
        (WhiteNoise(N) + gmwm.GaussMarkov(2 * N, 0.05)).simulate(50_000, DT, 2), DT
    ).fit
    assert not any(notice.code == "sensor-bandwidth" for notice in fit.notices)


def test_plain_white_noise_is_not_taken_for_filtered():
    for seed in range(40):
        wv = gmwm.wavelet_variance(WhiteNoise(N).simulate(20_000, DT, seed), dt=DT)
        assert sensor_bandwidth(wv, (), 7.0) is None


@pytest.mark.parametrize("run", [9, 445])
def test_a_level_that_is_low_by_chance_does_not_make_a_low_pass(run):
    # The coarsest level is a twentieth of the truth or less. Its small error drew all others down:
    # low-pass noise above half the rate was chosen, its p-value zero, its standard error too.
    x = np.random.default_rng(4320).normal(0.0, N, (446, 600))[run]
    selection = gmwm.select(x, dt=0.1)
    assert selection.chosen.p_value > 1e-3
    assert selection.model.title() == "white noise"


def test_a_bandwidth_above_half_the_rate_is_not_known():
    """It changes nothing there, and its standard error was zero."""
    x = np.random.default_rng(4320).normal(0.0, N, (446, 600))[445]
    fit = gmwm.estimate.estimate(LowPassNoise(order=0.905, damping=0.2177), x, 0.1)
    assert fit.params["lowpass_bandwidth"] > 5.0
    assert "undetermined" in {each.code for each in fit.notices}
    assert fit.interval()["lowpass_bandwidth"] == (0.0, np.inf)


def test_a_moving_average_is_found_by_its_window(monkeypatch):
    wv = gmwm.wavelet_variance(filtered(np.ones(7) / 7, [1.0], 4), dt=DT)
    found = sensor_bandwidth(wv, (), 7.0)
    assert found is not None
    assert found.free == AveragedNoise(window=0.07)
    monkeypatch.setattr(tuning, "BANDWIDTH_GAIN", 1e6)
    assert sensor_bandwidth(wv, (), 7.0) is None


def test_a_bandwidth_pays_for_its_size_and_its_shape(monkeypatch):
    # A filter that is hardly one gains between one and two times the price of both parameters.
    wv = gmwm.wavelet_variance(filtered([1.0, 0.187], [1.0], 1, n=20_000), dt=DT)
    gains = {}
    for gain in (tuning.BANDWIDTH_GAIN, 0.5 * tuning.BANDWIDTH_GAIN):
        monkeypatch.setattr(tuning, "BANDWIDTH_GAIN", gain)
        gains[gain] = sensor_bandwidth(wv, (), 7.0)
    taken, half = gains.values()
    assert taken is None
    assert half is not None and half.n_shapes == 1
