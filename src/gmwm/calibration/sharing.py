"""Slow errors that channels share: their correlation, and a test that there is none.

The wavelet covariances of two channels are fitted by r (nu_j^a nu_j^b)^(1/2), with the slow terms'
wavelet variances of both models, by generalized least squares. Levels at which a channel has more
fast noise than slow errors are left out: vibration that both have is not slow. The weights are the
covariance of wavelet covariances of independent channels with these models, so that the estimate
has the least variance where there is no sharing. There it is like a mean of products of independent
normals, as many as its information: Student's t has their variance and kurtosis (``python
benchmarks/arrays.py size``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from gmwm._core.distributions import student
from gmwm._core.typing import FloatArray
from gmwm.calibration import tuning
from gmwm.calibration.screening import Screened
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process
from gmwm.variance import WaveletCovariance, wavelet_covariance


@dataclass(frozen=True)
class Sharing:
    """Correlation of the slow errors of two channels.

    correlation: Estimate; by chance it may exceed 1.
    stderr: Its standard error where nothing is shared.
    p_value: Of the test that they share nothing, two-sided.
    """

    first: str
    second: str
    correlation: float
    stderr: float
    p_value: float


def is_slow(term: Process) -> bool:
    """Whether a term is random and slower than `tuning.SLOW`."""
    is_long = term.is_exponential and (term.values["tau"] or 0.0) >= tuning.SLOW
    return term.is_walk or term.is_flicker or is_long


def sharing(models: Mapping[str, Model], data: WaveletCovariance) -> list[Sharing]:
    """Sharing of each pair of channels whose models have slow terms that dominate at some levels.

    Pairs whose correlation is not known to `tuning.LARGEST_ERROR` are left out.
    """
    slow: dict[int, FloatArray] = {}
    for place, name in enumerate(data.names):
        parts = np.array([term.haar_variance(data.tau, data.dt) for term in models[name].terms])
        own = np.sum(parts[[is_slow(term) for term in models[name].terms]], axis=0)
        if np.any(own):
            slow[place] = np.where(own >= tuning.SLOW_SHARE * np.sum(parts, axis=0), own, 0.0)
    form = data.form([models[name].psd for name in data.names])
    found = []
    for a, b in combinations(slow, 2):
        used = (slow[a] > 0.0) & (slow[b] > 0.0)
        own = form[a, b][np.ix_(used, used)]
        deviation = np.sqrt(np.diag(own))  # levels of any unit are weighed alike
        if not np.all(deviation > 0.0):
            continue
        grown = deviation * np.sqrt(np.prod(1.0 + data.change[used][:, [a, b]], axis=1))
        shape = np.sqrt(slow[a] * slow[b])[used] / grown
        weighted = np.linalg.pinv(own / np.outer(deviation, deviation), hermitian=True) @ shape
        information = float(weighted @ shape)
        if information * tuning.LARGEST_ERROR**2 < 1.0:
            continue
        error = 1.0 / np.sqrt(information)
        estimate = float(weighted @ (data.values[used, a, b] / grown)) / information
        dof = information + 4.0  # of equal kurtosis: the mean of so many products of normals
        z = abs(estimate) / error * np.sqrt(dof / (dof - 2.0))
        p_value = 2.0 * float(student.sf(z, dof))
        found.append(Sharing(data.names[a], data.names[b], estimate, error, p_value))
    return found


SHARED = "shared-errors"
"""Code of the notice that channels share slow errors."""


def sharing_notices(one: Screened, models: Mapping[str, Model]) -> list[Notice]:
    """Name the channels of a recording that share slow errors, the most correlated first.

    Each pair is tested at `tuning.SHARED_LEVEL` divided by the number of pairs.
    """
    recording = one.recording
    channels = [
        c
        for c in recording.inertial
        if c.name in models and (c.n, c.dt) == (recording.n, recording.dt)
        if c.name not in one.robust and c.name not in one.repeated
        if all(term.has_spectrum() for term in models[c.name].terms)
    ]
    block = max(int(tuning.SLOW / tuning.BLOCKS_OF_SLOW / recording.dt), 1)
    try:
        found = sharing(models, wavelet_covariance(channels, block=block))
    except InputError:  # fewer than two channels, or no run in which all have samples
        return []
    level = tuning.SHARED_LEVEL
    pairs = [each for each in found if each.p_value * len(found) < level]
    if not pairs:
        return []
    pairs.sort(key=lambda each: -abs(each.correlation))
    largest = pairs[0]
    listed = ", ".join(
        f"{each.first} and {each.second} ({np.clip(each.correlation, -1.0, 1.0):.2f})"
        for each in pairs[: tuning.SHARED_LISTED]
    )
    more = len(pairs) - tuning.SHARED_LISTED
    names = {"first": largest.first, "second": largest.second, "level": level}
    sizes = {"correlation": largest.correlation, "p_value": largest.p_value}
    values = {**names, **sizes, "pairs": len(pairs), "tested": len(found)}
    others = f" and {more} more pair{'s' * (more > 1)}" if more > 0 else ""
    return [notice(SHARED, "", values, listed=listed + others)]
