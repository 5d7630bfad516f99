"""The confidence region of a fit, and the largest spectrum in it at each frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from gmwm._core.distributions import chi2, norm
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.spectra.target import Target
from gmwm.process import Model


@dataclass(frozen=True, eq=False)
class ParameterRegion:
    """A joint confidence region: the image of a ball of p dimensions.

    The ball is turned by the correlation of the estimates; along each parameter it reaches to the
    ends of the interval whose half-width is that of the joint region. So the region keeps to the
    ranges of the parameters, and is longer upwards where a standard error grows with the value.
    Amplitudes that are not significantly above zero are at their upper bounds, and rate ramps at
    their estimates.

    model: The estimate, with such amplitudes at their bounds.
    lower, upper: (p,), ends of the parameters.
    root: (p, p), of the correlation: rows have length 1.
    """

    model: Model
    keys: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, fit: Fit, level: float) -> ParameterRegion:
        """That of a fit at a level.

        Raises InputError if the data bound a parameter in no way.
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


def region_targets(target: Target, fit: Fit, level: float) -> tuple[Target, ...]:
    """Models of a confidence region, one of which has nearly the largest density at any frequency.

    They are drawn, or found by search at frequencies on a grid.

    target: That of the estimate.
    Raises InputError if the data bound a parameter in no way.
    """
    region = ParameterRegion.of(fit, level)
    dt = target.dt
    if not region.keys:
        return (Target.of(region.model, dt, target.horizon),)
    counted = [i for i, term in enumerate(fit.model.terms) if not (term.is_line or term.is_drift)]

    def density(point: FloatArray, f: FloatArray) -> FloatArray:
        terms = region.model_at(point).terms
        return np.sum([terms[i].psd(f, dt) for i in counted], axis=0)

    def least(point: FloatArray, f: FloatArray) -> float:
        inside = point / max(1.0, float(np.linalg.norm(point)))
        return -float(np.log(density(inside, f)[0]))

    # Slower processes than the estimate change at lower frequencies.
    f = target.frequencies(tuning.REGION_POINTS)
    f = np.append(f[0] * np.array([0.01, 0.1]), f)
    points = list(region.draws(tuning.REGION_DRAWS, np.random.default_rng(tuning.REGION_SEED)))
    densities = np.array([density(point, f) for point in points])
    for k in range(f.size):
        best = minimize(
            least, points[int(np.argmax(densities[:, k]))], args=(f[k : k + 1],), method="SLSQP",
            options={"maxiter": 40, "ftol": 1e-6},
            constraints={"type": "ineq", "fun": lambda p: 1.0 - float(p @ p)},
        ).x  # fmt: skip
        points.append(best / max(1.0, float(np.linalg.norm(best))))
    fine = np.geomspace(f[0], f[-1], 20 * f.size)
    densities = np.array([density(point, fine) for point in points])
    largest = np.unique(np.argmax(densities, axis=0))
    return tuple(Target.of(region.model_at(points[i]), dt, target.horizon) for i in largest)
