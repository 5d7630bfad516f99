"""Units and columns that sensors at rest contradict."""

from __future__ import annotations

import numpy as np
import pytest

from gmwm._core.units import factor
from gmwm.errors import InputError
from gmwm.readers import read

N = 6000
NAMES = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
EARTH = 7.292115e-5


def imu(seed=0, gyro=7e-4, accel=2e-3, bias=(0.007, -0.007, -0.005), turn=0.0):
    """A minute at 100 Hz in SI; white noise per sqrt(Hz); turns about x for a second in the middle.

    By default the gyros are of 0.04 deg/s/sqrt(Hz) with biases of 0.4 deg/s.
    """
    rng = np.random.default_rng(seed)
    rate = np.array(bias) + 10.0 * gyro * rng.normal(size=(N, 3))
    angle = np.zeros(N)
    rate[3000:3100, 0] += turn
    angle[3000:3100] = turn * np.arange(1, 101) / 100.0
    angle[3100:] = turn
    gravity = 9.81 * np.column_stack([0.0 * angle, np.sin(angle), np.cos(angle)])
    return np.column_stack([rate, gravity + 10.0 * accel * rng.normal(size=(N, 3))])


def in_units(rows, gyro, accel):
    scale = [factor(gyro, "rad/s")] * 3 + [factor(accel, "m/s^2")] * 3
    return rows / scale


def header(gyro, accel, names=NAMES):
    return ",".join(f"{n} [{gyro if n.startswith('gyro') else accel}]" for n in names)


def notices(recording):
    codes = ("gravity", "swapped", "gyro-unit")
    return [notice for notice in recording.notices if notice.code in codes]


@pytest.mark.parametrize(
    ("seed", "units"), [(0, ("deg/s", "g")), (1, ("rad/s", "m/s^2")), (2, ("mdeg/s", "mg"))]
)
def test_what_is_right_is_not_mentioned(write, seed, units):
    # Of a cheap, a good and a navigation-grade gyro, which sees the earth; of none at all.
    for quality in (
        {},
        {"gyro": 7e-5, "bias": (1e-3, 2e-3, -2e-3)},
        {"gyro": 3e-7, "bias": (0.6 * EARTH, 0.0, 0.8 * EARTH)},
        {"bias": (0.0, 0.0, 0.0)},
        {"bias": (0.3, 0.0, 0.0), "gyro": 2e-3},
        {"turn": 0.1},
    ):
        path = write(in_units(imu(seed, **quality), *units), header(*units))
        assert not notices(read(path, rate=100.0)), quality


@pytest.mark.parametrize("units", [("deg/s", "g"), ("rad/s", "m/s^2"), ("deg/s", "mg")])
def test_swapped_columns(write, units):
    rows = in_units(imu(), *units)
    names = NAMES[3:] + NAMES[:3]
    path = write(rows, header(*units, names))
    with pytest.raises(InputError, match="the two are swapped") as caught:
        read(path, rate=100.0)
    assert caught.value.code == "channels-swapped"
    # Six columns without names are gyro and accelerometer; these are not.
    path = write(rows[:, [3, 4, 5, 0, 1, 2]])
    with pytest.raises(InputError, match="channels="):
        read(path, rate=100.0, units={"gyro": units[0], "accel": units[1]})
    # Who says so himself is believed, and warned.
    channels = {name: i for i, name in enumerate(NAMES)}
    given = {"gyro": units[0], "accel": units[1]}
    recording = read(path, rate=100.0, units=given, channels=channels)
    assert [(n.code, n.severity) for n in notices(recording)] == [("swapped", "bad")]


def test_a_bias_of_one_degree_per_second_is_no_gravity(write):
    # Of data without gravity, and of an accelerometer that has it.
    for gravity in (0.0, 1.0):
        rows = imu(bias=np.radians([0.6, 0.0, 0.8])) * ([1.0] * 3 + [gravity] * 3)
        path = write(in_units(rows, "deg/s", "g"), header("deg/s", "g"))
        assert not notices(read(path, rate=100.0))


