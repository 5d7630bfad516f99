"""Logs as IMUs and receivers write them: jitter, holes, dates, signs; starts in motion; aids."""

from copy import copy
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial

import numpy as np
import pytest

import gmwm
from gmwm.errors import InputError
from gmwm.ins import Measured, Navigated, Outage, Straight, Turn, car_drive, emulate, gnss, perform
from gmwm.ins.fields import sensor_models
from gmwm.ins.geometry import ned_difference

RATE = 25.0
DATE = datetime(2024, 2, 29, 23, 59, 0, tzinfo=UTC)
START = DATE.timestamp()
SENSORS = {
    "gyro": {"N": "10 deg/h/sqrt(Hz)", "GM": [["10 deg/h", 100]]},
    "accel": {"N": "100 ug/sqrt(Hz)", "GM": [["100 ug", 100]]},
}
BIAS = {"gyro": "0.02 deg/s", "accel": "5 mg"}
NAMES = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")


class Log:
    """Samples and fixes of a known drive, and the files that they are written to."""

    def __init__(self, truth, seed=0, velocity=True, outages=()):
        rng = np.random.default_rng(seed)
        self.truth, ideal = truth, emulate(truth)
        errors = sensor_models(SENSORS, "test").simulate(ideal.n, ideal.dt, rng).total
        errors += np.repeat([3e-4, 0.04], 3) * rng.standard_normal(6)
        imu = ideal.with_errors(errors[:, :3], errors[:, 3:])
        self.samples = np.hstack([imu.rotation, imu.velocity]) / imu.dt
        self.stamps = START + imu.dt * (1.0 + np.arange(imu.n))
        aiding = gnss(truth, velocity_sd=0.1 if velocity else None)
        self.aiding = aiding.noisy(rng).without(outages)

    def imu(self, folder, stamps=None, keep=None, names=NAMES, stamped=True):
        keep = slice(None) if keep is None else keep
        stamps = self.stamps if stamps is None else stamps
        columns = [stamps[keep]] if stamped else []
        header = ",".join((["time_s"] if stamped else []) + list(names))
        np.savetxt(folder / "imu.csv", np.column_stack([*columns, self.samples[keep]]), "%.12g",
                   ",", header=header, comments="")  # fmt: skip

    def fixes(self, folder, time=lambda t: f"{t:.6f}", name="time_s"):
        position = self.aiding.fixes[0]
        header = [name, "latitude_deg", "longitude_deg", "height_m"]
        rows = [np.degrees(position.value[:, :2]), position.value[:, 2:]]
        if len(self.aiding.fixes) > 1:
            header += ["velocity_north_mps", "velocity_east_mps", "velocity_down_mps"]
            rows.append(self.aiding.fixes[1].value)
        lines = [
            ",".join([time(START + t), *(f"{each:.12g}" for each in row)])
            for t, row in zip(position.time, np.hstack(rows), strict=True)
        ]
        (folder / "fixes.csv").write_text("\n".join([",".join(header), *lines]) + "\n")


@pytest.fixture(scope="module")
def log():
    return Log(car_drive(duration=110.0, dt=1.0 / RATE))


