"""Linear programs of two to four variables under hundreds of constraints, many at once.

The dual of such a program has as many rows as variables, so the revised simplex method on it costs
one product with the matrix of constraints and the inverse of a few numbers a step. A general solver
takes far longer, mostly to set up, and keeps to constraints to 1e-7 only.
"""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray

_STEPS = 500
_UNTIL_FIRST = 100  # then the first candidate enters, not the best: it ends cycles
_TOLERANCE = 1e-13


def least_sum(rows: FloatArray, least: FloatArray) -> FloatArray:
    """The x of least sum with ``rows @ x >= 1`` and ``x >= least``.

    Parameters
    ----------
    rows : (b, n, m) ndarray
        Of b programs; not negative.
    least : (m,) ndarray
        Not negative.

    Returns
    -------
    (b, m) ndarray
        NaN where there is none.

    Notes
    -----
    With x = least + y and the rest r = 1 - rows @ least the dual is to maximise r @ u over u >= 0
    with rows^T u <= 1, for which u = 0 is a start. The prices of a basis are y; the constraint that
    they miss most enters it (Dantzig 1963, *Linear Programming and Extensions*, chapter 9).
    """
    b, n, m = rows.shape
    scale = np.max(rows, axis=2)
    usable = np.all(np.isfinite(scale) & (scale > 0.0), axis=1)
    scale[~usable] = 1.0
    # Those of slack variables come after the constraints.
    columns = np.concatenate(
        [
            np.where(usable[:, None, None], rows, 1.0) / scale[:, :, None],
            np.broadcast_to(np.eye(m), (b, m, m)),
        ],
        axis=1,
    )
    weight = np.concatenate([scale, np.ones((b, m))], axis=1)
    gains = np.concatenate([(1.0 - rows @ least) / scale, np.zeros((b, m))], axis=1)
    basis = np.tile(np.arange(n, n + m), (b, 1))
    each = np.arange(b)
    for step in range(_STEPS):
        inverse = np.linalg.inv(np.swapaxes(columns[each[:, None], basis], 1, 2))
        prices = (gains[each[:, None], basis][:, None, :] @ inverse)[:, 0]
        missed = weight * (gains - (columns @ prices[:, :, None])[:, :, 0])
        missed[:, n:] /= np.maximum(np.max(prices, axis=1), np.finfo(float).tiny)[:, None]
        missed[each[:, None], basis] = 0.0
        is_missed = missed > _TOLERANCE
        best = np.argmax(missed if step < _UNTIL_FIRST else is_missed, axis=1)
        going = usable & is_missed[each, best]
        if not np.any(going):
            break
        change = (inverse @ columns[each, best][:, :, None])[:, :, 0]
        ratios = np.full((b, m), np.inf)
        np.divide(np.sum(inverse, axis=2), change, out=ratios, where=change > _TOLERANCE)
        leaving = np.argmin(ratios, axis=1)
        usable &= ~going | np.isfinite(ratios[each, leaving])
        going &= usable
        basis[each[going], leaving[going]] = best[going]
    else:
        usable &= ~going
    return np.where(usable[:, None], least + np.maximum(prices, 0.0), np.nan)
