"""When a recording moves: from means made by hand, and of records with steps at known places."""

import numpy as np
import pytest

import gmwm
from gmwm.diagnosis.motion import Motion, Move, find_motion, is_moved_with

G, DT = 9.80665, 0.05


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


def test_the_three_longest_moves_are_named_and_the_others_counted():
    turns = [(60.0 * k, 60.0 * k + 5.0 * k, 0.3) for k in range(1, 6)]
    (notice,) = gmwm.health(record(rate=turns, seconds=420.0)).of(code="not-static")
    assert notice.values["moves"] == 5
    assert "it turns at up to 17.2 deg/s" in notice.text
    assert notice.text.endswith(", and 2 shorter ones")
