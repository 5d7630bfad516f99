"""What channels share: positive semidefinite amplitudes of the processes that they have in common.

The wavelet covariances of p channels are fitted by E[nu_j^ab] = sum_k (Q_k)_ab nu_j(theta_k): each
part k is a process of one shape on all channels, and the matrix Q_k >= 0 says how much of it each
channel has and how far it is the same noise. Given the shapes that is linear least squares over
cones, weighted by the covariance that the fit itself implies (Isserlis), iterated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.process import Process
from gmwm.variance import WaveletCovariance


@dataclass(frozen=True, eq=False)
class SharedFit:
    """Parts of the noise of several channels, and what the channels share of each.

    matrices: (K, p, p), Q_k, positive semidefinite: variances and covariances of each part, in
        products of the channels' units.
    covariance: (K P, K P), of the P = p (p + 1) / 2 elements a <= b of each matrix, part by part.
    """

    matrices: FloatArray
    covariance: FloatArray

    def matrix(self, growth: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sum of the matrices with weights, (p, p), and the covariance of its elements a <= b.

        growth: (K,), e.g. variance of an integral of each part.
        """
        total = np.einsum("k,kab->ab", growth, self.matrices)
        pairs = len(self.covariance) // len(growth)
        parts = self.covariance.reshape(len(growth), pairs, len(growth), pairs)
        return total, np.einsum("k,kplq,l->pq", growth, parts, growth)


def fit_shared(parts: Sequence[Process], data: WaveletCovariance) -> SharedFit:
    """Fit the matrices of parts of different shapes to wavelet covariances.

    Raises InputError if a channel has the samples of another.
    """
    p, levels, (first, second) = len(data.names), data.tau.size, data.pairs
    alike = np.min(np.abs(data.correlation), axis=0) - np.eye(p) > tuning.SAME_SAMPLES
    if np.any(alike):
        one, other = (data.names[k] for k in np.argwhere(alike)[0])
        raise InputError(
            f"{one} and {other} have the same samples: leave one of them out", "same-samples"
        )
    own = np.einsum("jaa->aj", data.values)
    scale = np.sqrt(np.exp(np.mean(np.log(own), axis=1)))
    usual = np.exp(np.mean(np.log(own / scale[:, None] ** 2), axis=0))
    scales = scale[first] * scale[second]
    unit = np.repeat(scales, levels)
    goal = data.vector / unit
    # Of independent channels of white coefficients, for the first round.
    fewest = np.maximum(data.n * data.block * data.dt / (2.0 * data.tau), 1.0)
    root = np.diag(np.tile(usual / np.sqrt(fewest), first.size))
    form = data.form([part.psd for part in parts])
    curves = np.stack([part.haar_variance(data.tau, data.dt) for part in parts])
    sizes = np.max(curves / usual, axis=1)
    columns = np.einsum("kj,pq->pjkq", curves / sizes[:, None], np.eye(first.size))
    columns = columns.reshape(unit.size, -1)
    matrices = np.zeros((len(parts), p, p))
    for turn in range(tuning.SHARED_ROUNDS):
        if turn:
            covariance = data.covariance_under(form, matrices) / np.outer(unit, unit)
            root = np.linalg.cholesky(covariance)
        whitened = solve_triangular(root, np.column_stack([columns, goal]), lower=True)
        design = whitened[:, :-1]
        information = design.T @ design
        x = cone_least_squares(information, design.T @ whitened[:, -1], len(parts), p)
        found = x.reshape(len(parts), -1) * scales / sizes[:, None]
        matrices[:, first, second] = matrices[:, second, first] = found
    # Without the bounds of the cones, near which it is too large: with them it is too small.
    spread = np.linalg.pinv(information, rcond=1e-13, hermitian=True)
    sized = (scales / sizes[:, None]).ravel()
    return SharedFit(matrices, spread * np.outer(sized, sized))


def cone_least_squares(
    information: FloatArray, target: FloatArray, count: int, size: int
) -> FloatArray:
    """Minimize x' H x / 2 - t' x where parts of x are positive semidefinite matrices.

    By Newton's method with a logarithmic barrier (Boyd & Vandenberghe 2004, *Convex Optimization*,
    ch. 11), in coordinates in which each matrix L L' moves by L Z L'.

    information, target: H and t, in units of the order of one matrix element.
    count, size: x has the elements a <= b of so many matrices, of so many rows.
    """
    first, second = np.triu_indices(size)
    pairs = first.size
    spread = np.zeros((size, size, pairs))
    spread[first, second, np.arange(pairs)] = spread[second, first, np.arange(pairs)] = 1.0
    identity, square = np.eye(size)[first, second], np.einsum("abp,abq->pq", spread, spread)
    barrier = np.kron(np.eye(count), square)
    x = np.tile(identity / count, count)
    weight = max(float(np.trace(information)) / target.size, 1.0)
    for _ in range(tuning.CONE_STEPS):
        roots = np.linalg.cholesky(np.einsum("kp,abp->kab", x.reshape(-1, pairs), spread))
        turned = np.zeros_like(information)
        for k, root in enumerate(roots):
            at = slice(k * pairs, (k + 1) * pairs)
            moved = np.einsum("ac,cdp,bd->abp", root, spread, root)
            turned[at, at] = moved[first, second]
        gradient = turned.T @ (information @ x - target)
        gradient -= weight * np.tile(identity, count)
        curvature = turned.T @ information @ turned + weight * barrier
        step = -np.linalg.solve(curvature, gradient)
        change = np.einsum("kp,abp->kab", step.reshape(-1, pairs), spread)
        worst = float(np.min(np.linalg.eigvalsh(change)))
        x = x + min(1.0, -0.95 / min(worst, -1e-300)) * (turned @ step)
        if -gradient @ step < weight:
            if weight * count * size < tuning.CONE_GAP:
                break
            weight *= 0.1
    return x
