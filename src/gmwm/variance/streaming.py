"""Wavelet variance of a stream: samples come in blocks, and are not kept.

Missing samples are treated as in `gmwm.variance.gaps`, but for which windows are left out: those
with half a window of too few samples, or of none at either end, so that gaps lie within it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import numpy as np

from gmwm._core import checks
from gmwm._core.documents import read_arrays
from gmwm._core.files import existing_file, moved_into_place
from gmwm._core.typing import ArrayLike, FloatArray, IntArray
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.readers import Channel
from gmwm.variance import stream_kernels as kernels, tuning
from gmwm.variance.covariance.haar import dyadic_levels
from gmwm.variance.gaps import GapEffects, spread_by_lengths, unmasked
from gmwm.variance.series import MIN_SAMPLES, check_varies, cumulant_of_powers, where_of
from gmwm.variance.wavelet import WaveletVariance


def variance_of(sums: kernels.Sums, channel: Channel, confidence: float) -> WaveletVariance:
    """The wavelet variance of a stream that is worked off.

    channel: Without samples: its name, quantity, unit and sampling interval.
    Raises InputError if it is too short, constant or of no sensor's size.
    """
    where, totals = where_of(channel), sums.totals
    n, missing = int(sums.tallies[kernels.N]), int(sums.tallies[kernels.MISSING])
    if n - missing < MIN_SAMPLES:
        raise InputError(f"{where} has {n - missing} samples: {MIN_SAMPLES} or more are needed")
    low = float(totals[kernels.REFERENCE] + totals[kernels.LOWEST])
    spread = max(float(totals[kernels.HIGHEST] - totals[kernels.LOWEST]), 0.0)
    check_varies(Channel(channel.name, np.array([low, low + spread]), channel.dt))
    windows = sums.levels[:, kernels.COUNT]
    size = min(int(np.sum(np.cumprod(windows > 0.0))), dyadic_levels(n).size)
    if not size:
        raise InputError(
            f"{where} has no two consecutive samples, so its noise cannot be estimated: record "
            "without gaps"
        )
    levels, windows = sums.levels[:size], windows[:size]
    mean = (levels[:, kernels.MEAN] + levels[:, kernels.LOST_MEAN]) / windows
    square = (levels[:, kernels.SQUARE] + levels[:, kernels.LOST_SQUARE]) / windows
    fourth = 16.0 * float(totals[kernels.FOURTH] + totals[kernels.LOST_FOURTH]) / float(windows[0])
    cumulant = cumulant_of_powers(4.0 * float(square[0]), fourth, float(windows[0]))
    gaps = None
    if missing:
        given = sums.gaps[sums.gaps[:, 0] > 0], missing / n, tuning.LONGEST_WITHIN
        scarcity = levels[:, kernels.SCARCITY] / windows
        square, change = unmasked(square, scarcity, lambda finer: spread_by_lengths(finer, *given))
        gaps = effects(n, missing, sums.gaps, windows, change)
    blocks, block = _block_means(sums)
    return WaveletVariance(
        tau=dyadic_levels(2**size) * channel.dt,
        variance=square,
        mean=mean,
        blocks=blocks,
        block=block,
        n=n,
        dt=channel.dt,
        confidence=confidence,
        name=channel.name,
        quantity=channel.quantity,
        unit=channel.unit or "u",
        gaps=gaps,
        fourth_cumulant=cumulant,
    )


def _block_means(sums: kernels.Sums) -> tuple[FloatArray, int]:
    """Means of blocks about the mean, NaN where half of one is missing; their size."""
    n, missing, _, count, octave = sums.tallies.tolist()
    most = tuning.MOST_BLOCKS_WITH_GAPS if missing else tuning.MOST_BLOCKS
    values, there = sums.blocks[:, :count].copy()
    while values.size > most:
        count = kernels.coarsened(values, there, values, there)
        values, there = values[:count], there[:count]
        octave += 1
    mean = float(sums.totals[kernels.SUM] + sums.totals[kernels.LOST_SUM]) / (n - missing)
    enough = there >= tuning.LEAST_OF_BLOCK * 2**octave
    return np.where(enough, values - mean, np.nan), 1 << octave


def effects(
    n: int, missing: int, gaps: IntArray, windows: FloatArray, change: FloatArray
) -> GapEffects:
    """What the gaps do to the levels.

    A share p of the windows of a level is left. Windows left out singly cost little, since their
    neighbours say the same; as many in a row as are correlated cost 1/p.

    gaps: (G, 2), number of gaps of up to 2^i samples, and samples they have.
    windows, change: (J,), number of windows used, and the change that `unmasked` finds.
    """
    m = 2.0 ** np.arange(windows.size)
    step = np.maximum(m / tuning.STREAMING_STARTS, 1.0)
    complete = np.floor(n / step) - 2.0 * m / step + 1.0
    left = np.minimum(windows / np.maximum(complete, 1.0), 1.0)
    # Sum of the squared autocorrelation of white noise over all lags.
    alike = np.maximum(tuning.ALIKE * m / step, 1.0)
    # Most are left out for a gap that takes an end of half a window.
    edge = np.maximum(m / tuning.STREAMING_EDGE, np.minimum(m, tuning.STREAMING_LEAST_EDGE))
    number = np.array([np.sum(gaps[int(np.ceil(np.log2(max(each, 1.0)))) :, 0]) for each in edge])
    run = np.maximum(complete - windows, 0.0) / np.maximum(number, 1.0)
    growth = 1.0 + (1.0 / left - 1.0) * np.minimum(run * left / alike, 1.0)
    deviation = np.sqrt(growth) * (1.0 + change)
    common = np.sqrt(np.minimum.outer(left, left) / np.maximum.outer(left, left))
    return GapEffects(missing, windows * step, change, np.outer(deviation, deviation) * common)


_FORMAT, _VERSION = "gmwm.streaming_variance", 3
_QUANTITY = {unit: quantity for quantity, unit in SI_UNIT.items()}


class StreamingVariance:
    """Haar wavelet variance of live samples that come in blocks, in memory that does not grow.

    Averaging times of up to 512 samples see all windows. Longer ones see those that begin at
    multiples of 1/512 of them. For white noise that raises the sampling variance by 1.25/512^2, or
    5e-6: a sum over that grid in place of an integral, by Euler and Maclaurin. A channel takes some
    4 MB, however long the record. The sums do not depend, to the last bit, on how the samples are
    divided into blocks; a large offset does no harm.

    Missing samples are NaN. Half windows are means of the samples they have, if these are at least
    three eighths and include both ends; what that adds to the expected variance is subtracted.

    Parameters
    ----------
    dt, rate : float
        Sampling interval, s, or rate, Hz.
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
        dt: float | None = None,
        channels: Sequence[str] | Mapping[str, str] | None = None,
        *,
        confidence: float = 0.95,
        rate: float | None = None,
    ):
        self.dt = checks.sampling_interval(dt, rate)
        self.confidence = checks.share("confidence", confidence, 0.95)
        if isinstance(channels, str):
            channels = (channels,)
        self._single = channels is None
        names = ("",) if channels is None else tuple(channels)
        if not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
            raise InputError(f"channels = {checks.shown(names)}: give different names")
        if not names:
            raise InputError("channels = (): name at least one, or leave it out for one series")
        units = channels if isinstance(channels, Mapping) else dict.fromkeys(names, "")
        self._units = {name: str(units[name]) for name in names}
        for unit in self._units.values():
            if unit and unit not in _QUANTITY:
                raise InputError(f"unit {unit!r} is not a sensor's SI unit: give rad/s or m/s^2")
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
            bad = np.flatnonzero(np.isinf(column))
            if bad.size:
                raise InputError(
                    f"the block{f', channel {name!r},' if name else ''} is infinite at index "
                    f"{bad[0]} (sample {self.n + bad[0]:,}): set it to NaN for missing"
                )
        for series, column in zip(self._series, columns, strict=True):
            kernels.absorb(column, series.rows, series.sums, series.scratch)

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
            arrays = read_arrays(file)
            if arrays["format"].tolist() != [_FORMAT, str(_VERSION)]:
                raise ValueError("another kind of file")
            units = dict(zip(arrays["names"].tolist(), arrays["units"].tolist(), strict=True))
            dt, confidence = arrays["interval"].tolist()
            made = cls(dt, None if arrays["single"] else units, confidence=confidence)
            for i, series in enumerate(made._series):
                own = {k.partition(".")[2]: v for k, v in arrays.items() if k.startswith(f"{i}.")}
                series.set(own)
                if any(
                    np.max(np.abs(own[name]), initial=0.0) > checks.LARGEST**4 for name in _SUMS
                ):
                    raise ValueError("sums that no samples have")
            return made
        raise InputError(f"{file.name} is not a saved streaming variance: write it with save()")


