"""The Generalized Method of Wavelet Moments.

Guerrier, Skaloud, Stebler & Victoria-Feser (2013), *JASA* 108, 1021-1030; Stebler et al. (2012).
The parameters minimise ``(nu_hat - nu(theta))' Omega (nu_hat - nu(theta))``. By default Omega is
the inverse covariance of the estimates that the fitted model itself implies, iterated to a fixed
point: it is smooth where one computed from the data is noisy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, cast
from weakref import WeakKeyDictionary

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.moments.conclusion import (
    Converged,
    conclude_moments,
    reweighted,
    with_doubtful_terms,
)
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.profile import Point, Profile, search
from gmwm.estimate.moments.weights import (
    WEIGHTS,
    Discrepancy,
    Weights,
    dictionary_fit,
    with_discrepancy,
)
from gmwm.estimate.problem.moments import Compared, Moments, Scales, Simulation, weight_root
from gmwm.estimate.problem.parameters import Coordinates, keys_by_term
from gmwm.estimate.problem.ramp import ols_slope
from gmwm.estimate.result.fit import Fit
from gmwm.issues import notice
from gmwm.process import Model, Process, RateRamp, as_model, parameter
from gmwm.variance import WaveletVariance

DRIFTS = ("slope", "moments")
_converged: WeakKeyDictionary[WaveletVariance, dict[tuple[GMWM, Model], Converged]] = (
    WeakKeyDictionary()
)
"""A selection and the tests of its terms ask for the same model repeatedly."""

_LEAST_ERROR = 1e-12  # of a wavelet variance, relative: that of 1e24 samples


class SquaredRamp(RateRamp):
    """A rate ramp as a term of nu(theta) like any other, which shows its square."""

    R: float = parameter("u/s", "scale", meaning="rate ramp")
    short_name: ClassVar[str] = "_R"
    is_drift: ClassVar[bool] = False


@dataclass(frozen=True)
class GMWM:
    """The Generalized Method of Wavelet Moments, ``method="gmwm"``.

    Parameters
    ----------
    weights : {"model", "data", "diagonal", "identity"}, optional
        Omega: inverse covariance of the wavelet variances, as the fitted model implies it
        (efficient, the default) or estimated from the coefficients; its diagonal, or none.
    discrepancy : float, optional
        Relative error that the model is allowed at each level beyond the statistical one. By
        default it is estimated where the model fails the chi-square test, and zero elsewhere; see
        `gmwm.estimate.moments.weights`.
    drift : {"slope", "moments"}, optional
        A rate ramp is estimated by generalized least squares beside the wavelet variances, or is
        part of nu(theta) to the letter of the paper's eq. (9), which knows it by its square only;
        weights from the data are then those of its eq. (5).
    start : Process, Model or float, optional
        The same model with starting values, or one value for all parameters: the paper's are all
        1.0. A local search from there must reach the minimum of the global one, which needs no
        start; else a notice says so. The lower one is taken.

    Raises
    ------
    InputError
        For unknown weights or drift, or a discrepancy that is not a fraction.
    """

    weights: str = "model"
    discrepancy: float | None = None
    drift: str = "slope"
    start: Process | Model | float | None = None

    name: ClassVar[str] = "gmwm"

    def __post_init__(self) -> None:
        checks.choice("weights", self.weights, WEIGHTS)
        checks.choice("drift", self.drift, DRIFTS)
        if self.start is not None and not checks.is_number(self.start):
            as_model(cast("Model", self.start))
        given = self.discrepancy
        if given is not None and (not checks.is_number(given) or not 0.0 <= given < 1.0):
            raise InputError(
                f"discrepancy = {checks.shown(given)}: give a fraction of the variance, e.g. 0.02"
            )

    def scales(self, wv: WaveletVariance) -> Scales:
        """The levels, and how the model's wavelet variances are found there."""
        return Scales.of(wv)

    def estimate(self, model: Model, wv: WaveletVariance) -> Fit:
        """Fit the open parameters of a model to wavelet variances."""
        ramp = next((term for term in model.terms if term.is_drift and term.is_open), None)
        if self.drift == "moments" and ramp is not None:
            return self._by_square(ramp, model, wv)
        weights = Weights.of(self.weights, wv, self.drift == "moments")
        efficient = replace(self, weights="model", start=None)
        least, missed = efficient._cached(model, wv), []
        root = weights.root(least.covariance, -least.compared.residual)
        profile = Profile(least.design, least.compared.target, root)
        if self.start is not None:
            grid = profile.refine(profile.at(least.point.shapes))
            reached = profile.descend(_started(self.start, least.design.coordinates))
            if self.weights == "model" and reached.objective < grid.objective:
                least = least.moved(reached)
            if reached.objective > grid.objective + tuning.SAME_MINIMUM:
                values = {"objective": reached.objective, "least": grid.objective}
                missed.append(notice("start-missed", "", values))
        other = least
        if self.weights != "model":
            other = replace(least.moved(search(profile)), root=root)

        def without(i: int) -> Converged | None:
            place = least.design.terms[i].place
            left = tuple(term for k, term in enumerate(model.terms) if k != place)
            if not any(term.is_open for term in left) or all(t.is_drift or t.is_line for t in left):
                return None
            return efficient._cached(Model(left), wv)

        fit = conclude_moments(least, wv, self.name)
        fit = with_doubtful_terms(fit, least, without)
        if other is not least:
            fit = reweighted(fit, least, other, self.weights)
        return replace(fit, notices=(*fit.notices, *missed)) if missed else fit

    def _by_square(self, ramp: Process, model: Model, wv: WaveletVariance) -> Fit:
        """The fit with a ramp as a term of nu(theta), whose sign the series tells."""
        if not np.any(wv.drift_response):
            raise InputError(
                f'{wv.wavelet!r} does not see a drift: use "haar", or leave out drift = "moments"'
            )
        squared = [SquaredRamp() if term is ramp else term for term in model.terms]
        found = self.estimate(Model(tuple(squared)), wv)
        size = math.copysign(found.params["R"], ols_slope(wv).value)
        return replace(found, model=model.with_params({**found.params, "R": size}))

    def _cached(self, model: Model, wv: WaveletVariance) -> Converged:
        """The minimum, searched once for each model and series."""
        if not all(term.is_plain for term in model.terms):
            return self._solve(model, wv)
        known, key = _converged.setdefault(wv, {}), (self, model)
        if key not in known:
            known[key] = self._solve(model, wv)
        return known[key]

    def _solve(self, model: Model, wv: WaveletVariance) -> Converged:
        """The minimum under weights that belong to it."""
        scales = self.scales(wv)
        design, moments = Design(model, scales), Moments.of(wv, model, scales)
        noise = design.coordinates.noise
        # A slope is least certain under noise fitted with the drift in it. Started as if it were
        # known, a walk can stay at zero, which makes it known.
        moments = moments.under(dictionary_fit(wv, wv.variance, noise).mixture)
        problem = _Problem(design, moments)
        reference = dictionary_fit(wv, moments.target, noise)
        level = Discrepancy(self.discrepancy, wv.tau.size > design.n_free)
        first = [level.value]
        if not any(process.is_line for process in noise):
            # The misfit of a sum of all kinds is discrepancy from the start. But processes that are
            # not in the reference mixture on their own may follow what it cannot.
            level.start_at(reference.discrepancy)
            first.append(level.value)
            if all(process.is_candidate for process in noise):
                del first[0]

        def end(value: float) -> Converged | None:
            level.value = value
            return _iterate(problem, reference.weights(problem.moments.target, value), level)

        found = None
        for value in dict.fromkeys(first):
            found = end(value)
            if found is not None and level.value == 0.0:
                break
        if found is not None and found.discrepancy > 0.0 and len(first) > 1:
            # What no mixture follows the model itself may follow, under its own weights.
            level.value = 0.0
            again = _iterate(problem, found.compared.statistical, level) or found
            found = min(found, again, key=lambda each: each.discrepancy)
            level.value = found.discrepancy
        is_large = self.discrepancy is None and level.value > tuning.DISCREPANCY_LARGE
        if found is not None and is_large:
            other = end(tuning.DISCREPANCY_NOTABLE) or found
            found = min(found, other, key=lambda each: each.discrepancy)
        found = found or _under_reference(problem, level)
        if self.discrepancy is None and found.discrepancy > tuning.DISCREPANCY_NESTED:
            found = self._as_good_as_nested(found, problem)
        return found

    def _as_good_as_nested(self, found: Converged, problem: _Problem) -> Converged:
        """The minimum under the weights of a nested model, if it needs less discrepancy."""
        terms, wv = problem.design.model.terms, problem.moments.wv
        noise = {term: i for i, term in enumerate(terms) if term.is_open and not term.is_drift}
        for i in noise.values():
            left = (*terms[:i], *terms[i + 1 :])
            if all(term.is_drift or term.is_line for term in left):
                continue
            nested = self._cached(Model(left), wv)
            if nested.discrepancy < found.discrepancy:
                point = problem.search(nested.compared.target, nested.covariance)
                found = replace(nested, design=problem.design).moved(point)
        return found


