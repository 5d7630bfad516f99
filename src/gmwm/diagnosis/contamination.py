"""Contamination: outliers too many, and too far apart, to be shocks.

A shock is left out with the samples around it. Outliers spread over the record cannot be: what is
left between them has no long averaging times. The robust wavelet variance bounds their influence
instead, at the price of standard errors 1.3 times as large, so that it is used only where outliers
do more harm than that.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import binom, norm

from gmwm._core.notices import Notice
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Innovations

_NOISE = 2.0 * float(norm.sf(tuning.FAR))  # share of Gaussian noise beyond


def contamination(errors: Innovations, events: tuple[tuple[int, int], ...]) -> float:
    """Share of prediction errors beyond four robust standard deviations, each event counted once.

    Parameters
    ----------
    errors : Innovations
    events : tuple of (int, int)
        As `gmwm.diagnosis.events.find_events` finds them.

    Returns
    -------
    float
        0 unless it is above one in a thousand, which is 16 times that of Gaussian noise, and more
        than Gaussian noise has in one of a thousand channels.
    """
    outside = errors.known.copy()
    for start, stop in events:
        outside[start:stop] = False
    # What rounding can add to an error is subtracted.
    far = np.abs(errors.values) - errors.rounding > tuning.FAR * errors.scale
    count = int(np.count_nonzero(far & outside)) + len(events)
    known = int(np.count_nonzero(errors.known))
    is_chance = bool(binom.sf(count - 1, known, _NOISE) > tuning.FALSE_ALARM)
    return 0.0 if is_chance or count <= tuning.HARMFUL_OUTLIERS * known else count / known


def contamination_notice(name: str, share: float) -> Notice | None:
    """Say how many outliers there are.

    Parameters
    ----------
    name : str
        Of the channel.
    share : float
        From `contamination`.
    """
    if share == 0.0:
        return None
    return Notice(
        "outliers",
        "warning",
        name,
        f"{100.0 * share:.2g} % of the samples are outliers spread over the record, beyond four "
        f"standard deviations, where noise has {100.0 * _NOISE:.2g} %",
        {"share": share},
        "gmwm calibrate takes robust wavelet variances (in Python robust=True)",
    )
