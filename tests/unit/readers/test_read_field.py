"""Files as programs of the field write them: weeks, dates, text named .mat, receivers' logs."""

import re

import numpy as np
import pytest

import gmwm
from gmwm import InputError
from gmwm.cli.options import with_hint

N, RATE = 300, 100.0
SAMPLES = np.random.default_rng(1).normal(0.0, 1e-3, (N, 6))
SAMPLES[:, 5] += 9.8
SENSORS = (
    "gyro_x [rad/s],gyro_y [rad/s],gyro_z [rad/s],accel_x [m/s^2],accel_y [m/s^2],accel_z [m/s^2]"
)
UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


def rows(stamps=None, start="", end=""):
    """Lines of the samples behind their stamps."""
    stamps = [f"{i / RATE:.2f}" for i in range(N)] if stamps is None else stamps
    cells = (",".join(f"{value:.7f}" for value in row) for row in SAMPLES)
    return [f"{start}{t},{row}{end}" for t, row in zip(stamps, cells, strict=True)]


def write(tmp_path, lines, name="a.csv"):
    path = tmp_path / name
    path.write_text("\n".join([*lines, ""]))
    return path


def check(recording):
    assert recording.rate == pytest.approx(RATE, rel=1e-6)
    assert len(recording) == 6
    np.testing.assert_allclose(recording["accel_z"].values, SAMPLES[:, 5], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "unit"), [("tow", 1), ("TOW [s]", 1), ("GPS TOW", 1), ("tow_ms", 1000)]
)
def test_times_of_week_go_on_behind_its_end(tmp_path, name, unit):
    stamps = [f"{(604799.0 + i / RATE) % 604800.0 * unit:.2f}" for i in range(N)]
    check(gmwm.read(write(tmp_path, [f"{name},{SENSORS}", *rows(stamps)])))


def test_dates_of_matlab(tmp_path):
    stamps = [f"31-Dec-2023 23:59:{59 + i / RATE:06.3f}" for i in range(100)]
    stamps += [f"01-Jan-2024 00:00:{i / RATE:06.3f}" for i in range(N - 100)]
    check(gmwm.read(write(tmp_path, [f"Timestamp,{SENSORS}", *rows(stamps)])))


def test_text_in_a_file_named_mat(tmp_path):
    np.savetxt(tmp_path / "a.mat", np.column_stack([np.arange(N) / RATE, SAMPLES]), fmt="%15.7e")
    check(gmwm.read(tmp_path / "a.mat", units=UNITS))


def test_a_preamble_and_a_comma_behind_each_row(tmp_path):
    lines = ["Device: X", "Serial: 5", f"time [s],{SENSORS}", *rows(end=",")]
    check(gmwm.read(write(tmp_path, lines)))


@pytest.mark.parametrize("channels", [None, {"gyro": "wb", "accel": "fb"}])
def test_arrays_of_three_axes_under_short_names(tmp_path, channels):
    from scipy.io import savemat

    imu = {"t": np.arange(N) / RATE, "wb": SAMPLES[:, :3], "fb": SAMPLES[:, 3:], "freq": RATE}
    savemat(tmp_path / "a.mat", {"imu": imu})
    check(gmwm.read(tmp_path / "a.mat", channels=channels, units=UNITS))


def test_arrays_of_three_axes_of_any_name(tmp_path):
    np.savez(tmp_path / "a.npz", turning=SAMPLES[:, :3], pushing=SAMPLES[:, 3:], rate=RATE)
    channels = {"gyro": "turning", "accel": "pushing"}
    check(gmwm.read(tmp_path / "a.npz", channels=channels, units=UNITS))


def test_checksums_are_removed_as_the_hint_says(tmp_path):
    names = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
    given = {"time": 1, "units": UNITS, "channels": {name: i for i, name in enumerate(names, 2)}}
    lines = rows(start="$PIMU,", end="*5A")
    with pytest.raises(InputError, match=r"remove the checksums, \*hh, from the ends of the lines"):
        gmwm.read(write(tmp_path, lines), **given)
    bare = [re.sub(r"\*[0-9A-F]{2}$", "", line) for line in lines]
    check(gmwm.read(write(tmp_path, bare), **given))


def test_counts_of_novatel_are_scaled_as_the_hint_says(tmp_path):
    scale = 1e-9  # of velocity and of angle, in m/s and rad
    counts = np.rint(SAMPLES / RATE / scale).astype(int)
    order, sign = [5, 4, 3, 2, 1, 0], np.array([1, -1, 1, 1, -1, 1])
    fields = [",".join(map(str, row)) for row in counts[:, order] * sign]
    head = "%RAWIMUSA,2193,539371.000;2193"
    lines = [
        f"{head},{539371 + i / RATE:.9f},00000077,{row}*0a1b2c3d" for i, row in enumerate(fields)
    ]
    with pytest.raises(InputError, match="accelerometer z, -y, x and gyro z, -y, x"):
        gmwm.read(write(tmp_path, lines))
    found = [line.partition("*")[0].partition(";")[2].split(",") for line in lines]
    values = np.array([row[-6:] for row in found], dtype=float) * sign * scale * RATE
    stamps = np.array([float(row[1]) for row in found])
    table = np.column_stack([stamps, values[:, order]])
    np.savetxt(tmp_path / "b.csv", table, "%.12g", ",", header=f"time [s],{SENSORS}", comments="")
    check(gmwm.read(tmp_path / "b.csv"))


def test_positions_of_novatel_hold_no_samples(tmp_path):
    lines = [
        "#INSPVAXA,COM1,0,73.5,FINESTEERING,1695,309428.000;INS_SOLUTION_GOOD,51.1,-114.0"
    ] * 80
    with pytest.raises(InputError, match="no samples of an IMU: log RAWIMUSXA"):
        gmwm.read(write(tmp_path, lines))


def test_a_refusal_names_the_rate_of_the_file(tmp_path):
    times = np.arange(N) / 248.28
    times[N // 2 :] -= times[N // 2]
    lines = [f"time [s],{SENSORS}", *rows([f"{t:.7f}" for t in times])]
    with pytest.raises(InputError, match="rate=HZ and time=False") as caught:
        gmwm.read(write(tmp_path, lines))
    assert with_hint(caught.value).endswith(
        "--rate HZ --time none (rows come at 248.28 Hz on average)"
    )
