"""What a streaming wavelet variance knows of one series."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from gmwm._core.typing import FloatArray
from gmwm.variance import tuning
from gmwm.variance.streaming import kernels, window_kernels
from gmwm.variance.streaming.kernels import (
    BLOCKS,
    FILLED,
    GAPPY,
    HALO,
    HEADED,
    LEADING,
    MISSING,
    MOST_BLOCKS,
    NEXT_BLOCK,
    OCTAVE,
    OLD,
    ORIGIN,
    ROOM,
    RUN,
    START,
    N,
)
from gmwm.variance.streaming.mark_kernels import PLACES, SLOTS, offsets
from gmwm.variance.streaming.window_kernels import (
    COUNT,
    FINE,
    FOURTH,
    HIGHEST,
    LOST_FOURTH,
    LOST_MEAN,
    LOST_SQUARE,
    LOST_SUM,
    LOWEST,
    MEAN,
    REFERENCE,
    SCARCITY,
    SQUARE,
    SUM,
)  # fmt: skip

_ROWS = tuning.STREAMING_ROWS
_LEVELS = FINE + _ROWS - 1


class Series:
    """Sums over the windows of one series, and the values that further windows need.

    Row k has the means of blocks of 2^k samples that begin at multiples of 2^k, counted from the
    beginning of the record.

    data, present: (rows, ROOM), latest values of each row about the reference, and how many samples
        each is made of; the latter only where the state says that some are missing.
    state: (rows, 5) of int, values in the row, index of the first of them, whether samples of them
        are missing, values of the head, and values that are worked off.
    sums: (levels, 6), of the windows of a level: number, sum of the coefficients and of their
        squares, growth of the variance of white noise by missing samples (over that of a sample),
        and what rounding took from the former two sums.
    head: (2, rows, HALO), first values of each row, and of how many samples: what joins the part
        before.
    blocks: (2, MOST_BLOCKS), all values of one row, and of how many samples.
    totals: (7,), reference, smallest, largest, sum and what was lost of it; sum of the fourth
        powers of the finest coefficients, and what was lost.
    tallies: (8,) of int, samples, missing ones, of which at the end and at the beginning; blocks,
        their row, index of the next; index of the first sample.
    gaps: (63, 2) of int, number of gaps of up to 2^i samples, and samples that they have.
    marks: (4, 1 + PLACES), of `mark_kernels`.
    """

    _ARRAYS = (
        "data", "present", "state", "sums", "head", "blocks", "totals", "tallies", "gaps", "marks",
    )  # fmt: skip

    def __init__(self, start: int = 0, room: int = ROOM):
        # What the state does not count is never read.
        self.data = np.empty((_ROWS, room))
        self.present = np.empty((_ROWS, room))
        self.state = np.zeros((_ROWS, 5), dtype=np.int64)
        self.state[0, ORIGIN] = start
        self.sums = np.zeros((_LEVELS, 6))
        self.head = np.empty((2, _ROWS, HALO))
        self.blocks = np.zeros((2, MOST_BLOCKS))
        self.totals = np.zeros(7)
        self.totals[[REFERENCE, LOWEST, HIGHEST]] = np.nan, np.inf, -np.inf
        self.tallies = np.zeros(8, dtype=np.int64)
        self.tallies[[START, NEXT_BLOCK]] = start
        self.gaps = np.zeros((63, 2), dtype=np.int64)
        self.marks = np.full((SLOTS, 1 + PLACES), np.nan)
        self.marks[:, 0] = 0.0, -1.0, -1.0, -1.0
        self._scratch = np.empty((2, room + 1))

    def absorb(self, samples: FloatArray) -> None:
        """Take in samples (n,), NaN where one is missing, none infinite."""
        kernels.absorb(samples, *(getattr(self, name) for name in self._ARRAYS), self._scratch)

    def finished(self, *, goes_on: bool = True) -> Self:
        """A copy of which all samples are worked off.

        goes_on: Whether it can take in more or be joined; otherwise it only tells what was found,
            in less memory and time.
        """
        made = type(self)(room=ROOM if goes_on else self._room_to_finish())
        for name in ("state", "sums", "totals", "tallies", "gaps", "marks"):
            getattr(made, name)[...] = getattr(self, name)
        made.blocks[:, : self.tallies[BLOCKS]] = self.blocks[:, : self.tallies[BLOCKS]]
        for row, (filled, headed, gappy) in enumerate(self.state[:, [FILLED, HEADED, GAPPY]]):
            made.data[row, :filled] = self.data[row, :filled]
            if goes_on:
                made.head[:, row, :headed] = self.head[:, row, :headed]
            if gappy:
                made.present[row, :filled] = self.present[row, :filled]
        kernels.work_off(
            1, made.data, made.present, made.state, made.sums, made.head, made.blocks, made.totals,
            made.tallies, made.marks, made._scratch,
        )  # fmt: skip
        return made

    def _room_to_finish(self) -> int:
        """Most values of a row while all are worked off: of the new ones, half go to the next."""
        room = new = 0
        for filled, old in self.state[:, [FILLED, OLD]].tolist():
            passed_on = new // 2 + 1
            room = max(room, filled + passed_on)
            new = filled - old + passed_on
        return room

    # -- what was found ----------------------------------------------------------------------------

    @property
    def start(self) -> int:
        """Index of the first sample."""
        return int(self.tallies[START])

    @property
    def n(self) -> int:
        """Samples, missing ones included."""
        return int(self.tallies[N])

    @property
    def missing(self) -> int:
        """Missing samples."""
        return int(self.tallies[MISSING])

    @property
    def mean(self) -> float:
        """Mean of the samples about the reference."""
        return float(self.totals[SUM] + self.totals[LOST_SUM]) / max(self.n - self.missing, 1)

    @property
    def lowest(self) -> float:
        """Smallest sample."""
        return float(self.totals[REFERENCE] + self.totals[LOWEST])

    @property
    def spread(self) -> float:
        """Largest less smallest sample; zero if there is none."""
        return max(float(self.totals[HIGHEST] - self.totals[LOWEST]), 0.0)

    def level_sums(self) -> FloatArray:
        """Number of windows, and means over them: coefficient, square, scarcity; (4, levels)."""
        count = self.sums[:, COUNT]
        columns = (
            self.sums[:, MEAN] + self.sums[:, LOST_MEAN],
            self.sums[:, SQUARE] + self.sums[:, LOST_SQUARE],
            self.sums[:, SCARCITY],
        )
        return np.stack([count, *(column / np.maximum(count, 1.0) for column in columns)])

    @property
    def fourth_power(self) -> float:
        """Mean fourth power of the finest coefficients."""
        return float(self.totals[FOURTH] + self.totals[LOST_FOURTH]) / max(
            float(self.sums[0, COUNT]), 1.0
        )

    def block_means(self, most: int) -> tuple[FloatArray, FloatArray, int]:
        """Means of at most so many blocks, samples that each has, and its size."""
        values, there = self.blocks[:, : self.tallies[BLOCKS]].copy()
        octave = int(self.tallies[OCTAVE])
        first = int(self.tallies[NEXT_BLOCK]) - values.size
        while values.size > most:
            made = kernels.coarsened(values, there, values.size, first)
            values, there = values[:made], there[:made]
            first = -(-first // 2)
            octave += 1
        return values, there, 1 << octave

    def of_ends(self, level: int, mean: float, square: float) -> tuple[float, float]:
        """Means of the coefficients of one of the two coarsest levels and of their squares.

        Where there are few windows, nearly each of them counts; between those that are known, lines
        are straight. Where there are many, those at multiples of 1/512 are known, of which the
        first and the last stand for half as many as others, and the last for those after it.

        mean, square: Over the windows at multiples.
        Returns: the same where samples before the first are missing, or between.
        """
        m = 1 << level
        count = self.n - 2 * m + 1
        if self.start or self.missing or m <= tuning.STREAMING_STARTS:
            return mean, square
        begins = offsets()[: int(np.searchsorted(offsets(), count))]
        sums = [self._sums_after(at)[: begins.size] for at in (0, m, 2 * m)]
        windows = (sums[2] - 2.0 * sums[1] + sums[0]) * (0.5 / m)
        if not np.all(np.isfinite(windows)):
            return mean, square
        if count <= tuning.FEW_WINDOWS * m:
            steps = np.diff(begins, append=count)
            weights = np.append(0.5 * (steps[:-1] + 1.0), float(steps[-1]))
            weights[1:] += 0.5 * (steps[:-1] - 1.0)
            return float(weights @ windows / count), float(weights @ windows**2 / count)
        step = m // tuning.STREAMING_STARTS
        multiples, rest = divmod(count - 1, step)
        first, last = -0.5 * (step - 1), rest - 0.5 * (step - 1)

        def whole(known: float, ends: FloatArray) -> float:
            total = step * (multiples + 1) * known + first * ends[0] + last * ends[-1]
            return float(total) / count

        return whole(mean, windows), whole(square, windows**2)

    def _sums_after(self, at: int) -> FloatArray:
        """Sums before the places after a mark; NaN where they are not known."""
        places = self.marks[:, 0].tolist()
        return self.marks[places.index(at), 1:] if at in places else np.full(PLACES, np.nan)

    # -- parts -------------------------------------------------------------------------------------

    def joined(self, other: Self) -> Self:
        """With the part that follows."""
        first, second = self.finished(), other.finished()
        if not second.n:
            return first
        if not first.n:
            return second
        second._refer_to(first)
        made = type(self)(first.start)
        made.sums = first.sums + second.sums
        joints = _joints(first, second)
        for row, joint in enumerate(joints):
            made._join(row, first, second, joint)
        made._join_blocks(first, second, joints)
        made._join_totals(first, second)
        made._join_marks(first, second)
        return made

    def _refer_to(self, other: Self) -> None:
        """Count values from the reference of another part."""
        shift = self.totals[REFERENCE] - other.totals[REFERENCE]
        if np.isnan(other.totals[REFERENCE]):
            other.totals[REFERENCE] = self.totals[REFERENCE]
        if np.isnan(shift):
            return
        self.totals[REFERENCE] = other.totals[REFERENCE]
        for row, (filled, headed) in enumerate(self.state[:, [FILLED, HEADED]]):
            self.data[row, :filled] += shift
            self.head[0, row, :headed] += shift
        self.blocks[0] += shift
        self.totals[[LOWEST, HIGHEST]] += shift
        self.marks[:, 1:] += shift * (self.marks[:, :1] + offsets() - self.start)
        self.totals[SUM] += shift * (self.n - self.missing)

    def _tail(self, row: int) -> tuple[FloatArray, FloatArray]:
        """Latest values of a row, and of how many samples."""
        size = self.state[row, FILLED]
        there = self.present[row, :size]
        if not self.state[row, GAPPY]:
            there = np.full(size, float(1 << row))
        return self.data[row, :size], there

    def _head(self, row: int) -> tuple[FloatArray, FloatArray]:
        """First values of a row, and of how many samples."""
        values, there = self.head[:, row, : self.state[row, HEADED]]
        return values, there

    def _indices(self, row: int) -> tuple[int, int]:
        """Index of the first value of a row, and of the one after its last."""
        return -(-self.start // (1 << row)), (self.start + self.n) // (1 << row)

    def _join(self, row: int, first: Self, second: Self, joint: NDArray[Any]) -> None:
        """The row of two parts that follow each other, and the windows that have some of both."""
        before, after = first._tail(row), second._head(row)
        full = float(1 << row)
        values, there = np.hstack([np.stack(before), joint, np.stack(after)])
        for level in range(FINE) if row == 0 else (FINE - 1,):
            # No more on either side than a window less one value: none lies in one part.
            reach = (2 << level) - 1
            left = min(before[0].size, reach)
            right = min(after[0].size, reach)
            part = slice(before[0].size - left, values.size - after[0].size + right)
            window_kernels.gappy_windows(
                values[part], there[part], 0, row, (level, level + 1), self.sums, self.totals,
                self._scratch,
            )  # fmt: skip
        head = np.hstack([np.stack(first._head(row)), joint, np.stack(after)])
        if first.state[row, HEADED] >= HALO:
            head = np.stack(first._head(row))
        tail = np.hstack([np.stack(before), joint, np.stack(second._tail(row))])
        if second.state[row, FILLED] >= HALO:
            tail = np.stack(second._tail(row))
        head, tail = head[:, :HALO], tail[:, -HALO:]
        size = tail.shape[1]
        self.head[:, row, : head.shape[1]] = head
        self.data[row, :size], self.present[row, :size] = tail
        end = (second.start + second.n) // (1 << row)
        gappy = not np.all(tail[1] == full)
        self.state[row] = size, end - size, gappy, head.shape[1], size

    def _join_blocks(self, first: Self, second: Self, joints: list[NDArray[Any]]) -> None:
        octave = max(int(first.tallies[OCTAVE]), int(second.tallies[OCTAVE]))
        parts = [each._blocks_of(octave) for each in (first, second)]
        found = np.ascontiguousarray(np.hstack([parts[0], joints[octave], parts[1]]))
        begin = -(-first.start // (1 << octave))
        while found.shape[1] > MOST_BLOCKS:
            made = kernels.coarsened(found[0], found[1], found.shape[1], begin)
            found = np.ascontiguousarray(found[:, :made])
            octave, begin = octave + 1, -(-begin // 2)
        self.blocks[:, : found.shape[1]] = found
        self.tallies[[BLOCKS, OCTAVE]] = found.shape[1], octave
        self.tallies[NEXT_BLOCK] = begin + found.shape[1]

    def _blocks_of(self, octave: int) -> NDArray[Any]:
        """All values of a row that is no finer than that of the blocks."""
        found = self.blocks[:, : self.tallies[BLOCKS]].copy()
        begin = -(-self.start // (1 << int(self.tallies[OCTAVE])))
        for _ in range(octave - int(self.tallies[OCTAVE])):
            made = kernels.coarsened(found[0], found[1], found.shape[1], begin)
            found, begin = np.ascontiguousarray(found[:, :made]), -(-begin // 2)
        return found

    def _join_marks(self, first: Self, second: Self) -> None:
        """Of equal marks, those that the second part does not know are known to the first."""
        before = first.totals[SUM] + first.totals[LOST_SUM]
        self.marks[...] = second.marks
        self.marks[:, 1:] += before
        for own, others in zip(self.marks, first.marks, strict=True):
            if own[0] < others[0]:
                own[...] = others
            elif own[0] == others[0]:
                own[...] = np.where(np.isnan(own), others, own)

    def _join_totals(self, first: Self, second: Self) -> None:
        self.totals[REFERENCE] = first.totals[REFERENCE]
        added = [SUM, LOST_SUM, FOURTH, LOST_FOURTH]
        self.totals[added] += first.totals[added] + second.totals[added]
        self.totals[LOWEST] = min(first.totals[LOWEST], second.totals[LOWEST])
        self.totals[HIGHEST] = max(first.totals[HIGHEST], second.totals[HIGHEST])
        self.gaps = first.gaps + second.gaps
        tallies, own = self.tallies, (first.tallies, second.tallies)
        tallies[[N, MISSING]] = own[0][[N, MISSING]] + own[1][[N, MISSING]]
        # What is missing at the end of the one and at the beginning of the other is one gap.
        leading = second.n if second.missing == second.n else int(own[1][LEADING])
        between = int(own[0][RUN]) + leading
        if first.missing == first.n:
            tallies[LEADING] = between
        else:
            tallies[LEADING] = own[0][LEADING]
        if second.missing == second.n:
            tallies[RUN] = between
            if first.missing == first.n:
                tallies[LEADING] = 0
        else:
            tallies[RUN] = own[1][RUN]
            if between and first.missing < first.n:
                octave = (between - 1).bit_length()
                self.gaps[octave] += (1, between)

    # -- checkpoints -------------------------------------------------------------------------------

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Everything that goes on from here, as arrays by name."""
        rows = int(np.sum(self.state[:, FILLED] > 0))
        found = {name: getattr(self, name) for name in self._ARRAYS}
        found["data"], found["present"], found["head"] = (
            np.where(np.arange(each.shape[-1]) < count[:rows, None], each, 0.0)
            for each, count in (
                (self.data[:rows], self.state[:, FILLED]),
                (self.present[:rows], self.state[:, FILLED] * self.state[:, GAPPY]),
                (self.head[:, :rows], self.state[:, HEADED]),
            )
        )
        found["blocks"] = self.blocks[:, : self.tallies[BLOCKS]]
        return found

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Inverse of `arrays`.

        Raises ValueError if they do not have the shapes and types of a series.
        """
        made = cls()
        for name in cls._ARRAYS:
            own, given = getattr(made, name), arrays[name]
            if given.dtype != own.dtype or given.ndim != own.ndim:
                raise ValueError(f"{name} is not an array of a series")
            if name in ("data", "present"):
                own = own[: given.shape[0]]
            elif name == "head" or name == "blocks":
                own = own[:, : given.shape[1]]
            if own.shape != given.shape:
                raise ValueError(f"{name} has the shape {given.shape}")
            own[...] = given
        return made


def _joints(first: Series, second: Series) -> list[NDArray[Any]]:
    """For each row, the value that has samples of both parts, (2, 0 or 1)."""
    none = np.zeros((2, 0))
    found = [none]
    for row in range(1, _ROWS):
        index = second.start // (1 << row)
        within = index << row >= first.start and (index + 1) << row <= second.start + second.n
        if index << row == second.start or not within:
            found.append(none)
            continue
        pair = np.stack([_value(first, second, found, row - 1, 2 * index + i) for i in (0, 1)])
        there = float(np.sum(pair[:, 1]))
        value = float(pair[:, 0] @ pair[:, 1]) / there if there else 0.0
        found.append(np.array([[value], [there]]))
    return found


def _value(
    first: Series, second: Series, joints: list[NDArray[Any]], row: int, index: int
) -> NDArray[Any]:
    """A value near where two parts meet, and of how many samples."""
    begin, end = first._indices(row)
    if begin <= index < end:
        values, there = first._tail(row)
        return np.array([values[index - end], there[index - end]])
    begin, _ = second._indices(row)
    if index >= begin:
        values, there = second._head(row)
        return np.array([values[index - begin], there[index - begin]])
    return joints[row][:, 0]
