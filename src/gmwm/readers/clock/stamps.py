"""A column of time stamps, and the same without what only looks uneven."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import BoolArray, FloatArray, IntArray, median
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.clock.beat import without_beat
from gmwm.readers.clock.unit_of_time import UNITS, without_unit

WAY_OUT = "if the samples are evenly spaced all the same, give rate= and time=False"


@dataclass(frozen=True)
class Clock:
    """Time stamps of a recording.

    source, column: File and column, for messages, ``"column 't'"``.
    stamps: (n,), in a unit of ``seconds``.
    seconds: The unit, if it is known.
    own_unit: The unit as the header states it.
    where: Row -> where that is in the file.
    same: Which rows, in an order, have the samples of the row before; asked where stamps repeat.
    """

    source: str
    column: str
    stamps: FloatArray
    seconds: float | None
    own_unit: str
    where: Callable[[int], str]
    same: Callable[[IntArray], BoolArray]

    def when(self, row: int, seconds: float) -> float:
        """Time of a row from the start of the record, s, with stamps in a unit of seconds."""
        return float(self.stamps[row] - self.stamps[0]) * seconds

    @property
    def place(self) -> str:
        """File and column, at the beginning of messages."""
        return f"{self.source}, {self.column}"

    def check_complete(self) -> None:
        bad = np.flatnonzero(np.isnan(self.stamps))
        if bad.size:
            others = f", and {bad.size - 1:,} more such" if bad.size > 1 else ""
            raise InputError(
                f"{self.place}, {self.where(int(bad[0]))}: no time stamp{others}",
                "clock",
                f"remove such lines, or, {WAY_OUT}",
            )

    def unit(self, step: float, expected: float | None) -> tuple[float, bool]:
        """The unit in seconds, and whether it is a guess."""
        if self.seconds is not None:
            return self.seconds, False
        if expected is not None and self.own_unit:
            return 1.0 / expected / step, True
        if expected is not None:
            return min(
                UNITS, key=lambda unit: abs(math.log(step * unit) + math.log(expected))
            ), True
        if error := without_unit(self.source, self.column, step):
            raise error
        return 1.0, True

    def mended(self) -> Mended | None:
        """The clock without the first of what only looks uneven; None if nothing is."""
        return self._without_copies() or self._continued() or self._without_beat()

    def _without_copies(self) -> Mended | None:
        copies = self._copies()
        if not copies.size:
            return None
        kept = np.delete(np.arange(self.stamps.size), copies)
        clock = replace(
            self,
            stamps=self.stamps[kept],
            where=lambda row: self.where(int(kept[row])),
            same=lambda order: self.same(kept[order]),
        )
        return Mended(clock, repeated_notice(copies.size), kept, copies)

    def _copies(self) -> IntArray:
        """Rows, alone or in pieces, that were written again: they are as an earlier one."""
        none = np.empty(0, dtype=np.int64)
        if np.all(np.diff(self.stamps) > 0.0):
            return none
        order = np.argsort(self.stamps, kind="stable")
        again = np.diff(self.stamps[order], prepend=np.nan) == 0.0
        beside = again & (np.diff(order, prepend=0) == 1)
        alike = int(np.count_nonzero(beside | np.append(beside[1:], False)))
        if 2 * alike > order.size or not np.any(again):
            return none  # bursts: coarse samples repeat by chance
        copies = again & self.same(order)
        many = np.count_nonzero(copies) > tuning.COPIES * np.count_nonzero(again)
        return np.sort(order[copies]) if many else none

    def _continued(self) -> Mended | None:
        stamps = _unwrapped(self.stamps)
        if stamps is None:
            return None
        text = "the counter of the time stamps ran over: they were continued"
        return Mended(replace(self, stamps=stamps), Notice("clock-wraps", "note", "", text))

    def _without_beat(self) -> Mended | None:
        with np.errstate(all="ignore"):
            beat = without_beat(self.stamps)
        if beat is None:
            return None
        text = (
            f"the time stamps are early and late in turns, by {beat.share:.2g} of a sampling "
            "interval: the samples were taken as evenly spaced"
        )
        notice = Notice("stamps-in-turns", "note", "", text, {"share": beat.share})
        return Mended(replace(self, stamps=beat.stamps), notice)


@dataclass(frozen=True)
class Mended:
    """A clock of which something was taken off.

    notice: What it was, if there is anything to tell.
    kept, copies: Rows that are left, and those that were written again.
    """

    clock: Clock
    notice: Notice | None
    kept: IntArray | None = None
    copies: IntArray | None = None


def repeated_notice(count: int) -> Notice:
    """That rows were written again."""
    text = f"{count:,} row{'s repeat rows' if count > 1 else ' repeats a row'} before"
    return Notice("rows-repeated", "note", "", text, {"count": count}, "left out")


def _unwrapped(stamps: FloatArray) -> FloatArray | None:
    """Stamps of a counter of 16 or 32 bit that ran over, continued; None if it did not."""
    with np.errstate(all="ignore"):
        steps = np.diff(stamps)
        back = np.flatnonzero(steps < 0.0)
        if not back.size:
            return None
        usual = median(steps)
        if usual == 0.0 and np.any(steps > 0.0):  # in bursts most are none
            usual = median(steps[steps > 0.0])
        for bits in (16, 32):
            forward = steps[back] + 2.0**bits
            if usual > 0.0 and np.all((forward > 0.0) & (forward < tuning.LONGEST_OF_WRAP * usual)):
                wraps = np.zeros(stamps.size)
                wraps[back + 1] = 2.0**bits
                return np.asarray(stamps + np.cumsum(wraps))
    return None
