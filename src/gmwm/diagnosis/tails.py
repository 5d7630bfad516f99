"""Outliers all over the record, or noise of heavy tails.

Outliers are left out one by one. White noise of heavy tails (Laplace, Student) stays: a robust
variance of it would be too small at fine levels only, which looks like a Gauss-Markov process. The
body of the distribution tells them apart: the better of Student's t and the exponential power law
is compared, by likelihood in bins, with Gaussian noise of which a part has a larger deviation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from gmwm._core.distributions import binom, gennorm, norm, student
from gmwm._core.typing import FloatArray, inner
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Examined, Innovations, Spans
from gmwm.issues import Notice, notice

_NOISE = 2.0 * float(norm.sf(tuning.FAR))  # share of Gaussian noise beyond


def contamination(errors: Innovations, events: Spans) -> float:
    """Share of prediction errors beyond four robust standard deviations, each event counted once.
    0 unless it is above one in a thousand, which is 16 times that of Gaussian noise, and more than
    Gaussian noise has in one of a thousand channels.
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


@dataclass(frozen=True)
class Tails:
    """A law of heavy tails."""

    law: str  # "student" (Student's t) or "power" (exponential power law)
    shape: float  # degrees of freedom, or the exponent: 2 is Gaussian, 1 Laplace
    scale: float  # in robust standard deviations

    def beyond(self, distance: FloatArray) -> FloatArray:
        """Probability of a larger absolute value, of distances in robust standard deviations."""
        return np.asarray(2.0 * _LAWS[self.law].sf(distance / self.scale, self.shape))

    def distance(self, chance: float) -> float:
        """Robust standard deviations that are passed with this probability."""
        return float(self.scale * _LAWS[self.law].isf(0.5 * chance, self.shape))


_LAWS = {"student": student, "power": gennorm}


def heavy_tails(errors: Innovations) -> Tails | None:
    """The law of the prediction errors, if it has heavy tails rather than outliers.
    None if Gaussian noise with outliers is as likely, large errors cluster, the law has no variance
    or hardly one, or the noise hides in the rounding.
    """
    counted = errors.known
    if errors.rounding > tuning.ROUNDING_OF_BODY * errors.level or not errors.level > 0.0:
        return None
    distance = np.abs(errors.values[counted]) / errors.scale[counted]
    # Mean correlation of large errors with the next ones.
    large = (distance > tuning.LARGE).astype(float)
    large -= np.mean(large)
    products = [inner(large[lag:], large[:-lag]) for lag in range(1, tuning.LAGS + 1)]
    if np.mean(products) / inner(large, large) > tuning.CLUSTERED:
        return None
    edges = np.append(
        np.arange(0.0, tuning.FAR, tuning.BIN_OF_BODY),
        tuning.FAR * 2.0 ** np.arange(0.0, tuning.OCTAVES_OF_TAIL, 0.25),
    )
    counts = np.append(np.histogram(distance, edges)[0], np.count_nonzero(distance >= edges[-1]))
    contaminated, _ = _most_likely(_mixture, counts, edges, _MIXTURE_STARTS)
    found = {law: _most_likely(_with_scale(law), counts, edges, _STARTS[law]) for law in _LAWS}
    law = max(found, key=lambda name: found[name][0])
    likelihood, (shape, scale) = found[law][0], np.exp(found[law][1])
    if likelihood <= contaminated or shape <= tuning.LEAST_SHAPE[law]:
        return None
    return Tails(law, float(shape), float(scale))


def _with_scale(law: str) -> Callable[[FloatArray, FloatArray], FloatArray]:
    return lambda x, logs: Tails(law, *np.exp(logs).tolist()).beyond(x)


def _mixture(x: FloatArray, at: FloatArray) -> FloatArray:
    scale, ratio = np.exp(at[0]), 1.0 + np.exp(at[1])
    share = 1.0 / (1.0 + np.exp(-at[2]))
    return np.asarray(
        2.0 * (1.0 - share) * norm.sf(x / scale) + 2.0 * share * norm.sf(x / (scale * ratio))
    )


_STARTS = {"student": ((np.log(4.0), np.log(0.8)),), "power": ((np.log(1.2), np.log(1.0)),)}
_MIXTURE_STARTS = ((0.0, np.log(2.0), -3.0), (0.0, np.log(20.0), -5.0))


def _most_likely(
    survival: Callable[[FloatArray, FloatArray], FloatArray],
    counts: FloatArray,
    edges: FloatArray,
    starts: tuple[tuple[float, ...], ...],
) -> tuple[float, FloatArray]:
    """Largest logarithm of the likelihood of counts in bins, the last open, and where it is."""

    def loss(at: FloatArray) -> float:
        beyond = np.append(survival(edges, at), 0.0)
        share = np.maximum(beyond[:-1] - beyond[1:], np.finfo(float).tiny)
        return float(-counts @ np.log(share))

    with np.errstate(over="ignore", invalid="ignore"):
        found = [minimize(loss, start, method="Nelder-Mead") for start in starts]
    best = min(found, key=lambda one: float(one.fun))
    return -float(best.fun), np.asarray(best.x)


def outliers_or_tails(channel: Examined) -> Iterator[Notice]:
    """Say how many outliers there are, or that the noise has heavy tails."""
    tails, errors = channel.tails, channel.errors
    if channel.outliers > 0.0:
        yield notice("outliers", channel.name, {"share": channel.outliers}, usual=_NOISE)
    elif tails is not None:
        there = errors.known & (errors.scale > 0.0)  # not where the channel is dead in part
        square = (errors.values[there] / errors.scale[there]) ** 2
        kurtosis = float(np.mean(square**2) / np.mean(square) ** 2 - 3.0)
        numbers = {"law": tails.law, "shape": tails.shape, "scale": tails.scale}
        values = numbers | {"kurtosis": kurtosis}
        yield notice("heavy-tails", channel.name, values, variant=tails.law)
