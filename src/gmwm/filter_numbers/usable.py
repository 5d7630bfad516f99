"""Numbers that a file can hold: of any model, and without zeros, by which filters divide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from gmwm.calibration import upper_limit
from gmwm.estimate import Fit
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.axes import AxisModel, Sd, SensorAxes, Several
from gmwm.filter_numbers.bound import bound, predicted
from gmwm.filter_numbers.reduce import reduce
from gmwm.filter_numbers.result import AxisFilterNumbers, FilterNumbers
from gmwm.issues import notice
from gmwm.process import GaussMarkov, RandomWalk, WhiteNoise


def usable(
    source: Several,
    form: str = "N+K",
    horizon: float = tuning.HORIZON,
    *,
    shared: bool = False,
    tau: float | str | None = None,
    bias_sd: Sd = 0.0,
    dt: float | None = None,
    rate: float | None = None,
) -> FilterNumbers:
    """Numbers of `bound`, with 95 % upper limits in place of terms that no axis has.

    The notice "upper-limit" has them by letter. No stationary process bounds a random walk: N+GM
    of models with one are of `reduce`. Parameters and errors are those of `bound`.
    """
    axes = SensorAxes.of(source, dt, bias_sd, rate)
    terms = (term for each in axes.axes for term in each.model.terms)
    options: Any = {"bias_sd": bias_sd, "shared": shared, "tau": tau, "dt": dt, "rate": rate}
    if form == "N+GM" and any(term.is_walk or term.is_flicker for term in terms):
        found = reduce(source, form, [share * horizon for share in tuning.OUTAGES], **options)
    else:
        found = bound(source, form, horizon, **options)
    if form not in ("N+K", "N+GM") or any(each.fit is None for each in axes.axes):
        return found
    slow = (each.tau[0] for each in found.values() if tau is not None and each.sigma[0] > 0.0)
    time = next(slow, horizon)
    filled = {
        axis.name: _filled(axis, group, found[axis.name], time)
        for group in axes.sharing(shared)
        for axis in group
    }
    return replace(found, axes={name: filled[name] for name in found})


def _filled(
    axis: AxisModel, group: Sequence[AxisModel], numbers: AxisFilterNumbers, tau: float
) -> AxisFilterNumbers:
    """The numbers of an axis without zeros; ``group``: axes with the same numbers."""
    upper, fits = {}, [each.fit for each in group if each.fit is not None]

    def largest(letter: str) -> float:
        return max(_limit(fit, letter) for fit in fits)

    def positive(letter: str, value: float) -> float:
        if value > 0.0:
            return value
        upper[letter] = largest(letter)
        return upper[letter]

    N = positive("N", numbers.N)
    if numbers.form == "N+K":
        model = WhiteNoise(N) + RandomWalk(positive("K", numbers.K))
    elif numbers.sigma[0] > 0.0:
        model = WhiteNoise(N) + GaussMarkov(numbers.sigma[0], numbers.tau[0])
    else:
        # At high frequencies this process rises as a random walk of that K does.
        upper["sigma"] = largest("K") * float(np.sqrt(tau / 2.0))
        model = WhiteNoise(N) + GaussMarkov(upper["sigma"], tau)
    if not upper:
        return numbers
    times = [each.time for each in numbers.predicted]
    again = predicted(axis, axis.chain, model, numbers.initial_sd, times)
    limits = notice("upper-limit", "", upper, letters=", ".join(upper))
    return replace(numbers, model=model, predicted=again, notices=(*numbers.notices, limits))


@lru_cache(maxsize=64)
def _limit(fit: Fit, letter: str) -> float:
    """`upper_limit`, which takes a fit of its own."""
    return upper_limit(fit, letter)
