"""Recordings made from arrays: units, names, looks, and what is refused."""

from collections.abc import Mapping

import numpy as np
import pytest

from gmwm import Channel, InputError, Recording
from gmwm.issues import Notice

UNUSED = Notice("columns-not-used", "note", "", "column not used: 'temp'")


@pytest.fixture
def recording():
    t = np.arange(200) / 50.0
    return Recording.from_arrays(
        {"gyro_x": 10.0 + np.sin(t), "accel_z": np.ones(200), "gyro_y": 3600.0 * t},
        rate=50.0,
        units={"gyro_x": "deg/s", "accel_z": "g", "gyro_y": "deg/h"},
        source="bench.csv",
        notices=[UNUSED],
    )


def test_arrays_are_brought_to_si(recording):
    t = np.arange(200) / 50.0
    np.testing.assert_allclose(recording["gyro_x"].values, np.radians(10.0 + np.sin(t)), rtol=1e-14)
    np.testing.assert_allclose(recording["gyro_y"].values, np.radians(t), rtol=1e-14)
    np.testing.assert_allclose(recording["accel_z"].values, 9.80665, rtol=1e-14)
    assert [(c.quantity, c.unit) for c in recording.values()] == [
        ("gyro", "rad/s"),
        ("accel", "m/s^2"),
        ("gyro", "rad/s"),
    ]


def test_size_and_time(recording):
    assert recording.names == ("gyro_x", "accel_z", "gyro_y")
    assert len(recording) == 3
    assert recording.n == 200
    assert recording.dt == pytest.approx(0.02)
    assert recording.rate == pytest.approx(50.0)
    assert recording.duration == pytest.approx(4.0)
    assert recording["gyro_x"].n == 200
    assert recording.notices == (UNUSED,)


def test_a_recording_of_one_rate_is_its_only_part(recording):
    (part,) = recording.by_rate()
    assert part is recording


def test_a_recording_is_a_mapping(recording):
    assert isinstance(recording, Mapping)
    assert list(recording) == list(recording.keys()) == ["gyro_x", "accel_z", "gyro_y"]
    assert [name for name, channel in recording.items() if channel.name == name] == list(recording)
    assert "gyro_x" in recording
    assert "gyro_z" not in recording
    assert recording.get("gyro_z") is None
    for kind in (KeyError, InputError):
        with pytest.raises(kind, match="no channel 'gyro_z': it has gyro_x, accel_z, gyro_y"):
            recording["gyro_z"]
    assert repr(recording) == "<Recording of bench.csv: gyro_x, accel_z, gyro_y; 50 Hz, 4 s>"


def test_integers_are_taken():
    rec = Recording.from_arrays({"accel_x": [1, 2, 3]}, rate=1.0, units={"accel_x": "m/s^2"})
    assert rec["accel_x"].values.dtype == np.float64


def test_constant_channels_are_known(recording):
    assert [c.is_constant for c in recording.values()] == [False, True, False]
    almost = np.ones(100)
    almost[-1] = np.nextafter(1.0, 2.0)
    assert not Channel("gyro_x", almost, 0.01).is_constant


@pytest.mark.parametrize("rate", [0.0, -100.0, float("nan"), float("inf")])
def test_rate_must_be_positive(rate):
    with pytest.raises(InputError, match=r"^rate = .*: give a .*Hz"):
        Recording.from_arrays({"gyro_x": np.ones(3)}, rate=rate, units={"gyro_x": "deg/s"})


def test_missing_and_unknown_units():
    arrays = {"gyro_x": np.ones(3), "accel_x": np.ones(3)}
    with pytest.raises(InputError, match=r"'accel_x' has no unit: give one, e\.g\. deg/s or g"):
        Recording.from_arrays(arrays, rate=1.0, units={"gyro_x": "deg/s"})
    with pytest.raises(InputError, match="unknown unit 'furlong'"):
        Recording.from_arrays(arrays, rate=1.0, units={"gyro_x": "deg/s", "accel_x": "furlong"})


def test_channels_of_unequal_length_are_refused():
    units = {"gyro_x": "deg/s", "gyro_y": "deg/s"}
    with pytest.raises(InputError, match="gyro_y"):
        Recording.from_arrays({"gyro_x": np.ones(100), "gyro_y": np.ones(99)}, 1.0, units)


def test_no_channel_at_all_is_refused():
    with pytest.raises(InputError, match="channel"):
        Recording.from_arrays({}, 1.0, {})


@pytest.mark.parametrize(
    "values", [["1.0", "two", "3.0"], np.ones((3, 2)), 1.0], ids=["text", "table", "scalar"]
)
def test_what_is_no_series_is_refused_by_name(values):
    with pytest.raises(InputError, match="gyro_x"):
        Recording.from_arrays({"gyro_x": values}, 1.0, {"gyro_x": "deg/s"})


