"""The model of one channel, selected or fitted, and what makes it invalid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from gmwm.calibration.departures import Departure, departures, with_departures
from gmwm.calibration.stages import stage
from gmwm.calibration.steadiness import steadiness_notice
from gmwm.calibration.summary import with_largest_walk
from gmwm.errors import InputError
from gmwm.estimate import Fit, estimate
from gmwm.issues import Notice, failure, notice
from gmwm.process import Model, Process
from gmwm.selection import Selection, select
from gmwm.variance import WaveletVariance

LONGEST_PART = "longest-part"
"""Code of the advice for a recording with several departures from noise."""

GivenModels = Process | Model | Mapping[str, Process | Model] | None
"""Models as the user gives them."""

Removed = Sequence[Sequence[Departure]]
"""Departures of each recording that were subtracted."""


@dataclass(frozen=True)
class ChannelModel:
    """Fit of a channel and how its model was chosen.

    selection: None where the model was given.
    largest: With the largest walk that the record leaves open, if the selected model has none.
    """

    fit: Fit
    selection: Selection | None
    largest: Model | None = None


Found = Mapping[str, ChannelModel | Notice]
"""Channel name -> its model, or why it has none."""


def model_of(name: str, model: GivenModels) -> Process | Model | None:
    """The model given for a channel: its own, its sensor's, or that of "" for all."""
    if not isinstance(model, Mapping):
        return model
    for key in (name, name.partition("_")[0], ""):
        if key in model:
            return model[key]
    hint = "add one to the mapping"
    raise InputError(
        f"no model is given for channel {name!r}", "model-missing", hint, {"channel": name}
    )


def channel_model(
    name: str,
    variances: Callable[[Removed], Sequence[WaveletVariance]],
    model: Process | Model | None,
    sources: Sequence[str],
    *,
    extra: Sequence[Process] = (),
    removals: int = 0,
) -> ChannelModel | Notice:
    """The model of a channel, or why it has none.

    variances: Wavelet variances of each recording without the departures that it is given.
    model: Fitted; None selects one.
    sources: Of the recordings.
    extra: Terms that a selected model may have.
    removals: How many times evident departures are subtracted, and the rest fitted again.
    """
    removed: list[tuple[Departure, ...]] = [()] * len(sources)
    before: Sequence[WaveletVariance] = ()
    try:
        for left in range(removals, -1, -1):
            with stage("variance"):
                parts = variances(removed)
                before = before or parts
            with stage("model"):
                found = _fitted(parts[0] if len(parts) == 1 else parts, model, extra)
            with stage("departures"):
                there = [departures(found.fit, part) for part in parts]
            if not left or not any(there):
                break
            removed = [gone + more for gone, more in zip(removed, there, strict=True)]
    except InputError as error:
        return failure(error.code or "not-estimable", name, str(error))
    curves = list(zip(before, parts, strict=True))
    fit = with_departures(found.fit, sources, there, removed, curves, removing=removals > 0)
    with stage("departures"):
        changes = [
            replace(change, source=source if len(sources) > 1 else "")
            for part, known, source in zip(parts, there, sources, strict=True)
            if (change := steadiness_notice(found.fit, part, known)) is not None
        ]
    return replace(found, fit=replace(fit, notices=(*fit.notices, *changes)))


def _fitted(
    data: WaveletVariance | Sequence[WaveletVariance],
    model: Process | Model | None,
    extra: Sequence[Process],
) -> ChannelModel:
    if model is not None:
        return ChannelModel(estimate(model, data), None)
    selection = select(data, extra=extra)
    _ = selection.rivals  # found here, where channels are done side by side
    return ChannelModel(selection.fit, selection, with_largest_walk(selection.fit))


def with_validity(found: Found, issues: Sequence[Notice], *, still: bool) -> Found:
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

    marked: dict[str, ChannelModel | Notice] = {}
    for name, each in found.items():
        marked[name] = each
        if isinstance(each, Notice):
            continue
        sensor = each.fit.wv.quantity or "gyro"
        spoiling = [issue for issue in issues if spoils(issue, name, sensor)]
        # Those of the sensor first; of one code and place, the last one.
        spoiling.sort(key=lambda issue: "channel" in issue.issue.spoils)
        own = {(issue.code, issue.where): replace(issue, where="", source="") for issue in spoiling}
        fit = replace(each.fit, notices=(*own.values(), *each.fit.notices))
        marked[name] = replace(each, fit=fit)
    return marked


def advise_cut(found: Found, length: float) -> tuple[Found, list[Notice]]:
    """Where several departures can be cut off, name the longest part without any of them.

    length: Of a single recording, s; 0 for several.
    Returns: the models, whose departures refer to that advice, and the advice.
    """
    spans = []
    departed: list[Notice] = []
    for each in found.values():
        for issue in () if isinstance(each, Notice) else each.fit.notices:
            if issue.severity == "note":
                continue
            if issue.code == "step":
                spans.append((issue.values["time_lower"], issue.values["time_upper"]))
            elif issue.code == "transient":
                spans.append((0.0, 3.0 * issue.values["time_upper"]))
            elif issue.code == "drift-at-start":
                spans.append((0.0, issue.values["time_upper"]))
            else:
                continue
            departed.append(issue)
    if not length or len(departed) < 2:
        return found, []
    parts, free = [], 0.0
    for start, stop in [*sorted(spans), (length, length)]:
        parts.append((start - free, free, start))
        free = max(free, stop)
    kept, start, stop = max(parts)
    removable = all(each.values["removable"] for each in departed)
    values = {"start": start, "stop": stop, "of": length, "removable": removable}
    also = ", or subtract them (remove_departures=True)" if removable else ""
    advice = notice(LONGEST_PART, "", values, count=len(departed), kept=kept, also=also)

    def together(issue: Notice) -> Notice:
        if issue not in departed:
            return issue
        hint = "leave it out with the others, or subtract them"
        return replace(issue, values={**issue.values, "together": True}, hint=hint)

    return {
        name: each
        if isinstance(each, Notice)
        else replace(each, fit=replace(each.fit, notices=tuple(map(together, each.fit.notices))))
        for name, each in found.items()
    }, [advice]
