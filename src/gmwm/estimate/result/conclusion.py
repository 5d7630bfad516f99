"""The one place where the estimates of a method become a `Fit`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from gmwm._core.text import brief, per_cent
from gmwm._core.typing import FloatArray
from gmwm._core.units import customary_unit
from gmwm.estimate import tuning
from gmwm.estimate.problem.moments import Compared, slope_dof, weight_root
from gmwm.estimate.problem.parameters import Coordinates, drift_key
from gmwm.estimate.problem.ramp import walks_beside
from gmwm.estimate.problem.regressors import Coefficients
from gmwm.estimate.result.fit import Fit
from gmwm.estimate.result.goodness import Goodness
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process
from gmwm.variance import WaveletVariance


@dataclass(frozen=True, eq=False)
class Estimates:
    """Estimates of the noise terms of a model by some method.

    processes: Its noise terms with their values, those of zero amplitude included.
    present, covariance: Coordinates of the terms that have an amplitude, and their (d, d).
    limits: Noise term -> 95 % upper limit of its scale, where that is not significantly above zero.
    method, weights, discrepancy, log_likelihood, trace: See `Fit`.
    """

    coordinates: Coordinates
    processes: Sequence[Process]
    present: Sequence[int]
    covariance: FloatArray
    limits: Mapping[int, float]
    slope: Coefficients | None
    method: str = ""
    weights: str = ""
    discrepancy: float = 0.0
    notices: Sequence[Notice] = ()
    log_likelihood: float = float("nan")
    trace: Sequence[float] = ()

    def by_key(self) -> tuple[Model, tuple[str, ...], FloatArray, dict[str, float]]:
        """The whole model with values; keys of its estimates, their covariance, and the limits."""
        coordinates, slope = self.coordinates, self.slope
        model, names = coordinates.fitted(self.processes, None if slope is None else slope.value)
        keys = [names[k] for k in self.present]
        jacobian = coordinates.jacobian(self.processes)[np.ix_(self.present, self.present)]
        matrix = jacobian @ self.covariance @ jacobian.T
        if slope is not None:
            keys.append(str(drift_key(model)))
            matrix = np.pad(matrix, (0, 1))
            matrix[-1, -1] = slope.variance
        upper = {
            names[k]: self.limits[i]
            for k, (i, is_amplitude) in enumerate(coordinates.owners)
            if is_amplitude and i in self.limits
        }
        ordered = tuple(key for key in model.params if key in keys)
        rows = [keys.index(key) for key in ordered]
        return model, ordered, matrix[np.ix_(rows, rows)], upper


def agreement(compared: Compared, covariance: FloatArray, n_free: int) -> dict[str, Any]:
    """Agreement with a model, as fields of `Fit`; the covariance has the discrepancy in it."""
    whitened = weight_root(covariance) @ compared.residual
    dof = compared.target.size - n_free
    plain = allowed = float("nan")
    if dof > 0:
        plain, allowed = map(compared.chi_square, (compared.statistical, covariance))
    return {
        "objective": float(whitened @ whitened),
        "chi_square": plain,
        "chi_square_allowed": allowed,
        "dof": dof,
    }


def conclude(
    found: Estimates, agrees: Mapping[str, Any], wv: WaveletVariance, *, misfits: bool
) -> Fit:
    """Make the `Fit` of some estimates and judge it."""
    model, keys, matrix, upper = found.by_key()
    dof = float("inf")
    if found.slope is not None:
        dof = slope_dof(model, keys, matrix, wv)
        faint = [i for i in model.parameters if model.terms[i.term].is_walk and i.key in upper]
        walks = walks_beside(model, {*keys, *upper}, wv) if faint and np.isfinite(dof) else None
        if walks is not None:
            limit = walks.quantile(tuning.UPPER_LEVEL)
            upper |= {item.key: max(limit, float(item.value or 0.0)) for item in faint}
    before, after = estimate_notices(model, keys, matrix, upper, wv)
    fit = Fit(
        model=model,
        wv=wv,
        keys=keys,
        covariance=matrix,
        upper_bounds=upper,
        **agrees,
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


def estimate_notices(
    model: Model,
    keys: Sequence[str],
    matrix: FloatArray,
    upper: Mapping[str, float],
    wv: WaveletVariance,
) -> tuple[list[Notice], list[Notice]]:
    """Notices about the estimates themselves: those that make a fit not valid, and the others."""
    bad = [notice("amplitude-bound", key, {"upper": limit}) for key, limit in upper.items()]
    errors = dict(zip(keys, map(float, np.sqrt(np.diag(matrix))), strict=True))
    for item in model.parameters:
        parameter, error = item.parameter, errors.get(item.key, 0.0)
        is_positive_shape = parameter.role == "shape" and parameter.lower == 0.0
        if is_positive_shape and error > tuning.UNDETERMINED * (item.value or 0.0):
            bad.append(notice("undetermined", item.key, {"stderr": error}))
    bad += _indistinct_notices(model, keys, matrix)
    terms = {item.key: item.term for item in model.parameters}
    worst: dict[tuple[int, int], tuple[float, Notice]] = {}  # one for any two terms
    for (i, first), (j, second) in combinations(enumerate(keys), 2):
        if errors[first] == 0.0 or errors[second] == 0.0:
            continue
        correlation = float(matrix[i, j] / (errors[first] * errors[second]))
        is_loose = errors[second] > tuning.LOOSE * abs(model.params[second] or 0.0)
        pair = terms[first], terms[second]
        before = worst[pair][0] if pair in worst else tuning.CONFOUNDED
        if abs(correlation) > before and is_loose:
            values = {"other": first, "correlation": correlation}
            worst[pair] = abs(correlation), notice("confounded", second, values)
    bad += [found for _, found in worst.values()]
    return bad, _bandwidth_notices(model, wv)


def _indistinct_notices(model: Model, keys: Sequence[str], matrix: FloatArray) -> list[Notice]:
    """Neighbouring terms of a kind whose correlation times do not differ significantly."""
    taus = [
        (item.key, item.value or 0.0, model.terms[item.term].title())
        for item in model.parameters
        if item.parameter.name == model.terms[item.term].ordered_by and item.key in keys
    ]
    notices = []
    for (first, a, title), (second, b, other) in pairwise(taus):
        if title != other:
            continue
        i, j = keys.index(first), keys.index(second)
        gradient = np.array([-1.0 / a, 1.0 / b])
        error = float(np.sqrt(gradient @ matrix[np.ix_([i, j], [i, j])] @ gradient))
        if np.log(b / a) < tuning.DISTINCT_SIGMA * error or b / a < tuning.DISTINCT_RATIO:
            values = {"first": first, "second": second, first: a, second: b}
            words: dict[str, Any] = {"kind": title, "one": a, "other": b}
            notices.append(notice("indistinct-terms", second, values, **words))
    return notices


def _bandwidth_notices(model: Model, wv: WaveletVariance) -> list[Notice]:
    """Terms that are the sensor's own filter, and the white noise that they act as."""
    filtered = [i for i, term in enumerate(model.terms) if term.is_band_limited]
    if not filtered and not any(term.is_white for term in model.terms):
        times = ((i, term.values.get("tau")) for i, term in enumerate(model.terms))
        filtered = [i for i, tau in times if tau is not None and tau < tuning.FILTER_LIKE * wv.dt]
    notices = []
    for i in filtered:
        term = model.terms[i]
        key = next(p.key for p in model.parameters if p.term == i and p.parameter.role == "shape")
        f = np.geomspace(1e-5, 0.5, 2000) / wv.dt
        density = term.psd(f, wv.dt)
        below = np.flatnonzero(density < 0.5 * density[0])
        bandwidth = float(f[-1])  # at which half of the power is left, or half the rate
        if below.size:
            part = slice(below[0] - 1, below[0] + 1)
            bandwidth = float(np.interp(-0.5 * density[0], -density[part], f[part]))
        low = term.psd(np.array([tuning.FOOT * bandwidth]), wv.dt)[0]
        if not low > 0.0:
            continue  # a term of zero amplitude is not the sensor's filter
        unit, factor = customary_unit("u/sqrt(Hz)", wv.quantity, wv.unit)
        level = float(np.sqrt(low))
        values = {"bandwidth": bandwidth, "density": level}
        words: dict[str, Any] = {"term": term.title(), "size": level * factor, "unit": unit}
        notices.append(notice("sensor-bandwidth", key, values, **words))
    return notices


