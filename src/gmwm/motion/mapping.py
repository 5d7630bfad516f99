"""One IMU's signals as another one on the same rigid body measures them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, sosfiltfilt

from gmwm._core.documents import Array, Document, Text
from gmwm._core.frozen import freeze
from gmwm._core.typing import QUARTILE, BoolArray, FloatArray
from gmwm.motion import tuning
from gmwm.motion.clocks import means
from gmwm.motion.curves import haar

_AXES = 3
_LAG = 9  # place of the lag behind the nine entries of the matrix


@dataclass(frozen=True)
class Mounting(Document):
    """How an IMU stands against the target, from one sensor of a flight.

    Attributes
    ----------
    flight : int
    sensor : {"gyro", "accel"}
    imu, target : str
    rotation : (3,) ndarray
        Rotation vector that turns the IMU's axes into the target's, rad.
    correction, correction_error : (9,) ndarray
        Rows of the matrix that multiplies turned signals beside the identity (scale on the
        diagonal, misalignment beside it), with standard errors.
    lag, lag_error : float
        Delay beside that of the clock, s.
    lever_arm, lever_arm_error : (3,) ndarray
        From the IMU to the target, m, in the target's axes; empty for gyros.
    """

    flight: int
    sensor: Text
    imu: Text
    target: Text
    rotation: Array
    correction: Array
    correction_error: Array
    lag: float
    lag_error: float
    lever_arm: Array
    lever_arm_error: Array

    def __post_init__(self) -> None:
        freeze(self, "rotation", "correction", "correction_error", "lever_arm", "lever_arm_error")


@dataclass(frozen=True)
class Signals:
    """One sensor of one IMU at the instants of the target, turned into its axes.

    values, slopes: (n, 3), and means over 0.1 s of their time derivatives.
    arms: (n, 3, 3), what a lever arm of 1 m along each axis adds; None for gyros.
    """

    values: FloatArray
    slopes: FloatArray
    arms: FloatArray | None = None

    @property
    def spreads(self) -> FloatArray:
        """Spread of each parameter before the data: matrix, lag, lever arm."""
        arm = [] if self.arms is None else [tuning.ARM_SPREAD] * _AXES
        return np.array([tuning.SCALE_SPREAD] * _LAG + [tuning.LAG_SPREAD, *arm])

    def regressors(self, size: int) -> FloatArray:
        """(m, 3, p) means over blocks of what each parameter adds to the target's axes."""
        values = means(self.values, size)
        found = np.zeros((len(values), _AXES, len(self.spreads)))
        for axis in range(_AXES):
            found[:, axis, _AXES * axis : _AXES * (axis + 1)] = values
        found[:, :, _LAG] = means(self.slopes, size)
        if self.arms is not None:
            found[:, :, _LAG + 1 :] = means(self.arms, size)
        return np.asarray(found - found.mean(axis=0))

    def is_close(self, target: FloatArray, parameters: FloatArray, size: int) -> bool:
        """Whether the rates, or the mean forces (gravity), agree as IMUs do."""
        if self.arms is None:
            left = means(target - self.mapped(parameters), size).var(axis=0).sum()
            is_explained = left < tuning.MOST_LEFT * means(target, size).var(axis=0).sum()
            return bool(is_explained and np.abs(parameters[:_LAG]).max() < tuning.MOST_CORRECTED)
        if np.linalg.norm((self.values - target).mean(axis=0)) > tuning.MOST_APART:
            return False
        # Without a spread before the data, a matrix far from the identity has other axes or scales.
        own, wanted = (
            each - each.mean(axis=0)
            for each in (means(self.values + self.arms @ parameters[-_AXES:], size),
                         means(target, size))
        )  # fmt: skip
        free = np.linalg.lstsq(own, wanted, rcond=None)[0]
        left = (wanted - own @ free).var(axis=0)
        inverse = np.diag(np.linalg.pinv(own.T @ own))
        error = np.sqrt(tuning.CORRELATION * np.outer(inverse, left))
        off = np.abs(free - np.eye(_AXES))
        is_sure = (off > tuning.SURE * error) & (left < tuning.NOISE_LEFT * wanted.var(axis=0))
        return not np.any(is_sure & (off > tuning.MOST_TURNED))

    def mapped(self, parameters: FloatArray) -> FloatArray:
        """(n, 3) as the target measures them, but for a constant."""
        matrix = np.eye(_AXES) + parameters[:_LAG].reshape(_AXES, _AXES)
        found = self.values @ matrix.T + parameters[_LAG] * self.slopes
        if self.arms is not None:
            found += self.arms @ parameters[_LAG + 1 :]
        return np.asarray(found)


def rotation_to(target: FloatArray, rates: FloatArray) -> FloatArray:
    """The rotation that turns rates into those of the target best (Wahba's problem)."""
    left, _, right = np.linalg.svd((target - target.mean(0)).T @ (rates - rates.mean(0)))
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)


def tilt_error(target: FloatArray, turned: FloatArray) -> float:
    """Standard error of a rotation about the axis of the largest rates, rad."""
    centred, left = target - target.mean(axis=0), target - turned
    spread = np.median(np.abs(left - np.median(left, axis=0))) / QUARTILE
    power = np.linalg.eigvalsh(centred.T @ centred)[-2]
    return float(spread * np.sqrt(tuning.CORRELATION / max(power, np.finfo(float).tiny)))


def arms_of(rates: FloatArray, slopes: FloatArray) -> FloatArray:
    """(n, 3, 3) matrices that take a lever arm to the specific force that it adds (m -> m/s^2)."""
    turning = _cross(rates)
    return np.asarray(_cross(slopes) + turning @ turning)


