import gzip
from pathlib import Path

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.ins.geometry import gravity, ned_difference
from gmwm.ins.increments import emulate
from gmwm.ins.trajectory.trajectory import Trajectory
from places import SHARED

FLIGHT = SHARED / "data/trajectories/fixed_wing_1.csv.gz"
HEADER = "time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,yaw_deg"


def rows(n: int = 40, dt: float = 0.1) -> np.ndarray:
    t = dt * np.arange(n)
    return np.stack(
        [t, 46 + 1e-5 * t, 179.999 + 1e-3 * t, 400 + t, 2 + 0 * t, 1 + t, 170 + 9 * t], axis=-1
    )


def write(folder: Path, table: np.ndarray, header: str = HEADER, name: str = "log.csv") -> Path:
    path = folder / name
    lines = [header, *(",".join(f"{x:.12g}" for x in row) for row in table)]
    text = ("\n".join(lines) + "\n").encode()
    path.write_bytes(gzip.compress(text) if name.endswith(".gz") else text)
    return path


@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz"])
def test_degrees_become_radians(tmp_path: Path, name: str) -> None:
    table = rows()
    found = Trajectory.read(write(tmp_path, table, name=name), smooth=None)
    assert found.dt == pytest.approx(0.1)
    np.testing.assert_allclose(np.degrees(found.lla[:, :2]), table[:, 1:3], rtol=1e-11)
    np.testing.assert_allclose(found.lla[:, 2], table[:, 3])
    np.testing.assert_allclose(np.degrees(found.rpy), table[:, 4:], rtol=1e-11)


@pytest.mark.parametrize(
    "header",
    [
        "t [s],Lat [deg],Lon [deg],Alt [m],Roll [deg],Pitch [deg],Heading [deg]",
        "time,lat,lng,altitude,roll,pitch,yaw",
        "time,gps.latitude,gps.longitude,h,rollDeg,pitchDeg,yawDeg",
        "Time (s);Latitude (°);Longitude (°);Height (m);Roll (°);Pitch (°);Yaw (°)",
    ],
)
def test_other_names(tmp_path: Path, header: str) -> None:
    path = write(tmp_path, rows(), header)
    if ";" in header:
        path.write_text(path.read_text().replace(",", ";"))
    found = Trajectory.read(path, smooth=None)
    assert np.degrees(found.lla[0, 0]) == pytest.approx(46.0)
    assert np.degrees(found.rpy[0, 2]) == pytest.approx(170.0)


def test_columns_in_any_order_with_others_between(tmp_path: Path) -> None:
    table = rows()
    shuffled = np.column_stack([table[:, 6], table[:, 1:4], np.full(40, 0.5), table[:, [4, 5, 0]]])
    header = "yaw_deg,lat_deg,lon_deg,height_ft,lat_std_m,roll_deg,pitch_deg,time_ms"
    found = Trajectory.read(write(tmp_path, shuffled, header), smooth=None)
    assert found.dt == pytest.approx(1e-4)
    np.testing.assert_allclose(found.lla[:, 2], 0.3048 * table[:, 3])


def test_small_latitudes_need_a_unit(tmp_path: Path) -> None:
    table = rows()
    table[:, 1] = 0.8
    plain = "time,latitude,longitude,height,roll,pitch,yaw"
    with pytest.raises(InputError, match=r"log\.csv, column 'latitude': are its angles in rad or"):
        Trajectory.read(write(tmp_path, table, plain))
    found = Trajectory.read(
        write(tmp_path, table, plain.replace("latitude", "latitude_deg")), smooth=None
    )
    assert np.degrees(found.rpy[0, 0]) == pytest.approx(2.0)


def spoilt(row: int, column: int, value: float) -> np.ndarray:
    table = rows()
    table[row, column] = value
    return table


