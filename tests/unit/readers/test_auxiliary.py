"""Temperature, voltage and further clocks beside the gyros and accelerometers."""

import numpy as np
import pytest

import gmwm
from gmwm import InputError, Recording, read
from gmwm._core.units import auxiliary_unit
from gmwm.readers import Wanted, open_tables, with_thermometer
from gmwm.readers.names import meaning

UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


def codes(recording):
    return [notice.code for notice in recording.notices]


@pytest.fixture
def columns(samples):
    return np.column_stack([samples[:, :2], 20.0 + samples[:, 2]])


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        *[(name, "temperature") for name in ("temp", "Temperature", "gyro_temp", "imuTemp1")],
        *[(name, "temperature") for name in ("T [degC]", "t [°C]", "die [K]", "temp_c", "temp x")],
        *[(name, "voltage") for name in ("voltage", "supply_voltage", "vdd", "bat [V]", "x [mV]")],
        *[(name, None) for name in ("temp_std", "std temp", "temp_time", "template", "t [m]", "v")],
    ],
)
def test_names_and_units_say_what_it_is(name, quantity):
    role = meaning(name).role
    assert role == quantity or (quantity is None and role in (None, "time"))


@pytest.mark.parametrize(
    ("unit", "value", "expected"),
    [
        ("degC", 25.0, 25.0),
        ("°C", 25.0, 25.0),
        ("K", 298.15, 25.0),
        ("degF", 77.0, 25.0),
        ("mV", 3300.0, 3.3),
        ("V", 3.3, 3.3),
        ("us", 1e6, 1.0),
    ],
)
def test_units(unit, value, expected):
    found = auxiliary_unit(unit)
    assert value * found.scale + found.offset == pytest.approx(expected)


@pytest.mark.parametrize("unit", ["", "rad/s", "g", "m/s^2", "deg", "Pa", "deg C K"])
def test_other_units(unit):
    assert auxiliary_unit(unit) is None


def test_auxiliary_channels_can_be_named(write, columns):
    path = write(columns, "gx,ax,die temp [K]")
    for also in ("temperature", "die temp"):
        recording = read(path, rate=50, units=UNITS, channels=["gyro", also])
        assert list(recording) == ["gyro_x", "die temp"]
    with pytest.raises(InputError, match="has no channel 'voltage'"):
        read(path, rate=50, units=UNITS, channels=["gyro", "voltage"])


def test_a_temperature_column_is_kept(write, columns):
    recording = read(write(columns, "gx,ax,temp [K]"), rate=50, units=UNITS)
    assert list(recording) == ["gyro_x", "accel_x", "temp"]
    channel = recording["temp"]
    assert (channel.quantity, channel.unit, channel.is_auxiliary) == ("temperature", "degC", True)
    np.testing.assert_allclose(channel.values, columns[:, 2] - 273.15, rtol=1e-12)
    assert [c.name for c in recording.inertial] == ["gyro_x", "accel_x"]
    (notice,) = recording.notices
    assert notice.code == "columns-auxiliary"
    assert notice.values == {"temp": "temperature"}


def test_without_a_unit_numbers_stay_as_they_are(write, columns):
    recording = read(write(columns, "gx,ax,temp"), rate=50, units=UNITS)
    assert recording["temp"].unit == ""
    np.testing.assert_array_equal(recording["temp"].values, columns[:, 2])
    assert str(recording.notices[0]) == "auxiliary channels: 'temp' (temperature, unit unknown)"
    known = read(write(columns, "gx,ax,temp"), rate=50, units=UNITS | {"temp": "degC"})
    assert known["temp"].unit == "degC"


def test_chosen_channels_may_be_auxiliary(write, columns):
    path = write(columns, "p,q,r")
    given = {"gyro_x": "p", "case_temp": "r"}
    recording = read(path, rate=50, units=UNITS, channels=given)
    assert recording["case_temp"].quantity == "temperature"
    recording = read(path, 50, UNITS | {"supply": "mV"}, {"gyro_x": "p", "supply": "r"})
    assert recording["supply"].quantity == "voltage"
    np.testing.assert_allclose(recording["supply"].values, 1e-3 * columns[:, 2])
    path = write(columns, "p,q,temp [degC]")
    assert list(read(path, rate=50, units=UNITS, channels={"gyro_x": "p"})) == ["gyro_x"]


