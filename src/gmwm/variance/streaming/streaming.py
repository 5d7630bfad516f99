"""Wavelet variance of a stream: samples come in blocks, and are not kept."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import numpy as np

from gmwm._core import checks
from gmwm._core.files import existing_file, moved_into_place
from gmwm._core.typing import ArrayLike
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.readers import Channel
from gmwm.variance.streaming.kernels import first_infinite
from gmwm.variance.streaming.result import variance_of
from gmwm.variance.streaming.series import Series
from gmwm.variance.wavelet import WaveletVariance

_FORMAT = "gmwm.streaming_variance"
_VERSION = 2
_NONE = np.zeros(0)
_QUANTITY = {unit: quantity for quantity, unit in SI_UNIT.items()}


class StreamingVariance:
    """Haar wavelet variance of samples that come in blocks, in memory that does not grow.

    Averaging times of up to 512 samples see all windows, longer ones those that begin at multiples
    of 1/512 of them: a sampling variance larger by 5e-6. Where a record without missing samples has
    room for few of the longest, nearly all of these count; a part with ``start`` that is not joined
    to what is before it may lack that averaging time. Some 5 MB a channel hold what is needed,
    however long the record. The sums, to the last bit, do not depend on how the samples are divided
    into blocks; a large offset does no harm.

    Missing samples are NaN. Half windows are means of the samples that are there, if these are
    three eighths of them at least and do not leave out an end; what that adds to the expected
    variance is taken off.

    Parameters
    ----------
    dt : float
        Sampling interval, s.
    channels : sequence of str, or mapping of str to str, optional
        Names of the channels that blocks have as columns, or names -> SI units (``"rad/s"``,
        ``"m/s^2"``). By default a block is one series.
    start : int, optional
        Samples before the first of this part, which is to be joined with `merge`: 0 for the
        beginning of the record.
    confidence : float, optional
        Level of the chi-square intervals of the result.

    Raises
    ------
    InputError
        If the interval is not positive, or names are missing or the same.

    Examples
    --------
    >>> stream = gmwm.StreamingVariance(dt=0.01)
    >>> for seed in range(4):
    ...     stream.update(np.random.default_rng(seed).normal(size=100_000))
    >>> stream.result()
    <WaveletVariance of a series: 400,000 samples at 100 Hz, 18 levels>
    """

    def __init__(
        self,
        dt: float,
        channels: Sequence[str] | Mapping[str, str] | None = None,
        *,
        start: int = 0,
        confidence: float = 0.95,
    ):
        self.dt = checks.sampling_interval(dt)
        self.confidence = checks.share("confidence", confidence, 0.95)
        begin = checks.whole("start", start, 0)
        if isinstance(channels, str):
            channels = (channels,)
        self._single = channels is None
        names = ("",) if channels is None else tuple(channels)
        if not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
            raise InputError(f"channels = {checks.shown(names)}: give each a name of its own")
        if not names:
            raise InputError("channels = (): name one at least, or leave it out for one series")
        units = channels if isinstance(channels, Mapping) else dict.fromkeys(names, "")
        self._units = {name: str(units[name]) for name in names}
        for unit in self._units.values():
            if unit and unit not in _QUANTITY:
                raise InputError(f"unit {unit!r} is none of a sensor in SI: give rad/s or m/s^2")
        self._series = [Series(begin) for _ in names]

    # -- data in -----------------------------------------------------------------------------------

    def update(self, block: ArrayLike) -> None:
        """Take in the samples that follow.

        Parameters
        ----------
        block : (n,) or (n, channels) array_like
            Of any length, none included; NaN where a sample is missing.

        Raises
        ------
        InputError
            If it has another number of channels, or holds infinite values or no numbers: nothing
            of it is used then.
        """
        values = checks.real_numbers(block, "the block")
        columns = [values] if values.ndim == 1 else list(np.atleast_2d(values).T)
        if values.ndim not in (1, 2) or len(columns) != len(self._series):
            wanted = "(n,)" if self._single else f"(n, {len(self._series)})"
            raise InputError(f"the block has shape {values.shape}: give one of shape {wanted}")
        columns = [np.ascontiguousarray(column) for column in columns]
        for name, column in zip(self._units, columns, strict=True):
            bad = first_infinite(column)
            if bad >= 0:
                raise InputError(
                    f"the block{f', channel {name!r},' if name else ''} is infinite at index {bad} "
                    f"(sample {self.start + self.n + bad:,}): set it to NaN for missing"
                )
        for series, column in zip(self._series, columns, strict=True):
            series.absorb(column)

    def merge(self, other: StreamingVariance) -> Self:
        """Join this part and the one that follows; neither is changed.

        Parameters
        ----------
        other : StreamingVariance
            Made with ``start`` equal to the `end` of this one, perhaps in another process.

        Returns
        -------
        StreamingVariance
            Of the same numbers as one that took in all samples, but for rounding.

        Raises
        ------
        InputError
            If the parts do not belong together.
        """
        if not isinstance(other, StreamingVariance):
            raise InputError(f"{checks.shown(other)} is no streaming variance: merge parts of one")
        for what in ("dt", "_units"):
            mine, theirs = getattr(self, what), getattr(other, what)
            if mine != theirs:
                raise InputError(
                    f"the parts do not belong together: {what.strip('_')} is {mine} and {theirs}"
                )
        if other.start != self.end:
            raise InputError(
                f"the part that follows begins at sample {other.start:,}, and this one ends at "
                f"{self.end:,}: merge in the order of time, and make each part with "
                "start=(samples before it)"
            )
        made = self._like()
        pairs = zip(self._series, other._series, strict=True)
        made._series = [first.joined(second) for first, second in pairs]
        return made

    def _like(self) -> Self:
        channels = None if self._single else self._units
        return type(self)(self.dt, channels, start=self.start, confidence=self.confidence)

    # -- what there is -----------------------------------------------------------------------------

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels; none of a single series."""
        return () if self._single else tuple(self._units)

    @property
    def n(self) -> int:
        """Samples per channel so far, missing ones included."""
        return self._series[0].n

    @property
    def start(self) -> int:
        """Index of the first sample within the record."""
        return self._series[0].start

    @property
    def end(self) -> int:
        """Index of the sample that comes next."""
        return self.start + self.n

    def result(self) -> Any:
        """The wavelet variance of the samples so far; more may follow.

        Returns
        -------
        WaveletVariance, or dict of str to WaveletVariance
            By channel, where they have names.

        Raises
        ------
        InputError
            If a channel is too short, constant or of no sensor's size.
        """
        found = self.results()
        for item in found.values():
            if isinstance(item, InputError):
                raise item
        return found[""] if self._single else found

    def results(self) -> dict[str, WaveletVariance | InputError]:
        """The same by channel, with the reason in place of the variance of one that has none."""
        found: dict[str, WaveletVariance | InputError] = {}
        for (name, unit), series in zip(self._units.items(), self._series, strict=True):
            try:
                channel = Channel(name, _NONE, self.dt, _QUANTITY.get(unit), unit)
                found[name] = variance_of(series, channel, self.confidence)
            except InputError as error:
                found[name] = error
        return found

    def __repr__(self) -> str:
        what = ", ".join(self.channels) or "a series"
        return f"<{type(self).__name__} of {what}: {self.n:,} samples at {1.0 / self.dt:g} Hz>"

    # -- checkpoints -------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to an NPZ file, from which `load` goes on to the last bit.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        arrays: dict[str, Any] = {
            "format": np.array([_FORMAT, str(_VERSION)]),
            "interval": np.array([self.dt, self.confidence]),
            "single": np.array(self._single),
            "names": np.array(list(self._units)),
            "units": np.array(list(self._units.values())),
        }
        for i, series in enumerate(self._series):
            arrays |= {f"{i}.{name}": array for name, array in series.arrays().items()}
        with moved_into_place(path) as new, new.open("wb") as stream:
            np.savez(stream, **arrays)
        return Path(path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Inverse of `save`.

        Raises
        ------
        InputError
            If the file is missing or is none of them.
        """
        file = existing_file(Path(path))
        with suppress(Exception):  # whatever damaged bytes raise
            # numpy leaves a file open that it cannot read.
            with file.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            return cls._of_arrays(arrays)
        raise InputError(f"{file.name} is no saved streaming variance: write it with save()")

    @classmethod
    def _of_arrays(cls, arrays: Mapping[str, Any]) -> Self:
        if arrays["format"].tolist() != [_FORMAT, str(_VERSION)]:
            raise ValueError("another kind of file")
        units = dict(zip(arrays["names"].tolist(), arrays["units"].tolist(), strict=True))
        dt, confidence = arrays["interval"].tolist()
        made = cls(dt, None if arrays["single"] else units, confidence=confidence)
        made._series = [
            Series.of_arrays(
                {
                    name.partition(".")[2]: array
                    for name, array in arrays.items()
                    if name.startswith(f"{i}.")
                }
            )
            for i in range(len(units))
        ]
        return made
