"""The model of one channel: selected or fitted, with the departures beside its noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from gmwm.calibration.departures import Departure, departures, with_departures
from gmwm.calibration.stages import stage
from gmwm.calibration.steadiness import steadiness_notice
from gmwm.calibration.summary import with_largest_walk
from gmwm.errors import InputError
from gmwm.estimate import Fit, estimate
from gmwm.issues import Notice
from gmwm.process import Model, Process
from gmwm.selection import Selection, select
from gmwm.variance import WaveletVariance

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


def model_of(name: str, model: GivenModels) -> Process | Model | None:
    """The model given for a channel."""
    if not isinstance(model, Mapping):
        return model
    if name not in model:
        raise InputError(f"no model is given for channel {name!r}: add one to the mapping")
    return model[name]


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
        return _why_not(name, error)
    curves = list(zip(before, parts, strict=True))
    fit = with_departures(found.fit, sources, there, removed, curves, removing=removals > 0)
    with stage("departures"):
        changes = [
            replace(notice, source=source if len(sources) > 1 else "")
            for part, known, source in zip(parts, there, sources, strict=True)
            if (notice := steadiness_notice(found.fit, part, known)) is not None
        ]
    return replace(found, fit=replace(fit, notices=(*fit.notices, *changes)))


def _why_not(name: str, error: InputError) -> Notice:
    """Why a channel has no model: the issue of the error's code, in the words of the error."""
    return Notice(error.code or "not-estimable", "bad", name, str(error))


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
