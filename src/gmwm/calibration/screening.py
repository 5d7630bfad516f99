"""What is done with a recording before a model is fitted to it: stretches at rest, issues."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from gmwm._core.notices import Notice
from gmwm.calibration import tuning
from gmwm.diagnosis import Health, Repetition, health, rest_of
from gmwm.errors import InputError
from gmwm.process import Model, Process, Resonance, Sinusoid
from gmwm.readers import Recording
from gmwm.variance import wavelet_variance

SCREENING = ("events", "lines", "resonances", "outliers")
"""Samples of shocks, spikes and lost packets are masked; lines and resonances are terms that a
model may have; the wavelet variances of channels with more outliers than can be left out are
robust."""

# Codes of advice that only the user can follow.
_ADVICE = (
    "stuck",
    "held",
    "filled",
    "saturation",
    "abrupt-end",
    "temperature",
    "variance",
)


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
            "record at rest, or give still=False to take everything as static",
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
    whole = [notice for notice in recording.notices if notice.code != "missing-samples"]
    first = replace(named[0], notices=(*whole, found.notice(), *named[0].notices))
    return (first, *named[1:])


def check_screening(chosen: Collection[str]) -> None:
    """Raise InputError if one of those chosen is unknown."""
    for name in chosen:
        if name not in SCREENING:
            known = ", ".join(SCREENING)
            raise InputError(f"screening for {name!r} is unknown: there are {known}")


def screened(recording: Recording, chosen: Collection[str] = SCREENING) -> Screened:
    """Examine a recording and mask, offer terms or make variances robust as it needs.

    Outliers all over the record are left out like shocks. Where that would take more than a tenth
    of the samples, or they are not to be left out, the wavelet variances are robust instead.

    chosen: Some of `SCREENING`.
    Raises InputError if one of those chosen is unknown.
    """
    check_screening(chosen)
    if not chosen:
        return Screened(recording, {}, notices=recording.notices)
    found = health(recording)
    names = tuple(channel.name for channel in recording.inertial)
    robust = frozenset(
        name for name in names if "outliers" in chosen and found.outliers(name) > 0.0
    )
    masked = recording
    if "events" in chosen:
        robust = frozenset(name for name in robust if _is_much(found.events(name), recording.n))
        masked = found.masked(recording, but=robust)
    left_out = frozenset(names) - robust if "events" in chosen else frozenset()
    taken = _taken(recording, masked, found) if "events" in chosen else {}
    fresh = [notice for notice in found.notices if notice not in recording.notices]
    return Screened(
        masked,
        {name: terms_of(found, name, chosen) for name in names},
        robust,
        {name: each for name in names if (each := found.repetition(name)) is not None},
        (*masked.notices, *with_treatment(fresh, found, left_out, robust, taken)),
    )


def _taken(
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


def with_treatment(
    notices: Iterable[Notice],
    found: Health,
    left_out: Collection[str],
    robust: Collection[str] = (),
    taken: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> list[Notice]:
    """Notices with what is done about each here, which is not what is advised elsewhere.

    left_out: Channels of which shocks, spikes, outliers and held samples are left out.
    robust: Channels that have robust wavelet variances.
    taken: Channels of which that takes much of the deviation; averaging time (s) and factor.
    """
    treated = []
    for notice in notices:
        is_mended = (
            notice.code == "held"
            and notice.where in left_out
            and found.channels[notice.where].held > 0.0
        )
        treated.append(
            replace(
                notice,
                hint="left out" if is_mended else _done(notice, robust, left_out, taken),
                values=_values(notice, left_out, taken),
                severity="warning" if is_mended else notice.severity,
            )
        )
    return treated


def _is_much(events: Sequence[tuple[int, int]], n: int) -> bool:
    """Whether events take so many samples that gaps in their place would do harm."""
    return sum(stop - start for start, stop in events) > tuning.MOST_LEFT_OUT * n


def _values(
    notice: Notice, left_out: Collection[str], taken: Mapping[str, tuple[float, float]]
) -> Mapping[str, Any]:
    if notice.code not in ("event", "outliers"):
        return notice.values
    found: dict[str, Any] = {**notice.values, "left_out": notice.where in left_out}
    if notice.code == "event" and notice.where in taken:
        found["taken_at"], found["taken"] = taken[notice.where]
    return found


def _done(
    notice: Notice,
    robust: Collection[str],
    left_out: Collection[str],
    taken: Mapping[str, tuple[float, float]],
) -> str:
    if notice.code in ("event", "outliers"):
        samples = f", {notice.values['samples']:,.0f} samples" if notice.code == "event" else ""
        if notice.where in left_out:
            if notice.code == "event" and notice.where in taken:
                tau, factor = taken[notice.where]
                samples += (
                    f"; with them the deviation at {tau:.3g} s is {factor:.2g} times as large: if "
                    "they are the sensor's own noise, leave them in"
                )
            return f"left out{samples}"
        if notice.where in robust:
            return "kept: robust wavelet variances bound their influence, at 1.3 times the errors"
        return "kept, as requested"
    if notice.code == "rows-copied":
        return f"left out; {notice.hint}" if left_out else f"kept, as requested; {notice.hint}"
    if notice.code in ("dead", "infinite") and "stretches" not in notice.values:
        return "the channel is skipped"
    if notice.code in _ADVICE:
        return f"left as it is; {notice.hint}"
    return notice.hint


def terms_of(found: Health, channel: str, chosen: Collection[str]) -> tuple[Process, ...]:
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
    notices: Sequence[Notice],
    models: Mapping[str, Model],
    offered: Mapping[str, Sequence[Process]],
) -> tuple[Notice, ...]:
    """Notices with what became of the lines and resonances among them.

    models: The model of each channel that has one.
    offered: Channel name -> terms that its model might have had.
    """
    return tuple(
        replace(
            notice,
            hint=_outcome(notice, models[notice.where], offered.get(notice.where, ())),
        )
        if notice.code in ("line", "resonance") and notice.where in models
        else notice
        for notice in notices
    )


def _outcome(notice: Notice, model: Model, offered: Sequence[Process]) -> str:
    if _holds(model.terms, notice):
        left = ", which N and K of a filter leave out" if notice.code == "line" else ""
        return f"a term of the model{left}"
    if _holds(offered, notice):
        return "tried as a term of the model, which does not need it"
    return "not tried as a term of the model"


def _holds(terms: Sequence[Process], notice: Notice) -> bool:
    """Whether one of the terms is the line or resonance that was found."""
    kind = Sinusoid if notice.code == "line" else Resonance
    found = notice.values["frequency"]
    frequencies = [term.values["frequency"] for term in terms if isinstance(term, kind)]
    return any(f is not None and abs(f / found - 1.0) < tuning.SAME_FREQUENCY for f in frequencies)
