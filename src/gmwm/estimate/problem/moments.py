"""The moments that a model is fitted to: wavelet variances, the slope of a ramp, their covariance.

They depend on the model through the ramp (its slope is removed from the data) and through the
noise (which implies the covariance).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.estimate.problem.parameters import drift_key
from gmwm.estimate.problem.ramp import (
    Slope,
    bias_of_detrending,
    detrended_covariance,
    gls_slope,
    ols_slope,
)
from gmwm.estimate.problem.scales import Scales
from gmwm.process import PSD, Model
from gmwm.variance import WaveletVariance


@dataclass(frozen=True, eq=False)
class Moments:
    """The moments of a series, given what is known of its ramp.

    slope: Drift removed from the wavelet variances, ``None`` where the model has no ramp.
    slope_is_free: Whether it is estimated (rather than given).
    """

    wv: WaveletVariance
    slope: Slope | None
    slope_is_free: bool
    scales: Scales

    @classmethod
    def of(cls, wv: WaveletVariance, model: Model, scales: Scales | None = None) -> Moments:
        """Moments before a first fit, with a least-squares slope where the model has a ramp."""
        scales = scales or Scales.of(wv)
        ramp = next((term for term in model.terms if term.is_drift), None)
        if ramp is None:
            return cls(wv, None, False, scales)
        if not ramp.is_open:
            return cls(wv, Slope(ramp.drift_rate(), 0.0), False, scales)
        return cls(wv, ols_slope(wv), True, scales)

    @property
    def target(self) -> FloatArray:
        """Wavelet variances of the noise alone, u^2, (J,): the drift is removed, the loss added."""
        if self.slope is None:
            return self.wv.variance
        return self.wv.detrended(self.slope.value) + bias_of_detrending(self.wv, self.slope)

    def under(self, noise: Model, part: float = 1.0) -> Moments:
        """The moments with the slope moved by ``part`` of the way to its estimate under a noise."""
        if self.slope is None or not self.slope_is_free:
            return self
        psd = self.scales.spectrum(noise)
        if not _has_power(psd, self.wv.dt):
            return self
        new, old = gls_slope(self.wv, psd), self.slope
        moved = Slope(
            (1.0 - part) * old.value + part * new.value,
            (1.0 - part) * old.variance + part * new.variance,
        )
        return replace(self, slope=moved)

    def covariance(self, noise: Model) -> FloatArray:
        """Covariance of `target` that a noise implies, u^4, (J, J)."""
        wv = self.wv
        psd = self.scales.spectrum(noise)
        if not _has_power(psd, wv.dt):
            return wv.covariance
        covariance = wv.covariance_under(psd, noise.lines())
        if self.slope_is_free and self.slope is not None:
            means = wv.mean_covariance_under(psd)
            covariance = detrended_covariance(covariance, means, wv.drift_response, self.slope)
        if any(self.scales.is_simulated(term) for term in noise.terms):
            covariance = covariance * self.scales.simulation.inflation(wv.n_all / wv.n)
        return covariance


@dataclass(frozen=True, eq=False)
class FittedMoments:
    """The moments at a fitted model: those of the data, those of the model, their covariance.

    target: (J,), wavelet variances of the data without the drift of the model, u^2.
    implied: (J,), those of the model's noise, u^2.
    statistical: (J, J), covariance of ``target`` if the model is right, u^4.
    discrepancy: Relative error allowed for at each level.
    """

    scales: Scales
    target: FloatArray
    implied: FloatArray
    statistical: FloatArray
    discrepancy: float

    @classmethod
    def of(
        cls,
        model: Model,
        wv: WaveletVariance,
        keys: Collection[str],
        slope_error: float,
        discrepancy: float,
    ) -> FittedMoments:
        """Moments of the data at a model with values.

        keys: The parameters that were estimated.
        slope_error: Standard error of the slope of a rate ramp, u/s; 0 if it was not estimated.
        """
        drift = drift_key(model)
        noise = tuple(term for term in model.terms if not term.is_drift)
        scales = Scales.of(wv)
        moments = Moments(wv, None, False, scales)
        if drift is not None:
            slope = Slope(model.drift_rate(), slope_error**2)
            moments = Moments(wv, slope, drift in keys, scales)
        if not noise:  # straight lines of the Allan plot may leave a ramp alone
            nothing = np.zeros_like(wv.tau)
            return cls(scales, moments.target, nothing, wv.covariance, discrepancy)
        implied, statistical = scales.curve(Model(noise)), moments.covariance(Model(noise))
        return cls(scales, moments.target, implied, statistical, discrepancy)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of ``target`` with the discrepancy, u^4, (J, J)."""
        return self.statistical + np.diag((self.discrepancy * self.implied) ** 2)


def _has_power(psd: PSD, dt: float) -> bool:
    return bool(np.any(psd(np.array([1e-6, 0.01, 0.25]) / dt, dt) > 0.0))


def weight_root(covariance: FloatArray) -> FloatArray:
    """L with L'L the inverse of a covariance matrix, computed on its correlations."""
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(correlation)
    # Rounding errors must not decide the weights of levels that are nearly copies of each other.
    values = np.maximum(values, 1e-8 * values[-1])
    return np.asarray((vectors / np.sqrt(values)).T / scale)


def chi_square(
    target: FloatArray, implied: FloatArray, covariance: FloatArray, basis: FloatArray
) -> tuple[FloatArray, float]:
    """Standardised residuals per level and their chi-square, on the cube-root scale.

    ``basis`` (J,) are the wavelet variances to which ``covariance`` belongs. A wavelet variance of
    few degrees of freedom is far from normal, its cube root is not (Wilson & Hilferty 1931, *PNAS*
    17, 684-688).
    """
    scale = np.sqrt(np.diag(covariance))
    share = (scale / basis) ** 2 / 9.0  # 2/(9 dof)
    root, expected = np.cbrt(target / basis), np.cbrt(implied / basis) * (1.0 - share)
    standard = (root - expected) / np.sqrt(share)
    whitened = weight_root(covariance / np.outer(scale, scale)) @ standard
    return standard, float(whitened @ whitened)
