"""How consistent a filter will be with given numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np
from annotated_types import MaxLen, MinLen

from gmwm._core import checks
from gmwm._core.documents import Document, NoneIs, NotNegative, Text
from gmwm._core.text import bullets, cell, plain_table, wrapped
from gmwm._core.units import SI_UNIT, factor
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.axes import SHARED, AxisModel, One, Sd, SensorAxes, Several, given_times
from gmwm.filter_numbers.bound import bound_of, open_walk, with_limits
from gmwm.filter_numbers.imperfections import Imperfections, Motion
from gmwm.filter_numbers.propagation import Chain
from gmwm.filter_numbers.reduce import usable
from gmwm.filter_numbers.result import AxisFilterNumbers, FilterNumbers, InUnits, shown_unit
from gmwm.filter_numbers.spectra.dominance import KINDS
from gmwm.ins import AIDINGS, SensorModels, Trajectory, covariance_analysis, loiter_with_outages
from gmwm.issues import Notice, notice
from gmwm.motion import HORIZON, INTERVAL, InMotion, between
from gmwm.process import Model, Process, RandomWalk, WhiteNoise, as_model
from gmwm.readers import Recording

Given = AxisFilterNumbers | FilterNumbers | Mapping[str, Any]
"""Numbers of all axes, or by axis or kind (gyro, accel) numbers, a model, or N and K."""

_SHOWN = {
    1: ("angle", "deg", float(np.degrees(1.0))),
    2: ("position", "m", 1.0),
    3: ("position by tilt", "m", factor("g", "m/s^2")),
}
"""Error, unit and factor of the last integral, by the number of integrals."""

CONSUMERS = {
    "free": f"Without aiding, after {tuning.SETTLING:g} s of fixes every {tuning.FIX_INTERVAL:g} s",
    "outage": "INS/GNSS filter, at the end of an outage",
    "pose": "INS with absolute poses at keyframes, at the end of an outage",
    "odometry": "INS with visual or lidar odometry: distance in an outage",
    "wheels": "INS with wheel odometry: distance in an outage",
    "keyframes": "Relative pose between keyframes",
    "motion": "Change of the mean rate in motion, from one such time to the next",
}
"""Users of the numbers."""

_MODEL, _ALL, _MOTION = "error model", "all together", "in motion"
"""Causes that numbers in use are judged by; the last that is there counts."""

_APART = ("keyframes", "motion")
"""Consumers whose times are not those of outages."""

_LOOSE = 0.5  # N and K that are needed over those in use, below which this is said

_MOST_NOTICES = 3
"""Most notices in the short text of a certificate."""

_OrNaN = Annotated[NotNegative, NoneIs(float("nan"))]


@dataclass(frozen=True)
class Check:
    """Predicted error beside the true one.

    nees: Normalised error squared per degree of freedom: of all integrals of a channel, or of the
        position.
    """

    consumer: Text
    where: Text
    quantity: Text
    unit: Text
    time: NotNegative
    true: _OrNaN
    believed: _OrNaN
    nees: _OrNaN


@dataclass(frozen=True)
class Cause:
    """A cause of larger numbers of a kind of sensor.

    N, K: That dominate with it, for all axes, u/sqrt(Hz) and u/s/sqrt(Hz).
    N_factor, K_factor: Of the error model and of all together, over the numbers in use; of the
        others, over those of the error model.
    """

    quantity: Text
    name: Text
    N: _OrNaN
    K: _OrNaN
    N_factor: _OrNaN
    K_factor: _OrNaN


_DOUBTS = {
    "fit-not-valid": "the error model is not valid",
    "beyond-record": "the record is too short for this horizon",
}
"""Codes of notices about the error model -> why the advice may be wrong for the axis."""


@dataclass(frozen=True, repr=False)
class Certificate(Document, InUnits):
    """How consistent a filter will be with given numbers, and why.

    Attributes
    ----------
    numbers : FilterNumbers
        In use.
    recommended : FilterNumbers
        Of the form in use, shared by axes where those are, as `gmwm.export` writes them.
    checks : tuple of Check
    causes : tuple of Cause
    notices : tuple of Notice
    """

    SCHEMA: ClassVar[str] = "gmwm.certificate"

    numbers: FilterNumbers
    recommended: FilterNumbers
    checks: Annotated[tuple[Check, ...], MinLen(1), MaxLen(10_000)]
    causes: Annotated[tuple[Cause, ...], MaxLen(1000)]
    notices: tuple[Notice, ...] = ()

    def __post_init__(self) -> None:
        kinds = [cause.quantity for cause in self.causes]
        if any(kinds.count(kind) < 2 for kind in kinds):
            raise InputError("causes must begin with the numbers in use and the error model")
        times = [set(each) for each in self._times.values()]
        if not self.of("keyframes") or not times[0] or any(each != times[0] for each in times):
            raise InputError("checks need the same times on all axes, and keyframes")

    @property
    def _times(self) -> dict[str, list[float]]:
        """Axis, or "horizontal" -> times of its checks in outages, s."""
        times: dict[str, list[float]] = {check.where: [] for check in self.checks}
        for check in self.checks:
            times[check.where] += [check.time] if check.consumer not in _APART else []
        return times

    def of(self, consumer: str) -> tuple[Check, ...]:
        """The checks of a consumer; see `CONSUMERS`."""
        return tuple(check for check in self.checks if check.consumer == consumer)

    @property
    def worst(self) -> Check:
        """The check with the largest NEES."""
        return max(self.checks, key=lambda check: check.nees)

    def __repr__(self) -> str:
        worst = self.worst
        return (
            f"<Certificate of {self.numbers.source or 'numbers'}: NEES up to {worst.nees:.3g}, "
            f"{worst.where} after {worst.time:g} s>"
        )

    def text(self, units: str = "field", *, verbose: bool = False) -> str:
        """The verdict, one table of errors, one of numbers, and what to do.

        verbose: Every check, all notices and the recommended numbers by axis too.
        """
        longest = max(max(times) for times in self._times.values())
        lines = [*wrapped(self._verdict()), "", self._errors(longest)]
        lines += wrapped(
            f"true, predicted: 1 sigma after {longest:g} s. NEES per degree of freedom; 1: "
            f"consistent, above {tuning.INCONSISTENT:g}: overconfident"
        )
        if moving := self.of("motion"):
            times = dict.fromkeys(check.time for check in moving)
            rows = [
                [name, *(cell(c.nees, 3) for c in moving if c.where == name)]
                for name in dict.fromkeys(check.where for check in moving)
            ]
            lines += ["", plain_table(["in motion", *(f"NEES\n{t:.3g} s" for t in times)], rows)]
        for quantity in dict.fromkeys(cause.quantity for cause in self.causes):
            lines += ["", self._covered(quantity, units)]
        notices = self.notices if verbose else self.notices[:_MOST_NOTICES]
        lines += ["", "What to do", *self._advice(), *bullets(notices)]
        if not verbose:
            return "\n".join(lines)
        for consumer, title in CONSUMERS.items():
            rows = []
            for c in self.of(consumer):
                about = [c.where, f"{c.quantity} [{c.unit}]", f"{c.time:g}"]
                rows.append([*about, cell(c.true), cell(c.believed), cell(c.nees, 3)])
            if rows:
                heads = ["", "", "time [s]", "true", "predicted", "NEES"]
                lines += ["", title, plain_table(heads, rows)]
        return "\n".join([*lines, "", "Recommended: " + self.recommended.text(units)])

    def _overconfident(self) -> list[str]:
        """Axes, or "horizontal", whose NEES is too large."""
        found = (each.where for each in self.checks if each.nees > tuning.INCONSISTENT)
        return list(dict.fromkeys(found))

    @property
    def _is_open(self) -> bool:
        """Whether the numbers are overconfident if a walk is as large as the record allows."""
        return any(each.code == "walk-not-covered" for each in self.notices)

    def _verdict(self) -> str:
        source = self.recommended.source.partition(":")[0] or "these error models"
        wrong = [name for name in self._overconfident() if name in self.numbers]
        where = "on all axes" if len(wrong) == len(self.numbers) else f"on {', '.join(wrong)}"
        if not wrong:
            where = "in the whole filter" if self._overconfident() else ""
        left = ", but only without the random walk that is left open" * self._is_open
        verdict = f"too small {where}: overconfident" if where else f"safe on all axes{left}"
        source += " and those in motion" * bool(self.of("motion"))
        return f"The numbers in use are {verdict}, if the errors are those of {source}."

    def _errors(self, longest: float) -> str:
        """A row for each axis and for the whole filter: errors, and NEES by time."""
        free = {check.time: None for check in self.checks if check.consumer not in _APART}
        rows = []
        for where in dict.fromkeys(check.where for check in self.checks):
            own = [check for check in self.checks if check.where == where]
            last = next(c for c in own if c.time == longest and c.consumer not in _APART)
            nees = {c.time: cell(c.nees, 3) for c in own if c.consumer not in _APART}
            pose = [cell(c.nees, 3) for c in own if c.consumer == "keyframes"]
            name = where if where in self.numbers else "whole filter"
            about = [name, f"{last.quantity} [{last.unit}]", cell(last.true), cell(last.believed)]
            rows.append([*about, *(nees[time] for time in free), *(pose or ["-"])])
        keyframe = next(check.time for check in self.of("keyframes"))
        times = [f"NEES\n{time:g} s" for time in free]
        heads = ["", "", "true", "predicted", *times, f"keyframes\n{keyframe:g} s"]
        return plain_table(heads, rows)

    def _covered(self, quantity: str, units: str) -> str:
        """N and K in use, and those that cover the model and each cause with it."""
        (N, n_scale), (K, k_scale) = (shown_unit(letter, quantity, units) for letter in "NK")
        rows = [
            [each.name, cell(each.N, scale=n_scale), cell(each.K, scale=k_scale)]
            for each in self.causes
            if each.quantity == quantity
        ]
        return plain_table([f"{quantity or 'axis'}, N and K", f"N\n{N}", f"K\n{K}"], rows)

    def _advice(self) -> list[str]:
        """What to do with the numbers in use: take others, or keep them."""
        # The last of these rows of each kind covers those before.
        needed = {c.quantity: c for c in self.causes if c.name in (_MODEL, _ALL, _MOTION)}
        names = dict.fromkeys(each.name for each in needed.values())
        row = " and ".join(f"the row '{name}'" for name in names)
        values = "; ".join(
            f"{quantity or 'axis'} N {each.N:.3g}, K {each.K:.3g}"
            for quantity, each in needed.items()
        )
        loose = [each for each in needed.values() if max(each.N_factor, each.K_factor) < _LOOSE]
        if self._overconfident() or self._is_open:
            times = f"{self.recommended.horizon:g} s"
            times += f" at rest, {HORIZON:g} s in motion" * (_MOTION in names)
            text = f"take {row}, for outages of {times}: {values} (SI, as gmwm export writes them)"
        elif loose:
            kinds = " and ".join(each.quantity or "axis" for each in loose)
            text = f"{kinds}: {row} is less than half of those in use, and as safe: {values} (SI)"
        else:
            text = "keep the numbers"
        for code, why in _DOUBTS.items():
            found = [
                name
                for name, axis in self.recommended.items()
                if any(each.code == code for each in axis.notices)
            ]
            text += f". Do not rely on {', '.join(found)}: {why}" if found else ""
        return wrapped(text, first="- ", indent=2)


def certify(
    source: One | Several,
    numbers: Given,
    *,
    outages: Sequence[float] = (10.0, 60.0),
    keyframe: float = 1.0,
    imperfections: Imperfections | None = None,
    motion: str | Motion | Recording | InMotion | None = None,
    aiding: str = "gnss",
    reference: Trajectory | None = None,
    bias_sd: Sd = 0.0,
    dt: float | None = None,
    rate: float | None = None,
) -> Certificate:
    """How consistent a filter will be with given numbers, and what they have to cover.

    Parameters
    ----------
    source : Process, Model, Fit, Calibration or mapping
        The truth.
    numbers : AxisFilterNumbers, FilterNumbers or mapping
        The numbers in use; a mapping has (N, K), a model or the numbers of an axis, by axis or kind
        ("gyro").
    outages : sequence of float, optional
        Times without aiding, s.
    keyframe : float, optional
        Interval of keyframes or scans between which poses are related, s.
    imperfections : Imperfections, optional
        Errors that static data cannot show, as far as they are known.
    motion : {"handheld", "drone", "car", "fixed-wing"}, Motion, Recording or InMotion, optional
        Motion that causes these errors: a usual one, or that of a recording. With a result of
        `gmwm.motion` the numbers are judged in that motion too, from 0.1 s to 1 s without updates.
    aiding : {"gnss", "pose", "odometry", "wheels"}, optional
        Aiding of the whole filter; see `gmwm.ins.loiter_with_outages`.
    reference : Trajectory, optional
        Trajectory for the whole filter, at its own sampling interval, in place of a loiter or, with
        wheels, of a car's drive.
    bias_sd : float or mapping, optional
        Standard deviation of a constant bias, such as the turn-on bias, in u; by axis or kind.
    dt, rate : float, optional
        Sampling interval (s) or rate (Hz) of models that are not fitted; 100 Hz by default.

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
    its last integral every second, then none; of a heading, the angle gained since if that is
    worse), of each axis between keyframes (the pose starts anew at each, the bias goes on), and of
    a whole aided filter on a trajectory, where all six axes are known. Odometry does not fix the
    position, so the distance since its last keyframe is judged, in the body axes of that keyframe.
    It covers neither nonlinearity nor errors that are not in the models.
    """
    times = given_times("outages", outages)
    keyframe = checks.positive("keyframe", keyframe, "give the interval of keyframes in seconds")
    axes = SensorAxes.of(source, dt, bias_sd, rate)
    axes.check_interval("keyframe", keyframe)
    axes.check_interval("outages", times[0])
    known = Imperfections() if imperfections is None else imperfections
    measured = motion if isinstance(motion, InMotion) else None
    moved = None if motion is None or isinstance(motion, InMotion) else Motion.of(motion)
    if known.needs_motion and moved is None:
        raise InputError(
            "these imperfections have no effect at rest: give a motion by name, or a recording"
        )
    horizon = times[-1]
    in_use = {axis.name: _in_use(numbers, axis, horizon) for axis in axes.axes}
    items: Any = source if isinstance(source, Mapping) else {axes.axes[0].name: source}
    safe = usable(
        items, horizon=horizon, bias_sd=bias_sd, dt=dt, rate=rate, **_kind_of(numbers, in_use)
    )
    starts = {name: one.initial_sd for name, one in safe.items()}
    in_use = {a.name: _in_use(numbers, a, horizon, starts[a.name]) for a in axes.axes}
    own = replace(safe, source="", axes=in_use)
    found = [check for axis in axes.axes for check in _of_axis(axis, own, times, keyframe)]
    checks.choice("aiding", aiding, tuple(AIDINGS))
    in_flight, notices = _in_flight(axes, own, times, (reference, aiding, keyframe))
    causes: list[Cause] = []
    for group in axes.groups:
        notices += _left_open(group, own, times, keyframe)
        rows, advice = _causes(group, own, horizon, known, moved)
        causes += rows
        notices += advice
        if measured is not None:
            more, row = _in_motion(measured, group, own, rows)
            found += more
            causes += row
            notices = [each for each in notices if each.code != "other-units"]
    notices += [each for each in measured.notices if each.severity == "warning"] if measured else []
    if measured is not None and not any(each.consumer == "motion" for each in found):
        seen = ", ".join(measured.numbers())
        raise InputError(f"the motion has only {seen}: give numbers for one of these axes or more")
    return Certificate(own, safe, (*found, *in_flight), tuple(causes), tuple(notices))


def _left_open(
    group: Sequence[AxisModel], numbers: FilterNumbers, times: Sequence[float], keyframe: float
) -> list[Notice]:
    """Whether numbers would be overconfident with the largest walks that the data leave open."""
    found = {}
    for axis in group:
        if (walk := open_walk(axis, times[-1])) > numbers[axis.name].K:
            terms = (*(term for term in axis.model.terms if not term.is_walk), RandomWalk(walk))
            checks = _of_axis(replace(axis, model=Model(terms)), numbers, times, keyframe)
            found[axis.name] = max(each.nees for each in checks), walk
    found = {name: each for name, each in found.items() if each[0] > tuning.INCONSISTENT}
    kind, (nees, walk) = group[0].quantity, max(found.values(), default=(0.0, 0.0))
    unit, scale = shown_unit("K", kind, "field")
    words: dict[str, Any] = {"axes": ", ".join(found), "shown": f"{walk * scale:.3g} {unit}"}
    return [notice("walk-not-covered", kind, {"K": walk, "nees": nees}, **words)] if found else []


def _in_motion(
    measured: InMotion, group: Sequence[AxisModel], numbers: FilterNumbers, rows: Sequence[Cause]
) -> tuple[list[Check], list[Cause]]:
    """Errors in motion beside those that numbers predict, and the numbers that cover them.

    rows: Causes at rest, which these numbers cover too. Axes that the motion does not show are
    not judged in it.
    """
    least, found = measured.numbers(), []
    unit = SI_UNIT.get(group[0].quantity, "u")
    names = [axis.name for axis in group if axis.name in least]
    if not names:
        return [], []
    for name in names:
        tau, variance = measured.envelope(name)
        times = np.array([INTERVAL, *tau[(tau > INTERVAL) & (tau < HORIZON)], HORIZON])
        true = between(tau, variance, times)
        own = 2.0 * numbers[name].model.haar_variance(times, measured.curves[0].tau[0])
        found += [
            Check(
                "motion", name, "rate", unit, float(t), float(np.sqrt(a)), float(np.sqrt(b)), a / b
            )
            for t, a, b in zip(times, true, own, strict=True)
        ]
    at_rest = [each for each in rows if each.name in (_MODEL, _ALL)][-1]
    N, K = (
        max(getattr(at_rest, k), *(float(least[a].params[k] or 0.0) for a in names)) for k in "NK"
    )
    in_use = [max(getattr(numbers[axis.name], k) for axis in group) for k in "NK"]
    factors = [_ratio(value, over) for value, over in zip((N, K), in_use, strict=True)]
    return found, [Cause(group[0].quantity, _MOTION, N, K, *factors)]


def _kind_of(given: Given, in_use: Mapping[str, AxisFilterNumbers]) -> dict[str, Any]:
    """Options of `usable` for numbers of the kind in use: as many terms, shared by as many axes."""
    forms = {one.form for one in in_use.values()}
    form = forms.pop() if len(forms) == 1 and forms <= set(KINDS) else "N+K"
    taus = {one.tau for one in in_use.values()}
    is_common = form != "N+K" and len(in_use) > 1 and len(taus) == 1
    is_by_axis = isinstance(given, Mapping) and any(name in given for name in in_use)
    is_shared = given.shared if isinstance(given, FilterNumbers) else not is_by_axis
    return {"form": form, "shared": is_shared, "tau": SHARED if is_common else None}


def _in_use(given: Given, axis: AxisModel, horizon: float, start: float = 0.0) -> AxisFilterNumbers:
    """The numbers of one axis in use; those without a horizon (s) or start (u) get the given."""
    kind = axis.quantity or axis.name
    names = [name for name in (axis.name, kind) if isinstance(given, Mapping) and name in given]
    if isinstance(given, Mapping) and not names:
        raise InputError(
            f"there are no numbers for {axis.name or 'the axis'}: give them by axis, or for "
            f"{kind or 'gyro and accel'}"
        )
    item: Any = given[names[0]] if isinstance(given, Mapping) else given
    if isinstance(item, AxisFilterNumbers):
        return item
    if isinstance(item, Process | Model):
        model = as_model(item)
    elif isinstance(item, tuple | list) and len(item) == 2:
        what = f"N and K of {axis.name or kind or 'the axis'}"
        N, K = (checks.positive(what, value) for value in item)
        model = WhiteNoise(N) + RandomWalk(K)
    else:
        raise InputError(
            f"{checks.shown(item)} gives no filter numbers: give N and K, a model, or a result of "
            "gmwm.bound"
        )
    kinds = [type(term).__name__ for term in model.terms]
    slow = {0: "", 1: "+GM", 2: "+2GM"}.get(kinds.count("GaussMarkov"), "+?")
    form = "N" + "+K" * ("RandomWalk" in kinds) + slow
    return AxisFilterNumbers(form, model, horizon, start, "given", quantity=axis.quantity)


def _of_axis(
    axis: AxisModel, numbers: FilterNumbers, times: Sequence[float], keyframe: float
) -> list[Check]:
    """Errors of one axis without aiding, and between keyframes."""
    believed = numbers[axis.name]
    result = []
    for consumer, chain, ends in (
        ("free", axis.chain, times),
        ("keyframes", Chain.of_poses(axis.quantity, keyframe), (keyframe,)),
    ):
        errors = chain.worse(
            axis.model, believed.model, axis.dt, ends, axis.bias_sd, believed.initial_sd
        )
        what, unit, scale = _SHOWN[chain.order] if axis.quantity else ("integral", "u s", 1.0)
        for time, actual, predicted, nees in zip(
            ends, errors.actual, errors.predicted, errors.nees(), strict=True
        ):
            true, own = (scale * float(np.sqrt(each[-1, -1])) for each in (actual, predicted))
            result.append(Check(consumer, axis.name, what, unit, time, true, own, float(nees)))
    return result


def _in_flight(
    axes: SensorAxes,
    numbers: FilterNumbers,
    times: Sequence[float],
    aided: tuple[Trajectory | None, str, float],
) -> tuple[list[Check], list[Notice]]:
    """Errors of an aided INS at the end of outages, where there are six axes.

    aided: Trajectory, aiding and interval of keyframes (s) of `loiter_with_outages`.
    """
    try:
        truth = SensorModels.of(
            {axis.name: axis.model for axis in axes.axes},
            {axis.name: axis.bias_sd for axis in axes.axes},
        )
        believed = SensorModels.of(numbers)
        scenario = loiter_with_outages(times, axes.axes[0].dt, *aided)
        analysis = covariance_analysis(scenario, truth, believed)
    except InputError as error:
        return [], [notice("no-navigation-filter", reason=str(error))]
    judged = analysis.since or analysis
    nees, result = judged.nees(slice(0, 3)), []
    what = "position" if analysis.since is None else "way"
    consumer = "outage" if aided[1] == "gnss" else aided[1]
    for outage in scenario.outages:
        at, time = analysis.index(outage.end), outage.duration
        true, own = (
            float(np.sqrt(np.trace(each[at, :2, :2]))) for each in (judged.actual, judged.predicted)
        )
        where = (consumer, "horizontal", what, "m")
        result.append(Check(*where, time, true, own, float(nees[at])))
    return result, []


def _causes(
    group: tuple[AxisModel, ...],
    numbers: FilterNumbers,
    horizon: float,
    known: Imperfections,
    motion: Motion | None,
) -> tuple[list[Cause], list[Notice]]:
    """What N and K of a kind of sensor have to cover."""
    kind = group[0].quantity

    def least(axes: tuple[AxisModel, ...], level: float | None = None) -> AxisFilterNumbers:
        found = bound_of(axes, "N+K", horizon, level)[0]
        return found if level is not None else with_limits(axes[0], axes, found, None)

    def row(name: str, found: AxisFilterNumbers, over: tuple[float, float]) -> Cause:
        K = max(found.K, first.K if "K" in first.upper else 0.0)
        return Cause(kind, name, found.N, K, _ratio(found.N, over[0]), _ratio(K, over[1]))

    in_use = [numbers[axis.name] for axis in group]
    N, K = max(each.N for each in in_use), max(each.K for each in in_use)
    first = least(group)
    alone = (first.N, first.K)
    causes = [
        Cause(kind, "in use", N, K, 1.0, 1.0),
        row(_MODEL, first, (N, K)),
    ]
    notices = []
    if N > tuning.OTHER_UNITS * first.N > 0.0:
        unit = SI_UNIT.get(kind, "u")
        notices.append(notice("other-units", kind, {"factor": N / first.N}, unit=unit))
    if all(axis.fit is not None for axis in group):
        try:
            causes.append(row("error model, to 95 %", least(group, 0.95), alone))
        except InputError as error:
            where, why = kind or group[0].name, error.problem
            notices.append(notice("uncertainty-not-covered", where, variant="why", reason=why))
    terms = known.terms(kind or "gyro", motion)
    for cause, term in terms.items():
        larger = row(cause, least(_with(group, [term])), alone)
        causes.append(larger)
        if motion is not None and isinstance(term, WhiteNoise):
            # The integral of a derivative is the difference of the motion at two times.
            times = horizon / motion.memory
            factor = float(np.sqrt(times / -np.expm1(-times)))
            notices.append(
                notice("bounded-error", kind, {"factor": factor}, cause=cause, horizon=horizon)
            )
        if max(larger.N_factor, larger.K_factor) > tuning.LARGE:
            values = {"N_factor": larger.N_factor, "K_factor": larger.K_factor}
            notices.append(notice("estimate-it", kind, values, cause=cause))
    if terms:
        every = least(_with(group, list(terms.values())))
        causes.append(row(_ALL, every, (N, K)))
    return causes, notices


def _with(group: Sequence[AxisModel], terms: Sequence[Process]) -> tuple[AxisModel, ...]:
    """Axes with more terms; white noise joins that of the model."""
    added = [term for term in terms if not isinstance(term, WhiteNoise)]
    density = sum(float(term.N or 0.0) ** 2 for term in terms if isinstance(term, WhiteNoise))
    result = []
    for axis in group:
        parts = axis.model.terms
        if density > 0.0:
            white = WhiteNoise(float(np.sqrt(axis.model.white_density() + density)))
            parts = (*(part for part in parts if not part.is_white), white)
        result.append(replace(axis, model=Model((*parts, *added)), fit=None))
    return tuple(result)


def _ratio(value: float, over: float) -> float:
    return value / over if over > 0.0 else float("inf")
