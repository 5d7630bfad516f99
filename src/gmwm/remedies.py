"""What is done about what was found in a recording, before a model is fitted to it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from gmwm.diagnosis import Finding, Health, health
from gmwm.errors import InputError
from gmwm.process import Process, Resonance, Sinusoid
from gmwm.recording import Recording

REMEDIES = ("events", "lines", "resonances")
"""Samples of knocks and spikes are masked; lines and resonances are terms that a model may have."""

_MOST_TERMS = 2  # a channel; each doubles the number of candidate models
_TOLD = ("warning", "bad")
_KNOWN_BEFORE = (
    "reader",
    "gap",
    "dead",
    "infinite",
    "length",
)  # the calibration tells these itself


@dataclass(frozen=True)
class Remedied:
    """A recording after the remedies.

    Attributes
    ----------
    recording : Recording
        Without the samples of knocks and spikes, with a note on each finding.
    extra : dict
        Channel name -> terms that its model may have, strongest first.
    """

    recording: Recording
    extra: dict[str, tuple[Process, ...]]


def remedied(recording: Recording, chosen: Collection[str] = REMEDIES) -> Remedied:
    """Examine a recording and do something about what is found.

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
    result = found.masked(recording) if "events" in chosen else recording
    notes = tuple(
        _told(finding, chosen)
        for finding in found.findings
        if finding.severity in _TOLD and finding.kind not in _KNOWN_BEFORE
    )
    told = replace(
        result, notes=(*result.notes, *(note for note in notes if note not in result.notes))
    )
    return Remedied(told, {c.name: _terms(found, c.name, chosen) for c in recording})


def _told(finding: Finding, chosen: Collection[str]) -> str:
    """What was found and what is done about it here, which is not what is advised elsewhere."""
    done = {
        "event": "left out" if "events" in chosen else "",
        "line": "the strongest are terms that the model may have" if "lines" in chosen else "",
    }.get(finding.kind, finding.action)
    return f"{finding.channel or 'recording'}: {finding.sentence}" + (f" ({done})" if done else "")


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
