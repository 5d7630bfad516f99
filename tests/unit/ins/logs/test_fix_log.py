from pathlib import Path

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.ins import read_fixes

ROWS = [[100.0 + i, 46.0 + 1e-5 * i, 7.0 + 2e-5 * i, 400.0 + i] for i in range(5)]
HEAD = "time_s,latitude_deg,longitude_deg,height_m"


def write(folder: Path, rows: list[list[object]], header: str = HEAD) -> Path:
    path = folder / "fixes.csv"
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]))
    return path


@pytest.mark.parametrize(
    "header",
    [HEAD, "t [s],Lat [deg],Lon [deg],Alt [m]", "time,gps_lat,gps_lon,h", "time,lat,lng,altitude"],
)
def test_positions(tmp_path: Path, header: str) -> None:
    (fixes,) = read_fixes(write(tmp_path, ROWS, header), start=90.0).fixes
    assert fixes.kind == "position"
    np.testing.assert_allclose(fixes.time, np.arange(10.0, 15.0))
    np.testing.assert_allclose(np.degrees(fixes.value[:, :2]), [row[1:3] for row in ROWS])
    np.testing.assert_allclose(fixes.value[:, 2], np.arange(400.0, 405.0))
    np.testing.assert_allclose(fixes.sd, np.tile([1.0, 1.0, 1.5], (5, 1)))


@pytest.mark.parametrize(
    ("header", "sign"),
    [
        ("velocity_north_mps,velocity_east_mps,velocity_down_mps", 1.0),
        ("vn,ve,vd", 1.0),
        ("VelN [m/s],VelE [m/s],VelU [m/s]", -1.0),
        ("north_velocity,east_velocity,up_velocity", -1.0),
        ("vel_n_m_s,vel_e_m_s,vel_d_m_s", 1.0),
    ],
)
def test_velocities(tmp_path: Path, header: str, sign: float) -> None:
    rows = [[*row, 1.0, 2.0, 3.0] for row in ROWS]
    _, velocity = read_fixes(write(tmp_path, rows, f"{HEAD},{header}")).fixes
    assert velocity.kind == "velocity"
    np.testing.assert_allclose(velocity.value, np.tile([1.0, 2.0, 3.0 * sign], (5, 1)))


def drive(seconds: int, outliers: bool) -> np.ndarray:
    """Rows of a drive with turns and climbs, with noise."""
    rng, time = np.random.default_rng(6), np.arange(float(seconds))
    velocity = np.stack(
        [12.0 * np.cos(time / 40.0), 9.0 * np.sin(time / 15.0), 0.8 * np.sin(time / 20.0)], axis=1
    )
    gone = np.cumsum(velocity, axis=0) + rng.standard_normal((seconds, 3)) * [1.0, 1.0, 1.5]
    if outliers:
        gone[rng.random(seconds) < 0.03] += 50.0
    position = [46.0 + gone[:, 0] / 111e3, 7.0 + gone[:, 1] / 77e3, 400.0 - gone[:, 2]]
    noisy = velocity + 0.1 * rng.standard_normal((seconds, 3))
    return np.column_stack([time, *position, noisy])


RIGHT = "time_s,latitude_deg,longitude_deg,height_m,vn,ve,vd"
RAD = np.pi / 180.0


@pytest.mark.parametrize(
    ("header", "factors", "what"),
    [
        (RIGHT, (1, 1, 1), ""),
        ("time_s,longitude_deg,latitude_deg,height_m,vn,ve,vd", (1, 1, 1),
         "latitude and longitude are exchanged"),
        (RIGHT.replace("vn,ve", "ve,vn"), (1, 1, 1), "velocity north and east are exchanged"),
        (RIGHT.replace("vd", "vu"), (1, 1, 1), "velocity down and up are exchanged"),
        (RIGHT, (1, -1, 1), "the sign of longitude"),
        (RIGHT, (-1, 1, 1), "the sign of latitude"),
        (RIGHT, (RAD, RAD, 1), "latitude and longitude are in rad"),
        (RIGHT, (1, 1, 3.6), "velocities are in km/h"),
        (RIGHT, (1, 1, 3600.0 / 1852.0), "velocities are in knots"),
        (RIGHT, (1, 1, 1000.0), "velocities are in mm/s"),
    ],
)  # fmt: skip
@pytest.mark.parametrize(("seconds", "outliers"), [(120, False), (400, True)])
def test_columns_and_units_that_do_not_fit_each_other(
    tmp_path: Path, header: str, factors: tuple[float, ...], what: str, seconds: int, outliers: bool
) -> None:
    """The fixes were said to be noisy, the heading wrong, or the sensors bad."""
    latitude, longitude, speed = factors
    rows = drive(seconds, outliers) * [1.0, latitude, longitude, 1.0, speed, speed, speed]
    path = write(tmp_path, rows.tolist(), header)
    if what:
        with pytest.raises(InputError, match=f"only if {what}"):
            read_fixes(path)
    else:
        assert len(read_fixes(path).fixes) == 2


