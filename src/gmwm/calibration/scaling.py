"""Fast noise that grows with a covariate, such as the temperature.

The model of a calibration is an average over the record. Where the variances of its parts follow
their mean covariate, ``log s = gamma x``, the deviation at each value of it is known too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gmwm._core.distributions import norm, student
from gmwm._core.documents import Array, NotNegative, Probability
from gmwm._core.text import per_cent
from gmwm._core.typing import FloatArray
from gmwm.calibration import tuning
from gmwm.estimate import Fit
from gmwm.estimate.problem import Scales
from gmwm.issues import Notice, Severity, notice
from gmwm.process import Model
from gmwm.readers import Channel, block_means

_ROUNDS = 20
_SETTLED = 1e-9


@dataclass(frozen=True, eq=False)
class Scaling:
    """How the deviation of the fast noise depends on a covariate.

    gamma: Of ``exp(gamma x)``, per unit of the covariate.
    error: Half its 95 % interval.
    p_value: Of the score test of ``gamma = 0``.
    reference: Where the noise is that of the model, the mean square of the recordings.
    places, deviation: Covariate and deviation of parts of the recordings, over that of the model.
    """

    gamma: float
    error: NotNegative
    p_value: Probability
    reference: float
    places: Array = field(repr=False)
    deviation: Array = field(repr=False)

    def factor(self, x: FloatArray | float) -> FloatArray:
        """Deviation at values of the covariate over that of the model."""
        return np.asarray(np.exp(self.gamma * (np.asarray(x, dtype=float) - self.reference)))

    def at(self, fit: Fit, x: float) -> Fit:
        """A fit with the fast noise at a value of the covariate: as if all of the record had it.

        The variances change by as much as the model's, the errors by that of gamma too.
        """
        factor = float(self.factor(x))
        model = with_noise(fit.model, factor)
        keys = _noise_keys(model)
        scale = np.array([factor if key in keys else 1.0 for key in fit.keys])
        turn = np.array([model.params[key] or 0.0 if key in keys else 0.0 for key in fit.keys])
        turn *= (x - self.reference) * self.error / float(norm.ppf(0.975))
        scales = Scales.of(fit.wv)
        added = scales.curve(model) - scales.curve(fit.model)
        variance = np.maximum(fit.wv.variance + added, np.finfo(float).tiny)
        bounds = {k: v * factor if k in keys else v for k, v in fit.upper_bounds.items()}
        covariance = fit.covariance * np.outer(scale, scale) + np.outer(turn, turn)
        wv = replace(fit.wv, variance=variance)
        return replace(fit, model=model, wv=wv, covariance=covariance, upper_bounds=bounds)

    def notice(self, name: str, unit: str, low: float, high: float) -> Notice | None:
        """Say that the noise grows, where that is clear."""
        if not self.p_value < tuning.FALSE_ALARM:
            return None
        ratio = float(np.exp(self.gamma * (high - low)))
        apart = max(ratio, 1.0 / ratio) > (1.0 + tuning.UNSTEADY) ** 2
        severity: Severity = "warning" if apart else "note"
        values = {"gamma": self.gamma, "error": self.error, "p_value": self.p_value}
        words = {
            "change": "grows" if self.gamma > 0.0 else "falls",
            "per": f"{per_cent(abs(self.gamma))} (+-{per_cent(self.error)}) per {unit}",
            "times": f"{ratio:.3g}",
            "ends": f"{low:.3g} to {high:.3g} {unit}",
        }
        return notice(
            "noise-scales", "", values | {"ratio": ratio}, severity=severity, name=name, **words
        )


def with_noise(model: Model, factor: float) -> Model:
    """A model with its fast noise, white or filtered, so many times as large."""
    return model.with_params(
        {key: factor * (model.params[key] or 0.0) for key in _noise_keys(model)}
    )


def _noise_keys(model: Model) -> list[str]:
    fast = [term.is_white or term.is_band_limited for term in model.terms]
    return [p.key for p in model.parameters if fast[p.term] and p.parameter.name == "N"]


def scaling(parts: Sequence[tuple[Channel, FloatArray, FloatArray]]) -> Scaling | None:
    """Regress mean squares of parts of recordings on their covariate, by a quasi-likelihood.

    The variances are in proportion to ``exp(2 gamma x)`` and scatter about it in proportion to it
    (gamma regression; McCullagh & Nelder 1989, *Generalized Linear Models*, ch. 8); the scatter is
    estimated, so that neither tails nor colour of the noise matter.

    parts: Of each recording the channel, times (s) and values there of the covariate.
    Returns: None where too few parts exist or the covariate does not change.
    """
    rows = [_mean_squares(*each) for each in parts]
    square, x = (np.concatenate([row[k] for row in rows]) for k in (0, 1))
    known = ~np.isnan(square + x) & (square > 0.0)
    square, x = square[known], x[known]
    if x.size < tuning.FEWEST_SCALED or not np.ptp(x) > 0.0:
        return None
    centred, free = x - np.mean(x), x.size - 2
    total = float(centred @ centred)
    relative = square / np.mean(square) - 1.0
    spread = float(np.sum((relative - centred * (centred @ relative) / total) ** 2)) / free
    score = abs(float(centred @ relative)) / np.sqrt(spread * total)
    level, slope = float(np.log(np.mean(square))), 0.0
    for _ in range(_ROUNDS):
        off = square / np.exp(level + slope * centred) - 1.0
        step = float(centred @ off) / total
        level, slope = level + float(np.mean(off)), slope + step
        if abs(step) < _SETTLED * (abs(slope) + _SETTLED):
            break
    dispersion = float(np.sum(off**2)) / free
    error = float(student.ppf(0.975, free)) * np.sqrt(dispersion / total)
    chance = float(2.0 * student.sf(score, free))
    middle = float(np.mean(x))
    if slope != 0.0:
        middle += float(np.log(np.mean(np.exp(slope * centred)))) / slope
    deviation = np.sqrt(square / np.mean(square))
    return Scaling(0.5 * slope, float(0.5 * error), chance, middle, x, deviation)


def _mean_squares(
    channel: Channel, time: FloatArray, covariate: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean squares of differences of short means in parts of a channel, and the covariate there."""
    short = max(round(tuning.FAST / channel.dt), 1)
    means = block_means([channel.values], short)[:, 0] if short > 1 else channel.values
    step = np.diff(means)[::2]  # of different samples
    count = min(tuning.SCALED_PARTS, step.size // tuning.STEPS_OF_PART)
    if count < 1:
        return np.zeros(0), np.zeros(0)
    size = step.size // count
    square = block_means([step**2], size, 0.5)[:count, 0]
    middles = channel.dt * short * 2.0 * size * (np.arange(count) + 0.5)
    return square, np.interp(middles, time, covariate)
