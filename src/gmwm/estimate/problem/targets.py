"""The moments that a model is fitted to: wavelet variances, and the slope of a ramp."""

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
    """What is known of a series before and while its noise is fitted.

    slope: Drift removed from the wavelet variances, ``None`` where the model has no ramp.
    slope_is_free: Whether it is estimated (rather than given).
    """

    wv: WaveletVariance
    slope: Slope | None
    slope_is_free: bool
    scales: Scales

    @classmethod
    def of(cls, wv: WaveletVariance, model: Model, scales: Scales | None = None) -> Moments:
        scales = scales or Scales.of(wv)
        ramps = [term for term in model.terms if term.is_drift]
        if not ramps:
            return cls(wv, None, False, scales)
        if not ramps[0].is_open:
            return cls(wv, Slope(ramps[0].drift_rate(), 0.0), False, scales)
        return cls(wv, ols_slope(wv), True, scales)

    @property
    def target(self) -> FloatArray:
        """Wavelet variances without the drift, and without what removing it took, u^2, (J,)."""
        if self.slope is None:
            return self.wv.variance
        return self.wv.detrended(self.slope.value) + bias_of_detrending(self.wv, self.slope)

    def under(self, noise: Model, part: float = 1.0) -> Moments:
        """The same with the slope moved by ``part`` of the way to its estimate under this noise."""
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
        """Covariance of `target` that the fitted noise implies, u^4, (J, J)."""
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
        """From a model with values and the data.

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
