"""Kalman filter and smoother of one series, compiled.

The state-space form is ``y[k] = h' x[k] + v[k]``, ``x[k+1] = F x[k] + w[k]`` with ``x[0]`` of
covariance P0 (`gmwm.StateSpace`). Several columns Y (n, m) are filtered at once with the same
gains: the series, and regressors (a constant, a ramp) whose coefficients are profiled out
afterwards (Rosenberg 1973, *Annals of Economic and Social Measurement* 2, 399-428; de Jong 1991,
*Annals of Statistics* 19, 1073-1083). A NaN in the first column is a missing sample.
"""

import math
from typing import NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray

_STEADY = 1e-13  # relative change of the predicted covariance from sample to sample


class Space(NamedTuple):
    """The arrays of a state space.

    F, Q, P0: (p, p), transition, covariance of w, initial covariance.
    h: (p,), output.
    r: Variance of v.
    """

    F: FloatArray
    Q: FloatArray
    h: FloatArray
    r: float
    P0: FloatArray


class Filtered(NamedTuple):
    """One-step predictions of each column, and what the smoother needs of the filter.

    states: (n, m, p), predicted.
    covariances: (n, p, p), of the predicted states.
    gains: (n, p), F P h / s.
    innovations: (n, m).
    variances: (n,), of the innovations, infinite where the sample is missing.
    """

    states: FloatArray
    covariances: FloatArray
    gains: FloatArray
    innovations: FloatArray
    variances: FloatArray


@compiled()
def _innovation(P: FloatArray, h: FloatArray, r: float, Ph: FloatArray) -> float:
    """Variance of the innovation; ``Ph`` receives P h."""
    s = r
    for i in range(h.size):
        Ph[i] = 0.0
        for j in range(h.size):
            Ph[i] += P[i, j] * h[j]
        s += h[i] * Ph[i]
    return s


@compiled()
def _times(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """``out`` receives a b: of matrices this small, faster than BLAS."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            value = 0.0
            for q in range(b.shape[0]):
                value += a[i, q] * b[q, j]
            out[i, j] = value


@compiled()
def _propagate(
    F: FloatArray, Q: FloatArray, P: FloatArray, half: FloatArray, new: FloatArray
) -> None:
    """``new`` receives F P F' + Q."""
    _times(F, P, half)
    for i in range(F.shape[0]):
        for j in range(i + 1):
            value = Q[i, j]
            for q in range(F.shape[0]):
                value += half[i, q] * F[j, q]
            new[i, j] = value
            new[j, i] = value


@compiled()
def whiten(space: Space, Y: FloatArray) -> tuple[FloatArray, float, int]:
    """Innovations of the columns of ``Y`` (n, m) over their standard deviation.

    Returns them with zero rows for missing samples, the sum of the logarithms of the innovation
    variances, and the number of samples. Once the predicted covariance has settled, the gain is
    kept until a sample is missing.
    """
    F, Q, h, r, P0 = space
    n, m = Y.shape
    p = h.size
    E, x, P = np.zeros((n, m)), np.zeros((m, p)), P0.copy()
    updated, half = np.zeros((p, p)), np.zeros((p, p))
    ahead, before, Ph, gain = np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p)
    total, count, steady, root, log_s = 0.0, 0, False, 1.0, 0.0
    for k in range(n):
        missing = math.isnan(Y[k, 0])
        if not (missing or steady):
            s = _innovation(P, h, r, Ph)
            for i in range(p):
                gain[i] = Ph[i] / s
            root = math.sqrt(s)
            log_s = math.log(s)
        if not missing:
            total += log_s
            count += 1
        for c in range(m):
            if not missing:
                v = Y[k, c]
                for i in range(p):
                    v -= h[i] * x[c, i]
                E[k, c] = v / root
                for i in range(p):
                    x[c, i] += gain[i] * v
            for i in range(p):
                ahead[i] = 0.0
                for j in range(p):
                    ahead[i] += F[i, j] * x[c, j]
            for i in range(p):
                x[c, i] = ahead[i]
        if missing or not steady:
            for i in range(p):
                before[i] = P[i, i]
                for j in range(p):
                    updated[i, j] = P[i, j] if missing else P[i, j] - gain[i] * Ph[j]
            steady = not missing
            _propagate(F, Q, updated, half, P)
            for i in range(p):
                if abs(P[i, i] - before[i]) > _STEADY * P[i, i]:
                    steady = False
    return E, total, count


