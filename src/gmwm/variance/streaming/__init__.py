"""Wavelet variance of streams: one pass over blocks of samples, at constant memory."""

from gmwm.variance.streaming.streaming import StreamingVariance as StreamingVariance