@pytest.fixture(scope="module")
def as_it_is(log, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    log.imu(folder)
    log.fixes(folder)
    return navigated(folder)


def navigated(folder, **changes):
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    imu = {"file": "imu.csv", "units": units} | changes.pop("imu", {})
    content = {"imu": imu, "gnss_fixes": "fixes.csv", "sensors": SENSORS, "bias": BIAS} | changes
    return Navigated.of(Measured.of(content, folder))


def standardised(found, truth):
    part = truth.segment(found.alignment.epoch * truth.dt, truth.duration)
    return found.solution.errors(part) / found.solution.sd


def apart(found, other):
    """Of two solutions on their common clock, m."""

    def by_time(each):
        after = ~each.solution.before
        times = np.round(each.clock(each.solution.time[after]), 3)
        return dict(zip(times, each.solution.lla[after], strict=True))

    here, there = by_time(found), by_time(other)
    common = [(here[t], there[t]) for t in here if t in there]
    ours, theirs = (np.array(each) for each in zip(*common, strict=True))
    assert len(ours) > 80
    return np.abs(ned_difference(ours, theirs))


def codes(found):
    return {notice.code for notice in found.measured.notices}


def test_stamps_that_jitter_by_a_millisecond_change_centimetres(log, as_it_is, tmp_path):
    rng = np.random.default_rng(1)
    log.imu(tmp_path, stamps=log.stamps + 1e-3 * rng.standard_normal(log.stamps.size))
    log.fixes(tmp_path)
    found = navigated(tmp_path)
    assert found.measured.start == pytest.approx(START, abs=2e-4)
    ours, theirs = (each.solution.lla[-20:] for each in (found, as_it_is))
    assert np.abs(ned_difference(ours, theirs)).max() < 0.05


def test_a_record_without_stamps_starts_when_its_start_says(log, as_it_is, tmp_path):
    log.imu(tmp_path, stamped=False)
    log.fixes(tmp_path)
    found = navigated(tmp_path, imu={"rate": RATE, "start": log.stamps[0]})
    assert "no-time-stamps" not in codes(found)
    np.testing.assert_allclose(apart(found, as_it_is), 0.0, atol=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"imu": {"start": START}}, "has time stamps: leave out its start"),
        ({"attitude": [0, 0, 0], "heading": 1.0}, "leave the heading out"),
    ],
)
def test_what_contradicts_the_rest_is_refused(log, tmp_path, changes, message):
    log.imu(tmp_path)
    log.fixes(tmp_path)
    with pytest.raises(InputError, match=message):
        navigated(tmp_path, **changes)


