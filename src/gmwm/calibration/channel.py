"""The model of one channel: selected or fitted, with the departures beside its noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from gmwm._core.notices import Notice
from gmwm.calibration.calibration import Calibration
from gmwm.calibration.departures import Departure, departures, with_departures
from gmwm.calibration.stages import stage
from gmwm.calibration.steadiness import steadiness_notice
from gmwm.calibration.unresolved import unresolved_notice, with_largest_walk
from gmwm.errors import InputError
from gmwm.estimate import Fit, estimate
from gmwm.process import Model, Process
from gmwm.selection import Selection, select, wider_ranges
from gmwm.variance import WaveletVariance

GivenModels = Process | Model | Mapping[str, Process | Model] | None
"""Models as the user gives them."""

Removed = Sequence[Sequence[Departure]]
"""Departures of each recording that were taken off."""

AMBIGUITY = "ambiguity"
"""Code of the notice that several models describe a channel equally well."""


@dataclass(frozen=True)
class ChannelModel:
    """What was found of a channel.

    selection: None where the model was given.
    largest: With the largest walk that the record leaves open, if the selected model has none.
    """

    fit: Fit
    selection: Selection | None
    largest: Model | None = None


def model_of(name: str, model: GivenModels) -> Process | Model | None:
    """What is given for a channel."""
    if not isinstance(model, Mapping):
        return model
    if name not in model:
        raise InputError(f"no model is given for channel {name!r}: add one to the mapping")
    return model[name]


def mostly_missing(name: str, missing: int, n: int) -> Notice | None:
    """Why a channel is skipped of which more than half of the samples are missing."""
    if missing <= n / 2:
        return None
    text = f"{missing:,} of {n:,} samples missing, more than half"
    return Notice("mostly-missing", "bad", name, text, {"missing": missing})


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
    removals: How many times evident departures are taken off, and the rest fitted again.
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
        return Notice(error.code or "not-estimable", "bad", name, str(error))
    curves = list(zip(before, parts, strict=True))
    fit = with_departures(found.fit, sources, there, removed, curves, removing=removals > 0)
    with stage("departures"):
        changes = [
            replace(notice, source=source if len(sources) > 1 else "")
            for part, known, source in zip(parts, there, sources, strict=True)
            if (notice := steadiness_notice(found.fit, part, known)) is not None
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


def calibration_of(
    models: Mapping[str, ChannelModel | Notice],
    dead: Mapping[str, Notice],
    notices: Sequence[Notice],
    *,
    source: str,
    rate: float,
    n: int,
    left_out: Mapping[str, tuple[tuple[int, int], ...]] | None = None,
) -> Calibration:
    """What was found of the channels, together.

    models: Of each channel on which work was done.
    dead: Why there was none on others.
    notices: Of the whole recording.
    source, rate, n, left_out: As in `Calibration`.
    Raises InputError if no channel has a model.
    """
    done = {name: each for name, each in models.items() if isinstance(each, ChannelModel)}
    skipped = {name: each for name, each in models.items() if isinstance(each, Notice)}
    skipped = {**dead, **skipped}
    if not done:
        why = "; ".join(f"{name}: {each.text}" for name, each in skipped.items())
        raise InputError(f"{source or 'the recording'}: {why}")
    tied = {name: each.selection for name, each in done.items() if each.selection is not None}
    tied = {name: each for name, each in tied.items() if each.rivals}
    rivals = {name: [rival.model for rival in each.rivals] for name, each in tied.items()}
    left_open = {name: each.largest for name, each in done.items() if each.largest is not None}
    for name, largest in left_open.items():
        rivals.setdefault(name, []).append(largest)
    return Calibration(
        fits={name: each.fit for name, each in done.items()},
        skipped=skipped,
        source=source,
        rate=rate,
        n=n,
        notices=(
            *notices,
            *(_ambiguity(name, each) for name, each in tied.items()),
            *(unresolved_notice(name, done[name].fit, each) for name, each in left_open.items()),
        ),
        rivals={name: tuple(models) for name, models in rivals.items()},
        left_out=left_out or {},
    )


def _ambiguity(name: str, selection: Selection) -> Notice:
    """Which models tie, and the parameters of which that leaves less known."""
    models = [fitted.model.title() for fitted in (selection.fit, *selection.rivals)]
    text = f"{len(models)} models describe the data equally well: {'; '.join(models)}"
    better = selection.surpassed_by
    if better is not None and better.model.title() in models:
        text += f" (best is that with bias instability, of {better.n_parameters} parameters)"
    wider = wider_ranges(selection.fit, selection.ranges())
    if wider:
        text += f". If none of them is ruled out: {', '.join(wider)}"
    values = {"models": len(models)}
    return Notice(AMBIGUITY, "note", name, text, values, "the first is used")
