"""What the data say: wavelet variances, their covariance, the Allan family."""

from gmwm.variance.allan_family import Deviations as Deviations, deviations as deviations
from gmwm.variance.covariance.haar import haar_covariance as haar_covariance
from gmwm.variance.cross import (
    WaveletCovariance as WaveletCovariance,
    wavelet_covariance as wavelet_covariance,
)
from gmwm.variance.curve import Curve as Curve, curve as curve, read_curves as read_curves
from gmwm.variance.gaps import Runs as Runs
from gmwm.variance.levels import pilot_psd as pilot_psd
from gmwm.variance.regressors import RegressorPart as RegressorPart, Regressors as Regressors
from gmwm.variance.series import (
    MIN_SAMPLES as MIN_SAMPLES,
    as_channel as as_channel,
    as_wavelet_variance as as_wavelet_variance,
    wavelet_variance as wavelet_variance,
)
from gmwm.variance.streaming import StreamingVariance as StreamingVariance
from gmwm.variance.wavelet import (
    PooledVariance as PooledVariance,
    WaveletVariance as WaveletVariance,
)
