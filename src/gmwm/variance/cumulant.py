"""Heavy tails: the fourth cumulant of the independent part of a series."""

from __future__ import annotations

import numpy as np

from gmwm.variance import tuning


def cumulant_of_powers(square: float, fourth: float, count: float) -> float:
    """Of the independent part of a series, u^4; 0 if not above chance.

    Cumulants of independent samples add up, so that first differences have twice that of the
    samples.

    Parameters
    ----------
    square, fourth : float
        Mean second and fourth power of the first differences, u^2 and u^4.
    count : float
        Number of the first differences.
    """
    excess = fourth / square**2 - 3.0 if square > 0.0 else 0.0
    chance = tuning.LARGEST_KURTOSIS * np.sqrt(tuning.KURTOSIS_VARIANCE / count)
    return 0.5 * square**2 * excess if excess > chance else 0.0
