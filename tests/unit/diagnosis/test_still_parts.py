"""Parts of the search for stretches at rest, from blocks made by hand."""

import numpy as np
import pytest

from gmwm import Channel, Recording, health
from gmwm.diagnosis import tuning
from gmwm.diagnosis.still.loudness import _changes, _split, loudness
from gmwm.diagnosis.still.stretches import (
    Still,
    _floor,
    _has_band,
    _of_one_level,
    _quiet,
    _runs,
    _vibrates,
    find_still,
    rest_of,
)

LONG = tuning.BLOCKS_OF_FLOOR
SIZE = 25


def test_a_timeline_shows_where_it_rests():
    found = Still(((0.0, 25.0), (50.0, 50.1)), 25.0, ((75.0, 100.0),), 100.0)
    width = len(found.timeline)
    marks = list("." * width)
    marks[: width // 4] = "#" * (width // 4)
    marks[width // 2] = "#"
    marks[3 * width // 4 :] = "~" * (width - 3 * width // 4)
    assert found.timeline == "".join(marks)
    assert found.total == pytest.approx(25.1)
    assert found.notice().values == {
        "stretches": 2, "total": pytest.approx(25.1), "longest": 25.0, "duration": 100.0,
    }  # fmt: skip


@pytest.mark.parametrize(("count", "more"), [(8, None), (9, " and 1 more"), (12, " and 4 more")])
def test_eight_stretches_are_listed(count, more):
    spans = tuple((20.0 * k, 20.0 * k + 10.0) for k in range(count))
    text = Still(spans, 10.0, (), 300.0).notice().text
    assert text.count(" to ") == 8 and ("more" in text) is (more is not None)
    assert more is None or more in text


def quiet_of(*spans, count=100):
    found = np.zeros(count, dtype=bool)
    for a, b in spans:
        found[a:b] = True
    return found


@pytest.mark.parametrize(
    ("spans", "runs"),
    [
        ([(0, 100)], [(0, 100)]),
        ([(10, 40)], [(11, 39)]),
        ([(0, 40), (44, 100)], [(0, 100)]),  # a shock of four blocks is bridged
        ([(0, 40), (45, 100)], [(0, 39), (46, 100)]),
        ([(0, LONG), (LONG + 2, 100)], [(0, 100)]),
        ([(0, LONG - 1), (LONG + 2, 100)], [(0, LONG - 2), (LONG + 3, 100)]),
        ([(0, 60), (62, 62 + LONG)], [(0, 61 + LONG)]),
        ([(0, 60), (62, 61 + LONG)], [(0, 59), (63, 60 + LONG)]),
        ([(10, 12)], []),
        ([(0, 1)], []),
    ],
)
def test_runs_bridge_shocks_and_lose_a_block_at_their_ends(spans, runs):
    assert _runs(quiet_of(*spans), 100, np.zeros((100, 3))) == runs


@pytest.mark.parametrize(("step", "joined"), [(0.98, True), (1.02, False), (-1.02, False)])
def test_what_turned_in_between_is_no_shock(step, joined):
    rate = np.zeros((100, 3))
    rate[42:, 1] = step * tuning.TURNS
    found = _runs(quiet_of((0, 40), (44, 100)), 100, rate)
    assert found == ([(0, 100)] if joined else [(0, 39), (45, 100)])


def test_the_floor_is_that_of_the_quietest_seconds_and_quiet_is_near_it():
    rng = np.random.default_rng(1)
    scatter = rng.chisquare(SIZE - 1, (400, 6)) / (SIZE - 1) * np.array([1.0, 2, 3, 4, 5, 6])
    scatter[:150] *= 30.0
    scatter[300:310] *= 30.0
    floor = _floor(scatter, SIZE)
    np.testing.assert_allclose(floor, [1.0, 2, 3, 4, 5, 6], rtol=0.1)
    found = _quiet(scatter, floor, SIZE)
    reach = tuning.BLOCKS_OF_SHOCK
    assert not np.any(found[: 150 - reach]) and np.all(found[150 + reach : 300 - reach])
    assert not np.any(found[300 + reach : 310 - reach]) and np.all(found[310 + reach :])
    scatter[200] = np.nan
    assert not _quiet(scatter, floor, SIZE)[200]


@pytest.mark.parametrize(
    ("together", "axis", "quiet"),
    [(1.75, 1.75, True), (1.85, 1.85, False), (1.0, 3.4, True), (1.0, 3.6, False)],
)
def test_how_far_above_the_floor_is_quiet(together, axis, quiet):
    scatter = np.full((30, 6), together)
    scatter[:, 2] = axis
    found = _quiet(scatter, np.ones(6), 10_000)
    assert np.all(found == quiet)


def channels(count=6):
    kinds = ["gyro"] * 3 + ["accel"] * 3
    return [Channel(f"{k}_{i}", np.zeros(4), 0.01, k, "rad/s") for i, k in enumerate(kinds)][:count]


@pytest.mark.parametrize(("size", "kept"), [(0.98, 2), (1.02, 1)])
def test_runs_of_one_rate_are_kept(size, kept):
    means = np.zeros((100, 6))
    means[50:, 2] = size * tuning.TURNS
    means[50:, 5] = 9.0  # another attitude is no motion
    runs = [(0, 50), (50, 100)]
    assert _of_one_level(runs, means, np.zeros(6), channels(), SIZE) == runs[:kept]
    assert _of_one_level([], means, np.zeros(6), channels(), SIZE) == []
    short = [(0, LONG - 1), (50, 100)]  # too short to say what rest is
    assert _of_one_level(short, means, np.zeros(6), channels(), SIZE) == short[2 - kept :]


@pytest.mark.parametrize(("axis", "limit"), [(1, tuning.SWAYING_RATE), (4, tuning.SWAYS * 9.80665)])
def test_runs_that_sway_are_none(axis, limit):
    for size, calm in ((0.98, True), (1.02, False)):
        means = np.zeros((100, 6))
        means[:, axis] = size * limit * 0.5 * np.where(np.arange(100) // 4 % 2, 1.0, -1.0)
        runs = [(0, 100)]
        assert _of_one_level(runs, means, np.zeros(6), channels(), SIZE) == runs * calm


@pytest.mark.parametrize(("ratio", "shakes"), [(1.45, False), (1.55, True)])
def test_a_stretch_that_scatters_more_than_the_quietest_vibrates(ratio, shakes):
    scatter = np.ones((100, 6))
    scatter[60:, 3] = ratio
    runs = [(0, 50), (60, 100)]
    dead = [Channel("gyro_x", np.random.default_rng(1).normal(size=2500), 0.01, "gyro", "rad/s")]
    assert _vibrates(runs, dead, scatter, SIZE, 0.01) == [False, shakes]
    scatter[60:, 3] = 1.0
    for blocks, now_and_then in ((4, False), (5, True)):  # of forty
        scatter[60 : 60 + blocks, :4] = 2.0
        assert _vibrates(runs, dead, scatter, SIZE, 0.01) == [False, now_and_then]
    assert _vibrates([], dead, scatter, SIZE, 0.01) == []


@pytest.mark.parametrize(("amplitude", "band"), [(0.5, False), (1.5, True)])
def test_a_narrow_band_with_much_of_the_variance(amplitude, band):
    rng = np.random.default_rng(2)
    values = rng.normal(size=4000) + amplitude * np.sin(2.0 * np.pi * 17.0 * 0.01 * np.arange(4000))
    values[::97] = np.nan
    assert _has_band(values, 0.01) is band


def test_two_levels_are_split_where_they_meet():
    logs = np.repeat([1.0, 3.0], [17, 23]) + 0.1 * np.tile([1.0, -1.0], 20)
    assert _split(logs, 0, 40) == 17
    assert _split(logs, 10, 30) == 17
    assert _split(logs, 16, 19) == 17


def test_loud_blocks_are_those_between_two_changes():
    rng = np.random.default_rng(3)
    logs = 0.1 * rng.normal(size=400)
    logs[161:283] += 2.0
    assert _changes(logs) == [0, 161, 283, 400]
    scatter = np.exp(np.column_stack([logs, 0.1 * rng.normal(size=(400, 2))]))
    found = loudness(scatter, np.zeros(3))
    assert np.flatnonzero(found.loud).tolist() == list(range(161, 283))
    assert found.ratio == pytest.approx(np.exp(1.0), rel=0.05)
    few = loudness(scatter[:116], np.zeros(3))  # less than thirty times four blocks
    assert not few.loud.any() and few.ratio == 1.0
    assert not loudness(scatter, np.full(3, 10.0)).loud.any()  # below the step


@pytest.mark.parametrize("step", [0.0, 1e-8])
def test_zeros_written_for_lost_samples_are_no_rest(step):
    rng = np.random.default_rng(5)
    values = 1e-3 * rng.normal(size=(2, 60_000)) + 3e-4
    for start in range(2000, 60_000, 3000):
        values[:, start : start + 250] = 0.0
    if step:
        values = np.round(values / step) * step
    channels = {f"gyro_{axis}": x for axis, x in zip("xy", values, strict=True)}
    recording = Recording.from_arrays(channels, 50.0, {"gyro": "rad/s"})
    assert rest_of(recording) is None
    found = health(recording)
    assert not found.of(code="vibration")
    assert all("stuck 20 times" in found.of(name, "stuck")[0].text for name in channels)


def test_stretches_end_a_block_before_motion_and_with_the_recording():
    rng = np.random.default_rng(4)
    n = 12_007
    values = rng.normal(size=(6, n)) * np.array([[1e-3]] * 3 + [[1e-2]] * 3)
    values[5] += 9.80665
    values[2, 4000:6000] += 0.5 + rng.normal(size=2000)
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    recording = Recording.from_arrays(
        dict(zip(names, values, strict=True)), 100.0, {"gyro": "rad/s", "accel": "m/s^2"}
    )
    (begin, stop), (start, end) = find_still(recording).stretches
    assert (begin, end) == (0.0, recording.duration)
    # The block after a turn has another mean than the one before it.
    assert (stop, start) == (40.0 - tuning.STILL_BLOCK, 60.0 + 2 * tuning.STILL_BLOCK)
