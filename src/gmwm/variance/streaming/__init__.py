"""Wavelet variance of streams: one pass over blocks of samples, at constant memory."""

from gmwm.variance.streaming.recording import StreamedRecording, stream
from gmwm.variance.streaming.streaming import StreamingVariance

__all__ = ["StreamedRecording", "StreamingVariance", "stream"]
