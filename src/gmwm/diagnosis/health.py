"""Results of an examination: notices for people, numbers for programs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from annotated_types import Ge, Le

from gmwm._core.documents import Document, NotNegative, Positive, Rate, Samples, Text
from gmwm._core.frozen import freeze
from gmwm._core.spool import scaled
from gmwm._core.text import Printed, frame, html_table, wrapped
from gmwm.diagnosis import tuning
from gmwm.errors import InputError, MissingNameError
from gmwm.issues import SEVERITIES, Notice, Severity, notice
from gmwm.readers import Recording

if TYPE_CHECKING:
    import pandas

_INDENT = 11
_LOOK = "check the mounting and the power supply"

Index = Annotated[int, Ge(0)]
Share = Annotated[float, Ge(0.0), Le(1.0)]


@dataclass(frozen=True)
class Repetition:
    """How often each sample of a channel is written.

    first: Index of a first one, below ``times``.
    """

    times: Annotated[int, Ge(2)]
    first: Index

    def __post_init__(self) -> None:
        if self.first >= self.times:
            raise ValueError("first is not below times")


@dataclass(frozen=True)
class ChannelHealth:
    """Numbers of one channel, for programs.

    lines: Frequency (Hz) and amplitude (u) of each periodic line, strongest first.
    resonances: Undamped natural frequency (Hz) and damping ratio of each resonance, strongest
        first.
    events: First sample and the one after the last of each spike or shock.
    lsb: Step of the samples, u; 0 if none was found.
    outliers: Fraction of the samples that are outliers all over the record; 0 if they are no more
        than noise and some shocks explain.
    held: Share of samples that only repeat the one before, where nearly all that do are such; else
        0.
    noise: Usual standard deviation of what cannot be predicted of a sample, u; 0 if it is not
        known.
    repetition: If each sample is written several times; the other numbers are then those of the
        channel at its own rate, events those of the recording.
    """

    lines: tuple[tuple[Positive, NotNegative], ...] = ()
    resonances: tuple[tuple[Positive, Positive], ...] = ()
    events: tuple[tuple[Index, Index], ...] = ()
    lsb: NotNegative = 0.0
    outliers: Share = 0.0
    held: Share = 0.0
    noise: NotNegative = 0.0
    repetition: Repetition | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Health(Document, Printed):
    """Faults and features of a recording.

    Attributes
    ----------
    notices : tuple of Notice
        Those of the whole recording, then channel by channel, worst first. Beside those of the
        reader, their codes are "length", "not-static", "tilt", "vibration", "clock", "gap", "dead",
        "rows-copied", "infinite", "size", "stuck", "held", "saturation", "abrupt-end",
        "value-repeated", "repeated-samples", "interpolated", "filled", "event", "outliers",
        "heavy-tails", "rounding", "line", "resonance", "drift", "variance", "temperature",
        "crosstalk" and "clean".
    channels : dict
        Channel name -> `ChannelHealth`.
    source : str
    rate : float
        Hz.
    n : int
        Samples per channel.
    """

    SCHEMA: ClassVar[str] = "gmwm.health"
    KEYS: ClassVar[Mapping[str, str]] = {"rate": "rate_hz"}
    SCHEMA_VERSION: ClassVar[int] = 2

    notices: tuple[Notice, ...]
    channels: Mapping[str, ChannelHealth]
    source: Text
    rate: Rate
    n: Samples

    def __post_init__(self) -> None:
        freeze(self, "channels")

    @property
    def worst(self) -> Severity:
        """The worst severity there is."""
        found = {notice.severity for notice in self.notices}
        return next((severity for severity in SEVERITIES if severity in found), "good")

    def of(self, where: str = "", code: str = "") -> tuple[Notice, ...]:
        """Notices of one channel, with one code, or both."""
        return tuple(n for n in self.notices if where in ("", n.where) and code in ("", n.code))

    def lines(self, channel: str) -> tuple[tuple[float, float], ...]:
        """Frequency (Hz) and amplitude (u) of each periodic line, strongest first."""
        return self._channel(channel).lines

    def resonances(self, channel: str) -> tuple[tuple[float, float], ...]:
        """Natural frequency (Hz) and damping ratio of each resonance, strongest first."""
        return self._channel(channel).resonances

    def events(self, channel: str) -> tuple[tuple[int, int], ...]:
        """Sample intervals (start, stop) of spikes and shocks, wide enough to be left out."""
        return self._channel(channel).events

    def lsb(self, channel: str) -> float:
        """Step of the samples, u; 0 if none was found."""
        return self._channel(channel).lsb

    def repetition(self, channel: str) -> Repetition | None:
        """How often each sample is written; None if once."""
        return self._channel(channel).repetition

    def outliers(self, channel: str) -> float:
        """Share of outliers spread over the record, which ask for robust wavelet variances."""
        return self._channel(channel).outliers

    def masked(self, recording: Recording, but: Collection[str] = ()) -> Recording:
        """The recording with the samples of all events, and those that were held, missing.

        Parameters
        ----------
        recording : Recording
            That which was examined.
        but : collection of str, optional
            Channels that stay as they are.

        Returns
        -------
        Recording
            Its channels are NaN during their own events, and where they repeat the sample before
            if that shows a lost one; a notice counts the samples.

        Raises
        ------
        InputError
            If the recording has other channels or another length.
        """
        names = tuple(channel.name for channel in recording.inertial)
        if names != tuple(self.channels) or recording.n != self.n:
            raise InputError(
                f"{recording.source or 'the recording'} is not the one that was examined "
                f"({self.source or 'without a name'}): give that recording, or examine this one"
            )
        channels, notices = [], list(recording.notices)
        for name, channel in recording.items():
            events = () if channel.is_auxiliary else self.events(name)
            held = not channel.is_auxiliary and self._channel(name).held > 0.0
            if (events or held) and name not in but:
                values = scaled(channel.values, 1.0)
                if held:
                    values[1:][np.diff(values) == 0.0] = np.nan
                for start, stop in events:
                    values[start:stop] = np.nan
                gone = int(np.count_nonzero(np.isnan(values))) - channel.missing
                copies = "copies, " if self.of(code="rows-copied") else ""
                notices.append(notice("events-left-out", name, {"samples": gone}, copies=copies))
                channel = replace(channel, values=values)
            channels.append(channel)
        return replace(recording, channels=tuple(channels), notices=tuple(notices))

    def _channel(self, name: str) -> ChannelHealth:
        if name not in self.channels:
            known = ", ".join(self.channels)
            raise MissingNameError(f"no channel {name!r} was examined: there are {known}")
        return self.channels[name]

    def __repr__(self) -> str:
        counts = [
            f"{count} {severity}"
            for severity in SEVERITIES
            if (count := sum(notice.severity == severity for notice in self.notices))
        ]
        return f"<Health of {self.source or 'a recording'}: {', '.join(counts)}>"

    def _repr_html_(self) -> str:
        rows = [(n.where or "all", n.severity, n.text, n.hint) for n in gathered(self.notices)]
        heads = ("channel", "", "finding", "what to do")
        return html_table(str(self).partition("\n")[0], heads, rows)

    def __str__(self) -> str:
        rows = [f"{self.source or 'recording'}: {self.rate:g} Hz, {self.n:,} samples a channel"]
        notices = gathered(self.notices)
        for where in dict.fromkeys(("", *self.channels, *(n.where for n in notices))):
            found = [notice for notice in notices if notice.where == where]
            if found:
                rows += ["", where or "whole recording"]
            for each in found:
                text = each.text + (f"; {each.hint}" if each.hint else "")
                rows += wrapped(text, first=f"  {each.severity:{_INDENT - 2}}", indent=_INDENT)
        return "\n".join(rows)

    def to_frame(self) -> pandas.DataFrame:
        """A table of the notices, one a row; needs pandas."""
        columns = ("where", "code", "severity", "text", "hint", "values")
        return frame((notice.to_dict() for notice in self.notices), columns)

    def derived(self) -> dict[str, Any]:
        return {"worst": self.worst}

    def check_content(self) -> None:
        for name, channel in self.channels.items():
            if any(not 0 <= start < stop <= self.n for start, stop in channel.events):
                raise ValueError(f"an event of {name} is not an interval of samples")


def gathered(notices: Iterable[Notice]) -> list[Notice]:
    """Lines and resonances that several sensors see, reported once: where they show best."""
    groups: list[list[Notice]] = []
    for each in notices:
        group = next((group for group in groups if _is_shared(group, each)), None)
        if group is None:
            groups.append([each])
        else:
            group.append(each)
    found = []
    for group in groups:
        best = group[0]
        if len(group) > 1:
            best = max(group, key=lambda each: each.values["ratio"])
            where = ", ".join(each.where for each in group)
            hints = "; ".join([*dict.fromkeys(each.hint for each in group if each.hint), _LOOK])
            text = f"{best.text} (in {best.where}); {len(group)} channels have it"
            best = replace(best, where=where, text=text, hint=hints)
        found.append(best)
    return found


def _is_shared(group: list[Notice], other: Notice) -> bool:
    first = group[0]
    if other.code not in ("line", "resonance") or "count" in {**first.values, **other.values}:
        return False
    if (first.code, first.severity, first.source) != (other.code, other.severity, other.source):
        return False
    if other.where in (each.where for each in group):
        return False
    within = tuning.SHARED_FREQUENCY * first.values["frequency"]
    return bool(abs(other.values["frequency"] - first.values["frequency"]) < within)
