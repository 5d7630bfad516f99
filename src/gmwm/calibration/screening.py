"""Prepare a recording for a fit: stretches at rest, samples left out, terms offered."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gmwm.calibration import tuning
from gmwm.diagnosis import Health, Repetition, health, rest_of
from gmwm.errors import InputError
from gmwm.issues import Notice
from gmwm.process import Model, Process, Resonance, Sinusoid
from gmwm.readers import Recording
from gmwm.variance import wavelet_variance

SCREENING = ("events", "lines", "resonances", "outliers")
"""Samples of shocks, spikes and lost packets are masked; lines and resonances are terms that a
model may have; the wavelet variances of channels with more outliers than can be left out are
robust."""


@dataclass(frozen=True)
class Screened:
    """A recording after screening.

    recording: Without the samples of shocks and spikes, with a notice of how many these were.
    extra: Channel name -> terms that its model may have, strongest first.
    robust: Channels whose wavelet variances are to be robust.
    repeated: Channels of which each sample is written several times, and how often.
    notices: Those of the reader, then what was found, with what is done about it here as
        ``hint``.
    """

    recording: Recording
    extra: dict[str, tuple[Process, ...]]
    robust: frozenset[str] = field(default=frozenset())
    repeated: Mapping[str, Repetition] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()


def stretches_at_rest(recording: Recording) -> tuple[Recording, ...]:
    """The recording itself if it is static, else its longest stretches at rest.

    The first of them has the notices of the recording, with one on which stretches are used.

    Raises InputError if it is not static and has no stretch at rest.
    """
    if any(notice.code == "rate-changes" for notice in recording.notices):
        return (recording,)  # times of its parts are not known
    if len(alike := recording.by_rate()) > 1:
        parts = [part for each in alike for part in stretches_at_rest(each)]
        return (recording,) if len(parts) == len(alike) else tuple(parts)
    found = rest_of(recording)
    if found is None:
        return (recording,)
    if not found.stretches:
        raise InputError(
            f"{recording.source or 'the recording'} is not static, and its longest stretch at rest "
            f"has {found.longest:.3g} s |{found.timeline}| where 10 s are needed",
            "no-rest",
            "record at rest, or give still=False to treat everything as static",
        )
    longest = sorted(found.stretches, key=lambda each: each[0] - each[1])
    used = sorted(longest[: tuning.MOST_STRETCHES])
    parts = [recording.part(start, stop) for start, stop in used]
    named = [
        replace(
            part,
            source=f"{recording.source or 'recording'} from {start:.4g} to {stop:.4g} s",
            # What was noticed of the recording is not noticed of each part.
            notices=tuple(n for n in part.notices if n not in recording.notices),
        )
        for part, (start, stop) in zip(parts, used, strict=True)
    ]
    whole = [  # motion looks like noise of a gyro in another unit
        replace(notice, severity="warning") if notice.code == "gyro-unit" else notice
        for notice in recording.notices
        if notice.code != "missing-samples"
    ]
    first = replace(named[0], notices=(*whole, found.notice(), *named[0].notices))
    return (first, *named[1:])


def screened(recording: Recording, chosen: Collection[str] = SCREENING) -> Screened:
    """Examine a recording and mask, offer terms or make variances robust as it needs.

    Outliers all over the record are left out like shocks. Where that would take more than a tenth
    of the samples, or they are not to be left out, the wavelet variances are robust instead.

    chosen: Some of `SCREENING`.
    Raises InputError if one of those chosen is unknown.
    """
    for name in chosen:
        if name not in SCREENING:
            known = ", ".join(SCREENING)
            raise InputError(f"screening for {name!r} is unknown: choose from {known}")
    if not chosen:
        return Screened(recording, {}, notices=recording.notices)
    found = health(recording)
    names = [channel.name for channel in recording.inertial]
    robust = frozenset(
        name for name in names if "outliers" in chosen and found.outliers(name) > 0.0
    )
    masked, left_out, losses = recording, frozenset[str](), dict[str, tuple[float, float]]()
    if "events" in chosen:
        most = tuning.MOST_LEFT_OUT * recording.n
        robust = frozenset(
            name for name in robust if sum(b - a for a, b in found.events(name)) > most
        )
        masked = found.masked(recording, but=robust)
        left_out = frozenset(names) - robust
        losses = _losses(recording, masked, found)
    fresh = (each for each in found.notices if each not in recording.notices)
    return Screened(
        masked,
        {name: offered_terms(found, name, chosen) for name in names},
        robust,
        {name: each for name in names if (each := found.repetition(name)) is not None},
        (
            *masked.notices,
            *(_treated(each, found, left_out, robust, losses.get(each.where)) for each in fresh),
        ),
    )


def _losses(
    recording: Recording, masked: Recording, found: Health
) -> dict[str, tuple[float, float]]:
    """Channel of many events -> averaging time (s) and factor by which most of the deviation goes.

    One shock is an accident; many of them may be how the sensor is noisy.
    """
    taken = {}
    for channel in recording.inertial:
        if len(found.events(channel.name)) < tuning.MANY_EVENTS:
            continue
        try:
            whole, left = (wavelet_variance(each[channel.name]) for each in (recording, masked))
        except InputError:  # too little is left, which the channel's own model says
            continue
        longest = channel.n * channel.dt / tuning.FEWEST_WINDOWS
        levels = np.flatnonzero((left.tau >= tuning.REFERENCE_TIME) & (left.tau <= longest))
        ratios = np.sqrt(whole.variance[levels] / left.variance[levels])
        if ratios.size and np.max(ratios) > tuning.TAKEN:
            at = int(np.argmax(ratios))
            taken[channel.name] = float(left.tau[levels[at]]), float(ratios[at])
    return taken


def _treated(
    found: Notice,
    health_of: Health,
    left_out: Collection[str],
    robust: Collection[str],
    loss: tuple[float, float] | None,
) -> Notice:
    """A notice with what is done about it here, which is not what is advised elsewhere.

    left_out: Channels of which shocks, spikes, outliers and held samples are left out.
    robust: Channels that have robust wavelet variances.
    loss: Averaging time (s) and factor of the deviation that leaving them out takes.
    """
    is_left_out = found.where in left_out
    if found.code == "held" and is_left_out and health_of.channels[found.where].held > 0.0:
        return replace(found, hint="left out", severity="warning")
    if found.code in ("event", "outliers"):
        values = {**found.values, "left_out": is_left_out}
        hint = "kept, as requested"
        if is_left_out:
            hint = "left out"
            if found.code == "event":
                hint += f", {found.values['samples']:,.0f} samples"
        elif found.where in robust:
            hint = "kept: robust wavelet variances limit their influence, with 1.3 times the errors"
        if loss is not None and found.code == "event":
            values["taken_at"], values["taken"] = loss
            if is_left_out:
                hint += (
                    f"; with them the deviation at {loss[0]:.3g} s is {loss[1]:.2g} times as "
                    "large: if they are the sensor's own noise, keep them"
                )
        return replace(found, hint=hint, values=values)
    if found.code == "rows-copied":
        done = "left out" if left_out else "kept, as requested"
        return replace(found, hint=f"{done}; {found.hint}")
    if found.code in ("dead", "infinite"):
        return replace(found, hint="the channel is skipped")
    return replace(found, hint=f"left as it is; {found.hint}") if found.issue.user_only else found


def offered_terms(found: Health, channel: str, chosen: Collection[str]) -> tuple[Process, ...]:
    """Terms for the lines and resonances of a channel, those worth most first."""
    terms: list[Process] = []
    if "lines" in chosen:
        terms += [Sinusoid(frequency=frequency) for frequency, _ in found.lines(channel)]
    if "resonances" in chosen:
        broad: list[Process] = [
            Resonance(frequency=frequency, damping=damping)
            for frequency, damping in found.resonances(channel)
        ]
        # A resonance costs more of the fit than the weaker lines do.
        terms = broad[:1] + terms + broad[1:]
    return tuple(terms[: tuning.MOST_TERMS])


def with_outcomes(
    notices: Sequence[Notice], models: Mapping[str, Model], offered: Mapping[str, Sequence[Process]]
) -> tuple[Notice, ...]:
    """Notices with what became of the lines and resonances among them.

    models: The model of each channel that has one.
    offered: Channel name -> terms that its model might have had.
    """
    return tuple(
        replace(notice, hint=_outcome(notice, models[notice.where], offered.get(notice.where, ())))
        if notice.code in ("line", "resonance") and notice.where in models
        else notice
        for notice in notices
    )


def _outcome(notice: Notice, model: Model, offered: Sequence[Process]) -> str:
    if _holds(model.terms, notice):
        is_line = notice.code == "line"
        return "modelled, but not in filter N and K" if is_line else "a term of the model"
    if _holds(offered, notice):
        return "tried as a term of the model, which does not need it"
    return "not tried as a term of the model"


def _holds(terms: Sequence[Process], notice: Notice) -> bool:
    """Whether one of the terms is the line or resonance that was found."""
    kind = Sinusoid if notice.code == "line" else Resonance
    found = notice.values["frequency"]
    frequencies = [term.values["frequency"] for term in terms if isinstance(term, kind)]
    return any(f is not None and abs(f / found - 1.0) < tuning.SAME_FREQUENCY for f in frequencies)
