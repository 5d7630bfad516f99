"""What there is to say of a clock: its jumps, its shifts, and what else is uneven."""

from __future__ import annotations

import math

import numpy as np

from gmwm._core.notices import Notice
from gmwm.readers import tuning
from gmwm.readers.clock.jumps import Jumps, find_shifts
from gmwm.readers.clock.stamps import Clock, repeated_notice
from gmwm.readers.clock.uneven import Followed

CLOCK_CODES = frozenset(
    {
        "clock-jumps",
        "clock-off-grid",
        "clock-set",
        "clock-shifts",
        "rate-changes",
        "rows-repeated",
        "stamps-astray",
    }
)
"""Codes of notices of what happens at some rows of a clock, all of which they tell of."""


def change_notice(
    rates: tuple[float, float], used: float, row: str, time: float | None = None
) -> Notice:
    """That the sampling rate changes.

    rates: Before and after, Hz.
    used: The rate that is taken, Hz.
    row: Where that is, in words.
    time: When, s, if that is known.
    """
    first, then = rates
    when = f"near {row}" if time is None else f"at about {time:.4g} s"
    text = (
        f"the sampling rate goes from {first:.4g} to {then:.4g} Hz {when}, and "
        f"{used:.6g} Hz is taken for all of it"
    )
    values = {"before": first, "after": then, "rate": used}
    values |= {} if time is None else {"time": time}
    hint = f"use the part before or after ({row})"
    return Notice("rate-changes", "bad", "", text, values, hint)


def jump_notices(clock: Clock, jumps: Jumps, seconds: float) -> list[Notice]:
    """When the clock jumps, how far, and how many samples that costs."""
    if not jumps.rows.size:
        return []
    count, i = jumps.rows.size, jumps.longest
    interval = jumps.interval * seconds
    digits = 1 - math.floor(math.log10(interval))
    length = round(float(jumps.steps[i] - 1.0) * interval, digits)
    when = round(clock.when(int(jumps.rows[i]) - 1, seconds), digits)
    notices = [_jump_notice(count, jumps.total, length, when)]
    if jumps.off_grid:
        which = (
            "the jump is"
            if count == 1
            else f"{jumps.off_grid:,} of these jumps {'are' if jumps.off_grid > 1 else 'is'}"
        )
        text = (
            f"{which} not near a whole number of sampling intervals: the samples after it "
            "were placed at the nearest"
        )
        values = {"count": jumps.off_grid}
        notices.append(Notice("clock-off-grid", "note", "", text, values))
    return notices


def _jump_notice(count: int, missing: float, length: float, when: float) -> Notice:
    """How often the clock jumps, and where it does so farthest, s."""
    total = f"{missing:,.0f} sample{'s' if missing > 1.0 else ''} missing"
    place = f"by {length:.12g} s, {when:.12g} s after the start"
    if count == 1:
        text = f"the clock jumps {place}: {total}"
    else:
        text = f"the clock jumps {count:,} times, farthest {place}: in all {total}"
    values = {"count": count, "missing": missing, "longest": length, "time": when}
    return Notice("clock-jumps", "note", "", text, values)


def uneven_notices(clock: Clock, found: Followed, jumps: Jumps, seconds: float) -> list[Notice]:
    """Bursts, rows that come twice, stamps far from the clock, and a clock that was set."""
    notices = []
    if found.burst > 1:
        text = (
            f"{found.burst} rows come with one stamp, usually: it is taken as that of the last "
            "of them, and the others are one sampling interval apart"
        )
        notices.append(Notice("stamps-in-bursts", "note", "", text, {"rows": found.burst}))
    if count := jumps.repeated.size:
        notices.append(repeated_notice(count))
    astray = np.flatnonzero(np.abs(found.late) > tuning.ASTRAY + found.burst)
    if astray.size:
        worst = astray[np.argmax(np.abs(found.late[astray]))]
        by = float(found.late[worst]) * jumps.interval * seconds
        text = (
            f"{astray.size:,} time stamp{'s are' if astray.size > 1 else ' is'} far from the "
            f"clock, at most by {by:.3g} s ({clock.where(int(worst))}): the samples were taken "
            "as evenly spaced"
        )
        notices.append(
            Notice("stamps-astray", "note", "", text, {"count": astray.size, "largest": by})
        )
    if count := jumps.set_at.size:
        far = (clock.stamps[jumps.set_at] - clock.stamps[jumps.set_at - 1]) * seconds
        first, largest = int(jumps.set_at[0]), float(far[np.argmax(np.abs(far))])
        times = "once" if count == 1 else f"{count:,} times"
        text = (
            f"the clock was set {times}, farthest by {largest:+.6g} s, first at "
            f"{clock.where(first)}: the samples were taken as evenly spaced there"
        )
        numbers = {"count": float(count), "largest": largest}
        hint = "if samples are missing there, use the part before or after"
        notices.append(Notice("clock-set", "warning", "", text, numbers, hint))
    return notices


def shift_notices(clock: Clock, jumps: Jumps, seconds: float) -> list[Notice]:
    """Where the clock was set by less than what is followed, or while the host stalled."""
    found = find_shifts(clock.stamps, jumps)
    if not found:
        return []
    row, by = max(found, key=lambda each: abs(each[1]))
    count = f"at {len(found)} places, farthest" if len(found) > 1 else ""
    text = (
        f"the clock shifts {count} by {by * jumps.interval * seconds:+.3g} s ({by:+.2g} "
        f"sampling intervals) near {clock.where(row)}: the samples were taken as evenly "
        "spaced there"
    )
    values = {"count": len(found), "largest": by * jumps.interval * seconds, "row": row}
    hint = "if samples are missing there, use the part before or after"
    return [Notice("clock-shifts", "warning", "", " ".join(text.split()), values, hint)]
