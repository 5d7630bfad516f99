"""How consistent a filter will be with given numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gmwm._core import checks
from gmwm._core.notices import Notice
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.axes import Axes, Axis, One, Sd, Several
from gmwm.filter_numbers.bound import bound_of
from gmwm.filter_numbers.certificate import Cause, Certificate, Check
from gmwm.filter_numbers.given import Given, in_use
from gmwm.filter_numbers.imperfections import Imperfections, Motion
from gmwm.filter_numbers.result import FilterNumbers, SensorNumbers
from gmwm.process import Model, Process, WhiteNoise
from gmwm.readers import Recording

_GRAVITY = 9.80665
_INTEGRALS = {1: "angle", 2: "position", 3: "position by tilt"}
_SHOWN = {1: ("deg", float(np.degrees(1.0))), 2: ("m", 1.0), 3: ("m", _GRAVITY)}


def certify(
    source: One | Several,
    numbers: Given,
    *,
    outages: Sequence[float] = (10.0, 60.0),
    keyframe: float = 1.0,
    imperfections: Imperfections | None = None,
    motion: str | Motion | Recording | None = None,
    bias_sd: Sd = 0.0,
    dt: float | None = None,
) -> Certificate:
    """How consistent a filter will be with given numbers, and what they have to cover.

    Parameters
    ----------
    source : Process, Model, Fit, Calibration or mapping
        The truth.
    numbers : FilterNumbers, SensorNumbers or mapping
        In use; a mapping has (N, K), a model or `FilterNumbers` by axis or kind ("gyro", "accel").
    outages : sequence of float, optional
        Times without aiding, s.
    keyframe : float, optional
        Interval of keyframes or scans between which poses are related, s.
    imperfections : Imperfections, optional
        Errors that static data cannot show, as far as they are known.
    motion : {"handheld", "drone", "car", "fixed-wing"}, Motion or Recording, optional
        With which they come: a usual one, or that of a recording.
    bias_sd : float or mapping, optional
        Standard deviation of a constant bias, such as that of turning on, in u; by axis or kind.
    dt : float, optional
        Sampling interval of models that are not fitted, s; 0.01 s by default.

    Returns
    -------
    Certificate

    Raises
    ------
    InputError
        If numbers or models of an axis are missing or cannot be used, or imperfections are given
        that need a motion.

    Notes
    -----
    Exact covariance analysis of linear filters, for the truth given: of each axis alone (fixes of
    its last integral every second, then none; of a heading, the angle gained since where that is
    the worse), of each axis between keyframes (the pose starts anew at each, the bias goes on), and
    of a whole INS/GNSS filter on a loiter, where all six axes are known. It covers neither
    nonlinearity nor errors that are not in the models.
    """
    times = sorted({checks.positive("outage", each) for each in outages})
    if not times:
        raise InputError("outages: give one length at least, s")
    keyframe = checks.positive("keyframe", keyframe, "give the interval of keyframes in seconds")
    axes = Axes.of(source, dt, bias_sd)
    axes.check_interval("keyframe", keyframe)
    axes.check_interval("outages", times[0])
    known = Imperfections() if imperfections is None else imperfections
    moved = None if motion is None else Motion.of(motion)
    if known.needs_motion and moved is None:
        raise InputError("these imperfections do nothing at rest: give a motion too")
    horizon = times[-1]
    safe = axes.sensor(lambda group: bound_of(group, "N+K", horizon, None), shared=False)
    own = replace(
        safe,
        source="",
        axes={
            axis.name: in_use(
                numbers, axis.name, axis.quantity, horizon, safe[axis.name].initial_sd
            )
            for axis in axes.axes
        },
    )
    found = [check for axis in axes.axes for check in _of_axis(axis, own, times, keyframe)]
    in_flight, notices = _in_flight(axes, own, times)
    causes, advice = _causes(axes, own, horizon, known, moved)
    return Certificate(
        numbers=own,
        recommended=safe,
        checks=(*found, *in_flight),
        causes=tuple(causes),
        notices=(*notices, *advice),
    )


def _of_axis(
    axis: Axis, numbers: SensorNumbers, times: Sequence[float], keyframe: float
) -> list[Check]:
    """Errors of one axis without aiding, and between keyframes."""
    believed = numbers[axis.name]
    result = []
    for consumer, chain, ends in (
        ("free", axis.chain, times),
        ("keyframes", axis.between(keyframe), (keyframe,)),
    ):
        errors = chain.worse(
            axis.model, believed.model, axis.dt, ends, axis.bias_sd, believed.initial_sd
        )
        unit, scale = _SHOWN[chain.order] if axis.quantity else ("u s", 1.0)
        what = _INTEGRALS[chain.order] if axis.quantity else "integral"
        for time, actual, predicted, nees in zip(
            ends, errors.actual, errors.predicted, errors.nees(), strict=True
        ):
            true, own = (scale * float(np.sqrt(each[-1, -1])) for each in (actual, predicted))
            result.append(Check(consumer, axis.name, what, unit, time, true, own, float(nees)))
    return result


def _in_flight(
    axes: Axes, numbers: SensorNumbers, times: Sequence[float]
) -> tuple[list[Check], list[Notice]]:
    """Errors of an INS/GNSS filter at the end of outages, where there are six axes."""
    # Trajectories and filters, which no calibration needs.
    from gmwm.ins import SensorModels, covariance_analysis, loiter_with_outages

    by_name = {axis.name: axis for axis in axes.axes}
    try:
        truth = SensorModels.of(
            {name: axis.model for name, axis in by_name.items()},
            {name: axis.bias_sd for name, axis in by_name.items()},
        )
        believed = SensorModels.of(
            {name: each.model for name, each in numbers.items()},
            {name: each.initial_sd for name, each in numbers.items()},
        )
        scenario = loiter_with_outages(times, axes.axes[0].dt)
        analysis = covariance_analysis(scenario, truth, believed)
    except InputError as error:
        text = f"the INS/GNSS filter is left out: {error}"
        return [], [Notice("no-navigation-filter", "note", "", text)]
    nees, result = analysis.nees(), []
    for outage in scenario.outages:
        at = analysis.index(outage.end)
        true, own = (float(np.hypot(*sd[at, :2])) for sd in (analysis.sd, analysis.predicted_sd))
        result.append(
            Check(
                "outage", "horizontal", "position", "m", outage.duration, true, own, float(nees[at])
            )
        )
    return result, []


def _causes(
    axes: Axes, numbers: SensorNumbers, horizon: float, known: Imperfections, motion: Motion | None
) -> tuple[list[Cause], list[Notice]]:
    """What N and K of each kind of sensor have to cover."""
    causes: list[Cause] = []
    notices: list[Notice] = []
    for group in axes.groups:
        kind = group[0].quantity
        in_hand = [numbers[axis.name] for axis in group]
        N, K = (max(getattr(each, letter) for each in in_hand) for letter in "NK")
        first = _bound(group, horizon)

        def row(name: str, found: FilterNumbers, over: tuple[float, float],
                kind: str = kind) -> Cause:  # fmt: skip
            pair = (found.N, found.K)
            factors = (v / o if o > 0.0 else float("inf") for v, o in zip(pair, over, strict=True))
            return Cause(kind, name, *pair, *factors)

        if N > tuning.OTHER_UNITS * first.N:
            notices.append(_units(kind, N / first.N))
        causes.append(Cause(kind, "in use", N, K, 1.0, 1.0))
        causes.append(row("error model with slow terms", first, (N, K)))
        if all(axis.fit is not None for axis in group):
            try:
                wide = _bound(group, horizon, 0.95)
                causes.append(row("uncertainty of the fit, 95 %", wide, (first.N, first.K)))
            except InputError as error:
                notices.append(Notice("uncertainty-not-covered", "note", group[0].name, str(error)))
        terms = known.terms(kind or "gyro", motion)
        for cause, term in terms.items():
            larger = row(cause, _bound(_with(group, [term]), horizon), (first.N, first.K))
            causes.append(larger)
            if motion is not None and isinstance(term, WhiteNoise):
                notices.append(_bounded(kind, cause, horizon, motion.memory))
            if max(larger.N_factor, larger.K_factor) > tuning.LARGE:
                text = (
                    f"larger numbers are a poor substitute for {cause}: N times "
                    f"{larger.N_factor:.3g}, K times {larger.K_factor:.3g}"
                )
                values = {"N_factor": larger.N_factor, "K_factor": larger.K_factor}
                notices.append(
                    Notice(
                        "estimate-it",
                        "warning",
                        kind,
                        text,
                        values,
                        "estimate it as a state, or calibrate it",
                    )
                )
        if terms:
            every = _bound(_with(group, list(terms.values())), horizon)
            causes.append(row("all together", every, (N, K)))
    return causes, notices


def _bounded(kind: str, cause: str, horizon: float, memory: float) -> Notice:
    """Of an error that is a derivative: its integral is that of the motion at two times."""
    factor = float(np.sqrt(horizon / memory / -np.expm1(-horizon / memory)))
    text = (
        f"what a {cause} does to the first integral does not grow: N for it, which is enough at "
        f"any time, is {factor:.2g} times too large after {horizon:g} s"
    )
    return Notice("bounded-error", "note", kind, text, {"factor": factor})


def _units(kind: str, factor: float) -> Notice:
    text = f"N in use is {factor:.3g} times that of the error model: it may be in other units"
    hint = f"give it in {SI_UNIT.get(kind, 'u')}/sqrt(Hz)"
    return Notice("other-units", "warning", kind, text, {"factor": factor}, hint)


def _bound(group: tuple[Axis, ...], horizon: float, level: float | None = None) -> FilterNumbers:
    """Shared by the axes of a kind."""
    return bound_of(group, "N+K", horizon, level)[0]


def _with(group: Sequence[Axis], terms: Sequence[Process]) -> tuple[Axis, ...]:
    """Axes with more terms; white noise joins that of the model."""
    result = []
    for axis in group:
        parts = list(axis.model.terms)
        for term in terms:
            if isinstance(term, WhiteNoise):
                white = axis.model.white_density() + term.N**2
                parts = [part for part in parts if not part.is_white]
                parts.append(WhiteNoise(float(np.sqrt(white))))
            else:
                parts.append(term)
        result.append(replace(axis, model=Model(tuple(parts)), fit=None))
    return tuple(result)
