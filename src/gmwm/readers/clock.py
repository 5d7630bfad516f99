"""A column of time stamps: is it a uniform clock, how fast, and which rows are missing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.jumps import Change, Jumps, find_change, find_jumps

_UNITS = {
    86400.0: "days",
    3600.0: "hours",
    60.0: "minutes",
    1.0: "seconds",
    1e-3: "milliseconds",
    1e-6: "microseconds",
    1e-9: "nanoseconds",
}
_SHORTEST_STEP = 1e-100  # in any unit; shorter ones only leave the range of floating point
_WAY_OUT = "if the samples are evenly spaced all the same, give rate= and time=False"


def agree(rate: float, other: float) -> bool:
    """Whether two rates are the same within 1 %."""
    return abs(rate / other - 1.0) <= tuning.RATES_AGREE


@dataclass(frozen=True)
class Timing:
    """What time stamps say.

    Attributes
    ----------
    rate : float
        In Hz; not rounded to what was expected.
    jumps : Jumps
        Where rows are missing.
    notices : tuple of Notice
        On the clock: its rate, its unit, its jitter, its jumps.
    jitter : float
        Standard deviation of the steps, as a share of a step.
    """

    rate: float
    jumps: Jumps
    notices: tuple[Notice, ...]
    jitter: float


@dataclass(frozen=True)
class Clock:
    """Time stamps of a recording.

    Attributes
    ----------
    source, column : str
        File and column, for messages.
    stamps : (n,) ndarray
        In a unit of ``seconds``.
    seconds : float or None
        The unit, if it is known.
    own_unit : str
        The unit as the header states it.
    where : callable
        Row -> where that is in the file.
    """

    source: str
    column: str
    stamps: FloatArray
    seconds: float | None
    own_unit: str
    where: Callable[[int], str]

    @property
    def place(self) -> str:
        """File and column, at the beginning of messages."""
        return f"{self.source}, column {self.column}"

    def timing(self, expected: float | None = None) -> Timing:
        """Sampling rate over the whole recording, and the jumps.

        Stamps without a unit are seconds where that gives the rate of an inertial sensor; for
        others a rate is asked for. With an expected rate, the unit is the one that fits it, or
        where the header states a unit that is unknown here, what makes it fit.

        Parameters
        ----------
        expected : float, optional
            Rate that the user or the file states, Hz.

        Returns
        -------
        Timing

        Raises
        ------
        InputError
            If a stamp is missing, if they are not increasing or not uniform, if more than half of
            the rows are missing, or if the stamps contradict what is expected.
        """
        self._check_complete()
        with np.errstate(all="ignore"):  # extreme stamps end in an InputError, not in a warning
            steps = np.diff(self.stamps)
            self._check_increasing(steps)
            change = find_change(self.stamps)
            if change is None:
                self._check_not_short(steps)
            jumps = find_jumps(self.stamps)
            jitter = float(np.std(np.delete(steps, jumps.rows - 1)))
        step = jumps.interval
        if not _SHORTEST_STEP < step < 1.0 / _SHORTEST_STEP:
            raise InputError(
                f"{self.place}: steps of {step:g} are not those of a clock: {_WAY_OUT}", "clock"
            )
        seconds, guessed = self._unit(step, expected)
        self._check_change(change, seconds)
        self._check_jumps(jumps)
        rate = 1.0 / (step * seconds)
        if expected is not None and not agree(rate, expected):
            raise InputError(
                f"{self.place}: its stamps give {rate:.6g} Hz, not the {expected:.6g} Hz stated",
                "rate-contradicted",
                "leave out the rate to use that of the stamps, or give time=False to ignore them",
            )
        text = (
            f"time stamps (column {self.column}, {_UNITS.get(seconds, self.own_unit)}"
            f"{', inferred from the steps' if guessed else ''}) give {rate:.6g} Hz; their steps "
            f"vary by {jitter * seconds:.3g} s rms ({jitter / step:.2%} of a step)"
        )
        values = {"rate": rate, "unit": seconds, "jitter": jitter / step}
        notice = Notice("time-stamps", "note", "", text, values)
        notices = [notice, *self._notices_of_jumps(jumps, seconds)]
        if change is not None:
            notices.append(self._notice_of_change(change, seconds, rate))
        return Timing(rate, jumps, tuple(notices), jitter / step)

    def _check_complete(self) -> None:
        bad = np.flatnonzero(np.isnan(self.stamps))
        if bad.size:
            others = f", and {bad.size - 1:,} more such" if bad.size > 1 else ""
            raise InputError(
                f"{self.place}, {self.where(int(bad[0]))}: no time stamp{others}: remove such "
                f"lines, or, {_WAY_OUT}",
                "clock",
            )

    def _check_increasing(self, steps: FloatArray) -> None:
        bad = np.flatnonzero(~(steps > 0.0))
        if bad.size:
            row = int(bad[0]) + 1
            what = "repeats the one before" if steps[row - 1] == 0.0 else "goes back"
            raise InputError(
                f"{self.place}, {self.where(row)}: time stamp {self.stamps[row]:.15g} {what}: "
                f"remove such lines, or, {_WAY_OUT}",
                "clock",
            )

    def _check_not_short(self, steps: FloatArray) -> None:
        median = float(np.median(steps))
        bad = np.flatnonzero(~(steps >= tuning.SHORTEST_STEP * median))
        if bad.size:
            row = int(bad[0]) + 1
            raise InputError(
                f"{self.place}, {self.where(row)}: a step of {steps[row - 1]:.6g} where "
                f"{median:.6g} is usual: use a part of the file with an even clock, or, {_WAY_OUT}",
                "clock",
            )

    def _check_change(self, change: Change | None, seconds: float) -> None:
        if change is not None and change.ratio > tuning.SHARP_CHANGE:
            first, then = (rate / seconds for rate in change.rates)
            raise InputError(
                f"{self.place}, near {self.where(change.row)}: the sampling rate goes from "
                f"{first:.4g} to {then:.4g} Hz: use the part before or after",
                "clock",
            )

    def _notice_of_change(self, change: Change, seconds: float, used: float) -> Notice:
        first, then = (rate / seconds for rate in change.rates)
        when = float(self.stamps[change.row] - self.stamps[0]) * seconds
        text = (
            f"the sampling rate goes from {first:.4g} to {then:.4g} Hz at about {when:.4g} s, and "
            f"{used:.6g} Hz, its mean, is the rate of neither"
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
                f"rounded too coarsely: {_WAY_OUT}",
                "clock",
            )
        n = self.stamps.size
        if jumps.total > n:
            row = int(jumps.rows[jumps.longest])
            raise InputError(
                f"{self.place}, {self.where(row)}: the clock jumps by "
                f"{jumps.missing[jumps.longest]:,.6g} sampling intervals, and in all "
                f"{jumps.total:,.6g} samples are missing where there are {n:,}, more than half of "
                f"the recording: use the part before or after, or, {_WAY_OUT}",
                "clock",
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

    def _unit(self, step: float, expected: float | None) -> tuple[float, bool]:
        """The unit in seconds, and whether it is a guess."""
        if self.seconds is not None:
            return self.seconds, False
        if expected is not None and self.own_unit:
            return 1.0 / expected / step, True
        if expected is not None:
            return min(
                _UNITS, key=lambda unit: abs(math.log(step * unit) + math.log(expected))
            ), True
        if not tuning.LEAST_STEP <= step < tuning.LARGEST_STEP:
            raise InputError(
                f"{self.place}: steps of {step:.6g} without a unit: name the column by its unit, "
                "e.g. time_s or time_ms, or give the sampling rate, rate=100",
                "time-unit",
            )
        return 1.0, True
