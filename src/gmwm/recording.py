"""A static recording: named channels of equal rate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.units import SI_UNIT, factor, quantity_of

_SLOWEST, _FASTEST = 1e-6, 1e9  # Hz


@dataclass(frozen=True, eq=False)
class Channel:
    """One axis of one sensor.

    Attributes
    ----------
    name : str
        E.g. ``"gyro_x"``.
    values : (n,) ndarray
        Samples in the SI unit of the quantity, mean not removed.
    dt : float
        Sampling interval, s.
    quantity : {"gyro", "accel", None}
        Angular rate (rad/s), specific force (m/s^2) or, if ``None``, something else in its own
        unit.
    unit : str
        The unit of ``values``.
    """

    name: str
    values: FloatArray
    dt: float
    quantity: str | None = None
    unit: str = ""

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.values.size)

    @property
    def is_constant(self) -> bool:
        """Whether every sample has the same value: a dead channel."""
        return bool(np.all(self.values == self.values[0]))

    def __str__(self) -> str:
        return (
            f"{self.name}: {self.n:,} samples, {self.n * self.dt:.6g} s, "
            f"mean {np.mean(self.values):.6g} {self.unit}"
        )


@dataclass(frozen=True)
class Recording:
    """Named channels with one sampling rate.

    Attributes
    ----------
    channels : tuple of Channel
    source : str
        Where it came from, for messages and reports.
    notes : tuple of str
        What the reader noticed, one sentence each.
    """

    channels: tuple[Channel, ...]
    source: str = ""
    notes: tuple[str, ...] = field(default=())

    @classmethod
    def from_arrays(
        cls,
        arrays: Mapping[str, FloatArray],
        rate: float,
        units: Mapping[str, str],
        source: str = "",
        notes: tuple[str, ...] = (),
    ) -> Recording:
        """Build a recording from arrays in any unit.

        Parameters
        ----------
        arrays : mapping of str to (n,) array_like
            Channel name -> samples.
        rate : float
            Sampling rate, Hz.
        units : mapping of str to str
            Channel name, or "gyro" and "accel" for all of them, -> unit: ``{"gyro": "deg/s"}``.
        source : str, optional
        notes : tuple of str, optional

        Raises
        ------
        InputError
            If the rate is not positive, a unit is missing or unknown, or the channels are not
            series of numbers of one length.
        """
        if not _SLOWEST <= rate <= _FASTEST:
            limits = f"{_SLOWEST:g} to {_FASTEST:g}"
            raise InputError(f"rate = {rate!r}: give a positive sampling rate in Hz ({limits})")
        channels = []
        for name, values in arrays.items():
            unit = units.get(name) or units.get(name.partition("_")[0])
            if unit is None:
                raise InputError(f"channel {name!r} has no unit: give one, e.g. deg/s or g")
            quantity = quantity_of(unit)
            si = SI_UNIT[quantity]
            scaled = _series(name, values) * factor(unit, si)
            channels.append(Channel(name, scaled, 1.0 / rate, quantity, si))
        lengths = {channel.name: channel.n for channel in channels}
        if len(set(lengths.values())) != 1:
            listed = ", ".join(f"{name}: {n}" for name, n in lengths.items()) or "none given"
            raise InputError(f"a recording needs channels of one length ({listed}): cut them alike")
        return cls(tuple(channels), source, notes)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.name for channel in self.channels)

    @property
    def dt(self) -> float:
        """Sampling interval, s."""
        return self.channels[0].dt

    @property
    def rate(self) -> float:
        """Sampling rate, Hz."""
        return 1.0 / self.dt

    @property
    def n(self) -> int:
        """Number of samples of each channel."""
        return self.channels[0].n

    @property
    def duration(self) -> float:
        """Length, s."""
        return self.n * self.dt

    def __getitem__(self, name: str) -> Channel:
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise InputError(f"the recording has no channel {name!r}: it has {', '.join(self.names)}")

    def __iter__(self) -> Iterator[Channel]:
        return iter(self.channels)

    def __len__(self) -> int:
        return len(self.channels)

    def __str__(self) -> str:
        head = f"{self.source or 'recording'}: {self.rate:g} Hz, {self.duration:.6g} s"
        return "\n".join([head, *(f"  {channel}" for channel in self.channels), *self.notes])


def _series(name: str, values: FloatArray) -> FloatArray:
    try:
        series = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"channel {name!r} holds something that is not a number") from None
    if series.ndim != 1:
        raise InputError(f"channel {name!r} has shape {series.shape}: give one series of samples")
    return series
