"""Numbers with which a small filter is never overconfident."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.text import per_cent
from gmwm.calibration import upper_limit
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.axes import AxisModel, One, Sd, SensorAxes, Several, given_tau, per_axis
from gmwm.filter_numbers.propagation import Chain
from gmwm.filter_numbers.result import AxisFilterNumbers, FilterNumbers, Predicted
from gmwm.filter_numbers.spectra.dominance import (
    KINDS,
    TIGHTEST,
    Problem,
    correlation_time,
    dominating,
    standard_errors,
)
from gmwm.filter_numbers.spectra.region import Estimated, region_spectra
from gmwm.filter_numbers.spectra.required import RequiredSpectrum
from gmwm.issues import Notice, notice
from gmwm.process import GaussMarkov, Model, RandomWalk, WhiteNoise


@per_axis
def bound(
    source: One | Several,
    form: str = "N+K",
    horizon: float = tuning.HORIZON,
    *,
    level: float | None = None,
    bias_sd: Sd = 0.0,
    shared: bool = False,
    tau: float | str | None = None,
    dt: float | None = None,
    rate: float | None = None,
) -> AxisFilterNumbers | FilterNumbers:
    """The smallest numbers of a form with which a linear filter is never overconfident.

    Parameters
    ----------
    source : Process, Model, Fit, Calibration or mapping
        The error model of an axis, or of several by channel name.
    form : {"N+K", "N+GM", "N+K+GM"}
        White noise with a random walk, a Gauss-Markov process, or both.
    horizon : float, optional
        Outage for which the numbers are as small as possible, s; they are never overconfident at
        any time. The interval of fixes or keyframes is not a horizon: see docs/filter-numbers.md.
    level : float, optional
        Level of the confidence region of a fit, e.g. 0.95. The numbers then cover all models in it,
        those of a calibration that fit equally well, and one more Gauss-Markov process that the
        data leave open (`Fit.deviation_interval`). By default they cover the estimate, and the 95 %
        upper limit of a random walk that it lacks (notice "upper-limit").
    bias_sd : float or mapping, optional
        Standard deviation of a constant bias, such as the turn-on bias, in u; by axis or kind
        ("gyro", "accel") if a mapping.
    shared : bool, optional
        Whether axes of a kind have the same numbers.
    tau : float or "shared", optional
        Correlation time of the Gauss-Markov process, s; "shared": the best one for all axes. By
        default each axis has its own.
    dt, rate : float, optional
        Sampling interval (s) or rate (Hz) of models that are not fitted; 100 Hz by default.

    Returns
    -------
    AxisFilterNumbers or FilterNumbers
        Of one axis, or by channel; N and K of valid fits with their standard errors.

    Raises
    ------
    InputError
        If a parameter is free, a term can only be simulated, the form cannot cover the model,
        ``level`` is given without a fit, or ``tau`` without one Gauss-Markov process, or a record
        is too short for an upper limit.

    Notes
    -----
    S_b(f) >= S(f) at every frequency f > 0, with the limits K_b >= K and N_b >= N; among those, the
    mean of AVAR_b(t)/AVAR(t) over t from a tenth of the horizon to the horizon is least. The
    covariance of the predicted error is then at least that of the true one, for any linear filter.
    That is a theorem for N+GM, which is stationary. With K it also needs the start of the random
    walk, whose variance is ``bias_sd^2`` plus twice that of the slow terms, as measured on many
    models (docs/filter-numbers.md). It covers neither nonlinearity nor errors that are not in the
    model. Quantization noise and resonances above ten over the horizon count by their density at
    low frequencies (resonances not far above by a part of their peak too), lines not at all, and a
    ramp R is a constant of standard deviation ``|R| horizon``; notices report them.
    """
    form = checks.choice("form", str(form).replace(" ", ""), list(KINDS))
    tau = given_tau(form, tau)
    horizon = checks.positive("horizon", horizon, "give a time without aiding in seconds")
    axes = SensorAxes.of(source, dt, bias_sd, rate)
    axes.check_interval("horizon", horizon)
    if level is not None:
        level = checks.share("level", level, 0.95)
        if any(axis.fit is None for axis in axes.axes):
            raise InputError("level needs a fit, a model has no confidence region: leave level out")
    if isinstance(tau, str):
        tau = _shared_time(axes.sharing(shared), form, horizon, level)
    given = (form, horizon, level, tau)

    def found(group: tuple[AxisModel, ...]) -> list[AxisFilterNumbers]:
        alone = zip(group, bound_of(group, *given), strict=True)
        return [with_limits(a, group, n, tau) if level is None else n for a, n in alone]

    return axes.as_given(axes.numbers(found, shared))


@lru_cache(maxsize=64)
def _shared_time(
    groups: tuple[tuple[AxisModel, ...], ...], form: str, horizon: float, level: float | None
) -> float:
    """The correlation time that costs least over all axes, s; cached as `bound_of`."""
    return correlation_time([_problem(group, horizon, level) for group in groups], form)


@lru_cache(maxsize=64)
def bound_of(
    group: tuple[AxisModel, ...],
    form: str,
    horizon: float,
    level: float | None,
    tau: float | None = None,
) -> tuple[AxisFilterNumbers, ...]:
    """The bound of axes that share their numbers; see `bound`.

    Cached: reports and exports ask for some of them again.
    """
    problem = _problem(group, horizon, level)
    model = dominating(problem, form, tau)
    stderr = _standard_errors(group, problem, model) if form == "N+K" and level is None else {}
    dominated = (*problem.targets, *problem.region)
    biases = [max(axis.bias_sd for axis in group)] * len(dominated)
    sd = start_sd(biases, dominated, model, tuning.INITIAL_SHARE)
    times = (horizon, 10.0 * horizon)
    errors = [predicted(axis, axis.chain, model, sd, times) for axis in group]
    tight: list[Predicted | None] = [None] * len(group)
    if any(found[0].tightness > tuning.LOOSE for found in errors):
        other = model if form == TIGHTEST else dominating(problem, TIGHTEST)
        start = start_sd(biases, dominated, other, tuning.INITIAL_SHARE)
        tight = [predicted(axis, axis.chain, other, start, times[:1])[0] for axis in group]
    numbers = []
    for axis, target, found, best in zip(group, problem.targets, errors, tight, strict=True):
        notices = list(target.notices)
        notices += _overconfidence(axis, model, sd, horizon) if target.notices else []
        if best is not None and found[0].tightness > tuning.LOOSE:
            values = {"tightness": found[0].tightness, "with_state": best.tightness}
            is_worth = best.tightness <= found[0].tightness / tuning.WORTH_A_STATE
            hint = f"use {TIGHTEST} where the filter has a state for it" if is_worth else ""
            words: dict[str, Any] = {"time": found[0].time, "tightest": TIGHTEST}
            variant = "tightest" if form == TIGHTEST else ""
            notices.append(notice("loose-form", "", values, variant=variant, hint=hint, **words))
        notices += covered_terms_notices(axis, target, model, problem.targets)
        notices += fit_notices(axis, level, horizon)
        about = (form, model, horizon, sd, "bound", found, tuple(notices), axis.quantity, stderr)
        numbers.append(AxisFilterNumbers(*about, turn_on_sd=axis.bias_sd))
    return tuple(numbers)


def with_limits(
    axis: AxisModel, group: tuple[AxisModel, ...], numbers: AxisFilterNumbers, tau: float | None
) -> AxisFilterNumbers:
    """The numbers of an axis with 95 % upper limits of terms that are not there, or left open.

    group: Axes with the same numbers.
    tau: Correlation time of the Gauss-Markov process, s; by default that of the bound.
    """
    model, walk = numbers.model, max(open_walk(each, numbers.horizon) for each in group)
    white = [_limit(a.fit, "N") for a in group if a.fit is not None and numbers.N == 0.0]
    upper = {"N": max(white)} if white else {}
    if "K" in numbers.form and walk > numbers.K:
        upper["K"] = walk
    elif "K" not in numbers.form and walk > 0.0:
        # At high frequencies this process rises as a random walk of that K does.
        slow = GaussMarkov(walk * float(np.sqrt(numbers.horizon / 2.0)), numbers.horizon)
        model = Model((model.terms[0], slow))
        if numbers.sigma[0] > 0.0 or tau is not None:
            both = tuple(replace(a, model=Model((*a.model.terms, slow)), fit=None) for a in group)
            model = bound_of(both, numbers.form, numbers.horizon, None, tau)[0].model
        upper["sigma"] = float(model.params["sigma"] or 0.0)
    if not upper:
        return numbers
    model = model.with_params(upper)
    again = predicted(axis, axis.chain, model, numbers.initial_sd, [*numbers.nees])
    # What a number of the estimate covers, and how loosely, does not hold for a limit.
    is_of = {"N": "more-than-white-noise", "K": "more-than-random-walk"}
    gone = ["loose-form", *(is_of[key] for key in upper if key in is_of)]
    kept = [each for each in numbers.notices if each.code not in gone]
    notices = (*kept, notice("upper-limit", "", upper, letters=", ".join(upper)))
    known = {key: error for key, error in numbers.stderr.items() if key not in upper}
    return replace(numbers, model=model, predicted=again, notices=notices, stderr=known)


def open_walk(axis: AxisModel, horizon: float) -> float:
    """The largest K that the data of an axis leave open, u/s/sqrt(Hz); 0 where its walk is known.

    That of a calibration's rivals, or of a fit without any slow term.
    """
    if (axis.model.params.get("K") or 0.0) > 0.0:
        return 0.0
    known = float(axis.rivals[-1].params.get("K") or 0.0) if axis.rivals else 0.0
    if known or axis.fit is None or bound_of((axis,), "N+K", horizon, None)[0].K > 0.0:
        return known
    return _limit(axis.fit, "K")


@lru_cache(maxsize=64)
def _limit(fit: Fit, letter: str) -> float:
    """`upper_limit`, which takes a fit of its own."""
    return upper_limit(fit, letter)


def _standard_errors(
    group: tuple[AxisModel, ...], problem: Problem, model: Model
) -> Mapping[str, float]:
    """Standard errors of N and K; of axes that share them, the largest of an axis alone.

    Where the curves of two axes meet, linear propagation moves N and K along both: 66 % for N of
    three equal gyros, which scatters by 8 % as each alone does.
    """
    if len(group) > 1:
        alone = [bound_of((axis,), "N+K", problem.horizon, None)[0].stderr for axis in group]
        return {key: max(each[key] for each in alone) for key in "NK"} if all(alone) else {}
    fit = group[0].fit
    if fit is None or not fit.valid:  # whose covariance cannot be used
        return {}
    return standard_errors(problem, model, Estimated.of(fit))


def _problem(group: Sequence[AxisModel], horizon: float, level: float | None) -> Problem:
    """The spectra that the numbers of axes have to dominate."""
    targets = required(group, horizon)
    region: list[RequiredSpectrum] = []
    for axis, target in zip(group, targets, strict=True):
        if level is not None and axis.fit is not None:
            region += region_spectra(target, axis.fit, level, axis.rivals)
    return Problem(targets, horizon, tuple(region))


def required(group: Sequence[AxisModel], horizon: float) -> tuple[RequiredSpectrum, ...]:
    """What the numbers of axes have to dominate, without the uncertainty of fits."""
    return tuple(RequiredSpectrum.of(each.model, each.dt, horizon, each.unit) for each in group)


def start_sd(
    biases: Sequence[float], spectra: Sequence[RequiredSpectrum], model: Model, slow_share: float
) -> float:
    """Standard deviation of the bias at the start: of the walk, or of a constant without one.

    biases: Standard deviations of constant biases, one a spectrum.
    slow_share: Of the variance of the slow terms that a walk starts with.
    """
    still = Model(tuple(term for term in model.terms if not term.is_walk))
    share = slow_share if len(still.terms) < len(model.terms) else 0.0
    variances = [
        bias**2 + each.constant_sd**2 + (share * each.slow_variance(still) if share else 0.0)
        for bias, each in zip(biases, spectra, strict=True)
    ]
    return float(np.sqrt(max(variances)))


def predicted(
    axis: AxisModel, chain: Chain, model: Model, sd: float, times: Sequence[float]
) -> tuple[Predicted, ...]:
    """How well a filter with these numbers knows its error after some times without aiding."""
    try:
        errors = chain.worse(axis.model, model, axis.dt, times, axis.bias_sd, sd)
    except InputError:
        nan = float("nan")
        return tuple(Predicted(time, nan, nan) for time in times)
    rows = zip(times, errors.nees(), errors.tightness(), strict=True)
    return tuple(Predicted(time, float(nees), float(sd)) for time, nees, sd in rows)


def _overconfidence(axis: AxisModel, model: Model, sd: float, horizon: float) -> list[Notice]:
    """Where the terms that the numbers leave out are too large for that, if anywhere."""

    def unaided(shares: Sequence[float]) -> list[tuple[float, float, str]]:
        found = predicted(axis, axis.chain, model, sd, [share * horizon for share in shares])
        return [(e.nees, e.time, f"after an outage of {e.time:g} s") for e in found]

    worst = max(unaided(tuning.SUSPECT))
    if worst[0] <= tuning.OPTIMISTIC:  # not NaN, where nothing is predicted
        usual = axis.chain
        given, starts = (axis.model, model, axis.dt, [horizon]), (axis.bias_sd, sd)
        poses = Chain.of_poses(axis.quantity, horizon).errors(*given, *starts)
        fixed = usual.errors(*given, *starts, every_fix=True).nees()
        worst = max(
            (float(poses.nees()[0]), horizon, f"between keyframes every {horizon:g} s"),
            (float(np.max(fixed[:-1])), 0.0, f"with a fix every {usual.interval:g} s"),
            *unaided(tuning.EARLY),
        )
    nees, time, when = worst
    if not nees > tuning.OPTIMISTIC:
        return []
    return [notice("optimistic", "", {"nees": nees, "time": time}, variant="bound", when=when)]


def covered_terms_notices(
    axis: AxisModel, target: RequiredSpectrum, model: Model, sharing: Sequence[RequiredSpectrum]
) -> list[Notice]:
    """The terms that N and K cover beside white noise and a random walk, where they are needed."""
    f = target.frequencies(tuning.POINTS)
    need, believed = target.psd(f), model.psd(f, axis.dt)
    alike = np.minimum(need / believed, believed / need)
    is_needed = (alike >= tuning.NEEDED) & (need >= np.max([each.psd(f) for each in sharing], 0))
    labels = dict(zip(map(id, axis.model.terms), axis.model.term_labels(), strict=True))
    white, filtered, walks = (
        [term for term in axis.model.terms if getattr(term, kind)]
        for kind in ("is_white", "is_band_limited", "is_walk")
    )
    found = []
    # White noise behind a low-pass is the sensor's own, too, and needs no explanation.
    for letter, code, one, own, explained, others in (
        ("N", "more-than-white-noise", WhiteNoise(1.0), white, filtered, white),
        ("K", "more-than-random-walk", RandomWalk(1.0), walks, [], [*walks, *white, *filtered]),
    ):
        unit, square = one.psd(f, axis.dt), (model.params.get(letter) or 0.0) ** 2
        known, alone = (
            sum(float(term.psd(f[:1], axis.dt)[0]) for term in terms) / unit[0]
            for terms in ([*own, *explained], own)
        )
        needed = np.where(is_needed, alike * square * unit / believed, 0.0)
        at = int(np.argmax(needed))
        # Where they are alike without it, too, it is not there for these.
        if tuning.ABOVE**2 * known >= square or needed[at] <= 1.0 - tuning.NEEDED:
            continue
        densities = zip(target.densities(f[at : at + 1]), target.feet, strict=True)
        shares = {
            labels[id(term)]: float((density[0] + foot) / need[at])
            for (term, density), foot in densities
            if not any(term is other for other in others)
        }
        ordered = sorted(((share, key) for key, share in shares.items()), reverse=True)
        large = {key: share for share, key in ordered if share > tuning.MENTIONED}
        parts = ", ".join(f"{key} ({per_cent(share)})" for key, share in large.items())
        times = float(np.sqrt(square / alone)) if alone > 0.0 else 0.0
        variant = "more" if alone > 0.0 else ""
        found.append(notice(code, "", large, variant=variant, times=times, parts=parts))
    return found


def fit_notices(axis: AxisModel, level: float | None, horizon: float) -> list[Notice]:
    """Limits of the fit, of the horizon (s) and of the prediction."""
    is_short = horizon < tuning.SHORTEST_HORIZON
    found = [notice("short-horizon", "", {"horizon": horizon})] * is_short
    try:
        axis.model.state_space(axis.dt)
    except InputError as error:
        found.append(notice("not-predicted", reason=str(error)))
    if axis.fit is None:
        return found
    if not axis.fit.valid:
        found.append(notice("fit-not-valid"))
    if (longest := float(axis.fit.wv.tau[-1])) < horizon:
        found.append(notice("beyond-record", "", {"longest": longest, "horizon": horizon}))
    if axis.bias_sd == 0.0:
        found.append(notice("turn-on-left-out"))
    if level is None:
        found.append(notice("uncertainty-not-covered"))
    return found
