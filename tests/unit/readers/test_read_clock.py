"""Time columns."""

from __future__ import annotations

import numpy as np
import pytest

from gmwm.cli.options import with_option
from gmwm.errors import InputError
from gmwm.readers import read
from gmwm.readers.grid import find_change
from reading import texts

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
        ("time_us", 0.5, 2e6),
        ("time_ns", 5e6, 200.0),
        ("time [min]", 0.01 / 60.0, 100.0),
        ("t (h)", 0.01 / 3600.0, 100.0),
        ("time [Days]", 0.01 / 86400.0, 100.0),
        ("time_hours", 0.01 / 3600.0, 100.0),
        ("elapsed_time [us]", 2500.0, 400.0),
    ],
)
@pytest.mark.parametrize("start", [0.0, 12.0])
def test_unit(timed, name, step, rate, start):
    recording = read(timed((start + np.arange(80)) * step, name), units=UNITS)
    assert recording.rate == pytest.approx(rate, rel=1e-9)
    assert ("inferred from the steps" in texts(recording)[0]) == (name == "t")


@pytest.mark.parametrize(("step", "rate"), [(1.0, 1.0), (1.0, 1000.0), (0.8, 1.25), (4.0, 0.25)])
def test_stated_rate_tells_the_unit(timed, step, rate):
    assert read(timed(step * np.arange(80)), rate=rate, units=UNITS).rate == pytest.approx(rate)


@pytest.mark.parametrize("unit", ["10us", "ticks", "degC", "UTC"])
def test_a_unit_that_is_not_known(timed, unit):
    path = timed(2.5 * np.arange(80), f"time [{unit}]")
    with pytest.raises(InputError, match=f"'{unit}' is not a known unit of time") as caught:
        read(path, units=UNITS)
    assert caught.value.code == "time-unit"
    # With a rate the unit is what makes the stamps fit it.
    stamps = np.delete(2.5 * np.arange(80), [50, 51])
    recording = read(timed(stamps, f"time [{unit}]"), units=UNITS, rate=100.0)
    assert recording.rate == 100.0
    assert recording.n == 80
    assert f", {unit}, inferred" in texts(recording)[0]


@pytest.mark.parametrize(
    ("step", "rate", "unit"),
    [
        (1.0, 1000.0, "ms"),
        (5.0, 200.0, "ms"),
        (250.0, 4000.0, "us"),
        (2500.0, 400.0, "us"),
        (5e6, 200.0, "ns"),
        (0.01 / 86400.0, 100.0, "days"),
        (0.01 / 3600.0, 100.0, "h"),
    ],
)
def test_stamps_without_a_unit_that_no_imu_has_in_seconds(timed, step, rate, unit):
    path = timed(12.0 + step * np.arange(80))
    with pytest.raises(InputError) as caught:
        read(path, units=UNITS)
    assert caught.value.code == "time-unit"
    assert f"name the column 't [{unit}]', or give the sampling rate, rate=" in str(caught.value)
    assert caught.value.values["rate"] == pytest.approx(rate, rel=1e-4)
    assert read(path, rate=rate, units=UNITS).rate == rate


def test_a_unit_of_time_is_asked_for_with_the_others_and_what_is_advised_helps(timed):
    path = timed(20_000.0 * np.arange(80))
    with pytest.raises(InputError) as caught:
        read(path)
    message = str(caught.value)
    assert "steps of 20000 without a unit, 50 Hz if they are microseconds, and it does" in message
    assert 'e.g. rate=50, units={"gyro": "deg/s"' in message
    assert "50 Hz if they are microseconds, not the given 100 Hz" in problem(path, rate=100)
    assert read(path, rate=50, units=UNITS).rate == 50.0


@pytest.mark.parametrize("units", ["deg/h", {"gyro": 3.0}, [("gyro", "deg/s")]])
def test_units_are_those_of_sensors(timed, units):
    with pytest.raises(
        InputError, match=r'^units = .*: give a unit for each sensor, e.g. units={"gyro"'
    ):
        read(timed(0.01 * np.arange(80)), units=units)


