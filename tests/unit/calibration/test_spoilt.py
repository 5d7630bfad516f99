"""What makes the samples of a channel wrong makes its fit not valid, and no other."""

import numpy as np
import pytest
from scipy.signal import lfilter

import gmwm
from gmwm import WhiteNoise
from gmwm.report.health import trust
from marks import every

N, SD = 6_000, 8.7e-4


def clean(seed):
    return SD * np.random.default_rng(seed).standard_normal(N)


def zeros(share):
    values = clean(1)
    values[np.random.default_rng(2).random(N) < share] = 0.0
    return values


def held(share, step=0.0, n=N):
    """Some samples at random are written again in place of the next, as of lost packets."""
    rng = np.random.default_rng(2)
    values = clean(1)[:n] if not step else rounded(clean(1)[:n], step * SD)
    last = np.where(rng.random(n) < share, 0, np.arange(n))
    return values[np.maximum.accumulate(last)]


def between(values, some):
    return np.where(some, 0.5 * (np.roll(values, 1) + np.roll(values, -1)), values)


def filled(share):
    return between(clean(1), np.random.default_rng(2).random(N) < share)


def rounded(noise, step):
    return step * np.round(noise / step)


def shaken(envelope):
    return clean(1) * envelope(np.arange(N) / 100.0)


