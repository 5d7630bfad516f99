"""Numbers with which a small filter is never too optimistic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from gmwm._core import checks
from gmwm._core.notices import Notice
from gmwm._core.text import per_cent
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.axes import Axes, Axis, One, Sd, Several, given_tau, per_axis
from gmwm.filter_numbers.chain import Chain
from gmwm.filter_numbers.result import FilterNumbers, Predicted, SensorNumbers
from gmwm.filter_numbers.spectra import (
    KINDS,
    TIGHTEST,
    Estimated,
    Problem,
    Target,
    correlation_time,
    dominating,
    region_targets,
    standard_errors,
)
from gmwm.process import Model, RandomWalk, WhiteNoise


@per_axis
def bound(
    source: One | Several,
    form: str = "N+K",
    horizon: float = 60.0,
    *,
    level: float | None = None,
    bias_sd: Sd = 0.0,
    shared: bool = False,
    tau: float | str | None = None,
    dt: float | None = None,
) -> FilterNumbers | SensorNumbers:
    """The smallest numbers of a form with which a linear filter is never too optimistic.

    Parameters
    ----------
    source : Process, Model, Fit, Calibration or mapping
        The error model of an axis, or of several by channel name.
    form : {"N+K", "N+GM", "N+K+GM"}
        White noise with a random walk, a Gauss-Markov process, or both.
    horizon : float, optional
        Time without aiding for which they are to be small, s. For relative poses, the interval of
        keyframes. They dominate at any time.
    level : float, optional
        Of the confidence region of a fit, e.g. 0.95, all of which is dominated. By default the
        estimate is, and the uncertainty of its parameters is not covered.
    bias_sd : float or mapping, optional
        Standard deviation of a constant bias, such as that of turning on, in u; by axis or kind
        ("gyro", "accel") if a mapping.
    shared : bool, optional
        Whether axes of a kind have the same numbers.
    tau : float or "shared", optional
        Correlation time of the Gauss-Markov process, s; "shared": the one for all axes that costs
        least over them. By default each has its own.
    dt : float, optional
        Sampling interval of models that are not fitted, s; 0.01 s by default.

    Returns
    -------
    FilterNumbers or SensorNumbers
        Of one axis, or by channel; N and K of valid fits with the standard errors that these leave.

    Raises
    ------
    InputError
        If a parameter is open, a term is known by simulation only, the form cannot dominate the
        model, ``level`` is given without a fit, or ``tau`` without one Gauss-Markov process.

    Notes
    -----
    S_b(f) >= S(f) at every frequency f > 0, with the limits K_b >= K and N_b >= N; among those, the
    mean of AVAR_b(t)/AVAR(t) over t from a tenth of the horizon to the horizon is least. The
    covariance of the believed error is then at least that of the true one, and so is that of what
    any linear filter makes of it. That is a theorem for N+GM, stationary; with K it also takes the
    start of the walk, whose variance is ``bias_sd^2`` and twice that of the slow terms, as measured
    on many models (docs/filter-numbers.md). It covers neither nonlinearity nor errors that are not
    in the model. Quantization noise and resonances above ten over the horizon count by their
    density at low frequencies (resonances not far above by a part of their peak too), lines not at
    all, and a ramp R is a constant of standard deviation ``|R| horizon``; notices report them.
    """
    checks.choice("form", form, list(KINDS))
    tau = given_tau(form, tau)
    horizon = checks.positive("horizon", horizon, "give a time without aiding in seconds")
    axes = Axes.of(source, dt, bias_sd)
    axes.check_interval("horizon", horizon)
    if level is not None:
        level = checks.share("level", level, 0.95)
        for axis in axes.axes:
            _fit(axis)
    if isinstance(tau, str):
        problems = [_problem(group, horizon, level) for group in axes.sharing(shared)]
        tau = correlation_time(problems, form)

    def found(group: tuple[Axis, ...]) -> Sequence[FilterNumbers]:
        return bound_of(group, form, horizon, level, tau)

    return axes.numbers(found, shared)


@lru_cache(maxsize=64)
def bound_of(
    group: tuple[Axis, ...],
    form: str,
    horizon: float,
    level: float | None,
    tau: float | None = None,
) -> tuple[FilterNumbers, ...]:
    """The bound of axes that share their numbers; see `bound`.

    A report asks for some of them again, and the exports for those of the report.
    """
    problem = _problem(group, horizon, level)
    model = dominating(problem, form, tau)
    # Errors of a fit that is not valid are not those of its parameters either.
    fits = [Estimated.of(axis.fit) for axis in group if axis.fit is not None and axis.fit.valid]
    known = form == "N+K" and level is None and len(fits) == len(group)
    stderr = standard_errors(problem, model, fits) if known else {}
    dominated = (*problem.targets, *problem.region)
    sd = max(_start(group, each, model) for each in dominated)
    times = (horizon, 10.0 * horizon)
    errors = [predicted(axis, axis.chain, model, sd, times) for axis in group]
    if form != TIGHTEST and any(found[0].tightness > tuning.LOOSE for found in errors):
        other = dominating(problem, TIGHTEST)
        start = max(_start(group, each, other) for each in dominated)
        tight = [predicted(axis, axis.chain, other, start, times[:1])[0] for axis in group]
        looseness = [_loose(found[0], best) for found, best in zip(errors, tight, strict=True)]
    else:
        looseness = [()] * len(group)
    return tuple(
        FilterNumbers(
            form=form,
            model=model,
            horizon=horizon,
            initial_sd=sd,
            method="bound",
            predicted=found,
            notices=(
                *target.notices,
                *(_optimistic(axis, model, sd, horizon) if target.notices else ()),
                *loose,
                *stands_for(axis, target, model, problem.targets),
                *about(axis, level),
            ),
            quantity=axis.quantity,
            stderr=stderr,
        )
        for axis, target, found, loose in zip(
            group, problem.targets, errors, looseness, strict=True
        )
    )


def _problem(group: Sequence[Axis], horizon: float, level: float | None) -> Problem:
    """What the numbers that axes share have to dominate."""
    targets = tuple(Target.of(axis.model, axis.dt, horizon, axis.unit) for axis in group)
    region: list[Target] = []
    if level is not None:
        for axis, target in zip(group, targets, strict=True):
            region += region_targets(target, _fit(axis), level)
    return Problem(targets, horizon, tuple(region))


def _optimistic(axis: Axis, model: Model, sd: float, horizon: float) -> tuple[Notice, ...]:
    """Where what the numbers leave out is too large for that, without aiding or before."""
    late, early = ([share * horizon for share in each] for each in (tuning.SUSPECT, tuning.EARLY))

    def unaided(times: Sequence[float]) -> list[tuple[float, float, str]]:
        found = predicted(axis, axis.chain, model, sd, times)
        return [(e.nees, e.time, f"after {e.time:g} s without aiding") for e in found]

    worst = max(unaided(late))
    if worst[0] <= tuning.OPTIMISTIC:  # not NaN, where nothing is predicted
        relative, usual = axis.between(horizon), axis.chain
        (pose, *_), fixed = (
            chain.errors(
                axis.model, model, axis.dt, [horizon],
                true_sd=axis.bias_sd, believed_sd=sd, every_fix=chain is usual,
            ).nees()
            for chain in (relative, usual)
        )  # fmt: skip
        worst = max(
            (float(pose), horizon, f"between keyframes every {horizon:g} s"),
            (float(np.max(fixed[:-1])), 0.0, f"with a fix every {usual.interval:g} s"),
            *unaided(early),
        )
    nees, time, when = worst
    if not nees > tuning.OPTIMISTIC:
        return ()
    text = (
        f"too optimistic: a NEES of {nees:.3g} {when}; what the numbers leave out is not small here"
    )
    hint = "estimate it as a state, or take it off the data"
    return (Notice("optimistic", "warning", "", text, {"nees": nees, "time": time}, hint),)


def _loose(found: Predicted, best: Predicted) -> tuple[Notice, ...]:
    """What a form costs, and where another is worth its state."""
    if found.tightness <= tuning.LOOSE:
        return ()
    text = (
        f"after {found.time:g} s without aiding errors are believed {found.tightness:.3g} times as "
        f"large as they are; with {TIGHTEST}, {best.tightness:.3g} times"
    )
    values = {"tightness": found.tightness, "with_state": best.tightness}
    is_worth = best.tightness <= found.tightness / tuning.WORTH_A_STATE
    hint = f"use {TIGHTEST} where the filter has a state for it" if is_worth else ""
    return (Notice("loose-form", "note", "", text, values, hint),)


def stands_for(
    axis: Axis, target: Target, model: Model, sharing: Sequence[Target]
) -> tuple[Notice, ...]:
    """What N and K are for beside white noise and a random walk: terms, where they are needed.

    sharing: Targets of the axes that share the numbers; what another needs is not explained.
    """
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
    # White noise behind a low-pass is that of the sensor, too, and nothing to be explained.
    for letter, name, one, own, explained, others in (
        ("N", "white noise", WhiteNoise(1.0), white, filtered, white),
        ("K", "random walk", RandomWalk(1.0), walks, [], [*walks, *white, *filtered]),
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
        shares = {
            labels[id(term)]: float((density[0] + foot) / need[at])
            for (term, density), foot in zip(
                target.densities(f[at : at + 1]), target.feet, strict=True
            )
            if not any(term is other for other in others)
        }
        large = {
            key: share
            for share, key in sorted(((share, key) for key, share in shares.items()), reverse=True)
            if share > tuning.MENTIONED
        }
        parts = ", ".join(f"{key} ({per_cent(share)})" for key, share in large.items())
        if alone > 0.0:
            text = f"{letter} is {np.sqrt(square / alone):.3g} times that of the model's {name}: it"
        else:
            text = f"the model has no {name}: {letter}"
        text += f" has to cover {parts}"
        code = f"more-than-{name.replace(' ', '-')}"
        found.append(Notice(code, "note", "", text, large))
    return tuple(found)


def _fit(axis: Axis) -> Fit:
    if axis.fit is None:
        raise InputError("level is that of a fit: a model has no confidence region")
    return axis.fit


def _start(group: Sequence[Axis], target: Target, model: Model) -> float:
    """Standard deviation of the bias at the start: the walk, or a constant where there is none."""
    variance = max(axis.bias_sd for axis in group) ** 2 + target.constant_sd**2
    stationary = [term for term in model.terms if not term.is_walk]
    if len(stationary) < len(model.terms):
        variance += tuning.INITIAL_SHARE * target.slow_variance(Model(tuple(stationary)))
    return float(np.sqrt(variance))


def judged(source: One | Several, numbers: FilterNumbers) -> FilterNumbers:
    """The same numbers with what is predicted where an error model is the truth.

    source: The error model of the axis; as a mapping, with its name.
    numbers: Of any origin; the times of its predictions are kept.
    """
    axis = Axes.of(source, None, 0.0).axes[0]
    times = [each.time for each in numbers.predicted]
    found = predicted(axis, axis.chain, numbers.model, numbers.initial_sd, times)
    return replace(numbers, predicted=found)


def predicted(
    axis: Axis, chain: Chain, model: Model, sd: float, times: Sequence[float]
) -> tuple[Predicted, ...]:
    """What a filter with these numbers knows of its error after some times without aiding."""
    try:
        errors = chain.worse(axis.model, model, axis.dt, times, axis.bias_sd, sd)
    except InputError:
        nan = float("nan")
        return tuple(Predicted(time, nan, nan) for time in times)
    rows = zip(times, errors.nees(), errors.tightness(), strict=True)
    return tuple(Predicted(time, float(nees), float(sd)) for time, nees, sd in rows)


def about(axis: Axis, level: float | None) -> tuple[Notice, ...]:
    """What there is to know of the fit and of the prediction."""
    found = []
    try:
        axis.model.state_space(axis.dt)
    except InputError as error:
        text = f"the consistency is not predicted: {error}"
        found.append(Notice("not-predicted", "note", "", text))
    if axis.fit is None:
        return tuple(found)
    if not axis.fit.valid:
        text = "the fit is not valid, nor are numbers from it"
        found.append(Notice("fit-not-valid", "warning", "", text, {}, "read its notices first"))
    if axis.bias_sd == 0.0:
        text = (
            "the bias at the start leaves out that of switching on, which no recording at rest "
            "shows: add its variance"
        )
        found.append(Notice("turn-on-left-out", "note", "", text))
    if level is None:
        text = "the uncertainty of the fitted parameters is not covered"
        found.append(Notice("uncertainty-not-covered", "note", "", text))
    return tuple(found)
