"""The maximal overlap discrete wavelet transform (MODWT), by the pyramid algorithm.

Percival & Walden, *Wavelet Methods for Time Series Analysis*, 2000, ch. 5: level j filters the
smooth of level j - 1 with the filters of level 1, their taps 2^(j-1) samples apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import wavelet as wavelet_of


@dataclass(frozen=True, eq=False)
class Modwt:
    """The transform of a series.

    Attributes
    ----------
    wavelet : str
        Filter, as PyWavelets names it.
    detail : (J, n) ndarray
        Wavelet coefficients of the levels 1 to J, averaging times 2^(j-1) samples. The series is
        taken as periodic: the first ``width(j) - 1`` of level j mix its end with its beginning.
    smooth : (n,) ndarray
        Scaling coefficients of level J.
    """

    wavelet: str
    detail: FloatArray
    smooth: FloatArray

    def inverse(self) -> FloatArray:
        """The series, (n,)."""
        return imodwt(self.detail, self.smooth, self.wavelet)


def modwt(x: FloatArray, wavelet: str = "haar", levels: int | None = None) -> Modwt:
    """Maximal overlap discrete wavelet transform of a series taken as periodic.

    Parameters
    ----------
    x : (n,) array_like
        Finite numbers; any length.
    wavelet : str, optional
        "haar", "db2" to "db10", "sym2" to "sym10", "coif1" to "coif5".
    levels : int, optional
        Number of levels J; by default all that have a coefficient free of end effects, at least 1.

    Raises
    ------
    InputError
        For a series that is empty, not one-dimensional or not finite, an unknown wavelet, or
        levels whose averaging time exceeds the series.
    """
    filters = wavelet_of(wavelet)
    smooth = _series(x)
    n = smooth.size
    count, most = max(filters.levels(n), 1), n.bit_length()
    if levels is not None:
        hint = f"give an integer from 1 to {most} for {n} samples"
        count = checks.whole("levels", levels, 1, hint)
        if count > most:
            raise InputError(f"levels = {levels!r}: {hint}")
    detail = np.zeros((count, n))
    for row in range(count):
        detail[row] = _circular(smooth, filters.detail, 1 << row)
        smooth = _circular(smooth, filters.scaling, 1 << row)
    return Modwt(filters.name, detail, smooth)


def imodwt(detail: FloatArray, smooth: FloatArray, wavelet: str = "haar") -> FloatArray:
    """Inverse of `modwt`.

    Parameters
    ----------
    detail : (J, n) array_like
    smooth : (n,) array_like
    wavelet : str, optional

    Returns
    -------
    (n,) ndarray

    Raises
    ------
    InputError
        If the shapes do not belong together, or for an unknown wavelet.
    """
    filters = wavelet_of(wavelet)
    result = _series(smooth)
    rows = np.asarray(detail, dtype=float)
    n = result.size
    if rows.ndim != 2 or rows.shape[1] != n:
        raise InputError(
            f"detail has shape {rows.shape} beside a smooth of {n} samples: give one row of {n} "
            "coefficients a level"
        )
    for row in range(rows.shape[0] - 1, -1, -1):
        step = -(1 << row)
        detailed = _circular(rows[row], filters.detail, step)
        result = _circular(result, filters.scaling, step, detailed)
    return result


def coefficients(values: FloatArray, wavelet: str, levels: int = 64) -> Iterator[FloatArray]:
    """Wavelet coefficients free of end effects, level by level; one level at a time is in memory.

    values: (n,), finite numbers.
    levels: At most so many. A short series has fewer that have such a coefficient.
    Yields: (n - width(j) + 1,), of level j = 1, 2, ..., in the order of time; element i stems from
        samples i to i + width(j) - 1.
    Raises InputError for a series that cannot be used, or an unknown wavelet.
    """
    filters = wavelet_of(wavelet)
    smooth = _series(values)
    count = min(filters.levels(smooth.size), levels)

    def level_by_level(smooth: FloatArray) -> Iterator[FloatArray]:
        for row in range(count):
            yield _filtered(smooth, filters.detail, 1 << row)
            if row + 1 < count:
                smooth = _filtered(smooth, filters.scaling, 1 << row)

    return level_by_level(smooth)


def _circular(
    values: FloatArray, taps: FloatArray, step: int, start: FloatArray | None = None
) -> FloatArray:
    """start[t] + sum_l taps[l] values[t - step l], indices taken modulo the length."""
    out = np.zeros(values.size) if start is None else start
    for i, tap in enumerate(taps.tolist()):
        out += tap * np.roll(values, i * step)
    return out


def _filtered(values: FloatArray, taps: FloatArray, step: int) -> FloatArray:
    """sum_l taps[l] values[t - step l] where all of these exist."""
    reach = step * (taps.size - 1)
    out = np.zeros(values.size - reach)
    for i, tap in enumerate(taps.tolist()):
        out += tap * values[reach - step * i : values.size - step * i]
    return out


def _series(x: FloatArray) -> FloatArray:
    values = np.ascontiguousarray(checks.real_numbers(x, "the series"))
    if np.ndim(x) != 1 or values.size == 0:
        raise InputError(f"the series has shape {np.shape(x)}: give one series of samples")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise InputError(
            f"the series has {bad.size} NaN or infinite samples, the first at index {bad[0]}: "
            "remove or repair them"
        )
    return values
