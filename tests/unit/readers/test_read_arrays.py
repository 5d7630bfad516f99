"""NPY and NPZ."""

from __future__ import annotations

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.readers import read
from gmwm.readers.formats.arrays import Array, ArrayTable
from gmwm.readers.names import CANONICAL
from reading import SI, assert_holds, texts

TIME = 0.01 * np.arange(80)


@pytest.fixture
def save(tmp_path):
    def _save(*args, **entries):
        path = tmp_path / ("a.npz" if entries else "a.npy")
        if entries:
            np.savez(path, **entries)
        else:
            np.save(path, *args)
        return path

    return _save


def problem(path, **options):
    with pytest.raises(InputError) as caught:
        read(path, **({"rate": 100, "units": SI} | options))
    message = str(caught.value)
    assert message.startswith(path.name)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("dtype", ["f8", ">f8", "f4", "i4", "u2", "f2", "i8", "g"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_matrix(save, samples, dtype, order):
    rows = np.asarray(np.round(np.abs(samples) * 100), dtype=dtype, order=order)
    recording = read(save(rows), rate=100, units=SI)
    assert_holds(recording, rows.astype(float))
    assert recording["gyro_x"].values.dtype == np.float64
    assert recording.source == "a.npy"


def test_matrix_with_time(save, samples):
    recording = read(save(np.column_stack([TIME, samples])), units=SI)
    assert_holds(recording, samples)
    assert recording.rate == pytest.approx(100)


def test_vector(save, samples):
    assert_holds(
        read(save(samples[:, 0]), rate=1, units={"accel": "m/s^2"}), samples[:, :1], ["accel_x"]
    )


def test_the_file_is_not_kept_open(save, samples):
    path = save(samples)
    recording = read(path, rate=1, units=SI)
    assert type(recording["gyro_x"].values) is np.ndarray
    np.save(path, 0.0 * samples)
    assert_holds(recording, samples)


def test_structured(save, samples):
    fields = [("t", "f8"), ("temp", "f4"), ("gyro", "f8", (3,)), ("ax", "f4"), ("label", "U5")]
    array = np.zeros(80, dtype=fields)
    array["t"], array["gyro"], array["ax"] = TIME, samples[:, :3], samples[:, 3]
    recording = read(save(array), units=SI)
    assert recording.names == ("gyro_x", "gyro_y", "gyro_z", "accel_x", "temp")
    np.testing.assert_array_equal(recording["gyro_z"].values, samples[:, 2])
    assert recording.rate == pytest.approx(100)
    assert "column not used: 'label'" in texts(recording)


def test_named_vectors(save, samples):
    path = save(time_ms=1e3 * TIME, ax=samples[:, 3], gx=samples[:, 0], note="bench", id=np.int8(3))
    recording = read(path, units={"gyro": "rad/s", "accel": "m/s^2"})
    assert_holds(recording, samples[:, [0, 3]], ["gyro_x", "accel_x"])
    assert recording.rate == pytest.approx(100)


@pytest.mark.parametrize(
    ("entry", "value"),
    [("rate", 50.0), ("rate", np.array([50])), ("dt", 0.02), ("fs", 50), ("DT", np.float32(0.02))],
)
def test_rate_in_the_file(save, samples, entry, value):
    path = save(gyro=samples[:, :3], accel=samples[:, 3:], **{entry: value})
    recording = read(path, units=SI)
    assert_holds(recording, samples)
    assert recording.rate == pytest.approx(50)
    assert read(path, rate=50.1, units=SI).rate == pytest.approx(50.1)
    message = problem(path, rate=60)
    assert "states a rate of 50 Hz, not 60 Hz: leave out the rate" in message


@pytest.mark.parametrize("name", ["t", "time", "timestamp"])
def test_one_matrix_and_time(save, samples, name):
    recording = read(save(**{name: TIME}, imu=samples), units=SI)
    assert_holds(recording, samples)
    assert recording.rate == pytest.approx(100)
    recording = read(save(**{name: TIME}, imu=samples), channels={"accel_x": 4}, units=SI)
    np.testing.assert_array_equal(recording["accel_x"].values, samples[:, 4])


def test_compressed_npz(tmp_path, samples):
    path = tmp_path / "a.NPZ"
    with path.open("wb") as stream:
        np.savez_compressed(stream, samples)
    assert_holds(read(path, rate=1, units=SI), samples)


def test_entries_that_are_not_wanted_may_be_anything(save, samples):
    path = save(
        gyro=samples[:, :3],
        misalignment=np.eye(3),
        info=np.array({"who": "me"}),
        raw=np.array([None, 1]),
        labels=np.array(["a", "b"]),
        z=np.array([1j, 2j]),
    )
    recording = read(path, rate=1, units=SI)
    assert recording.names == CANONICAL[:3]


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.array([None] * 80), "holds Python objects"),
        (np.array(["a"] * 80), "holds text: save real numbers"),
        (np.zeros(80, complex), "holds complex numbers"),
        (np.zeros(80, bool), "holds booleans"),
        (np.zeros(80, "M8[s]"), "holds dates"),
        (np.zeros((80, 2, 3)), "shape (80, 2, 3)"),
        (np.float64(3.0), "shape ()"),
        (np.zeros((6, 80)), "shape (6, 80): samples run along the rows here, save array.T"),
        (np.zeros((80, 5)), "5 columns without names that are known"),
        (np.zeros((63, 6)), "63 samples, but needs at least 64"),
        (np.zeros((0, 6)), "0 samples"),
        (np.zeros((80, 0)), "no column"),
        (np.zeros(80, [("gx", "f8", (2, 2))]), "column 'gx' has shape (80, 2, 2)"),
        (np.zeros(80, [("p", "f8"), ("q", "f8")]), "columns are 'p', 'q'"),
    ],
)
def test_bad_array(save, array, words):
    units = SI if array.shape[1:] == (6,) else {"gyro": "rad/s"}
    assert words in problem(save(array), units=units)


