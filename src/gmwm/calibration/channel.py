"""The model of one channel, selected or fitted, what it leaves open and what makes it invalid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.text import brief
from gmwm._core.units import customary_unit
from gmwm.calibration import tuning
from gmwm.calibration.covariates import Design
from gmwm.calibration.curve import BiasCurve
from gmwm.calibration.departures import Departure, departure_notices, departures, variance_without
from gmwm.calibration.numbers import upper_limit
from gmwm.calibration.steadiness import steadiness_notice
from gmwm.errors import InputError
from gmwm.estimate import Fit, estimate
from gmwm.issues import Notice, failure, notice
from gmwm.process import Model, Process, RandomWalk, as_model
from gmwm.readers import Channel
from gmwm.selection import Selection, select
from gmwm.variance import WaveletVariance

LONGEST_PART = "longest-part"
"""Code of the advice for a recording with several departures from noise."""

GivenModels = Process | Model | str | Mapping[str, Process | Model | str] | None
"""Models as the user gives them."""


@dataclass(frozen=True)
class ChannelModel:
    """Fit of a channel and how its model was chosen.

    selection: None where the model was given.
    largest: With the largest walk that the record leaves open, if the selected model has none.
    curve: Beside the noise, where there are covariates.
    """

    fit: Fit
    selection: Selection | None
    largest: Model | None = None
    curve: BiasCurve | None = None

    @property
    def rivals(self) -> tuple[Model, ...]:
        """Models that describe the channel equally well, that with the largest walk last."""
        rivals = self.selection.rivals if self.selection is not None else ()
        return (*(each.model for each in rivals), *([] if self.largest is None else [self.largest]))


def model_of(name: str, model: GivenModels) -> Model | None:
    """The model given for a channel: its own, its sensor's, or that of "" for all."""
    if not isinstance(model, Mapping):
        return None if model is None else as_model(model)
    for key in (name, name.partition("_")[0], ""):
        if key in model:
            return as_model(model[key])
    hint = f"add one, as in model={{{name!r}: 'N + K'}}"
    raise InputError(
        f"no model is given for channel {name!r}", "model-missing", hint, {"channel": name}
    )


@dataclass(frozen=True, eq=False)
class ChannelTask:
    """A channel whose model is to be found.

    parts: In each recording.
    model: Fitted; None selects one.
    extra: Terms that a selected model may have.
    removals: How many times evident departures are subtracted, and the rest fitted again.
    design: Regressors of the curve beside the noise, at the recordings' ``places``.
    """

    name: str
    parts: Sequence[Channel]
    sources: Sequence[str]
    model: Process | Model | None
    extra: Sequence[Process]
    robust: bool
    removals: int
    design: Design | None = None
    places: Sequence[int] = ()

    def model_or_why(self) -> ChannelModel | Notice:
        """The model of the channel, or why it has none."""
        try:
            return self._model()
        except InputError as error:
            return failure(error.code or "not-estimable", self.name, str(error))

    def _model(self) -> ChannelModel:
        removed: list[tuple[Departure, ...]] = [()] * len(self.parts)
        before: list[WaveletVariance] = []
        for left in range(self.removals, -1, -1):
            both = zip(self.parts, removed, strict=True)
            after = [variance_without(part, gone, robust=self.robust) for part, gone in both]
            if self.design is not None:
                together = zip(after, self.places, strict=True)
                after = [self.design.beside(wv, place) for wv, place in together]
            before = before or after
            found = self._fitted(after[0] if len(after) == 1 else after)
            there = [departures(found.fit, each) for each in after]
            if not left or not any(there):
                break
            removed = [gone + more for gone, more in zip(removed, there, strict=True)]
        # Beside a curve nothing can be subtracted: it would take the curve with it.
        fit, removing = found.fit, self.removals > 0 or self.design is not None
        records = list(zip(there, removed, before, after, strict=True))
        notices = [departure_notices(fit, *each, removing=removing) for each in records]
        changes = [steadiness_notice(fit, wv, known) for known, _, _, wv in records]
        notices += [[each] if each else [] for each in changes]
        sources = self.sources if len(records) > 1 else [""]
        named = [
            replace(each, source=source)
            for source, issues in zip([*sources, *sources], notices, strict=True)
            for each in issues
        ]
        curve = None
        if self.design is not None:
            named += self.design.notices
            one = next(iter(self.design.covariates), None)
            growth = self.design.scaling(self.parts, self.places)
            found_curve = self.design.curve(fit, may_lack=self.model is None)
            curve = replace(found_curve, scaling=growth)
            if growth is not None and one is not None:
                said = growth.notice(one.name, one.unit, one.low, one.high)
                named += [said] if said is not None else []
        return replace(found, fit=replace(fit, notices=(*fit.notices, *named)), curve=curve)

    def _fitted(self, data: WaveletVariance | Sequence[WaveletVariance]) -> ChannelModel:
        if self.model is not None:
            return ChannelModel(estimate(self.model, data), None)
        selection = select(data, extra=self.extra)
        _ = selection.rivals  # found here, where channels are done side by side
        return ChannelModel(selection.fit, selection, with_largest_walk(selection.fit))


