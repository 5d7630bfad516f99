"""IMU logs: clocks, signs, gaps, stuck channels, and files on disk."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from gmwm._core.spool import is_spooled
from gmwm.calibration import BiasCurve, Covariate
from gmwm.calibration.curve import Regressor
from gmwm.errors import InputError
from gmwm.ins import Imu, read_imu, tuning
from gmwm.ins.logs import read_imu_log

DT = 0.02
MOST = round(tuning.LONGEST_FILLED / DT)
HEAD = "time,wx [deg/s],wy [deg/s],wz [deg/s],ax [m/s^2],ay [m/s^2],az [m/s^2]"


def imu_rows(n: int = 100) -> np.ndarray:
    rng = np.random.default_rng(1)
    rows = np.hstack([5.0 + DT * np.arange(n)[:, None], 0.01 * rng.standard_normal((n, 6))])
    rows[:, 6] -= 9.8
    return rows


def write_imu(folder: Path, rows: np.ndarray, header: str = HEAD) -> Path:
    path = folder / "imu.csv"
    lines = [",".join("" if np.isnan(x) else f"{x:.12g}" for x in row) for row in rows]
    path.write_text("\n".join([header, *lines]))
    return path


@pytest.mark.parametrize(("unit", "factor"), [("time", 1.0), ("time_us", 1e6)])
def test_samples_become_increments_over_the_interval_that_ends_at_their_stamp(
    tmp_path, unit, factor
):
    rows = imu_rows()
    stamped = rows.copy()
    stamped[:, 0] *= factor
    log = read_imu_log(write_imu(tmp_path, stamped, HEAD.replace("time", unit)))
    assert log.start == pytest.approx(5.0 - DT)
    assert log.imu.dt == pytest.approx(DT)
    np.testing.assert_allclose(log.imu.rotation, np.radians(rows[:, 1:4]) * DT, rtol=1e-9)
    np.testing.assert_allclose(log.imu.velocity, rows[:, 4:] * DT, rtol=1e-9)


def test_the_unit_of_a_clock_does_not_depend_on_its_last_stamp(tmp_path):
    """With the first row again at the end it was a division by zero."""
    rows = imu_rows()
    rows[:, 0] *= 1e3
    rows = np.vstack([rows, rows[:1]])
    log = read_imu_log(write_imu(tmp_path, rows, HEAD.replace("time", "time_ms")))
    assert log.start == pytest.approx(5.0 - DT)


@pytest.mark.parametrize("unit", ["s", "ns"])
def test_stamps_of_every_format_are_the_clock(tmp_path, unit):
    rows, names = imu_rows(), HEAD.split(",")
    stamps = rows[:, 0] if unit == "s" else np.rint(1e9 * rows[:, 0]).astype(np.int64)
    columns = {f"time [{unit}]": stamps, **dict(zip(names[1:], rows[:, 1:].T, strict=True))}
    parquet.write_table(pa.table(columns), tmp_path / "imu.parquet")
    assert read_imu_log(tmp_path / "imu.parquet").start == pytest.approx(5.0 - DT)


def test_a_minus_before_a_column_reverses_it(tmp_path):
    path = write_imu(tmp_path, imu_rows(), "time,a,b,c,d,e,f")
    names = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
    columns: dict[str, str | int] = dict(zip(names, ("a", "b", "c", "d", "e", "f"), strict=True))
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    plain = read_imu(path, units=units, channels=columns)
    turned = read_imu(path, units=units, channels=columns | {"gyro_x": "-a", "accel_y": "-5"})
    np.testing.assert_array_equal(turned.rotation, plain.rotation * [-1, 1, 1])
    np.testing.assert_array_equal(turned.velocity, plain.velocity * [1, -1, 1])


def test_gaps_are_filled_along_a_line(tmp_path):
    rows = imu_rows()
    rows[:, 2] = np.arange(100.0)
    truth = read_imu(write_imu(tmp_path, rows))
    rows[10 : 10 + MOST, 2] = rows[[1, 12, 48], 3] = np.nan
    log = read_imu_log(write_imu(tmp_path, rows))
    np.testing.assert_allclose(log.imu.rotation[:, 1], truth.rotation[:, 1])
    (filled,) = (each for each in log.notices if each.code == "samples-filled")
    assert filled.values == {"count": MOST + 2, "longest": MOST}  # one row has two


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (
            slice(30, 31 + MOST),
            f"gyro_z has a gap of length {MOST + 1} from sample 31 on, 0.6 s .* up to {MOST}",
        ),
        ([0], "gyro_z has a gap of length 1 from sample 1 on, 0 s"),
        ([99], "length 1 from sample 100 on, 1.98 s"),
    ],
)
def test_a_gap_that_is_too_long_or_at_an_end_is_rejected(tmp_path, rows, words):
    given = imu_rows()
    given[rows, 3] = np.nan
    with pytest.raises(InputError, match=words):
        read_imu(write_imu(tmp_path, given))


def test_bad_imu_files(tmp_path):
    rows = imu_rows()
    with pytest.raises(InputError, match="gyro_x has a gap of length 6 from sample 31"):
        read_imu(write_imu(tmp_path, np.delete(rows, range(30, 36), axis=0)))
    with pytest.raises(InputError, match="no channel accel_z"):
        read_imu(write_imu(tmp_path, rows[:, :6], HEAD.rpartition(",")[0]))
    free = rows.copy()
    free[:, 6] += 9.8
    with pytest.raises(InputError, match="that gravity is not subtracted"):
        read_imu(write_imu(tmp_path, free))
    upward = rows.copy()
    upward[:, 6] *= -1.0
    notices = read_imu_log(write_imu(tmp_path, upward)).notices
    assert ("axis-up", "accel_z") in {(notice.code, notice.where) for notice in notices}


@pytest.mark.parametrize("first", [0, 100, 200])
def test_a_channel_that_is_stuck(tmp_path, first):
    """The noise of another sensor was blamed for it."""
    rows = imu_rows(500)
    assert "stuck" not in {each.code for each in read_imu_log(write_imu(tmp_path, rows)).notices}
    rows[first : first + 300, 2] = rows[first, 2]
    notices = read_imu_log(write_imu(tmp_path, rows)).notices
    (stuck,) = (each for each in notices if each.code == "stuck")
    assert stuck.where == "gyro_y"
    assert stuck.values["length"] == pytest.approx(6.0)
    assert stuck.values["start"] == pytest.approx(5.0 + DT * first)


def test_a_long_file_is_read_as_a_short_one(tmp_path, monkeypatch):
    """With jitter of a tenth of a step, a row left out, and an empty field."""
    rng, n = np.random.default_rng(3), 2000
    rows = imu_rows(n)
    rows[:, 0] += 0.1 * DT * rng.standard_normal(n)
    rows[1150, 4] = np.nan
    path = write_imu(tmp_path, np.delete(rows, 1200, axis=0))
    found: list[Imu] = [read_imu(path)]
    monkeypatch.setenv("GMWM_MEMORY", "1e-5")
    monkeypatch.setattr("gmwm._core.spool.ROWS", 97)
    found.append(read_imu(path))
    once, long = found
    assert is_spooled(long.rotation) and not is_spooled(once.rotation)
    assert long.dt == once.dt
    np.testing.assert_array_equal(long.rotation, once.rotation)
    np.testing.assert_array_equal(long.velocity, once.velocity)


def test_a_curve_is_subtracted_where_the_log_has_its_temperature(tmp_path):
    """The increments of a sensor at one temperature, but for the time that its node stands for."""
    rows, hot = imu_rows(2000), 25.0 + 10.0 * np.arange(2000) / 2000
    one = Covariate("temperature", "degC", 30.0, 5.0, 25.0, 35.0)
    line = Regressor("power", "temperature", 1)
    numbers = (np.array([0.01]), np.eye(1), np.ones((1, 1)), np.zeros(0), 0.5)
    curve = BiasCurve("accel_y", "accel", "m/s^2", (one,), (line,), *numbers)
    plain = read_imu_log(write_imu(tmp_path, rows)).imu
    rows[:, 5] += 0.01 * (hot - 30.0) / 5.0
    rows = np.hstack([rows, hot[:, None]])
    path = write_imu(tmp_path, rows, f"{HEAD},temperature [degC]")
    log = read_imu_log(path, curves={"accel_y": curve})
    np.testing.assert_array_equal(log.imu.rotation, plain.rotation)
    np.testing.assert_allclose(log.imu.velocity, plain.velocity, atol=0.02 * 0.01 * DT)
    assert "curve-subtracted" in {each.code for each in log.notices}
    path = write_imu(tmp_path, rows[:, :-1])
    (said,) = [
        e for e in read_imu_log(path, curves={"accel_y": curve}).notices if "curve" in e.code
    ]
    assert (said.code, said.severity) == ("curve-not-subtracted", "bad")