def test_a_unit_of_time_that_nothing_is_like(timed):
    assert problem(timed(3e12 * np.arange(80))).endswith(
        "without a unit: name the column by its unit, or give the sampling rate, rate=100"
    )


@pytest.mark.parametrize("unit", [60.0, 3600.0, 86400.0])
def test_a_rate_tells_long_units_too(timed, unit):
    assert read(timed(0.01 / unit * np.arange(80)), rate=100, units=UNITS).rate == 100.0


@pytest.fixture
def long(tmp_path):
    def _long(stamps):
        path = tmp_path / "long.csv"
        table = np.column_stack([stamps, np.sin(np.arange(len(stamps)))])
        np.savetxt(path, table, delimiter=",", header="time_s,gx", comments="", fmt="%.9f")
        return path

    return _long


def test_a_rate_that_changes(long):
    stamps = np.cumsum(np.r_[np.full(6000, 0.01), np.full(6000, 1.0 / 71.0)])
    recording = read(long(stamps), units=UNITS)
    (found,) = [notice for notice in recording.notices if notice.code == "rate-changes"]
    assert found.severity == "bad"
    assert found.values["before"] == pytest.approx(100.0, rel=1e-3)
    assert found.values["after"] == pytest.approx(71.0, rel=1e-3)
    assert found.values["time"] == pytest.approx(60.0, abs=0.1)
    assert "from 100 to 71 Hz at about 60 s" in found.text


def test_a_rate_that_comes_and_goes(long):
    time = np.arange(60_000) / 50.0
    recording = read(long(time + 3.0 * np.sin(2.0 * np.pi * time / 600.0)), units=UNITS)
    (found,) = [notice for notice in recording.notices if notice.code == "rate-changes"]
    first, then = sorted((found.values["before"], found.values["after"]))
    assert first == pytest.approx(48.5, abs=0.2) and then == pytest.approx(51.6, abs=0.2)
    assert f"{found.values['before']:.4g} to {found.values['after']:.4g} Hz" in found.text


@pytest.mark.parametrize("then", [50.0, 30.0, 200.0, 300.0])
def test_a_rate_that_changes_so_much_that_rows_seem_to_be_missing(long, then):
    stamps = np.cumsum(np.r_[np.full(5000, 0.01), np.full(7000, 1.0 / then)])
    with pytest.raises(InputError, match=f"from 100 to {then:g} Hz: cut the file there and use"):
        read(long(stamps), units=UNITS)


def _steady(kind):
    rng = np.random.default_rng(3)
    even = np.arange(20_000) / 100.0
    if kind == "missing rows in one half":
        return np.delete(even, rng.choice(10_000, 1500, replace=False))
    if kind == "jitter":
        return even + rng.uniform(-0.003, 0.003, even.size)
    if kind == "steps of their own":
        return np.cumsum(rng.uniform(0.006, 0.014, even.size))
    if kind == "a pause":
        return even + 5.0 * (np.arange(even.size) > 7000)
    if kind == "a clock that warms up":
        return even + 1e-6 * even**2
    return np.round(np.arange(20_000) / float(kind), 3)


@pytest.mark.parametrize(
    "kind",
    [
        "missing rows in one half",
        "jitter",
        "steps of their own",
        "a pause",
        "a clock that warms up",
        *("666.7", "667", "400", "390", "800", "999"),
    ],
)
def test_no_change_is_seen_where_there_is_none(kind):
    assert find_change(_steady(kind)) is None


def test_stated_rate_is_used_and_noted(timed):
    recording = read(timed(np.arange(80) / 100.4), rate=100, units=UNITS)
    assert recording.rate == 100.0
    assert "give 100.4 Hz" in texts(recording)[0]
    assert texts(recording)[1] == "the given rate of 100 Hz is used"


def test_stated_rate_disagrees(timed):
    message = problem(timed(np.arange(80) / 102.0), rate=100)
    assert "its stamps give 102 Hz, not the given 100 Hz: leave out the rate" in message
    assert read(timed(np.arange(80) / 102.0), rate=100, units=UNITS, time=False).rate == 100.0


