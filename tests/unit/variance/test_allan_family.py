"""Deviations of the Allan family: against their definitions, and their intervals in simulation."""

from __future__ import annotations

import json

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest
from scipy.stats import binom, chi2

import gmwm
from gmwm import Channel, InputError, QuantizationNoise, RandomWalk, RateRamp, Resonance, WhiteNoise
from marks import slow
from places import SHARED

pytestmark = pytest.mark.usefixtures("closed_figures")

KINDS = ("overlapping", "modified", "hadamard", "total")


def noise(n, seed=0):
    return 5.0 + np.random.default_rng(seed).normal(size=n)


# -- definitions ----------------------------------------------------------------------------------


def means(x, first, m):
    return np.mean(x[first : first + m])


def overlapping(x, m):
    """Half the mean square of the difference of adjacent means."""
    starts = range(x.size - 2 * m + 1)
    return np.sqrt(np.mean([(means(x, i + m, m) - means(x, i, m)) ** 2 for i in starts]) / 2)


def hadamard(x, m):
    """A sixth of the mean square of the second difference of adjacent means."""
    squares = [
        (means(x, i + 2 * m, m) - 2 * means(x, i + m, m) + means(x, i, m)) ** 2
        for i in range(x.size - 3 * m + 1)
    ]
    return np.sqrt(np.mean(squares) / 6)


def modified(x, m):
    """As `overlapping`, of differences averaged over m adjacent places."""
    differences = [means(x, i + m, m) - means(x, i, m) for i in range(x.size - 2 * m + 1)]
    averaged = [np.mean(differences[i : i + m]) for i in range(len(differences) - m + 1)]
    return np.sqrt(np.mean(np.square(averaged)) / 2)


def total(x, m):
    """As `overlapping`, of the series continued by its own reflection at both ends."""
    y = np.concatenate([x[::-1], x, x[::-1]])
    n = x.size
    # Pairs of means about each inner point of the integrated series.
    squares = [(means(y, n + i, m) - means(y, n + i - m, m)) ** 2 for i in range(1, n)]
    return np.sqrt(np.mean(squares) / 2)


