"""What sensors at rest read: gravity, a small rate, noise of a known order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import QUARTILE, FloatArray, known_of, median
from gmwm._core.units import SI_UNIT, factor
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.at_rest.rotation import block_means, turning_gravity
from gmwm.readers.names import AXES
from gmwm.readers.recording import Recording

_GRAVITY = factor("g", SI_UNIT["accel"])
_EARTH = 7.292115e-5  # rad/s, WGS 84
_DENSITY = factor("deg/s", SI_UNIT["gyro"])  # rad/s/sqrt(Hz) in deg/s/sqrt(Hz)
_ACCEL_UNITS = ("m/s^2", "g", "mg", "ug", "cm/s^2")
_GYRO_UNITS = ("deg/s", "rad/s", "deg/h", "mdeg/s", "mrad/s")
_LEAST_COUNT = {"gyro": _DENSITY, "accel": 1.0}  # 1 deg/s and 1 m/s^2: no last bit is as large


def rest_notices(
    recording: Recording,
    unit_of: Mapping[str, str],
    given: Mapping[str, str],
    are_columns_given: bool,
    *,
    has_layout: bool = False,
) -> tuple[Notice, ...]:
    """Compare the means and the noise of the sensors with those of sensors at rest.

    Only what contradicts what was assumed and agrees with something else counts: an accelerometer
    may have no gravity (of data without it), and a gyro may turn.

    unit_of: Unit of each channel in the file.
    given: Units that the user gave, by channel or sensor.
    are_columns_given: Whether the user said which column is which channel.
    has_layout: Whether the scales are those of a layout, in which gravity has to show.
    Raises InputError if the unit of the accelerometer, the columns or the layout are wrong, and
        the unit or the columns were not given.
    """
    rate, force = _Sensor.of(recording, unit_of, "gyro"), _Sensor.of(recording, unit_of, "accel")
    swapped = _swapped(recording, rate, force, are_columns_given)
    if swapped:
        return swapped
    found = [
        *_gravity(recording, force, given, has_layout),
        *(_gyro_unit(recording, rate) or _mean_rate(rate)),
    ]
    counts = _counts(recording, unit_of)
    explained = {notice.where for notice in counts}
    rest = [each for each in found if each.severity == "bad" or each.where not in explained]
    one = (*_axis_unit(recording, "gyro", rate), *_axis_unit(recording, "accel", force))
    return (*counts, *rest, *one)


class _Sensor:
    """The axes of a sensor in one unit: their mean and their noise.

    unit: In the file.
    names: Of the axes that are there.
    size: Length of the mean vector, SI.
    usual: Median length of the means of a second, SI, which no motion changes much.
    fast, scatter: Standard deviation of the fast noise of each axis, and the largest, SI.
    density: White noise of the noisiest axis, SI/sqrt(Hz): the least that samples and means of a
        second leave, so that neither a filter's band nor a drift counts.
    size_error: Standard deviation of the length from the fast noise, SI.
    """

    def __init__(self, unit: str, channels: Mapping[str, FloatArray], dt: float) -> None:
        self.unit, self.names = unit, tuple(channels)
        axes = list(channels.values())
        self.size = float(np.linalg.norm([np.nanmean(values) for values in axes]))
        second = max(round(1.0 / dt), 1)
        means = block_means(axes, second)
        lengths = known_of(np.linalg.norm(means, axis=1))
        self.usual = median(lengths) if lengths.size else self.size
        self.fast, slow = _steps(axes), _steps(means.T)
        self.scatter = float(np.max(self.fast))
        densities = np.minimum(self.fast * math.sqrt(dt), slow * math.sqrt(second * dt))
        self.density = float(np.max(densities))
        self.size_error = self.scatter * math.sqrt(len(axes) / axes[0].size)

    @classmethod
    def of(cls, recording: Recording, unit_of: Mapping[str, str], sensor: str) -> _Sensor | None:
        """None if all axes are missing or empty, of an accelerometer one, or have several units."""
        names = [name for axis in AXES if (name := f"{sensor}_{axis}") in recording]
        units = {unit_of[name] for name in names if name in unit_of}
        axes = {name: recording[name].values for name in names}
        axes = {name: values for name, values in axes.items() if not np.all(np.isnan(values))}
        if len(axes) < (1 if sensor == "gyro" else len(AXES)) or len(units) > 1:
            return None
        found = cls(units.pop(), axes, recording.dt)
        return found if found.size > 0.0 else None


def _steps(axes: Sequence[FloatArray] | FloatArray) -> FloatArray:
    """Robust standard deviation of white noise from differences, axis by axis; 0 if unknown."""
    found = np.zeros(len(axes))
    for axis, values in enumerate(axes):
        steps = np.diff(values)
        known = known_of(np.abs(steps, out=steps))
        if known.size:
            found[axis] = median(known, overwrite=True) / (QUARTILE * math.sqrt(2.0))
    return found


def _is_gravity(length: float, tolerance: float = tuning.GRAVITY_AGREES) -> bool:
    return abs(length / _GRAVITY - 1.0) < tolerance


def _gravity_units(length: float, tolerance: float = tuning.GRAVITY_AGREES) -> list[str]:
    """Units in which a number of the file is gravity, the nearest first."""
    sizes = {unit: length * factor(unit, SI_UNIT["accel"]) for unit in _ACCEL_UNITS}
    likely = [unit for unit, size in sizes.items() if _is_gravity(size, tolerance)]
    return sorted(likely, key=lambda unit: abs(sizes[unit] - _GRAVITY))


def _swapped(
    recording: Recording, rate: _Sensor | None, force: _Sensor | None, are_columns_given: bool
) -> tuple[Notice, ...]:
    """Gravity in the gyro's columns, and none in the accelerometer's."""
    if rate is None or force is None:
        return ()
    in_file = rate.size / factor(rate.unit, SI_UNIT["gyro"])
    units = _gravity_units(in_file, tuning.GRAVITY_SURE)
    other = force.size / factor(force.unit, SI_UNIT["accel"])
    if not units or _gravity_units(other) or rate.scatter > tuning.GRAVITY_NOISE * rate.size:
        return ()
    text = (
        f"the mean of the gyro's columns is {in_file:.4g} long, gravity in {units[0]}, and "
        f"that of the accelerometer's {other:.4g}, which is not: the two are swapped"
    )
    if not are_columns_given:
        raise InputError(
            f"{recording.source}: {text}",
            "channels-swapped",
            'give the columns, e.g. channels={"accel_x": 0, "gyro_x": 3}',
        )
    values = {"gyro": rate.size, "accel": force.size, "likely": units[0]}
    return (Notice("swapped", "bad", "", text, values, "check which column is which channel"),)


def _gravity(
    recording: Recording, force: _Sensor | None, given: Mapping[str, str], has_layout: bool
) -> tuple[Notice, ...]:
    """A mean that is no gravity in the unit used, but is in another one, or is not small either."""
    if force is None:
        return ()
    in_file = force.size / factor(force.unit, SI_UNIT["accel"])
    likely = _gravity_units(in_file)
    if _is_gravity(force.size):
        return ()
    is_given = any(key in given for key in ("accel", *(f"accel_{axis}" for axis in AXES)))
    if not likely:
        return _scale(recording, force, must_show=has_layout and not is_given)
    text = (
        f"the mean of the accelerometer is {in_file:.4g} {force.unit} long, which is gravity in "
        f"{likely[0]}"
    )
    if not is_given:
        raise InputError(
            f"{recording.source}: {text}",
            "accel-unit-missing",
            f'give the unit, units={{"accel": "{likely[0]}"}}',
            {"unit": likely[0]},
        )
    values = {"norm": force.size, "unit": force.unit, "likely": likely[0]}
    off = _GRAVITY / force.size
    hint = f"check the unit: everything of the accelerometer is off by {off:.4g}"
    return (Notice("gravity", "bad", "accel", text, values, hint),)


def _scale(recording: Recording, force: _Sensor, *, must_show: bool) -> tuple[Notice, ...]:
    """A length that is that of gravity in no unit, and not that of an accelerometer without it."""
    ratio, values = force.usual / _GRAVITY, {"norm": force.size}
    text = f"the accelerometer reads {force.usual:.4g} m/s^2, {ratio:.3g} times gravity"
    if must_show and not 0.5 < ratio < 2.0:
        raise InputError(
            f"{recording.source}: {text}: its numbers are not of this layout",
            "layout",
            'give the layout of this file, or units={"accel": "m/s^2"} if there is no gravity',
        )
    if _is_gravity(force.size * recording.rate, tuning.GRAVITY_SURE):
        text += ", gravity over one sampling interval: increments of velocity, not accelerations"
        hint = "divide them, and those of the gyro, by the sampling interval"
        return (Notice("gravity", "bad", "", text, values, hint),)
    is_none = (
        force.usual < tuning.NO_GRAVITY or force.scatter > tuning.NOISE_OF_GRAVITY * force.usual
    )
    if is_none or abs(ratio - 1.0) < tuning.SCALE_AGREES:
        return ()
    text += ", which is neither that nor none"
    hint = "check its scale and range, and that the numbers are no counts"
    return (Notice("gravity", "warning", "accel", text, values, hint),)


def _gyro_unit(recording: Recording, rate: _Sensor | None) -> tuple[Notice, ...]:
    """A unit that the noise, the mean, the earth's rate or turning gravity contradicts."""
    if rate is None:
        return ()
    ratios = {
        unit: factor(unit, SI_UNIT["gyro"]) / factor(rate.unit, SI_UNIT["gyro"])
        for unit in _GYRO_UNITS
    }
    others = {unit: ratio for unit, ratio in ratios.items() if abs(math.log(ratio)) > 0.1}
    found = _by_turning(recording, others) or _by_size(rate, others)
    if found is None and len(rate.names) == len(AXES):
        found = _by_earth(rate, others)
    if found is None:
        return ()
    text, likely = found
    values: dict[str, Any] = {"density": rate.density, "mean": rate.size, "unit": rate.unit}
    hint = "check the unit and the sampling rate"
    if likely:
        values["likely"] = likely[0]
        hint = f"{hint}: {' or '.join(likely)}, not {rate.unit}, would explain it"
    return (Notice("gyro-unit", "warning", "gyro", text, values, hint),)


