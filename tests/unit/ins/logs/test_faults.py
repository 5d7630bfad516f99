"""Faults put into logs with a known truth: each is named with its values, and no other."""

from dataclasses import replace

import numpy as np
import pytest

from emulated_logs import emulated_log
from gmwm.ins import Measured, Navigated, Straight, emulate, gnss, perform
from gmwm.ins.filter.filter import InitialSd
from gmwm.ins.logs import Fault, Faults, Replay, fault_notice
from gmwm.study.demo import LEVER_ARM, sensors
from marks import slow

DURATION = 160.0


def found(seed, *faults, vehicle="car", **options):
    """What is found in a log with faults; the sensor models are right."""
    log, _ = emulated_log(
        seed, vehicle, duration=options.pop("duration", DURATION),
        rate=options.pop("rate", 10.0), faults=faults, **options,
    )  # fmt: skip
    return Navigated.of(log)


def codes(navigated):
    return [each.code for each in navigated.fault_notices]


@pytest.mark.parametrize(
    ("seed", "faults", "options", "expected"),
    [
        (204, ["off-grid"], {}, []),  # fixes between samples
        (300, [], {"vehicle": "loiter"}, []),
        *(
            slow(300 + k // 2, [], {"vehicle": ("car", "loiter")[k % 2]}, [])
            for k in (0, 2, 3, 4, 5)
        ),
        (208, ["stamps", "lever arm"], {"duration": 200.0}, ["lever-arm", "time-offset"]),
        # The filter diverges with either sign of any axis.
        (7105, ["one far"], {"vehicle": "loiter"}, ["outliers"]),
        # Of positions alone: the filter started from the line to an outlier, and was lost.
        (7109, ["outliers"], {"velocity": False}, ["outliers"]),
        slow(7113, ["outliers"], {"vehicle": "helicopter", "velocity": False}, ["outliers"]),
    ],
)
def test_each_fault_is_named_and_no_other(seed, faults, options, expected):
    navigated = found(seed, *faults, **options)
    assert sorted(codes(navigated)) == expected
    assert navigated.fits is not bool(expected)
    assert navigated.faults.explained


def within(fault, name, truth, sigmas=4.0):
    error = fault.values[f"{name} error"]
    assert abs(fault.values[name] - truth) < sigmas * error, (fault.values, name)
    return error


def test_stamps_that_are_late():
    navigated = found(201, "stamps")
    (fault,) = navigated.fault_notices
    assert navigated.verdict.code == fault.code == "time-offset"
    assert within(fault, "time offset", 0.2) < 0.02
    assert navigated.verdict.values["explained"]


@pytest.mark.parametrize("vehicle", ["loiter", slow("helicopter"), slow("car")])
def test_a_clock_that_runs_slow(vehicle):
    """A loiter's had late stamps, a helicopter's poor sensors, and the car's filter was lost."""
    navigated = found(214, "slow clock", vehicle=vehicle)
    assert codes(navigated) == ["clock-rate"]
    assert navigated.faults.explained
    (fault,) = navigated.fault_notices
    assert within(fault, "clock rate", 0.027) < 1e-3
    assert "multiply the IMU's times by 1.02" in fault.hint


@pytest.mark.slow
def test_leap_seconds_and_an_outlier():
    """The filter of such stamps is lost, and is aligned anew; other times stay the log's."""
    navigated = found(201, "leap seconds", "one far")
    assert navigated.faults.explained
    assert navigated.verdict.code == "time-offset"
    assert "GPS time" in navigated.verdict.text
    stamps, outlier = navigated.fault_notices
    assert within(stamps, "time offset", 18.0) < 0.02
    assert outlier.code == "outliers"
    times = navigated.measured.aiding.of("position").time
    truth = times[times.size // 2] - 18.0  # on the IMU's clock
    assert outlier.values["time"] == pytest.approx(truth, abs=0.2)


def test_circles_at_constant_speed_do_not_tell_stamps_from_a_lever_arm():
    faults = found(201, "stamps", vehicle="loiter").faults
    (fault,) = faults.found
    assert fault.code in {"time-offset", "lever-arm"}


@pytest.mark.parametrize("vehicle", ["loiter", slow("car")])
@pytest.mark.slow
def test_stamps_that_are_farther_off_than_one_search_reaches(vehicle):
    """Of circles, 1.5 s and an antenna 14 m behind "explained" 2.2 s, which are the same there."""
    log, _ = emulated_log(1000, vehicle, duration=300.0, rate=10.0)
    fixes = [
        replace(each, time=each.time + 2.2).part(each.time < 297.0) for each in log.aiding.fixes
    ]
    navigated = Navigated.of(replace(log, aiding=replace(log.aiding, fixes=tuple(fixes))))
    (fault,) = navigated.fault_notices
    assert within(fault, "time offset", 2.2) < 0.03
    assert navigated.faults.explained


@pytest.mark.parametrize("by", [-0.15, 0.15])
def test_fixes_along_the_track_are_as_good_as_stamps_where_a_vehicle_rolls(by):
    """The attitude was that of the next second of the track."""
    replay = found(201, vehicle="loiter").faults.replay
    exact, smooth = (move(by).standard for move in (replay.later, replay.along))
    moved = np.nansum((exact - replay.standard) ** 2)
    assert np.nansum((smooth - exact) ** 2) < 0.15 * moved


@pytest.mark.parametrize(
    "spoil",
    [
        lambda imu: replace(imu, rotation=imu.rotation / np.degrees(1.0)),
        slow(lambda imu: replace(imu, velocity=held(imu.velocity, 0, 60.0, imu.dt))),
    ],
    ids=["deg/s for rad/s", "an axis that is stuck"],
)
def test_noise_that_no_sensor_has_explains_nothing(spoil):
    """White noise of the gyros 200 to 600 times the model's was said to explain all."""
    log, _ = emulated_log(5, duration=80.0, rate=10.0)
    navigated = Navigated.of(replace(log, imu=spoil(log.imu)))
    assert not navigated.faults.explained
    assert navigated.verdict.code == "lost"


def held(samples, axis, start, dt):
    """Samples of which one axis keeps its value from a time on."""
    first, result = round(start / dt), samples.copy()
    result[first:, axis] = result[first, axis]
    return result


@pytest.mark.parametrize(
    ("vehicle", "seed", "rate"), [("car", 202, 10.0), slow("helicopter", 1000, 20.0)]
)
def test_a_lever_arm_left_out(vehicle, seed, rate):
    """And no time offset beside it, which would explain a part of it too."""
    (fault,) = found(seed, "lever arm", vehicle=vehicle, duration=300.0, rate=rate).fault_notices
    assert fault.code == "lever-arm"
    for name, truth in zip(("forward", "right", "down"), LEVER_ARM, strict=True):
        within(fault, name, truth)
    assert fault.values["forward error"] < 0.3


@pytest.mark.parametrize(
    ("down", "advice"),
    [(0.3, "give the lever arm 1.50,0.30,-2.80"),
     (2.0, "give the lever arm 1.50,0.30,-1.00; measure down, which"),
     (None, "measure it: this motion does not show any")],
)  # fmt: skip
def test_only_what_the_motion_shows_of_a_lever_arm_is_advised(down, advice):
    log, _ = emulated_log(1, duration=DURATION, rate=10.0)
    aiding = replace(log.aiding, lever_arm=(1.5, 0.3, -2.8))
    replay = Replay(log.imu, None, InitialSd(), log.sensors, aiding)
    errors = dict.fromkeys(("forward", "right", "down"), 0.1 if down else 2.0)
    if down:
        errors["down"] = down
    values = {"forward": 1.0, "right": 0.3, "down": -1.8}
    fault = Fault("lever-arm", "", replay, 20.0, 8.0, values, errors)
    assert fault_notice(fault, 0.0).hint.startswith(advice)


def test_one_fix_far_off_is_dated_on_the_clock_of_the_files():
    log, _ = emulated_log(205, duration=DURATION, rate=10.0, faults=("one far",))
    navigated = Navigated.of(replace(log, start=1e5))
    (fault,) = navigated.fault_notices
    assert (fault.code, fault.where) == ("outliers", "position")
    assert fault.values["count"] == 1.0
    assert 1e5 < fault.values["time"] < 1e5 + DURATION
    size, at = navigated.farthest
    assert size > 20.0
    assert at == pytest.approx(fault.values["time"])


def test_outliers_are_counted():
    log, _ = emulated_log(206, duration=DURATION, rate=10.0, faults=("outliers",))
    right, _ = emulated_log(206, duration=DURATION, rate=10.0)
    moved = np.any(log.aiding.fixes[0].value != right.aiding.fixes[0].value, axis=1)
    navigated = Navigated.of(log)
    (fault,) = navigated.fault_notices
    start = navigated.alignment.epoch * log.imu.dt + 1.6
    inside = moved & (log.aiding.fixes[0].time > start)
    inside &= log.aiding.fixes[0].time < DURATION - 1.6
    assert fault.code == "outliers"
    assert fault.values["count"] == np.count_nonzero(inside) > 0


def test_an_imu_mounted_rotated():
    navigated = found(207, "mounting")
    first, second = navigated.fault_notices
    assert (first.code, second.code) == ("heading", "lever-arm")
    assert abs(abs(np.degrees(first.values["heading"])) - 90.0) < 10.0
    # The antenna is where it was, seen from axes that are turned.
    arm = np.asarray(navigated.faults.replay.aiding.lever_arm)
    turned = np.array([LEVER_ARM[1], -LEVER_ARM[0]])
    assert np.linalg.norm(arm[:2] - turned) < 0.6


@pytest.mark.parametrize(
    ("kind", "signs", "shown"),
    [("gyro", (-1, -1, -1), (0, 0, -1)), slow("accel", (-1, -1, -1), (-1, -1, -1)),
     slow("accel", (1, -1, -1), (1, -1, -1))],
)  # fmt: skip
def test_axes_that_point_the_other_way_are_no_noise(kind, signs, shown):
    """A car on level roads shows the sign of its yaw rate alone."""
    log, _ = emulated_log(212, duration=DURATION, rate=10.0)
    of = {"gyro": log.imu.rotation, "accel": log.imu.velocity}
    of[kind] = of[kind] * signs
    turned = replace(log, imu=type(log.imu)(log.imu.dt, of["gyro"], of["accel"]))
    navigated = Navigated.of(turned)
    (fault,) = navigated.fault_notices
    assert (fault.code, fault.where) == ("axis-signs", kind)
    assert tuple(fault.values[axis] for axis in "xyz") == shown
    assert navigated.faults.explained
    assert ("reverse gyro_z" if kind == "gyro" else "y, accel_z") in fault.hint
    assert "Check every gyro by hand" in fault.hint


@pytest.mark.parametrize(
    ("seed", "vehicle", "options"),
    [(501, "car", {}), (510, "helicopter", {}), (501, "loiter", {}),
     (2058, "helicopter", {"duration": 160.0}),
     slow(8223, "car", {"duration": 300.0, "rate": 20.0})],
)  # fmt: skip
def test_right_models_of_noisy_sensors_are_not_blamed(seed, vehicle, options):
    """No rest was found in their noise, stamps moved to other noise were 0.07 s late, and a scale
    that the motion does not show was wrong by 16 %.
    """
    navigated = found(seed, vehicle=vehicle, truth=sensors(gyro=30.0, accel=100.0), **options)
    assert navigated.verdict.code == "consistent"
    if vehicle != "loiter":
        assert navigated.alignment.stood >= 20.0


@pytest.mark.parametrize(
    ("kind", "factor", "vehicle", "seed"),
    [("gyro", 10.0, "car", 209), slow("gyro", 0.1, "car", 209), ("accel", 10.0, "car", 209),
     slow("accel", 0.1, "car", 209), slow("gyro", 10.0, "helicopter", 1001)],
)  # fmt: skip
def test_a_wrong_sensor_model_is_no_fault_of_the_log(kind, factor, vehicle, seed):
    """Sensors so poor, or so shaken, that their white noise shows between two fixes."""
    coarse = {"gyro": 30.0, "accel": 100.0}
    navigated = found(
        seed, vehicle=vehicle, truth=sensors(**coarse),
        believed=sensors(**{**coarse, kind: factor * coarse[kind]}),
    )  # fmt: skip
    assert not navigated.fault_notices
    assert not navigated.fits


@pytest.mark.parametrize(
    ("fault", "vehicle"),
    [("coloured", "car"), ("coloured", "loiter"), slow("clock step", "car")],
)
def test_faults_that_are_not_looked_for_are_not_named_as_others(fault, vehicle):
    """Coloured fixes were outliers; a clock set by a second was a clock rate and a time offset."""
    navigated = found(203, fault, vehicle=vehicle, duration=200.0)
    assert not navigated.fits
    assert not navigated.fault_notices
    assert navigated.verdict.code == "too-large"
    assert "cause not found" in navigated.verdict.text


@pytest.mark.parametrize(
    ("kind", "vehicle", "seed", "axis"),
    [("gyro", "car", 11, "z"), ("accel", "loiter", 11, "z"), slow("gyro", "loiter", 12, "x"),
     slow("accel", "car", 12, "x"), slow("accel", "helicopter", 12, "x")],
)  # fmt: skip
def test_scale_errors(kind, vehicle, seed, axis):
    """They were lever arms and headings on the loiter, and outliers of a car."""
    navigated = found(seed, f"{kind} scale", vehicle=vehicle, duration=200.0)
    (fault,) = navigated.fault_notices
    assert navigated.faults.explained
    assert (fault.code, fault.where) == ("scale-error", kind)
    assert within(fault, axis, 0.03) < 0.01
    assert f"{kind}_{axis}" in fault.hint
    unseen = [a for a in "xyz" if abs(fault.values[a]) < 5.0 * fault.values[f"{a} error"]]
    assert unseen and not any(f"{kind}_{a}" in fault.hint for a in unseen)


@pytest.mark.parametrize("vehicle", ["car", slow("helicopter")])
def test_late_stamps_and_a_lever_arm_left_out_are_estimated_together(vehicle):
    stamps, arm = found(1000, "stamps", "lever arm", vehicle=vehicle, duration=300.0,
                        rate=20.0).fault_notices  # fmt: skip
    assert (stamps.code, arm.code) == ("time-offset", "lever-arm")
    within(stamps, "time offset", 0.2)
    within(arm, "forward", LEVER_ARM[0])


def test_a_start_upside_down_is_a_doubtful_heading():
    """A helicopter that does not turn: a heading 172 deg off explained reversed accelerometers."""
    log, _ = emulated_log(12, "helicopter", duration=200.0, rate=10.0)
    navigated = Navigated.of(replace(log, imu=replace(log.imu, velocity=-log.imu.velocity)))
    (fault,) = navigated.fault_notices
    assert "axis-signs" in {fault.code, *fault.values["rivals"].split(", ")}


def test_a_lever_arm_that_explains_all_has_no_time_offset_beside_it():
    """Of good fixes in circles, an offset of 0.07 s and an antenna 2.6 m forward, not 1 m."""
    log, truth = emulated_log(32, "loiter", duration=400.0, rate=10.0)
    sd = {"position_sd": (0.01, 0.01, 0.015), "velocity_sd": (0.01, 0.01, 0.01)}
    aiding = gnss(truth, **sd, lever_arm=LEVER_ARM, imu=emulate(truth))
    aiding = replace(aiding.noisy(np.random.default_rng(32)), lever_arm=(0.0, 0.0, 0.0))
    (fault,) = Navigated.of(replace(log, aiding=aiding)).fault_notices
    assert within(fault, "forward", LEVER_ARM[0]) < 0.05


def test_a_fault_that_another_explains_as_well_is_named_with_it():
    """Of circles, stamps that were 0.2 s late were a clock 0.4 % slow, without a doubt."""
    navigated = found(12, "stamps", vehicle="loiter", duration=200.0)
    (fault,) = navigated.fault_notices
    named = {fault.code, *fault.values["rivals"].split(", ")}
    assert named >= {"time-offset", "clock-rate"}
    assert "another fault that explains the log nearly as well" in navigated.verdict.text


def test_straight_flight_at_constant_speed_shows_no_lever_arm():
    """It moves the track as a whole."""
    truth = perform([Straight(200.0)], start=(0.8, 0.1, 500.0), heading=0.4, speed=20.0, dt=0.05)
    rng = np.random.default_rng(3)
    models = sensors()
    errors = models.simulate(truth.n, truth.dt, rng).total
    imu = emulate(truth).with_errors(errors[:, :3], errors[:, 3:])
    position = gnss(truth, lever_arm=LEVER_ARM).noisy(rng).fixes[0]
    log = Measured(imu, gnss(truth).__class__((position,)), models, heading=0.4)
    faults = Faults.of(
        Replay(imu, truth.state(0), InitialSd(2.0, 0.1, 0.002, 0.01), models, log.aiding)
    )
    assert not faults.found
    assert faults.explained


def test_the_fix_that_a_filter_starts_from_may_be_an_outlier():
    log, _ = emulated_log(211, duration=DURATION, rate=10.0)
    start = Navigated.of(log).alignment.epoch * log.imu.dt
    position = log.aiding.fixes[0]
    by = np.zeros((position.time.size, 3))
    by[int(np.argmin(np.abs(position.time - start))), 0] = by[60, 1] = 50.0
    moved = replace(position, value=position.moved(by))
    navigated = Navigated.of(
        replace(log, aiding=replace(log.aiding, fixes=(moved, *log.aiding.fixes[1:])))
    )
    (fault,) = navigated.fault_notices
    assert (fault.code, fault.values["count"], fault.values["time"]) == ("outliers", 2.0, start)
    assert navigated.faults.explained
