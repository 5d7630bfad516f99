"""Channels of which each sample is written several times: sample and hold of a lower rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gmwm._core.notices import Notice
from gmwm.diagnosis import tuning
from gmwm.diagnosis.result import Repetition
from gmwm.readers import Channel


def repetition(channel: Channel) -> Repetition | None:
    """Find out whether a channel changes at every k-th sample only.

    Of samples that are not repeated, every change is in the same place modulo k with a probability
    of 1/k, so that some dozen changes leave no room for chance, however coarse the rounding is.

    Parameters
    ----------
    channel : Channel

    Returns
    -------
    Repetition or None
    """
    steps = np.diff(channel.values)
    changes = np.flatnonzero((steps != 0.0) & ~np.isnan(steps)) + 1
    if changes.size < tuning.FEWEST_KNOWN:
        return None
    times = int(np.gcd.reduce(np.diff(changes)))
    return Repetition(times, int(changes[0]) % times) if times > 1 else None


def thinned(channel: Channel, found: Repetition) -> Channel:
    """One of each group of equal samples, at the channel's own rate."""
    values = channel.values[found.first :: found.times]
    return replace(channel, values=values, dt=channel.dt * found.times)


def repetition_notice(channel: Channel, found: Repetition) -> Notice:
    """Say how often each sample comes, and the rate of the channel."""
    rate = 1.0 / (channel.dt * found.times)
    text = f"each sample is repeated, {found.times} times in all: the channel's own rate is "
    return Notice(
        "repeated-samples",
        "note",
        channel.name,
        f"{text}{rate:.6g} Hz",
        {"times": float(found.times), "rate": rate},
        "one of each is used, at that rate",
    )
