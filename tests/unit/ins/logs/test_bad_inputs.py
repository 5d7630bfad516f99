"""Faults that files show before any filter: named as what they are, with hints that work."""

from dataclasses import replace

import numpy as np
import pytest

from emulated_logs import emulated_log
from gmwm.errors import InputError
from gmwm.ins import Measured, Navigated, read_fixes
from gmwm.ins.logs.fix_log import height_steps
from gmwm.study.demo import LEVER_ARM, sensors
from marks import every

RATE, DURATION = 10.0, 160.0
NED = ("north", "east", "down")
CLIPPED = {"accel_x": 3, "accel_y": 4, "gyro_z": 2}


@pytest.fixture(scope="module")
def log():
    return emulated_log(301, duration=DURATION, rate=RATE)[0]


def write(folder, log, fixes=None, change=lambda samples: samples):
    """Files of a log."""
    samples = change(np.hstack([log.imu.rotation, log.imu.velocity]) / log.imu.dt)
    time = (1.0 + np.arange(len(samples))) / RATE
    axes = [f"{kind}_{axis}" for kind in ("gyro", "accel") for axis in "xyz"]
    head = ["time_s", *axes]
    table(folder / "imu.csv", np.column_stack([time, np.round(samples, 7)]), head)
    position, *others = log.aiding.fixes if fixes is None else fixes
    columns = [position.time, *np.degrees(position.value[:, :2]).T, position.value[:, 2]]
    head = ["time_s", "latitude_deg", "longitude_deg", "height_m"]
    columns += list(position.sd.T)
    head += [f"sd_{axis}" for axis in NED]
    for each in others:
        columns += [*each.value.T, *each.sd.T]
        head += [f"{what}_{axis}" for what in ("velocity", "sd_velocity") for axis in NED]
    table(folder / "fixes.csv", np.column_stack(columns), head)


def table(path, values, head):
    np.savetxt(path, values, "%.12g", ",", header=",".join(head), comments="")


def navigated(folder):
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    content = {"imu": {"file": "imu.csv", "units": units}, "gnss_fixes": "fixes.csv"}
    own = {"gyro": {"N": 1e-6}, "accel": {"N": 1e-6}}
    content |= {"sensors": own, "bias": {"gyro": "0.1 deg/s", "accel": "0.1 m/s^2"}}
    measured = Measured.of(content | {"lever_arm": list(LEVER_ARM)}, folder)
    right = replace(sensors(), bias_sd=measured.sensors.bias_sd)
    return Navigated.of(replace(measured, sensors=right))


@pytest.mark.parametrize("axis", every(2, CLIPPED))
def test_a_sensor_at_the_end_of_its_range_is_named_and_nothing_else(log, tmp_path, axis):
    """Clipped turns were taken for missing samples, a rotated mounting or a stuck sensor."""

    def clipped(samples):
        column = samples[:, CLIPPED[axis]]
        middle = np.median(column)
        reach = np.quantile(np.abs(column - middle), 0.8)
        column[:] = np.clip(column, middle - reach, middle + reach)
        return samples

    write(tmp_path, log, change=clipped)
    found = navigated(tmp_path)
    assert (found.verdict.code, found.verdict.where) == ("saturation", axis)
    assert found.verdict.severity == "bad"
    assert found.verdict.values["share"] == pytest.approx(0.2, abs=0.02)
    assert not found.fault_notices


def test_a_cut_off_sensor_is_the_verdict_where_the_innovations_agree(log, tmp_path):
    """A car on level roads hardly needs its roll rate: the verdict was "consistent"."""

    def clipped(samples):
        reach = np.quantile(np.abs(samples[:, 0]), 0.95)
        samples[:, 0] = np.clip(samples[:, 0], -reach, reach)
        return samples

    write(tmp_path, log, change=clipped)
    found = navigated(tmp_path)
    assert found.fits
    assert (found.verdict.code, found.verdict.severity) == ("saturation", "bad")
    assert "The innovations agree, but the data are wrong" in found.verdict.text


