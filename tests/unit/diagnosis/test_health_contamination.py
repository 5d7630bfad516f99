"""Outliers all over the record, told apart from shocks, rounding and noise."""

import numpy as np
import pytest

import gmwm
from gmwm.diagnosis.events import contamination
from gmwm.diagnosis.innovations import Innovations
from marks import every

DATA_RATE = 100.0


def recording(values):
    return gmwm.Recording.from_arrays({"gyro_x": values}, DATA_RATE, {"gyro": "rad/s"})


def noise(n, seed):
    return np.random.default_rng(seed).standard_normal(n)


@pytest.mark.parametrize(
    ("share", "size"),
    every(2, [(0.005, 6.0), (0.01, 3.0), (0.02, 20.0), (0.05, 10.0), (0.05, 1000.0)]),
)
def test_the_share_is_that_of_the_outliers_that_can_be_told(share, size):
    rng = np.random.default_rng(1)
    n = 100_000
    bad = rng.random(n) < share
    x = rng.standard_normal(n) * np.where(bad, size, 1.0)
    found = gmwm.health(recording(x))
    told = found.outliers("gyro_x")
    assert 1e-3 < told < 1.5 * share
    (notice,) = found.of(code="outliers")
    assert notice.severity == "warning"
    assert notice.values == {"share": told}
    assert f"{100 * told:.2g} % of the samples" in notice.text
    assert found.to_dict()["channels"]["gyro_x"]["outliers"] == told


@pytest.mark.parametrize("n", [100, 777, 5000, 100_000])
def test_gaussian_noise_has_none(n):
    # False alarms are one in a thousand channels: in 20 of them one would be much.
    alarms = sum(gmwm.health(recording(noise(n, s))).outliers("gyro_x") > 0.0 for s in range(5))
    assert alarms == 0


@pytest.mark.parametrize("kind", ["walk", "flicker", "rounded", "louder"])
def test_other_noise_is_no_contamination(kind):
    rng = np.random.default_rng(6)
    n = 60_000
    x = rng.standard_normal(n)
    if kind == "walk":
        x = np.cumsum(x)
    elif kind == "flicker":
        x = gmwm.simulate(gmwm.BiasInstability(1.0), n, 0.01, 3)
    elif kind == "rounded":
        x = 2.0 * np.rint(0.5 * x)
    else:
        x[30_000:] *= 2.0
    assert gmwm.health(recording(x)).outliers("gyro_x") == 0.0


def test_each_event_counts_once():
    n = 10_000
    values = np.zeros(n)
    values[100:140] = 10.0
    values[5000:5030:2] = 5.0  # 15 beyond four
    errors = Innovations(values, np.ones(n, dtype=bool), np.ones(n), 0.0)
    assert contamination(errors, ()) == pytest.approx(55 / n)
    assert contamination(errors, ((90, 160),)) == pytest.approx(16 / n)
    # What rounding can add is taken from the errors.
    rounded = Innovations(values, np.ones(n, dtype=bool), np.ones(n), 1.5)
    assert contamination(rounded, ((90, 160),)) == 0.0


def test_masking_but_for_some_channels():
    x = noise(5000, 3)
    x[2000] = 60.0
    rec = gmwm.Recording.from_arrays({"gyro_x": x, "gyro_y": x.copy()}, 100.0, {"gyro": "rad/s"})
    masked = gmwm.health(rec).masked(rec, but=["gyro_y"])
    assert masked["gyro_x"].missing > 0
    assert masked["gyro_y"].is_complete


@pytest.mark.parametrize(
    ("jitter", "severity"), [(None, None), (0.01, None), (0.15, "note"), (0.4, "warning")]
)
def test_an_uneven_clock_is_told(jitter, severity):
    from dataclasses import replace

    rec = replace(recording(noise(2000, 1)), jitter=jitter)
    found = gmwm.health(rec).of(code="clock")
    assert [one.severity for one in found] == ([severity] if severity else [])
    if found:
        assert f"{100 * jitter:.2g} % rms" in found[0].text