def test_a_second_clock_is_kept(write, columns):
    t = np.arange(80) / 50.0
    path = write(np.column_stack([t, 1e3 * t, columns[:, 0]]), "time,gps_time_ms,gx")
    recording = read(path, units=UNITS)
    assert recording["gps_time_ms"].quantity == "clock"
    np.testing.assert_allclose(recording["gps_time_ms"].values, t, rtol=1e-12)
    ignored = read(path, rate=50, units=UNITS, time=False)
    assert list(ignored) == ["gyro_x"]


def test_equal_names_are_told_apart_by_their_place(write, columns):
    recording = read(write(columns, "gx,T [degC],T [K]"), rate=50, units=UNITS)
    assert list(recording) == ["gyro_x", "T", "T_2"]


def test_one_that_cannot_be_read_is_left_out(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("gx,temp,supply [V]\n" + "0.01,cold,5\n" * 80)
    recording = read(path, rate=50, units=UNITS)
    assert list(recording) == ["gyro_x", "supply"]
    assert codes(recording) == ["columns-auxiliary", "columns-unreadable"]
    assert "'temp'" in recording.notices[1].text
    assert "'supply'" not in recording.notices[1].text
    path.write_text("gx,temp\n" + "1,cold\n" * 79 + "1 2,cold\n")
    with pytest.raises(InputError, match="line 81, column 'gx'"):
        read(path, rate=50, units=UNITS)


def test_one_of_another_length_is_left_out(tmp_path, samples):
    path = tmp_path / "a.npz"
    np.savez(path, gx=samples[:, 0], temp=np.arange(8.0))
    recording = read(path, rate=50, units=UNITS)
    assert list(recording) == ["gyro_x"]
    assert codes(recording) == ["columns-auxiliary", "columns-unreadable"]


def test_gaps_of_the_clock_are_gaps_of_all(write, columns):
    t = np.arange(80) / 50.0
    t[40:] += 1.0
    path = write(np.column_stack([t, columns]), "time,gx,ax,temp [degC]")
    recording = read(path, units=UNITS)
    assert recording["temp"].missing == recording["gyro_x"].missing == 50


def test_arrays():
    arrays = {"gyro_x": np.zeros(8), "temp": np.full(8, 300.0), "bus": np.ones(8)}
    recording = Recording.from_arrays(arrays, 1.0, {"gyro": "rad/s", "temp": "K", "bus": "V"})
    assert [c.quantity for c in recording.values()] == ["gyro", "temperature", "voltage"]
    assert recording["temp"].mean == pytest.approx(26.85)


def test_no_model_and_no_diagnosis_of_its_own():
    rng = np.random.default_rng(4)
    arrays = {"gyro_x": rng.normal(size=3000), "temp": np.full(3000, 20.0)}
    arrays["gyro_x"][1000] = 60.0
    recording = Recording.from_arrays(arrays, 100.0, {"gyro": "rad/s", "temp": "degC"})
    found = gmwm.health(recording)
    assert list(found.channels) == ["gyro_x"]
    masked = found.masked(recording)
    assert masked["temp"] is recording["temp"]
    assert masked["gyro_x"].missing > 0
    calibration = gmwm.calibrate(recording, gmwm.WhiteNoise())
    assert (list(calibration), dict(calibration.skipped)) == (["gyro_x"], {})
    alone = Recording.from_arrays({"temp": np.arange(100.0)}, 1.0, {"temp": "K"})
    assert gmwm.health(alone).channels == {}
    with pytest.raises(InputError, match="only auxiliary channels"):
        gmwm.calibrate(alone)


def test_temperatures_of_another_file(tmp_path):
    rng = np.random.default_rng(4)
    arrays = {"gyro_x": rng.normal(size=1000), "temp": np.full(1000, 20.0)}
    recording = Recording.from_arrays(arrays, 10.0, {"gyro": "rad/s", "temp": "degC"})
    path = tmp_path / "oven.csv"
    path.write_text("time [min],fan,temperature [K]\n0,1,300\n1,2,310\n2,2,320\n")
    found = with_thermometer(recording, open_tables(path, Wanted())[0])
    np.testing.assert_allclose(found["temperature"].values, 26.85 + np.arange(1000) / 60.0)
    assert found.names == ("gyro_x", "temperature")  # not the recording's own
    path.write_text("time [min],temperature [K]\n100,300\n101,310\n102,320\n")
    with pytest.raises(InputError, match="do not cover half of the recording"):
        with_thermometer(recording, open_tables(path, Wanted())[0])
