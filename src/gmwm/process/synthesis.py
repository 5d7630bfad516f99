"""Simulation kernels: first-order recursions, and series with a given spectrum."""

from __future__ import annotations

import numpy as np
from scipy import fft

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.process.spectral import PSD, evaluated
from gmwm.process.state_space import StateSpace

_BLOCK = 100_000


@compiled()
def first_order(innovation: FloatArray, phi: float, scale: float, start: float) -> None:
    """In place: x[0] = start * e[0], x[k] = phi x[k-1] + scale * e[k]."""
    state = start * innovation[0]
    innovation[0] = state
    for k in range(1, innovation.size):
        state = phi * state + scale * innovation[k]
        innovation[k] = state


@compiled()
def _propagate(
    transition: FloatArray,
    noise_root: FloatArray,
    output: FloatArray,
    state: FloatArray,
    noise: FloatArray,
    series: FloatArray,
) -> None:
    p = state.size
    following = np.empty(p)
    for k in range(series.size):
        total = 0.0
        for i in range(p):
            total += output[i] * state[i]
        series[k] = total
        for i in range(p):
            value = 0.0
            for j in range(p):
                value += transition[i, j] * state[j] + noise_root[i, j] * noise[k, j]
            following[i] = value
        state[:] = following


def _root(covariance: FloatArray) -> FloatArray:
    """A square root of a positive semi-definite matrix."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def from_state_space(form: StateSpace, n: int, rng: np.random.Generator) -> FloatArray:
    """A series of the model ``form``, in blocks so that the noise does not fill the memory."""
    state = form.initial_mean + _root(form.initial_covariance) @ rng.standard_normal(form.n_states)
    root = _root(form.process_noise)
    series = np.empty(n)
    for start in range(0, n, _BLOCK):
        part = series[start : start + _BLOCK]
        noise = rng.standard_normal((part.size, form.n_states))
        _propagate(form.transition, root, form.output, state, noise, part)
    if form.measurement_noise > 0.0:
        series += np.sqrt(form.measurement_noise) * rng.standard_normal(n)
    return series


def circulant(spectrum: FloatArray, n: int, rng: np.random.Generator) -> FloatArray:
    """First ``n`` samples of a periodic Gaussian series (Davies & Harte 1987, *Biometrika* 74, 95).

    spectrum: (N/2 + 1,), non-negative eigenvalues of its circulant covariance matrix at frequencies
        0, 1/N, ..., 1/2 cycles per sample.
    """
    size = 2 * (spectrum.size - 1)
    transformed = fft.rfft(rng.standard_normal(size)) * np.sqrt(spectrum)
    return np.asarray(fft.irfft(transformed, size)[:n])


def from_psd(psd: PSD, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
    """A Gaussian series from its power spectral density.

    The spectrum is sampled at multiples of 1/(4 n dt), so the autocovariance is right up to what
    is left of it beyond lag 3 n. A spectrum that grows without bound towards zero frequency is
    simulated through its first differences and starts at zero.
    """
    size = fft.next_fast_len(4 * n, real=True)
    size += size % 2
    frequency = np.arange(size // 2 + 1) / size
    frequency[0] = 1e-4 / size
    spectrum = evaluated(psd, frequency / dt, dt) / dt
    if spectrum[0] <= 2.0 * spectrum[1]:
        return circulant(spectrum, n, rng)
    difference = spectrum * 4.0 * np.sin(np.pi * frequency) ** 2
    path = np.cumsum(circulant(difference, n, rng))
    return np.asarray(path - path[0])