def late(table: np.ndarray) -> np.ndarray:
    table[:20, 0] *= 1.012
    return table


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (spoilt(7, 3, np.nan), r"column 'height_m', line 9: no value"),
        (spoilt(7, 0, np.nan), r"column 'time_s', line 9: no value"),
        (spoilt(7, 0, 0.6), r"column 'time_s', line 9: time stamp 0\.6 repeats the one before"),
        (spoilt(7, 0, 0.55), r"column 'time_s', line 9: time stamp 0\.55 goes back"),
        (spoilt(7, 0, 0.73), r"line 9: time stamp 0\.73 is off the even spacing of 0\.1"),
        (late(rows()), r"line 11: time stamp 0\.9108 is off the even spacing of 0\.1"),
        (np.delete(rows(), 7, axis=0), r"line 9: time stamp 0\.8 is off the even spacing of 0\.1"),
        (spoilt(7, 1, 97.0), r"line 9: a latitude of 97 deg: check the unit"),
        (spoilt(7, 5, -91.0), r"line 9: a pitch of -91 deg: check the unit"),
        (spoilt(7, 1, 89.5), r"latitude 89\.5 deg at index 7 is too near a pole"),
        (spoilt(7, 4, 150.0), r"roll turns by 148 deg from epoch 6 to 7"),
        (rows(1), r"log\.csv has a single row"),
    ],
)
def test_bad_rows_are_named(tmp_path: Path, table: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Trajectory.read(write(tmp_path, table), smooth=None)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (HEADER.replace("roll", "foo"), "no column for roll: name the columns"),
        (HEADER.replace("time_s", "x"), "no column for time"),
        (HEADER.replace("roll", "lat"), "'latitude_deg' and 'lat_deg' both look like latitude"),
        (HEADER.replace("roll_deg", "roll_m"), "'roll_m': m is not a unit of angle"),
        (HEADER.replace("height_m", "height_deg"), "deg is not a unit of height"),
        (HEADER.replace("_deg", "_rad"), "a latitude of .* deg: check the unit"),
    ],
)
def test_bad_headers(tmp_path: Path, header: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Trajectory.read(write(tmp_path, rows(), header))


def test_a_wrapped_heading_and_longitude_are_smoothed_across(tmp_path: Path) -> None:
    table = rows(400, 0.02)
    wrapped = table.copy()
    wrapped[:, [2, 6]] = (table[:, [2, 6]] + 180.0) % 360.0 - 180.0
    assert np.ptp(wrapped[:, 2]) > 350.0
    assert np.ptp(wrapped[:, 6]) > 350.0
    found = Trajectory.read(write(tmp_path, wrapped))
    np.testing.assert_allclose(np.degrees(found.lla[:, 1]), table[:, 2], atol=1e-9)
    np.testing.assert_allclose(np.degrees(found.rpy[:, 2]), table[:, 6], atol=1e-9)


def test_rounding_vanishes_from_the_specific_force(tmp_path: Path) -> None:
    t = 0.01 * np.arange(3000)
    table = np.zeros((3000, 7))
    table[:, 0] = t
    table[:, 1] = 46.0
    table[:, 3] = np.round(400 + 3 * np.sin(0.8 * t), 3)  # 1 mm at 100 Hz: 10 m/s^2
    path = write(tmp_path, table)
    force = emulate(Trajectory.read(path)).velocity[:, 2] / 0.01
    middle = t[:-1] + 0.005
    expected = -gravity(np.radians(46.0), 400.0) + 3 * 0.64 * np.sin(0.8 * middle)
    assert np.std(emulate(Trajectory.read(path, smooth=None)).velocity[:, 2] / 0.01) > 5.0
    # Of a wave, cubic splines with knots 0.5 s apart miss (0.8 * 0.5)^2/12 of the acceleration at
    # most: 0.026 m/s^2. White rounding of 0.29 mm, of which 2 of 100 parts pass, times
    # (2 pi 1 Hz)^2 adds 2 mm/s^2 rms.
    assert np.std((force - expected)[100:-100]) < 0.026 / np.sqrt(2.0)


@pytest.mark.skipif(not FLIGHT.is_file(), reason="the shared data are not beside the repository")
def test_a_recorded_flight_becomes_flyable() -> None:
    raw, found = Trajectory.read(FLIGHT, smooth=None), Trajectory.read(FLIGHT)
    assert (found.n, found.dt) == (5999, pytest.approx(0.01))
    assert np.max(np.abs(ned_difference(found.lla, raw.lla))) < 0.06
    assert np.max(np.abs(found.rpy - np.unwrap(raw.rpy, axis=0))) < np.radians(0.5)
    imu = emulate(found)
    force = imu.velocity / imu.dt
    assert np.max(np.linalg.norm(force, axis=1)) < 20.0
    assert np.min(np.linalg.norm(force, axis=1)) > 6.0
    assert np.max(np.abs(np.diff(force, axis=0))) < 0.1
    assert np.max(np.abs(imu.rotation / imu.dt)) < 1.5
    assert np.max(np.abs(emulate(raw).velocity / imu.dt)) > 400.0
