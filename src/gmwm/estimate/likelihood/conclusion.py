"""From the maximum of a likelihood to a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gmwm._core.notices import Notice
from gmwm.estimate.likelihood.series import Series
from gmwm.estimate.moments import suffices
from gmwm.estimate.problem import Moments
from gmwm.estimate.result import (
    Comparison,
    Estimates,
    Fit,
    conclude,
    no_test_notice,
)
from gmwm.process import Model


def conclude_likelihood(
    series: Series,
    found: Estimates,
    *,
    method: str,
    log_likelihood: float,
    notices: Sequence[Notice] = (),
    trace: Sequence[float] = (),
) -> Fit:
    """Make the `Fit` of estimates that maximise a likelihood.

    Where the wavelet variances are those of a series whose gaps are bridged by lines, nothing is
    concluded from how the model agrees with them.

    series: What was fitted; its wavelet variances test the fit.
    notices, trace: See `Fit`.
    """
    comparison, agrees = _compared(series, found)
    misfits = not (agrees or series.is_bridged)
    if series.is_bridged:
        untested = float("nan")
        comparison = replace(comparison, chi_square=untested, chi_square_allowed=untested)
        notices = (*notices, no_test_notice())
    return conclude(
        found, comparison, series.wv, method=method, misfits=misfits, notices=notices,
        log_likelihood=log_likelihood, trace=trace,
    )  # fmt: skip


def _compared(series: Series, found: Estimates) -> tuple[Comparison, bool]:
    """How the wavelet variances agree with the fitted noise, and whether they do."""
    wv = series.wv
    moments = Moments.of(wv, found.coordinates.model)
    if found.slope is not None:
        moments = Moments(wv, found.slope, True, moments.scales)
    present = (p for i, p in enumerate(found.processes) if i not in found.absent)
    noise = Model(tuple(present))
    covariance, target = moments.covariance(noise), moments.target
    implied = noise.wavelet_variance(wv.tau, wv.dt, wv.wavelet)
    comparison = Comparison.of(target, implied, covariance, implied, len(found.present))
    agrees = suffices(0.0, target - implied, covariance, target, implied, max(comparison.dof, 1))
    return comparison, agrees
