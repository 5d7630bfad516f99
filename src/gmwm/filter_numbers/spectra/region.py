"""The confidence region of a fit, and the largest spectrum in it at each frequency."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.optimize import minimize

from gmwm._core.distributions import chi2, norm
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import Fit, left_open
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.spectra.required import RequiredSpectrum
from gmwm.process import Model, Process


@dataclass(frozen=True, eq=False)
class Estimated:
    """A model, and the errors of some of its parameters.

    covariance: (p, p), of these parameters, in products of their units.
    """

    model: Model
    keys: tuple[str, ...]
    covariance: FloatArray

    @classmethod
    def of(cls, fit: Fit) -> Self:
        """The parameters of a fit: amplitudes at upper limits and rate ramps count as known."""
        drifts = {p.key for p in fit.model.parameters if fit.model.terms[p.term].is_drift}
        known = drifts | set(fit.upper_bounds)
        free = [i for i, key in enumerate(fit.keys) if key not in known]
        keys = tuple(fit.keys[i] for i in free)
        return cls(fit.model, keys, fit.covariance[np.ix_(free, free)])


@dataclass(frozen=True, eq=False)
class ParameterRegion:
    """A joint confidence region: the image of a ball of p dimensions.

    The ball is turned by the correlation of the estimates; along each parameter it reaches to the
    ends of the interval whose half-width is that of the joint region. So the region keeps to the
    ranges of the parameters, and is longer upwards where a standard error grows with the value.
    Amplitudes that are not significantly above zero are at their upper limits, and rate ramps at
    their estimates.

    model: The estimate, with such amplitudes at their limits.
    lower, upper: (p,), ends of the parameters.
    root: (p, p), of the correlation: rows have length 1.
    """

    model: Model
    keys: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, fit: Fit, level: float) -> Self:
        """The region of a fit at a level."""
        free = Estimated.of(fit)
        keys = free.keys
        single = 2.0 * norm.cdf(np.sqrt(chi2.ppf(level, max(len(keys), 1)))) - 1.0
        ends = fit.interval(float(single))
        bounds = dict(fit.upper_bounds)
        for key, end in (*bounds.items(), *((key, ends[key][1]) for key in keys)):
            if not np.isfinite(end):
                raise InputError(
                    f"channel {fit.wv.name!r}: the record does not bound {key}, so no numbers "
                    "cover its confidence region: record longer, or leave out the level"
                )
        errors = np.sqrt(np.diag(free.covariance))
        correlation = free.covariance / np.outer(errors, errors)
        values, vectors = np.linalg.eigh(correlation) if keys else (np.zeros(0), np.zeros((0, 0)))
        return cls(
            model=fit.model.with_params(bounds),
            keys=keys,
            lower=np.array([ends[key][0] for key in keys]),
            upper=np.array([ends[key][1] for key in keys]),
            root=vectors * np.sqrt(np.maximum(values, 0.0)),
        )

    def value(self, i: int, along: float) -> float:
        """A parameter some way to its upper end, or if negative, to its lower one."""
        centre = float(self.model.params[self.keys[i]] or 0.0)
        end = float(self.upper[i] if along > 0.0 else self.lower[i])
        if centre > 0.0 and end > 0.0:
            return centre * (end / centre) ** abs(along)
        return centre + (end - centre) * abs(along)

    def model_at(self, point: FloatArray) -> Model:
        """The model at a point of the unit ball."""
        ways = enumerate((self.root @ point).tolist())
        return self.model.with_params({self.keys[i]: self.value(i, along) for i, along in ways})

    def draws(self, number: int, rng: np.random.Generator) -> FloatArray:
        """Points of the ball, (number, p): half of them on its surface."""
        points = rng.standard_normal((number, len(self.keys)))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        points[::2] *= rng.random((len(points[::2]), 1)) ** (1.0 / max(len(self.keys), 1))
        return points


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """Density of the models of a region, and how it grows along each parameter.

    Only the term that a parameter changes is made anew, not the model.

    free: For each term, numbers and names of its parameters in the region.
    """

    region: ParameterRegion
    terms: list[Process]
    free: list[list[tuple[int, str]]]
    dt: float

    @classmethod
    def of(cls, region: ParameterRegion, dt: float) -> Self:
        model = region.model
        counted = [i for i, t in enumerate(model.terms) if not (t.is_line or t.is_drift)]
        found = {p.key: (p.term, p.parameter.name) for p in model.parameters}
        own = [(i, *found[key]) for i, key in enumerate(region.keys)]
        free = [[(i, name) for i, term, name in own if term == each] for each in counted]
        return cls(region, [model.terms[i] for i in counted], free, dt)

    def _at(self, along: FloatArray) -> list[Process]:
        return [
            term.with_values(**{name: self.region.value(i, float(along[i])) for i, name in free})
            for term, free in zip(self.terms, self.free, strict=True)
        ]

    def density(self, point: FloatArray, f: FloatArray) -> FloatArray:
        terms = self._at(self.region.root @ point)
        return np.sum([term.psd(f, self.dt) for term in terms], axis=0)

    def least(self, point: FloatArray, f: FloatArray) -> tuple[float, FloatArray]:
        """Minus the logarithm of the density at one frequency, and its gradient, in the ball."""
        outside = max(1.0, float(np.linalg.norm(point)))
        inside = point / outside
        along = self.region.root @ inside
        slopes, total = np.zeros(along.size), 0.0
        for term, free in zip(self._at(along), self.free, strict=True):
            own = float(term.psd(f, self.dt)[0])
            total += own
            for i, name in free:
                further = self.region.value(i, float(along[i]) + tuning.REGION_STEP)
                changed = term.with_values(**{name: further}).psd(f, self.dt)[0]
                slopes[i] = (float(changed) - own) / tuning.REGION_STEP
        gradient = -(self.region.root.T @ slopes) / total
        if outside > 1.0:
            gradient = (gradient - inside * (inside @ gradient)) / outside
        return -float(np.log(total)), gradient


def region_spectra(
    target: RequiredSpectrum, fit: Fit, level: float, rivals: Sequence[Model] = ()
) -> tuple[RequiredSpectrum, ...]:
    """Models of a confidence region, one of which has nearly the largest density at any frequency.

    They are drawn, or found by search at frequencies on a grid. Models that fit equally well, and
    those with one more Gauss-Markov process that the data leave open, belong to them.

    Raises InputError if the data do not bound a parameter.
    """
    region = ParameterRegion.of(fit, level)
    dt = target.dt
    others = [
        RequiredSpectrum.of(each, dt, target.horizon) for each in (*rivals, *left_open(fit, level))
    ]
    if not region.keys:
        return (RequiredSpectrum.of(region.model, dt, target.horizon), *others)
    spectrum = _Spectrum.of(region, dt)
    # Slower processes than the estimate change at lower frequencies.
    f = target.frequencies(tuning.REGION_POINTS)
    f = np.append(f[0] * np.array([0.01, 0.1]), f)
    points = list(region.draws(tuning.REGION_DRAWS, np.random.default_rng(tuning.REGION_SEED)))
    densities = [spectrum.density(point, f) for point in points]
    for k in range(f.size):
        start = points[int(np.argmax([each[k] for each in densities]))]
        best = minimize(
            spectrum.least,
            start,
            args=(f[k : k + 1],),
            jac=True,
            method="SLSQP",
            options={"maxiter": 40, "ftol": 1e-6},
            constraints={
                "type": "ineq",
                "fun": lambda p: 1.0 - float(p @ p),
                "jac": lambda p: -2.0 * p,
            },
        ).x
        points.append(best / max(1.0, float(np.linalg.norm(best))))
        densities.append(spectrum.density(points[-1], f))
    fine = np.append(f[:2], target.frequencies(10 * tuning.REGION_POINTS))
    largest = np.unique(np.argmax([spectrum.density(point, fine) for point in points], axis=0))
    models = [region.model_at(points[i]) for i in largest]
    found = [*(RequiredSpectrum.of(model, dt, target.horizon) for model in models), *others]
    largest = np.unique(np.argmax([each.psd(fine) for each in found], axis=0))
    return tuple(found[i] for i in largest)