@pytest.mark.parametrize(
    ("header", "count"),
    [
        ("sd_north_m,sd_east_m,sd_down_m", 3),
        ("std_n,std_e,std_u", 3),
        ("latitude_sd_m,longitude_sd_m,height_sd_m", 3),
        ("sigma_lat,sigma_lon,sigma_h", 3),
        ("horizontal_accuracy_m,vertical_accuracy_m", 2),
    ],
)
def test_standard_deviations(tmp_path: Path, header: str, count: int) -> None:
    values = [2.0, 2.0, 5.0] if count == 3 else [2.0, 5.0]
    rows = [[*row, *values] for row in ROWS]
    (fixes,) = read_fixes(write(tmp_path, rows, f"{HEAD},{header}")).fixes
    np.testing.assert_allclose(fixes.sd, np.tile([2.0, 2.0, 5.0], (5, 1)))


def test_standard_deviations_of_velocities(tmp_path: Path) -> None:
    rows = [[*row, 1.0, 2.0, 3.0, 0.1, 0.2, 0.3 + 0.1 * i] for i, row in enumerate(ROWS)]
    header = f"{HEAD},vn,ve,vd,sd_vn,sd_ve,sd_vd"
    position, velocity = read_fixes(write(tmp_path, rows, header)).fixes
    np.testing.assert_allclose(position.sd, np.tile([1.0, 1.0, 1.5], (5, 1)))
    np.testing.assert_allclose(velocity.sd, [row[-3:] for row in rows])


def test_empty_rows_and_the_gulf_of_guinea_are_no_fixes(tmp_path: Path) -> None:
    rows: list[list[object]] = [list(row) for row in ROWS]
    rows[1][1] = ""
    rows[3][1:3] = [0.0, 0.0]
    (fixes,) = read_fixes(write(tmp_path, rows)).fixes
    np.testing.assert_allclose(fixes.time, [100.0, 102.0, 104.0])


@pytest.mark.parametrize(
    ("header", "row", "cells", "message"),
    [
        ("time_s,latitude_deg,height_m,x", 0, ROWS[0], "no column for longitude"),
        ("time_s,latitude_rad,longitude_rad,height_m", 0, ROWS[0], "line 2: a latitude of 26"),
        ("time_s,latitude_m,longitude_deg,height_m", 0, ROWS[0], "m is not a unit of angle"),
        ("time_s,latitude_deg,longitude_deg,height_deg", 0, ROWS[0], "not a unit of height"),
        (HEAD, 2, [101.0, 46, 7, 400], "line 4: time stamp 101 repeats the one before"),
        (HEAD, 2, [99.0, 46, 7, 400], "line 4: time stamp 99 goes back"),
        (HEAD, 2, ["", 46, 7, 400], "line 4: no time"),
        (HEAD, 2, [102, "x", 7, 400], "line 4"),
    ],
)
def test_bad_files(
    tmp_path: Path, header: str, row: int, cells: list[object], message: str
) -> None:
    rows: list[list[object]] = [list(each) for each in ROWS]
    rows[row] = cells
    with pytest.raises(InputError, match=message):
        read_fixes(write(tmp_path, rows, header))


def test_a_velocity_without_one_component_or_a_deviation_of_zero(tmp_path: Path) -> None:
    rows: list[list[object]] = [[*row, 1.0, 2.0] for row in ROWS]
    with pytest.raises(InputError, match="none for velocity down"):
        read_fixes(write(tmp_path, rows, f"{HEAD},vn,ve"))
    rows = [[*row, 1.0, 2.0, 0.0 if i == 3 else 1.0] for i, row in enumerate(ROWS)]
    with pytest.raises(InputError, match="line 5: a standard deviation of 0"):
        read_fixes(write(tmp_path, rows, f"{HEAD},sd_n,sd_e,sd_d"))
    with pytest.raises(InputError, match="both look like"):
        read_fixes(write(tmp_path, rows, f"{HEAD},vn,ve,v_north"))
    with pytest.raises(InputError, match="does not exist"):
        read_fixes(tmp_path / "no.csv")