def _cross(vectors: FloatArray) -> FloatArray:
    found = np.zeros((len(vectors), _AXES, _AXES))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[:, i, j], found[:, j, i] = -vectors[:, k], vectors[:, k]
    return found


def map_onto(
    target: FloatArray, others: Sequence[Signals], good: BoolArray, dt: float
) -> tuple[list[FloatArray], list[FloatArray], list[FloatArray], FloatArray]:
    """Differences of the target and each other, the parameters of each with their errors.

    And the shares (K - 1, J, 3) of the variance of differences that the fits take, by octave.

    target: (n, 3), unfiltered.
    good: (n,), where no IMU lost a sample.
    dt: Of the target, s.

    The mapping of one IMU has the signals of the others as instruments: their errors are not its
    own, so that noise in what is mapped does not shrink the mapping, as least squares would. Two
    IMUs leave only least squares.
    """
    size = max(1, round(tuning.MEAN_OVER / dt))
    used_means = means(good.astype(float), size) == 1.0
    wanted = means(target - target.mean(axis=0), size)[used_means]
    spreads = others[0].spreads
    regressors = [each.regressors(size) * spreads for each in others]
    part = np.flatnonzero(used_means) * size * dt // tuning.ERROR_PART
    ends = np.flatnonzero(np.diff(part, prepend=-1.0))
    differences, parameters, errors, absorbed = [], [], [], []
    for j, each in enumerate(others):
        used = [k for k in range(len(others)) if k != j] or [j]
        instruments = np.mean([regressors[k] for k in used], axis=0)
        left = wanted - means(each.values - each.values.mean(axis=0), size)[used_means]
        z, x = (
            array[used_means].reshape(-1, len(spreads)) for array in (instruments, regressors[j])
        )
        # Two-stage least squares: what the others explain of the regressors has no noise of theirs.
        first = np.linalg.lstsq(z, x, rcond=None)[0]
        shared = z @ first
        product = shared.T @ shared
        found = np.zeros(len(spreads))
        for _ in range(tuning.REWEIGHTED):
            scatter = tuning.CORRELATION * float(np.var(left.ravel() - x @ found))
            inverse = np.linalg.inv(product + scatter * np.eye(len(spreads)))
            found = inverse @ (shared.T @ left.ravel())
        rest = (left.ravel() - x @ found).reshape(wanted.shape)
        by_row = np.einsum("nap,na->np", shared.reshape(*rest.shape, -1), rest)
        sums = np.add.reduceat(by_row, ends)
        spread = inverse @ (sums.T @ sums + scatter**2 * np.eye(len(spreads))) @ inverse
        parameters.append(found * spreads)
        errors.append(np.sqrt(np.diag(spread)) * spreads)
        differences.append(target - each.mapped(found * spreads))
        # The hat matrix H = X A X' of errors e leaves (I - H) e.
        power, axes = np.linalg.eigh(product)
        taken = axes * (np.sqrt(np.abs(power) + 2.0 * scatter) / (np.abs(power) + scatter))
        absorbed.append(_absorbed(instruments @ (first @ taken), size, len(target)))
    return differences, parameters, errors, np.array(absorbed)


def _absorbed(basis: FloatArray, size: int, n: int) -> FloatArray:
    """(J, 3) Share of the Allan variance that a fit to means takes, at 1, 2, 4 ... of n samples.

    Of errors that are white over an octave: a motion of half a hertz takes those at 1 s.
    """
    found = np.zeros((int(np.log2(n)), _AXES))
    columns = basis.reshape(len(basis), -1)
    for octave, share in enumerate(found):
        m = round(2**octave / size)
        if 0 < 2 * m <= len(basis):
            power = np.mean(haar(columns, m) ** 2, axis=0).reshape(basis.shape[1:])
            share[:] = np.minimum(0.5 * m * power.sum(axis=1), tuning.MOST_ABSORBED)
    return found


def far_out(differences: Sequence[FloatArray], dt: float) -> BoolArray:
    """(n,) Whether a mean over 0.1 s of a difference is far out: ten robust deviations.

    More than 1 % of a record, as where a part of it is at rest, are no events.
    """
    size = max(1, round(tuning.MEAN_OVER / dt))
    away = np.zeros(len(differences[0]), dtype=bool)
    for each in differences:
        level = means(each - np.median(each, axis=0), size)
        spread = np.median(np.abs(level), axis=0) / QUARTILE
        here = np.repeat(np.any(np.abs(level) > tuning.FAR_OUT * spread, axis=1), size)
        away[: here.size] |= here
    return away if away.mean() <= tuning.MOST_EVENTS else np.zeros_like(away)


def vibration_of(forces: FloatArray, dt: float) -> FloatArray:
    """(n,) rms over a second of what is from 20 to 60 Hz, m/s^2; NaN where it is not seen."""
    low, high = tuning.VIBRATION
    if 2.2 * low * dt > 1.0:
        return np.full(len(forces), np.nan)
    kind, ends = ("bandpass", (low, high)) if 2.2 * high * dt < 1.0 else ("highpass", low)
    band = sosfiltfilt(butter(4, ends, kind, fs=1.0 / dt, output="sos"), forces, axis=0)
    mean = uniform_filter1d(np.sum(band**2, axis=1), max(1, round(tuning.VIBRATION_OVER / dt)))
    return np.sqrt(np.maximum(mean, np.finfo(float).tiny))


def bridged(difference: FloatArray, used: BoolArray, dt: float) -> FloatArray:
    """The difference (n, 3) with its local level where samples are not used."""
    if np.all(used):
        return difference
    width = round(tuning.LEVEL_OVER / dt)
    share = uniform_filter1d(used.astype(float), width)
    total = uniform_filter1d(np.where(used[:, None], difference, 0.0), width, axis=0)
    return np.where(used[:, None], difference, total / np.maximum(share, 1e-9)[:, None])
