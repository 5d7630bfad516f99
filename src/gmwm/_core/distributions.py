"""Distributions of the statistics that are tested, from special functions.

`scipy.stats` has them too; importing it takes most of a second and 40 MB.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy import special


def _fisher_isf(p: Any, dof: Any, dof_below: Any) -> Any:
    # Each part of the sum by itself, so that neither loses digits; fdtri of scipy 1.15 is off by up
    # to seven powers of ten.
    below = special.betaincinv(0.5 * dof_below, 0.5 * dof, p)
    above = special.betainccinv(0.5 * dof, 0.5 * dof_below, p)
    return dof_below * above / (dof * below)


norm = SimpleNamespace(
    cdf=special.ndtr,
    sf=lambda x: special.ndtr(-x),
    ppf=special.ndtri,
    isf=lambda p: -special.ndtri(p),
)
chi2 = SimpleNamespace(
    cdf=lambda x, dof: special.chdtr(dof, np.maximum(x, 0.0)),
    sf=lambda x, dof: special.chdtrc(dof, np.maximum(x, 0.0)),
    ppf=lambda p, dof: 2.0 * special.gammaincinv(0.5 * dof, p),
    isf=lambda p, dof: special.chdtri(dof, p),
)
student = SimpleNamespace(
    sf=lambda x, dof: special.stdtr(dof, -x),
    ppf=lambda p, dof: special.stdtrit(dof, p),
    isf=lambda p, dof: -special.stdtrit(dof, p),
)
fisher = SimpleNamespace(isf=_fisher_isf)
binom = SimpleNamespace(sf=lambda k, n, p: special.bdtrc(k, n, p))
gennorm = SimpleNamespace(
    sf=lambda x, shape: 0.5 * special.gammaincc(1.0 / shape, x**shape),
    isf=lambda p, shape: special.gammainccinv(1.0 / shape, 2.0 * p) ** (1.0 / shape),
)
"""Density exp(-|x|^shape) up to its factor, at x >= 0."""
