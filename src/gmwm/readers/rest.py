"""Units, columns and scales that gravity, its turns, or the noise at rest contradict."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from gmwm._core.typing import QUARTILE, FloatArray, known_of, median
from gmwm._core.units import Unit, factor
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.readers import tuning
from gmwm.readers.columns import Given
from gmwm.readers.names import AXES
from gmwm.readers.recording import Recording

_ROWS = 1 << 16  # at a time


@dataclass(frozen=True)
class TurningGravity:
    """Changes of the specific force against those that the angular rate explains."""

    factor: float  # least-squares factor of the predicted changes: 1 for a sensor that is turned
    explained: float  # share of the squared changes that the prediction explains: zero for noise
    change: float  # root mean square of the predicted changes, m/s^2


def _triad(recording: Recording, sensor: str) -> list[FloatArray]:
    """Samples of three axes; none if one is missing."""
    names = [f"{sensor}_{axis}" for axis in AXES]
    return [recording[name].values for name in names] if set(names) <= set(recording) else []


def block_means(axes: Sequence[FloatArray], size: int, least: float = 0.25) -> FloatArray:
    """Means (n // size, axes) of blocks; NaN where no more than the least share is present."""

    def means(values: FloatArray) -> FloatArray:
        rows = values[: values.size // size * size].reshape(-1, size)
        known = ~np.isnan(rows)
        count = np.count_nonzero(known, axis=1)
        total = np.sum(rows, axis=1, where=known)
        return np.where(count > least * size, total / np.maximum(count, 1), np.nan)

    return np.stack([means(values) for values in axes], axis=1)


def turning_gravity(recording: Recording, size: int, parts: int = 1) -> TurningGravity | None:
    """Compare the specific force with the angular rate; None if an axis or any change is missing.

    In the frame of a sensor that turns, gravity changes by da/dt = -w x a, of which independent
    noises explain nothing. The mean of the rate, which is mostly bias, is left out.

    size: Samples of the blocks, between whose means changes are compared.
    parts: Parts of the record that are compared separately; the medians are returned.
    """
    rate, force = _triad(recording, "gyro"), _triad(recording, "accel")
    if not (rate and force) or recording.n < 4 * size:
        return None
    # The same means of the integral as of the force: both changes are filtered alike.
    predicted = np.diff(_integral_means(rate, force, size) * -recording.dt, axis=0)
    observed = np.diff(block_means(force, size), axis=0)
    found = []
    for x, y in zip(np.array_split(predicted, parts), np.array_split(observed, parts), strict=True):
        known = ~np.isnan(y)
        squares, product = np.sum(x[known] ** 2), np.sum(x[known] * y[known])
        total = np.sum(y[known] ** 2)
        if squares > 0.0 and total > 0.0:
            change = np.sqrt(squares / np.count_nonzero(known))
            found.append((product / squares, product**2 / (squares * total), change))
    if not found:
        return None
    factor, explained, change = np.median(found, axis=0)
    return TurningGravity(float(factor), float(explained), float(change))


def _integral_means(
    rate: Sequence[FloatArray], force: Sequence[FloatArray], size: int
) -> FloatArray:
    """Block means of the sum of w x a, some blocks at a time to save memory."""
    middle = [median(known_of(column)) for column in rate]
    rows = size * max(_ROWS // size, 1)
    total, means = np.zeros(3), []
    for start in range(0, rate[0].size // size * size, rows):
        part = slice(start, min(start + rows, rate[0].size // size * size))
        w = [column[part] - m for column, m in zip(rate, middle, strict=True)]
        a = [column[part] for column in force]
        change = np.array([w[i - 2] * a[i - 1] - w[i - 1] * a[i - 2] for i in range(3)])
        change[np.isnan(change)] = 0.0
        integral = np.cumsum(change, axis=1, out=change)
        integral += total[:, None]
        means.append(integral.reshape(3, -1, size).mean(axis=2).T)
        total = integral[:, -1]
    return np.concatenate(means)


_ACCEL_UNITS = {unit: factor(unit, "m/s^2") for unit in ("m/s^2", "g", "mg", "ug", "cm/s^2")}
_GYRO_UNITS = {
    unit: factor(unit, "rad/s") for unit in ("deg/s", "rad/s", "deg/h", "mdeg/s", "mrad/s")
}
_GRAVITY, _DEGREE = _ACCEL_UNITS["g"], _GYRO_UNITS["deg/s"]
_LEAST_COUNT = {"gyro": _DEGREE, "accel": 1.0}  # no sensor's last bit is larger


def rest_notices(
    recording: Recording, unit_of: Mapping[str, Unit], given: Given, *, has_layout: bool
) -> tuple[Notice, ...]:
    """Notices where means or noise contradict the units or the columns; InputError if not given.

    An accelerometer without gravity is fine (it may have been subtracted), and so is a gyro that
    turns.

    unit_of: Unit of each channel in the file.
    has_layout: Whether the scales are those of a binary layout, where gravity has to show.
    """
    rate, force = _Sensor.of(recording, unit_of, "gyro"), _Sensor.of(recording, unit_of, "accel")
    swapped = _swapped(recording.source, rate, force, isinstance(given.channels, Mapping))
    if swapped:
        return swapped
    counts = _counts(recording, unit_of)
    others = [*_gravity(recording, force, given.units, has_layout)]
    if rate is not None and not _is_plausible(rate.density, rate.size):
        others.append(_gyro_unit(rate))
    elif rate is not None and rate.size - tuning.SURE_MEAN * rate.size_error >= tuning.USUAL_BIAS:
        others.append(notice("mean-rate", "gyro", {"mean": rate.size}, size=rate.size / _DEGREE))
    others = [each for each in others if each.code == "gravity" or each.where not in counts]
    found = []
    for sensor, (names, noise) in counts.items():
        listed, unit = ", ".join(names), unit_of[names[0]].text
        found.append(notice("counts", sensor, {"noise": noise}, listed=listed, unit=unit))
    return (*found, *others)


class _Sensor:
    """Mean and noise of a sensor whose axes have one unit, in SI units.

    size, size_error: Length of the mean vector, and its standard deviation from the fast noise.
    usual: Median length of the means of a second; motion hardly changes it.
    scatter: Standard deviation of the fast noise of the noisiest axis.
    density: White noise of it, per sqrt(Hz): the smaller one of samples and of means of a second,
        so that neither a filter's band nor a drift counts.
    """

    def __init__(self, unit: Unit, axes: Sequence[FloatArray], dt: float) -> None:
        self.unit = unit
        self.size = float(np.linalg.norm([np.nanmean(values) for values in axes]))
        second = max(round(1.0 / dt), 1)
        means = block_means(axes, second)
        lengths = known_of(np.linalg.norm(means, axis=1))
        self.usual = median(lengths) if lengths.size else self.size
        fast, slow = _noise_of(axes), _noise_of(means.T)
        self.scatter = float(np.max(fast))
        densities = np.minimum(fast * math.sqrt(dt), slow * math.sqrt(second * dt))
        self.density = float(np.max(densities))
        self.size_error = self.scatter * math.sqrt(len(axes) / axes[0].size)

    @classmethod
    def of(cls, recording: Recording, unit_of: Mapping[str, Unit], sensor: str) -> Self | None:
        """None if axes are absent, empty (an accelerometer needs all three) or differ in unit."""
        names = [name for axis in AXES if (name := f"{sensor}_{axis}") in recording]
        units = {unit_of[name] for name in names if name in unit_of}
        axes = [recording[name].values for name in names]
        axes = [values for values in axes if not np.all(np.isnan(values))]
        if len(axes) < (1 if sensor == "gyro" else len(AXES)) or len(units) > 1:
            return None
        found = cls(units.pop(), axes, recording.dt)
        return found if found.size > 0.0 else None


def _noise_of(axes: Sequence[FloatArray] | FloatArray) -> FloatArray:
    """Robust standard deviation of white noise of each axis from differences; 0 if unknown."""
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
    sizes = {unit: length * scale for unit, scale in _ACCEL_UNITS.items()}
    likely = [unit for unit, size in sizes.items() if _is_gravity(size, tolerance)]
    return sorted(likely, key=lambda unit: abs(sizes[unit] - _GRAVITY))


def _swapped(
    source: str, rate: _Sensor | None, force: _Sensor | None, are_columns_given: bool
) -> tuple[Notice, ...]:
    """Gravity in the gyro's columns, and none in the accelerometer's."""
    if rate is None or force is None:
        return ()
    in_file = rate.size / rate.unit.scale
    units = _gravity_units(in_file, tuning.GRAVITY_SURE)
    other = force.size / force.unit.scale
    if not units or _gravity_units(other) or rate.scatter > tuning.GRAVITY_NOISE * rate.size:
        return ()
    text = (
        f"the mean of the gyro columns is {in_file:.4g}, gravity in {units[0]}, but the mean of "
        f"the accelerometer columns is {other:.4g}: the two are swapped"
    )
    if not are_columns_given:
        hint = 'give the columns, e.g. channels={"accel_x": 0, "gyro_x": 3}'
        raise InputError(f"{source}: {text}", "channels-swapped", hint)
    values = {"gyro": rate.size, "accel": force.size, "likely": units[0]}
    return (notice("swapped", "", values, contradiction=text),)


def _gravity(
    recording: Recording, force: _Sensor | None, given: Mapping[str, str], has_layout: bool
) -> tuple[Notice, ...]:
    """A mean that is gravity in another unit than the one used, or has a wrong scale."""
    if force is None or _is_gravity(force.size) or _is_gravity(force.usual):  # it may turn over
        return ()
    in_file = force.size / force.unit.scale
    likely = _gravity_units(in_file)
    is_given = any(key in given for key in ("accel", *(f"accel_{axis}" for axis in AXES)))
    if not likely:
        return _scale(recording, force, must_show=has_layout and not is_given)
    values = {"norm": force.size, "unit": force.unit.text, "likely": likely[0], "alike": likely[0]}
    hint = f"check the unit: all accelerometer values are off by {_GRAVITY / force.size:.4g}"
    found = notice("gravity", "accel", values, variant="unit", hint=hint, in_file=in_file)
    if not is_given:
        hint, unit = f'give the unit, units={{"accel": "{likely[0]}"}}', {"unit": likely[0]}
        raise InputError(f"{recording.source}: {found.text}", "accel-unit-missing", hint, unit)
    return (found,)


def _scale(recording: Recording, force: _Sensor, *, must_show: bool) -> tuple[Notice, ...]:
    """A length that is gravity in no unit, and too large for an accelerometer without gravity."""
    values, usual, ratio = {"norm": force.size}, force.usual, force.usual / _GRAVITY
    if must_show and not 0.5 < ratio < 2.0:
        text = f"the accelerometer reads {usual:.4g} m/s^2, {ratio:.3g} times gravity"
        hint = 'give the layout of this file, or units={"accel": "m/s^2"} if there is no gravity'
        raise InputError(f"{recording.source}: {text}: the file has another layout", "layout", hint)
    if _is_gravity(force.size * recording.rate, tuning.GRAVITY_SURE):
        hint = "divide the increments, also of the gyro, by the sampling interval"
        return (notice("gravity", "", values, variant="increments", hint=hint, usual=usual),)
    is_absent = usual < tuning.NO_GRAVITY or force.scatter > tuning.NOISE_OF_GRAVITY * usual
    if is_absent or abs(ratio - 1.0) < tuning.SCALE_AGREES:
        return ()
    words: dict[str, Any] = {"variant": "scale", "usual": usual, "ratio": ratio}
    return (notice("gravity", "accel", values, severity="warning", **words),)


def _gyro_unit(rate: _Sensor) -> Notice:
    """Noise or a mean rate that is too large, and the units in which it is not."""
    ratios = {unit: scale / rate.unit.scale for unit, scale in _GYRO_UNITS.items()}
    likely = [
        unit
        for unit, ratio in ratios.items()
        if ratio < 0.9 and _is_plausible(rate.density * ratio, rate.size * ratio)
    ]
    # Units whose ratio is smaller than that between gyros cannot be distinguished.
    first, apart = ratios[likely[0]] if likely else 1.0, math.log(tuning.UNITS_APART)
    near = [unit for unit in likely if abs(math.log(ratios[unit] / first)) < apart]
    values: dict[str, object] = {"density": rate.density, "mean": rate.size, "unit": rate.unit.text}
    explained = ""
    if near:
        values |= {"likely": near[0], "alike": " or ".join(near)}
        explained = f": {values['alike']}, not {rate.unit.text}, would explain it"
    is_noisy = rate.density > tuning.NOISIEST_GYRO
    size = (rate.density if is_noisy else rate.size) / _DEGREE
    variant = "noise" if is_noisy else "mean"
    words: dict[str, Any] = {"variant": variant, "size": size, "explained": explained}
    return notice("gyro-unit", "gyro", values, severity="bad" if near else None, **words)


def _is_plausible(density: float, mean: float) -> bool:
    return density < tuning.NOISIEST_GYRO and mean < tuning.LARGEST_BIAS


def _counts(
    recording: Recording, unit_of: Mapping[str, Unit]
) -> dict[str, tuple[list[str], float]]:
    """Channels of a sensor that are multiples of a unit too coarse for it, and their noise."""
    found = {}
    for sensor, largest in _LEAST_COUNT.items():
        counts = {
            name: recording[name].values / unit.scale
            for name, unit in unit_of.items()
            if name.startswith(sensor)
            and unit.scale >= largest
            and _is_counted(recording[name].values, unit.scale)
        }
        if counts:
            found[sensor] = [*counts], float(np.max(_noise_of([*counts.values()])))
    return found


def _is_counted(values: FloatArray, size: float) -> bool:
    """Whether samples are multiples of a size, and their noise is several times that size."""
    for part in (values[: tuning.ROWS_OF_COUNTS], values):
        numbers = part / size
        off = np.abs(numbers - np.rint(numbers))
        if not np.fmax.reduce(off, initial=np.nan) <= 1e-6:  # passes over NaN
            return False
    return bool(_noise_of([values])[0] > tuning.NOISE_OF_COUNTS * size)
