"""What was found in a recording: findings for people, and numbers for programs."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from gmwm.errors import InputError
from gmwm.readers import Recording

Severity = Literal["good", "note", "warning", "bad"]

SEVERITIES: tuple[Severity, ...] = ("bad", "warning", "note", "good")
"""Worst first."""

_WIDTH = 80
_INDENT = 11

SCHEMA = "gmwm.health"
SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Finding:
    """One thing that was found.

    Attributes
    ----------
    channel : str
        Name of the channel; empty if it concerns the whole recording.
    kind : str
        "length", "reader", "clock", "gap", "dead", "infinite", "stuck", "saturation", "event",
        "outliers", "rounding", "line", "resonance", "drift", "variance", "temperature",
        "crosstalk" or "clean"; of a calibration also "choice", on its model.
    severity : {"good", "note", "warning", "bad"}
        "note": nothing is to be done; "warning": estimates may be off; "bad": the channel should
        not be used as it is.
    sentence : str
        What was found, with numbers and units, without the channel's name.
    action : str
        What is done about it, or should be.
    values : dict
        The numbers, in SI units.
    recording : str
        Its source, where there are several recordings.
    """

    channel: str
    kind: str
    severity: Severity
    sentence: str
    action: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    recording: str = ""

    def __str__(self) -> str:
        place = "".join(f"{part}: " for part in (self.recording, self.channel) if part)
        return f"{place}{self.sentence}" + (f" ({self.action})" if self.action else "")

    def to_dict(self) -> dict[str, Any]:
        """In JSON types."""
        return {
            "channel": self.channel,
            "kind": self.kind,
            "severity": self.severity,
            "sentence": self.sentence,
            "action": self.action,
            "values": {k: v if np.isfinite(v) else None for k, v in self.values.items()},
            **({"recording": self.recording} if self.recording else {}),
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Finding:
        """Inverse of `to_dict`.

        Raises
        ------
        KeyError, TypeError, ValueError
            If the content is no finding.
        """
        if content["severity"] not in SEVERITIES:
            raise ValueError(f"severity = {content['severity']!r}")
        texts = {name: str(content[name]) for name in ("channel", "kind", "sentence", "action")}
        values = {k: float("nan") if v is None else float(v) for k, v in content["values"].items()}
        return cls(
            **texts,
            severity=content["severity"],
            values=values,
            recording=str(content.get("recording", "")),
        )


@dataclass(frozen=True)
class ChannelHealth:
    """What a program wants to know of one channel.

    Attributes
    ----------
    lines : tuple of (float, float)
        Frequency (Hz) and amplitude (u) of each periodic line, strongest first.
    resonances : tuple of (float, float)
        Undamped natural frequency (Hz) and damping ratio of each resonance, strongest first.
    events : tuple of (int, int)
        First sample and the one after the last of each spike or knock.
    lsb : float
        Step of the samples, u; 0 if none was found.
    outliers : float
        Share of the samples that are outliers spread over the record; 0 if they are no more than
        noise and some knocks explain.
    """

    lines: tuple[tuple[float, float], ...] = ()
    resonances: tuple[tuple[float, float], ...] = ()
    events: tuple[tuple[int, int], ...] = ()
    lsb: float = 0.0
    outliers: float = 0.0


@dataclass(frozen=True)
class Health:
    """What was found in a recording.

    Attributes
    ----------
    findings : tuple of Finding
        Those of the whole recording, then channel by channel, worst first.
    channels : dict
        Channel name -> `ChannelHealth`.
    source : str
    rate : float
        Hz.
    n : int
        Samples per channel.
    """

    findings: tuple[Finding, ...]
    channels: dict[str, ChannelHealth]
    source: str
    rate: float
    n: int

    @property
    def worst(self) -> Severity:
        """The worst severity there is."""
        found = {finding.severity for finding in self.findings}
        return next((severity for severity in SEVERITIES if severity in found), "good")

    def of(self, channel: str = "", kind: str = "") -> tuple[Finding, ...]:
        """Findings of one channel, of one kind, or both."""
        return tuple(
            finding
            for finding in self.findings
            if channel in ("", finding.channel) and kind in ("", finding.kind)
        )

    def lines(self, channel: str) -> tuple[tuple[float, float], ...]:
        """Frequency (Hz) and amplitude (u) of each periodic line, strongest first."""
        return self._channel(channel).lines

    def resonances(self, channel: str) -> tuple[tuple[float, float], ...]:
        """Natural frequency (Hz) and damping ratio of each resonance, strongest first."""
        return self._channel(channel).resonances

    def events(self, channel: str) -> tuple[tuple[int, int], ...]:
        """Sample intervals (start, stop) of spikes and knocks, wide enough to be left out."""
        return self._channel(channel).events

    def lsb(self, channel: str) -> float:
        """Step of the samples, u; 0 if none was found."""
        return self._channel(channel).lsb

    def outliers(self, channel: str) -> float:
        """Share of outliers spread over the record, which ask for robust wavelet variances."""
        return self._channel(channel).outliers

    def masked(self, recording: Recording, but: Collection[str] = ()) -> Recording:
        """The recording with the samples of all events missing.

        Parameters
        ----------
        recording : Recording
            That which was examined.
        but : collection of str, optional
            Channels that stay as they are.

        Returns
        -------
        Recording
            Its channels are NaN during their own events; a note tells how many samples that cost.

        Raises
        ------
        InputError
            If the recording has other channels or another length.
        """
        if recording.names != tuple(self.channels) or recording.n != self.n:
            raise InputError(
                f"{recording.source or 'the recording'} is not the one that was examined "
                f"({self.source or 'without a name'}): give that, or examine this one"
            )
        channels, notes = [], []
        for channel in recording:
            events = self.events(channel.name)
            if events and channel.name not in but:
                values = np.array(channel.values, dtype=float)
                for start, stop in events:
                    values[start:stop] = np.nan
                gone = int(np.count_nonzero(np.isnan(values))) - channel.missing
                notes.append(f"{channel.name}: {gone:,} samples of spikes or knocks left out.")
                channel = replace(channel, values=values)
            channels.append(channel)
        return replace(recording, channels=tuple(channels), notes=(*recording.notes, *notes))

    def _channel(self, name: str) -> ChannelHealth:
        if name not in self.channels:
            known = ", ".join(self.channels)
            raise InputError(f"no channel {name!r} was examined: there are {known}")
        return self.channels[name]

    def __str__(self) -> str:
        rows = [f"{self.source or 'recording'}: {self.rate:g} Hz, {self.n:,} samples a channel"]
        for name in ("", *self.channels):
            found = [finding for finding in self.findings if finding.channel == name]
            if found:
                rows += ["", name or "whole recording"]
            for finding in found:
                rows += _wrapped(finding)
        return "\n".join(rows)

    def to_dict(self) -> dict[str, Any]:
        """Everything, in JSON types."""
        return {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "source": self.source,
            "rate_hz": self.rate,
            "n": self.n,
            "worst": self.worst,
            "findings": [finding.to_dict() for finding in self.findings],
            "channels": {
                name: {
                    "lines": [list(line) for line in channel.lines],
                    "resonances": [list(resonance) for resonance in channel.resonances],
                    "events": [list(event) for event in channel.events],
                    "lsb": channel.lsb,
                    "outliers": channel.outliers,
                }
                for name, channel in self.channels.items()
            },
        }


def worst_first(findings: list[Finding]) -> list[Finding]:
    """Sort by severity; equal ones stay in their order."""
    return sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity))


def _wrapped(finding: Finding) -> list[str]:
    """Severity in front, sentence and action beside it."""
    text = finding.sentence + (f"; {finding.action}" if finding.action else "")
    return textwrap.wrap(
        text,
        width=_WIDTH,
        initial_indent=f"  {finding.severity:{_INDENT - 2}}",
        subsequent_indent=" " * _INDENT,
        break_long_words=False,
        break_on_hyphens=False,
    )
