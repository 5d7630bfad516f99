"""What the data say: wavelet variances, their covariance, the Allan family."""

from gmwm.variance.allan_family import Deviations, deviations
from gmwm.variance.analysis import MIN_SAMPLES, as_channel, as_wavelet_variance, wavelet_variance
from gmwm.variance.covariance.haar import haar_covariance
from gmwm.variance.gaps import Runs
from gmwm.variance.modwt import Modwt, imodwt, modwt
from gmwm.variance.pilot import pilot_psd
from gmwm.variance.pooled import PooledVariance
from gmwm.variance.streaming import StreamedRecording, StreamingVariance, stream
from gmwm.variance.wavelet import WaveletVariance

__all__ = [
    "MIN_SAMPLES",
    "Deviations",
    "Modwt",
    "PooledVariance",
    "Runs",
    "StreamedRecording",
    "StreamingVariance",
    "WaveletVariance",
    "as_channel",
    "as_wavelet_variance",
    "deviations",
    "haar_covariance",
    "imodwt",
    "modwt",
    "pilot_psd",
    "stream",
    "wavelet_variance",
]
