"""What was found in a recording: notices for people, and numbers for programs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from gmwm._core.documents import Document
from gmwm._core.frames import frame
from gmwm._core.frozen import freeze
from gmwm._core.notices import SEVERITIES, Notice, Severity
from gmwm._core.spool import scaled
from gmwm._core.text import Printed, wrapped
from gmwm.diagnosis.gathered import gathered
from gmwm.errors import InputError, MissingNameError
from gmwm.readers import Recording

if TYPE_CHECKING:
    import pandas

    from gmwm._core.forms import Form

_INDENT = 11


@dataclass(frozen=True)
class Repetition:
    """How often each sample of a channel is written.

    first: Index of a first one, below ``times``.
    """

    times: int
    first: int


@dataclass(frozen=True)
class ChannelHealth:
    """What a program wants to know of one channel.

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

    lines: tuple[tuple[float, float], ...] = ()
    resonances: tuple[tuple[float, float], ...] = ()
    events: tuple[tuple[int, int], ...] = ()
    lsb: float = 0.0
    outliers: float = 0.0
    held: float = 0.0
    noise: float = 0.0
    repetition: Repetition | None = None

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> ChannelHealth:
        """Inverse of `dataclasses.asdict`, after a round trip through JSON and its form."""
        known = {each.name: content[each.name] for each in fields(cls)}
        known |= {name: tuple(known[name]) for name in ("lines", "resonances", "events")}
        repeated = known.pop("repetition")
        return cls(
            **known, repetition=repeated and Repetition(repeated["times"], repeated["first"])
        )


@dataclass(frozen=True, eq=False, repr=False)
class Health(Document, Printed):
    """What was found in a recording.

    Attributes
    ----------
    notices : tuple of Notice
        Those of the whole recording, then channel by channel, worst first. Beside those of the
        reader, their codes are "length", "not-static", "tilt", "vibration", "clock", "gap", "dead",
        "rows-copied", "infinite", "size", "stuck", "held", "saturation", "abrupt-end",
        "value-repeated",
        "repeated-samples", "interpolated", "filled", "event",
        "outliers", "heavy-tails", "rounding", "line", "resonance",
        "drift", "variance", "temperature", "crosstalk" and "clean".
    channels : dict
        Channel name -> `ChannelHealth`.
    source : str
    rate : float
        Hz.
    n : int
        Samples per channel.
    """

    SCHEMA: ClassVar[str] = "gmwm.health"
    SCHEMA_VERSION: ClassVar[int] = 2

    notices: tuple[Notice, ...]
    channels: Mapping[str, ChannelHealth]
    source: str
    rate: float
    n: int

    def __post_init__(self) -> None:
        freeze(self, "channels")

    @property
    def worst(self) -> Severity:
        """The worst severity there is."""
        found = {notice.severity for notice in self.notices}
        return next((severity for severity in SEVERITIES if severity in found), "good")

    def of(self, where: str = "", code: str = "") -> tuple[Notice, ...]:
        """Notices of one channel, with one code, or both."""
        return tuple(
            notice
            for notice in self.notices
            if where in ("", notice.where) and code in ("", notice.code)
        )

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
                f"({self.source or 'without a name'}): give that, or examine this one"
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
                text = f"{gone:,} samples of {copies}spikes, shocks or lost packets left out"
                notices.append(Notice("events-left-out", "note", name, text, {"samples": gone}))
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

    def __str__(self) -> str:
        rows = [f"{self.source or 'recording'}: {self.rate:g} Hz, {self.n:,} samples a channel"]
        notices = gathered(self.notices)
        for where in dict.fromkeys(("", *self.channels, *(n.where for n in notices))):
            found = [notice for notice in notices if notice.where == where]
            if found:
                rows += ["", where or "whole recording"]
            for notice in found:
                rows += _wrapped(notice)
        return "\n".join(rows)

    def to_frame(self) -> pandas.DataFrame:
        """A table of the notices, one a row; needs pandas."""
        columns = ("where", "code", "severity", "text", "hint", "values")
        return frame((notice.to_dict() for notice in self.notices), columns)

    def content(self) -> dict[str, Any]:
        return {
            "source": self.source,
            "rate_hz": self.rate,
            "n": self.n,
            "worst": self.worst,
            "notices": [notice.to_dict() for notice in self.notices],
            "channels": {name: asdict(channel) for name, channel in self.channels.items()},
        }

    @classmethod
    def document_form(cls) -> type[Form]:
        from gmwm.diagnosis.form import HealthForm

        return HealthForm

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        return cls(
            notices=tuple(map(Notice.from_dict, content["notices"])),
            channels={
                name: ChannelHealth.from_content(item) for name, item in content["channels"].items()
            },
            source=content["source"],
            rate=content["rate_hz"],
            n=content["n"],
        )


def _wrapped(notice: Notice) -> list[str]:
    """Severity in front, text and hint beside it."""
    text = notice.text + (f"; {notice.hint}" if notice.hint else "")
    return wrapped(text, first=f"  {notice.severity:{_INDENT - 2}}", indent=_INDENT)
