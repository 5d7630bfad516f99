"""The weight matrix Omega of the method of moments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.problem import weight_root
from gmwm.variance import WaveletVariance

WEIGHTS = ("model", "data", "diagonal", "identity")


@dataclass(frozen=True, eq=False)
class Weights:
    """A choice of Omega.

    name: One of `WEIGHTS`.
    of_data: (J, J) or None, covariance estimated from the coefficients, for "data".
    """

    name: str
    of_data: FloatArray | None = None

    @classmethod
    def of(cls, name: str, wv: WaveletVariance) -> Weights:
        """Weights for these wavelet variances.

        Raises InputError if they are "data" and the variances come without a covariance of their
            own.
        """
        if name == "data" and wv.data_covariance is None:
            raise InputError(
                'weights = "data" needs the covariance estimated from the coefficients: make the '
                'wavelet variance with data_covariance="octave"'
            )
        return cls(name, wv.data_covariance if name == "data" else None)

    def root(self, covariance: FloatArray) -> FloatArray:
        """L with L'L the weight matrix, (J, J).

        covariance: (J, J), of the moments under the fitted model, u^4.
        """
        if self.of_data is not None:
            return weight_root(self.of_data)
        if self.name == "model":
            return weight_root(covariance)
        variances = np.diag(covariance)
        if self.name == "diagonal":
            return np.diag(1.0 / np.sqrt(variances))
        return np.eye(variances.size) / np.sqrt(np.max(variances))
