"""The confidence region of a fit, and the largest spectrum in it at each frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import chi2, norm

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.dominance import Envelope
from gmwm.filter_numbers.target import Target
from gmwm.process import Model


@dataclass(frozen=True, eq=False)
class ParameterRegion:
    """A joint confidence region: the image of a ball of p dimensions.

    The ball is turned by the correlation of the estimates; along each parameter it reaches to the
    ends of the interval whose half-width is that of the joint region. So the region keeps to the
    ranges of the parameters, and is longer upwards where a standard error grows with the value.
    Amplitudes that are not significantly above zero are at their upper bounds, and rate ramps at
    their estimates.

    Attributes
    ----------
    model : Model
        The estimate, with such amplitudes at their bounds.
    keys : tuple of str
    lower, upper : (p,) ndarray
        Ends of the parameters.
    root : (p, p) ndarray
        Of the correlation: rows have length 1.
    """

    model: Model
    keys: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, fit: Fit, level: float) -> ParameterRegion:
        """That of a fit at a level.

        Raises
        ------
        InputError
            If the data bound a parameter in no way.
        """
        drifts = {p.key for p in fit.model.parameters if fit.model.terms[p.term].is_drift}
        place = [
            i for i, key in enumerate(fit.keys) if key not in drifts and key not in fit.upper_bounds
        ]
        keys = tuple(fit.keys[i] for i in place)
        single = 2.0 * norm.cdf(np.sqrt(chi2.ppf(level, max(len(keys), 1)))) - 1.0
        ends = fit.interval(float(single))
        bounds = dict(fit.upper_bounds)
        for key, end in (*bounds.items(), *((key, ends[key][1]) for key in keys)):
            if not np.isfinite(end):
                raise InputError(
                    f"channel {fit.wv.name!r}: the record does not bound {key}, so no numbers "
                    "dominate its confidence region: record longer, or leave out the level"
                )
        covariance = fit.covariance[np.ix_(place, place)]
        errors = np.sqrt(np.diag(covariance))
        correlation = covariance / np.outer(errors, errors)
        values, vectors = np.linalg.eigh(correlation) if keys else (np.zeros(0), np.zeros((0, 0)))
        return cls(
            model=fit.model.with_params({key: bounds[key] for key in bounds}),
            keys=keys,
            lower=np.array([ends[key][0] for key in keys]),
            upper=np.array([ends[key][1] for key in keys]),
            root=vectors * np.sqrt(np.maximum(values, 0.0)),
        )

    def model_at(self, point: FloatArray) -> Model:
        """The model at a point of the unit ball."""
        values = {}
        for i, (key, along) in enumerate(zip(self.keys, self.root @ point, strict=True)):
            centre = float(self.model.params[key] or 0.0)
            end = self.upper[i] if along > 0.0 else self.lower[i]
            if centre > 0.0 and end > 0.0:
                values[key] = centre * float(end / centre) ** abs(along)
            else:
                values[key] = centre + (end - centre) * abs(along)
        return self.model.with_params(values)

    def draws(self, number: int, rng: np.random.Generator) -> FloatArray:
        """Points of the ball, (number, p): half of them on its surface."""
        points = rng.standard_normal((number, len(self.keys)))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        points[::2] *= rng.random((len(points[::2]), 1)) ** (1.0 / max(len(self.keys), 1))
        return points


def region_envelope(pairs: Sequence[tuple[Target, Fit]], level: float) -> Envelope:
    """The largest density at each frequency over the confidence regions of some fits.

    It is that of a finite number of models: those with the largest density at frequencies on a
    grid, found by search, and some that are drawn.

    Parameters
    ----------
    pairs : sequence of (Target, Fit)
    level : float

    Raises
    ------
    InputError
        If the data bound a parameter in no way.
    """
    found: list[Target] = []
    for target, fit in pairs:
        region = ParameterRegion.of(fit, level)
        found += [_target(target, region.model_at(p)) for p in _extremes(target, region)]

    def envelope(f: FloatArray) -> FloatArray:
        return np.asarray(tuning.ENVELOPE * np.max([each.psd(f) for each in found], axis=0))

    return envelope


def _extremes(target: Target, region: ParameterRegion) -> list[FloatArray]:
    """Points of the ball with the largest densities."""
    rng = np.random.default_rng(tuning.REGION_SEED)
    if not region.keys:
        return [np.zeros(0)]
    drawn = list(region.draws(tuning.REGION_DRAWS, rng))
    points = np.log10(0.5 / target.dt / target.lowest) * tuning.REGION_POINTS
    f = np.geomspace(target.lowest, 0.5 / target.dt, int(points) + 1)
    densities = np.array([_target(target, region.model_at(p)).psd(f) for p in drawn])
    result = drawn
    for k in range(f.size):

        def least(point: FloatArray, at: FloatArray = f[k : k + 1]) -> float:
            inside = point / max(1.0, float(np.linalg.norm(point)))
            return -float(np.log(_target(target, region.model_at(inside)).psd(at)[0]))

        start = drawn[int(np.argmax(densities[:, k]))]
        best = minimize(
            least, start, method="SLSQP", options={"maxiter": 40, "ftol": 1e-6},
            constraints={"type": "ineq", "fun": lambda p: 1.0 - float(p @ p)},
        ).x  # fmt: skip
        result = [*result, best / max(1.0, float(np.linalg.norm(best)))]
    return result


def _target(like: Target, model: Model) -> Target:
    return Target.of(model, like.dt, like.horizon)
