"""A static recording: named channels, of equal rate or each at its own; missing samples."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from gmwm._core import checks
from gmwm._core.spool import scaled
from gmwm._core.text import Printed
from gmwm._core.typing import FloatArray
from gmwm._core.units import AUXILIARY, Unit, auxiliary_unit, sensor_unit
from gmwm.errors import InputError, MissingNameError, printable
from gmwm.issues import Notice, codes, notice
from gmwm.readers import tuning


@dataclass(frozen=True)
class Missing:
    """How many samples of a series are missing."""

    n: int = 0  # samples, missing ones included
    samples: int = 0  # missing samples
    # gaps, longest: runs of missing samples, and the length of the longest.
    gaps: int = 0
    longest: int = 0

    @classmethod
    def of(cls, values: FloatArray) -> Self:
        """Count NaN."""
        gone = np.isnan(values)
        edges = np.flatnonzero(np.diff(gone, prepend=False, append=False))
        lengths = edges[1::2] - edges[::2]
        longest = int(np.max(lengths, initial=0))
        return cls(gone.size, int(np.sum(lengths)), lengths.size, longest)


_SAMPLE = 0.5  # by which two clocks may part over a recording and count as one

READING = codes(topic="reading") | codes(topic="clock")
"""Codes of the notices about how a file was read."""

Series = tuple[str, FloatArray, Unit]
"""Name, samples (n,) in the unit as kept, and the unit of a channel."""


@dataclass(frozen=True, eq=False)
class Channel:
    """One axis of one sensor.

    Attributes
    ----------
    name : str
        E.g. ``"gyro_x"``.
    values : (n,) ndarray
        Samples in the SI unit of the quantity, mean not removed; NaN where one is missing.
    dt : float
        Sampling interval, s.
    quantity : {"gyro", "accel", "temperature", "voltage", "vibration", "clock", None}
        Angular rate (rad/s), specific force (m/s^2), an auxiliary quantity (degC, V, s) or, if
        ``None``, something else in its own unit.
    unit : str
        The unit of ``values``; empty if it is not known.
    """

    name: str
    values: FloatArray
    dt: float
    quantity: str | None = None
    unit: str = ""

    def __post_init__(self) -> None:
        for name in ("name", "unit"):
            object.__setattr__(self, name, printable(getattr(self, name)))

    @property
    def is_auxiliary(self) -> bool:
        """Whether it is kept for what it explains, and no error model is fitted to it."""
        return self.quantity in AUXILIARY

    @property
    def n(self) -> int:
        """Number of samples, those that are missing included."""
        return int(self.values.size)

    @property
    def missing(self) -> int:
        """Number of samples that are missing."""
        return int(np.count_nonzero(np.isnan(self.values)))

    @property
    def is_complete(self) -> bool:
        """Whether no sample is missing."""
        return self.missing == 0

    @property
    def mean(self) -> float:
        """Mean of the samples that are there; NaN if none is."""
        present = self.n - self.missing
        return float(np.nansum(self.values)) / present if present else np.nan

    @property
    def spread(self) -> float:
        """Largest less smallest of the samples that are there, u; zero if none is."""
        values = np.asarray(checks.unmasked(self.values), dtype=float)
        lowest = np.fmin.reduce(values, initial=np.inf)  # passes over NaN
        return max(float(np.fmax.reduce(values, initial=-np.inf) - lowest), 0.0)

    @property
    def is_constant(self) -> bool:
        """Whether every sample that is there has the same value: a dead channel."""
        return self.spread == 0.0

    @property
    def is_of_a_sensor(self) -> bool:
        """Whether it varies by as much as the noise of a sensor may, by many decades."""
        return tuning.LEAST_SPREAD < self.spread < tuning.LARGEST_SPREAD

    def __str__(self) -> str:
        missing = self.missing
        size = f"{self.name}: {self.n:,} samples, {self.n * self.dt:.6g} s"
        if missing == self.n:
            return f"{size}, all missing"
        gone = f", {missing:,} missing" if missing else ""
        return f"{size}, mean {self.mean:.6g} {self.unit}{gone}"


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Mapping[str, Channel], Printed):
    """Channels that begin and end together: a mapping of their names to `Channel`.

    Most often they have one sampling rate; in a log of sensors with clocks of their own each has
    that of its ``dt``, and `rate`, `dt` and `n` are those of the fastest.

    Attributes
    ----------
    channels : tuple of Channel
    source : str
        Where it came from, for messages and reports.
    notices : tuple of Notice
        What the reader noticed; see `READING`.
    jitter : float or None
        Standard deviation of the steps of its time stamps, as a share of the sampling interval;
        None if it has none.
    start : float
        Time stamp of its first sample, s; 0 if it has none.
    """

    channels: tuple[Channel, ...]
    source: str = ""
    notices: tuple[Notice, ...] = ()
    jitter: float | None = None
    start: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "source", printable(self.source))

    @classmethod
    def from_arrays(
        cls,
        arrays: Mapping[str, FloatArray] | Iterable[tuple[str, FloatArray]],
        rate: float,
        units: Mapping[str, str],
        source: str = "",
        notices: Sequence[Notice] = (),
    ) -> Self:
        """Build a recording from arrays in any unit.

        Parameters
        ----------
        arrays : mapping, or iterable of pairs
            Channel name -> samples (n,), NaN where one is missing. Pairs that are made one by one
            save memory.
        rate : float
            Sampling rate, Hz.
        units : mapping
            Channel name, or "gyro" and "accel", -> unit: ``{"gyro": "deg/s"}``. A channel in degC,
            K, V, mV or s is auxiliary.
        source : str, optional
            Name of the recording.
        notices : sequence of Notice, optional
            Added to those about missing samples.

        Raises
        ------
        InputError
            If the rate is not positive, a unit is missing or unknown, or the channels are not
            series of numbers of one length, none infinite.
        """

        def converted() -> Iterator[Series]:
            for name, values in arrays.items() if isinstance(arrays, Mapping) else arrays:
                text = units.get(name) or units.get(name.partition("_")[0])
                if text is None:
                    raise InputError(f"channel {name!r} has no unit: give one, e.g. deg/s or g")
                series = _series(name, values)
                unit = auxiliary_unit(text) or sensor_unit(text)
                yield name, scaled(series, unit.scale, unit.offset), unit

        return cls.of_series(converted(), rate, source, notices)

    @classmethod
    def of_series(
        cls, series: Iterable[Series], rate: float, source: str, notices: Sequence[Notice]
    ) -> Self:
        """Build a recording from series whose units are known; see `from_arrays`."""
        if not tuning.SLOWEST_RATE <= rate <= tuning.FASTEST_RATE:
            limits = f"{tuning.SLOWEST_RATE:g} to {tuning.FASTEST_RATE:g}"
            raise InputError(f"rate = {rate!r}: give a positive sampling rate in Hz ({limits})")
        channels = [
            Channel(name, values, 1.0 / rate, unit.quantity, unit.kept)
            for name, values, unit in series
        ]
        lengths = {channel.name: channel.n for channel in channels}
        if len(set(lengths.values())) != 1:
            listed = ", ".join(f"{name}: {n}" for name, n in lengths.items()) or "none given"
            raise InputError(f"channels have different lengths ({listed}): cut them to one length")
        return cls(tuple(channels), source, (*notices, *notices_of_gaps(channels)))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.name for channel in self.channels)

    @property
    def inertial(self) -> tuple[Channel, ...]:
        """Channels that can be calibrated: all but the auxiliary ones."""
        return tuple(channel for channel in self.channels if not channel.is_auxiliary)

    @property
    def dt(self) -> float:
        """Sampling interval, s, of the fastest channels."""
        return self._fastest.dt

    @property
    def rate(self) -> float:
        """Sampling rate, Hz, of the fastest channels."""
        return 1.0 / self.dt

    @property
    def n(self) -> int:
        """Number of samples of the fastest channels."""
        return self._fastest.n

    @property
    def _fastest(self) -> Channel:
        return max(self.inertial or self.channels, key=lambda channel: channel.n)

    def by_rate(self) -> tuple[Self, ...]:
        """The recordings of one sampling rate each that make up this one; usually itself.

        The auxiliary channels, which explain the others, are in all of them.
        """
        kinds = dict.fromkeys((channel.dt, channel.n) for channel in self.inertial)
        if len(kinds) < 2:
            return (self,)

        def channels(kind: tuple[float, int]) -> tuple[Channel, ...]:
            return tuple(c for c in self.channels if c.is_auxiliary or (c.dt, c.n) == kind)

        return tuple(replace(self, channels=channels(kind)) for kind in kinds)

    def of_one_rate(self, what: str) -> Self:
        """The recording, if its sensors have one sampling rate, which ``what`` needs."""
        parts = self.by_rate()
        if len(parts) > 1:
            rates = " and ".join(f"{part.rate:.6g}" for part in parts)
            text = f"{self.source or 'the recording'} has channels at {rates} Hz"
            hint = "choose a topic that has all of them"
            raise InputError(f"{text}, and {what} needs one rate: {hint}")
        return self

    @property
    def duration(self) -> float:
        """Length, s."""
        return self.n * self.dt

    def part(self, start: float = 0.0, stop: float | None = None) -> Self:
        """The recording between two times, whose own times count from ``start``.

        Parameters
        ----------
        start, stop : float, optional
            s from the first sample; by default to the end.

        Raises
        ------
        InputError
            If fewer than 64 samples lie between, or the sampling rate changes, so that the times
            are not those of the file.
        """
        end = self.duration if stop is None else min(float(stop), self.duration)
        if start == 0.0 and end == self.duration:
            return self
        if any(each.code == "rate-changes" for each in self.notices):
            text = "the sampling rate changes, so that a part has another rate than the whole"
            hint = "cut the file where it changes"
            raise InputError(f"{self.source or 'the recording'}: {text}: {hint}")
        if not (start >= 0.0 and (end - start) * self.rate >= tuning.FEWEST_SAMPLES):
            raise InputError(
                f"{self.source or 'the recording'} lasts {self.duration:.6g} s and has fewer than "
                f"{tuning.FEWEST_SAMPLES} samples from {start:g} to {end:g} s: give other times"
            )
        rows = [slice(round(start / c.dt), round(end / c.dt)) for c in self.channels]
        pairs = zip(self.channels, rows, strict=True)
        channels = tuple(replace(c, values=c.values[own]) for c, own in pairs)
        part = notice("part", "", {"start": float(start), "stop": end})
        kept = [each for each in self.notices if each.code != "missing-samples"]
        notices = (*kept, part, *notices_of_gaps(channels))
        return replace(self, channels=channels, notices=notices, start=self.start + start)

    def __getitem__(self, name: str) -> Channel:
        for channel in self.channels:
            if channel.name == name:
                return channel
        names = ", ".join(self.names)
        raise MissingNameError(f"the recording has no channel {name!r}: it has {names}")

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.channels)

    @property
    def _size(self) -> str:
        rates = " and ".join(f"{part.rate:g}" for part in self.by_rate())
        return f"{rates} Hz, {self.duration:.6g} s"

    def __repr__(self) -> str:
        return f"<Recording of {self.source or 'arrays'}: {', '.join(self.names)}; {self._size}>"

    def __str__(self) -> str:
        head = f"{self.source or 'recording'}: {self._size}"
        channels = (f"  {channel}" for channel in self.channels)
        return "\n".join([head, *channels, *map(str, self.notices)])


def _series(name: str, values: FloatArray) -> FloatArray:
    try:
        series = np.asarray(checks.unmasked(values), dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"channel {name!r} holds something that is not a number") from None
    if series.ndim != 1:
        raise InputError(f"channel {name!r} has shape {series.shape}: give one series of samples")
    infinite = np.flatnonzero(np.isinf(series))
    if infinite.size:
        where = f"channel {name!r} is infinite at index {infinite[0]}"
        raise InputError(f"{where}: give a number, or NaN if the sample is missing")
    return series


def notices_of_gaps(channels: Iterable[Channel]) -> list[Notice]:
    """One for all channels that miss equally many samples in equally many gaps."""
    found, notices = {channel.name: Missing.of(channel.values) for channel in channels}, []
    for each in dict.fromkeys(each for each in found.values() if each.samples):
        names = [name for name, other in found.items() if other == each]
        variant = "all" if each.samples == each.n else "many" if each.gaps > 1 else "one"
        values = {"missing": each.samples, "gaps": each.gaps, "longest": each.longest}
        where, them = ", ".join(names), "each " if len(names) > 1 else ""
        notices.append(
            notice("missing-samples", where, values, variant=variant, n=each.n, each=them)
        )
    return notices


def joined(parts: Sequence[Recording]) -> Recording:
    """Recordings of topics, cut to the time that they have in common."""
    first = parts[0]
    if len(parts) == 1:
        return first
    start = max(part.start for part in parts)
    stop = min(part.start + part.duration for part in parts)
    if not stop > start:
        text = f'{first.source}: its topics have no time in common: choose one, or clock="log"'
        raise InputError(text, "topics-apart")
    channels = [channel for part in parts for channel in _cut(part, start, stop)]
    names = [channel.name for channel in channels]
    if len(set(names)) < len(names):
        raise InputError(f"{first.source}: two topics have the same channels: choose one", "topic")
    # Clocks that are the same within half a sample get one rate and length.
    dt, n = channels[0].dt, channels[0].n
    for i, channel in enumerate(channels):
        if abs(channel.dt / dt - 1.0) * channel.n < _SAMPLE and abs(channel.n - n) <= 1:
            channels[i] = replace(channel, dt=dt, values=channel.values[:n])
    shortest = min(channel.n for channel in channels if channel.dt == dt)
    channels = [
        replace(channel, values=channel.values[:shortest]) if channel.dt == dt else channel
        for channel in channels
    ]
    notices: list[Notice] = []
    for each in (each for part in parts for each in part.notices):
        if each.code != "missing-samples" and each not in notices:
            notices.append(each)
    values = {
        "duration": stop - start,
        "lost": max(part.duration for part in parts) - (stop - start),
        "rates": len({channel.dt for channel in channels if not channel.is_auxiliary}),
    }
    rates = ", ".join(f"{part.rate:.6g} Hz" for part in parts)
    notices.append(notice("topics-joined", "", values, count=len(parts), listed=rates))
    jitter = [part.jitter for part in parts if part.jitter is not None]
    return replace(
        first,
        channels=tuple(channels),
        notices=(*notices, *notices_of_gaps(channels)),
        jitter=max(jitter, default=None),
        start=start,
    )


def _cut(recording: Recording, start: float, stop: float) -> list[Channel]:
    begin, end = (round((time - recording.start) * recording.rate) for time in (start, stop))
    rows = slice(begin, end)
    if rows.stop - rows.start < tuning.FEWEST_SAMPLES:
        common = f"{recording.source}: its topics have {stop - start:.3g} s in common"
        hint = f"fewer than {tuning.FEWEST_SAMPLES} samples: choose one, or record longer"
        raise InputError(f"{common}, {hint}", "topics-apart")
    return [replace(channel, values=channel.values[rows]) for channel in recording.channels]


def require_recording(given: Any) -> None:
    """Raise InputError for anything but a recording."""
    if isinstance(given, str | os.PathLike):
        path = checks.shown(os.fspath(given))
        raise InputError(f"{path} is a path: read it first, gmwm.read({path}, rate=..., units=...)")
    if not isinstance(given, Recording):
        hint = "give what gmwm.read returns, or make one with Recording.from_arrays"
        raise InputError(f"{checks.shown(given)} is not a recording of samples: {hint}")
