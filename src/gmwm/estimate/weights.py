"""The weight matrix Omega of the method of moments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.profile import weight_root
from gmwm.variance.wavelet import WaveletVariance

OMEGAS = ("model", "data", "diagonal", "identity")


@dataclass(frozen=True, eq=False)
class Weights:
    """A choice of Omega.

    Attributes
    ----------
    omega : str
        One of `OMEGAS`.
    of_data : (J, J) ndarray or None
        Covariance estimated from the coefficients, for "data".
    """

    omega: str
    of_data: FloatArray | None = None

    @classmethod
    def of(cls, omega: str, wv: WaveletVariance) -> Weights:
        """Weights for these wavelet variances.

        Raises
        ------
        InputError
            If ``omega`` is unknown, or "data" and they come without a covariance of their own.
        """
        if omega not in OMEGAS:
            raise InputError(f"omega = {omega!r}: known are {', '.join(OMEGAS)}")
        if omega == "data" and wv.data_covariance is None:
            raise InputError(
                'omega = "data" needs the covariance estimated from the coefficients: make the '
                'wavelet variance with data_covariance="octave"'
            )
        return cls(omega, wv.data_covariance if omega == "data" else None)

    def root(self, covariance: FloatArray) -> FloatArray:
        """L with L'L the weight matrix, (J, J).

        Parameters
        ----------
        covariance : (J, J) ndarray
            Of the moments under the fitted model, u^4.
        """
        if self.of_data is not None:
            return weight_root(self.of_data)
        if self.omega == "model":
            return weight_root(covariance)
        variances = np.diag(covariance)
        if self.omega == "diagonal":
            return np.diag(1.0 / np.sqrt(variances))
        return np.eye(variances.size) / np.sqrt(np.max(variances))
