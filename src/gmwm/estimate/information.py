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
from gmwm.process import Process
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
