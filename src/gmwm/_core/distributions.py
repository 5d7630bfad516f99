"""Distributions of the statistics that are tested, from special functions.

`scipy.stats` has them too; importing it takes most of a second and 40 MB.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import special


class _Normal:
    """Standard normal."""

    def cdf(self, x: Any) -> Any:
        return special.ndtr(x)

    def sf(self, x: Any) -> Any:
        return special.ndtr(-x)

    def ppf(self, p: Any) -> Any:
        return special.ndtri(p)

    def isf(self, p: Any) -> Any:
        return -special.ndtri(p)


class _ChiSquare:
    def cdf(self, x: Any, dof: Any) -> Any:
        return special.chdtr(dof, np.maximum(x, 0.0))

    def sf(self, x: Any, dof: Any) -> Any:
        return special.chdtrc(dof, np.maximum(x, 0.0))

    def ppf(self, p: Any, dof: Any) -> Any:
        return 2.0 * special.gammaincinv(0.5 * dof, p)

    def isf(self, p: Any, dof: Any) -> Any:
        return special.chdtri(dof, p)


class _Student:
    def sf(self, x: Any, dof: Any) -> Any:
        return special.stdtr(dof, -x)

    def ppf(self, p: Any, dof: Any) -> Any:
        return special.stdtrit(dof, p)

    def isf(self, p: Any, dof: Any) -> Any:
        return -special.stdtrit(dof, p)


class _Fisher:
    def isf(self, p: Any, dof: Any, dof_below: Any) -> Any:
        # Each part of the sum by itself, so that neither loses digits; fdtri of scipy 1.15 is off
        # by up to seven powers of ten.
        below = special.betaincinv(0.5 * dof_below, 0.5 * dof, p)
        above = special.betainccinv(0.5 * dof, 0.5 * dof_below, p)
        return dof_below * above / (dof * below)


class _Binomial:
    def sf(self, k: Any, n: int, p: Any) -> Any:
        return special.bdtrc(k, n, p)


class _GeneralizedNormal:
    """Of density exp(-|x|^shape), up to its factor."""

    def sf(self, x: Any, shape: Any) -> Any:
        """At x >= 0."""
        return 0.5 * special.gammaincc(1.0 / shape, x**shape)


norm, chi2, student, fisher = _Normal(), _ChiSquare(), _Student(), _Fisher()
binom, gennorm = _Binomial(), _GeneralizedNormal()