@compiled()
def filtered(space: Space, Y: FloatArray, A0: FloatArray, U: FloatArray) -> Filtered:
    """Filter columns with initial mean ``A0`` (m, p) and constant input ``U`` (m, p) of each."""
    F, Q, h, r, P0 = space
    n, m = Y.shape
    p = h.size
    X, PP, G = np.zeros((n, m, p)), np.zeros((n, p, p)), np.zeros((n, p))
    V, S = np.zeros((n, m)), np.zeros(n)
    P, x = P0.copy(), A0.copy()
    updated, half, Ph = np.zeros((p, p)), np.zeros((p, p)), np.zeros(p)
    for k in range(n):
        missing = math.isnan(Y[k, 0])
        S[k] = s = math.inf if missing else _innovation(P, h, r, Ph)
        for i in range(p):
            for j in range(p):
                PP[k, i, j] = P[i, j]
                updated[i, j] = P[i, j] if missing else P[i, j] - Ph[i] * Ph[j] / s
                G[k, i] += 0.0 if missing else F[i, j] * Ph[j] / s
        for c in range(m):
            V[k, c] = 0.0 if missing else Y[k, c]
            for i in range(p):
                X[k, c, i] = x[c, i]
                V[k, c] -= 0.0 if missing else h[i] * x[c, i]
            for i in range(p):
                x[c, i] = U[c, i] + G[k, i] * V[k, c]
                for j in range(p):
                    x[c, i] += F[i, j] * X[k, c, j]
        _propagate(F, Q, updated, half, P)
    return Filtered(X, PP, G, V, S)


@compiled()
def smooth(
    space: Space, Y: FloatArray, A0: FloatArray, U: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Smoothed states given all samples, with their covariances at lags zero and one.

    The backward recursion of de Jong (1989, *JASA* 84, 1085-1088) gives the result of Rauch, Tung
    and Striebel's without inverting a covariance.

    Y, A0, U: As of `filtered`.
    Returns: X (n, m, p), smoothed states of each column; C (n, p, p), their covariance; D (n - 1,
        p, p), covariance of state k+1 with state k; V, S, innovations and their variances.
    """
    F, h = space.F, space.h
    n, m = Y.shape
    p = h.size
    X, C, G, V, S = filtered(space, Y, A0, U)
    D = np.zeros((max(n - 1, 0), p, p))
    R, back = np.zeros((m, p)), np.zeros(p)
    N, L, later = np.zeros((p, p)), np.zeros((p, p)), np.zeros((p, p))
    left, right = np.zeros((p, p)), np.zeros((p, p))
    for k in range(n - 1, -1, -1):
        predicted = C[k]
        for i in range(p):
            for j in range(p):
                L[i, j] = F[i, j] - G[k, i] * h[j]
        if k < n - 1:  # (1 - P[k + 1] N) L P[k]
            _times(L, predicted, right)
            _times(later, N, left)
            for i in range(p):
                for j in range(p):
                    left[i, j] = (i == j) - left[i, j]
            _times(left, right, D[k])
        for c in range(m):
            for i in range(p):
                back[i] = h[i] * V[k, c] / S[k]
                for j in range(p):
                    back[i] += L[j, i] * R[c, j]
            for i in range(p):
                R[c, i] = back[i]
                for j in range(p):
                    X[k, c, i] += predicted[i, j] * back[j]
        _times(N, L, right)
        for i in range(p):
            for j in range(p):
                N[i, j] = h[i] * h[j] / S[k]
                for q in range(p):
                    N[i, j] += L[q, i] * right[q, j]
        _times(predicted, N, left)
        _times(left, predicted, right)
        for i in range(p):
            for j in range(p):
                later[i, j] = predicted[i, j]
                predicted[i, j] -= right[i, j]
    return X, C, D, V, S


class Recursion(NamedTuple):
    """Transition (p, p), output (p,), gains (n, p) and variances (n,) of a filter; or, with a first
    axis of length d more, their derivatives.
    """

    F: FloatArray
    h: FloatArray
    G: FloatArray
    s: FloatArray


@compiled()
def accumulated(at: Recursion, by: Recursion) -> FloatArray:
    """Information (d, d) of d parameters, from a filter and its derivatives.

    The predicted state and its d derivatives follow one linear system driven by the innovations;
    its covariance is propagated.
    """
    F, h, G, s = at
    dF, dh, dG, ds = by
    n, p = G.shape
    d = dF.shape[0]
    size = p * (1 + d)
    information = np.zeros((d, d))
    A, P, noise = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size))
    half, b = np.zeros((size, size)), np.zeros(size)
    rows, known = np.zeros((d, size)), np.zeros((d, size))  # d v of each over the joint state
    for i in range(p):
        for j in range(p):
            A[i, j] = F[i, j]
        for m in range(d):
            rows[m, i], rows[m, p * (1 + m) + i] = -dh[m, i], -h[i]
    for k in range(n):
        _times(rows, P, known)
        for i in range(d):
            for j in range(d):
                moved = 0.5 * ds[i, k] * ds[j, k] / s[k]
                for q in range(size):
                    moved += known[i, q] * rows[j, q]
                information[i, j] += moved / s[k]
        for i in range(p):
            b[i] = G[k, i]
            for m in range(d):
                own = p * (1 + m)
                b[own + i] = dG[m, k, i]
                for j in range(p):
                    A[own + i, j] = dF[m, i, j] - G[k, i] * dh[m, j]
                    A[own + i, own + j] = F[i, j] - G[k, i] * h[j]
        for i in range(size):
            for j in range(size):
                noise[i, j] = s[k] * b[i] * b[j]
        _propagate(A, noise, P, half, P)
    return information