# -- missing samples ------------------------------------------------------------------------------


def gapped(*missing, n=100, value=None):
    values = np.random.default_rng(4).normal(size=n) if value is None else np.full(n, value)
    values[list(missing)] = np.nan
    return Channel("gyro_x", values, 0.01, "gyro", "rad/s")


def test_missing_samples_are_counted():
    assert (gapped().missing, gapped().is_complete) == (0, True)
    assert (gapped(0, 7, 99).missing, gapped(0, 7, 99).is_complete) == (3, False)
    assert gapped(0, 7, 99).n == 100
    assert Channel("empty", np.empty(0), 1.0).is_complete


@pytest.mark.parametrize("missing", [(), (0,), (99,), (0, 50, 99), range(99)])
def test_constant_but_for_what_is_missing(missing):
    assert gapped(*missing, value=2.5).is_constant
    assert gapped(*missing).is_constant == (len(missing) == 99)


def test_the_mean_is_that_of_what_is_there():
    channel = gapped(*range(0, 100, 3))
    present = channel.values[np.arange(100) % 3 > 0]
    assert channel.mean == pytest.approx(np.mean(present), rel=1e-14)
    assert str(channel) == (
        f"gyro_x: 100 samples, 1 s, mean {np.mean(present):.6g} rad/s, 34 missing"
    )


def test_nothing_is_there():
    channel = gapped(*range(100))
    assert channel.is_constant
    assert np.isnan(channel.mean)
    assert str(channel) == "gyro_x: 100 samples, 1 s, all missing"


def test_integers_and_nothing_at_all_have_the_same_properties():
    assert Channel("", np.array([3, 3, 3]), 1.0).is_constant
    assert not Channel("", np.array([3, 3, 4]), 1.0).is_constant
    assert Channel("", np.array([3, 3, 4]), 1.0).is_complete
    assert Channel("", np.empty(0), 1.0).is_constant


def test_channels_with_the_same_gaps_share_a_notice():
    arrays = {name: gapped(3, 4, 5, 60).values for name in ("gyro_x", "gyro_y")}
    arrays |= {"gyro_z": gapped(8, 9, n=100).values, "accel_x": np.ones(100)}
    units = {"gyro": "deg/s", "accel": "g"}
    before, *found = Recording.from_arrays(arrays, 100.0, units, notices=[UNUSED]).notices
    assert before == UNUSED
    assert {notice.code for notice in found} == {"missing-samples"}
    assert [str(notice) for notice in found] == [
        "gyro_x, gyro_y: each 4 of 100 samples missing, in 2 gaps, the longest 3 samples",
        "gyro_z: 2 of 100 samples missing, in one gap",
    ]


@pytest.mark.parametrize("value", [np.inf, -np.inf])
def test_infinite_samples_are_refused(value):
    values = np.array([1.0, np.nan, value, 2.0])
    with pytest.raises(InputError, match="'gyro_x' is infinite at index 2: give a number, or NaN"):
        Recording.from_arrays({"gyro_x": values}, 1.0, {"gyro_x": "deg/s"})


def test_part_of_a_recording():
    values = np.arange(1000.0)
    values[100:110] = np.nan
    rec = Recording.from_arrays({"gyro_x": values}, 10.0, {"gyro": "rad/s"})
    assert rec.part() is rec
    assert rec.part(0.0, 1e9) is rec
    part = rec.part(20.0, 90.0)
    np.testing.assert_array_equal(part["gyro_x"].values, values[200:900])
    assert [notice.code for notice in part.notices] == ["part"]
    assert part.notices[0].values == {"start": 20.0, "stop": 90.0}
    assert [notice.code for notice in rec.part(5.0).notices] == ["part", "missing-samples"]
    for start, stop in ((-1.0, None), (0.0, 6.3), (95.0, None), (np.nan, None), (0.0, np.nan)):
        with pytest.raises(InputError, match="fewer than 64 samples"):
            rec.part(start, stop)


def test_a_part_of_a_record_whose_rate_changes_is_refused():
    notice = Notice("rate-changes", "bad", "", "the rate changes")
    rec = Recording.from_arrays({"gyro_x": np.arange(1e3)}, 10.0, {"gyro": "rad/s"}, "", [notice])
    assert rec.part() is rec
    with pytest.raises(InputError, match="cut the file where it changes"):
        rec.part(0.0, 50.0)


def test_what_is_masked_is_missing():
    values = np.ma.masked_greater(np.array([0.1, 0.2, 99.0, 0.3]), 10.0)
    recording = Recording.from_arrays({"gyro_x": values}, 100.0, {"gyro": "rad/s"})
    np.testing.assert_array_equal(recording["gyro_x"].values, [0.1, 0.2, np.nan, 0.3])
    np.testing.assert_array_equal(Channel("", values, 0.01).values, [0.1, 0.2, np.nan, 0.3])
