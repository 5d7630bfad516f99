"""Time columns."""

from __future__ import annotations

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.readers import read


def texts(recording):
    """What the reader noticed."""
    return tuple(map(str, recording.notices))


UNITS = {"gyro": "rad/s"}


@pytest.fixture
def timed(write, samples):
    def _timed(stamps, name="t"):
        return write(np.column_stack([stamps, samples[: len(stamps), 0]]), f"{name},gx")

    return _timed


def problem(path, **options):
    with pytest.raises(InputError) as caught:
        read(path, units=UNITS, **options)
    message = str(caught.value)
    assert message.startswith("static.csv, column 't'")
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    ("name", "step", "rate"),
    [
        ("t", 0.01, 100.0),
        ("time_s", 2.0, 0.5),
        ("time [s]", 1.0, 1.0),
        ("time_ms", 1.0, 1e3),
        ("t", 5.0, 200.0),
        ("t", 2.5, 400.0),
        ("time_us", 0.5, 2e6),
        ("t", 2500.0, 400.0),
        ("t", 1000.0, 1000.0),
        ("time_ns", 5e6, 200.0),
        ("t", 5e6, 200.0),
    ],
)
@pytest.mark.parametrize("start", [0.0, 12.0])
def test_unit(timed, name, step, rate, start):
    recording = read(timed((start + np.arange(80)) * step, name), units=UNITS)
    assert recording.rate == pytest.approx(rate, rel=1e-9)
    assert ("inferred from the steps" in texts(recording)[-1]) == (name == "t")


@pytest.mark.parametrize(("step", "rate"), [(1.0, 1.0), (1.0, 1000.0), (0.8, 1.25), (4.0, 0.25)])
def test_stated_rate_tells_the_unit(timed, step, rate):
    assert read(timed(step * np.arange(80)), rate=rate, units=UNITS).rate == pytest.approx(rate)


def test_unit_that_cannot_be_told(timed):
    message = problem(timed(np.arange(80.0)))
    assert "a step of 1 may be seconds or milliseconds" in message
    assert "time_s or time_ms, or give rate=" in message


def test_stated_rate_is_used_and_noted(timed):
    recording = read(timed(np.arange(80) / 100.4), rate=100, units=UNITS)
    assert recording.rate == 100.0
    assert "give 100.4 Hz" in texts(recording)[0]
    assert texts(recording)[1] == "the rate stated, 100 Hz, is used"


def test_stated_rate_disagrees(timed):
    message = problem(timed(np.arange(80) / 102.0), rate=100)
    assert "its stamps give 102 Hz, not the 100 Hz stated: leave out the rate" in message
    assert read(timed(np.arange(80) / 102.0), rate=100, units=UNITS, time=False).rate == 100.0


def test_jitter_is_noted(timed):
    jitter = np.random.default_rng(0).uniform(-0.0005, 0.0005, 80)
    recording = read(timed(0.01 * np.arange(80) + jitter, "time_s"), units=UNITS)
    steps = np.diff(0.01 * np.arange(80) + jitter)
    assert f"vary by {np.std(steps):.3g} s rms" in texts(recording)[0]
    assert "% of a step" in texts(recording)[0]


def test_rounded_stamps_are_fine(timed):
    stamps = np.round(np.arange(80) / 400, 3)
    assert read(timed(stamps), units=UNITS).rate == pytest.approx(400, rel=0.01)


def test_a_short_step(timed):
    stamps = 0.01 * np.arange(80)
    stamps[50:] -= 0.0051
    message = problem(timed(stamps))
    assert "line 52: a step of 0.0049 where 0.01 is usual" in message
    assert "give rate= and time=False" in message


@pytest.mark.parametrize(
    ("value", "words"), [(0.48, "repeats the one before"), (0.2, "goes back"), (-3.0, "goes back")]
)
def test_not_increasing(timed, value, words):
    stamps = 0.01 * np.arange(80)
    stamps[49] = value
    assert f"line 51: time stamp {value:g} {words}" in problem(timed(stamps))


def test_line_counts_blank_lines_and_comments(timed):
    stamps = 0.01 * np.arange(80)
    stamps[49] = 0.2
    path = timed(stamps)
    lines = path.read_text().splitlines()
    lines[20:20] = ["", "  "]
    path.write_text("\n".join(["# bench", *lines]))
    assert "line 54: time stamp" in problem(path)


@pytest.mark.parametrize("step", [1e-310, 1e-200, 1e130])
@pytest.mark.parametrize("name", ["time_ns", "time_s", "t"])
@pytest.mark.parametrize("rate", [None, 100.0, 1e300])
def test_absurd_steps(timed, step, name, rate):
    with pytest.raises(InputError) as caught:
        read(timed(step * np.arange(80), name), rate=rate, units=UNITS)
    assert "static.csv, column" in str(caught.value)


def test_time_by_name_index_or_not_at_all(write, samples):
    slow, fast = np.arange(80) / 10.0, np.arange(80) / 50.0
    path = write(np.column_stack([slow, fast, samples[:, 0]]), "time,when,gx")
    assert read(path, units=UNITS).rate == pytest.approx(10)
    assert read(path, units=UNITS, time="when").rate == pytest.approx(50)
    assert read(path, units=UNITS, time=1).rate == pytest.approx(50)
    recording = read(path, units=UNITS, time=False, rate=7)
    assert recording.rate == pytest.approx(7)
    assert texts(recording) == ("columns not used: 'time', 'when'",)


def test_several_time_columns(write, samples):
    path = write(np.column_stack([np.arange(80) / 10.0, np.zeros(80), samples[:, 0]]), "t,stamp,gx")
    recording = read(path, units=UNITS)
    assert recording.rate == pytest.approx(10)
    assert "time is column 't'; time= selects 'stamp'" in texts(recording)


def test_time_stamps_as_text(tmp_path):
    path = tmp_path / "static.csv"
    path.write_text("timestamp,gx\n" + "2024-05-01T12:00:00,0.1\n" * 80)
    with pytest.raises(InputError, match=r"line 2, column 'timestamp': '2024.*time="):
        read(path, units=UNITS)
    assert read(path, units=UNITS, time=False, rate=1).n == 80
