"""Whether gravity turns in the frame of a sensor as its gyros say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray, known_of, median
from gmwm.readers.names import AXES
from gmwm.readers.recording import Recording

_ROWS = 1 << 16  # at a time
_LEAST_CONE = 0.01  # rad by which gravity leaves its mean where a sensor turns; at rest, 0.3 deg
_LAGS, _FEWEST_LAGS = (1, 4, 16), 20  # blocks between which changes count; how many at least


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


def steady_turn(recording: Recording, size: int) -> float:
    """Constant rate at which gravity turns in the frame of a sensor, rad/s; 0 if there is none.

    The w of da/dt = -w x a by least squares. It counts if it explains most of the changes and turns
    by a radian in all, which noise and drifts do not.
    """
    force = _triad(recording, "accel")
    means = block_means(force, size) if force else np.full((1, 1), np.nan)
    if np.all(np.any(np.isnan(means), axis=1)):
        return 0.0
    wander = np.linalg.norm(means - np.nanmean(means, axis=0), axis=1)
    if not np.nanmax(wander) > _LEAST_CONE * np.linalg.norm(np.nanmean(means, axis=0)):
        return 0.0
    for lag in _LAGS:
        if means.shape[0] < _FEWEST_LAGS * lag:
            break
        change = means[lag:] - means[:-lag]
        known = ~np.any(np.isnan(change), axis=1)
        x, y, z = 0.5 * (means[lag:] + means[:-lag])[known].T
        none = np.zeros(x.size)
        # -w x a, by the components of w.
        turned = np.array([[none, z, -y], [-z, none, x], [y, -x, none]])
        design, wanted = turned.reshape(3, -1).T, change[known].T.ravel()
        rate, *_ = np.linalg.lstsq(design, wanted, rcond=None)
        rest, total = wanted - design @ rate, float(wanted @ wanted)
        speed = float(np.linalg.norm(rate)) / (lag * size * recording.dt)
        if rest @ rest < 0.5 * total and speed * recording.duration > 1.0:
            return speed
    return 0.0