@pytest.mark.parametrize("kind", [overlapping, hadamard, modified, total])
@pytest.mark.parametrize("n", [8, 9, 33, 64, 101])
def test_definition(kind, n):
    x = noise(n, n)
    name = kind.__name__
    found = gmwm.deviations(x, 0.5, [name], tau=0.5 * np.arange(1, n))
    m = np.rint(found.tau[name] / 0.5).astype(int)
    reach = 3 if name in ("hadamard", "modified") else 2
    assert m.tolist() == list(range(1, (n - 1) // reach + 1))
    np.testing.assert_allclose(found.deviation[name], [kind(x, k) for k in m], rtol=1e-10)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("dt", [1e-4, 1 / 3, 100.0])
def test_units_of_value_and_time(scale, dt):
    plain, other = gmwm.deviations(noise(200), 1.0), gmwm.deviations(scale * noise(200), dt)
    for kind in KINDS:
        np.testing.assert_allclose(other.tau[kind], dt * plain.tau[kind], rtol=1e-12)
        for part in ("deviation", "lower", "upper"):
            found, expected = getattr(other, part)[kind], scale * getattr(plain, part)[kind]
            np.testing.assert_allclose(found, expected, rtol=1e-8)


# -- averaging times ------------------------------------------------------------------------------


def test_octave_and_decade():
    found = gmwm.deviations(noise(1000), 0.1, ["overlapping"], "octave")
    np.testing.assert_allclose(found.tau["overlapping"], 0.1 * 2.0 ** np.arange(9))
    found = gmwm.deviations(noise(1000), 0.1, ["overlapping"], "decade")
    expected = 0.1 * np.array([1, 2, 4, 10, 20, 40, 100, 200, 400])
    np.testing.assert_allclose(found.tau["overlapping"], expected)


def test_times_are_rounded_sorted_and_cut_for_each_kind():
    found = gmwm.deviations(noise(100), 0.1, KINDS, [4.0, 0.04, 0.11, 0.1, 1.04, 99.0])
    np.testing.assert_allclose(found.tau["overlapping"], [0.1, 1.0, 4.0])
    np.testing.assert_allclose(found.tau["hadamard"], [0.1, 1.0])
    only = gmwm.deviations(noise(100), 0.1, "total", 2.0)
    assert only.kinds == ("total",)
    np.testing.assert_allclose(only.tau["total"], [2.0])


# -- intervals ------------------------------------------------------------------------------------


def test_intervals_of_the_total_deviation_have_the_bias_and_freedom_that_are_published():
    """Of a random walk of N samples: 1 - 0.75 m/N and 0.93 N/m - 0.36 (NIST SP 1065, table 7)."""
    n = 1024
    x = RandomWalk(1.0).simulate(n, 1.0, 3)
    found = gmwm.deviations(x, 1.0, "total", [64.0, 128.0, 256.0], confidence=1e-6)
    share = found.tau["total"] / n
    freedom = 0.93 / share - 0.36
    median = (1.0 - 0.75 * share) * chi2.ppf(0.5, freedom) / freedom
    ratio = (found.deviation["total"] / found.lower["total"]) ** 2
    np.testing.assert_allclose(ratio, median, rtol=0.05)


@pytest.mark.parametrize(
    "process",
    [slow(WhiteNoise(1.0)), slow(gmwm.BiasInstability(1.0)), RandomWalk(1.0)],
    ids=lambda process: type(process).__name__,
)
def test_intervals_hold_the_truth(process):
    runs, n = 25, 256
    rng = np.random.default_rng(11)
    found = [gmwm.deviations(process.simulate(n, 1.0, rng), 1.0) for _ in range(runs)]
    least = binom.ppf(1e-4, runs, 0.93)  # of a few per cent less than stated nobody takes harm
    for kind in KINDS:
        truth = np.sqrt(np.mean([f.deviation[kind] ** 2 for f in found], axis=0))
        if kind in ("overlapping", "total"):  # what the total deviation estimates too
            truth = np.sqrt(2.0 * process.haar_variance(found[0].tau[kind], 1.0))
        held = [(f.lower[kind] <= truth) & (truth <= f.upper[kind]) for f in found]
        assert np.min(np.sum(held, axis=0)) >= least, kind


QN = QuantizationNoise(1.0) + WhiteNoise(0.06)


def test_an_interval_does_not_depend_on_the_other_averaging_times():
    x = QN.simulate(2048, 1.0, 0)
    found, alone = gmwm.deviations(x, 1.0), gmwm.deviations(x, 1.0, tau=[512.0])
    for kind in KINDS:
        place = found.tau[kind].tolist().index(512.0)
        for part in ("lower", "upper"):
            assert getattr(alone, part)[kind] == pytest.approx(getattr(found, part)[kind][place])


@pytest.mark.parametrize(
    "model",
    [
        QN,
        slow(QuantizationNoise(1.0) + RandomWalk(1e-3)),
        slow(WhiteNoise(1.0) + Resonance(0.5, 0.05, 0.05)),
    ],
    ids=["quantization and white", "quantization and walk", "resonance and white"],
)
def test_intervals_hold_the_truth_of_mixed_noise(model):
    runs, n = 25, 4096
    rng = np.random.default_rng(3)
    found = [
        gmwm.deviations(model.simulate(n, 1.0, rng), 1.0, ["overlapping"]) for _ in range(runs)
    ]
    truth = np.sqrt(2.0 * model.haar_variance(found[0].tau["overlapping"], 1.0))
    held = [(f.lower["overlapping"] <= truth) & (truth <= f.upper["overlapping"]) for f in found]
    assert np.min(np.sum(held, axis=0)) >= binom.ppf(1e-4, runs, 0.93)


def test_intervals_of_stable32():
    folder = SHARED / "reference" / "stable32"
    if not folder.exists():
        pytest.skip("Stable32's results are not on this machine")
    expected = json.loads((folder / "expected.json").read_text())
    names = ("stable32_phase.dat", "stable32_pink_frequency.txt")
    phase, pink = (np.loadtxt(folder / name) for name in names)
    for name, x in (("PHASE", np.diff(phase)), ("pink", pink)):
        for kind in set(KINDS) & set(expected[name]):
            _, tau, _, _, low, _, high = np.transpose(expected[name][kind])
            found = gmwm.deviations(x, 1.0, [kind], tau, confidence=0.683)
            reach = found.tau[kind].size
            np.testing.assert_allclose(found.lower[kind], low[:reach], rtol=0.15)
            np.testing.assert_allclose(found.upper[kind], high[:reach], rtol=0.15)


@pytest.mark.parametrize("n", [8, 9, 31, 100, 1000])
@pytest.mark.parametrize(
    "series",
    [
        lambda n: noise(n),
        lambda n: np.cumsum(noise(n) - 5.0),
        lambda n: np.cumsum(np.cumsum(noise(n) - 5.0)),
        lambda n: np.diff(noise(n + 2), 2),
        lambda n: np.arange(n) % 2.0,
        lambda n: RateRamp(1.0).simulate(n, 1.0, 0) + 1e-9 * noise(n),
        lambda n: np.where(np.arange(n) == n // 2, 1.0, 0.0),
    ],
    ids=["white", "walk", "double walk", "differences", "toggling", "ramp", "one spike"],
)
def test_intervals_are_numbers_for_any_series(series, n):
    found = gmwm.deviations(series(n), 1.0)
    for kind in KINDS:
        low, value, high = found.lower[kind], found.deviation[kind], found.upper[kind]
        assert np.all(np.isfinite(low) & np.isfinite(value) & np.isfinite(high))
        assert np.all((low >= 0.0) & (low <= high))
        assert low.shape == value.shape == high.shape == found.tau[kind].shape


def test_a_higher_confidence_makes_wider_intervals():
    narrow, wide = (gmwm.deviations(noise(300), 1.0, confidence=c) for c in (0.68, 0.99))
    for kind in KINDS:
        assert np.all(wide.lower[kind] < narrow.lower[kind])
        assert np.all(wide.upper[kind] > narrow.upper[kind])


# -- looks ----------------------------------------------------------------------------------------


@pytest.fixture
def gyro():
    return Channel("gyro_x", 1e-3 * noise(5000), 0.01, "gyro", "rad/s")


def test_to_dict_is_json(gyro):
    found = gmwm.deviations(gyro)
    content = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert (content["n"], content["dt"], content["unit"]) == (5000, 0.01, "rad/s")
    assert list(content["kinds"]) == list(KINDS)
    for kind in KINDS:
        for part in ("tau", "deviation", "lower", "upper"):
            assert content["kinds"][kind][part] == getattr(found, part)[kind].tolist()


# -- bad input ------------------------------------------------------------------------------------

GAPS = np.where(np.arange(100) % 40 == 7, np.nan, noise(100))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((noise(100),), "the sampling rate is missing: give it in Hz, as in rate=100, or dt=0.01"),
        ((noise(100), 0.0), "dt = 0.0: give a positive sampling interval"),
        ((noise(7), 1.0), "shape (7,): give one series of 8 samples or more"),
        ((np.ones((100, 2)), 1.0), "shape (100, 2): give one series"),
        ((["a"] * 100, 1.0), "something that is not a number"),
        ((np.ones(100), 1.0), "is constant (1)"),
        ((np.where(np.arange(100) == 3, np.inf, 1.0), 1.0), "1 infinite samples, the first at"),
        ((GAPS, 1.0), "the series has 3 missing samples: cut it to a part without any, or use"),
        ((Channel("gyro_x", GAPS, 1.0),), "channel 'gyro_x' has 3 missing samples"),
        ((noise(100), 1.0, ["allan"]), "kind 'allan' is not known: choose from overlapping,"),
        ((noise(100), 1.0, []), "no kind of deviation is given: choose from overlapping,"),
        ((noise(100), 1.0, KINDS, "all"), "tau = 'all': give octave, decade or averaging times"),
        ((noise(100), 1.0, KINDS, [0.0]), "give positive averaging times in seconds"),
        ((noise(100), 1.0, KINDS, []), "give positive averaging times in seconds"),
        ((noise(100), 1.0, KINDS, [np.nan]), "give positive averaging times in seconds"),
        ((noise(100), 1.0, KINDS, ["x"]), "give averaging times in seconds"),
        ((noise(100), 0.1, KINDS, [4.0]), "4 s is too long for the modified Allan deviation of "
         "100 samples: give at most 3.3 s"),
    ],
)  # fmt: skip
def test_bad_input(arguments, words):
    with pytest.raises(InputError) as caught:
        gmwm.deviations(*arguments)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("confidence", [0.0, 1.0, 95.0, np.nan])
def test_confidence_that_is_none(confidence):
    with pytest.raises(InputError, match="give a number between 0 and 1"):
        gmwm.deviations(noise(100), 1.0, confidence=confidence)
