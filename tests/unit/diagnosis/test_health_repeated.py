"""Samples that are written several times."""

from __future__ import annotations

import numpy as np
import pytest

import gmwm


def held(times, n, seed=1, first=0, step=0.0):
    values = np.random.default_rng(seed).normal(size=n // times + 2)
    if step:
        values = step * np.rint(values / step)
    return np.repeat(values, times)[times - first :][:n]


@pytest.mark.parametrize(("times", "first"), [(2, 0), (2, 1), (5, 3), (40, 0)])
@pytest.mark.parametrize("step", [0.0, 0.5])
def test_repeated_samples_are_named_with_their_own_rate(record, times, first, step):
    n = 20_000
    x = held(times, n, first=first, step=step)
    gyro = np.random.default_rng(2).normal(size=n)
    found = gmwm.health(record(rate=200.0, gyro_x=gyro, accel_x=x))
    (notice,) = found.of("accel_x", "repeated-samples")
    assert notice.severity == "note"
    assert notice.values == {"times": times, "rate": 200.0 / times}
    assert found.repetition("accel_x") == gmwm.diagnosis.Repetition(times, first)
    assert found.repetition("gyro_x") is None
    assert not found.events("accel_x")
    assert {notice.code for notice in found.of("accel_x")} <= {
        "repeated-samples",
        "rounding",
        "clean",
    }


def test_they_are_seen_beside_missing_rows(record):
    x = held(2, 20_000)
    x[4001:4020] = np.nan
    assert gmwm.health(record(accel_x=x)).repetition("accel_x").times == 2


@pytest.mark.parametrize("step", [0.0, 1.0, 4.0])
def test_samples_that_are_not_repeated(record, step):
    for seed in range(10):
        x = held(1, 5000, seed=seed, step=step)
        assert gmwm.health(record(accel_x=x)).repetition("accel_x") is None


def test_a_shock_among_them_is_found_where_it_is(record):
    x = held(4, 20_000, first=3)
    x[8003:8007] += 60.0
    found = gmwm.health(record(accel_x=x))
    ((start, stop),) = found.events("accel_x")
    assert start <= 8003 < 8007 <= stop
    assert (start - 3) % 4 == 0
    masked = found.masked(record(accel_x=x))["accel_x"]
    assert masked.missing == stop - start


def test_a_round_trip(record, tmp_path):
    found = gmwm.health(record(accel_x=held(2, 5000)))
    found.save(tmp_path / "health.json")
    assert gmwm.diagnosis.Health.load(tmp_path / "health.json").channels == found.channels
