"""Many fixes of a chain of integrators, in compiled code."""

from __future__ import annotations

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray


@compiled()
def _propagated(P: FloatArray, A: FloatArray, Q: FloatArray) -> FloatArray:
    """A P A' + Q, symmetric: nothing damps what rounding leaves of an asymmetry.

    Loops, for a product of matrices takes numba seconds to compile.
    """
    size = P.shape[0]
    left, result = np.zeros((size, size)), Q.copy()
    for i in range(size):
        for k in range(size):
            if A[i, k] != 0.0:
                for j in range(size):
                    left[i, j] += A[i, k] * P[k, j]
    for i in range(size):
        for j in range(i + 1):
            for k in range(size):
                result[i, j] += left[i, k] * A[j, k]
            result[j, i] = result[i, j]
    return result


@compiled()
def settle(
    P: FloatArray, J: FloatArray, A: FloatArray, Q: FloatArray, B: FloatArray, R: FloatArray,
    n: int, q: int, variance: float, is_relative: bool, fixes: int,
    out_P: FloatArray, out_J: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Propagate and update by fixes of the last integral.

    P, A, Q: (n + q, n + q), the filter's covariance, its transition between fixes, its noise.
    J, B, R: (m, m), the same of the joint vector: errors of the integrals, estimates of the states,
        true states.
    n, q: Integrals, and states of the filter.
    variance: Of a fix.
    is_relative: Whether the last integral starts anew at each fix.
    out_P, out_J: (K, n, n), covariances of the integrals after the first K fixes.
    Returns: ``P`` and ``J`` after the last fix.
    """
    size, total = P.shape[0], J.shape[0]
    row, gain, first, added = np.zeros(size), np.zeros(size), np.zeros(total), np.zeros(total)
    for fix in range(fixes):
        P = _propagated(P, A, Q)
        J = _propagated(J, B, R)
        for i in range(size):
            row[i] = P[i, n - 1]
            gain[i] = row[i] / (P[n - 1, n - 1] + variance)
        for i in range(size):
            for j in range(size):
                P[i, j] -= 0.5 * (gain[i] * row[j] + row[i] * gain[j])
        # Feedback: the integrals are corrected, and the estimates take what their errors lose.
        for i in range(n):
            added[i] = -gain[i]
        for i in range(n, n + q):
            added[i] = gain[i]
        for i in range(total):
            first[i] = J[i, n - 1]
        own = first[n - 1] + variance
        for i in range(total):
            for j in range(total):
                J[i, j] += added[i] * first[j] + first[i] * added[j] + own * added[i] * added[j]
        if is_relative:
            for i in range(size):
                P[n - 1, i] = P[i, n - 1] = 0.0
            for i in range(total):
                J[n - 1, i] = J[i, n - 1] = 0.0
        if fix < out_P.shape[0]:
            for i in range(n):
                for j in range(n):
                    out_P[fix, i, j], out_J[fix, i, j] = P[i, j], J[i, j]
    return P, J