_SUMS = ("data", "levels", "blocks")
"""Arrays of a series that samples of a sensor bound."""


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
        )
        limits = [kernels.REFERENCE, kernels.LOWEST, kernels.HIGHEST]
        self.sums.totals[limits] = np.nan, np.inf, -np.inf
        self.scratch = np.empty((2, kernels.ROOM + 1))

    def finished(self) -> _Series:
        """A copy with all samples worked off; it does not go on."""
        made = _Series()
        made.set(self.arrays())
        kernels.work_off(1, made.rows, made.sums, made.scratch)
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
        """Inverse of `arrays`; raises ValueError if they are not those of a series."""
        for name, own in (self.rows._asdict() | self.sums._asdict()).items():
            given = arrays[name]
            if name in ("data", "present"):
                own = own[: given.shape[0]]
            if given.dtype != own.dtype or own.shape != given.shape:
                raise ValueError(f"{name} is not an array of a series")
            own[...] = given
        filled, origin, gappy, old = self.rows.state.T
        n, missing, run, blocks, octave = self.sums.tallies.tolist()
        gaps, used = self.sums.gaps, np.arange(len(filled)) < arrays["data"].shape[0]
        rows = (old >= 0) & (old <= filled) & (old <= kernels.HALO) & (filled - old < kernels.CHUNK)
        rows &= (origin >= 0) & (origin <= n) & (gappy >> 1 == 0) & ((filled > 0) == used)
        fits = np.all(rows) and np.sum(used) == len(arrays["present"])
        fits &= 0 <= run <= missing <= n == origin[0] + filled[0] <= checks.MOST_SAMPLES
        fits &= 0 <= blocks <= kernels.MOST_BLOCKS and 0 <= octave < len(filled)
        numbers = (self.rows.data[: np.sum(used)], self.sums.levels, self.sums.blocks)
        fits &= not any(np.isnan(each).any() for each in numbers)
        limits = self.sums.totals[[kernels.REFERENCE, kernels.LOWEST, kernels.HIGHEST]]
        fits &= missing == n or bool(np.all(np.isfinite(limits)))
        if not (fits and np.all((gaps >= 0) & (gaps <= n))):
            raise ValueError("counts that are not those of a series")
