"""Numbers with which a small filter is consistent, and those that a file can hold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from gmwm._core import checks
from gmwm._core.typing import FloatArray, Progress
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.axes import (
    AxisModel,
    One,
    Sd,
    SensorAxes,
    Several,
    given_tau,
    given_times,
    per_axis,
)
from gmwm.filter_numbers.bound import (
    bound,
    covered_terms_notices,
    fit_notices,
    predicted,
    required,
    start_sd,
)
from gmwm.filter_numbers.propagation import Chain, ChainErrors
from gmwm.filter_numbers.result import FORMS, AxisFilterNumbers, FilterNumbers, Predicted
from gmwm.filter_numbers.spectra.dominance import Problem, with_correlation_times
from gmwm.filter_numbers.spectra.required import RequiredSpectrum
from gmwm.issues import Notice, notice
from gmwm.process import Model

_TIMES = {"N+K": (), "N+GM": (1.0,), "N+K+GM": (1.0,), "N+2GM": (0.1, 3.0)}
"""Correlation times at the start of the search, over the longest outage."""
_STEPS = 60
_SLOPE_STEP = 1e-4  # of the logarithms of factors, for slopes by differences
_FARTHEST = 12.0  # logarithm of a factor, beyond which numbers have no meaning any more


@per_axis
def reduce(
    source: One | Several,
    form: str = "N+K",
    outages: Sequence[float] = (10.0, 30.0, 60.0),
    *,
    keyframe: float | None = None,
    bias_sd: Sd = 0.0,
    shared: bool = False,
    tau: float | str | None = None,
    dt: float | None = None,
    rate: float | None = None,
    progress: Progress | None = None,
) -> AxisFilterNumbers | FilterNumbers:
    """The numbers of a form that make a small filter consistent, and as accurate as it can be.

    Unlike those of `gmwm.bound` they may be overconfident in some direction or at other times.

    Parameters
    ----------
    source : Process, Model, Fit, Calibration or mapping
        The error model of an axis, or of several by channel name.
    form : {"N+K", "N+GM", "N+K+GM", "N+2GM"}
        White noise with a random walk, with Gauss-Markov processes, or both.
    outages : sequence of float, optional
        Outages for which the numbers are consistent, s.
    keyframe : float, optional
        Interval of keyframes or scans between which poses are related, s, in place of outages.
    bias_sd, shared, tau, dt, rate : optional
        As in `gmwm.bound`.
    progress : callable, optional
        Called as ``progress(done, total, channel)``.

    Returns
    -------
    AxisFilterNumbers or FilterNumbers
        Of one axis, or by channel; the horizon is the longest outage or the interval of keyframes,
        and predictions are at each of them and at ten times the longest.

    Raises
    ------
    InputError
        If a parameter is free, a term has no state-space form, there is no outage, or ``tau`` is
        given without one Gauss-Markov process.

    Notes
    -----
    They minimise the expected negative logarithm of the predicted density at the true error of the
    integrals at the end of the outages: a proper score, which penalizes a covariance that is too
    small as well as one that is too large. The squared logarithm of the NEES of each outage is
    added, so that one outage cannot compensate for another. The expectation is exact for the given
    truth, in the filter of `gmwm.filter_numbers.Chain`. For a heading the angle gained since the
    last fix counts too; `gmwm.certify` judges both.
    """
    form = checks.choice("form", str(form).replace(" ", ""), FORMS)
    tau = given_tau(form, tau)
    if keyframe is not None:
        outages = (checks.positive("keyframe", keyframe, "give the interval of keyframes in s"),)
    times = given_times("outages", outages)
    axes = SensorAxes.of(source, dt, bias_sd, rate)
    axes.check_interval("outages" if keyframe is None else "keyframe", times[0])
    search = _Search(form, times, keyframe is not None)
    time = _shared_time(search, axes.sharing(shared)) if isinstance(tau, str) else tau
    tell, done, total = progress or (lambda *_: None), 0, len(axes.axes)

    def found(group: tuple[AxisModel, ...]) -> tuple[AxisFilterNumbers, ...]:
        nonlocal done
        tell(done, total, group[0].name)
        done += len(group)
        return _numbers(search, group, time)

    result = axes.as_given(axes.numbers(found, shared))
    tell(total, total, "")
    return result


@dataclass(frozen=True)
class _Search:
    """For the numbers of a form that are right after some times without aiding."""

    form: str
    times: tuple[float, ...]
    is_relative: bool

    def chain(self, axis: AxisModel) -> Chain:
        return Chain.of_poses(axis.quantity, self.times[-1]) if self.is_relative else axis.chain

    def numbers(self, group: Sequence[AxisModel], tau: float | None) -> list[AxisFilterNumbers]:
        """The numbers of axes that share them."""
        _, model, sd = self.least(group, tau)
        longest, numbers = self.times[-1], []
        targets = required(group, longest)
        for axis, target in zip(group, targets, strict=True):
            found = predicted(axis, self.chain(axis), model, sd, [*self.times, 10.0 * longest])
            # All else that a bound leaves out is part of the truth here.
            notices = [each for each in target.notices if each.code == "ramp-as-constant"]
            notices += _overconfidence(found, longest)
            own = float(np.sqrt(axis.model.white_density()))
            share = float(np.sqrt(model.white_density())) / own if own > 0.0 else 1.0
            notices += [notice("less-white-noise", "", {"share": share})] * (share <= tuning.BELOW)
            notices += covered_terms_notices(axis, target, model, targets)
            notices += fit_notices(axis, None, longest)
            about = (self.form, model, longest, sd, "reduce", found, tuple(notices), axis.quantity)
            numbers.append(AxisFilterNumbers(*about, turn_on_sd=axis.bias_sd))
        return numbers

    def correlation_time(self, groups: Sequence[Sequence[AxisModel]]) -> float:
        """The one for all that costs least over them, s."""

        def cost(log_tau: float) -> float:
            return sum(self.least(group, float(np.exp(log_tau)))[0] for group in groups)

        grid = np.log(self.times[-1] * np.array(tuning.SHARED_TAUS))
        best = int(np.argmin([cost(each) for each in grid]))
        around = grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)]
        options = {"xatol": tuning.SHARED_TAU_WITHIN}
        found = minimize_scalar(cost, bounds=around, method="bounded", options=options)
        return float(np.exp(found.x))

    def least(self, group: Sequence[AxisModel], tau: float | None) -> tuple[float, Model, float]:
        """The least score, its numbers, and the standard deviation of the bias at the start."""
        targets = required(group, self.times[-1])
        start, sd = self._start(group, targets, tau)
        names = [name for name in start.params if tau is None or name != "tau"]
        values = np.array([float(start.params[name] or 0.0) for name in names])

        def scaled(logs: FloatArray) -> Model:
            return start.with_params(dict(zip(names, values * np.exp(logs), strict=True)))

        def errors(axis: AxisModel, model: Model) -> list[ChainErrors]:
            given = (axis.model, model, axis.dt, self.times)
            chains = self.chain(axis).judged
            return [c.errors(*given, true_sd=axis.bias_sd, believed_sd=sd) for c in chains]

        def score(logs: FloatArray) -> float:
            by_axis = [errors(axis, scaled(logs)) for axis in group]
            total = 0.0
            for i in range(max(map(len, by_axis))):
                found = [each[i] for each in by_axis if i < len(each)]
                # Of all axes together: one that shares its numbers may be conservative, another
                # overconfident.
                uneven = np.log(np.mean([each.nees() for each in found], axis=0)) ** 2
                mean = np.mean([each.score() for each in found], axis=0)
                total += float(np.sum(mean + tuning.EVENNESS * uneven))
            return total

        starts = [np.zeros(len(names))]
        if any(each.code == "fast-peak-left-out" for target in targets for each in target.notices):
            # A second start, with N read off at the longest time: of quantization of an angle it is
            # a hundred times that of the bound, with a minimum between.
            longest = self.times[-1]
            at = np.array([longest])
            read = max(2.0 * longest * axis.model.haar_variance(at, axis.dt)[0] for axis in group)
            factor = float(np.sqrt(read / start.white_density()))
            starts.append(np.where(np.array(names) == "N", np.log(factor), 0.0))
        least, logs = _smallest_score(score, starts)
        return least, scaled(logs), sd

    def _start(
        self, group: Sequence[AxisModel], targets: tuple[RequiredSpectrum, ...], tau: float | None
    ) -> tuple[Model, float]:
        """A bound with given correlation times, without zeros; standard deviation at the start.

        Without a walk it lies above the models from the frequency of the longest time on: below, a
        correlation time shorter than theirs needs a hundred times the variance, too far off for the
        search.
        """
        longest = self.times[-1]
        lowest = 0.0 if "K" in self.form else 0.5 / np.pi / longest
        taus = [factor * longest for factor in _TIMES[self.form]] if tau is None else [tau]
        problem = Problem(targets, longest, lowest=lowest)
        model = with_correlation_times(problem, self.form, taus)
        biases = [axis.bias_sd for axis in group]
        return model, start_sd(biases, targets, model, slow_share=1.0)


@lru_cache(maxsize=64)
def _shared_time(search: _Search, groups: tuple[tuple[AxisModel, ...], ...]) -> float:
    """Cached as `bound_of`: an export and its explanation ask for it again."""
    return search.correlation_time(groups)


@lru_cache(maxsize=64)
def _numbers(
    search: _Search, group: tuple[AxisModel, ...], tau: float | None
) -> tuple[AxisFilterNumbers, ...]:
    return tuple(search.numbers(group, tau))


def _overconfidence(found: Sequence[Predicted], longest: float) -> list[Notice]:
    """Where a filter with these numbers is overconfident, at the times asked for or beyond."""
    high = [each for each in found if each.nees > tuning.INCONSISTENT]
    if not high:
        return []
    worst = max(high, key=lambda each: (each.time <= longest, each.nees))
    values = {"nees": worst.nees, "time": worst.time}
    if worst.time > longest:
        hint = "if your outages are that long, add that time to the outages"
        return [notice("optimistic", "", values, severity="note", variant="beyond", hint=hint)]
    hint = "use gmwm.bound, a form with more terms, or separate numbers for each axis"
    return [notice("optimistic", "", values, variant="reduce", hint=hint)]


def usable(
    source: Several, form: str = "N+K", horizon: float = tuning.HORIZON, **options: Any
) -> FilterNumbers:
    """Numbers of `bound`; N+GM of models with a random walk, which it cannot bound, of `reduce`.

    Options and errors are those of `bound`.
    """
    terms = (term for axis in SensorAxes.of(source, None, 0.0).axes for term in axis.model.terms)
    if form == "N+GM" and any(term.is_walk or term.is_flicker for term in terms):
        return reduce(source, form, [share * horizon for share in tuning.OUTAGES], **options)
    return bound(source, form, horizon, **options)


def _smallest_score(
    score: Callable[[FloatArray], float], starts: Sequence[FloatArray]
) -> tuple[float, FloatArray]:
    """The least score, and the logarithms of factors there.

    score: Of logarithms of factors on the numbers at the start of the search. To it comes a little
        of their squares, so that a factor which does not matter stays at one.
    """

    def cost(logs: FloatArray) -> float:
        # Finite beyond the farthest, too, where a line search may try: it takes differences.
        return score(np.clip(logs, -_FARTHEST, _FARTHEST)) + tuning.INERTIA * float(logs @ logs)

    options = {"eps": _SLOPE_STEP, "gtol": tuning.SLOPE, "maxiter": _STEPS}
    found = [minimize(cost, logs, method="BFGS", options=options) for logs in starts]
    best = min(found, key=lambda each: float(each.fun))
    return float(best.fun), np.clip(best.x, -_FARTHEST, _FARTHEST)
