"""From estimates of the noise, however found, to a `Fit`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import chi2

from gmwm._typing import FloatArray
from gmwm.estimate.coordinates import Coordinates, fitted_model
from gmwm.estimate.discrepancy import chi_square, suffices
from gmwm.estimate.fit import Fit
from gmwm.estimate.information import error_growth, slope_dof
from gmwm.estimate.moments import Moments
from gmwm.estimate.profile import weight_root
from gmwm.estimate.ramp import Slope
from gmwm.estimate.remarks import (
    NO_TEST,
    bound_remarks,
    merged_remarks,
    undetermined_remarks,
    worst_misfit,
)
from gmwm.estimate.uncertainty import SIGNIFICANT, in_model_order, quantile_above_zero
from gmwm.process import Model, Process, RateRamp
from gmwm.variance.wavelet import WaveletVariance


def conclude(
    coordinates: Coordinates,
    processes: Sequence[Process],
    covariance: FloatArray,
    slope: Slope | None,
    wv: WaveletVariance,
    *,
    method: str,
    log_likelihood: float,
    absent: Mapping[int, float],
    is_bridged: bool = False,
    remarks: Sequence[str] = (),
    trace: Sequence[float] = (),
) -> Fit:
    """Make the `Fit` of estimates that maximise a likelihood.

    Parameters
    ----------
    coordinates : Coordinates
        Of the whole model.
    processes : sequence of Process
        Its noise terms with their estimates, those without amplitude included.
    covariance : (d, d) ndarray
        Of the coordinates of the terms that have an amplitude.
    slope : Slope or None
        Estimated slope of the ramp, ``None`` where there is none to estimate.
    wv : WaveletVariance
        Of the series, for the test of the fit.
    method : str
    log_likelihood : float
    absent : mapping of int to float
        Noise term of zero amplitude -> 95 % upper bound of the amplitude.
    is_bridged : bool
        Whether ``wv`` is that of a series whose gaps are bridged by lines. Nothing is then said
        of how the model agrees with it.
    remarks, trace : sequence
        See `Fit`.
    """
    values = dict(zip(coordinates.places, processes, strict=True))
    for place, term in enumerate(coordinates.model.terms):
        if isinstance(term, RateRamp) and slope is not None:
            values[place] = term.with_values(R=slope.value)
    model, keys_of = fitted_model(coordinates.model, values)
    present = [k for k, (i, _) in enumerate(coordinates.owners) if i not in absent]
    transform = coordinates.jacobian(processes)[np.ix_(present, present)]
    names = [coordinates.names[k] for k in present]
    keys = [keys_of[coordinates.places[i], name] for i, name in names]
    matrix = transform @ covariance @ transform.T
    upper = {
        keys_of[coordinates.places[i], _linear(processes[i])]: bound for i, bound in absent.items()
    }
    upper |= _insignificant(coordinates, processes, covariance, present, keys)
    growth = error_growth(model, keys, wv.n, wv.dt)
    dof = np.inf
    if slope is not None:
        dof = slope_dof(model, keys, matrix, wv.n, wv.dt)
        keys.append(next(i.key for i in model.parameters if i.parameter.role == "slope"))
        matrix = np.pad(matrix, (0, 1))
        matrix[-1, -1] = slope.variance
    ordered, matrix = in_model_order(model, tuple(keys), matrix)
    said = [
        *remarks,
        *bound_remarks(model, upper),
        *undetermined_remarks(model, ordered, matrix),
        *merged_remarks(model, ordered, matrix),
    ]
    noise = Model(tuple(p for i, p in enumerate(processes) if i not in absent))
    objective, p_value, levels, misfits, poor = _agreement(
        coordinates.model, noise, slope, wv, len(present)
    )
    if is_bridged:
        p_value, poor, misfits = float("nan"), False, [NO_TEST]
    return Fit(
        model=model,
        wv=wv,
        keys=ordered,
        covariance=matrix,
        upper_bounds=upper,
        objective=objective,
        dof=levels,
        discrepancy=0.0,
        p_value=p_value,
        method=method,
        omega="",
        valid=not said and not poor,
        remarks=(*said, *misfits),
        log_likelihood=log_likelihood,
        trace=tuple(trace),
        slope_dof=dof,
        error_growth=growth,
    )


def _linear(process: Process) -> str:
    return next(p.name for p in process.parameters if p.linear)


def _insignificant(
    coordinates: Coordinates,
    processes: Sequence[Process],
    covariance: FloatArray,
    present: Sequence[int],
    keys: Sequence[str],
) -> dict[str, float]:
    """Upper bounds of amplitudes without a shape that are not significantly above zero."""
    shaped = {i for i, is_amplitude in coordinates.owners if not is_amplitude}
    upper = {}
    for row, k in enumerate(present):
        i, is_amplitude = coordinates.owners[k]
        deviation = float(np.sqrt(covariance[row, row]))
        if is_amplitude and i not in shaped and deviation > 1.0 / SIGNIFICANT:
            power = next(p.power for p in processes[i].parameters if p.linear)
            value = float(processes[i].values[_linear(processes[i])] or 0.0)
            upper[keys[row]] = value * quantile_above_zero(1.0, deviation) ** (1.0 / power)
    return upper


def _agreement(
    model: Model, noise: Model, slope: Slope | None, wv: WaveletVariance, n_free: int
) -> tuple[float, float, int, list[str], bool]:
    """How the wavelet variances agree with the fitted noise: as in the method of moments."""
    moments = Moments.of(wv, model)
    if slope is not None:
        moments = Moments(wv, slope, True, moments.scales)
    covariance = moments.covariance(noise)
    target, implied = moments.target, noise.wavelet_variance(wv.tau, wv.dt, wv.wavelet)
    residual = target - implied
    whitened = weight_root(covariance) @ residual
    dof = target.size - n_free
    p_value = float("nan")
    if dof > 0 and np.all(implied > 0.0):
        p_value = float(chi2.sf(chi_square(target, implied, covariance, implied)[1], dof))
    misfits: list[str] = []
    poor = False
    if not suffices(0.0, residual, covariance, target, implied, max(dof, 1)):
        worst, tau, poor = worst_misfit(wv, target, implied, np.diag(covariance))
        misfits.append(
            "the model differs from the data by more than their statistical errors (largest "
            f"misfit of the deviation {100.0 * worst:.2g} % at tau = {tau:.3g} s)"
        )
    return float(whitened @ whitened), p_value, dof, misfits, poor
