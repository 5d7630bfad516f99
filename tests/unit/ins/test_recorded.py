"""Stretches of real recordings as sensor errors."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gmwm.errors import InputError
from gmwm.ins import Recorded
from gmwm.ins.sensors import AXES
from gmwm.readers.recording import Recording

UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


def recording(values, rate=10.0, source="static.csv", axes=AXES):
    arrays = dict(zip(axes, np.asarray(values, dtype=float).T, strict=True))
    return Recording.from_arrays(arrays, rate, UNITS, source=source)


def noise(n, seed=0):
    return np.random.default_rng(seed).standard_normal((n, 6)) + 10.0 * np.arange(6)


@given(st.lists(st.integers(1, 400), min_size=1, max_size=4), st.floats(0.1, 30.0))
@settings(max_examples=60, deadline=None)
def test_stretches_cover_what_they_can_and_never_overlap(lengths, duration):
    # Every sample has a value of its own, known again without its mean.
    recordings, whole = [], []
    for i, length in enumerate(lengths):
        values = np.arange(length)[:, None] ** 1.5 + 1e6 * i + np.arange(6)
        recordings.append(recording(values, source=f"{i}.csv"))
        whole.append(values - values.mean(axis=0))
    n = round(duration / recordings[0].dt)
    counts = [length // n for length in lengths]
    if not any(counts):
        with pytest.raises(InputError, match="shorten it or record longer"):
            Recorded.of(recordings, duration)
        return
    found = Recorded.of(recordings, duration)
    assert found.available == sum(counts)
    expected = np.concatenate(
        [each[: count * n] for each, count in zip(whole, counts, strict=True)]
    )
    np.testing.assert_allclose(np.concatenate(found.stretches), expected, rtol=1e-12, atol=1e-6)


def test_the_mean_of_each_recording_is_taken_off():
    found = Recorded.of([recording(noise(100)), recording(noise(150, 1) + 5.0)], 10.0)
    assert found.available == 2
    np.testing.assert_allclose(found.stretches[0].mean(axis=0), 0.0, atol=1e-12)
    assert np.abs(found.stretches[1].mean(axis=0)).max() < 1.0
    assert found.source == "static.csv, static.csv"


@pytest.mark.parametrize("hole", [slice(0, 7), slice(40, 55), slice(93, 100), slice(0, 99)])
def test_gaps_are_filled_with_a_neighbour(hole):
    values = noise(100)
    values[hole, 5] = np.nan
    found = Recorded.of(recording(values), 10.0).stretches[0]
    assert np.all(np.isfinite(found))
    filled = values[:, 5].copy()
    filled[hole] = filled[hole.start - 1] if hole.start else filled[hole.stop]
    np.testing.assert_allclose(found[:, 5], filled - filled.mean(), atol=1e-12)
    np.testing.assert_allclose(found[:, 0], values[:, 0] - values[:, 0].mean(), atol=1e-12)


def test_spread_of_the_bias_is_that_of_means_over_a_minute():
    """White noise of unit variance, and a slow sine: 600 samples a minute."""
    rng = np.random.default_rng(2)
    n = 600 * 400
    sine = 0.5 * np.sin(2.0 * np.pi * np.arange(n) / n)
    values = rng.standard_normal((n, 6))
    values[:, 1] += sine
    found = Recorded.of(recording(values), 100.0).bias_sd
    # Relative error of a root mean square of 400: 1 / sqrt(800).
    assert found["gyro_x"] == pytest.approx(1.0 / np.sqrt(600.0), rel=4.0 / np.sqrt(800.0))
    assert found["gyro_y"] == pytest.approx(np.sqrt(0.125 + 1.0 / 600.0), rel=0.05)
    assert list(found) == list(AXES)


def test_draw_gives_the_stretch_of_a_run():
    found = Recorded.of(recording(noise(300)), 10.0)
    rng = np.random.default_rng(0)
    drawn = found.draw(2, 80, 0.1, rng)
    np.testing.assert_array_equal(drawn.total, found.stretches[2][:80])
    assert drawn.slow is None
    # Nothing is drawn: the noise of the fixes does not depend on the source.
    assert rng.bit_generator.state == np.random.default_rng(0).bit_generator.state


@pytest.mark.parametrize(("n", "dt"), [(101, 0.1), (80, 0.05), (50, 0.2)])
def test_a_trajectory_that_does_not_fit(n, dt):
    found = Recorded.of(recording(noise(300)), 10.0)
    with pytest.raises(InputError, match="stretches of 100 samples at 10 Hz do not fit"):
        found.draw(0, n, dt, np.random.default_rng(0))


def test_what_cannot_be_used():
    good = recording(noise(100))
    with pytest.raises(InputError, match=r"slow.csv has 9 Hz and static.csv 10 Hz"):
        Recorded.of([good, recording(noise(100), rate=9.0, source="slow.csv")], 5.0)
    five = recording(noise(100)[:, :5], axes=AXES[:5])
    with pytest.raises(InputError, match="there is no channel accel_z"):
        Recorded.of(five, 5.0)
    empty = noise(100)
    empty[:, 1] = np.nan
    with pytest.raises(InputError, match="gyro_y has no samples"):
        Recorded.of(recording(empty), 5.0)
    with pytest.raises(InputError, match=r"longest recording has 10 s, less than the 10\.1 s"):
        Recorded.of([good, recording(noise(50))], 10.1)
    with pytest.raises(InputError, match="no recordings given"):
        Recorded.of([], 5.0)
    for duration in (0.0, -3.0, np.nan):
        with pytest.raises(InputError, match="duration"):
            Recorded.of(good, duration)
