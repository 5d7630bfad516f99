"""A column of time stamps: is it a uniform clock, how fast, and which rows are missing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.clock.beat import without_beat
from gmwm.readers.clock.jumps import Change, Jumps, find_change, find_jumps, find_shifts, jumps_of
from gmwm.readers.clock.uneven import Followed, followed
from gmwm.readers.clock.unit_of_time import UNITS, without_unit

_SHORTEST_SHOWN = 1e-3  # s; less is given in microseconds
_SHORTEST_STEP = 1e-100  # in any unit; shorter ones only leave the range of floating point
_WAY_OUT = "if the samples are evenly spaced all the same, give rate= and time=False"


def agree(rate: float, other: float) -> bool:
    """Whether two rates are the same within 1 %."""
    return abs(rate / other - 1.0) <= tuning.RATES_AGREE


@dataclass(frozen=True)
class Timing:
    """What time stamps say.

    rate: In Hz; not rounded to what was expected.
    jumps: Where rows are missing.
    notices: On the clock: its rate, its unit, its jitter, its jumps, and what else is uneven.
    jitter: Standard deviation of the steps, as a share of a step.
    """

    rate: float
    jumps: Jumps
    notices: tuple[Notice, ...]
    jitter: float


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
    extent: int

    @property
    def place(self) -> str:
        """File and column, at the beginning of messages."""
        return f"{self.source}, {self.column}"

    def timing(self, expected: float | None = None) -> Timing:
        """Sampling rate over the whole recording, and the jumps.

        Stamps without a unit are seconds where that gives the rate of an inertial sensor; for
        others a rate is asked for. With an expected rate, the unit is the one that fits it, or
        where the header states a unit that is unknown here, what makes it fit.

        Parameters
        ----------
        expected : float, optional
            Rate that the user or the file states, Hz.

        Raises
        ------
        InputError
            If a stamp is missing, if most are far from any even clock, if more than half of the
            rows are missing, or if the stamps contradict what is expected.

        Notes
        -----
        Where no step is shorter than half of the usual one, the jumps are those of the steps.
        Else every row is given its sample number: see `gmwm.readers.clock.uneven`.
        """
        self._check_complete()
        copies = self._copies()
        if copies.size:
            kept = np.delete(np.arange(self.stamps.size), copies)
            rest = replace(
                self,
                stamps=self.stamps[kept],
                where=lambda row: self.where(int(kept[row])),
                same=lambda order: self.same(kept[order]),
            )
            timing = rest.timing(expected)
            found = (*timing.notices, _repeated_notice(copies.size))
            return replace(timing, jumps=timing.jumps.among(kept, copies), notices=found)
        unwrapped = _unwrapped(self.stamps)
        if unwrapped is not None:
            text = "the counter of the time stamps ran over: they were continued"
            timing = replace(self, stamps=unwrapped).timing(expected)
            wrapped = Notice("clock-wraps", "note", "", text)
            return replace(timing, notices=(*timing.notices, wrapped))
        with np.errstate(all="ignore"):
            beat = without_beat(self.stamps)
        if beat is not None:
            timing = replace(self, stamps=beat.stamps).timing(expected)
            text = (
                f"the time stamps are early and late in turns, by {beat.share:.2g} of a sampling "
                "interval: the samples were taken as evenly spaced"
            )
            in_turns = Notice("stamps-in-turns", "note", "", text, {"share": beat.share})
            return replace(timing, notices=(*timing.notices, in_turns))
        uneven: Followed | None = None
        with np.errstate(all="ignore"):  # extreme stamps end in an InputError, not in a warning
            steps = np.diff(self.stamps)
            increasing = bool(np.all(steps > 0.0))
            change = find_change(self.stamps[:: 1 if increasing else tuning.ROWS_OF_ROUGH])
            if change is not None and not increasing:
                change = replace(change, row=change.row * tuning.ROWS_OF_ROUGH)
            is_even = increasing and (change is not None or self._short(steps) is None)
            if is_even:
                jumps = find_jumps(self.stamps)
                jitter = float(np.std(np.delete(steps, jumps.rows - 1))) / jumps.interval
                # What is longer than the recording is no gap.
                is_even = change is not None or not np.any(jumps.missing > self.extent)
            if not is_even:
                uneven = self._followed(steps)
                jumps = jumps_of(uneven)
                jitter = float(np.std(np.diff(uneven.late)[uneven.is_usual]))
        step = jumps.interval
        if not _SHORTEST_STEP < step < 1.0 / _SHORTEST_STEP:
            raise InputError(
                f"{self.place}: steps of {step:g} are not those of a clock", "clock", _WAY_OUT
            )
        seconds, guessed = self._unit(step, expected)
        self._check_change(change, seconds)
        self._check_jumps(jumps)
        rate = 1.0 / (step * seconds)
        if expected is not None and not agree(rate, expected):
            if guessed and (error := without_unit(self.source, self.column, step, expected)):
                raise error
            raise InputError(
                f"{self.place}: its stamps give {rate:.6g} Hz, not the {expected:.6g} Hz stated",
                "rate-contradicted",
                "leave out the rate to use that of the stamps, or give time=False to ignore them",
            )
        text = (
            f"time stamps ({self.column}, {UNITS.get(seconds, self.own_unit)}"
            f"{', inferred from the steps' if guessed else ''}) give {rate:.6g} Hz"
        )
        if jitter >= tuning.JITTER_SHOWN:
            far, unit = jitter * step * seconds, "s"
            if far < _SHORTEST_SHOWN:
                far, unit = 1e6 * far, "us"
            text += f"; their steps vary by {far:.3g} {unit} rms ({100.0 * jitter:.2f} % of a step)"
        values = {"rate": rate, "unit": seconds, "jitter": jitter}
        notice = Notice("time-stamps", "note", "", text, values)
        notices = [notice, *self._notices_of_jumps(jumps, seconds)]
        if change is not None:
            notices.append(self._notice_of_change(change, seconds, rate))
        notices += self._notices_of_shifts(jumps, seconds)
        if uneven is not None:
            notices += self._notices_of_uneven(uneven, jumps, seconds)
        slowest, fastest = tuning.RATES_OF_SENSORS
        if not slowest <= rate <= fastest:
            text = f"{rate:.6g} Hz is a rate that inertial sensors hardly have"
            action = "check the unit of the time column"
            notices.append(Notice("rate-unlikely", "warning", "", text, {"rate": rate}, action))
        return Timing(rate, jumps, tuple(notices), jitter)

    def _check_complete(self) -> None:
        bad = np.flatnonzero(np.isnan(self.stamps))
        if bad.size:
            others = f", and {bad.size - 1:,} more such" if bad.size > 1 else ""
            raise InputError(
                f"{self.place}, {self.where(int(bad[0]))}: no time stamp{others}",
                "clock",
                f"remove such lines, or, {_WAY_OUT}",
            )

    def _copies(self) -> IntArray:
        """Rows, alone or in pieces, that were written again: they are as an earlier one."""
        none = np.empty(0, dtype=np.int64)
        if np.all(np.diff(self.stamps) > 0.0):
            return none
        order = np.argsort(self.stamps, kind="stable")
        again = np.diff(self.stamps[order], prepend=np.nan) == 0.0
        alike = int(np.count_nonzero(again | np.append(again[1:], False)))
        if not 0 < 2 * alike <= order.size:
            return none  # bursts: coarse samples repeat by chance
        copies = again & self.same(order)
        many = np.count_nonzero(copies) > tuning.COPIES * np.count_nonzero(again)
        return np.sort(order[copies]) if many else none

    def _followed(self, steps: FloatArray) -> Followed:
        """Number the rows one by one, if there is a clock that most of them agree on."""
        repeats = steps == 0.0
        same = np.zeros(self.stamps.size, dtype=bool)
        if np.any(repeats):
            same[1:] = repeats & self.same(np.arange(self.stamps.size))[1:]
        found = None
        finest = float(np.spacing(np.max(np.abs(self.stamps))))
        if not np.all(repeats) and finest < 0.1 * np.median(np.abs(steps[~repeats])):
            found = followed(self.stamps, same, self.extent)
        if found is None or not found.is_a_clock:
            raise self._no_clock(steps)
        return found

    def _no_clock(self, steps: FloatArray) -> InputError:
        """The first step that no clock has, and how many there are."""
        wrong, what = np.flatnonzero(steps < 0.0) + 1, "goes back"
        if not wrong.size:
            wrong, what = np.flatnonzero(steps == 0.0) + 1, "repeats the one before"
        if not wrong.size:
            short = self._short(steps)
            row = int(np.argmax(steps)) + 1 if short is None else short
            wrong = np.array([row])
            what = f"is {steps[row - 1]:.6g} after the one before, {np.median(steps):.6g} is usual"
        row = int(wrong[0])
        others = f", and {wrong.size - 1:,} more such" if wrong.size > 1 else ""
        return InputError(
            f"{self.place}, {self.where(row)}: time stamp {self.stamps[row]:.15g} {what}{others}, "
            "so that no even clock fits most of them",
            "clock",
            f"sort the rows or use a part with an even clock, or, {_WAY_OUT}",
        )

    def _short(self, steps: FloatArray) -> int | None:
        """First row after a step that rounding does not make so short."""
        bad = np.flatnonzero(~(steps >= tuning.SHORTEST_STEP * float(np.median(steps))))
        return int(bad[0]) + 1 if bad.size else None

    def _check_change(self, change: Change | None, seconds: float) -> None:
        if change is not None and change.ratio > tuning.SHARP_CHANGE:
            first, then = (rate / seconds for rate in change.rates)
            raise InputError(
                f"{self.place}, near {self.where(change.row)}: the sampling rate goes from "
                f"{first:.4g} to {then:.4g} Hz",
                "rate-changes",
                "use the part before or after",
            )

    def _notice_of_change(self, change: Change, seconds: float, used: float) -> Notice:
        first, then = (rate / seconds for rate in change.rates)
        when = float(self.stamps[change.row] - self.stamps[0]) * seconds
        text = (
            f"the sampling rate goes from {first:.4g} to {then:.4g} Hz at about {when:.4g} s, and "
            f"{used:.6g} Hz, between the two, is the rate of neither"
        )
        values = {"before": first, "after": then, "time": when, "rate": used}
        action = f"use the part before or after ({self.where(change.row)})"
        return Notice("rate-changes", "bad", "", text, values, action)

    def _check_jumps(self, jumps: Jumps) -> None:
        if jumps.are_rounding:
            row = int(jumps.rows[0])
            raise InputError(
                f"{self.place}, {self.where(row)}: a step of two intervals, and "
                f"{jumps.rows.size - 1:,} more such at even distances, as if the stamps were "
                "rounded too coarsely",
                "clock",
                _WAY_OUT,
            )
        n = self.stamps.size
        if jumps.off_grid > tuning.MOST_OFF_GRID * n:
            raise InputError(
                f"{self.place}: {jumps.off_grid:,} of {n:,} steps are not near a whole number of "
                f"the usual one of {jumps.interval:.6g}, so that the sampling rate is not known",
                "clock",
                _WAY_OUT,
            )
        if jumps.are_bursts:
            raise InputError(
                f"{self.place}: every {jumps.rows[1] - jumps.rows[0]} rows the clock steps by "
                f"{jumps.steps[0]:.3g} of the usual steps: rows come in bursts, and stamps say "
                "when they were written, not when they were sampled",
                "clock",
                _WAY_OUT,
            )
        if jumps.total > self.extent:
            row = int(jumps.rows[jumps.longest])
            raise InputError(
                f"{self.place}, {self.where(row)}: the clock jumps by "
                f"{jumps.missing[jumps.longest]:,.6g} sampling intervals, and in all "
                f"{jumps.total:,.6g} samples are missing where there are {n:,}, more than half of "
                "the recording",
                "clock",
                f"use the part before or after, or, {_WAY_OUT}",
            )

    def _notices_of_jumps(self, jumps: Jumps, seconds: float) -> list[Notice]:
        """When the clock jumps, how far, and how many samples that costs."""
        if not jumps.rows.size:
            return []
        count, i = jumps.rows.size, jumps.longest
        interval = jumps.interval * seconds
        digits = 1 - math.floor(math.log10(interval))
        length = round(float(jumps.steps[i] - 1.0) * interval, digits)
        when = round(float(self.stamps[jumps.rows[i] - 1] - self.stamps[0]) * seconds, digits)
        total = f"{jumps.total:,.0f} sample{'s' if jumps.total > 1.0 else ''} missing"
        place = f"by {length:.12g} s, {when:.12g} s after the start"
        if count == 1:
            text, which = f"the clock jumps {place}: {total}", "the jump is"
        else:
            text = f"the clock jumps {count:,} times, farthest {place}: in all {total}"
            which = f"{jumps.off_grid:,} of these jumps {'are' if jumps.off_grid > 1 else 'is'}"
        values = {"count": count, "missing": jumps.total, "longest": length, "time": when}
        notices = [Notice("clock-jumps", "note", "", text, values)]
        if jumps.off_grid:
            text = (
                f"{which} not near a whole number of sampling intervals: the samples after it "
                "were placed at the nearest"
            )
            values = {"count": jumps.off_grid}
            notices.append(Notice("clock-off-grid", "note", "", text, values))
        return notices

    def _notices_of_uneven(self, found: Followed, jumps: Jumps, seconds: float) -> list[Notice]:
        """Bursts, rows that come twice, stamps far from the clock, and a clock that was set."""
        notices = []
        if found.burst > 1:
            text = (
                f"{found.burst} rows come with one stamp, usually: it is taken as that of the last "
                "of them, and the others are one sampling interval apart"
            )
            notices.append(Notice("stamps-in-bursts", "note", "", text, {"rows": found.burst}))
        if count := jumps.repeated.size:
            notices.append(_repeated_notice(count))
        astray = np.flatnonzero(np.abs(found.late) > tuning.ASTRAY + found.burst)
        if astray.size:
            worst = astray[np.argmax(np.abs(found.late[astray]))]
            by = float(found.late[worst]) * jumps.interval * seconds
            text = (
                f"{astray.size:,} time stamp{'s are' if astray.size > 1 else ' is'} far from the "
                f"clock, at most by {by:.3g} s ({self.where(int(worst))}): the samples were taken "
                "as evenly spaced"
            )
            notices.append(
                Notice("stamps-astray", "note", "", text, {"count": astray.size, "largest": by})
            )
        if count := jumps.set_at.size:
            far = (self.stamps[jumps.set_at] - self.stamps[jumps.set_at - 1]) * seconds
            first, largest = int(jumps.set_at[0]), float(far[np.argmax(np.abs(far))])
            times = "once" if count == 1 else f"{count:,} times"
            text = (
                f"the clock was set {times}, farthest by {largest:+.6g} s, first at "
                f"{self.where(first)}: the samples were taken as evenly spaced there"
            )
            numbers = {"count": float(count), "largest": largest}
            action = "if samples are missing there, use the part before or after"
            notices.append(Notice("clock-set", "warning", "", text, numbers, action))
        return notices

    def _notices_of_shifts(self, jumps: Jumps, seconds: float) -> list[Notice]:
        """Where the clock was set by less than what is followed, or while the host stalled."""
        found = find_shifts(self.stamps, jumps)
        if not found:
            return []
        row, by = max(found, key=lambda each: abs(each[1]))
        count = f"at {len(found)} places, farthest" if len(found) > 1 else ""
        text = (
            f"the clock shifts {count} by {by * jumps.interval * seconds:+.3g} s ({by:+.2g} "
            f"sampling intervals) near {self.where(row)}: the samples were taken as evenly "
            "spaced there"
        )
        values = {"count": len(found), "largest": by * jumps.interval * seconds, "row": row}
        action = "if samples are missing there, use the part before or after"
        return [Notice("clock-shifts", "warning", "", " ".join(text.split()), values, action)]

    def _unit(self, step: float, expected: float | None) -> tuple[float, bool]:
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


def _repeated_notice(count: int) -> Notice:
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
        usual = float(np.median(steps))
        for bits in (16, 32):
            forward = steps[back] + 2.0**bits
            if usual > 0.0 and np.all((forward > 0.0) & (forward < tuning.LONGEST_OF_WRAP * usual)):
                wraps = np.zeros(stamps.size)
                wraps[back + 1] = 2.0**bits
                return np.asarray(stamps + np.cumsum(wraps))
    return None