def with_validity(
    found: Mapping[str, ChannelModel], issues: Sequence[Notice], *, still: bool
) -> dict[str, ChannelModel]:
    """Models of channels, with fits that are not valid where the data were not fit for them.

    issues: Of the recordings and their channels.
    still: Whether a recording that was not static is an issue.
    """

    def spoils(issue: Notice, name: str, sensor: str) -> bool:
        if issue.severity != "bad" or (issue.code == "not-static" and not still):
            return False
        if "channel" in issue.issue.spoils:
            return issue.where == name
        return sensor in issue.issue.spoils and issue.where in ("", sensor)

    marked = {}
    for name, each in found.items():
        sensor = each.fit.wv.quantity or "gyro"
        spoiling = [issue for issue in issues if spoils(issue, name, sensor)]
        # Those of the sensor first; of one code and place, the last one.
        spoiling.sort(key=lambda issue: "channel" in issue.issue.spoils)
        own = {(issue.code, issue.where): replace(issue, where="", source="") for issue in spoiling}
        fit = replace(each.fit, notices=(*own.values(), *each.fit.notices))
        marked[name] = replace(each, fit=fit)
    return marked


def advise_cut(
    found: Mapping[str, ChannelModel], length: float
) -> tuple[dict[str, ChannelModel], list[Notice]]:
    """Where several departures can be cut off, name the longest part without any of them.

    length: Of a single recording, s; 0 for several.
    Returns: the models, whose departures refer to that advice, and the advice.
    """
    departed = [
        issue
        for each in found.values()
        for issue in each.fit.notices
        if issue.code in ("step", "transient", "drift-at-start") and issue.severity != "note"
    ]
    if not length or len(departed) < 2:
        return dict(found), []
    spans = []
    for issue in departed:
        last = issue.values["time_upper"] * (3.0 if issue.code == "transient" else 1.0)
        spans.append((issue.values["time_lower"] if issue.code == "step" else 0.0, last))
    parts, free = [], 0.0
    for start, stop in [*sorted(spans), (length, length)]:
        parts.append((start - free, free, start))
        free = max(free, stop)
    kept, start, stop = max(parts)
    if kept <= 0.0:
        return dict(found), []
    removable = all(each.values["removable"] for each in departed)
    values = {"start": start, "stop": stop, "of": length, "removable": removable}
    advice = notice(LONGEST_PART, "", values, count=len(departed), kept=kept)
    way = "subtract all of them (remove_departures=True)"
    hint = way if removable else "calibrate the longest part without any"
    marked = {}
    for name, each in found.items():
        notices = tuple(
            replace(issue, values={**issue.values, "together": True}, hint=hint)
            if issue in departed
            else issue
            for issue in each.fit.notices
        )
        marked[name] = replace(each, fit=replace(each.fit, notices=notices))
    return marked, [advice]


UNRESOLVED = "unresolved-walk"
"""Code of the notice that a walk may be there that the model lacks."""


def with_largest_walk(fitted: Fit) -> Model | None:
    """The model with the random walk that is its upper bound (95 %), fitted beside it.

    None where the model has a walk or a ramp, or the walk would change little at `tuning.OPEN_AT`.
    """
    if any(term.is_drift for term in fitted.model.terms):
        return None
    try:
        if fitted.params.get("K", 0.0) > 0.0 and "K" not in fitted.upper_bounds:
            return None
        walk = upper_limit(fitted, "K")
        noise = Model(tuple(t for t in fitted.model.terms if not isinstance(t, RandomWalk)))
        free = [key for key in (*fitted.keys, *fitted.upper_bounds) if key in noise.params]
        largest = estimate(
            noise.with_params(dict.fromkeys(free)) + RandomWalk(walk), fitted.wv
        ).model
    except InputError:  # of a record so short that nothing bounds it
        return None
    return largest if _growth(fitted, largest)[1] > tuning.OPEN else None


def unresolved_notice(name: str, fitted: Fit, largest: Model) -> Notice:
    """Say how large the walk and its effect may be."""
    walk, (tau, growth) = largest.params["K"] or 0.0, _growth(fitted, largest)
    unit, per_si = customary_unit("u/s/sqrt(Hz)", fitted.wv.quantity, fitted.wv.unit)
    values = {"K": walk, "tau": tau, "growth": growth}
    shown = f"{walk * per_si:.2g} {unit}"
    return notice(UNRESOLVED, name, values, shown=shown, times=brief(growth))


def _growth(fitted: Fit, largest: Model) -> tuple[float, float]:
    """The time that is looked at, s, and the ratio of the deviations of two models there."""
    tau, dt = max(tuning.OPEN_AT, fitted.wv.dt), fitted.wv.dt
    there, least = (float(m.haar_variance(np.array([tau]), dt)[0]) for m in (largest, fitted.model))
    return tau, float(np.sqrt(there / least)) if least > 0.0 else float("inf")
