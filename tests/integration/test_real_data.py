"""Four recordings of a real IMU: what is in them is found, and their models describe them.

The numbers are those of docs/real-data.md. The frequencies of the line were read off long
periodograms, independently of this package.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.ndimage import median_filter
from scipy.signal import welch

import gmwm
from gmwm import Resonance, Sinusoid
from gmwm._core.units import factor
from gmwm.diagnosis.motion import find_motion
from gmwm.readers import turning_gravity
from marks import slow
from places import SHARED

ADIS = SHARED / "data/adis16405"
COLUMNS = {"gyro_x": 0, "gyro_y": 1, "gyro_z": 2, "accel_x": 3, "accel_y": 4, "accel_z": 5}
LINES = {1: 0.565, 2: 0.568, 3: 0.540, 4: 0.534}
MG = factor("mg", "m/s^2")

pytestmark = pytest.mark.skipif(not ADIS.exists(), reason="ADIS16405 recordings are not here")


@lru_cache(maxsize=2)  # a million rows of text
def whole(number):
    path = ADIS / f"adis16405_{number}.csv.gz"
    return gmwm.read(path, rate=100, units={"gyro": "deg/s", "accel": "g"}, channels=COLUMNS)


def recording(number, *names):
    """The named channels of one recording, or all of them."""
    found = whole(number)
    return replace(found, channels=tuple(found[name] for name in names)) if names else found


def peaks(channel, low, high):
    """Largest frequency of the spectrum within a band, in each eighth of the record."""
    found = []
    for part in np.array_split(np.asarray(channel.values, dtype=float), 8):
        frequency, density = welch(part, 100.0, nperseg=4096)
        inside = (frequency > low) & (frequency < high)
        found.append(frequency[inside][np.argmax(density[inside])])
    return np.array(found)


# -- what gmwm health finds -----------------------------------------------------------------------


@pytest.mark.parametrize("number", [1, slow(2), slow(3)])
def test_line_steps_and_peak(number):
    found = gmwm.health(recording(number, "gyro_z", "accel_y"))
    assert found.lines("accel_y")[0][0] == pytest.approx(LINES[number], abs=0.005)
    (rounding,) = found.of("accel_y", "rounding")
    assert rounding.values["lsb"] == pytest.approx(3.33 * MG, rel=2e-3)
    assert 0.9 < rounding.values["lsb"] / rounding.values["noise"] < 1.3
    assert found.lines("gyro_z") == ()
    assert found.resonances("gyro_z")[0][0] == pytest.approx(20.0, abs=0.6)


@pytest.mark.slow
@pytest.mark.parametrize("number", LINES)
def test_every_channel(number):
    found = gmwm.health(recording(number))
    for name in COLUMNS:
        if name.startswith("accel"):
            assert found.lines(name)[0][0] == pytest.approx(LINES[number], abs=0.005)
            assert found.lsb(name) == pytest.approx(3.33 * MG, rel=2e-3)
        else:
            assert found.lines(name) == ()
            assert found.lsb(name) == pytest.approx(np.radians(0.05), rel=1e-3)
    assert found.resonances("gyro_z")[0][0] == pytest.approx(20.0, abs=0.6)
    large = [e for e in found.of(code="event") if abs(e.values["height"]) > np.radians(10.0)]
    shaken = {e.where for e in large if e.where.startswith("gyro")}
    assert shaken == ({"gyro_x"} if number == 4 else set())


@pytest.mark.parametrize("number", [1, slow(2), slow(3), slow(4)])
def test_recordings_are_at_rest(number):
    rec = recording(number)
    codes = {"gravity", "swapped", "gyro-unit"}
    assert codes.isdisjoint(notice.code for notice in rec.notices)
    assert find_motion(rec).moves == ()
    # Running medians of five means of a second, five seconds apart.
    limits = {"gyro": np.radians(0.16), "accel": np.radians(0.3) * 9.80665}
    for name, channel in rec.items():
        means = np.asarray(channel.values, dtype=float).reshape(-1, 100).mean(axis=1)
        level = median_filter(means, 5)
        assert np.max(np.abs(level[5:] - level[:-5])) < limits[name.split("_")[0]], name
    turning = turning_gravity(rec, 100)
    assert turning.explained < 1e-4


def test_deg_per_second_for_radians_is_reported():
    path = ADIS / "adis16405_1.csv.gz"
    rec = gmwm.read(path, rate=100, units={"gyro": "rad/s", "accel": "g"}, channels=COLUMNS)
    (notice,) = rec.notices
    assert (notice.code, notice.values["likely"]) == ("gyro-unit", "deg/s")


@pytest.mark.slow
def test_shock_is_left_out_and_no_more():
    raw = recording(4, "gyro_x")
    found = gmwm.health(raw)
    shock = max(found.of("gyro_x", "event"), key=lambda event: abs(event.values["height"]))
    assert abs(shock.values["height"]) == pytest.approx(np.radians(17.0), rel=0.05)
    clean = found.masked(raw)["gyro_x"]
    assert 30 < clean.missing < 500
    # 17 deg/s is 48 times the noise; what is left has no sample beyond seven times.
    left = np.abs(clean.values - np.nanmean(clean.values)) / np.nanstd(clean.values)
    assert np.nanmax(left) < 7.0


def test_peaks_of_gyro_and_accelerometer_wander_together():
    both = recording(2, "gyro_z", "accel_x")
    gyro, accelerometer = peaks(both["gyro_z"], 17.0, 23.0), peaks(both["accel_x"], 8.5, 11.5)
    assert np.ptp(gyro) > 1.5
    assert gyro == pytest.approx(2.0 * accelerometer, abs=0.5)


# -- what the models make of them -----------------------------------------------------------------


@pytest.mark.slow
def test_model_of_a_gyro_axis():
    """Its step at 2,500 s is real, and too little evidence for a single axis to be not valid."""
    fit = gmwm.calibrate(recording(1, "gyro_x"))["gyro_x"]
    misfit, _ = fit.goodness.worst
    assert fit.valid
    assert abs(misfit) < 0.1
    (step,) = [each for each in fit.notices if each.code == "step"]
    assert step.severity == "warning" and 100.0 < step.values["evidence"] < 1000.0
    assert step.values["time"] == pytest.approx(2500.0, abs=60.0)


def test_the_step_of_that_axis_is_on_all_axes():
    """Means of 200 s before and after fall on all six: as much is rare at other times."""
    for name, channel in recording(1).items():
        means = np.asarray(channel.values, dtype=float).reshape(-1, 1000).mean(axis=1)
        level = np.convolve(means, np.full(20, 1.0 / 20.0), "valid")
        change = level[20:] - level[:-20]
        time = 200.0 + 10.0 * np.arange(change.size)
        here = np.min(change[np.abs(time - 2504.0) <= 40.0])
        assert here < 0.0, name
        assert np.mean(np.abs(change) >= -here) < 0.04, name


@pytest.mark.slow
def test_chosen_terms_hold_line_and_peak():
    fits = gmwm.calibrate(recording(3, "gyro_z", "accel_z"))
    (line,) = [term for term in fits["accel_z"].model.terms if isinstance(term, Sinusoid)]
    assert line.values["frequency"] == pytest.approx(LINES[3], abs=0.005)
    assert line.values["amplitude"] == pytest.approx(0.65 * MG, rel=0.15)
    (peak,) = [term for term in fits["gyro_z"].model.terms if isinstance(term, Resonance)]
    assert peak.values["frequency"] == pytest.approx(20.0, abs=0.6)
    assert abs(fits["gyro_z"].goodness.worst[0]) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_misfits_are_small_or_chance(number):
    """Within 10 % at levels of more than 30 degrees of freedom, or within 2.5 standard errors."""
    for fit in gmwm.calibrate(recording(number, "gyro_z", "accel_z")).fits.values():
        good = fit.goodness
        known = good.dof > 30.0
        assert np.all((np.abs(good.misfit[known]) < 0.1) | (np.abs(good.residual[known]) < 2.5))