@pytest.mark.parametrize("velocity", [True, False])
def test_a_step_of_the_height_is_dated_and_its_hint_mends_it(log, tmp_path, velocity):
    """The heights were outliers, a lever arm, or sensors worse than their models."""
    position, *others = log.aiding.fixes
    later = position.time > 0.5 * DURATION
    stepped = position.value + np.outer(later, [0.0, 0.0, 45.0])
    fixes = (replace(position, value=stepped), *others)[: 1 + velocity]
    write(tmp_path, log, fixes)
    verdict = navigated(tmp_path).verdict
    assert verdict.code == "heights-step"
    assert verdict.values["time"] == pytest.approx(position.time[later][0])
    assert verdict.values["up"] == pytest.approx(45.0, abs=4.0 * np.hypot(1.5, 1.5))
    stepped[position.time >= verdict.values["time"] - 1e-6, 2] -= verdict.values["up"]
    write(tmp_path, log, (replace(position, value=stepped), *others)[: 1 + velocity])
    assert navigated(tmp_path).verdict.code == "consistent"


@pytest.mark.parametrize("vehicle", ["car", "helicopter", "loiter"])
def test_climbs_and_outliers_are_no_step_of_the_height(vehicle):
    for seed in range(5):
        log, _ = emulated_log(seed, vehicle, duration=300.0, rate=2.0)
        position = log.aiding.fixes[0]
        far = position.value.copy()
        far[40, 2] += 60.0
        for value in (position.value, far):
            fixes = (replace(position, value=value),)
            assert not height_steps(replace(log.aiding, fixes=fixes), 0.0)


@pytest.mark.parametrize("times", [2, 5])
def test_fixes_that_are_written_again_are_left_out(log, tmp_path, times):
    """They were fixes with late stamps."""
    fixes = []
    for each in log.aiding.fixes:
        time = (each.time[:-1, None] + np.arange(times) / times).ravel()
        value, sd = (np.repeat(part[:-1], times, axis=0) for part in (each.value, each.sd))
        fixes.append(replace(each, time=time, value=value, sd=sd))
    write(tmp_path, log, fixes)
    found = navigated(tmp_path)
    (notice,) = (each for each in found.notices if each.code == "fixes-repeated")
    count = log.aiding.fixes[0].time.size - 1
    assert notice.values["count"] == (times - 1) * count
    assert found.measured.aiding.fixes[0].time.size == count
    assert found.verdict.code == "consistent"


def test_a_receiver_that_holds_its_position_at_rest_repeats_nothing(log, tmp_path):
    """A vehicle at rest needs its fixes for the alignment."""
    position, velocity = log.aiding.fixes
    still = np.linalg.norm(velocity.value, axis=1) < 0.5
    assert np.count_nonzero(still) > 5
    value = np.where(still[:, None], position.value[0], position.value)
    write(tmp_path, log, (replace(position, value=value), velocity))
    assert read_fixes(tmp_path / "fixes.csv").fixes[0].time.size == position.time.size


@pytest.mark.parametrize("gaps", [False, True])
def test_velocities_of_exchanged_columns_are_rejected_beside_gaps(log, tmp_path, gaps):
    """Two gaps of 10 s left too few ways, and signs of accelerometers were blamed."""
    fixes = []
    for each in log.aiding.fixes:
        kept = each.time < 120.0
        if gaps:
            kept &= (np.abs(each.time - 45.0) > 5.0) & (np.abs(each.time - 85.0) > 5.0)
        fixes.append(each.part(kept))
    fixes[1] = replace(fixes[1], value=fixes[1].value[:, [1, 0, 2]])
    write(tmp_path, log, fixes)
    with pytest.raises(InputError, match="north and east are exchanged"):
        read_fixes(tmp_path / "fixes.csv")


def test_velocities_in_axes_of_the_body_are_rejected_and_left_out_they_do_no_harm(log, tmp_path):
    position, velocity = log.aiding.fixes
    speed = np.hypot(velocity.value[:, 0], velocity.value[:, 1])
    noise = 0.1 * np.random.default_rng(4).standard_normal(speed.size)
    body = np.column_stack([speed, noise, velocity.value[:, 2]])
    write(tmp_path, log, (position, replace(velocity, value=body)))
    with pytest.raises(InputError, match=r"forward, right, down: turn .* or leave them out"):
        read_fixes(tmp_path / "fixes.csv")
    write(tmp_path, log, (position,))
    assert navigated(tmp_path).verdict.code == "consistent"


def test_accelerometers_of_the_other_sign_are_reversed_alone(log, tmp_path):
    """A second notice advised to reverse gyro_z too."""
    write(tmp_path, log, change=lambda samples: samples * np.repeat([1.0, -1.0], 3))
    found = navigated(tmp_path)
    assert (found.verdict.code, found.verdict.where) == ("axis-signs", "accel")
    assert [found.verdict.values[axis] for axis in "xyz"] == [-1.0, -1.0, -1.0]
    assert "axis-up" not in {each.code for each in found.notices}
