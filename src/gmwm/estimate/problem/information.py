"""Fisher information of the parameters, from the spectrum.

For a Gaussian series of n samples with spectrum S the information matrix tends to
``n int_0^{1/2} (d log S / d z) (d log S / d z)' df`` (Whittle 1953, *Arkiv for Matematik* 2,
423-434). Frequencies below some lowest one belong to the unknown constant. With 1/(4 n dt) the
information on a random walk, beside white noise or not, is the exact one to 1 % from a thousand
samples on; with 1/(2 n dt) a walk that is just seen loses a third.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from gmwm._core.frozen import frozen
from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.problem.parameters import Coordinates, difference
from gmwm.process import Model, Process, evaluated, legendre

_STEP = 1e-5
_PANELS_PER_OCTAVE = 8
_NODES = 8
_SINGULAR = 1e10


@lru_cache(maxsize=16)
def frequency_nodes(n: int, dt: float) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes (Hz) from 1/(4 n dt) to 1/(2 dt), and their weights times n dt."""
    octaves = np.log2(n * 0.5 / tuning.LOWEST_FREQUENCY)
    panels = int(np.ceil(octaves * _PANELS_PER_OCTAVE))
    x, w = legendre(_NODES)
    edges = np.linspace(-octaves, 0.0, panels + 1)
    half = 0.5 * np.diff(edges)[:, None]
    middle = 0.5 * (edges[1:] + edges[:-1])[:, None]
    frequency = 0.5 * np.exp2((middle + half * x).ravel())
    weight = (half * w).ravel() * np.log(2.0) * frequency
    return frozen(frequency / dt), frozen(n * weight)


def density(processes: Sequence[Process], f: FloatArray, dt: float) -> FloatArray:
    """Spectrum of a sum of processes at ``f`` (Hz), u^2/Hz."""
    total = np.zeros_like(f)
    for process in processes:
        total += evaluated(process.psd, f, dt)
    return total


def spectral_information(
    coordinates: Coordinates, processes: Sequence[Process], n: int, dt: float
) -> FloatArray:
    """Expected information of z, (d, d)."""
    weight, own, slopes = _at_nodes(coordinates, processes, n, dt)
    return _information(weight, slopes, np.sum(own, axis=0))


def information_with(
    coordinates: Coordinates, processes: Sequence[Process], term: int, n: int, dt: float
) -> Callable[[float], FloatArray]:
    """Expected information as a function of the amplitude of one term, of positive amplitude.

    The spectrum and the slopes of a term are proportional to its amplitude.
    """
    weight, own, slopes = _at_nodes(coordinates, processes, n, dt)
    others = np.sum(np.delete(own, term, axis=0), axis=0)
    linear = coordinates.terms[term].linear
    now = float(processes[term].values[linear.name] or 0.0) ** linear.power
    mine = np.array([i == term for i, _ in coordinates.owners])[:, None]

    def information(amplitude: float) -> FloatArray:
        times = amplitude / now
        return _information(
            weight, np.where(mine, times * slopes, slopes), others + times * own[term]
        )

    return information


def _at_nodes(
    coordinates: Coordinates, processes: Sequence[Process], n: int, dt: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weights of the nodes, (f,), each process's spectrum, (terms, f), and slopes dS/dz, (d, f)."""
    f, weight = frequency_nodes(n, dt)
    own = np.array([evaluated(process.psd, f, dt) for process in processes])
    slopes = np.empty((len(coordinates.owners), f.size))
    z = coordinates.pack(processes)
    for k, (i, is_amplitude) in enumerate(coordinates.owners):

        def spectrum(at: FloatArray, i: int = i) -> FloatArray:
            return coordinates.process(i, at, processes[i]).psd(f, dt)

        slopes[k] = own[i] if is_amplitude else difference(spectrum, z, k, _STEP)
    return weight, own, slopes


def _information(weight: FloatArray, slopes: FloatArray, density: FloatArray) -> FloatArray:
    """By the slopes of a spectrum's logarithm, which are zero where it underflows, (d, d)."""
    scaled = np.divide(slopes, density, out=np.zeros_like(slopes), where=density > 0.0)
    return np.asarray((weight * scaled) @ scaled.T)


@np.errstate(divide="ignore", invalid="ignore")  # no noise, or a value beyond its own steps
def error_growth(model: Model, keys: Sequence[str], n: int, dt: float) -> dict[str, float]:
    """Exponents with which the relative standard errors of positive parameters grow, by key.

    A relative standard error is proportional to value^k between the points half a standard error
    below and above the estimate, along which the other parameters follow as they are correlated; by
    the expected information.
    """
    coordinates = Coordinates(model.with_params(dict.fromkeys(keys)))
    processes = [model.terms[term.place] for term in coordinates.terms]
    names = coordinates.fitted(processes)[1]
    if not names or not all(process.has_spectrum() for process in processes):
        return {}
    positive = {i.key for i in model.parameters if i.parameter.lower == 0.0}
    covariance = _covariance(coordinates, processes, n, dt)
    if covariance is None:
        return {}
    z = coordinates.pack(processes)
    result = {}
    for k, name in enumerate(names):
        if name not in positive:
            continue
        step = tuning.PROFILE_STEP * covariance[:, k] / np.sqrt(covariance[k, k])
        step /= max(float(np.max(np.abs(step))), 1.0)  # too long where hardly anything is known
        ends = []
        for moved in (z - step, z + step):
            there = coordinates.processes(moved, processes)
            i, own = coordinates.names[k]
            value = float(there[i].values[own] or 0.0)
            matrix, error = _covariance(coordinates, there, n, dt), np.nan
            if matrix is not None:
                slope = coordinates.jacobian(there)[k, k]
                error = float(np.sqrt(matrix[k, k]) * abs(slope) / value)
            ends.append((np.log(value), np.log(error)))
        rise = (ends[1][1] - ends[0][1]) / (ends[1][0] - ends[0][0])
        if np.isfinite(rise):
            result[name] = float(np.clip(rise, -tuning.STEEPEST_GROWTH, tuning.STEEPEST_GROWTH))
    return result


def _covariance(
    coordinates: Coordinates, processes: Sequence[Process], n: int, dt: float
) -> FloatArray | None:
    """Inverse of the information; None if it is singular, as for a term of zero amplitude."""
    information = spectral_information(coordinates, processes, n, dt)
    deviation = np.sqrt(np.diag(information))
    if not np.all(np.isfinite(information)) or np.any(deviation == 0.0):
        return None
    if not np.linalg.cond(information / np.outer(deviation, deviation)) < _SINGULAR:
        return None
    return np.asarray(np.linalg.inv(information))
