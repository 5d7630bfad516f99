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
from gmwm._core.typing import ArrayLike, FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.readers import Channel
from gmwm.variance import stream_kernels as kernels, tuning
from gmwm.variance.stream_result import variance_of
from gmwm.variance.wavelet import WaveletVariance

_FORMAT, _VERSION = "gmwm.streaming_variance", 3
_QUANTITY = {unit: quantity for quantity, unit in SI_UNIT.items()}


class StreamingVariance:
    """Haar wavelet variance of live samples that come in blocks, in memory that does not grow.

    Averaging times of up to 512 samples see all windows. Longer ones see those that begin at
    multiples of 1/512 of them, which raises the sampling variance by 5e-6. Where a record without
    missing samples has room for few of the longest windows, nearly all of these count. A channel
    takes some 4 MB, however long the record. The sums do not depend, to the last bit, on how the
    samples are divided into blocks; a large offset does no harm.

    Missing samples are NaN. Half windows are means of the samples they have, if these are at least
    three eighths and include both ends; what that adds to the expected variance is subtracted.

    Parameters
    ----------
    dt : float
        Sampling interval, s.
    channels : sequence of str, or mapping of str to str, optional
        Names of the channels that blocks have as columns, or names -> SI units (``"rad/s"``,
        ``"m/s^2"``). By default a block is one series.
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
        confidence: float = 0.95,
    ):
        self.dt = checks.sampling_interval(dt)
        self.confidence = checks.share("confidence", confidence, 0.95)
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
        self._series = [_Series() for _ in names]

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
            bad = kernels.first_infinite(column)
            if bad >= 0:
                raise InputError(
                    f"the block{f', channel {name!r},' if name else ''} is infinite at index {bad} "
                    f"(sample {self.n + bad:,}): set it to NaN for missing"
                )
        for series, column in zip(self._series, columns, strict=True):
            series.absorb(column)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels; none for a single series."""
        return () if self._single else tuple(self._units)

    @property
    def n(self) -> int:
        """Samples per channel so far, missing ones included."""
        return int(self._series[0].sums.tallies[kernels.N])

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
        """The same by channel, with the reason in place of a variance that cannot be given."""
        found: dict[str, WaveletVariance | InputError] = {}
        for (name, unit), series in zip(self._units.items(), self._series, strict=True):
            try:
                channel = Channel(name, np.zeros(0), self.dt, _QUANTITY.get(unit), unit)
                found[name] = variance_of(series.finished().sums, channel, self.confidence)
            except InputError as error:
                found[name] = error
        return found

    def __repr__(self) -> str:
        what = ", ".join(self.channels) or "a series"
        return f"<{type(self).__name__} of {what}: {self.n:,} samples at {1.0 / self.dt:g} Hz>"

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
            If the file is missing or was not written by `save`.
        """
        file = existing_file(Path(path))
        with suppress(Exception):  # whatever damaged bytes raise
            # numpy leaves a file open that it cannot read.
            with file.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            if arrays["format"].tolist() != [_FORMAT, str(_VERSION)]:
                raise ValueError("another kind of file")
            units = dict(zip(arrays["names"].tolist(), arrays["units"].tolist(), strict=True))
            dt, confidence = arrays["interval"].tolist()
            made = cls(dt, None if arrays["single"] else units, confidence=confidence)
            for i, series in enumerate(made._series):
                series.set(
                    {k.partition(".")[2]: v for k, v in arrays.items() if k.startswith(f"{i}.")}
                )
            return made
        raise InputError(f"{file.name} is no saved streaming variance: write it with save()")


class _Series:
    """Sums over the windows of one series, and the values that further windows need."""

    def __init__(self) -> None:
        rows, levels = tuning.STREAMING_ROWS, kernels.FINE + tuning.STREAMING_ROWS - 1
        # What the state does not count is never read.
        self.rows = kernels.Rows(
            data=np.empty((rows, kernels.ROOM)),
            present=np.empty((rows, kernels.ROOM)),
            state=np.zeros((rows, 4), dtype=np.int64),
        )
        self.sums = kernels.Sums(
            levels=np.zeros((levels, 6)),
            totals=np.zeros(7),
            tallies=np.zeros(5, dtype=np.int64),
            gaps=np.zeros((63, 2), dtype=np.int64),
            blocks=np.zeros((2, kernels.MOST_BLOCKS)),
            marks=np.full((kernels.SLOTS, 1 + kernels.PLACES), np.nan),
        )
        limits = [kernels.REFERENCE, kernels.LOWEST, kernels.HIGHEST]
        self.sums.totals[limits] = np.nan, np.inf, -np.inf
        self.sums.marks[:, 0] = 0.0, -1.0, -1.0, -1.0
        self._scratch = np.empty((2, kernels.ROOM + 1))

    def absorb(self, samples: FloatArray) -> None:
        """Take in samples (n,), NaN where one is missing, none infinite."""
        kernels.absorb(samples, self.rows, self.sums, self._scratch)

    def finished(self) -> _Series:
        """A copy with all samples worked off; it does not go on."""
        made = _Series()
        made.set(self.arrays())
        kernels.work_off(1, made.rows, made.sums, made._scratch)
        return made

    def arrays(self) -> dict[str, FloatArray]:
        """Everything that goes on from here, as arrays by name."""
        data, present, state = self.rows
        used = int(np.sum(state[:, kernels.FILLED] > 0))
        filled = np.arange(data.shape[1]) < state[:used, kernels.FILLED, None]
        gappy = state[:used, kernels.GAPPY, None] > 0
        own = {
            "data": np.where(filled, data[:used], 0.0),
            "present": np.where(filled & gappy, present[:used], 0.0),
            "state": state,
        }
        return own | self.sums._asdict()

    def set(self, arrays: Mapping[str, FloatArray]) -> None:
        """Inverse of `arrays`.

        Raises ValueError if they do not have the shapes and types of a series.
        """
        for name, own in (self.rows._asdict() | self.sums._asdict()).items():
            given = arrays[name]
            if name in ("data", "present"):
                own = own[: given.shape[0]]
            if given.dtype != own.dtype or own.shape != given.shape:
                raise ValueError(f"{name} is not an array of a series")
            own[...] = given
