"""Subtract departures from stationary noise, and give back the noise that this takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.calibration import tuning
from gmwm.calibration.departures import DEPARTURES, WIDE, Departure
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.readers import Channel, Recording
from gmwm.variance import WaveletVariance, wavelet_variance


def without_departures(recording: Recording, fits: Mapping[str, Fit]) -> Recording:
    """A recording without what its calibration reports as evident departures.

    Steps, transients, drifts at the start and slow periods are subtracted; samples at which a step
    may be are missing (NaN). What is left has one parameter less for each size, which a calibration
    of it does not know; ``gmwm.calibrate(..., remove_departures=True)`` does.

    Parameters
    ----------
    recording : Recording
        That which was calibrated, alone.
    fits : Calibration or mapping of str to Fit

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        If a fit is of a recording of another length.

    Examples
    --------
    >>> import gmwm, numpy as np
    >>> x = gmwm.simulate(gmwm.WhiteNoise(0.01), n=36_000, dt=0.1, seed=1)
    >>> x[20_000:] += 0.05
    >>> rec = gmwm.Recording.from_arrays({"gyro_x": x}, 10.0, {"gyro": "rad/s"})
    >>> found = gmwm.calibrate(rec)
    >>> list(found["gyro_x"].reasons)
    ['stationary']
    >>> again = gmwm.calibrate(gmwm.without_departures(rec, found))
    >>> again["gyro_x"].valid, list(again["gyro_x"].params)
    (True, ['N'])
    """
    for name, fit in fits.items():
        if name in recording and fit.wv.n * fit.wv.dt > recording.duration + recording.dt:
            raise InputError(
                f"{recording.source or 'the recording'} is not the one that was calibrated: "
                f"{recording.duration:g} s, and the fit of {name} has {fit.wv.n * fit.wv.dt:g} s"
            )
    channels = []
    for channel in recording.channels:
        found = []
        for each in fits[channel.name].notices if channel.name in fits else ():
            of = each.values
            if each.code in DEPARTURES and of["evidence"] >= tuning.EVIDENT:
                time = (of["time"], of["time_lower"], of["time_upper"])
                size = (of["size"], of["lower"], of["upper"])
                numbers = (of["evidence"], of["share"], of["phase"])
                found.append(Departure(each.code, time, size, *numbers))
        channels.append(_without(channel, found))
    return replace(recording, channels=tuple(channels))


def variance_without(
    channel: Channel, found: Sequence[Departure], *, robust: bool = False
) -> WaveletVariance:
    """Wavelet variances of a channel less departures whose sizes were estimated from it.

    An estimated curve has followed the noise: what is subtracted with it has, on average, the
    square of the standard error of its size times the wavelet variance of the curve at unit size,
    where the size is estimated by generalized least squares. So much is added again. Errors of
    several sizes are correlated as under white noise: of two opposite steps the level after both is
    known better than that between.
    """
    left = _without(channel, found)
    wv = wavelet_variance(left, robust=robust)
    if not found:
        return wv
    curves, errors = [], []
    for each in found:
        for phase in (0.0, 0.5 * np.pi) if each.kind == "slow-period" else (0.0,):
            curves.append(replace(each, phase=each.phase + phase).curve(_times(channel)))
            errors.append((each.size[2] - each.size[1]) / (2.0 * WIDE))
    there = ~np.isnan(left.values)
    taken = np.zeros_like(wv.variance)
    for error in _independent(np.array(curves)[:, there], np.array(errors)):
        size = float(np.linalg.norm(error))
        # Of the whole curve: a gap that it steps in is filled in what is left.
        unit = wavelet_variance((error / size) @ np.array(curves), dt=channel.dt)
        taken += size**2 * unit.variance[: taken.size]
    return replace(wv, variance=wv.variance + taken)


def _independent(curves: FloatArray, errors: FloatArray) -> FloatArray:
    """Combinations of curves whose sizes have independent errors, in standard errors, (k, k)."""
    centred = curves - np.mean(curves, axis=1)[:, None]
    covariance = np.linalg.pinv(centred @ centred.T)
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    found = (vectors * np.sqrt(np.maximum(values, 0.0))).T * errors
    return np.asarray(found[values > tuning.NO_INFORMATION])


def _times(channel: Channel) -> FloatArray:
    return channel.dt * np.arange(len(channel.values), dtype=float)


def _without(channel: Channel, found: Sequence[Departure]) -> Channel:
    if not found:
        return channel
    values, time = np.array(channel.values, dtype=float), _times(channel)
    for each in found:
        values -= each.size[0] * each.curve(time)
        if each.kind == "step":
            values[(time > each.time[1]) & (time < each.time[2])] = np.nan
    return replace(channel, values=values)
