"""Non-negative least squares of a few columns, many times over (Lawson & Hanson 1974, ch. 23)."""

import numpy as np
from scipy.optimize import nnls

from gmwm._core.typing import FloatArray

_DEPENDENT = 1e-12  # of a column: what is left of it beside those it depends on
_ROUNDING = 1e-12  # of |y|: a correlation with the residuals that is none
_ROUNDS = 100  # a column, beyond which the search cycles


def solve_nonnegative(columns: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (k,) of columns (J, k) that come nearest to y (J,), and the residuals (J,)."""
    count = columns.shape[1]
    if count == 0:
        return np.zeros(0), np.array(y)
    length = _lengths(columns)
    unit = columns / length
    x, _ = nnls(unit, y, maxiter=_ROUNDS * count)
    return x / length, y - unit @ x


def objectives_with(columns: FloatArray, candidates: FloatArray, y: FloatArray) -> FloatArray:
    """Sums of squares (G,) of y (J,) that each candidate (J, G) leaves beside columns (J, k).

    A candidate takes from the columns what it shares with them. Where one of these would become
    negative, or one that is zero would gain, the problem is solved anew.
    """
    columns, candidates = columns / _lengths(columns), candidates / _lengths(candidates)
    x, residual = solve_nonnegative(columns, y)
    present = x > 0.0
    shared = np.linalg.lstsq(columns[:, present], candidates, rcond=_DEPENDENT)[0]
    own = candidates - columns[:, present] @ shared
    square = np.einsum("ij,ij->j", own, own)
    gaining = (residual @ own > 0.0) & (square > _DEPENDENT**2)
    amplitude = np.where(gaining, residual @ own, 0.0) / np.where(gaining, square, 1.0)
    result = residual @ residual - amplitude**2 * square
    is_negative = np.any(shared * amplitude > x[present, None], axis=0)
    slopes = columns[:, ~present].T @ (residual[:, None] - own * amplitude)
    would_gain = np.any(slopes > _ROUNDING * np.sqrt(y @ y), axis=0)
    for g in np.flatnonzero(gaining & (is_negative | would_gain)):
        left = solve_nonnegative(np.column_stack([columns, candidates[:, g]]), y)[1]
        result[g] = left @ left
    return np.asarray(result)


def orthogonal_to(columns: FloatArray, others: FloatArray) -> FloatArray:
    """What of some columns is orthogonal to others, (J, k) and (J, l)."""
    basis, _ = np.linalg.qr(others)
    return np.asarray(columns - basis @ (basis.T @ columns))


def _lengths(columns: FloatArray) -> FloatArray:
    """Lengths of columns, 1 in place of 0."""
    length = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    length[length == 0.0] = 1.0
    return length
