"""The model of one channel, selected or fitted, and what makes it invalid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gmwm.calibration.departures import Departure, departure_notices, departures
from gmwm.calibration.removal import variance_without
from gmwm.calibration.stages import Stopwatch, stage
from gmwm.calibration.steadiness import steadiness_notice
from gmwm.calibration.unresolved import with_largest_walk
from gmwm.errors import InputError
from gmwm.estimate import Fit, estimate
from gmwm.issues import Notice, failure, notice
from gmwm.process import Model, Process, as_model
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
    """

    fit: Fit
    selection: Selection | None
    largest: Model | None = None

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
    """

    name: str
    parts: Sequence[Channel]
    sources: Sequence[str]
    model: Process | Model | None
    extra: Sequence[Process]
    robust: bool
    removals: int

    def timed_model(self) -> tuple[ChannelModel | Notice, Stopwatch]:
        """The model of the channel, or why it has none, and the time that it took."""
        with Stopwatch().running() as watch:
            try:
                found: ChannelModel | Notice = self._model()
            except InputError as error:
                found = failure(error.code or "not-estimable", self.name, str(error))
        return found, watch

    def _model(self) -> ChannelModel:
        removed: list[tuple[Departure, ...]] = [()] * len(self.parts)
        before: list[WaveletVariance] = []
        for left in range(self.removals, -1, -1):
            with stage("variance"):
                both = zip(self.parts, removed, strict=True)
                after = [variance_without(part, gone, robust=self.robust) for part, gone in both]
                before = before or after
            with stage("model"):
                found = self._fitted(after[0] if len(after) == 1 else after)
            with stage("departures"):
                there = [departures(found.fit, each) for each in after]
            if not left or not any(there):
                break
            removed = [gone + more for gone, more in zip(removed, there, strict=True)]
        fit, removing = found.fit, self.removals > 0
        records = list(zip(there, removed, before, after, strict=True))
        notices = [departure_notices(fit, *each, removing=removing) for each in records]
        with stage("departures"):
            changes = [steadiness_notice(fit, wv, known) for known, _, _, wv in records]
        notices += [[each] if each else [] for each in changes]
        sources = self.sources if len(records) > 1 else [""]
        named = [
            replace(each, source=source)
            for source, issues in zip([*sources, *sources], notices, strict=True)
            for each in issues
        ]
        return replace(found, fit=replace(fit, notices=(*fit.notices, *named)))

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
    removable = all(each.values["removable"] for each in departed)
    values = {"start": start, "stop": stop, "of": length, "removable": removable}
    also = ", or subtract them (remove_departures=True)" if removable else ""
    advice = notice(LONGEST_PART, "", values, count=len(departed), kept=kept, also=also)
    hint = "leave it out with the others, or subtract them"
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
