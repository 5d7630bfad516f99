"""Debiased Whittle likelihood of a prewhitened series, by one FFT.

Whittle's likelihood (1953, *Arkiv for Matematik* 2, 423-434) compares the periodogram with the
spectrum, frequency by frequency. Of a series with a steep spectrum the periodogram is biased by
leakage, and so are the estimates (Sykulski, Olhede, Guillaumin, Lilly & Early 2019, *Biometrika*
106, 251-266). Here the series is first filtered to its innovations under starting values that are
close (prewhitening: Percival & Walden 1993, *Spectral Analysis for Physical Applications*,
sec. 6.5), which has no leakage to speak of; the periodogram is that of the zero-padded
innovations, so that the end of the series does not meet its beginning; and its expectation at the
starting values, one less what the regression on a constant and a ramp has taken, is exact. The
filter is renewed until its values are the estimates.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import fft

from gmwm._core.typing import FloatArray
from gmwm.estimate.likelihood.likelihood import Columns, Regression, stacked, whitened
from gmwm.estimate.problem import density
from gmwm.process import Process, StateSpace

_SINGLE = 2048  # lowest frequencies kept one by one
_BINS_PER_OCTAVE = 256  # above them
_CHUNK = 4096


class WhittleLikelihood:
    """Log-likelihood of a series near some values of its noise.

    Parameters
    ----------
    columns : Columns
        Without missing samples.
    filters : sequence of Process
        What the series is whitened with: processes with a state space, close to the noise.

    Notes
    -----
    With e the innovations over their standard deviations, zero-padded to 2 n samples, I their
    periodogram, c the share of its expectation that the regression takes, and rho the spectrum
    over that of the filter, the log-likelihood is ``-1/4 sum (1 - c) log rho + I / rho`` over all
    2 n frequencies. As rho is smooth and close to one, frequencies are grouped in narrow bins.
    """

    def __init__(self, columns: Columns, filters: Sequence[Process]) -> None:
        innovations, log_variance, _ = whitened(columns, filters)
        products = innovations.T @ innovations
        self.regression = Regression.of(products)
        n = columns.n
        residual = innovations[:, 0] - innovations[:, 1:] @ self.regression.beta
        size = fft.next_fast_len(2 * n, real=True)
        edges = _edges(size // 2 + 1)
        share = np.ones(size // 2 + 1)
        share[0] = 0.5
        if size % 2 == 0:
            share[-1] = 0.5
        share *= 2.0 * n / size  # as if of 2 n frequencies
        index = np.arange(size // 2 + 1)
        weight = np.add.reduceat(share, edges)
        self._frequency = np.add.reduceat(share * index, edges) / weight / size / columns.dt
        self._frequency[0] = 0.25 / size / columns.dt  # spectra may be infinite at zero
        power = share * np.abs(fft.rfft(residual, size)) ** 2 / n
        self._power = np.add.reduceat(power, edges)
        root = np.linalg.cholesky(self.regression.covariance)
        for column in (innovations[:, 1:] @ root).T:
            share = share - share * np.abs(fft.rfft(column, size)) ** 2 / n
        self._share = np.add.reduceat(share, edges)
        self._dt = columns.dt
        self._filter = _transfer(stacked(filters, columns.dt), self._frequency * columns.dt)
        free = n - self.regression.beta.size
        self._constant = -0.5 * (
            free * np.log(2.0 * np.pi) + log_variance + self.regression.log_determinant
        )

    def __call__(self, processes: Sequence[Process]) -> float:
        """Log-likelihood of these processes; comparable with `KalmanLikelihood`."""
        ratio = density(processes, self._frequency, self._dt) / self._dt / self._filter
        return self._constant - 0.5 * float(self._share @ np.log(ratio) + self._power @ (1 / ratio))


def _edges(count: int) -> npt.NDArray[np.intp]:
    """First indices of bins: single ones, then of equal width in the logarithm."""
    single = np.arange(min(_SINGLE, count))
    if count <= _SINGLE:
        return single
    bins = int(np.ceil(np.log2(count / _SINGLE) * _BINS_PER_OCTAVE))
    wide = np.geomspace(_SINGLE, count, bins + 1)[:-1].round().astype(int)
    return np.unique(np.concatenate([single, wide]))


def _transfer(space: StateSpace, frequency: FloatArray) -> FloatArray:
    """Spectrum of a state space at ``frequency`` (cycles per sample), u^2 per cycle per sample."""
    p = space.n_states
    result = np.full(frequency.size, space.measurement_noise)
    if p == 0:
        return result
    for start in range(0, frequency.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        turn = np.exp(2j * np.pi * frequency[part])
        matrices = turn[:, None, None] * np.eye(p) - space.transition
        rows = np.broadcast_to(space.output, (turn.size, p))[:, :, None]
        gain = np.linalg.solve(matrices.transpose(0, 2, 1), rows)[:, :, 0]
        result[part] += np.einsum("ki,ij,kj->k", gain, space.process_noise, gain.conj()).real
    return result