@pytest.mark.parametrize(
    ("true", "read_as", "quality"),
    [
        ("deg/s", "rad/s", {}),  # the noise
        ("deg/s", "rad/s", {"gyro": 5e-5, "bias": (0.02, 0.0, 0.01)}),  # the mean
        ("mdeg/s", "deg/s", {}),
        ("deg/h", "deg/s", {"gyro": 1e-5, "bias": (1e-4, 0.0, 1e-4)}),
    ],
)
@pytest.mark.parametrize("is_given", [False, True])
def test_a_gyro_in_another_unit_is_suspected(write, true, read_as, quality, is_given):
    path = write(
        in_units(imu(**quality), true, "g"), ",".join(NAMES) if is_given else header(read_as, "g")
    )
    units = {"gyro": read_as, "accel": "g"} if is_given else None
    (found,) = notices(read(path, rate=100.0, units=units))
    assert (found.code, found.severity) == ("gyro-unit", "bad")
    # Of milli-degrees per second and degrees per hour there is a factor of 3.6 between.
    assert true in found.hint
    assert factor(found.values["likely"], true) == pytest.approx(1.0, abs=0.75)


def test_a_rate_that_no_unit_explains(write):
    path = write(in_units(imu(bias=(0.0, 0.0, 1.5)), "deg/s", "g"), header("deg/s", "g"))
    (found,) = notices(read(path, rate=100.0))
    assert found.code == "gyro-unit"
    assert "a mean rate of 85.9 deg/s" in found.text


@pytest.mark.parametrize("axes", [1, 2])
def test_fewer_axes_have_noise_as_well(write, axes):
    path = write(in_units(imu(), "mdeg/s", "g")[:, :axes], header("deg/s", "g", NAMES[:axes]))
    (found,) = notices(read(path, rate=100.0))
    assert found.code == "gyro-unit" and "mdeg/s" in found.hint


def counted(rows, gyro, accel):
    return np.rint(rows / ([gyro] * 3 + [accel] * 3))


@pytest.mark.parametrize(
    ("unit", "bit", "reported"),
    [
        ("deg/s", 3e-4, True),  # noise of 23 counts
        ("rad/s", 1e-3, True),
        ("deg/s", 5e-3, False),  # of 1.4: a coarse output, if one of another world
        ("mdeg/s", 3e-4, False),
        ("deg/h", 3e-4, False),
    ],
)
def test_counts_are_no_unit(write, unit, bit, reported):
    rows = counted(imu(), bit, 1e-4)
    recording = read(write(rows[:, :3], header(unit, "", NAMES[:3])), rate=100.0)
    found = [each for each in recording.notices if each.where == "gyro"]
    assert ("counts" in {each.code for each in found}) is reported
    if reported:  # in one notice
        (notice,) = found
        assert notice.severity == "bad" and "gyro_x, gyro_y, gyro_z" in notice.text
        assert notice.values["noise"] == pytest.approx(7e-3 / bit, rel=0.1)


def test_counts_of_an_accelerometer(write):
    rows = counted(imu(), 3e-4, 1.7e-3)
    recording = read(write(rows[:, 3:5], header("", "m/s^2", NAMES[3:5])), rate=100.0)
    assert [each.where for each in recording.notices if each.code == "counts"] == ["accel"]
    # One sample that is none is enough.
    rows[4999, 3:] += 0.5
    recording = read(write(rows[:, 3:5], header("", "m/s^2", NAMES[3:5])), rate=100.0)
    assert "counts" not in {each.code for each in recording.notices}


def test_missing_axes_and_samples_are_survived(write):
    rows = in_units(imu(), "deg/s", "g")
    rows[::2] = np.nan
    path = write(rows, header("rad/s", "g"))
    assert len(notices(read(path, rate=100.0))) <= 1
    path = write(rows[:, 1:], header("deg/s", "g", NAMES[1:]))
    assert not notices(read(path, rate=100.0))


@pytest.mark.parametrize(("mean", "reported"), [(0.105, True), (0.04, False), (0.8, False)])
def test_a_mean_rate_that_few_gyros_have_at_rest(write, mean, reported):
    path = write(imu(bias=(0.0, mean, 0.0)), header("rad/s", "m/s^2"))
    found = [each for each in read(path, rate=100.0).notices if each.code == "mean-rate"]
    assert len(found) == reported
    if reported:
        assert found[0].severity == "warning"
        assert found[0].values["mean"] == pytest.approx(mean, rel=1e-2)
