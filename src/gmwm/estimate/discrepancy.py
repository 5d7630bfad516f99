"""Model discrepancy: what is granted to a model that fails the chi-square test.

With a million samples the fine levels are known to a tenth of a per cent, and no sum of textbook
processes is that exact. A fit that chases them lets go of the long averaging times, which are what
navigation feels. So, where the test fails, the covariance of the wavelet variances gains a relative
discrepancy, ``Sigma + delta^2 diag(nu_hat^2)``, with delta such that the weighted sum of squares
equals its degrees of freedom (the moment estimator of a random effect, DerSimonian & Laird 1986,
*Controlled Clinical Trials* 7, 177-188). It stays zero where the model is right.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from gmwm._typing import FloatArray
from gmwm.estimate.profile import weight_root

_SIGNIFICANT = 0.001
_NOT_SMALL = 0.02
_SETTLED = 1e-3  # relative change of delta


def chi_square(
    target: FloatArray, implied: FloatArray, covariance: FloatArray, basis: FloatArray
) -> tuple[FloatArray, float]:
    """Standardised residuals per level and their chi-square, on the cube-root scale.

    ``basis`` (J,) are the wavelet variances to which ``covariance`` belongs. A wavelet variance of few degrees of freedom is far from normal, its cube root is not (Wilson
    & Hilferty 1931, *PNAS* 17, 684-688).
    """
    scale = np.sqrt(np.diag(covariance))
    share = (scale / basis) ** 2 / 9.0  # 2/(9 dof)
    root, expected = np.cbrt(target / basis), np.cbrt(implied / basis) * (1.0 - share)
    standard = (root - expected) / np.sqrt(share)
    whitened = weight_root(covariance / np.outer(scale, scale)) @ standard
    return standard, float(whitened @ whitened)


class Discrepancy:
    """The level of discrepancy while a fit is iterated.

    Parameters
    ----------
    given : float or None
        Fixed value; ``None`` to estimate it.
    dof : int
        Degrees of freedom of the fit.
    """

    def __init__(self, given: float | None, dof: int) -> None:
        self.value = given or 0.0
        self._given = given
        self._estimated = given is None and dof > 0
        self._dof = dof

    def start_at(self, value: float) -> None:
        """Begin with a value found elsewhere, if it is to be estimated and not small.

        A small one may be that of the mixture's own grid.
        """
        if self._estimated and value > _NOT_SMALL:
            self.value = value

    def restart(self) -> None:
        """Forget what was estimated."""
        self.value = self._given or 0.0

    def added_to(self, covariance: FloatArray, target: FloatArray) -> FloatArray:
        """Covariance of the wavelet variances with the discrepancy, u^4, (J, J)."""
        return covariance + np.diag((self.value * target) ** 2)

    def update(
        self,
        residual: FloatArray,
        covariance: FloatArray,
        target: FloatArray,
        basis: FloatArray,
        dof: int | None = None,
    ) -> bool:
        """Estimate anew from residuals (J,) and their covariance; returns whether it changed.

        ``basis`` (J,) are the wavelet variances to which ``covariance`` belongs.
        """
        if not self._estimated:
            return False
        dof = dof or self._dof
        if self.value == 0.0:
            implied = target - residual
            if np.all(implied > 0.0) and np.all(basis > 0.0):
                objective = chi_square(target, implied, covariance, basis)[1]
                if chi2.sf(objective, dof) > _SIGNIFICANT:
                    return False
        before, self.value = self.value, _moment_estimate(residual, covariance, target, dof)
        return abs(self.value - before) > _SETTLED * max(self.value, before, 1e-6)


def _moment_estimate(
    residual: FloatArray, covariance: FloatArray, target: FloatArray, dof: int
) -> float:
    def excess(log_delta: float) -> float:
        root = weight_root(covariance + np.diag((np.exp(log_delta) * target) ** 2))
        whitened = root @ residual
        return float(whitened @ whitened) - dof

    low, high = np.log(1e-5), np.log(10.0)
    if excess(low) <= 0.0:
        return 0.0
    if excess(high) >= 0.0:
        return float(np.exp(high))
    return float(np.exp(brentq(excess, low, high, rtol=1e-6)))