def missed_level_notices(goodness: Goodness) -> list[Notice]:
    """The averaging time that the model misses, if it misses one."""
    if goodness.largest is None or not goodness.is_excluded:
        return []
    residual, tau = goodness.largest
    side = "above" if residual > 0.0 else "below"
    values = {"tau": tau, "residual": residual, "p_value": goodness.largest_p}
    return [notice("level-missed", "", values, errors=brief(abs(residual)), side=side)]


def misfit_notices(goodness: Goodness, discrepancy: float, *, failed: bool) -> list[Notice]:
    """Consequence for prediction where a model misses an averaging time.

    failed: Whether the chi-square test failed. If not, a misfit is bad only where fewer than one in
        twenty right models have one as clear at any level: of six axes with right models nearly one
        has a smaller one by chance.
    """
    beyond = goodness.beyond_chance
    if beyond is None:
        return []
    misfit, tau, residual = beyond
    values = {"misfit": misfit, "tau": tau, "residual": residual, "discrepancy": discrepancy}
    side, scale = ("above", "small") if misfit > 0.0 else ("below", "large")
    words: dict[str, Any] = {
        "share": per_cent(abs(misfit)),
        "side": side,
        "scale": scale,
        "errors": brief(abs(residual)),
        "chance": 100.0 * goodness.largest_p,
    }
    if not goodness.is_poor:
        variant = "allowed" if discrepancy > 0.0 else "slight"
    elif failed or goodness.largest_p < tuning.POOR_P:
        return [notice("misfit", "", values, **words)]
    else:
        variant = "chance"
    return [notice("misfit", "", values, severity="note", variant=variant, **words)]
