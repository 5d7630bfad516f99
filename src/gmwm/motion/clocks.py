"""Clocks of two IMUs on one body, joined by the rates that both measure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from gmwm._core.documents import Document, OrNaN, Text
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.motion import tuning


@dataclass(frozen=True)
class Clock(Document):
    """The clock of an IMU against that of the first one: ``offset + (1 + drift) t``.

    offset, offset_error: s, when the first IMU's own time is zero, and its standard error.
    drift, drift_error: Share, and its standard error.
    """

    flight: int
    imu: Text
    offset: float
    drift: float
    offset_error: OrNaN
    drift_error: OrNaN

    def of_first(self, own: FloatArray) -> FloatArray:
        """Time of the first IMU at times of this one, s."""
        return (own - self.offset) / (1.0 + self.drift)

    def own(self, first: FloatArray) -> FloatArray:
        """Time of this IMU at times of the first one, s."""
        return self.offset + (1.0 + self.drift) * first


def means(values: FloatArray, size: int) -> FloatArray:
    """Means over blocks of samples along the first axis; a last part of one is left out."""
    count = len(values) // size
    return np.asarray(values[: count * size].reshape(count, size, *values.shape[1:]).mean(axis=1))


def join(
    flight: int, imu: str, rates: tuple[FloatArray, FloatArray], dt: tuple[float, float]
) -> Clock | None:
    """The clock of an IMU against the first one of the flight; None where neither moves.

    rates: (n, 3) of the first and of this IMU, rad/s.
    dt: Their sampling intervals, s.

    The lengths of the rates, which no mounting changes, give the offset to a sample. Then means
    over 0.1 s of the first are a matrix times those of the other, delayed by a line in time
    (Gauss-Newton). Raises InputError if the rates are not of one body, or the delay is no line.
    """
    lag = _coarse(rates, dt)
    if lag is None:
        spreads = [np.std(means(r, _block(own)), axis=0) for r, own in zip(rates, dt, strict=True)]
        if np.max(spreads) > tuning.MOVING:
            raise InputError(
                f"flight {flight}: the rates of {imu} and of the first IMU do not correlate: give "
                "recordings of one motion, on one rigid body"
            )
        return None
    first, size = rates[0], _block(dt[0])
    spline = CubicSpline(np.arange(len(rates[1])) * dt[1], rates[1])
    time = np.arange(len(first)) * dt[0]
    line = np.array([lag, 0.0])  # offset and drift
    for _ in range(tuning.PASSES):
        own = line[0] + (1.0 + line[1]) * time
        inside = (own > tuning.EDGE * dt[1]) & (own < spline.x[-1] - tuning.EDGE * dt[1])
        if np.count_nonzero(inside) < 20 * size:
            raise InputError(f"flight {flight}: {imu} and the first IMU share less than 2 s")
        target, at = means(first[inside], size), means(time[inside], size)
        mapped = np.column_stack([means(spline(own[inside]), size), np.ones(len(target))])
        matrix = np.linalg.lstsq(mapped, target, rcond=None)[0]
        residual = target - mapped @ matrix
        slope = means(spline(own[inside], 1), size) @ matrix[:3]
        slope -= mapped @ np.linalg.lstsq(mapped, slope, rcond=None)[0]
        middle = float(at.mean())
        lines = np.column_stack([slope.ravel(), (slope * (at - middle)[:, None]).ravel()])
        step = np.linalg.lstsq(lines, residual.ravel(), rcond=None)[0]
        line += [step[0] - step[1] * middle, step[1]]
        if abs(step[0]) < tuning.CLOSE:
            break
    left = residual.ravel() - lines @ step
    _check_steady(flight, imu, left.reshape(slope.shape), slope, at)
    covariance = np.linalg.inv(lines.T @ lines) * np.var(left) * tuning.CORRELATION
    at_zero = covariance[0, 0] + middle**2 * covariance[1, 1] - 2.0 * middle * covariance[0, 1]
    errors = np.sqrt([at_zero, covariance[1, 1]])
    return Clock(flight, imu, float(line[0]), float(line[1]), float(errors[0]), float(errors[1]))


def _block(dt: float) -> int:
    return max(1, round(tuning.MEAN_OVER / dt))


def _coarse(rates: tuple[FloatArray, FloatArray], dt: tuple[float, float]) -> float | None:
    """Delay of the second IMU's clock to a sample, s; None where the rates do not correlate."""
    lengths = []
    for values, own in zip(rates, dt, strict=True):
        size = _block(own)
        total = np.cumsum(np.vstack([np.zeros((1, 3)), values]), axis=0)
        length = np.linalg.norm((total[size:] - total[:-size]) / size, axis=1)
        if own != dt[0]:
            grid = np.arange(0.0, (len(length) - 1) * own, dt[0])
            length = np.interp(grid, np.arange(len(length)) * own, length)
        lengths.append(length - length.mean())
    size = len(lengths[0]) + len(lengths[1])
    spectra = [np.fft.rfft(each, size) for each in lengths]
    product = np.fft.irfft(np.conj(spectra[0]) * spectra[1], size)
    best = int(np.argmax(product))
    late = best if best < len(lengths[1]) else best - size
    # Over what both have, if that is enough: they may have started far apart.
    one, other = lengths[0][max(-late, 0) :], lengths[1][max(late, 0) :]
    shared = min(len(one), len(other))
    is_enough = shared > tuning.LEAST_SHARED * min(map(len, lengths))
    one, other = (one[:shared], other[:shared]) if is_enough else lengths
    norm = float(np.linalg.norm(one) * np.linalg.norm(other))
    return late * dt[0] if product[best] > tuning.CORRELATED * norm else None


def _check_steady(
    flight: int, imu: str, residual: FloatArray, slope: FloatArray, at: FloatArray
) -> None:
    """Raise InputError if delays of parts explain much of what the line leaves."""
    part = np.minimum(((at - at[0]) / tuning.PART).astype(int), int((at[-1] - at[0]) / tuning.PART))
    power = np.bincount(part, np.sum(slope**2, axis=1))
    along = np.bincount(part, np.sum(residual * slope, axis=1))
    delays = along / np.maximum(power, np.finfo(float).tiny)
    if delays**2 @ power > tuning.WANDER * float(np.sum(residual**2)):
        raise InputError(
            f"flight {flight}: the clock of {imu} wanders against that of the first IMU by "
            f"{1e3 * np.std(delays):.2g} ms around a steady drift: give shorter recordings, or "
            "recordings with time stamps of the sensors"
        )
