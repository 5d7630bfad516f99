"""The Generalized Method of Wavelet Moments.

Guerrier, Skaloud, Stebler & Victoria-Feser (2013), *JASA* 108, 1021-1030; Stebler et al. (2012).
The parameters minimise ``(nu_hat - nu(theta))' Omega (nu_hat - nu(theta))``. By default Omega is
the inverse covariance of the estimates that the fitted model itself implies, iterated to a fixed
point: it is smooth where one computed from the data is noisy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar
from weakref import WeakKeyDictionary

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.moments.conclusion import conclude_moments, goodness_of
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.discrepancy import Discrepancy
from gmwm.estimate.moments.profile import Point, Profile
from gmwm.estimate.moments.start import DICTIONARY, Reference, dictionary_fit, search
from gmwm.estimate.moments.weights import WEIGHTS, Weights
from gmwm.estimate.problem import Moments, Scales, Simulation, Slope, is_plain
from gmwm.estimate.result import Fit, Goodness
from gmwm.process import Model, Process
from gmwm.variance import WaveletVariance


@dataclass(frozen=True, eq=False)
class End:
    """Where an estimation ended, without the series: kept with it, this must not keep it.

    slope: Drift removed from the wavelet variances.
    covariance, statistical, point, basis: As of `State`.
    """

    design: Design
    slope: Slope | None
    covariance: FloatArray
    statistical: FloatArray
    point: Point
    basis: FloatArray
    discrepancy: float

    def moments(self, wv: WaveletVariance) -> Moments:
        """What was fitted."""
        return replace(Moments.of(wv, self.design.model, self.design.scales), slope=self.slope)


_ends: WeakKeyDictionary[WaveletVariance, dict[tuple[GMWM, Model], End]] = WeakKeyDictionary()
"""A selection and the tests of its terms ask for the same model again."""


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
        `gmwm.estimate.moments.discrepancy`.

    Raises
    ------
    InputError
        For unknown weights, or a discrepancy that is not a fraction.
    """

    weights: str = "model"
    discrepancy: float | None = None

    name: ClassVar[str] = "gmwm"

    def __post_init__(self) -> None:
        checks.choice("weights", self.weights, WEIGHTS)
        given = self.discrepancy
        if given is not None and (not checks.is_number(given) or not 0.0 <= given < 1.0):
            raise InputError(
                f"discrepancy = {checks.shown(given)}: give a fraction of the variance, e.g. 0.02"
            )

    def scales(self, wv: WaveletVariance) -> Scales:
        """How the model's wavelet variances are found."""
        return Scales.of(wv)

    def estimate(self, model: Model, wv: WaveletVariance) -> Fit:
        """Fit the open parameters of a model to wavelet variances."""

        def without(i: int) -> Goodness | None:
            noise = [k for k, term in enumerate(model.terms) if not term.is_drift]
            left = tuple(term for k, term in enumerate(model.terms) if k != noise[i])
            if not any(term.is_open for term in left) or all(t.is_drift or t.is_line for t in left):
                return None
            found = self._ended(Model(left), wv)
            return goodness_of(found.design, found.moments(wv), found.point, found.discrepancy)

        found = self._ended(model, wv)
        return conclude_moments(
            found.design, found.moments(wv), found.covariance, found.statistical, found.point,
            found.basis, Weights.of(self.weights, wv), self.name, found.discrepancy, without,
        )  # fmt: skip

    def _ended(self, model: Model, wv: WaveletVariance) -> End:
        """Where the estimation ends; searched once for each model and series."""
        if not all(is_plain(term) for term in model.terms):
            return self._searched(model, wv)
        known, key = _ends.setdefault(wv, {}), (self, model)
        if key not in known:
            known[key] = self._searched(model, wv)
        return known[key]

    def _searched(self, model: Model, wv: WaveletVariance) -> End:
        weights = Weights.of(self.weights, wv)
        scales = self.scales(wv)
        design = Design(model, scales)
        moments = Moments.of(wv, model, scales)
        extra = design.coordinates.noise
        reference = dictionary_fit(wv, moments.target, extra)
        level = Discrepancy(self.discrepancy, wv.tau.size - design.n_free)
        beginnings = [level.value]
        if not any(process.is_line for process in extra):
            # What no sum of processes without lines can follow is discrepancy from the start. But
            # processes of other kinds may follow what no mixture of the dictionary does.
            level.start_at(reference.discrepancy)
            beginnings.append(level.value)
            if all(isinstance(process, DICTIONARY) for process in extra):
                del beginnings[0]
        settled = None
        for value in dict.fromkeys(beginnings):
            level.value = value
            state = _begun(design, moments, reference, level, weights)
            settled = _iterate(design, state, level, weights)
            if settled is not None and level.value == 0.0:
                break
        if settled is None:
            settled = _under_reference(design, state, level, weights, extra)
        return End(
            design, settled.moments.slope, settled.covariance, settled.statistical, settled.point,
            settled.basis, level.value,
        )  # fmt: skip


