"""The moments that a model is fitted to: wavelet variances, and the slope of a ramp."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gmwm._typing import FloatArray
from gmwm.estimate.ramp import (
    Slope,
    bias_of_detrending,
    detrended_covariance,
    gls_slope,
    ols_slope,
)
from gmwm.estimate.scales import Scales
from gmwm.process import Model, RateRamp
from gmwm.process.spectral import PSD
from gmwm.variance.wavelet import WaveletVariance


@dataclass(frozen=True, eq=False)
class Moments:
    """What is known of a series before and while its noise is fitted.

    Attributes
    ----------
    wv : WaveletVariance
    slope : Slope or None
        Drift removed from the wavelet variances, ``None`` where the model has no ramp.
    slope_is_free : bool
        Whether it is estimated (rather than given).
    scales : Scales
    """

    wv: WaveletVariance
    slope: Slope | None
    slope_is_free: bool
    scales: Scales

    @classmethod
    def of(cls, wv: WaveletVariance, model: Model, scales: Scales | None = None) -> Moments:
        scales = scales or Scales.of(wv)
        ramps = [term for term in model.terms if isinstance(term, RateRamp)]
        if not ramps:
            return cls(wv, None, False, scales)
        if ramps[0].R is not None:
            return cls(wv, Slope(ramps[0].R, 0.0), False, scales)
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


def _has_power(psd: PSD, dt: float) -> bool:
    return bool(np.any(psd(np.array([1e-6, 0.01, 0.25]) / dt, dt) > 0.0))