def test_jitter_is_noted(timed):
    jitter = np.random.default_rng(0).uniform(-0.0005, 0.0005, 80)
    recording = read(timed(0.01 * np.arange(80) + jitter, "time_s"), units=UNITS)
    steps = np.diff(0.01 * np.arange(80) + jitter)
    text = f"vary by {1e6 * np.std(steps):.3g} us rms ({1e4 * np.std(steps):.2f} % of a step)"
    assert text in texts(recording)[0]


def test_jitter_that_is_rounding_is_not_mentioned(timed):
    (text, *_) = texts(read(timed(0.01 * np.arange(80), "time_s"), units=UNITS))
    assert text == "time stamps (column 'time_s', seconds) give 100 Hz"


def test_a_jump_is_no_jitter(timed):
    jitter = np.random.default_rng(1).uniform(-0.0005, 0.0005, 80)
    stamps = 0.01 * np.arange(80) + jitter
    steps = np.delete(np.diff(stamps), 49)
    stamps[50:] += 0.2
    recording = read(timed(stamps, "time_s"), units=UNITS)
    assert recording.jitter == pytest.approx(np.std(steps) / 0.01, rel=0.01)


def test_a_time_column_that_is_given_as_a_channel_is_no_clock(timed):
    path = timed(0.5 * np.arange(80), "time_s")
    found = read(path, units=UNITS, channels={"gyro_x": "time_s"}, rate=100.0)
    assert found.rate == 100.0
    assert not [notice for notice in found.notices if notice.code == "time-stamps"]


def test_rounded_stamps_are_fine(timed):
    stamps = np.round(np.arange(80) / 400, 3)
    assert read(timed(stamps), units=UNITS).rate == pytest.approx(400, rel=0.01)


def test_a_short_step(timed):
    stamps = 0.01 * np.arange(80)
    stamps[50:] -= 0.0051
    found = read(timed(stamps), units=UNITS)
    assert found.rate == pytest.approx(100.0, rel=0.01)
    assert found["gyro_x"].is_complete


@pytest.mark.parametrize(
    ("value", "astray"), [(0.48, 0), (0.465, 0), (0.455, 1), (0.2, 1), (-3.0, 1), (30.0, 1)]
)
def test_one_wild_stamp_does_no_harm(timed, value, astray):
    stamps = 0.01 * np.arange(80)
    stamps[49] = value
    found = read(timed(stamps), units=UNITS)
    assert found.rate == pytest.approx(100.0, rel=1e-4)
    assert found["gyro_x"].n == 80
    assert found["gyro_x"].is_complete
    codes = [notice.code for notice in found.notices]
    assert codes.count("stamps-astray") == astray


def test_line_counts_blank_lines_and_comments(timed):
    stamps = 0.01 * np.arange(80)
    stamps[48:] = stamps[48:][::-1]
    path = timed(stamps)
    lines = path.read_text().splitlines()
    lines[20:20] = ["", "  "]
    path.write_text("\n".join(["# bench", *lines]))
    assert "goes back" in problem(path)


@pytest.mark.parametrize("step", [1e-310, 1e-200, 1e130])
@pytest.mark.parametrize("name", ["time_ns", "time_s", "t"])
def test_absurd_steps(timed, step, name):
    for rate in (None, 100.0, 1e300):
        with pytest.raises(InputError, match=r"static\.csv, column"):
            read(timed(step * np.arange(80), name), rate=rate, units=UNITS)


def test_time_by_name_index_or_not_at_all(write, samples):
    slow, fast = np.arange(80) / 10.0, np.arange(80) / 50.0
    path = write(np.column_stack([slow, fast, 1e-3 * samples[:, 0]]), "time,when,gx")
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
    found = next(each for each in recording.notices if each.code == "time-column")
    assert found.text == "time stamps are read from column 't', not 'stamp'"
    assert with_option(found).hint == "to choose another, give --time"


def test_time_stamps_as_text(tmp_path):
    path = tmp_path / "static.csv"
    path.write_text("timestamp,gx\n" + "Wed 12:00,0.1\n" * 80)
    with pytest.raises(InputError, match=r"line 2, column 'timestamp': 'Wed.*time="):
        read(path, units=UNITS)
    assert read(path, units=UNITS, time=False, rate=1).n == 80
