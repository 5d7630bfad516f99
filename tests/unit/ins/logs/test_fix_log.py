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


@pytest.mark.parametrize(
    ("column", "what"),
    [
        ("latitude_deg,longitude_deg,height_m,vn,ve,vd", ""),
        ("longitude_deg,latitude_deg,height_m,vn,ve,vd", "latitude and longitude"),
        ("latitude_deg,longitude_deg,height_m,ve,vn,vd", "velocity north and east"),
        ("latitude_deg,longitude_deg,height_m,vn,ve,vu", "velocity down and up"),
    ],
)
@pytest.mark.parametrize("outliers", [False, True])
def test_columns_that_are_exchanged(tmp_path: Path, column: str, what: str, outliers: bool) -> None:
    """Silently, a filter would blame its sensors."""
    rng = np.random.default_rng(5)
    time = np.arange(400.0)
    velocity = np.stack(
        [12.0 * np.cos(time / 40.0), 9.0 * np.sin(time / 30.0), 0.4 * np.sin(time / 20.0)], axis=1
    )
    gone = np.cumsum(velocity, axis=0) + rng.standard_normal((400, 3)) * [1.0, 1.0, 1.5]
    if outliers:
        gone[rng.random(400) < 0.03] += 50.0
    noisy = velocity + 0.1 * rng.standard_normal((400, 3))
    latitude, longitude = 46.0 + gone[:, 0] / 111e3, 7.0 + gone[:, 1] / 77e3
    rows = np.column_stack([time, latitude, longitude, 400.0 - gone[:, 2], noisy])
    path = write(tmp_path, rows.tolist(), f"time_s,{column}")
    if what:
        with pytest.raises(InputError, match=f"only if {what} are exchanged"):
            read_fixes(path)
    else:
        assert len(read_fixes(path).fixes) == 2


def drive(seconds: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions (deg, deg, m) and velocities of a drive with turns, with noise."""
    rng = np.random.default_rng(6)
    time = np.arange(float(seconds))
    velocity = np.stack([12.0 * np.cos(time / 40.0), 9.0 * np.sin(time / 15.0), 0.0 * time], axis=1)
    gone = np.cumsum(velocity, axis=0) + rng.standard_normal((seconds, 3))
    position = [46.0 + gone[:, 0] / 111e3, 7.0 + gone[:, 1] / 77e3, 400.0 - gone[:, 2]]
    return np.stack(position, axis=1), velocity + 0.1 * rng.standard_normal((seconds, 3))


@pytest.mark.parametrize(
    ("position", "velocity", "what"),
    [
        ((1.0, 1.0, 1.0), 1.0, ""),
        ((1.0, -1.0, 1.0), 1.0, "the sign of longitude"),
        ((-1.0, 1.0, 1.0), 1.0, "the sign of latitude"),
        ((np.pi / 180.0, np.pi / 180.0, 1.0), 1.0, "latitude and longitude are in rad"),
        ((1.0, 1.0, 1.0), 3.6, "velocities are in km/h"),
        ((1.0, 1.0, 1.0), 3600.0 / 1852.0, "velocities are in knots"),
        ((1.0, 1.0, 1.0), 1000.0, "velocities are in mm/s"),
    ],
)
def test_units_and_signs_that_do_not_go_together(
    tmp_path: Path, position: tuple[float, ...], velocity: float, what: str
) -> None:
    """In two minutes; the fixes were said to be noisy, or the heading wrong."""
    places, speeds = drive(120)
    rows = np.column_stack([np.arange(120.0), places * position, speeds * velocity])
    path = write(tmp_path, rows.tolist(), f"{HEAD},vn,ve,vd")
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
