"""The smallest spectrum of a form that lies above a given one at every frequency.

If S_b(f) >= S(f) for all f, the covariance of any linear functional of the error is at most that
which the larger spectrum predicts: the difference of the two is itself the spectrum of a process.
So a filter with such numbers is never overconfident, in any direction, aided or not. Variances
enter spectra linearly: the smallest mean of AVAR_b/AVAR over the averaging times of interest is a
linear program, for each correlation time.

The sampling error of a fit in these numbers is by linear propagation. Where a bound touches the
spectrum S, it follows it: with shares w_j of the bound's terms there, the sum of w_j d(ln v_j) over
their variances v_j is d(ln S). As many places as there are numbers touch, or the limit of white
noise does; where more do, they agree. A maximum that moves changes nothing to first order.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize_scalar

from gmwm._core.typing import BoolArray, FloatArray
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.spectra.region import Estimated
from gmwm.filter_numbers.spectra.required import RequiredSpectrum
from gmwm.process import GaussMarkov, Model, Process, RandomWalk, WhiteNoise

_STEPS = 500
_UNTIL_FIRST = 100  # then the first candidate enters, not the best: it ends cycles
_TOLERANCE = 1e-13

KINDS = {"N+K": "NK", "N+GM": "NG", "N+K+GM": "NKG"}
"""Forms that `dominating` knows, with the kinds of their terms."""

TIGHTEST = "N+K+GM"
"""The form that contains the others."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Spectra to dominate by one set of numbers, and the cost of these.

    targets: Of one axis, or of several that share the numbers: the cost is relative to them.
    region: Spectra of a confidence region, to be dominated in place of the targets.
    lowest: Frequency from which on they are dominated, Hz; by default all frequencies are.
    """

    targets: tuple[RequiredSpectrum, ...]
    horizon: float
    region: tuple[RequiredSpectrum, ...] = ()
    lowest: float = 0.0

    @cached_property
    def f(self) -> FloatArray:
        """Frequencies of the linear program, Hz."""
        return self.frequencies(tuning.POINTS)

    @cached_property
    def need(self) -> FloatArray:
        """The required density at these, u^2/Hz."""
        return self.largest(self.f)

    @cached_property
    def _allan(self) -> tuple[FloatArray, FloatArray]:
        """Averaging times of the cost, s, and the Allan variances of the targets there, u^2."""
        times = np.geomspace(0.1 * self.horizon, self.horizon, tuning.AVERAGING_TIMES)
        tau = np.unique(np.maximum(np.rint(times / self.dt), 1.0)) * self.dt
        return tau, np.array([each.allan_variance(tau) for each in self.targets])

    @property
    def dt(self) -> float:
        """Sampling interval, s."""
        return self.targets[0].dt

    @property
    def dominated(self) -> tuple[RequiredSpectrum, ...]:
        """The spectra that have to be dominated."""
        return self.region or self.targets

    def frequencies(self, points: int) -> FloatArray:
        """Frequencies of all spectra, some a decade; Hz."""
        f = np.unique(np.concatenate([t.frequencies(points) for t in self.dominated]))
        return f[f >= self.lowest]

    def largest(self, f: FloatArray) -> FloatArray:
        """Largest of the spectra, u^2/Hz."""
        largest = np.max([target.psd(f) for target in self.dominated], axis=0)
        return np.asarray(largest * (tuning.ENVELOPE if self.region else 1.0))

    def cost(self, process: Process) -> float:
        """Mean over averaging times and axes: its Allan variance over the true one."""
        tau, allan = self._allan
        return float(np.mean(2.0 * process.haar_variance(tau, self.dt) / allan))


def dominating(problem: Problem, form: str, tau: float | None = None) -> Model:
    """The smallest model of a form whose spectrum lies above those of a problem.

    tau: Correlation time of the Gauss-Markov process, s; by default the smallest model's.
    """
    rises = any(target.slope >= tuning.RISING for target in problem.dominated)
    if "K" not in KINDS[form] and rises:
        raise InputError(
            f"{form} cannot cover a random walk, whose spectrum rises without limit towards "
            "zero frequency: use N+K or N+K+GM"
        )
    plain = _plain(form)
    if "G" not in KINDS[form]:
        return _scaled(problem, plain, solved(problem, columns_of(problem, plain))[0])
    tau = correlation_time([problem], form) if tau is None else tau
    shares = _with_slow(problem, columns_of(problem, plain), [GaussMarkov(1.0, tau)])
    return _scaled(problem, [*plain, GaussMarkov(1.0, tau)], shares[0])


def correlation_time(problems: Sequence[Problem], form: str) -> float:
    """The one correlation time for several problems that costs least over them, s."""
    fast = [columns_of(problem, _plain(form)) for problem in problems]

    def costs(log_taus: FloatArray) -> FloatArray:
        gauss = [GaussMarkov(1.0, float(tau)) for tau in np.exp(log_taus)]
        shares = [
            _with_slow(each, columns, gauss) for each, columns in zip(problems, fast, strict=True)
        ]
        return np.asarray(np.sum(shares, axis=(0, 2)))

    grid = np.unique(np.concatenate([_correlation_times(problem) for problem in problems]))
    found = costs(grid)
    # Of several that are as good, the shortest: a slower one would only have a larger variance.
    best = int(np.argmax(found <= np.min(found) * (1.0 + tuning.AS_GOOD)))
    around = grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)]
    options = {"xatol": 1e-3}
    refined = minimize_scalar(
        lambda x: float(costs(np.array([x]))[0]), bounds=around, method="bounded", options=options
    )
    is_less = refined.fun < found[best] * (1.0 - tuning.AS_GOOD)
    return float(np.exp(refined.x if is_less else grid[best]))


def _plain(form: str) -> list[Process]:
    """The processes of a form beside a Gauss-Markov process, of unit amplitude."""
    return [WhiteNoise(1.0), *([RandomWalk(1.0)] if "+K" in form else [])]


def _with_slow(problem: Problem, fast: FloatArray, gauss: Sequence[Process]) -> FloatArray:
    """Shares of the plain processes, by their columns, and of each of some slow ones with them."""
    slow = columns_of(problem, gauss).T[:, :, None]
    each = np.broadcast_to(fast, (len(gauss), *fast.shape))
    return solved(problem, np.concatenate([each, slow], axis=2))


def with_correlation_times(problem: Problem, form: str, taus: Sequence[float]) -> Model:
    """The smallest model of a form that dominates with given correlation times, without zeros.

    A spectrum without a limit at zero frequency is dominated from the lowest frequency on.
    """
    processes = [*_plain(form), *(GaussMarkov(1.0, tau) for tau in taus)]
    shares = solved(problem, columns_of(problem, processes), "+K" in form)[0]
    least = tuning.LEAST_SHARE * float(np.sum(shares))
    return _scaled(problem, processes, np.maximum(shares, least))


def _correlation_times(problem: Problem) -> FloatArray:
    """Logarithms of correlation times to try: a grid, and those of the truth."""
    high = np.log(1.0 / problem.f[0])
    low = min(max(np.log(problem.horizon / tuning.SHORTEST_TAU), np.log(problem.dt)), high - 1.0)
    number = int(np.ceil((high - low) / np.log(10.0) * tuning.TAU_POINTS)) + 1
    own = [
        np.log(term.values[p.name] or 1.0)
        for target in problem.targets
        for term in target.terms
        for p in term.shape_parameters
        if p.unit == "s"
    ]
    inside = [each for each in own if low < each < high]
    return np.unique(np.append(np.linspace(low, high, number), inside))


def columns_of(problem: Problem, processes: Sequence[Process]) -> FloatArray:
    """Spectra of processes of unit amplitude over the required one, per unit of their cost."""
    return np.column_stack(
        [p.psd(problem.f, problem.dt) / problem.need / problem.cost(p) for p in processes]
    )


def solved(problem: Problem, columns: FloatArray, is_walking: bool = True) -> FloatArray:
    """Shares of m processes in the least cost, for each of b sets: (b, m).

    Columns are those of one set, (n, m), or of several, (b, n, m).
    """
    least = limits(problem, columns.shape[-1], is_walking)
    shares = least_sum(columns.reshape(-1, *columns.shape[-2:]), least)
    if np.any(np.isnan(shares)):
        raise InputError(
            "no numbers of this form cover the model within the computer's precision: its "
            "parameters are too far apart"
        )
    return shares


def limits(problem: Problem, m: int, is_walking: bool) -> FloatArray:
    """Least shares of m processes, white noise first, random walk second."""
    least = np.zeros(m)
    least[0] = problem.cost(WhiteNoise(1.0)) * max(target.white for target in problem.dominated)
    walk = max(target.walk for target in problem.dominated)
    if walk > 0.0 and is_walking:
        least[1] = problem.cost(RandomWalk(1.0)) * walk
    return least


def _scaled(problem: Problem, processes: Sequence[Process], shares: FloatArray) -> Model:
    """A model from shares of the cost, above the spectrum on a finer grid too."""
    costs = np.array([problem.cost(process) for process in processes])
    variances = np.maximum(shares, 0.0) / costs

    def short(f: FloatArray) -> FloatArray:
        spectra = np.column_stack([p.psd(f, problem.dt) for p in processes])
        return np.asarray(problem.largest(f) / (spectra @ variances))

    fine = problem.frequencies(tuning.CHECKED_POINTS)
    ratio = short(fine)
    most = float(np.max(ratio))
    # A maximum lies between two of the points.
    places = np.flatnonzero(ratio > (1.0 - tuning.NEAR) * most)
    ends = fine[np.maximum(places - 1, 0)], fine[np.minimum(places + 1, fine.size - 1)]
    most = max(most, float(np.max(short(np.geomspace(*ends, tuning.REFINED).ravel()))))
    variances = variances * max(most, 1.0) * tuning.SAFETY
    terms = (p.with_amplitude(float(v)) for p, v in zip(processes, variances, strict=True))
    return Model(tuple(terms))


def least_sum(rows: FloatArray, least: FloatArray) -> FloatArray:
    """The x of least sum with ``rows @ x >= 1`` and ``x >= least``, (b, m); NaN if there is none.

    rows: (b, n, m), of b programs of two to four variables under hundreds of constraints.
    least: (m,).

    With x = least + y and the rest r = 1 - rows @ least the dual is to maximise r @ u over u >= 0
    with rows^T u <= 1, for which u = 0 is a start. The prices of a basis are y; the constraint that
    they miss most enters it (Dantzig 1963, *Linear Programming and Extensions*, chapter 9). A step
    costs one product with the constraints; a general solver takes far longer, mostly to set up, and
    keeps to constraints to 1e-7 only.
    """
    b, n, m = rows.shape
    scale = np.max(rows, axis=2)
    usable = np.all(np.isfinite(scale) & (scale > 0.0), axis=1)
    scale[~usable] = 1.0
    # Those of slack variables come after the constraints.
    columns = np.concatenate(
        [
            np.where(usable[:, None, None], rows, 1.0) / scale[:, :, None],
            np.broadcast_to(np.eye(m), (b, m, m)),
        ],
        axis=1,
    )
    weight = np.concatenate([scale, np.ones((b, m))], axis=1)
    gains = np.concatenate([(1.0 - rows @ least) / scale, np.zeros((b, m))], axis=1)
    basis = np.tile(np.arange(n, n + m), (b, 1))
    each = np.arange(b)
    for step in range(_STEPS):
        inverse = np.linalg.inv(np.swapaxes(columns[each[:, None], basis], 1, 2))
        prices = (gains[each[:, None], basis][:, None, :] @ inverse)[:, 0]
        missed = weight * (gains - (columns @ prices[:, :, None])[:, :, 0])
        missed[:, n:] /= np.maximum(np.max(prices, axis=1), np.finfo(float).tiny)[:, None]
        missed[each[:, None], basis] = 0.0
        is_missed = missed > _TOLERANCE
        best = np.argmax(missed if step < _UNTIL_FIRST else is_missed, axis=1)
        going = usable & is_missed[each, best]
        if not np.any(going):
            break
        change = (inverse @ columns[each, best][:, :, None])[:, :, 0]
        ratios = np.full((b, m), np.inf)
        np.divide(np.sum(inverse, axis=2), change, out=ratios, where=change > _TOLERANCE)
        leaving = np.argmin(ratios, axis=1)
        usable &= ~going | np.isfinite(ratios[each, leaving])
        going &= usable
        basis[each[going], leaving[going]] = best[going]
    else:
        usable &= ~going
    return np.where(usable[:, None], least + np.maximum(prices, 0.0), np.nan)


_STEP = 1e-3  # standard errors


def standard_errors(problem: Problem, model: Model, estimate: Estimated) -> dict[str, float]:
    """Standard errors of the amplitudes of a bound, by their keys."""
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
    changes = _changes(problem.targets[0], estimate, f, is_white)
    counts = shares > 0.0
    moved = np.linalg.lstsq(rows[:, counts], changes, rcond=None)[0]
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
