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
def test_channel(sensor, pattern):
    for axis in "xyz":
        name = pattern.format(axis)
        assert meaning(name).role == meaning(name.upper()).role == f"{sensor}_{axis}"


def test_humps():
    names = ("GyroX", "GyrX", "Gyroscope_X", "Gyro X", "AngularVelocityX")
    assert {meaning(name).role for name in names} == {"gyro_x"}


def test_px4():
    for index, axis in enumerate("xyz"):
        gyro, accel = meaning(f"gyro_rad[{index}]"), meaning(f"accelerometer_m_s2[{index}]")
        assert (gyro.role, gyro.unit.text) == (f"gyro_{axis}", "rad/s")
        assert (accel.role, accel.unit.text) == (f"accel_{axis}", "m/s^2")


def test_anything_else():
    names = [*NEITHER.split(), "", "second [g]", "t [m]", "é", "gyro [x]"]
    assert [name for name in names if meaning(name).role is not None] == []


TIMES = {
    None: ("time", "t", "TIMESTAMP", "stamp", "time_stamp", "TimeStamp", "header.stamp",
           "Time (UTC)", "%time", "unix time", "ts"),
    1.0: ("time_s", "sec", "time [s]", "t (sec)", "Time_Sec", "seconds", "time_ms [s]"),
    1e-3: ("ms", "time_ms", "t [ms]", "millis", "timestamp_msec"),
    1e-6: ("TimeUS", "timestamp_us", "time [µs]", "time(μs)", "micros"),
    1e-9: ("#timestamp [ns]", "time_ns", "t_nsec", "timens"),
    60.0: ("time [min]", "time_minutes"),
    3600.0: ("time [h]", "time_hours"),
    86400.0: ("time [days]", "time_days"),
    1e-4: ("SampleTimeFine",),
}  # fmt: skip


@pytest.mark.parametrize("seconds", TIMES)
def test_time(seconds):
    for name in TIMES[seconds]:
        assert (meaning(name).role, meaning(name).seconds) == ("time", seconds), name


# A header is not a place for arithmetic.
NO_UNITS = ("ax", "ax [counts]", "ax [LSB]", "ax [m]", "ax []", "ax [9**9**9]", "ax [s^9^9^9]",
            "ax [s^3^3^3^3^3]", "ax [m/s^2 * 9999999]", "ax [" + "m/" * 500 + "s]")  # fmt: skip


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("gyro_x [deg/s]", "deg/s"), ("gyro_x (rad s^-1)", "rad s^-1"),
        ("gyro_x (rad s-1)", "rad s^-1"), ("gyro_x_dps", "deg/s"), ("gyro_dps_x", "deg/s"),
        ("gyro_x_dps [rad/s]", "rad/s"), ("omega_x_deg_per_s", "deg/s"), ("gx [°/s]", "deg/s"),
        ("ax [G]", "g"), ("ax [µg]", "ug"), ("ax [m/s²]", "m/s^2"), ("ax [m/s/s]", "m/s/s"),
        ("ax [m·s^-2]", "m·s^-2"), ("level [mg]", "mg"), ("ax [ft/s^2]", "ft/s^2"),
        ("gx [rpm]", "rpm"), *((name, None) for name in NO_UNITS),
    ],
)  # fmt: skip
def test_unit(name, unit):
    assert getattr(meaning(name).unit, "text", None) == unit


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
