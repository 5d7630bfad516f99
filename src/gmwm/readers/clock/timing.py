"""What time stamps say: is it a uniform clock, how fast, and which rows are missing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray, median
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.clock.clock_notices import (
    change_notice,
    jump_notices,
    shift_notices,
    uneven_notices,
)
from gmwm.readers.clock.jumps import Change, Jumps, find_change, find_jumps, jumps_of
from gmwm.readers.clock.stamps import WAY_OUT, Clock
from gmwm.readers.clock.uneven import Followed, followed
from gmwm.readers.clock.unit_of_time import UNITS, without_unit

_SHORTEST_SHOWN = 1e-3  # s; less is given in microseconds
_SHORTEST_STEP = 1e-100  # in any unit; shorter ones only leave the range of floating point


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


def timing_of(clock: Clock, expected: float | None = None) -> Timing:
    """Sampling rate over the whole recording, and the jumps.

    Stamps without a unit are seconds where that gives the rate of an inertial sensor; for others a
    rate is asked for. With an expected rate, the unit is the one that fits it, or where the header
    states a unit that is unknown here, what makes it fit.

    expected: Rate that the user or the file states, Hz.
    Raises: InputError if a stamp is missing, if most are far from any even clock, if more than half
        of the rows are missing, or if the stamps contradict what is expected.
    """
    clock.check_complete()
    mended = clock.mended()
    if mended is not None:
        timing = timing_of(mended.clock, expected)
        jumps = timing.jumps
        if mended.kept is not None and mended.copies is not None:
            jumps = jumps.among(mended.kept, mended.copies)
        more = () if mended.notice is None else (mended.notice,)
        return replace(timing, jumps=jumps, notices=(*timing.notices, *more))
    steps = _steps(clock)
    step = steps.jumps.interval
    if not _SHORTEST_STEP < step < 1.0 / _SHORTEST_STEP:
        raise InputError(
            f"{clock.place}: steps of {step:g} are not those of a clock", "clock", WAY_OUT
        )
    seconds, guessed = clock.unit(step, expected)
    _check_change(clock, steps.change, seconds)
    _check_jumps(clock, steps.jumps)
    rate = 1.0 / (step * seconds)
    if expected is not None and not agree(rate, expected):
        raise _contradiction(clock, rate, expected, step if guessed else None)
    notices = [_rate_notice(clock, rate, seconds, steps.jitter, guessed=guessed)]
    notices += jump_notices(clock, steps.jumps, seconds)
    if steps.change is not None:
        row, (before, after) = steps.change.row, steps.change.rates
        rates = before / seconds, after / seconds
        notices.append(change_notice(rates, rate, clock.where(row), clock.when(row, seconds)))
    notices += shift_notices(clock, steps.jumps, seconds)
    if steps.uneven is not None:
        notices += uneven_notices(clock, steps.uneven, steps.jumps, seconds)
    is_told = expected is not None or not guessed
    slowest, fastest = tuning.RATES_OF_SENSORS if is_told else tuning.RATES_OF_SECONDS
    if not slowest <= rate <= fastest:
        text = f"{rate:.6g} Hz is a rate that inertial sensors hardly have"
        hint = "check the unit of the time column"
        if not is_told:
            hint = "the time column states no unit: name it, such as 'time [s]' or 'time [ms]'"
        notices.append(Notice("rate-unlikely", "warning", "", text, {"rate": rate}, hint))
    return Timing(rate, steps.jumps, tuple(notices), steps.jitter)


@dataclass(frozen=True)
class _Steps:
    """The steps of a clock: their jumps and jitter, where its rate changes, and if uneven, how."""

    jumps: Jumps
    jitter: float
    change: Change | None
    uneven: Followed | None


def _steps(clock: Clock) -> _Steps:
    """Where no step is shorter than half of the usual one, the jumps are those of the steps.

    Else every row is given its sample number: see `gmwm.readers.clock.uneven`.
    """
    with np.errstate(all="ignore"):  # extreme stamps end in an InputError, not in a warning
        steps = np.diff(clock.stamps)
        increasing = bool(np.all(steps > 0.0))
        every = 1 if increasing else tuning.ROWS_OF_ROUGH
        change = find_change(clock.stamps[::every])
        if change is not None:
            change = replace(change, row=change.row * every)
        if increasing and (change is not None or _short(steps) is None):
            jumps = find_jumps(clock.stamps)
            # What is longer than the recording is no gap, nor are steps of 40 orders in one clock.
            if jumps.interval > 0.0 and (
                change is not None or not np.any(jumps.missing > clock.stamps.size)
            ):
                jitter = float(np.std(np.delete(steps, jumps.rows - 1))) / jumps.interval
                return _Steps(jumps, jitter, change, None)
        del steps  # following needs more memory
        uneven = _followed(clock)
        jitter = float(np.std(np.diff(uneven.late)[uneven.is_usual]))
        return _Steps(jumps_of(uneven), jitter, change, uneven)


def _contradiction(clock: Clock, rate: float, expected: float, guessed: float | None) -> InputError:
    """That the stamps, of a step whose unit may be a guess, have another rate than stated."""
    if guessed is not None:
        error = without_unit(clock.source, clock.column, guessed, expected)
        if error is not None:
            return error
    return InputError(
        f"{clock.place}: its stamps give {rate:.6g} Hz, not the {expected:.6g} Hz stated",
        "rate-contradicted",
        "leave out the rate to use that of the stamps, or give time=False to ignore them",
    )


def _rate_notice(
    clock: Clock, rate: float, seconds: float, jitter: float, *, guessed: bool
) -> Notice:
    text = (
        f"time stamps ({clock.column}, {UNITS.get(seconds, clock.own_unit)}"
        f"{', inferred from the steps' if guessed else ''}) give {rate:.6g} Hz"
    )
    if jitter >= tuning.JITTER_SHOWN:
        far, unit = jitter / rate, "s"
        if far < _SHORTEST_SHOWN:
            far, unit = 1e6 * far, "us"
        text += f"; their steps vary by {far:.3g} {unit} rms ({100.0 * jitter:.2f} % of a step)"
    return Notice(
        "time-stamps", "note", "", text, {"rate": rate, "unit": seconds, "jitter": jitter}
    )


def _check_change(clock: Clock, change: Change | None, seconds: float) -> None:
    if change is not None:
        first, then = (rate / seconds for rate in change.rates)
        check_rates(first, then, f"{clock.place}, near {clock.where(change.row)}")


def check_rates(first: float, then: float, place: str) -> None:
    """Raise InputError if two rates of one recording, Hz, are too different to be one."""
    if max(first / then, then / first) > tuning.SHARP_CHANGE:
        raise InputError(
            f"{place}: the sampling rate goes from {first:.4g} to {then:.4g} Hz",
            "rate-changes",
            "use the part before or after",
        )


def _check_jumps(clock: Clock, jumps: Jumps) -> None:
    if jumps.are_rounding:
        row = int(jumps.rows[0])
        raise InputError(
            f"{clock.place}, {clock.where(row)}: a step of two intervals, and "
            f"{jumps.rows.size - 1:,} more such at even distances, as if the stamps were "
            "rounded too coarsely",
            "clock",
            WAY_OUT,
        )
    n = clock.stamps.size
    if jumps.off_grid > tuning.MOST_OFF_GRID * n:
        raise InputError(
            f"{clock.place}: {jumps.off_grid:,} of {n:,} steps are not near a whole number of "
            f"the usual one of {jumps.interval:.6g}, so that the sampling rate is not known",
            "clock",
            WAY_OUT,
        )
    if jumps.are_bursts:
        raise InputError(
            f"{clock.place}: every {jumps.rows[1] - jumps.rows[0]} rows the clock steps by "
            f"{jumps.steps[0]:.3g} of the usual steps: rows come in bursts, and stamps say "
            "when they were written, not when they were sampled",
            "clock",
            WAY_OUT,
        )
    if jumps.total > clock.stamps.size:
        row = int(jumps.rows[jumps.longest])
        raise InputError(
            f"{clock.place}, {clock.where(row)}: the clock jumps by "
            f"{jumps.missing[jumps.longest]:,.6g} sampling intervals, and in all "
            f"{jumps.total:,.6g} samples are missing where there are {n:,}, more than half of "
            "the recording",
            "clock",
            f"use the part before or after, or, {WAY_OUT}",
        )


def _followed(clock: Clock) -> Followed:
    """Number the rows one by one, if there is a clock that most of them agree on."""
    steps = np.diff(clock.stamps)
    repeats = steps == 0.0
    same = np.zeros(clock.stamps.size, dtype=bool)
    if np.any(repeats):
        same[1:] = repeats & clock.same(np.arange(clock.stamps.size))[1:]
    found = None
    finest = float(np.spacing(np.max(np.abs(clock.stamps))))
    is_fine = not np.all(repeats) and finest < 0.1 * median(np.abs(steps[~repeats]))
    del steps
    if is_fine:
        found = followed(clock.stamps, same, clock.stamps.size)
    if found is None or not found.is_a_clock:
        raise _no_clock(clock, np.diff(clock.stamps))
    return found


def _no_clock(clock: Clock, steps: FloatArray) -> InputError:
    """The first step that no clock has, and how many there are."""
    wrong, what = np.flatnonzero(steps < 0.0) + 1, "goes back"
    if not wrong.size:
        wrong, what = np.flatnonzero(steps == 0.0) + 1, "repeats the one before"
    if not wrong.size:
        short = _short(steps)
        row = int(np.argmax(steps)) + 1 if short is None else short
        wrong = np.array([row])
        what = f"is {steps[row - 1]:.6g} after the one before, {np.median(steps):.6g} is usual"
    row = int(wrong[0])
    others = f", and {wrong.size - 1:,} more such" if wrong.size > 1 else ""
    return InputError(
        f"{clock.place}, {clock.where(row)}: time stamp {clock.stamps[row]:.15g} {what}{others}, "
        "so that no even clock fits most of them",
        "clock",
        f"sort the rows or use a part with an even clock, or, {WAY_OUT}",
    )


def _short(steps: FloatArray) -> int | None:
    """First row after a step that rounding does not make so short."""
    bad = np.flatnonzero(~(steps >= tuning.SHORTEST_STEP * median(steps)))
    return int(bad[0]) + 1 if bad.size else None
