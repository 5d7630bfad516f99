"""What is done about what was found in a recording, before a model is fitted to it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.diagnosis import Finding, Health, health
from gmwm.errors import InputError
from gmwm.process import Model, Process, Resonance, Sinusoid
from gmwm.readers import Channel, Recording

REMEDIES = ("events", "lines", "resonances", "outliers")
"""Samples of knocks and spikes are masked; lines and resonances are terms that a model may have;
the wavelet variances of channels with outliers all over the record are robust."""

_TORN = 32  # times the longest run that masks leave
_MOST_TERMS = 2  # a channel; each doubles the number of candidate models
_SAME_FREQUENCY = 0.02  # of a line in several recordings of one sensor
_ADVICE = ("stuck", "saturation", "temperature", "variance")  # that only the user can follow


@dataclass(frozen=True)
class Remedied:
    """A recording after the remedies.

    Attributes
    ----------
    recording : Recording
        Without the samples of knocks and spikes, with a note on how many these were.
    extra : dict
        Channel name -> terms that its model may have, strongest first.
    robust : frozenset of str
        Channels whose wavelet variances are to be robust.
    findings : tuple of Finding
        What was found, with what is done about it here as ``action``.
    """

    recording: Recording
    extra: dict[str, tuple[Process, ...]]
    robust: frozenset[str] = field(default=frozenset())
    findings: tuple[Finding, ...] = ()


def remedied(recording: Recording, chosen: Collection[str] = REMEDIES) -> Remedied:
    """Examine a recording and do something about what is found.

    Nothing is masked in a channel with so many outliers all over the record that masks would leave
    no run of 1/32 of it, and with that none of its long averaging times.

    Parameters
    ----------
    recording : Recording
    chosen : collection of str, optional
        Some of `REMEDIES`.

    Raises
    ------
    InputError
        If a remedy is unknown.
    """
    for remedy in chosen:
        if remedy not in REMEDIES:
            raise InputError(f"remedy {remedy!r} is unknown: there are {', '.join(REMEDIES)}")
    if not chosen:
        return Remedied(recording, {})
    found = health(recording)
    robust = frozenset(
        name for name in recording.names if "outliers" in chosen and found.outliers(name) > 0.0
    )
    masked, kept = recording, frozenset(recording.names)
    if "events" in chosen:
        masked = found.masked(recording)
        kept = frozenset(name for name in robust if _is_torn(recording[name], masked[name]))
        masked = found.masked(recording, but=kept) if kept else masked
    done = [_done(each, each.channel in robust, each.channel in kept) for each in found.findings]
    return Remedied(
        masked,
        {channel.name: _terms(found, channel.name, chosen) for channel in recording},
        robust,
        tuple(
            replace(finding, action=action)
            for finding, action in zip(found.findings, done, strict=True)
        ),
    )


def _is_torn(whole: Channel, masked: Channel) -> bool:
    """Whether masks leave no run that is long beside the longest there was."""
    return _longest_run(masked.values) * _TORN < _longest_run(whole.values)


def _longest_run(values: FloatArray) -> int:
    """Number of samples in the longest run without a missing one."""
    gaps = np.flatnonzero(np.isnan(np.concatenate([[np.nan], values, [np.nan]])))
    return int(np.max(np.diff(gaps))) - 1


def _done(finding: Finding, is_robust: bool, is_kept: bool) -> str:
    """What is done about a finding here, which is not what is advised elsewhere."""
    if finding.kind == "event":
        if is_robust and is_kept:
            return "kept: the robust wavelet variances bound their influence"
        samples = f"{finding.values['samples']:,.0f} samples"
        return "kept, as was asked" if is_kept else f"left out, {samples}"
    if finding.kind == "outliers":
        done = "robust wavelet variances bound their influence; standard errors are 1.3 times as"
        return f"{done} large" if is_robust else "counted in full, as was asked"
    if finding.kind in ("dead", "infinite"):
        return "the channel is skipped"
    if finding.kind in _ADVICE:
        return f"left as it is; {finding.action}"
    return finding.action


def _terms(found: Health, channel: str, chosen: Collection[str]) -> tuple[Process, ...]:
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
    return tuple(terms[:_MOST_TERMS])


def told_of_terms(
    findings: Sequence[Finding],
    models: Mapping[str, Model],
    offered: Mapping[str, Sequence[Process]],
) -> tuple[Finding, ...]:
    """Findings with what became of the lines and resonances among them.

    Parameters
    ----------
    findings : sequence of Finding
    models : mapping of str to Model
        The model of each channel that has one.
    offered : mapping of str to sequence of Process
        Channel name -> terms that its model might have had.
    """
    return tuple(
        replace(
            finding,
            action=_became(finding, models[finding.channel], offered.get(finding.channel, ())),
        )
        if finding.kind in ("line", "resonance") and finding.channel in models
        else finding
        for finding in findings
    )


def _became(finding: Finding, model: Model, offered: Sequence[Process]) -> str:
    if _holds(model.terms, finding):
        return "a term of the model"
    if _holds(offered, finding):
        return "tried as a term of the model, which does not need it"
    return "not tried as a term of the model"


def _holds(terms: Sequence[Process], finding: Finding) -> bool:
    """Whether one of the terms is the line or resonance that was found."""
    kind = Sinusoid if finding.kind == "line" else Resonance
    found = finding.values["frequency"]
    frequencies = [term.values["frequency"] for term in terms if isinstance(term, kind)]
    return any(f is not None and abs(f / found - 1.0) < _SAME_FREQUENCY for f in frequencies)
