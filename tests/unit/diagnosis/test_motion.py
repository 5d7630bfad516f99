"""When a recording moves: from means made by hand, and of records with steps at known places."""

import numpy as np
import pytest

import gmwm
from gmwm.diagnosis import tuning
from gmwm.diagnosis.motion.motion import (
    Motion,
    Move,
    _angle,
    _changing,
    _fastest,
    _runs,
    _still,
    _white,
    find_motion,
    is_moved_with,
)
from gmwm.diagnosis.motion.notices import motion_notices

G, DT = 9.80665, 0.05
SIZE = max(round(tuning.MOTION_BLOCK / DT), tuning.FEWEST_OF_MOTION)
K = tuning.SHORTEST_STATIC


def record(rate=(), tilt=(), seconds=120.0, seed=1):
    """A recording that turns about z, (begin, end, rad/s), or leans, (from, rad), once each."""
    rng = np.random.default_rng(seed)
    n = round(seconds / DT)
    gyro, accel = 1e-3 * rng.normal(size=(3, n)), 1e-2 * rng.normal(size=(3, n))
    time = DT * np.arange(n)
    for begin, end, size in rate:
        gyro[2, (time >= begin) & (time < end)] += size
    angle = np.zeros(n)
    for begin, size in tilt:
        angle[time >= begin] = size
    accel[0] += G * np.sin(angle)
    accel[2] += G * np.cos(angle)
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    return gmwm.Recording.from_arrays(dict(zip(names, [*gyro, *accel], strict=True)), 1 / DT, units)


@pytest.mark.parametrize(("angle", "blocks"), [(0.3, 2 * K), (-0.02, 3 * K), (3.0, 2 * K)])
def test_the_angle_of_gravity_between_the_first_and_the_last_blocks(angle, blocks):
    force = np.tile([0.0, 0.0, G], (blocks, 1))
    force[-K:] = G * np.array([np.sin(angle), 0.0, np.cos(angle)])
    assert _angle(force) == pytest.approx(abs(angle))
    assert _angle(0.51 * force) == pytest.approx(abs(angle))
    assert _angle(0.49 * force) == 0.0  # no gravity
    assert _angle(force[:, :2]) == 0.0
    assert _angle(force[-(2 * K - 1) :]) == 0.0


def test_runs_are_long_enough_to_know_a_level():
    chosen = np.zeros(100, dtype=bool)
    chosen[:K] = chosen[20 : 19 + K] = chosen[100 - K :] = True
    assert _runs(chosen) == [(0, K), (100 - K, 100)]
    assert _runs(np.ones(K, dtype=bool)) == [(0, K)]
    assert _runs(np.ones(K - 1, dtype=bool)) == []


def test_still_are_the_runs_nearest_to_no_rate():
    rate = np.zeros((60, 3))
    runs = [(0, 20), (20, 40), (40, 60)]
    for size, still in ((0.98, runs), (1.02, [runs[0], runs[2]])):
        rate[20:40, 1] = size * tuning.TURNS
        assert _still(rate, runs) == still
    rate[20:40] = [0.0, 0.0, 0.3]
    rate[40:] = [0.0, 0.0, 0.31]
    assert _still(rate, runs) == [runs[0]]
    rate[:20] = [0.0, -0.5, 0.0]
    assert _still(rate, runs) == runs[1:]
    assert _still(rate[:, :0], runs) == runs and _still(rate, []) == []


def test_the_fastest_rate_is_that_beyond_rest():
    rate = np.tile([0.1, 0.0, 0.0], (50, 1))
    rate[30] = [0.1, 3.0, 4.0]
    assert _fastest(rate, [(0, 20)]) == pytest.approx(5.0)
    assert _fastest(rate, [(0, 20)], slice(0, 30)) == pytest.approx(0.0)
    assert _fastest(rate, []) == pytest.approx(5.0)
    assert _fastest(rate[:, :0], []) == 0.0


@pytest.mark.parametrize(("change", "found"), [(1.01, True), (0.99, False), (-1.01, True)])
def test_blocks_across_which_the_level_changes(change, found):
    series = np.where(np.arange(60) >= 30, change, 0.0)
    expected = np.zeros(60, dtype=bool)
    expected[25:35] = found  # a difference over five blocks has both of its ends
    assert _changing(series, 1.0, 0.0).tolist() == expected.tolist()
    assert not np.any(_changing(series, 1.0, 0.2))  # noise does that