def _mean_rate(rate: _Sensor | None) -> tuple[Notice, ...]:
    """A mean that few gyros have at rest."""
    if rate is None or rate.size - tuning.SURE_MEAN * rate.size_error < tuning.USUAL_BIAS:
        return ()
    text = (
        f"a mean rate of {rate.size / _DENSITY:.3g} deg/s is more than the bias of most gyros: "
        "it turned from the first sample to the last, or is a cheap gyro that was not calibrated"
    )
    hint = "make sure that it was at rest"
    return (Notice("mean-rate", "warning", "gyro", text, {"mean": rate.size}, hint),)


def _counts(recording: Recording, unit_of: Mapping[str, str]) -> tuple[Notice, ...]:
    """Whole numbers with noise of several, in a unit of which no sensor's last bit is one."""
    notices = []
    for sensor, largest in _LEAST_COUNT.items():
        units = {name: unit for name, unit in unit_of.items() if name.startswith(sensor)}
        sizes = {name: factor(unit, SI_UNIT[sensor]) for name, unit in units.items()}
        found = [
            name
            for name, size in sizes.items()
            if size >= largest and _is_counted(recording[name].values, size)
        ]
        if not found:
            continue
        noise = float(np.max(_steps([recording[name].values / sizes[name] for name in found])))
        text = (
            f"{', '.join(found)}: every sample is a whole number, with noise of {noise:.3g} of "
            f"them: counts of the converter, not {units[found[0]]}"
        )
        hint = "multiply them by what a count is worth by the data sheet"
        notices.append(Notice("counts", "bad", sensor, text, {"noise": noise}, hint))
    return tuple(notices)


