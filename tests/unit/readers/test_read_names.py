"""What names of columns mean."""

from __future__ import annotations

import pytest

from gmwm.readers.names import meaning, of_dates

GYRO = """gyro_{} g{} w{} omega_{} angular_velocity.{} angular_velocity_{} gyr_{} rate_{} ang_vel_{}
    imu.angular_velocity.{} /imu/data/angular_velocity/{} gyro{} {}gyro {}_gyro_out RAW_IMU.{}gyro
    w_RS_S_{} gyroscope_{} angularVelocity{} imu_gyro_{} gyro_{}_rps gyro_{}_rad_s"""
ACCEL = """accel_{} a{} acc_{} f{} linear_acceleration.{} acceleration_{} a_RS_S_{} accelerometer_{}
    specific_force_{} SpecForce{} field.linear_acceleration.{} {}acc a_{} lin_acc_{}
    accel_{}_mps2"""
NEITHER = """qx qw orientation.x mag_x x y z w a g flag index seq max
    acc_max
    gyro_bias_x bias_gyro_x linear_velocity_x yaw_rate pitch_rate gyro_integral_dt delta_angle_x
    hours minutes days t_min sample_time_coarse time_of_flight g_force_x a_gain_y
    accelerometer_timestamp_relative angular_velocity_covariance[0] error_rate s dates times
    3 col3 [] [deg/s]"""


@pytest.mark.parametrize(
    ("sensor", "pattern"),
    [*(("gyro", p) for p in GYRO.split()), *(("accel", p) for p in ACCEL.split())],
)
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_channel(sensor, pattern, axis):
    name = pattern.format(axis)
    assert meaning(name).role == f"{sensor}_{axis}"
    assert meaning(name.upper()).role == f"{sensor}_{axis}"


@pytest.mark.parametrize("name", ["GyroX", "GyrX", "Gyroscope_X", "Gyro X", "AngularVelocityX"])
def test_humps(name):
    assert meaning(name).role == "gyro_x"


@pytest.mark.parametrize("index", [0, 1, 2])
def test_px4(index):
    assert meaning(f"gyro_rad[{index}]").role == f"gyro_{'xyz'[index]}"
    assert meaning(f"gyro_rad[{index}]").unit == "rad/s"
    assert meaning(f"accelerometer_m_s2[{index}]").role == f"accel_{'xyz'[index]}"
    assert meaning(f"accelerometer_m_s2[{index}]").unit == "m/s^2"


@pytest.mark.parametrize("name", [*NEITHER.split(), "", "second [g]", "t [m]", "é", "gyro [x]"])
def test_anything_else(name):
    assert meaning(name).role is None


@pytest.mark.parametrize(
    ("name", "seconds"),
    [
        *[(name, None) for name in ("time", "t", "TIMESTAMP", "stamp", "time_stamp", "TimeStamp")],
        *[(name, None) for name in ("header.stamp", "Time (UTC)", "%time", "unix time", "ts")],
        *[(name, 1.0) for name in ("time_s", "sec", "time [s]", "t (sec)", "Time_Sec", "seconds")],
        *[(name, 1e-3) for name in ("ms", "time_ms", "t [ms]", "millis", "timestamp_msec")],
        *[(name, 1e-6) for name in ("TimeUS", "timestamp_us", "time [µs]", "time(μs)", "micros")],
        *[(name, 1e-9) for name in ("#timestamp [ns]", "time_ns", "t_nsec", "timens")],
        *[(name, 60.0) for name in ("time [min]", "time_minutes")],
        *[(name, 3600.0) for name in ("time [h]", "time_hours")],
        *[(name, 86400.0) for name in ("time [days]", "time_days")],
        ("SampleTimeFine", 1e-4),
        ("time_ms [s]", 1.0),
    ],
)
def test_time(name, seconds):
    assert meaning(name).role == "time"
    assert meaning(name).seconds == seconds


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("gyro_x [deg/s]", "deg/s"),
        ("gyro_x (rad s^-1)", "rad s^-1"),
        ("gyro_x (rad s-1)", "rad s^-1"),
        ("gyro_x_dps", "deg/s"),
        ("gyro_dps_x", "deg/s"),
        ("gyro_x_dps [rad/s]", "rad/s"),
        ("omega_x_deg_per_s", "deg/s"),
        ("gx [°/s]", "deg/s"),
        ("ax [G]", "g"),
        ("ax [µg]", "ug"),
        ("ax [m/s²]", "m/s^2"),
        ("ax [m/s/s]", "m/s/s"),
        ("ax [m·s^-2]", "m·s^-2"),
        ("level [mg]", "mg"),
        ("ax", None),
        ("ax [counts]", None),
        ("ax [LSB]", None),
        ("ax [m]", None),
        ("ax []", None),
        # A header is not a place for arithmetic.
        ("ax [9**9**9]", None),
        ("ax [s^9^9^9]", None),
        ("ax [s^3^3^3^3^3]", None),
        ("ax [m/s^2 * 9999999]", None),
        ("ax [" + "m/" * 500 + "s]", None),
    ],
)
def test_unit(name, unit):
    assert meaning(name).unit == unit


@pytest.mark.parametrize(
    ("name", "stated"),
    [("time [ticks]", "ticks"), ("t [s]", "s"), ("time", ""), ("stamp (UTC)", "UTC")],
)
def test_what_a_name_states_of_its_time(name, stated):
    assert meaning(name).stated == stated


@pytest.mark.parametrize(
    ("name", "dates"),
    [("UTC", "UTC time [s]"), ("", "time [s]"), ("date (UTC)", "date time [s]"),
     ("time", "time [s]"), ("stamp [local]", "stamp [s]")],
)  # fmt: skip
def test_columns_of_dates_are_times_in_seconds(name, dates):
    assert of_dates(name) == dates
    assert meaning(dates).seconds == 1.0


@pytest.mark.parametrize(
    ("name", "dates"),
    [("gps stamp", "gps stamp [s]"), ("day of boot", "day of boot time [s]"), ("17", "17 [s]"),
     ("utc 17", "utc 17 time [s]")],
)  # fmt: skip
def test_the_last_word_of_a_column_of_dates_says_whether_it_is_vague(name, dates):
    assert of_dates(name) == dates