SPOILT = {
    "cut off above": ("saturation", "within_range", np.minimum(clean(1), 0.5 * SD)),
    "cut off on both sides": ("saturation", "within_range", np.clip(clean(1), -SD, SD)),
    "rounded to 3 sd": ("rounding", "resolution_fine", 3 * SD * np.round(clean(1) / 3 / SD + 0.13)),
    "rounded to 6 sd": ("rounding", "resolution_fine", 6 * SD * np.round(clean(1) / 6 / SD + 0.13)),
    "30 % are zero": ("value-repeated", "samples_measured", zeros(0.3)),
    "every other one is zero": (
        "value-repeated", "samples_measured", np.where(np.arange(N) % 2, clean(1), 0.0)
    ),
    "cut towards zero in steps of 0.5 sd": (
        "value-repeated", "samples_measured", 0.5 * SD * np.trunc(clean(1) / (0.5 * SD))
    ),
    "stuck": (
        "stuck", "samples_change",
        np.repeat(clean(1)[: 36 * N // 50], np.tile([1] * 35 + [15], N // 50)),
    ),
    "rectified": ("abrupt-end", "within_range", np.abs(clean(1))),
    "rectified, in steps": ("abrupt-end", "within_range", np.abs(rounded(clean(1), 0.1 * SD))),
    "wrapped round at 1.5 sd": (
        "abrupt-end", "within_range", (clean(1) + 1.5 * SD) % (3.0 * SD) - 1.5 * SD
    ),
    "uniform": ("abrupt-end", "within_range", SD * np.random.default_rng(1).random(N)),
    "10 % held, steps of 0.4 sd": ("held", "samples_measured", held(0.1, 0.4)),
    "10 % between their neighbours": ("filled", "samples_measured", filled(0.1)),
    "beyond 1.7 sd between its neighbours": (
        "filled", "samples_measured", between(clean(1), np.abs(clean(1)) > 1.7 * SD)
    ),
    "swells to 2 sd and dies": (
        "variance", "noise_steady", shaken(lambda t: 1.0 + np.sin(np.pi * t / 60.0) ** 2)
    ),
    "times 4 for 1 s of every 2 s": (
        "variance", "noise_steady", shaken(lambda t: np.where(t % 2.0 < 1.0, 4.0, 1.0))
    ),
    "25 s, times 5 for 12 s": (
        "variance", "noise_steady", shaken(lambda t: np.where((t > 8) & (t < 20), 5.0, 1.0))[:2500]
    ),
}  # fmt: skip


def calibrated(values):
    # In the other axis nothing is wrong.
    channels = {"gyro_x": values, "gyro_y": clean(3)[: values.size]}
    rec = gmwm.Recording.from_arrays(channels, 100.0, {"gyro": "rad/s"})
    return gmwm.calibrate(rec, WhiteNoise())


@pytest.mark.parametrize("kind", every(2, SPOILT))
def test_a_spoilt_channel_is_not_valid_and_the_others_are(kind):
    code, reason, values = SPOILT[kind]
    found = calibrated(values)
    fit = found["gyro_x"]
    assert not fit.valid
    assert reason in fit.reasons
    assert [n.code for n in found.notices if n.where == "gyro_x" and n.severity == "bad"] == [code]
    assert trust("gyro_x", fit, found)[0] is False
    assert found["gyro_y"].valid
    assert not found["gyro_y"].reasons


@pytest.mark.parametrize(("share", "step"), [(0.05, 0.0), (0.2, 0.0), (0.1, 0.15)])
def test_samples_of_lost_packets_are_left_out(share, step):
    rec = gmwm.Recording.from_arrays({"gyro_x": held(share, step)}, 100.0, {"gyro": "rad/s"})
    found = gmwm.calibrate(rec, WhiteNoise())
    (notice,) = [n for n in found.notices if n.code == "held"]
    assert notice.severity == "warning"
    assert notice.values["share"] == pytest.approx(share, rel=0.1)
    assert found["gyro_x"].valid
    # Chance makes some of the samples equal that are made missing; left in, N is 1 + share.
    error = 4.0 / np.sqrt(2.0 * N) + 0.4 * step**2
    assert found["gyro_x"].params["N"] / (0.1 * SD) == pytest.approx(1.0, abs=error)


def test_lost_packets_that_are_left_in_spoil_the_channel():
    rec = gmwm.Recording.from_arrays({"gyro_x": held(0.1)}, 100.0, {"gyro": "rad/s"})
    found = gmwm.calibrate(rec, WhiteNoise(), screening=("lines",))
    assert "samples_measured" in found["gyro_x"].reasons


RNG = np.random.default_rng(7)
SOUND = {
    "rounded to 1 sd": rounded(clean(5), SD),
    "rounded to 2 sd": rounded(clean(5), 2 * SD),
    "Laplace, rounded": rounded(SD * RNG.laplace(size=N), SD),
    "Student's t, rounded": rounded(SD * RNG.standard_t(3, size=N), SD),
    "a walk, rounded": rounded(clean(5) + 0.05 * SD * np.cumsum(RNG.standard_normal(N)), SD),
    "shocks that are cut off": np.clip(
        np.where(RNG.random(N) < 2e-3, 200 * SD * RNG.standard_normal(N), clean(5)),
        -30 * SD, 30 * SD,
    ),
    "a few zeros": zeros(0.002),
    "noise 15 % larger in the second half": shaken(lambda t: np.where(t > 30.0, 1.15, 1.0)),
    "Student's t with 2.5 degrees of freedom": SD * RNG.standard_t(2.5, N),
    "a Gauss-Markov process": gmwm.GaussMarkov(SD, 0.5),
    "low-passed": lfilter(np.ones(8) / 8.0, [1.0], clean(5)),
    "a sum of two uniform ones": SD * (RNG.random(N) + RNG.random(N)),
    "a strong line": clean(5) + 10 * SD * np.sin(np.arange(N) * 0.7),
    "a walk": np.cumsum(clean(5)),
    "a walk in steps": rounded(np.cumsum(clean(5)), 0.5 * SD),
    "single precision": np.float32(9.8 + clean(5)).astype(float),
    "a resonance": WhiteNoise(1e-5) + gmwm.Resonance(SD, 10.0, 0.01),
    "quantization noise": gmwm.QuantizationNoise(SD * 0.01),
}  # fmt: skip


@pytest.mark.parametrize("kind", SOUND)
def test_sound_channels_are_not_called_spoilt(kind):
    values = SOUND[kind]
    if not isinstance(values, np.ndarray):  # not where every worker compiles it
        values = values.simulate(N, 0.01, 1)
    rec = gmwm.Recording.from_arrays({"gyro_x": values}, 100.0, {"gyro": "rad/s"})
    assert not [n for n in gmwm.health(rec).notices if n.severity == "bad"]
