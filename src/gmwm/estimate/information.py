"""Fisher information of the parameters, from the spectrum.

For a Gaussian series of n samples with spectrum S the information matrix tends to
``n int_0^{1/2} (d log S / d z) (d log S / d z)' df`` (Whittle 1953, *Arkiv for Matematik* 2,
423-434); frequencies below 1/(2 n dt) belong to the unknown constant.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gmwm._typing import FloatArray
from gmwm.estimate.coordinates import Coordinates
from gmwm.process import Model, Process
from gmwm.process.spectral import evaluated, legendre

_STEP = 1e-5
_PANELS_PER_OCTAVE = 8
_NODES = 8


def frequency_nodes(n: int, dt: float) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes (Hz) from 1/(2 n dt) to 1/(2 dt), and their weights times n dt."""
    octaves = np.log2(n)
    panels = int(np.ceil(octaves * _PANELS_PER_OCTAVE))
    x, w = legendre(_NODES)
    edges = np.linspace(-octaves, 0.0, panels + 1)
    half = 0.5 * np.diff(edges)[:, None]
    middle = 0.5 * (edges[1:] + edges[:-1])[:, None]
    frequency = 0.5 * np.exp2((middle + half * x).ravel())
    weight = (half * w).ravel() * np.log(2.0) * frequency
    return frequency / dt, n * weight


def density(processes: Sequence[Process], f: FloatArray, dt: float) -> FloatArray:
    """Spectrum of a sum of processes at ``f`` (Hz), u^2/Hz."""
    total = np.zeros_like(f)
    for process in processes:
        total += evaluated(process.psd, f, dt)
    return total


def log_slopes(
    coordinates: Coordinates, processes: Sequence[Process], f: FloatArray, dt: float
) -> FloatArray:
    """Slopes d log S / d z at ``f`` (Hz), shape (len(f), d)."""
    z = coordinates.pack(processes)
    total = density(processes, f, dt)
    columns = []
    for k, (i, is_amplitude) in enumerate(coordinates.owners):
        if is_amplitude:
            columns.append(processes[i].psd(f, dt) / total)
            continue
        pair = []
        for step in (_STEP, -_STEP):
            moved = z.copy()
            moved[k] += step
            pair.append(coordinates.processes(moved, processes)[i].psd(f, dt))
        columns.append((pair[0] - pair[1]) / (2.0 * _STEP) / total)
    return np.stack(columns, axis=1)


def spectral_information(
    coordinates: Coordinates, processes: Sequence[Process], n: int, dt: float
) -> FloatArray:
    """Expected information of z, (d, d)."""
    f, weight = frequency_nodes(n, dt)
    slopes = log_slopes(coordinates, processes, f, dt)
    return np.asarray(slopes.T @ (weight[:, None] * slopes))


def slope_dof(
    model: Model, keys: Sequence[str], covariance: FloatArray, n: int, dt: float
) -> float:
    """Degrees of freedom of the variance of a ramp's estimated slope.

    That variance is computed from estimated noise; one of relative error r has 2/r^2 degrees of
    freedom (Satterthwaite 1946, *Biometrics Bulletin* 2, 110-114). By the spectrum it is the
    inverse of ``int |T|^2 / S df`` with T the Fourier transform of the ramp.

    Parameters
    ----------
    model : Model
        With the estimates.
    keys : sequence of str
        The estimated parameters of its noise.
    covariance : (d, d) ndarray
        Of these.
    n : int
    dt : float
        Sampling interval, s.
    """
    coordinates = Coordinates(model.with_params(dict.fromkeys(keys)))
    processes = [model.terms[i] for i in coordinates.places]
    by_term = {(i.term, i.parameter.name): i.key for i in model.parameters}
    names = [by_term[coordinates.places[i], name] for i, name in coordinates.names]
    if not names:
        return np.inf
    order = [list(keys).index(name) for name in names]
    f, weight = frequency_nodes(n, dt)
    phase = np.pi * f * n * dt
    ramp = ((np.sin(phase) - phase * np.cos(phase)) / f**2) ** 2
    share = weight * ramp / density(processes, f, dt)
    by_z = share @ log_slopes(coordinates, processes, f, dt) / np.sum(share)
    gradient = np.linalg.solve(coordinates.jacobian(processes).T, by_z)
    variance = float(gradient @ covariance[np.ix_(order, order)] @ gradient)
    return 2.0 / variance if variance > 0.0 else np.inf