def _is_counted(values: FloatArray, size: float) -> bool:
    """Whether samples are multiples of a size, and their noise is several of it."""
    for part in (values[: tuning.ROWS_OF_COUNTS], values):
        numbers = known_of(part) / size
        off = np.abs(numbers - np.rint(numbers))
        if not numbers.size or np.max(off) > 1e-6:
            return False
    return bool(_steps([values])[0] > tuning.NOISE_OF_COUNTS * size)


def _axis_unit(recording: Recording, sensor: str, found: _Sensor | None) -> tuple[Notice, ...]:
    """One axis that scatters more or less than the others by the ratio of two units."""
    if found is None or len(found.names) < 2 or not np.all(found.fast > 0.0):
        return ()
    used, logs = factor(found.unit, SI_UNIT[sensor]), np.log(found.fast)
    for unit in _GYRO_UNITS if sensor == "gyro" else _ACCEL_UNITS:
        ratio = math.log(used / factor(unit, SI_UNIT[sensor]))
        alike, near = tuning.AXES_ALIKE[abs(ratio) > tuning.FAR_UNITS]
        for i, name in enumerate(found.names):
            rest = np.delete(logs, i)
            far = float(logs[i] - np.mean(rest))
            is_near = abs(ratio) > tuning.NEAREST_UNITS and abs(far - ratio) < near
            if not is_near or np.ptp(rest) > alike or _moves(recording, found.names, i, ratio):
                continue
            times = math.exp(far)
            text = (
                f"its noise is {times:.3g} times that of the other axes, as if it were in {unit}, "
                f"not {found.unit}"
            )
            hint = f"if so, name its unit in the header: {name} [{unit}]"
            values = {"ratio": times, "likely": unit}
            return (Notice("axis-unit", "warning", name, text, values, hint),)
    return ()


