"""Means and noise of sensors at rest, on either side of what contradicts a unit or the columns."""

import numpy as np
import pytest

from gmwm import InputError, Recording
from gmwm._core.units import sensor_unit
from gmwm.readers.columns import Given
from gmwm.readers.rest import rest_notices
from reading import SI

G, RATE, N = 9.80665, 100.0, 2000


def recorded(gyro=(1e-3, 0.0, 0.0), accel=(0.0, 0.0, -G), noise=(1e-4, 1e-2), n=N):
    rng = np.random.default_rng(1)
    values = {}
    for sensor, mean, size in (("gyro", gyro, noise[0]), ("accel", accel, noise[1])):
        for axis, level in zip("xyz", mean, strict=True):
            values[f"{sensor}_{axis}"] = level + size * rng.normal(size=n)
    return Recording.from_arrays(values, RATE, SI, "a.csv")


def notices(recording, given=(), columns=False, layout=False):
    units = {name: sensor_unit(SI[name.split("_")[0]]) for name in recording}
    said = Given(units=dict.fromkeys(given, ""), channels={} if columns else None)
    return rest_notices(recording, units, said, has_layout=layout)


def test_of_a_sensor_at_rest_nothing_is_said():
    assert notices(recorded()) == ()


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
    assert {each.severity for each in found} <= {"warning"}
    assert all("a sensor at rest reads 1 g" in each.text for each in found)


@pytest.mark.parametrize(("ratio", "bad"), [(0.48, True), (0.55, False), (1.9, False), (2.1, True)])
def test_gravity_has_to_show_in_a_known_layout(ratio, bad):
    recording = recorded(accel=(0.0, 0.0, ratio * G))
    if bad:
        with pytest.raises(InputError, match="has another layout"):
            notices(recording, layout=True)
    else:
        assert len(notices(recording, layout=True)) == 1
    assert len(notices(recording, given=["accel"], layout=True)) == 1


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
