"""The one place where the estimates of a method become a `Fit`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.problem import (
    Coordinates,
    Slope,
    chi_square,
    drift_key,
    in_model_order,
    slope_dof,
    weight_root,
)
from gmwm.estimate.result.fit import Fit
from gmwm.estimate.result.intervals import upper_amplitude
from gmwm.estimate.result.remarks import (
    estimate_notices,
    misfit_notices,
    missed_level_notices,
)
from gmwm.issues import Notice
from gmwm.process import Process
from gmwm.variance import WaveletVariance


@dataclass(frozen=True, eq=False)
class Estimates:
    """Estimates of the noise terms of a model by some method.

    coordinates: Of the whole model.
    processes: Its noise terms with their values, those of zero amplitude included.
    covariance: (d, d), of the coordinates of the terms that have an amplitude.
    absent: Noise term of zero amplitude -> 95 % upper limit of its scale.
    slope: Of the rate ramp, where it is estimated.
    method, weights, discrepancy, log_likelihood, trace: See `Fit`.
    notices: Those that only the method finds.
    """

    coordinates: Coordinates
    processes: Sequence[Process]
    covariance: FloatArray
    absent: Mapping[int, float]
    slope: Slope | None
    method: str
    weights: str = ""
    discrepancy: float = 0.0
    notices: Sequence[Notice] = ()
    log_likelihood: float = float("nan")
    trace: Sequence[float] = ()

    @property
    def present(self) -> list[int]:
        """Coordinates of the terms that have an amplitude."""
        owners = self.coordinates.owners
        return [k for k, (i, _) in enumerate(owners) if i not in self.absent]


@dataclass(frozen=True)
class Comparison:
    """Agreement of wavelet variances with those of a model.

    objective: Weighted sum of squares.
    chi_square: Sum of squares on cube roots under statistical errors; NaN where it has no meaning.
    chi_square_allowed: With the discrepancy in the errors.
    dof: Levels less parameters.
    """

    objective: float
    chi_square: float
    chi_square_allowed: float
    dof: int

    @classmethod
    def of(
        cls,
        target: FloatArray,
        implied: FloatArray,
        covariance: FloatArray,
        basis: FloatArray,
        n_free: int,
        statistical: FloatArray | None = None,
    ) -> Comparison:
        """Compare under a covariance that belongs to the wavelet variances ``basis``.

        ``statistical`` is the covariance less the discrepancy, where there is one.
        """
        whitened = weight_root(covariance) @ (target - implied)
        dof = target.size - n_free
        plain = allowed = float("nan")
        if dof > 0 and np.all(basis > 0.0):
            plain = allowed = chi_square(target, implied, covariance, basis)[1]
            if statistical is not None:
                plain = chi_square(target, implied, statistical, basis)[1]
        return cls(float(whitened @ whitened), plain, allowed, dof)


def conclude(
    found: Estimates, comparison: Comparison, wv: WaveletVariance, *, misfits: bool
) -> Fit:
    """Make the `Fit` of some estimates and judge it.

    wv: The data.
    misfits: Whether the fit fails the chi-square test.
    """
    slope = found.slope
    model, all_keys = found.coordinates.fitted(
        found.processes, None if slope is None else slope.value
    )
    keys = [all_keys[k] for k in found.present]
    jacobian = found.coordinates.jacobian(found.processes)[np.ix_(found.present, found.present)]
    matrix = jacobian @ found.covariance @ jacobian.T
    upper = _upper_limits(found, all_keys, wv)
    dof = float("inf")
    if slope is not None:
        dof = slope_dof(model, keys, matrix, wv.n, wv.dt)
        keys.append(str(drift_key(model)))
        matrix = np.pad(matrix, (0, 1))
        matrix[-1, -1] = slope.variance
    ordered, matrix = in_model_order(model, keys, matrix)
    before, after = estimate_notices(model, ordered, matrix, upper, wv)
    fit = Fit(
        model=model,
        wv=wv,
        keys=ordered,
        covariance=matrix,
        upper_bounds=upper,
        objective=comparison.objective,
        chi_square=comparison.chi_square,
        chi_square_allowed=comparison.chi_square_allowed,
        dof=comparison.dof,
        discrepancy=found.discrepancy,
        method=found.method,
        weights=found.weights,
        notices=(*before, *found.notices, *after, *wv.notices),
        log_likelihood=found.log_likelihood,
        trace=tuple(found.trace),
        slope_dof=dof,
    )
    shown = missed_level_notices(fit.goodness)
    if misfits or fit.goodness.is_poor:
        shown += misfit_notices(fit.goodness, found.discrepancy, failed=misfits)
    return replace(fit, notices=(*fit.notices, *shown)) if shown else fit


def _upper_limits(found: Estimates, keys: Sequence[str], wv: WaveletVariance) -> dict[str, float]:
    """95 % upper limits of amplitudes that are zero, or have no shape and are not significant."""
    coordinates = found.coordinates
    present = [j for j in range(len(coordinates.terms)) if j not in found.absent]
    rows = {k: row for row, k in enumerate(found.present)}
    limits = {}
    for k, (i, is_amplitude) in enumerate(coordinates.owners):
        if not is_amplitude:
            continue
        if i in found.absent:
            limits[keys[k]] = found.absent[i]
            continue
        term, deviation = coordinates.terms[i], float(np.sqrt(found.covariance[rows[k], rows[k]]))
        if term.n_shapes or not deviation > 1.0 / tuning.SIGNIFICANT:
            continue
        amplitude = float(found.processes[i].values[term.linear.name] or 0.0) ** term.linear.power
        limit = upper_amplitude(
            coordinates.without(list(found.absent)),
            [found.processes[j] for j in present],
            present.index(i),
            (amplitude, deviation * amplitude, amplitude),
            wv,
        )
        limits[keys[k]] = limit ** (1.0 / term.linear.power)
    return limits
