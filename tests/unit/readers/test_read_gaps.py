"""Missing samples: fields that are empty, and rows that the clock says are not there."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gmwm.errors import InputError
from gmwm.readers import csv_table, read
from gmwm.readers.grid import find_jumps
from gmwm.readers.names import CANONICAL
from reading import SI, texts

GYRO = {"gyro": "rad/s"}
N = 400


def table(recording):
    return np.column_stack([channel.values for channel in recording.values()])


# -- empty fields ---------------------------------------------------------------------------------


@pytest.fixture
def edited(write, samples):
    """Write a good file with some fields replaced, by row and column of ``samples``."""

    def _edited(cells):
        path = write(samples, ",".join(CANONICAL))
        lines = path.read_text().split("\n")
        for (row, column), cell in cells.items():
            fields = lines[row + 1].split(",")
            fields[column] = cell
            lines[row + 1] = ",".join(fields)
        path.write_text("\n".join(lines))
        return path

    return _edited


@pytest.mark.parametrize(
    "cell", ["", " ", '""', "nan", "NaN", "-nan", "+NAN", "NA", "N/A", "#n/a", "null", "NONE"]
)
def test_what_stands_for_a_missing_sample(edited, samples, cell):
    recording = read(edited({(10, 1): cell, (79, 5): cell}), rate=100, units=SI)
    samples[10, 1] = samples[79, 5] = np.nan
    np.testing.assert_array_equal(table(recording), samples)
    assert recording["gyro_y"].missing == 1
    assert recording["gyro_x"].is_complete
    assert not recording["accel_z"].is_complete
    assert texts(recording) == ("gyro_y, accel_z: each 1 of 80 samples missing, in one gap",)


def test_gaps_are_counted(edited):
    cells = dict.fromkeys([(r, 3) for r in (0, 1, 2, 7, 78, 79)], "")
    recording = read(edited(cells), rate=100, units=SI)
    note = "accel_x: 6 of 80 samples missing, in 3 gaps, the longest 3 samples"
    assert texts(recording) == (note,)
    assert "accel_x: 80 samples, 0.8 s, mean" in str(recording)
    assert ", 6 missing\n" in str(recording)


def test_a_column_of_nothing(edited, samples):
    recording = read(edited({(r, 5): "" for r in range(80)}), rate=100, units=SI)
    np.testing.assert_array_equal(table(recording)[:, :5], samples[:, :5])
    assert recording["accel_z"].missing == 80
    assert texts(recording) == ("accel_z: all 80 samples missing",)


def test_an_empty_row_is_one_of_missing_samples(edited, samples):
    recording = read(edited({(33, c): "" for c in range(6)}), rate=100, units=SI)
    assert recording.n == 80
    assert all(np.flatnonzero(np.isnan(c.values)).tolist() == [33] for c in recording.values())


def test_blank_line_in_a_single_column(write, samples):
    path = write(samples[:, :1], "gx", after="\n\n")
    lines = path.read_text().split("\n")
    lines[40] = ""
    path.write_text("\n".join(lines))
    recording = read(path, rate=100, units=GYRO)
    assert np.flatnonzero(np.isnan(recording["gyro_x"].values)).tolist() == [39]
    assert recording.n == 80


@pytest.mark.parametrize("arrow", [True, False])
def test_over_many_blocks_either_way(write, monkeypatch, arrow):
    monkeypatch.setattr(csv_table.blocks, "__defaults__", (0, 1, 2000, str))
    if not arrow:
        monkeypatch.setattr(csv_table, "_parse_with_arrow", lambda *_: None)
    rng = np.random.default_rng(8)
    rows = np.round(rng.normal(size=(N, 3)), 4)
    rows[rng.random(rows.shape) < 0.2] = np.nan
    path = write(rows, "gx,gy,gz")
    words = iter(["", "NA", "nan", "null", "N/A", "None"] * N)
    path.write_text(re.sub("nan", lambda _: next(words), path.read_text()))
    np.testing.assert_array_equal(table(read(path, rate=1, units=GYRO)), rows)


def test_a_missing_time_stamp_is_refused(write, samples):
    stamps = 0.01 * np.arange(80)
    stamps[[20, 50]] = np.nan
    path = write(np.column_stack([stamps, samples[:, 0]]), "t,gx")
    with pytest.raises(InputError) as caught:
        read(path, units=GYRO)
    assert str(caught.value).startswith(
        "static.csv, column 't', line 22: no time stamp, and 1 more"
    )
    assert "remove such lines" in str(caught.value)
    assert read(path, units=GYRO, time=False, rate=100)["gyro_x"].is_complete


# -- jumps of the clock ---------------------------------------------------------------------------


@pytest.fixture
def recorded(write):
    """Write the rows of a regular recording that were kept; returns it and all its values."""

    def _recorded(keep, stamps, name="t"):
        values = np.round(np.random.default_rng(3).normal(size=keep.size), 4)
        return write(np.column_stack([stamps, values])[keep], f"{name},gx"), values

    return _recorded


def without(*gaps, n=N):
    keep = np.ones(n, dtype=bool)
    for first, last in gaps:
        keep[first:last] = False
    return keep


@pytest.mark.parametrize("start", [0.0, 1.7e9])
@pytest.mark.parametrize(("name", "unit"), [("time_s", 1.0), ("time_us", 1e-6), ("t", 1.0)])
def test_rows_go_to_their_places(recorded, start, name, unit):
    keep = without((1, 2), (100, 150), (152, 153), (398, 399))
    path, values = recorded(keep, np.round((start + np.arange(N) / 100) / unit, 4), name)
    recording = read(path, units=GYRO)
    assert recording.rate == pytest.approx(100, rel=1e-6)
    np.testing.assert_array_equal(recording["gyro_x"].values, np.where(keep, values, np.nan))
    assert texts(recording)[-2:] == (
        "the clock jumps 4 times, the longest by 0.5 s at 0.99 s after the start: 53 samples "
        "missing in all",
        "gyro_x: 53 of 400 samples missing, in 4 gaps, the longest 50 samples",
    )


@pytest.mark.parametrize(
    ("count", "length", "words"), [(1, "0.01", "1 sample"), (250, "2.5", "250 samples")]
)
def test_one_jump(recorded, count, length, words):
    keep = without((121, 121 + count), n=700)
    path, _ = recorded(keep, np.arange(700) / 100 + 5.0)
    notes = texts(read(path, units=GYRO))
    assert f"the clock jumps by {length} s, 1.2 s after the start: {words} missing" in notes
    assert f"gyro_x: {count} of 700 samples missing, in one gap" in notes


@settings(max_examples=150, deadline=None, database=None)
@given(
    seed=st.integers(0, 10**6),
    loss=st.sampled_from([0.0, 0.01, 0.1, 0.3]),
    jitter=st.sampled_from([0.0, 0.01, 0.06]),
    drift=st.sampled_from([0.0, 1e-4]),
    digits=st.sampled_from([3, 9]),
    rate=st.sampled_from([1.0, 62.5, 100.0]),
)
def test_any_rows_lost_with_jitter_drift_and_rounding(seed, loss, jitter, drift, digits, rate):
    rng = np.random.default_rng(seed)
    n = 600
    keep = rng.random(n) >= loss
    keep[200 : 200 + rng.integers(0, 40)] = False
    keep[[0, -1]] = True
    exact = np.arange(n) * (1.0 + drift * np.arange(n) / n)
    stamps = (exact + jitter * np.clip(rng.normal(size=n), -3, 3)) / rate
    stamps = np.round(stamps, digits)[keep]
    jumps = find_jumps(stamps)
    values = rng.normal(size=n)
    np.testing.assert_array_equal(jumps.spread(values[keep]), np.where(keep, values, np.nan))
    assert jumps.total == n - np.count_nonzero(keep)
    # Jitter and rounding of both ends, over the whole length; a line through rows of which some
    # are lost has the drift of the middle a little more than that of the ends.
    error = (6.0 * jitter + 10.0**-digits * rate) / n + 1.1 * drift
    assert abs(jumps.interval * rate - 1.0) <= error + 1e-12


@pytest.mark.parametrize("rate", [300.0, 400.0, 600.0])
@pytest.mark.parametrize("length", [1, 2, 7])
def test_gaps_between_stamps_rounded_to_more_than_a_third_of_a_step(rate, length):
    keep = without(*((start, start + length) for start in (20, 50, 133, 200, 201 + length, 350)))
    stamps = np.round(np.arange(N) / rate, 3)[keep]
    values = np.arange(N) + 1.0
    spread = find_jumps(stamps).spread(values[keep])
    np.testing.assert_array_equal(spread, np.where(keep, values, np.nan))


def test_a_stamp_that_comes_late_is_no_gap(recorded):
    stamps = 0.01 * np.arange(N)
    stamps[200] += 0.0045
    stamps[300] += 0.006
    stamps[301] += 0.002
    path, values = recorded(without(), stamps)
    recording = read(path, units=GYRO)
    np.testing.assert_array_equal(recording["gyro_x"].values, values)
    assert recording.rate == pytest.approx(100)
    assert not any("jump" in note for note in texts(recording))


@pytest.mark.parametrize(("steps", "missing"), [(1.51, 1), (2.6, 2), (2.4, 1), (7.3, 6)])
def test_off_the_grid(recorded, steps, missing):
    stamps = 0.01 * np.arange(N)
    stamps[50:] += 0.01 * (steps - 1.0)
    path, values = recorded(without(), stamps)
    recording = read(path, units=GYRO)
    expected = np.insert(values, [50] * missing, np.nan)
    np.testing.assert_array_equal(recording["gyro_x"].values, expected)
    assert recording.rate == pytest.approx(100, rel=1e-9)
    note = (
        "the jump is not a whole number of sampling intervals: the samples after it were moved to "
    )
    assert note + "the nearest interval" in texts(recording)


def test_near_the_grid_is_not_worth_a_note(recorded):
    stamps = 0.01 * np.arange(N)
    stamps[50:] += 0.0522
    path, _ = recorded(without(), stamps)
    assert not any("whole number" in note for note in texts(read(path, units=GYRO)))


@pytest.mark.parametrize("stated", [100, 100.5])
def test_with_a_stated_rate(recorded, stated):
    keep = without((100, 150))
    path, _ = recorded(keep, np.arange(N) / 100)
    recording = read(path, units=GYRO, rate=stated)
    assert recording.rate == pytest.approx(stated)
    assert recording["gyro_x"].missing == 50


def test_the_rate_is_not_that_of_first_and_last_stamp(recorded):
    keep = without((100, 250))
    path, _ = recorded(keep, np.arange(N) / 100)
    with pytest.raises(InputError, match=r"stamps give 100 Hz, not the given 62\.5 Hz"):
        read(path, units=GYRO, rate=62.5)


def test_half_may_be_missing_but_no_more(recorded):
    path, _ = recorded(without((100, 300)), np.arange(N) / 100)
    assert read(path, units=GYRO)["gyro_x"].missing == 200
    path, _ = recorded(without((60, 160), (200, 300), (380, 390)), np.arange(N) / 100)
    with pytest.raises(InputError) as caught:
        read(path, units=GYRO)
    message = str(caught.value)
    assert message.startswith("static.csv, column 't', line 62: the clock jumps by 100 sampling")
    assert "in all 210 samples are missing, with 190 present: more than half" in message


@pytest.mark.parametrize("far", [4.02, 1e6, 1e9])
def test_a_clock_that_jumps_farther_than_the_recording_is_long_is_rejected(recorded, far):
    path, _ = recorded(without(), 0.01 * np.arange(N) + far * (np.arange(N) >= 300))
    with pytest.raises(InputError, match=r"line 302: the clock jumps .* more than half of the rec"):
        read(path, units=GYRO)


def test_a_wild_stamp_asks_for_no_memory(recorded):
    stamps = 0.01 * np.arange(N)
    stamps[300:] += 1e90  # all the same
    path, _ = recorded(without(), stamps)
    with pytest.raises(InputError, match="repeats the one before"):
        read(path, units=GYRO)


@pytest.mark.parametrize("rate", [800.0, 950.0])  # or every fifth, every twentieth row is lost
def test_stamps_rounded_too_coarsely_are_no_gaps(recorded, rate):
    path, _ = recorded(without(), np.floor(np.arange(N) / rate * 1e3), "time_ms")
    with pytest.raises(InputError, match=r"line \d+: a step of two intervals.*rounded too coarse"):
        read(path, units=GYRO)


def test_rows_lost_in_a_rhythm_are_gaps_if_they_are_more_than_one(recorded):
    keep = np.arange(N) % 50 < 47
    path, _ = recorded(keep, np.arange(N) / 100)
    assert read(path, units=GYRO)["gyro_x"].missing == np.count_nonzero(~keep[: 50 * 7 + 47])
