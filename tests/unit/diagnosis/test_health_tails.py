"""Noise of heavy tails, distinguished from outliers beside Gaussian noise."""

import numpy as np
import pytest

import gmwm
from gmwm.diagnosis.events import Tails, find_events, heavy_tails
from gmwm.diagnosis.innovations import innovations
from marks import every, slow

N = 36_000


def heavy(law, n, rng):
    if law == "laplace":
        return rng.laplace(size=n)
    if law == "logistic":
        return rng.logistic(size=n)
    return rng.standard_t(int(law[1:]), n)


def contaminated(share, size, n, rng):
    return rng.standard_normal(n) * np.where(rng.random(n) < share, size, 1.0)


def bursts(share, size, n, rng, length=10):
    x = rng.standard_normal(n)
    for start in rng.integers(0, n - length, int(share * n / length)):
        x[start : start + length] *= size
    return x


def with_walk(noise, rng):
    return noise + np.cumsum(rng.standard_normal(noise.size)) * 2e-3


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("law", ["laplace", "t3", "t4", "t5", "t8", "logistic"])
def test_heavy_tails_are_recognised(record, law, seed):
    rng = np.random.default_rng(seed)
    found = gmwm.health(record(gyro_x=with_walk(heavy(law, N, rng), rng)))
    (notice,) = found.of("gyro_x", "heavy-tails")
    assert notice.severity == "note"
    assert notice.values["kurtosis"] > 0.5
    assert not found.of("gyro_x", "outliers")
    assert found.outliers("gyro_x") == 0.0
    # Independent samples pass the threshold of events in one of a thousand channels.
    assert not found.events("gyro_x")


@pytest.mark.parametrize("law", ["student", "power"])
def test_the_shape_is_that_of_the_law(law):
    rng = np.random.default_rng(3)
    x = rng.standard_t(4, 200_000) if law == "student" else rng.laplace(size=200_000)
    found = heavy_tails(innovations(x, 0.0))
    assert found.law == law
    # Prediction errors hold a seventeenth of other samples, which takes some of the tails.
    assert found.shape == pytest.approx({"student": 4.0, "power": 1.0}[law], rel=0.15)


@pytest.mark.parametrize(
    ("share", "size"),
    every(3, [(0.01, 3.0), (0.005, 6.0), (0.01, 10.0), (0.05, 100.0), (0.05, 3.0), (0.1, 10.0),
              (0.1, 5.0)]),
)  # fmt: skip
def test_outliers_are_none_of_the_noise(record, share, size):
    rng = np.random.default_rng(4)
    found = gmwm.health(record(gyro_x=with_walk(contaminated(share, size, N, rng), rng)))
    assert not found.of("gyro_x", "heavy-tails")
    assert found.of("gyro_x", "outliers")


@pytest.mark.parametrize(("share", "size"), [(0.01, 10.0), (0.05, 10.0)])
def test_bursts_are_none_of_the_noise(share, size):
    rng = np.random.default_rng(5)
    assert heavy_tails(innovations(bursts(share, size, N, rng), 0.0)) is None


@pytest.mark.parametrize("law", ["t3", "laplace"])
def test_shocks_are_found_in_heavy_tails(law):
    rng = np.random.default_rng(6)
    x = heavy(law, N, rng)
    x[20_000:20_060] += 30.0 * np.std(x) * np.sin(np.arange(60.0))
    errors = innovations(x, 0.0)
    events = find_events(errors, heavy_tails(errors))
    assert len(events) == 1
    assert events[0][0] <= 20_000 < 20_050 <= events[0][1]


def test_the_distance_is_passed_with_the_chance():
    for tails in (Tails("student", 3.0, 0.8), Tails("power", 1.0, 0.8)):
        for chance in (0.3, 1e-3, 1e-9):
            distance = tails.distance(chance)
            assert tails.beyond(np.array([distance]))[0] == pytest.approx(chance, rel=1e-6)


@pytest.mark.parametrize("size", [10.0, slow(100.0)])
def test_what_outliers_leave_is_white(record, size):
    # Samples cut off about a level that follows them would depend on each other: 11 % of variance.
    rng = np.random.default_rng(7)
    recording = record(gyro_x=contaminated(0.08, size, 200_000, rng))
    clean = gmwm.health(recording).masked(recording)["gyro_x"]
    wv = gmwm.wavelet_variance(clean)
    level = 8
    ratio = wv.variance[level] / wv.variance[0] * 2.0**level
    assert abs(ratio - 1.0) < 4.0 * np.sqrt(2.0 / wv.dof[level])
