"""What a calibration reports of departures from stationary noise, and how they are taken off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gmwm._core.notices import Notice, Severity
from gmwm._core.text import readable
from gmwm._core.typing import FloatArray
from gmwm.calibration import tuning
from gmwm.calibration.departures import Departure, departures
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.readers import Channel, Recording
from gmwm.variance import PooledVariance

_KINDS = ("step", "transient", "drift-at-start", "slow-period")


def with_departures(fitted: Fit, sources: Sequence[str]) -> Fit:
    """A fit with a notice of each departure; not valid if one accounts for much of the noise.

    Parameters
    ----------
    fitted : Fit
    sources : sequence of str
        Of its recordings; named where there are several.
    """
    wv = fitted.wv
    parts = wv.parts if isinstance(wv, PooledVariance) else (wv,)
    notices = [
        replace(departure_notice(found, wv.unit), source=source if len(parts) > 1 else "")
        for part, source in zip(parts, sources, strict=True)
        for found in departures(fitted, part)
    ]
    return replace(fitted, notices=(*fitted.notices, *notices)) if notices else fitted


def departure_notice(found: Departure, unit: str) -> Notice:
    """What it is, and whether a fit beside it is valid.

    Parameters
    ----------
    found : Departure
    unit : str
        Of the channel, SI.
    """
    size, low, high = (readable(each, unit, sign=True) for each in found.size)
    size = f"{size} ({low} .. {high})"
    time, first, last = (f"{each:.4g}" for each in found.time)
    when = f"{time} s ({first} .. {last})"
    what, remedy = {
        "step": (
            f"a step of {size} at {when}",
            "calibrate the part before it or after it",
        ),
        "transient": (
            f"a transient of {size} at the start with a time constant of {when}",
            "leave out the first three time constants",
        ),
        "drift-at-start": (
            f"a drift by {size} from the start, which ends at {when}: a transient after switching "
            "on and no rate ramp",
            "leave it out",
        ),
        "slow-period": (
            f"a period of {when} with an amplitude of {size}",
            "find what varies so, such as the temperature",
        ),
    }[found.kind]
    harmful = found.share > tuning.HARMFUL_SHARE
    severity: Severity
    if found.is_evident:
        severity = "bad" if harmful else "warning"
        part = f"{100.0 * found.share:.0f} %" if found.share < 1.0 else "all"
        text = (
            f"{what}; it accounts for up to {part} of the model's wavelet variance, so that slow "
            "terms of the model are too large"
        )
        action = f"{remedy}, or take it off (gmwm.without_departures)"
    else:
        severity = "warning" if harmful else "note"
        text = f"{what}, or slow noise: this record does not distinguish them"
        action = "a longer record does"
    names = ("time", "time_lower", "time_upper", "size", "lower", "upper")
    values = dict(zip(names, (*found.time, *found.size), strict=True))
    values |= {"phase": found.phase, "evidence": found.evidence, "share": found.share}
    return Notice(found.kind, severity, "", text, values, action)


def without_departures(recording: Recording, fits: Mapping[str, Fit]) -> Recording:
    """A recording without what its calibration reports as evident departures.

    Steps, transients, drifts at the start and slow periods are subtracted; samples at which a step
    may be are missing (NaN). What is left has one parameter less for each size, which a calibration
    of it does not know.

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
    >>> found["gyro_x"].reasons["stationary"]
    False
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
    channels = tuple(
        _without(channel, fits[channel.name].notices) if channel.name in fits else channel
        for channel in recording.channels
    )
    return replace(recording, channels=channels)


def _without(channel: Channel, notices: Sequence[Notice]) -> Channel:
    values = np.array(channel.values, dtype=float)
    time = channel.dt * np.arange(values.size, dtype=float)
    for notice in notices:
        if notice.code not in _KINDS or notice.values["evidence"] < tuning.EVIDENT:
            continue
        values -= notice.values["size"] * _curve(notice, time)
        if notice.code == "step":
            near = (time > notice.values["time_lower"]) & (time < notice.values["time_upper"])
            values[near] = np.nan
    return replace(channel, values=values)


def _curve(notice: Notice, time: FloatArray) -> FloatArray:
    """At unit size."""
    length = notice.values["time"]
    if notice.code == "step":
        return np.asarray(time > length, dtype=float)
    if notice.code == "transient":
        return np.exp(-time / length)
    if notice.code == "drift-at-start":
        return np.maximum(1.0 - time / length, 0.0)
    return np.cos(2.0 * np.pi * time / length - notice.values["phase"])