def _started(start: Process | Model | float, coordinates: Coordinates) -> list[Process]:
    """The noise terms with starting values."""
    model = coordinates.model
    if checks.is_number(start):
        given: dict[str, float | None] = dict.fromkeys(model.params, float(cast("float", start)))
    else:
        given = as_model(cast("Model", start)).params
    if given.keys() != model.params.keys() or None in given.values():
        raise InputError(
            f"start = {start!r}: repeat the model {model!r} with a number for every parameter, or "
            "give one number for all"
        )
    keys, terms = keys_by_term(model), list(coordinates.noise)
    for i, name in coordinates.names:
        terms[i] = terms[i].with_values(**{name: given[keys[coordinates.terms[i].place, name]]})
    return terms


@dataclass(frozen=True)
class SimulatedMoments(GMWM):
    """GMWM with the model's wavelet variances found by simulation, ``method="simulated"``.

    Indirect inference, for processes that can only be simulated.

    Parameters
    ----------
    weights, discrepancy, drift, start
        As of `GMWM`.
    replications : int, optional
        Number of simulated series as long as the data. The covariance of the estimates grows by
        one part in so many.
    seed : int, optional
        Of these series.
    single : bool, optional
        Whether they are one series of their total length, R T in the paper; a walk then goes on.

    Raises
    ------
    InputError
        If ``replications`` is not a positive integer, ``seed`` negative, or ``single`` no truth.
    """

    replications: int = 10
    seed: int = 0
    single: bool = False

    name: ClassVar[str] = "simulated"

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.whole("replications", self.replications, 1)
        checks.whole("seed", self.seed, 0)
        checks.truth("single", self.single)

    def scales(self, wv: WaveletVariance) -> Scales:
        simulation = Simulation(int(self.replications), int(self.seed), self.single)
        return replace(Scales.of(wv), simulation=simulation, simulate_all=True)