def iso(t):
    return datetime.fromtimestamp(t, UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def zoned(t):
    return datetime.fromtimestamp(t + 5400.0, UTC).strftime("%Y-%m-%d %H:%M:%S.%f") + "+01:30"


@pytest.mark.parametrize(("write", "both"), [(iso, False), (zoned, False), (iso, True)])
def test_dates_are_seconds(log, as_it_is, tmp_path, write, both):
    (partial(dated, log) if both else log.imu)(tmp_path)
    log.fixes(tmp_path, write, "time")
    found = navigated(tmp_path)
    assert "dates" in codes(found)
    assert "time-scales" not in codes(found)
    np.testing.assert_allclose(apart(found, as_it_is), 0.0, atol=1e-3)


def dated(log, folder):
    """The IMU's stamps as dates."""
    log.imu(folder)
    head, *rows = (folder / "imu.csv").read_text().splitlines()
    rows = [
        f"{iso(float(stamp))},{rest}" for stamp, _, rest in (row.partition(",") for row in rows)
    ]
    (folder / "imu.csv").write_text("\n".join([head.replace("time_s", "UTC"), *rows]) + "\n")


@pytest.mark.parametrize("weeks", [False, True])
def test_a_solution_of_rtklib(log, as_it_is, tmp_path, weeks):
    (log.imu if weeks else partial(dated, log))(tmp_path)
    position = log.aiding.fixes[0]
    lines = [
        "% program   : RTKLIB",
        "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp)",
        "%  GPST             latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   "
        "sdu(m)  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio",
    ]
    for t, value in zip(START + position.time, position.value, strict=True):
        if weeks:
            week, rest = divmod(t - 315964800.0, 604800.0)
            stamp = f"{int(week)} {rest:10.3f}"
        else:
            stamp = datetime.fromtimestamp(t, UTC).strftime("%Y/%m/%d %H:%M:%S.%f")[:-3]
        lat, lon = np.degrees(value[:2])
        lines.append(f"{stamp}   {lat:.9f}   {lon:.9f} {value[2]:.4f}   1  12   1.0000   1.0000   "
                     "1.5000   0.0000   0.0000   0.0000   0.00    3.5")  # fmt: skip
    (tmp_path / "rover.pos").write_text("\n".join(lines) + "\n")
    found = navigated(tmp_path, gnss_fixes="rover.pos")
    assert "sd-assumed" not in codes(found)
    np.testing.assert_allclose(found.measured.aiding.fixes[0].time, position.time, atol=2e-3)
    np.testing.assert_allclose(found.measured.aiding.fixes[0].sd[0], [1.0, 1.0, 1.5])
    assert apart(found, as_it_is).max() < 5.0  # there are no velocities here
    assert ("time-scales" in codes(found)) is not weeks  # GPS time beside dates of the IMU


def test_a_shift_of_the_fixes_is_added_to_their_times(log, as_it_is, tmp_path):
    log.imu(tmp_path)
    log.fixes(tmp_path, lambda t: f"{t - 18.0:.6f}")
    found = navigated(tmp_path, gnss_shift=18)
    np.testing.assert_allclose(apart(found, as_it_is), 0.0, atol=1e-3)


# ---- Starts in motion ----


@pytest.fixture(scope="module")
def underway():
    """A car that turns and brakes from the first sample on."""
    whole = car_drive(duration=200.0, dt=1.0 / RATE)
    return whole.segment(60.0, 200.0)


def test_an_attitude_that_is_given_starts_a_record_in_motion(underway, tmp_path):
    log = Log(underway, 2)
    log.imu(tmp_path)
    log.fixes(tmp_path)
    rng = np.random.default_rng(3)
    at_fix = underway.rpy[int(RATE)] + np.radians(1.0) * rng.standard_normal(3)
    found = navigated(tmp_path, attitude=[f"{each} deg" for each in np.degrees(at_fix)])
    assert found.alignment.notices[0].code == "attitude-given"
    np.testing.assert_allclose(found.alignment.state.rpy, at_fix, atol=1e-9)
    assert np.mean(standardised(found, underway)[5:] ** 2) < 2.5


@pytest.mark.parametrize("velocity", [True, False])
def test_acceleration_is_not_taken_for_a_slope(tmp_path, velocity):
    """4 m/s^2 from rest: the pitch was 19 deg."""
    speeding = [gmwm.ins.Accelerate(4.0 * 5.0, 4.0), Straight(30.0), Turn(1.0, 0.2), Straight(20.0)]
    truth = perform(speeding, start=(0.8, 0.1, 400.0), ramp=1.0, dt=1.0 / RATE, flat=True)
    log = Log(truth, velocity=velocity)
    log.imu(tmp_path)
    log.fixes(tmp_path)
    found = navigated(tmp_path)
    assert np.all(np.abs(found.alignment.state.rpy[:2]) < np.radians(1.0))
    assert np.all(np.abs(standardised(found, truth)[:, 6:]) < 4.0)


def test_rejected_fixes_are_reported(log, tmp_path):
    position = log.aiding.fixes[0]
    by = np.zeros_like(position.value)
    by[50, 0] = 300.0
    far = Log.__new__(Log)
    moved = (replace(position, value=position.moved(by)), *log.aiding.fixes[1:])
    far.__dict__ = log.__dict__ | {"aiding": replace(log.aiding, fixes=moved)}
    far.imu(tmp_path)
    far.fixes(tmp_path)
    found = navigated(tmp_path, gate=1e-5)
    (notice,) = found.rejections
    assert (notice.code, notice.where, notice.values["count"]) == ("fixes-rejected", "position", 1)
    assert notice.values["time"] == pytest.approx(START + position.time[50])
    assert "position: 1 of " in str(found)
    assert np.abs(standardised(found, log.truth)[:, :3]).max() < 5.0
    assert not navigated(tmp_path).rejections


@pytest.fixture(scope="module")
def stopping():
    """A car that stands for 20 s at the start, and in an outage again."""
    log = Log(car_drive(duration=160.0, dt=1.0 / RATE), 5, outages=[Outage(100.0, 55.0)])
    # Engine and road shake a car that moves.
    speed = np.linalg.norm(log.truth.velocity[1:], axis=1)
    shake = np.repeat([2e-3, 0.03], 3) * (speed > 0.05)[:, None]
    log.samples = log.samples + shake * np.random.default_rng(9).standard_normal((speed.size, 6))
    return log


def test_standstills_are_recognised_and_hold_the_velocity(stopping, tmp_path):
    stopping.imu(tmp_path)
    stopping.fixes(tmp_path)
    shaken = {"gyro": {"N": "100 deg/h/sqrt(Hz)"}, "accel": {"N": "800 ug/sqrt(Hz)"}}
    found = navigated(tmp_path, zero_velocity="0.02 m/s", sensors=shaken)
    fixes = found.measured.aiding.fixes[-1]
    assert fixes.kind == "standstill" and fixes.time.size >= 10
    truth = stopping.truth
    speed = np.linalg.norm(truth.velocity[np.rint(fixes.time * RATE).astype(int)], axis=1)
    assert speed.max() < 0.05
    assert "standstill" not in found.kinds
    assert not found.rejections


def test_a_barometer_of_another_datum_holds_the_height(log, tmp_path):
    gone = replace(log.aiding.without([Outage(60.0, 45.0)]))
    without = Log.__new__(Log)
    without.__dict__ = log.__dict__ | {"aiding": gone}
    without.imu(tmp_path)
    without.fixes(tmp_path)
    rng = np.random.default_rng(4)
    index = np.arange(0, log.truth.n, int(RATE))
    height = log.truth.lla[index, 2] - 48.0 + 0.3 * rng.standard_normal(index.size)
    np.savetxt(tmp_path / "baro.csv", np.column_stack([START + index / RATE, height]), "%.12g", ",",
               header="time_s,height_m", comments="")  # fmt: skip
    found = navigated(tmp_path, barometer={"file": "baro.csv", "drift_sd": "3 m"})
    (set_to,) = (each for each in found.measured.notices if each.code == "barometer-set")
    assert set_to.values["shift"] == pytest.approx(48.0, abs=5.0)
    assert found.kinds == ("position", "velocity", "height")
    alone = navigated(tmp_path)
    assert found.longest_outage.sd[2] < 0.6 * alone.longest_outage.sd[2]
    assert np.abs(standardised(found, log.truth)[:, 2]).max() < 5.0


def test_coloured_noise_of_the_fixes_is_a_state(log, tmp_path):
    log.imu(tmp_path)
    log.fixes(tmp_path)
    found = navigated(tmp_path, coloured_sd=[0.5, 0.5, 1.0], coloured_tau="60 s")
    assert found.solution.state_names[-3:] == ("GNSS north", "GNSS east", "GNSS down")


def test_curves_of_the_sensors_are_subtracted_from_a_log(log, tmp_path):
    """The increments are those of a log without them, and N is that at its temperature."""
    rng, n = np.random.default_rng(8), 4096
    warm = 45.0 - 20.0 * np.cos(4.0 * np.pi * np.arange(n) / n)
    arrays = {name: 1e-3 * np.exp(0.01 * (warm - 45.0)) * rng.standard_normal(n) for name in NAMES}
    arrays = {name: x + 1e-3 * (warm - 45.0) for name, x in arrays.items()}
    units = {"gyro": "rad/s", "accel": "m/s^2", "temperature": "degC"}
    rec = gmwm.Recording.from_arrays(arrays | {"temperature": warm}, 10.0, units)
    cal = gmwm.calibrate(rec, "N", covariates={"temperature": "linear"}, screening=(), jobs=1)
    cal.save(tmp_path / "cal.json")
    replace(cal, curves={}).save(tmp_path / "plain.json")
    log.fixes(tmp_path)
    content = {"gnss_fixes": "fixes.csv", "sensors": "cal.json", "bias": BIAS}
    content["imu"] = {"file": "imu.csv", "units": {"gyro": "rad/s", "accel": "m/s^2"}}
    log.imu(tmp_path)
    plain = Measured.of(content | {"sensors": "plain.json"}, tmp_path)
    bare = Measured.of(content, tmp_path)
    assert "curve-not-subtracted" in {each.code for each in bare.notices}
    temperature = np.linspace(50.0, 60.0, len(log.samples))
    added = [cal.curves[a].along({"temperature": temperature}, 1.0 / RATE) for a in NAMES]
    warmer = copy(log)
    warmer.samples = np.column_stack([log.samples + np.transpose(added), temperature])
    warmer.imu(tmp_path, names=(*NAMES, "temperature [degC]"))
    found = Measured.of(content, tmp_path)
    np.testing.assert_array_equal(bare.imu.rotation, plain.imu.rotation)
    for kind in ("rotation", "velocity"):
        left = getattr(found.imu, kind) - getattr(plain.imu, kind)
        assert np.max(np.abs(left)) < 0.01 / RATE * np.max(np.abs(added))
    for axis in NAMES:
        here, mean = (each.sensors.models[axis].params["N"] for each in (found, plain))
        assert here == pytest.approx(mean * float(cal.curves[axis].noise_factor(55.0)), rel=0.01)