def _moves(recording: Recording, names: Sequence[str], axis: int, ratio: float) -> bool:
    """Whether third differences, in which motion falls out, lack a ratio of an axis' noise."""
    noise = _steps([np.diff(recording[name].values, 2) for name in names])
    if not np.all(noise > 0.0):
        return True
    far = math.log(noise[axis]) - float(np.mean(np.log(np.delete(noise, axis))))
    return abs(far - ratio) > tuning.AXES_ALIKE[1][1]


def _by_turning(recording: Recording, others: Mapping[str, float]) -> tuple[str, list[str]] | None:
    found = turning_gravity(recording, max(round(1.0 / recording.dt), 1))
    if found is None or found.explained < tuning.TURNING_EXPLAINED:
        return None
    for unit, ratio in others.items():
        if abs(math.log(abs(found.factor) / ratio)) < tuning.TURNING_AGREES:
            text = f"gravity turns {found.factor:.3g} times as fast as the gyros read"
            return text, [unit]
    return None


def _by_size(rate: _Sensor, others: Mapping[str, float]) -> tuple[str, list[str]] | None:
    """Noise or a mean larger than that of any gyro, or a mean that belies the noise."""
    if not _is_plausible(rate.density, rate.size):
        likely = [
            unit
            for unit, ratio in others.items()
            if ratio < 1.0 and _is_plausible(rate.density * ratio, rate.size * ratio)
        ]
        if rate.density > tuning.NOISIEST_GYRO:
            text = f"white noise of {rate.density / _DENSITY:.3g} deg/s/sqrt(Hz)"
        else:
            text = f"a mean rate of {rate.size / _DENSITY:.3g} deg/s"
        # Units that differ by less than gyros do cannot be distinguished.
        near = [
            unit
            for unit in likely
            if abs(math.log(others[unit] / others[likely[0]])) < math.log(tuning.UNITS_APART)
        ]
        return f"{text} is more than gyros at rest have", near
    noise = f"white noise of {60.0 * rate.density / _DENSITY:.2g} deg/sqrt(h) is"
    if 0.0 < rate.density < tuning.QUIETEST_GYRO:
        return f"{noise} less than gyros have", _less_quiet(rate, others)
    if 0.0 < rate.density < tuning.QUIET_GYRO and rate.size > tuning.QUIET_BIAS:
        likely = [unit for unit, ratio in others.items() if 10.0 < ratio < 100.0]
        mean = f"a mean rate of {3600.0 * rate.size / _DENSITY:.3g} deg/h"
        return f"{noise} that of a fibre-optic gyro, and {mean} is not", likely
    return None


def _less_quiet(rate: _Sensor, others: Mapping[str, float]) -> list[str]:
    """Units in which the noise is that of gyros which need not read the earth's rate."""
    return [
        unit
        for unit, ratio in others.items()
        if rate.density * ratio > tuning.EARTH_SHOWS
        and _is_plausible(rate.density * ratio, rate.size * ratio)
    ]


def _is_plausible(density: float, mean: float) -> bool:
    return density < tuning.NOISIEST_GYRO and mean < tuning.LARGEST_BIAS


def _by_earth(rate: _Sensor, others: Mapping[str, float]) -> tuple[str, list[str]] | None:
    """The earth's rate in another unit, or none of a gyro that has to read it."""
    for unit, ratio in others.items():
        is_quiet = 0.0 < rate.density * ratio < tuning.EARTH_SEEN
        if is_quiet and abs(rate.size * ratio / _EARTH - 1.0) < tuning.EARTH_AGREES:
            return f"the mean rate is that of the earth in {unit}", [unit]
    part = rate.size / _EARTH
    is_removed = part < tuning.NO_EARTH
    if not 0.0 < rate.density < tuning.EARTH_SHOWS or is_removed:
        return None
    if abs(part - 1.0) < tuning.EARTH_IS_SHOWN:
        return None
    text = (
        f"white noise of {60.0 * rate.density / _DENSITY:.2g} deg/sqrt(h) is that of a navigation "
        f"gyro, which reads the earth's 15 deg/h; the mean rate is {part * 15.04:.3g} deg/h"
    )
    return text, _less_quiet(rate, others)
