"""What channels share: positive semidefinite amplitudes of the processes that they have in common.

The wavelet covariances of p channels are fitted by E[nu_j^ab] = sum_k (Q_k)_ab nu_j(theta_k): each
part k is a process of one shape on all channels, and the matrix Q_k >= 0 says how much of it each
channel has and how far it is the same noise. Given the shapes that is linear least squares over
cones, weighted by the covariance that the fit itself implies (Isserlis), iterated. Correlation
times are found with it, by Gauss-Newton steps in their logarithms.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from gmwm._core.distributions import chi2, norm
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.process import Process
from gmwm.variance import WaveletCovariance


@dataclass(frozen=True, eq=False)
class SharedFit:
    """Parts of the noise of several channels, and what the channels share of each.

    names: Of the p channels.
    parts: At unit amplitude.
    matrices: (K, p, p), Q_k, positive semidefinite: variances and covariances of each part, in
        products of the channels' units.
    covariance: (K P, K P), of the P = p (p + 1) / 2 elements a <= b of each matrix, part by part;
        with the uncertainty of the correlation times.
    """

    names: tuple[str, ...]
    parts: tuple[Process, ...]
    matrices: FloatArray
    covariance: FloatArray

    @property
    def stderr(self) -> FloatArray:
        """Standard errors of ``matrices``, (K, p, p)."""
        first, second = np.triu_indices(len(self.names))
        found = np.empty_like(self.matrices)
        own = np.sqrt(np.diag(self.covariance)).reshape(len(self.parts), -1)
        found[:, first, second] = found[:, second, first] = own
        return found

    def interval(self, level: float = 0.95) -> tuple[FloatArray, FloatArray]:
        """Ends of the intervals of ``matrices``: chi-square for variances, normal for others.

        The upper end of a variance is at least the normal one.
        """
        probability = 0.5 + 0.5 * level
        reach = norm.ppf(probability) * self.stderr
        low, high = self.matrices - reach, self.matrices + reach
        place = np.arange(len(self.names))
        own, error = self.matrices[:, place, place], self.stderr[:, place, place]
        dof = np.maximum(2.0 * (own / error) ** 2, tuning.LEAST_SHARED_DOF)
        low[:, place, place] = dof * own / chi2.ppf(probability, dof)
        upper = dof * own / chi2.ppf(1.0 - probability, dof)
        high[:, place, place] = np.maximum(high[:, place, place], upper)
        return low, high

    def matrix(self, growth: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sum of the matrices with weights, (p, p), and the covariance of its elements a <= b.

        growth: (K,), e.g. variance of an integral of each part.
        """
        total = np.einsum("k,kab->ab", growth, self.matrices)
        pairs = len(self.covariance) // len(self.parts)
        parts = self.covariance.reshape(len(growth), pairs, len(growth), pairs)
        return total, np.einsum("k,kplq,l->pq", growth, parts, growth)


def fit_shared(
    parts: Sequence[Process], data: WaveletCovariance, *, refine: bool = True
) -> SharedFit:
    """Fit the matrices of parts, and their correlation times, to wavelet covariances.

    parts: Of the shapes where the search starts; all but correlation times are kept.
    refine: Whether correlation times are fitted; else they are kept too.
    Raises InputError if there are no parts, two have one shape, or a channel has the samples of
        another.
    """
    kinds = [type(part) for part in parts if not part.is_exponential]
    if not parts or len(set(kinds)) < len(kinds):
        raise InputError("give each part once, such as [WhiteNoise(1), RandomWalk(1)]")
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
    moving = [k for k, part in enumerate(parts) if part.is_exponential and refine]
    # Of independent channels of white coefficients, for the first round.
    fewest = np.maximum(data.n * data.block * data.dt / (2.0 * data.tau), 1.0)
    root = np.diag(np.tile(usual / np.sqrt(fewest), first.size))
    form = None
    matrices = np.zeros((len(parts), p, p))
    for turn in range(tuning.SHARED_ROUNDS if moving else tuning.KEPT_ROUNDS):
        curves = np.stack([part.haar_variance(data.tau, data.dt) for part in parts])
        sizes = np.max(curves / usual, axis=1)
        columns = np.einsum("kj,pq->pjkq", curves / sizes[:, None], np.eye(first.size))
        columns = columns.reshape(unit.size, -1)
        if turn:
            form = data.form([part.psd for part in parts]) if form is None or moving else form
            covariance = data.covariance_under(form, matrices) / np.outer(unit, unit)
            root = np.linalg.cholesky(covariance)
        if turn and moving:
            slopes = (matrices[moving][:, first, second] / scales)[:, :, None]
            slopes = slopes * _slopes(parts, moving, data)[:, None, :]
            columns = np.hstack([columns, slopes.reshape(len(moving), -1).T])
        whitened = solve_triangular(root, np.column_stack([columns, goal]), lower=True)
        design = whitened[:, :-1]
        information = design.T @ design
        x = cone_least_squares(information, design.T @ whitened[:, -1], len(parts), p)
        kept = len(parts) * first.size
        found = x[:kept].reshape(len(parts), -1) * scales / sizes[:, None]
        matrices[:, first, second] = matrices[:, second, first] = found
        if turn:
            step = np.clip(x[kept:], -tuning.SHARED_STEP, tuning.SHARED_STEP)
            parts = _moved(parts, moving, step)
    # Without the bounds of the cones, near which it is too large: with them it is too small.
    spread = np.linalg.pinv(information, rcond=1e-13, hermitian=True)[:kept, :kept]
    sized = (scales / sizes[:, None]).ravel()
    return SharedFit(data.names, tuple(parts), matrices, spread * np.outer(sized, sized))