@pytest.mark.parametrize("size", [1, 16])
def test_the_deviation_of_a_mean_by_the_fast_noise(size):
    rng = np.random.default_rng(2)
    values = 3.0 * rng.normal(size=100_000) + np.linspace(0.0, 100.0, 100_000)
    values[500:5000] = 7.0
    values[::7] = np.nan
    assert _white(values, size) == pytest.approx(3.0 / np.sqrt(size), rel=0.02)
    assert _white(np.ones(10), size) == 0.0


def test_a_channel_says_something_of_motion_if_half_of_it_is_there_and_in_range():
    def of(*values):
        return gmwm.Channel("gyro_x", np.array(values, dtype=float), DT, "gyro", "rad/s")

    assert is_moved_with(of(1.0, np.nan)) and not is_moved_with(of(1.0, np.nan, np.nan))
    assert is_moved_with(of(-0.9e6)) and not is_moved_with(of(-1.1e6))


@pytest.mark.parametrize("size", [0.05, -0.3])
def test_a_turn_is_found_where_it_is(size):
    found = find_motion(record(rate=[(40.0, 60.0, size)]))
    (move,) = found.moves
    (first, then) = found.static
    assert first == (0.0, pytest.approx(move.start)) and then == (pytest.approx(move.stop), 120.0)
    # Means of five seconds know the ends to that.
    assert 40.0 - 6.0 <= move.start <= 40.0 and 60.0 <= move.stop <= 66.0
    assert move.rate == pytest.approx(abs(size), rel=0.01)
    assert move.tilt < 0.01 and not move.is_tilt
    assert move.length == pytest.approx(move.stop - move.start)


@pytest.mark.parametrize(("angle", "moves"), [(0.01, 0), (0.05, 1), (-0.4, 1)])
def test_a_tilt_is_found_and_measured(angle, moves):
    found = find_motion(record(tilt=[(70.0, angle)]))
    assert len(found.moves) == moves
    for move in found.moves:
        assert move.tilt == pytest.approx(abs(angle), abs=0.002)
        assert move.start <= 70.0 <= move.stop <= move.start + 12.0
        assert move.is_tilt


@pytest.mark.parametrize(("seconds", "moves"), [(29.9, 0), (31.0, 1)])
def test_too_short_a_record_is_not_examined(seconds, moves):
    assert len(find_motion(record(rate=[(15.0, 99.0, 0.3)], seconds=seconds)).moves) == moves


def test_what_touches_a_move():
    # Two turns and a tilt of 5 s; of events: in the tilt twice, at its edges, and elsewhere.
    tilt = Move(50.0, 55.0, 5.0, 0.0, 0.1)
    turn = Move(80.0, 90.0, 10.0, 0.3, 0.0)
    assert tilt.is_tilt and not turn.is_tilt
    assert not Move(50.0, 55.0, 30.0, 0.0, 0.1).is_tilt
    assert Move(50.0, 55.0, 29.9, 0.0, 0.0176).is_tilt
    assert not Move(50.0, 55.0, 5.0, 0.0, 0.0174).is_tilt
    motion = Motion((tilt, turn), ((0.0, 50.0), (55.0, 80.0), (90.0, 100.0)))
    events = ((10, 20), (480, 499), (490, 500), (520, 530), (550, 560), (551, 570), (810, 820))
    assert motion.joined(events, 0.1) == (
        (10, 20), (480, 499), (490, 560), (551, 570), (810, 820),
    )  # fmt: skip
    assert motion.outside(events, 0.1) == ((10, 20), (480, 499), (551, 570))
    assert Motion((tilt, turn), ()).outside(events, 0.1) == events


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (2, "from 10 to 12 s, 20 to 23 s"),
        (3, "from 10 to 12 s, 20 to 23 s, 30 to 34 s"),
        (4, "from 20 to 23 s, 30 to 34 s, 40 to 45 s, and 1 shorter one"),
        (5, "from 30 to 34 s, 40 to 45 s, 50 to 56 s, and 2 shorter ones"),
    ],
)
def test_the_three_longest_moves_are_named_and_the_others_counted(count, words):
    moves = [Move(10.0 * k, 11.0 * k + 1.0, k + 1.0, 0.3, 0.0) for k in range(1, count + 1)]
    (notice,) = motion_notices(Motion(tuple(moves), ()))
    assert notice.text.endswith(words)