def test_other_numbers_than_a_file_declares():
    """Regression: damaged files of MATLAB had complex numbers, which were cut with a warning."""
    like = np.zeros(80)
    arrays = (Array(like, lambda: like + 1j),)
    table = ArrayTable(source="a.mat", names=("gyro_x",), arrays=arrays)
    with pytest.raises(InputError, match=r"^a\.mat, column 'gyro_x' holds complex numbers: save"):
        table.load([0])


@pytest.mark.parametrize("value", [np.inf, -np.inf, 1e200])
def test_not_finite(save, samples, value):
    samples[[17, 30, 31], 4] = value
    message = problem(save(samples))
    assert f"a.npy, column 4 (counted from 0), row 17 (counted from 0): {value} is not" in message
    assert "and 2 more such" in message


def test_nan_is_a_missing_sample(save, samples):
    samples[[17, 30, 31], 4] = np.nan
    samples[:, 1] = np.nan
    for path in (save(samples), save(gyro=samples[:, :3], accel=samples[:, 3:])):
        recording = read(path, rate=100, units=SI)
        assert_holds(recording, samples)
        assert texts(recording)[-2:] == (
            "gyro_y: all 80 samples missing",
            "accel_y: 3 of 80 samples missing, in 2 gaps, the longest 2 samples",
        )


def test_a_clock_that_jumps(save, samples):
    stamps = 0.01 * np.arange(80) + 0.05 * (np.arange(80) >= 30)
    samples[3, 3] = np.nan
    recording = read(save(t=stamps, gyro=samples[:, :3], accel=samples[:, 3:]), units=SI)
    expected = np.insert(samples, [30] * 5, np.nan, axis=0)
    assert_holds(recording, expected)
    assert recording.rate == pytest.approx(100)


def test_float64_cannot_hold_it(save):
    if np.finfo(np.longdouble).max == np.finfo(float).max:
        pytest.skip("long double is double here")
    array = np.full(80, np.longdouble("1e4000"))
    assert "row 0" in problem(save(array), units={"gyro": "rad/s"})


def test_lengths_differ(save, samples):
    message = problem(save(gx=samples[:, 0], gy=samples[:70, 1]))
    assert "column 'gy': 70 samples where column 'gx' has 80: give every column" in message


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("entry", ["rate", "dt"])
def test_rate_in_the_file_is_bad(save, samples, entry, value):
    assert f"{entry} = {value} is not positive" in problem(save(gx=samples[:, 0], **{entry: value}))


def test_npz_of_objects_only_or_empty(save, tmp_path):
    assert "holds Python objects" in problem(save(gx=np.array([None, {}])))
    assert "no column" in problem(save(a=np.float64(1)))
    with (tmp_path / "b.npz").open("wb") as stream:
        np.savez(stream)
    assert "no column" in problem(tmp_path / "b.npz")


def test_time_in_a_row_message(save, samples):
    stamps = TIME.copy()
    stamps[40:] = stamps[39]
    message = problem(save(t=stamps, gx=samples[:, 0]), rate=None)
    assert "a.npz, column 't', row 40 (counted from 0): time stamp 0.39 repeats" in message


@pytest.mark.parametrize("name", ["a.npy", "a.npz"])
@pytest.mark.parametrize("data", [b"", b"gx,gy\n1,2\n", b"\x93NUMPY", b"PK\x03\x04", b"\x80\x04K."])
def test_not_an_array_file(tmp_path, name, data):
    path = tmp_path / name
    path.write_bytes(data)
    message = problem(path)
    assert "write it with numpy.save" in message or "damaged or cut off: save it again" in message


@pytest.mark.parametrize("keep", [0.2, 0.5, 0.99])
def test_cut_off(save, samples, keep):
    for path in (save(samples), save(gyro=samples[:, :3])):
        data = path.read_bytes()
        path.write_bytes(data[: int(keep * len(data))])
        message = problem(path)
        assert "damaged" in message or "is not an NPZ file" in message


def test_header_that_promises_too_much(save, samples):
    path = save(samples)
    path.write_bytes(path.read_bytes().replace(b"(80, 6)", b"(8000000000000, 6)"))
    assert "damaged or cut off" in problem(path)
