"""Means and noise of sensors at rest, on either side of what contradicts a unit or the columns."""

from types import SimpleNamespace

import numpy as np
import pytest

from gmwm import InputError, Recording
from gmwm.readers import tuning
from gmwm.readers.at_rest.sensors import _by_earth, _Sensor, rest_notices

G, RATE, N = 9.80665, 100.0, 2000
SI = {"gyro": "rad/s", "accel": "m/s^2"}


def recorded(gyro=(1e-3, 0.0, 0.0), accel=(0.0, 0.0, -G), noise=(1e-4, 1e-2), n=N):
    rng = np.random.default_rng(1)
    values = {}
    for sensor, mean, size in (("gyro", gyro, noise[0]), ("accel", accel, noise[1])):
        for axis, level in zip("xyz", mean, strict=True):
            values[f"{sensor}_{axis}"] = level + size * rng.normal(size=n)
    return Recording.from_arrays(values, RATE, SI, "a.csv")


def notices(recording, given=(), columns=False, **options):
    units = {name: SI[name.split("_")[0]] for name in recording}
    return rest_notices(recording, units, dict.fromkeys(given, ""), columns, **options)


def test_of_a_sensor_at_rest_nothing_is_said():
    assert notices(recorded()) == ()


def test_size_and_noise_of_a_sensor():
    recording = recorded(gyro=(3e-3, 0.0, -4e-3), noise=(2e-4, 1e-2))
    found = _Sensor.of(recording, {"gyro_x": "rad/s"}, "gyro")
    assert found.size == pytest.approx(5e-3, rel=0.01)
    assert found.usual == pytest.approx(5e-3, rel=0.01)
    assert found.scatter == pytest.approx(2e-4, rel=0.06)
    assert found.density == pytest.approx(2e-5, rel=0.25)
    assert found.size_error == pytest.approx(found.scatter * np.sqrt(3.0 / N))
    assert _Sensor.of(recording, {"gyro_x": "rad/s", "gyro_y": "deg/s"}, "gyro") is None


@pytest.mark.parametrize("unit", ["g", "ug"])
@pytest.mark.parametrize("off", [-0.11, -0.09, 0.09, 0.11])
def test_gravity_in_another_unit_to_a_tenth(unit, off):
    size = {"g": 1.0, "ug": 1e6}[unit] * (1.0 + off)
    recording = recorded(accel=(0.0, 0.6 * size, 0.8 * size), noise=(1e-4, 1e-3 * size))
    if abs(off) > 0.1:
        assert all("likely" not in each.values for each in notices(recording))
        return
    with pytest.raises(InputError, match=f"which is gravity in {unit}"):
        notices(recording)
    (found,) = notices(recording, given=["accel"])
    assert found.code == "gravity" and found.severity == "bad"
    assert found.values["likely"] == unit
    assert found.values["norm"] == pytest.approx(size, rel=0.01)
    assert float(found.hint.split()[-1]) == pytest.approx(G / size, rel=0.01)
    assert notices(recording, given=["accel_y"]) == (found,)


@pytest.mark.parametrize(
    ("size", "noise", "said"),
    [
        (1.29 * G, 1e-2, False), (1.31 * G, 1e-2, True), (0.71 * G, 1e-2, False),
        (0.69 * G, 1e-2, True),
        (3.0, 0.59, True), (3.0, 0.75, False),
    ],
)  # fmt: skip
def test_a_scale_that_no_unit_explains(size, noise, said):
    found = notices(recorded(accel=(0.0, 0.0, size), noise=(1e-4, noise)))
    assert bool(found) is said
    for notice in found:
        assert notice.severity == "warning"
        assert "which is neither that nor none" in notice.text


@pytest.mark.parametrize(
    ("ratio", "refused"), [(0.48, True), (0.55, False), (1.9, False), (2.1, True)]
)
def test_gravity_has_to_show_in_a_known_layout(ratio, refused):
    recording = recorded(accel=(0.0, 0.0, ratio * G))
    if refused:
        with pytest.raises(InputError, match="not of this layout"):
            notices(recording, has_layout=True)
    else:
        assert len(notices(recording, has_layout=True)) == 1
    assert len(notices(recording, given=["accel"], has_layout=True)) == 1


@pytest.mark.parametrize(("off", "said"), [(0.04, True), (0.06, False)])
def test_increments_are_named(off, said):
    size = G / RATE * (1.0 + off)
    found = notices(recorded(accel=(0.0, 0.0, size), noise=(1e-4, 1e-4)))
    assert ["increments" in each.text for each in found] == [True] * said
    assert [(each.severity, each.where) for each in found] == [("bad", "")] * said


@pytest.mark.parametrize(
    ("size", "noise", "swapped"),
    [(1.04 * G, 0.02, True), (1.06 * G, 0.02, False), (0.96 * G, 0.02, True),
     (G, 0.029, True), (G, 0.032, False)],
)  # fmt: skip
def test_gravity_in_the_columns_of_the_gyro(size, noise, swapped):
    recording = recorded((0.0, size, 0.0), (0.02, 0.0, 0.0), (noise * size, 1e-3))
    if not swapped:
        assert all(each.code != "swapped" for each in notices(recording, columns=True))
        return
    with pytest.raises(InputError, match="the two are swapped"):
        notices(recording)
    (found,) = notices(recording, columns=True)
    assert found.code == "swapped" and found.values["likely"] == "m/s^2"
    assert found.values["gyro"] == pytest.approx(size, rel=0.01)
    both = recorded((0.0, size, 0.0), (0.0, 0.0, G), (noise * size, 1e-2))
    assert all(each.code != "swapped" for each in notices(both))


@pytest.mark.parametrize(
    ("density", "off", "found"),
    [(0.99, 0.0, True), (1.01, 0.0, False), (0.0, 0.0, False), (0.5, 0.99, True),
     (0.5, -0.99, True), (0.5, 1.01, False)],
)  # fmt: skip
def test_the_rate_of_the_earth_in_another_unit_of_a_quiet_gyro(density, off, found):
    ratio = 57.0
    size = 7.292115e-5 * (1.0 + off * tuning.EARTH_AGREES) / ratio
    rate = SimpleNamespace(density=density * tuning.EARTH_SEEN / ratio, size=size)
    said = _by_earth(rate, {"deg/h": 1e-3, "rad/s": ratio})
    is_told = said == ("the mean rate is that of the earth in rad/s", ["rad/s"])
    assert is_told is found


@pytest.mark.parametrize(
    ("density", "part", "found"),
    [(0.99, 0.79, True), (0.99, 1.21, True), (0.99, 0.81, False), (0.99, 1.19, False),
     (1.01, 0.5, False), (0.0, 0.5, False), (0.99, 0.0011, True), (0.99, 0.0009, False)],
)  # fmt: skip
def test_a_navigation_gyro_reads_the_rate_of_the_earth(density, part, found):
    rate = SimpleNamespace(density=density * tuning.EARTH_SHOWS, size=7.292115e-5 * part)
    said = _by_earth(rate, {"mrad/s": 1.1, "deg/s": 1e7})
    assert (said is not None) is found
    assert said is None or said[1] == ["mrad/s"]