def _slopes(parts: Sequence[Process], moving: Sequence[int], data: WaveletCovariance) -> FloatArray:
    """Derivatives of curves by the logarithms of correlation times, (r, J)."""
    h = 1e-4
    ends = [_moved(parts, moving, np.full(len(moving), each)) for each in (-h, h)]
    low, high = (
        np.stack([end[k].haar_variance(data.tau, data.dt) for k in moving]) for end in ends
    )
    return (high - low) / (2.0 * h)


def _moved(
    parts: Sequence[Process], moving: Sequence[int], move: FloatArray
) -> tuple[Process, ...]:
    """Parts whose correlation times are moved by so much in their logarithms."""
    found = list(parts)
    for k, by in zip(moving, move, strict=True):
        found[k] = parts[k].with_values(tau=float(parts[k].values["tau"] or 1.0) * np.exp(by))
    return tuple(found)


def cone_least_squares(
    information: FloatArray, target: FloatArray, count: int, size: int
) -> FloatArray:
    """Minimize x' H x / 2 - t' x where parts of x are positive semidefinite matrices.

    By Newton's method with a logarithmic barrier (Boyd & Vandenberghe 2004, *Convex Optimization*,
    ch. 11), in coordinates in which each matrix L L' moves by L Z L'.

    information, target: H and t, in units of the order of one matrix element.
    count, size: x begins with the elements a <= b of so many matrices, of so many rows; what
        follows is free.
    """
    first, second = np.triu_indices(size)
    pairs, ends = first.size, count * first.size
    spread = np.zeros((size, size, pairs))
    spread[first, second, np.arange(pairs)] = spread[second, first, np.arange(pairs)] = 1.0
    identity, square = np.eye(size)[first, second], np.einsum("abp,abq->pq", spread, spread)
    barrier = np.zeros_like(information)
    barrier[:ends, :ends] = np.kron(np.eye(count), square)
    x = np.zeros(target.size)
    x[:ends] = np.tile(identity / count, count)
    weight = max(float(np.trace(information)) / target.size, 1.0)
    for _ in range(tuning.CONE_STEPS):
        roots = np.linalg.cholesky(np.einsum("kp,abp->kab", x[:ends].reshape(-1, pairs), spread))
        turned = np.eye(target.size)
        for k, root in enumerate(roots):
            at = slice(k * pairs, (k + 1) * pairs)
            moved = np.einsum("ac,cdp,bd->abp", root, spread, root)
            turned[at, at] = moved[first, second]
        gradient = turned.T @ (information @ x - target)
        gradient[:ends] -= weight * np.tile(identity, count)
        curvature = turned.T @ information @ turned + weight * barrier
        step = -np.linalg.solve(curvature, gradient)
        change = np.einsum("kp,abp->kab", step[:ends].reshape(-1, pairs), spread)
        worst = float(np.min(np.linalg.eigvalsh(change)))
        x = x + min(1.0, -0.95 / min(worst, -1e-300)) * (turned @ step)
        if -gradient @ step < weight:
            if weight * count * size < tuning.CONE_GAP:
                break
            weight *= 0.1
    return x
