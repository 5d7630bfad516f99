"""A static recording: named channels, of equal rate or each at its own; missing samples."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from gmwm._core import checks
from gmwm._core.spool import scaled
from gmwm._core.text import Printed
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm._core.units import AUXILIARY, Unit, auxiliary_unit, sensor_unit
from gmwm.errors import InputError, MissingNameError, printable
from gmwm.issues import Notice, Severity, codes, notice
from gmwm.readers import tuning

_CODES = {float(sign * (10**k - 1)) for k in range(3, 8) for sign in (-1, 1)} | {-999.25, -99.99}
_ENDS = {
    float(end): bits
    for bits in (64, 32, 24, 16)
    for end in (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1, 2**bits - 1)
}
_ODD = np.array([*_CODES, *_ENDS])


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


def without_sentinels(
    name: str, values: FloatArray, largest: float, where: Callable[[int], str]
) -> tuple[FloatArray, list[Notice]]:
    """Mask numbers that are no samples, and report them; a copy if there is any.

    These are numbers beyond the range of any sensor; error codes (999, -9999, ...) and the smallest
    and largest integers of 16 to 64 bit, if far outside all others; and numbers that come again and
    again, exactly, with nothing between them and the others.

    largest: Magnitude beyond the range of any sensor, in the unit of the file.
    where: Row -> its place in the file.
    """
    some = values[:: -(-values.size // tuning.SAMPLED_FOR_RANGE)]
    some = some[~np.isnan(some)]
    # The range is that of samples: codes among them would make it as wide as themselves.
    usual = some[(np.abs(some) <= largest) & np.isfinite(some) & ~np.isin(some, _ODD)]
    if not usual.size:
        return values, []
    low, first, middle, third, high = np.quantile(usual, [0.05, 0.25, 0.5, 0.75, 0.95])
    width = high - low
    # Codes without a meaning are among the usual ones: a quarter of the samples at most.
    narrow = min(tuning.OF_QUARTILES * (third - first), width) if third > first else width
    reach = tuning.FAR_OUTSIDE * narrow
    # Almost always, and without arrays as long as the values.
    if np.fmax.reduce(values) <= middle + reach and np.fmin.reduce(values) >= middle - reach:
        return values, []
    far = np.flatnonzero(np.abs(values - middle) > reach)
    numbers, which = np.unique(values[far], return_inverse=True)
    chosen = np.array([_meaning(each, largest) != "" for each in numbers.tolist()])
    chosen &= np.abs(numbers - middle) > tuning.FAR_OUTSIDE * width
    if narrow > 0.0:
        chosen |= _are_isolated(values, far, numbers, which, middle)
    gone = far[chosen[which]]
    if not gone.size:
        return values, []
    clean = scaled(values, 1.0)
    clean[gone] = np.nan
    most = tuning.MOST_SENTINELS * values.size
    severity: Severity = "bad" if gone.size > most else "warning"
    notices = []
    own = [[i] for i in np.flatnonzero(chosen & (np.abs(numbers) <= largest)).tolist()]
    beyond = np.flatnonzero(chosen & (np.abs(numbers) > largest)).tolist()
    for group in [*own, beyond] if beyond else own:
        rows = far[np.isin(which, group)]
        number = max(numbers[group].tolist(), key=abs)
        data = {"count": rows.size, "value": number, "row": int(rows[0])}
        words: dict[str, Any] = {
            "samples": f"{rows.size:,} samples are" if rows.size > 1 else "a sample is",
            "alike": " and the like" if len(group) > 1 else "",
            "meaning": _meaning(number, largest) or "far from all others with nothing between",
            "place": where(int(rows[0])),
        }
        notices.append(notice("sentinel", name, data, severity=severity, **words))
    return clean, notices


def _are_isolated(
    values: FloatArray, far: IntArray, numbers: FloatArray, which: IntArray, middle: float
) -> BoolArray:
    """Whether each number comes several times, and from nowhere: motion passes through others."""
    counts = np.bincount(which, minlength=numbers.size)
    again = counts >= tuning.LEAST_REPEATS
    if not np.any(again):
        return again
    # Beside another code, or the same one, is no transition. A sensor at the end of its range stays
    # there: transitions are counted at the ends of each run of equal numbers.
    passing = np.zeros(values.size + 2, dtype=bool)
    passing[far + 1] = ~again[which]
    begins = np.diff(far, prepend=-2) > 1
    begins[1:] |= np.diff(which) != 0
    runs = np.bincount(which, begins, minlength=numbers.size)
    transitions = np.bincount(which, passing[far] | passing[far + 2], minlength=numbers.size)
    again &= transitions <= tuning.TRANSITIONS * runs
    others = np.sort(values[far[~again[which]]])
    reach = 0.5 * np.abs(numbers - middle)
    near = np.searchsorted(others, numbers + reach) - np.searchsorted(others, numbers - reach)
    return np.asarray(again & (near <= tuning.TRANSITIONS * counts))


def _meaning(number: float, largest: float) -> str:
    """What a number stands for; empty for a number like others."""
    if number in _ENDS:
        end = "largest" if number > 0.0 else "smallest"
        return f"the {end} integer of {_ENDS[number]} bit"
    if number in _CODES:
        return "an error code"
    return "beyond the range of any sensor" if abs(number) > largest else ""


READING = codes(topic="reading") | codes(topic="clock")
"""Codes of the notices about how a file was read."""


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
        if not tuning.SLOWEST_RATE <= rate <= tuning.FASTEST_RATE:
            limits = f"{tuning.SLOWEST_RATE:g} to {tuning.FASTEST_RATE:g}"
            raise InputError(f"rate = {rate!r}: give a positive sampling rate in Hz ({limits})")
        channels = []
        for name, values in arrays.items() if isinstance(arrays, Mapping) else arrays:
            unit = units.get(name) or units.get(name.partition("_")[0])
            if unit is None:
                raise InputError(f"channel {name!r} has no unit: give one, e.g. deg/s or g")
            series = _series(name, values)
            known = auxiliary_unit(unit) or sensor_unit(unit)
            channels.append(channel_of(name, series, 1.0 / rate, known))
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


def channel_of(name: str, values: FloatArray, dt: float, unit: Unit) -> Channel:
    """A channel of values in any unit."""
    return Channel(name, scaled(values, unit.scale, unit.offset), dt, unit.quantity, unit.kept)


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


def require_recording(given: Any) -> None:
    """Raise InputError for anything but a recording."""
    if isinstance(given, str | os.PathLike):
        path = checks.shown(os.fspath(given))
        raise InputError(f"{path} is a path: read it first, gmwm.read({path}, rate=..., units=...)")
    if not isinstance(given, Recording):
        hint = "give what gmwm.read returns, or make one with Recording.from_arrays"
        raise InputError(f"{checks.shown(given)} is not a recording of samples: {hint}")