@dataclass(frozen=True, eq=False)
class _Problem:
    """A model, and the moments of a series before a first fit."""

    design: Design
    moments: Moments

    def search(self, target: FloatArray, covariance: FloatArray) -> Point:
        """The global minimum under the weights of a covariance of the moments."""
        return search(Profile(self.design, target, weight_root(covariance)))

    def dof(self, point: Point) -> int:
        """Levels less the parameters of terms that have an amplitude; one without fits nothing."""
        present = self.design.amplitudes(point.x) > 0.0
        return int(
            self.moments.wv.tau.size - sum(present[i] for i, _ in self.design.coordinates.owners)
        )


def _iterate(problem: _Problem, relaxed: FloatArray, level: Discrepancy) -> Converged | None:
    """Iterate theta -> minimum under the weights that theta implies; ``None`` if it wanders.

    It starts at the minimum under a covariance ``relaxed``. Where it oscillates about the fixed
    point, the weights are moved by part of the way only (Aitken's relaxation).
    """
    design, moments = problem.design, problem.moments
    point = problem.search(moments.target, relaxed)
    part, least = 1.0, np.inf
    curve = design.implied(point.x, point.shapes)
    step = np.zeros_like(curve)
    for rounds in range(1, tuning.MAX_ROUNDS + 1):
        noise = design.fitted_noise(point.x, point.shapes)
        moments = moments.under(noise, part)
        target, statistical = moments.target, moments.covariance(noise)
        covariance = with_discrepancy(statistical, target, level.value)
        relaxed = covariance if rounds == 1 else (1.0 - part) * relaxed + part * covariance
        deviation = np.sqrt(np.diag(covariance))
        if not np.all(deviation > _LEAST_ERROR * np.abs(target)):
            return None  # a level without any noise of the model would outweigh all others
        if rounds == 1:  # weights from a first fit may point elsewhere: search anew, then follow
            point = problem.search(target, relaxed)
        else:
            lost = moments.lost(design.unit_terms(point.shapes))
            given = target if lost is None else moments.detrended
            profile = Profile(design, given, weight_root(relaxed), lost=lost)
            point = profile.refine(profile.at(point.shapes))
        previous, curve = curve, design.implied(point.x, point.shapes)
        before, step = step, (curve - previous) / deviation
        largest = float(np.max(np.abs(step)))
        least = min(least, largest)
        if rounds == tuning.WANDERING_ROUNDS and least > tuning.WANDERING_STEP:
            return None
        converged = largest < tuning.SETTLED
        # A discrepancy does not enter before the weights settle, where any model looks wrong.
        if converged or (level.value > 0.0 and rounds % tuning.DISCREPANCY_EVERY == 0):
            compared = Compared(target, curve, statistical, previous, moments.taken)
            changed = level.update(compared, problem.dof(point))
            if converged and not changed:
                compared, root = replace(compared, basis=curve), weight_root(covariance)
                return Converged(
                    design, moments.found, compared, covariance, root, point, level.value
                )
        elif rounds > 1:
            ratio = float(step @ before) / max(float(before @ before), 1e-300)
            part = float(np.clip(part / max(1.0 - ratio, 0.5), tuning.LEAST_PART, 1.0))
    return None


def _under_reference(problem: _Problem, level: Discrepancy) -> Converged:
    """The minimum under the weights of the reference mixture.

    The weights of a model that misses part of the noise depend on the very parameters that try to
    make up for it, and their iteration may have no fixed point. The mixture misses nothing.
    """
    design, moments = problem.design, problem.moments
    noise = design.coordinates.noise
    for _ in range(tuning.REFERENCE_ROUNDS):
        reference = dictionary_fit(moments.wv, moments.target, noise)
        moments = moments.under(reference.mixture)
    reference = dictionary_fit(moments.wv, moments.target, noise)
    target, statistical = moments.target, moments.covariance(reference.mixture)
    level.value = level.given or 0.0
    for _ in range(tuning.REFERENCE_ROUNDS):
        covariance = with_discrepancy(statistical, target, level.value)
        point = problem.search(target, covariance)
        implied = design.implied(point.x, point.shapes)
        compared = Compared(target, implied, statistical, reference.curve, moments.taken)
        if not level.update(compared, problem.dof(point)):
            break
    root = weight_root(covariance)
    return Converged(design, moments.found, compared, covariance, root, point, level.value)