@dataclass(frozen=True)
class SimulatedMoments(GMWM):
    """The same with the model's wavelet variances found by simulation, ``method="simulated"``.

    Indirect inference, for processes that can only be simulated.

    Parameters
    ----------
    weights, discrepancy
        As of `GMWM`.
    replications : int, optional
        Number of simulated series as long as the data. The covariance of the estimates grows by
        one part in so many.
    seed : int, optional
        Of these series.

    Raises
    ------
    InputError
        If ``replications`` is not a positive integer, or ``seed`` is negative.
    """

    replications: int = 10
    seed: int = 0

    name: ClassVar[str] = "simulated"

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.whole("replications", self.replications, 1)
        checks.whole("seed", self.seed, 0)

    def scales(self, wv: WaveletVariance) -> Scales:
        simulation = Simulation(int(self.replications), int(self.seed))
        return replace(Scales.of(wv), simulation=simulation, simulate_all=True)


@dataclass(frozen=True, eq=False)
class State:
    """Where an estimation stands.

    covariance: (J, J), of the moments, with the discrepancy, u^4.
    statistical: (J, J), the same without it.
    point: The minimum under it.
    basis: (J,), the wavelet variances to which the covariance belongs, u^2.
    """

    moments: Moments
    covariance: FloatArray
    statistical: FloatArray
    point: Point
    basis: FloatArray


def _begun(
    design: Design, moments: Moments, reference: Reference, level: Discrepancy, weights: Weights
) -> State:
    """The minimum under the weights of the reference mixture."""
    covariance = level.added_to(reference.covariance, moments.target)
    point = search(Profile(design, moments.target, weights.root(covariance)))
    return State(moments, covariance, reference.covariance, point, reference.curve)


def _iterate(design: Design, start: State, level: Discrepancy, weights: Weights) -> State | None:
    """Iterate theta -> minimum under the weights that theta implies; ``None`` if it wanders.

    Where it swings about the fixed point, the weights are moved by part of the way only (Aitken's
    relaxation).
    """
    moments, relaxed, point = start.moments, start.covariance, start.point
    part, least = 1.0, np.inf
    curve = _implied(design, point)
    step = np.zeros_like(curve)
    for rounds in range(1, tuning.MAX_ROUNDS + 1):
        noise = design.fitted_noise(point.x, point.shapes)
        moments = moments.under(noise, part)
        statistical = moments.covariance(noise)
        covariance = level.added_to(statistical, moments.target)
        relaxed = covariance if rounds == 1 else (1.0 - part) * relaxed + part * covariance
        if np.min(np.diag(relaxed)) < np.finfo(float).tiny:
            return None  # a noise that some level has nothing of gives it a weight beyond all
        profile = Profile(design, moments.target, weights.root(relaxed))
        # Weights from a first fit may point elsewhere: search anew once, then follow.
        point = search(profile) if rounds == 1 else profile.refine(profile.at(point.shapes))
        previous, curve = curve, _implied(design, point)
        before, step = step, (curve - previous) / np.sqrt(np.diag(covariance))
        largest = float(np.max(np.abs(step)))
        least = min(least, largest)
        if rounds == tuning.WANDERING_ROUNDS and least > tuning.WANDERING_STEP:
            return None
        converged = largest < tuning.SETTLED
        if converged or _discrepancy_is_due(level.value, rounds):
            changed = level.update(moments.target - curve, statistical, moments.target, previous)
            if converged and not changed:
                return State(moments, covariance, statistical, point, curve)
        elif rounds > 1:
            ratio = float(step @ before) / max(float(before @ before), 1e-300)
            part = float(np.clip(part / max(1.0 - ratio, 0.5), tuning.LEAST_PART, 1.0))
    return None


def _under_reference(
    design: Design, start: State, level: Discrepancy, weights: Weights, extra: tuple[Process, ...]
) -> State:
    """The minimum under the weights of the reference mixture.

    The weights of a model that misses part of the noise depend on the very parameters that try to
    make up for it, and their iteration may have no fixed point. The mixture misses nothing.
    """
    moments = start.moments
    wv = moments.wv
    for _ in range(tuning.REFERENCE_ROUNDS):
        reference = dictionary_fit(wv, moments.target, extra)
        moments = moments.under(reference.mixture)
    reference = dictionary_fit(wv, moments.target, extra)
    statistical = moments.covariance(reference.mixture)
    level.restart()
    for _ in range(tuning.REFERENCE_ROUNDS):
        covariance = level.added_to(statistical, moments.target)
        point = search(Profile(design, moments.target, weights.root(covariance)))
        residual = moments.target - _implied(design, point)
        if not level.update(residual, statistical, moments.target, reference.curve):
            break
    return State(moments, covariance, statistical, point, reference.curve)


def _discrepancy_is_due(value: float, rounds: int) -> bool:
    """Whether to update the discrepancy before the weights have settled: if there is one.

    It does not enter on the way, where any model looks wrong.
    """
    return value > 0.0 and rounds % tuning.DISCREPANCY_EVERY == 0


def _implied(design: Design, point: Point) -> FloatArray:
    return np.asarray(design.curves(point.shapes) @ design.amplitudes(point.x))
