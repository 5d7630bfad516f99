"""Rows that a recording has twice."""

import numpy as np
import pytest

import gmwm
from gmwm import RandomWalk, WhiteNoise
from gmwm.diagnosis.repeats import Copy, find_copies

RATE = 100.0


def recorded(columns):
    names = ("gyro_x", "gyro_y", "gyro_z")
    return gmwm.Recording.from_arrays(
        dict(zip(names, columns, strict=False)), RATE, {"gyro": "rad/s"}
    )


def noise(n, channels=3, step=0.0, seed=1):
    rows = np.random.default_rng(seed).normal(size=(channels, n))
    return np.round(rows / step) * step if step else rows


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("step", [0.0, 0.5, 2.0, 8.0])
def test_noise_has_no_copies_however_coarse(channels, step):
    assert find_copies(recorded(noise(200_000, channels, step))) == ()


@pytest.mark.parametrize("step", [0.1, 1.0, 50.0])
def test_a_coarse_walk_has_no_copies(step):
    walk = np.cumsum(noise(200_000, 1), axis=1)
    assert find_copies(recorded(np.round(walk / step) * step)) == ()


@pytest.mark.parametrize("step", [0.0, 2.0])
def test_a_copy_is_found_with_its_very_ends(step):
    rows = noise(50_000, 3, step)
    rows[:, 30_000:33_000] = rows[:, 4_000:7_000]
    rows[0, [29_999, 33_000]] += 20.0
    assert find_copies(recorded(rows)) == (Copy(30_000, 33_000, 4_000),)


def test_buffers_of_64_rows_that_are_sent_twice_are_nearly_all_found():
    rows = noise(64 * 200).reshape(3, 200, 64).repeat(2, axis=1).reshape(3, -1)
    found = find_copies(recorded(rows))
    # Each is missed with a chance of (7/8)^33 = 0.012: 2.4 of 200, and 10 with one of 2e-4.
    assert len(found) >= 190
    assert all(each.first == each.start - 64 and each.stop == each.start + 64 for each in found)


def test_what_is_in_one_channel_only_is_no_copy():
    rows = noise(50_000)
    rows[:2, 30_000:33_000] = rows[:2, 4_000:7_000]
    assert find_copies(recorded(rows)) == ()


def test_stuck_and_missing_stretches_and_slow_square_waves_are_no_copies():
    rows = noise(50_000)
    rows[:, 10_000:12_000] = rows[:, 20_000:22_000] = 0.5
    rows[:, 30_000:32_000] = rows[:, 40_000:42_000] = np.nan
    assert find_copies(recorded(rows)) == ()
    assert find_copies(recorded([np.where(np.arange(50_000) // 50 % 2, 1.0, -1.0)])) == ()


@pytest.mark.parametrize("n", [0, 1, 31, 32, 33, 64, 1024, 1025])
def test_short_recordings(n):
    rows = noise(n)
    again = np.hstack([rows, rows])
    found = find_copies(recorded(again))
    assert found in ((), (Copy(n, 2 * n, 0),))
    assert found or n < 128


def test_health_tells_of_copies_and_leaves_them_out():
    rows = noise(30_000)
    recording = recorded(np.hstack([rows, rows[:, :9_000]]))
    health = gmwm.health(recording)
    (found,) = health.of(code="rows-copied")
    assert found.severity == "warning"
    assert found.values == {
        "samples": 9_000.0, "count": 1.0, "longest": 90.0, "start": 300.0, "first": 0.0,
    }  # fmt: skip
    assert health.events("gyro_y") == ((30_000, 39_000),)
    masked = health.masked(recording)
    assert masked["gyro_x"].missing == 9_000
    assert masked.notices[-1].text.startswith("9,000 samples of copies, spikes")


def test_a_file_that_has_its_beginning_again_is_calibrated_without_it():
    n = 90_000
    truth = WhiteNoise(1e-4) + RandomWalk(2e-6)
    x = truth.simulate(n, 1 / RATE, seed=4)
    model = WhiteNoise() + RandomWalk()
    once = gmwm.calibrate(recorded([x]), model)
    twice = gmwm.calibrate(recorded([np.concatenate([x, x[: n // 2]])]), model)
    (found,) = (each for each in twice.notices if each.code == "rows-copied")
    assert found.hint.startswith("left out; ")
    np.testing.assert_allclose(
        twice["gyro_x"].wv.variance[:14], once["gyro_x"].wv.variance[:14], rtol=1e-3
    )
    kept = gmwm.calibrate(recorded([np.concatenate([x, x[: n // 2]])]), model, screening=["lines"])
    (found,) = (each for each in kept.notices if each.code == "rows-copied")
    assert found.hint.startswith("kept, as requested; ")


def test_a_file_that_is_mostly_copies_is_refused_with_the_cause():
    x = noise(20_000, 1)
    with pytest.raises(gmwm.InputError, match="are exact copies of the rows"):
        gmwm.calibrate(recorded(np.tile(x, 4)))


def test_the_same_recording_twice_is_not_two():
    rows = noise(40_000)
    one, other = recorded(rows), recorded(np.hstack([noise(500, seed=2), rows[:, 10_000:]]))
    with pytest.raises(
        gmwm.InputError, match="from 100 s on and another from 5 s on have the same"
    ):
        gmwm.calibrate([one, other])
    with pytest.raises(gmwm.InputError, match="from 0 s on and another from 0 s on"):
        gmwm.calibrate([one, recorded(noise(40_000, seed=3)), one])
