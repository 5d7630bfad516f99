"""Tolerance limits: what holds for most units when only some were measured."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.stats import binom, chi2, nct, ncx2, norm

from gmwm.population.tuning import CONFIDENCE, CONTENT

_NODES = 80  # of the quadrature over the error of the mean: seven digits


@lru_cache
def one_sided_factor(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> float:
    """Factor k of the upper limit ``mean + k * sd`` of normal units.

    n: Units measured, 2 or more.
    content, confidence: With this confidence, this fraction of all units is below the limit.

    Exact, by the noncentral t distribution (ISO 16269-6:2014; Krishnamoorthy and Mathew,
    *Statistical Tolerance Regions*, 2009, (2.2.3)).
    """
    shift = np.sqrt(n) * norm.ppf(content)
    return float(nct.ppf(confidence, n - 1, shift) / np.sqrt(n))


@lru_cache
def two_sided_factor(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> float:
    """Factor k of the interval ``mean - k * sd`` to ``mean + k * sd``; see `one_sided_factor`.

    Exact: the probability that the sample's standard deviation is large enough, averaged over the
    error of its mean (Krishnamoorthy and Mathew, (2.3.4)). The search starts at the approximation
    of Howe, J. Am. Stat. Assoc. 64, 1969.
    """
    dof = n - 1
    howe = norm.ppf(0.5 + 0.5 * content) * np.sqrt(
        dof * (1 + 1 / n) / chi2.ppf(1 - confidence, dof)
    )
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    error = 4.0 * (1.0 + nodes) / np.sqrt(n)  # of the mean, from zero to eight standard errors
    weights = 8.0 * weights * norm.pdf(error * np.sqrt(n))
    needed = ncx2.ppf(content, 1, error**2)

    def shortfall(factor: float) -> float:
        return float(weights @ chi2.sf(dof * needed / factor**2, dof)) - confidence

    return float(brentq(shortfall, 0.8 * howe, 1.2 * howe, xtol=1e-6 * howe))


def rank_of_limit(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> int | None:
    """Rank, from the largest as 1, of the value that is an upper limit for any distribution.

    ``None`` if there are too few units: 95 % with 95 % confidence takes 59. The r-th largest value
    is above the quantile ``content`` unless more than ``n - r`` are below it (Wilks, Ann. Math.
    Stat. 12, 1941).
    """
    ranks = np.arange(1, n + 1)
    good = ranks[binom.cdf(n - ranks, n, content) >= confidence]
    return int(good[-1]) if good.size else None


def rank_of_limits(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> int | None:
    """Rank r of the interval from the r-th smallest to the r-th largest: it takes 93 units."""
    ranks = np.arange(1, (n + 1) // 2 + 1)
    good = ranks[(n > 1) & (binom.cdf(n - 2 * ranks, n, content) >= confidence)]
    return int(good[-1]) if good.size else None


def content_of_largest(n: int, confidence: float = CONFIDENCE) -> float:
    """Fraction of all units that the largest of ``n`` values is a limit for."""
    return float((1.0 - confidence) ** (1.0 / n))


def needed_units(content: float = CONTENT, confidence: float = CONFIDENCE) -> int:
    """Number of units whose largest value is a limit for any distribution."""
    return int(np.ceil(np.log(1.0 - confidence) / np.log(content)))
