"""The sampling error of a fit in the numbers that dominate it, by linear propagation.

Where a bound touches the spectrum S, it follows it: with shares w_j of the bound's terms there, the
sum of w_j d(ln v_j) over their variances v_j is d(ln S). As many places as there are numbers touch,
or the limit of white noise does; where more do, they agree. A maximum that moves changes nothing to
first order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gmwm._core.typing import BoolArray, FloatArray
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.spectra.dominance import Problem, columns_of, limits, solved
from gmwm.filter_numbers.spectra.region import Estimated
from gmwm.filter_numbers.spectra.required import RequiredSpectrum
from gmwm.process import Model

_STEP = 1e-3  # standard errors


def standard_errors(
    problem: Problem, model: Model, estimates: Sequence[Estimated]
) -> dict[str, float]:
    """Standard errors of the amplitudes of a bound, by their keys.

    model: The bound.
    estimates: One for each target, independent of each other.
    """
    terms = [term.with_amplitude(1.0) for term in model.terms]
    columns = columns_of(problem, terms)
    walks = [term.is_walk for term in terms]
    least = limits(problem, len(terms), any(walks))
    shares = solved(problem, columns, any(walks))[0]
    touched = np.flatnonzero(columns @ shares < 1.0 + tuning.TOUCHED)
    # A limit that is not zero is that of white noise, or of the walk at the lowest frequency.
    at_limit = np.flatnonzero((shares <= least * (1.0 + tuning.TOUCHED)) & (least > 0.0))
    f = np.append(problem.f[touched], np.full(at_limit.size, problem.f[0]))
    is_white = np.append(np.zeros(touched.size, dtype=bool), at_limit == 0)
    rows = np.vstack([columns[touched] * shares, np.eye(len(terms))[at_limit]])
    largest = [_densities(target, f, is_white) for target in problem.targets]
    owner = np.argmax(largest, axis=0)
    changes = [
        np.where((owner == i)[:, None], _changes(target, estimate, f, is_white), 0.0)
        for i, (target, estimate) in enumerate(zip(problem.targets, estimates, strict=True))
    ]
    counts = shares > 0.0
    moved = np.linalg.lstsq(rows[:, counts], np.hstack(changes), rcond=None)[0]
    relative = np.zeros(len(terms))
    relative[counts] = 0.5 * np.sqrt(np.sum(moved**2, axis=1))
    # The amplitude comes first of the parameters of a term.
    keys = {p.term: p.key for p in reversed(model.parameters)}
    return {
        key: float(relative[i]) * float(model.params[key] or 0.0) for i, key in sorted(keys.items())
    }


def _changes(
    target: RequiredSpectrum, estimate: Estimated, f: FloatArray, is_white: BoolArray
) -> FloatArray:
    """Change of the logarithm of the density for a step along each independent error, (n, p)."""
    model, keys = estimate.model, estimate.keys
    values = np.array([float(model.params[key] or 0.0) for key in keys])
    # Of the correlation: variances of correlation times and of amplitudes are twenty decades apart,
    # and rounding of the largest would be far above the smallest.
    errors = np.sqrt(np.diag(estimate.covariance))
    known = np.where(errors > 0.0, errors, 1.0)
    shares, vectors = np.linalg.eigh(estimate.covariance / np.outer(known, known))
    root = errors[:, None] * vectors * np.sqrt(np.maximum(shares, 0.0))
    counted = [
        i for i, term in enumerate(model.terms) if any(term is kept for kept in target.terms)
    ]

    def logarithms(values: FloatArray) -> FloatArray:
        terms = model.with_params(dict(zip(keys, map(float, values), strict=True))).terms
        moved = replace(target, terms=tuple([terms[i] for i in counted]))
        # A density of steps of 1e-200 is below all numbers.
        return np.log(np.maximum(_densities(moved, f, is_white), np.finfo(float).tiny))

    columns = []
    for column in root.T:
        # No step leaves the range of a parameter.
        largest = np.max(np.abs(column) / np.maximum(np.abs(values), np.finfo(float).tiny))
        step = _STEP / max(1.0, float(largest))
        change = logarithms(values + step * column) - logarithms(values - step * column)
        columns.append(change / (2.0 * step))
    return np.column_stack(columns) if columns else np.zeros((f.size, 0))


def _densities(target: RequiredSpectrum, f: FloatArray, is_white: BoolArray) -> FloatArray:
    """Density of all terms, or of the white ones where only these count."""
    return sum(
        (
            np.where(is_white & (not term.is_white), 0.0, density)
            for term, density in target.densities(f)
        ),
        np.full_like(f, target.foot),
    )
