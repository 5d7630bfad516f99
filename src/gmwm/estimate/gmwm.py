"""The Generalized Method of Wavelet Moments.

Guerrier, Skaloud, Stebler & Victoria-Feser (2013), *JASA* 108, 1021-1030; Stebler et al. (2012).
The parameters minimise ``(nu_hat - nu(theta))' Omega (nu_hat - nu(theta))``. By default Omega is
the inverse covariance of the estimates that the fitted model itself implies, iterated to a fixed
point: it is smooth where one computed from the data is noisy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.design import Design
from gmwm.estimate.discrepancy import Discrepancy
from gmwm.estimate.fit import Fit
from gmwm.estimate.moments import Moments
from gmwm.estimate.profile import Point, Profile
from gmwm.estimate.scales import Scales
from gmwm.estimate.simulation import Simulation
from gmwm.estimate.start import dictionary_fit, search
from gmwm.estimate.uncertainty import describe
from gmwm.estimate.weights import Weights
from gmwm.process import Model, Process, Sinusoid
from gmwm.variance.wavelet import WaveletVariance

_MAX_ROUNDS = 40
_REFERENCE_ROUNDS = 3
_LEAST_PART = 0.05
_DISCREPANCY_EVERY = 3
_TOLERANCE = 1e-4  # of the implied curve from round to round, in standard deviations of the data


def fit_gmwm(
    model: Model,
    wv: WaveletVariance,
    *,
    omega: str = "model",
    discrepancy: float | None = None,
) -> Fit:
    """Estimate by the method of wavelet moments; see `gmwm.fit` for the parameters."""
    return _fit(model, wv, Scales.of(wv), "gmwm", omega, discrepancy)


def fit_simulated(
    model: Model,
    wv: WaveletVariance,
    *,
    omega: str = "model",
    discrepancy: float | None = None,
    replications: int = 10,
    seed: int = 0,
) -> Fit:
    """The same with simulated moments; see `gmwm.fit` for the parameters."""
    simulation = Simulation.of(replications, seed)
    scales = replace(Scales.of(wv), simulation=simulation, simulate_all=True)
    return _fit(model, wv, scales, "simulated", omega, discrepancy)


def _fit(
    model: Model,
    wv: WaveletVariance,
    scales: Scales,
    method: str,
    omega: str,
    discrepancy: float | None,
) -> Fit:
    weights = Weights.of(omega, wv)
    if discrepancy is not None and not 0.0 <= discrepancy < 1.0:
        raise InputError(f"discrepancy = {discrepancy!r}: give a share of the variance, e.g. 0.02")
    design = Design(model, scales)
    if not design.terms:
        raise InputError(f"{model!r} has no noise process: add WhiteNoise() at least")
    moments = Moments.of(wv, model, scales)
    extra = tuple(term.process for term in design.terms)
    reference = dictionary_fit(wv, moments.target, extra)
    level = Discrepancy(discrepancy, wv.tau.size - design.n_free)
    if not any(isinstance(process, Sinusoid) for process in extra):
        # What no sum of processes without lines can follow is discrepancy from the start.
        level.start_at(reference.discrepancy)
    covariance = level.added_to(reference.covariance, moments.target)
    point = search(Profile(design, moments.target, weights.root(covariance)))
    state = State(moments, covariance, point, reference.curve)
    settled = _iterate(design, state, level, weights)
    if settled is None:
        settled = _under_reference(design, state, level, weights, extra)
    return describe(
        design, settled.moments.target, settled.covariance, settled.point, settled.moments.slope,
        basis=settled.basis, wv=wv, weights=weights, method=method,
        slope_is_free=moments.slope_is_free, discrepancy=level.value,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class State:
    """Where an estimation stands.

    Attributes
    ----------
    moments : Moments
    covariance : (J, J) ndarray
        Of the moments, with the discrepancy, u^4.
    point : Point
        The minimum under it.
    basis : (J,) ndarray
        The wavelet variances to which the covariance belongs, u^2.
    """

    moments: Moments
    covariance: FloatArray
    point: Point
    basis: FloatArray


def _iterate(design: Design, start: State, level: Discrepancy, weights: Weights) -> State | None:
    """Iterate theta -> minimum under the weights that theta implies; ``None`` if it wanders.

    Where it swings about the fixed point, the weights are moved by part of the way only (Aitken's
    relaxation).
    """
    moments, relaxed, point = start.moments, start.covariance, start.point
    part = 1.0
    curve = _implied(design, point)
    step = np.zeros_like(curve)
    for rounds in range(1, _MAX_ROUNDS + 1):
        noise = design.fitted_noise(point.x, point.shapes)
        moments = moments.under(noise, part)
        statistical = moments.covariance(noise)
        covariance = level.added_to(statistical, moments.target)
        relaxed = covariance if rounds == 1 else (1.0 - part) * relaxed + part * covariance
        profile = Profile(design, moments.target, weights.root(relaxed))
        # Weights from a first fit may point elsewhere: search anew once, then follow.
        point = search(profile) if rounds == 1 else profile.refine(profile.at(point.shapes))
        previous, curve = curve, _implied(design, point)
        before, step = step, (curve - previous) / np.sqrt(np.diag(covariance))
        converged = bool(np.max(np.abs(step)) < _TOLERANCE)
        if converged or _discrepancy_is_due(level.value, rounds):
            changed = level.update(moments.target - curve, statistical, moments.target, previous)
            if converged and not changed:
                return State(moments, covariance, point, curve)
        elif rounds > 1:
            ratio = float(step @ before) / max(float(before @ before), 1e-300)
            part = float(np.clip(part / max(1.0 - ratio, 0.5), _LEAST_PART, 1.0))
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
    for _ in range(_REFERENCE_ROUNDS):
        reference = dictionary_fit(wv, moments.target, extra)
        moments = moments.under(reference.mixture)
    reference = dictionary_fit(wv, moments.target, extra)
    statistical = moments.covariance(reference.mixture)
    level.restart()
    for _ in range(_REFERENCE_ROUNDS):
        covariance = level.added_to(statistical, moments.target)
        point = search(Profile(design, moments.target, weights.root(covariance)))
        residual = moments.target - _implied(design, point)
        if not level.update(residual, statistical, moments.target, reference.curve):
            break
    return State(moments, covariance, point, reference.curve)


def _discrepancy_is_due(value: float, rounds: int) -> bool:
    """Whether to update the discrepancy before the weights have settled: if there is one.

    It does not enter on the way, where any model looks wrong.
    """
    return value > 0.0 and rounds % _DISCREPANCY_EVERY == 0


def _implied(design: Design, point: Point) -> FloatArray:
    return np.asarray(design.curves(point.shapes) @ design.amplitudes(point.x))
