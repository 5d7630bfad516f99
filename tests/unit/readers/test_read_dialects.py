"""Text files as the usual programs export them."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.readers import read
from gmwm.readers.clock import is_time_of_day
from gmwm.readers.names import CANONICAL
from reading import SI

N = 100


@pytest.fixture
def rows():
    found = np.round(np.random.default_rng(4).normal(size=(N, 6)), 4) * 0.01
    found[:, 5] += 9.81
    return np.round(found, 6)


@pytest.fixture
def save(tmp_path):
    def _save(name, head, table):
        path = tmp_path / name
        lines = [",".join(map(str, row)) for row in table]
        path.write_text("\n".join([*head, *lines, ""]))
        return path

    return _save


def values(recording):
    return np.column_stack([recording[name].values for name in CANONICAL if name in recording])


XSENS = ["// General information:", "//  MT Manager version: 2020.0", "//  Update Rate: 100.0Hz",
         "PacketCounter,SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z"]  # fmt: skip


@pytest.mark.parametrize("start", [1000, 2**32 - 4000, 65536 - 3000])
def test_xsens(save, rows, start):
    ticks = (start + 100 * np.arange(N)) % 2 ** (16 if start < 2**31 and start > 2000 else 32)
    table = [[i, t, *row[3:], *row[:3]] for i, (t, row) in enumerate(zip(ticks, rows, strict=True))]
    table[50][2] = ""
    found = read(save("mt.txt", XSENS, table), units=SI)
    rows[50, 3] = np.nan
    np.testing.assert_array_equal(values(found), rows)
    assert found.rate == pytest.approx(100.0, rel=1e-9)
    codes = {notice.code for notice in found.notices}
    assert ("clock-wraps" in codes) == (start > 1000)


@pytest.mark.parametrize(("sensor", "first"), [
    ("Gyroscope", 0), ("TotalAcceleration", 3), ("Accelerometer", 3),
])  # fmt: skip
def test_android_sensor_logger(save, rows, sensor, first):
    stamps = 1_700_000_000_000_000_000 + 10_000_000 * np.arange(N)
    table = [[t, 0.01 * i, *row[first : first + 3][::-1]]
             for i, (t, row) in enumerate(zip(stamps, rows, strict=True))]  # fmt: skip
    found = read(save(f"{sensor}.csv", ["time,seconds_elapsed,z,y,x"], table))
    np.testing.assert_array_equal(values(found), rows[:, first : first + 3])
    assert found.rate == pytest.approx(100.0, rel=1e-6)
    codes = {notice.code for notice in found.notices}
    assert ("gravity-absent" in codes) == (sensor == "Accelerometer")


BLACKBOX = ['"Product","Blackbox flight data recorder by Nicholas Sherlock"',
            '"firmwareType","Cleanflight"', '"gyro_scale","0x3089705f"', '"acc_1G","2048"',
            '"vbatcellvoltage","33,35,43"']  # fmt: skip
BLACKBOX_NAMES = ('"loopIteration","time","axisP[0]","gyroADC[0]","gyroADC[1]","gyroADC[2]",'
                  '"accSmooth[0]","accSmooth[1]","accSmooth[2]"')  # fmt: skip


def test_betaflight_blackbox(save):
    rng = np.random.default_rng(5)
    gyro, steps = rng.integers(-3, 4, (N, 3)), rng.integers(-20, 20, (N, 3))
    steps[:, 2] += 2048
    table = [[i, 500 * i, 7, *gyro[i], *steps[i]] for i in range(N)]
    found = read(save("btfl.csv", [*BLACKBOX, BLACKBOX_NAMES], table))
    assert found.rate == pytest.approx(2000.0, rel=1e-9)
    expected = np.column_stack([np.radians(gyro), steps / 2048.0 * 9.80665])
    np.testing.assert_allclose(values(found), expected, rtol=1e-15)


def test_a_blackbox_log_without_its_header(save):
    with pytest.raises(InputError, match="preamble of a blackbox log but no line that begins"):
        read(save("btfl.csv", BLACKBOX, [[1, 2, 3]]))


DOT = ["sep=,", "DeviceTag:,Xsens DOT 1", "OutputRate:,100Hz", "",
       "PacketCounter,SampleTimeFine,FreeAcc_X,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z"]  # fmt: skip
EPSON = ["2024/01/15,Version 1.0", "M-G370PDF1,FW 1.0,SN 123", "Scale: 0.0066,0.4",
         "Sample No,time,Gx,Gy,Gz,Ax,Ay,Az,Count"]  # fmt: skip
OMEGA = "omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z"
PX4 = ("timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],"
       "accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2]")  # fmt: skip
ECHO = ["%time,field.header.stamp"] + [
    f"field.{what}.{axis}" for what in ("angular_velocity", "linear_acceleration") for axis in "xyz"
]


def test_preambles_and_clocks_of_exporters(save, rows):
    count, ns = np.arange(N), 1_403_636_579_000_000_000 + 10_000_000 * np.arange(N)
    turned = rows[:, [3, 4, 5, 0, 1, 2]]
    wrapping = (2**32 - 500_000 + 10_000 * count) % 2**32
    for name, head, table, units in (
        ("dot.csv", DOT, [count, wrapping, 0.1 * rows[:, 0], *turned.T], SI),
        ("epson.csv", EPSON, [count, 0.01 * count, *rows.T, count], SI),
        ("imu0.csv", [f"timestamp,{OMEGA}"], [ns, *rows.T], {}),
        ("sensor_combined.csv", [PX4], [ns // 1000, *rows.T], {}),
        ("echo.csv", [",".join(ECHO)], [ns + 2_000_000, ns, *rows.T], SI),
    ):
        # As objects: whole nanoseconds stay whole.
        found = read(save(name, head, zip(*(each.tolist() for each in table), strict=True)),
                     units=units)  # fmt: skip
        np.testing.assert_allclose(values(found), rows, rtol=1e-15, err_msg=name)
        assert found.rate == pytest.approx(100.0, rel=1e-6), name
        has_preamble = any(notice.code == "preamble" for notice in found.notices)
        assert has_preamble == (len(head) > 1)


def test_scales_of_gyroflow(save):
    rng = np.random.default_rng(6)
    steps = rng.integers(-20, 20, (N, 6))
    steps[:, 5] += 2048
    head = ["GYROFLOW IMU LOG", "version,1.3", "orientation,YxZ", "tscale,0.001",
            "gscale,0.00122173047", "ascale,0.00048828125", "t,gx,gy,gz,ax,ay,az"]  # fmt: skip
    found = read(save("video.gcsv", head, [[5 * i, *row] for i, row in enumerate(steps)]))
    scales = np.repeat([0.00122173047, 0.00048828125 * 9.80665], 3)
    np.testing.assert_allclose(values(found), steps * scales, rtol=1e-14)
    assert found.rate == pytest.approx(200.0, rel=1e-9)


def test_a_header_of_another_width_than_the_data_is_no_preamble(save, rows):
    with pytest.raises(InputError, match=r"6 fields where the header \(line 1\) has 7"):
        read(save("wide.csv", ["time,gx,gy,gz,ax,ay,az"], rows), rate=100, units=SI)


@pytest.mark.parametrize(
    "head",
    [
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
        "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]",
        '"Time (ns)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)",'
        '"Acceleration x (m/s^2)","Acceleration y (m/s^2)","Acceleration z (m/s^2)"',
    ],
    ids=["EuRoC and TUM-VI", "phyphox"],
)
def test_units_in_the_header(save, rows, head):
    stamps = 1_520_000_000_000_000_000 + 5_000_000 * np.arange(N)
    table = [[t, *row] for t, row in zip(stamps, rows, strict=True)]
    found = read(save("data.csv", [head], table))
    np.testing.assert_array_equal(values(found), rows)
    assert found.rate == pytest.approx(200.0, rel=1e-6)


@pytest.mark.parametrize(("name", "head", "width"), [
    ("mt.txt", XSENS, 8), ("Gyroscope.csv", ["time,seconds_elapsed,z,y,x"], 5),
    ("btfl.csv", [*BLACKBOX, BLACKBOX_NAMES], 9),
])  # fmt: skip
def test_a_line_that_is_cut_off(save, name, head, width):
    table = [[i * 100, *np.full(width - 1, i * 100)] for i in range(N)]
    table[-1] = table[-1][:-2]
    with pytest.raises(InputError, match=f"{width - 2} fields where {width} were expected"):
        read(save(name, head, table), units=SI)


@pytest.mark.parametrize(
    ("header", "zone", "mark"),
    [("time", "", "T"), ("Timestamp (UTC)", "Z", "T"), ("Date", "+01:00", " "), ("", "", " ")],
)
@pytest.mark.parametrize("quoted", [False, True])
def test_dates_are_times_in_seconds(tmp_path, header, zone, mark, quoted):
    path = tmp_path / "log.csv"
    first = datetime(2026, 2, 28, 23, 59, 59)  # passes a day and a month
    rows = [
        (first + timedelta(milliseconds=5 * i)).isoformat(mark, "milliseconds") + zone
        for i in range(400)
    ]
    lines = [f'"{row}",{i}.5' if quoted else f"{row},{i}.5" for i, row in enumerate(rows)]
    names = [f"{header},gyro_x [rad/s]"] if header else []
    path.write_text("\n".join([*names, *lines]))
    extra = {} if header else {"channels": {"gyro_x": 1}, "time": 0, "units": {"gyro_x": "rad/s"}}
    recording = read(path, **extra)
    assert recording.dt == pytest.approx(0.005, rel=1e-6)  # a quarter of a microsecond in 2 s
    assert recording["gyro_x"].values[-1] == 399.5
    assert "dates" in [notice.code for notice in recording.notices]


@pytest.mark.parametrize("wrong", ["2026-02-30T00:00:01.00", "soon"])
def test_a_date_that_is_none_is_named_with_its_line(tmp_path, wrong):
    path = tmp_path / "log.csv"
    rows = [f"2026-02-03T00:00:{i / 100:05.2f},{i}" for i in range(5000)]
    rows[4000] = f"{wrong},1"
    path.write_text("time,gyro_x [rad/s]\n" + "\n".join(rows))
    with pytest.raises(InputError, match=f"line 4002, column 'time .s.': '{wrong}'"):
        read(path)


def dated(tmp_path, stamps, delimiter=","):
    path = tmp_path / "log.csv"
    lines = [f"{stamp}{delimiter}{i}.5" for i, stamp in enumerate(stamps)]
    path.write_text("\n".join([f"time{delimiter}gyro_x [rad/s]", *lines]))
    return read(path)


FIRST = datetime(2026, 2, 28, 23, 59, 59)
MOMENTS = [FIRST + timedelta(milliseconds=5 * i) for i in range(400)]


@pytest.mark.parametrize(
    ("form", "zone", "delimiter"),
    [("%Y-%m-%dT%H:%M:%S,%f", "Z", ";"), ("%Y-%m-%dT%H:%M:%S.%f", "+02", ","),
     ("%Y%m%dT%H%M%S.%f", "Z", ","), ("%Y%m%dT%H%M%S,%f", "+0530", ";"),
     ("%Y-%m-%dt%H:%M:%S.%f", "z", ","), ("%Y-%m-%d %H:%M:%S.%f", " UTC", ","),
     ("%Y/%m/%d %H:%M:%S.%f", "", ","), ("%Y-%jT%H:%M:%S.%f", "Z", ","),
     ("%Y%jT%H%M%S.%f", "Z", ","), ("%G-W%V-%uT%H:%M:%S.%f", "Z", ","),
     ("%GW%V%uT%H%M%S.%f", "", ",")],
)  # fmt: skip
def test_forms_of_iso_dates(tmp_path, form, zone, delimiter):
    recording = dated(tmp_path, [each.strftime(form) + zone for each in MOMENTS], delimiter)
    assert recording.dt == pytest.approx(0.005, rel=1e-6)
    assert recording["gyro_x"].values[-1] == 399.5


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [("2026-03-01T00:00:65.000Z", "is not a date that exists"),
     ("2026-03-01T00:00:60.000Z", "is not a date that exists"),
     ("2026-03-01T23:58:60.000Z", "is not a date that exists"),
     ("2026-03-01T00:00:00.500+99:99", "is not a date that exists"),
     ("2026-03-01T00:00:00.500+02:75", "is not a date that exists"),
     ("2026-03-01T00:00:00.500", "has no zone, unlike the dates before it"),
     ("later", "is not a date")],
)  # fmt: skip
def test_dates_that_are_none_or_of_another_zone_are_refused(tmp_path, wrong, problem):
    stamps = [each.isoformat(timespec="milliseconds") + "Z" for each in MOMENTS]
    stamps[300] = wrong
    with pytest.raises(InputError, match=f"line 302.*{problem}"):
        dated(tmp_path, stamps)


def test_a_zone_where_the_others_have_none_is_refused(tmp_path):
    stamps = [each.isoformat(timespec="milliseconds") for each in MOMENTS]
    stamps[300] += "+01:00"
    with pytest.raises(InputError, match=r"line 302.*has a zone, unlike"):
        dated(tmp_path, stamps)


def test_a_leap_second_is_read(tmp_path):
    stamps = [f"2016-12-31T23:59:{i / 10:04.1f}Z" for i in range(500, 610)]
    assert dated(tmp_path, stamps).dt == pytest.approx(0.1, rel=1e-6)


def test_times_of_day_as_one_number_have_no_gap_at_the_minute(tmp_path):
    moments = [FIRST + timedelta(milliseconds=100 * i) for i in range(2000)]
    kept = moments[:1000] + moments[1003:]  # passes midnight and three minutes
    stamps = [each.strftime("%H%M%S.%f")[:-4] for each in kept]
    recording = dated(tmp_path, stamps)
    assert "time-of-day" in [notice.code for notice in recording.notices]
    values = recording["gyro_x"].values
    assert recording.dt == pytest.approx(0.1, rel=1e-6)
    assert np.flatnonzero(np.isnan(values)).tolist() == [1000, 1001, 1002]


@pytest.mark.parametrize("step", [50, 100, 25, 0.05])
def test_plain_numbers_are_no_times_of_day(step):
    assert not is_time_of_day(step * np.arange(1000.0))


def test_an_hour_without_samples_stays_missing_in_utc(tmp_path):
    moments = [FIRST + timedelta(seconds=i + 3600 * (i >= 4000)) for i in range(6000)]
    recording = dated(tmp_path, [each.isoformat() + "Z" for each in moments])
    assert recording["gyro_x"].missing == 3600
