"""Time stamps: the sampling rate, and the place of every row on an even grid."""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.typing import BoolArray, FloatArray, IntArray, median
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.readers import tuning
from gmwm.readers.columns import Roles
from gmwm.readers.grid import Grid, Jumps, NoGrid, find_grid, find_lattice
from gmwm.readers.names import bare, stated_seconds
from gmwm.readers.samples import Samples
from gmwm.readers.table import Columns, Table, more_such

# Names of units of time, by their seconds.
UNITS = {86400.0: "days", 3600.0: "hours", 60.0: "minutes", 1.0: "seconds"}
UNITS |= {1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}
_SHORT = dict(zip(UNITS, ("days", "h", "min", "s", "ms", "us", "ns"), strict=True))
_WAY_OUT = "if the samples are evenly spaced all the same, give the sensor's rate=HZ and time=False"
_CUT = f"cut the file at this row and use one part, or, {_WAY_OUT}"
_EXAMPLES = {"gyro": "deg/s", "accel": "g"}
_SHORTEST_SHOWN = 1e-3  # s; less is given in microseconds
_SHORTEST_STEP = 1e-100  # in any unit; shorter ones only leave the range of floating point
_DAY = 86400.0


@dataclass(frozen=True)
class Clock:
    """Time stamps of a recording."""

    source: str  # file, for messages
    column: str  # ``"column 't'"``
    stamps: FloatArray  # (n,), in a unit of ``seconds``
    seconds: float | None  # the unit; None if the header states none that is known
    own_unit: str  # the unit as the header states it
    where: Callable[[int], str]  # row -> its place in the file
    same: Callable[[IntArray], BoolArray]  # rows -> whether each has the samples of the one before
    origin: float = 0.0  # of the stamps, in their unit

    def error(self, row: int | None, text: str, hint: str = _WAY_OUT) -> InputError:
        """An error about the stamps, with the file, the column and the place."""
        place = "" if row is None else f", {self.where(row)}"
        rate = mean_rate(self.stamps, self.seconds)
        values: dict[str, float | str] = {} if rate is None else {"rate": rate}
        # Not an advice: the sensor's rate is higher by the share of the rows that are lost.
        if rate is not None and hint.endswith(_WAY_OUT):
            hint += f" (rows come at {rate:.6g} Hz on average)"
        text = f"{self.source}, {self.column}{place}: {text}"
        return InputError(text, "clock", hint, values)


@dataclass(frozen=True)
class Timing:
    """What time stamps say."""

    rate: float  # Hz, as the stamps have it
    jumps: Jumps  # where rows are missing
    notices: tuple[Notice, ...]  # the rate, its unit, the jitter, jumps, and what else is uneven
    jitter: float  # standard deviation of the steps, as a share of a step
    start: float  # s, of the first row on the grid


def usual_step(stamps: FloatArray) -> float:
    """Sampling interval of stamps: mean of usual steps, of all where many are none."""
    steps = np.diff(stamps)
    usual = median(steps)
    if np.min(steps) > 0.0 and (lattice := find_lattice(stamps)):
        return lattice.interval
    some = steps[(steps > 0.5 * usual) & (steps <= tuning.USUAL_STEP * usual)]
    return float(np.mean(some if np.quantile(steps, tuning.MANY_ALIKE) > 0.0 else steps))


def mean_rate(stamps: FloatArray, seconds: float | None) -> float | None:
    """Rate (Hz) of the rows over the time that they cover, in the digits that are sure.

    It is that of most parts of the recording: a gap, or a clock that is set, changes that of one.
    None if fewer than half have the same, or without a unit (s) where no sensor has such a rate.
    """
    there = np.flatnonzero(~np.isnan(stamps))
    if there.size < 2:
        return None
    edges = there[np.linspace(0, there.size - 1, tuning.RATE_PARTS + 1).astype(int)]
    unit, (least, most) = seconds or 1.0, tuning.PARTS_AGREE
    with np.errstate(all="ignore"):
        rows, spans = np.diff(edges), np.diff(stamps[edges]) * unit
        usual = np.median(spans / rows)
        tails = np.quantile(np.diff(stamps[there]), tuning.TAILS_OF_STEPS) * unit
        bound = 2.0 * np.ptp(tails) / np.min(rows) / usual
        alike = np.abs(spans / rows / usual - 1.0) <= max(bound, least)
    is_likely = seconds is not None or tuning.LEAST_STEP <= usual < tuning.LARGEST_STEP
    is_known = 0.0 <= bound < most and 2 * np.count_nonzero(alike) > alike.size
    if not (is_likely and is_known and usual > 0.0):
        return None
    span = float(np.sum(spans[alike]))
    digits = math.ceil(-math.log10(max(float(np.ptp(tails)) / span, 1e-6)))
    return float(f"{float(np.sum(rows[alike])) / span:.{max(digits, 3)}g}")


def agree(rate: float, other: float) -> bool:
    """Whether two rates are the same within 1 %."""
    return abs(rate / other - 1.0) <= tuning.RATES_AGREE


def timing_of(clock: Clock, expected: float | None = None) -> Timing:
    """Sampling rate over the whole recording, and the jumps; InputError if no even clock fits.

    Stamps without a unit are seconds where that gives the rate of an inertial sensor; for others a
    rate is asked for. With an expected rate (Hz), the unit is the one that fits it, or where the
    header states a unit that is unknown here, whatever makes it fit.
    """
    missing = np.flatnonzero(np.isnan(clock.stamps))
    if missing.size:
        text = f"no time stamp{more_such(missing.size)}"
        raise clock.error(int(missing[0]), text, f"remove such lines, or, {_WAY_OUT}")
    last, copies = list[Notice](), _copies(clock)
    kept = np.delete(np.arange(clock.stamps.size), copies) if copies.size else None
    if kept is not None:
        rows, where = kept, clock.where
        clock = replace(clock, stamps=clock.stamps[rows], where=lambda row: where(int(rows[row])))
        variant = "many" if copies.size > 1 else ""
        last.append(notice("rows-repeated", "", {"count": copies.size}, variant=variant))
    continued = _unwrapped(clock.stamps, clock.seconds or 1.0)
    if continued is not None:
        clock = replace(clock, stamps=continued)
        last.insert(0, notice("clock-wraps"))
    found = find_grid(clock.stamps)
    if isinstance(found, NoGrid):
        raise _not_even(clock, found)
    jumps = found.jumps
    if not _SHORTEST_STEP < jumps.interval < 1.0 / _SHORTEST_STEP:
        raise clock.error(None, f"steps of {jumps.interval:g} are impossible for a clock")
    seconds, is_guess = _unit(clock, jumps.interval, expected)
    _check_jumps(clock, found, seconds)
    rate = 1.0 / (jumps.interval * seconds)
    if expected is not None and not agree(rate, expected):
        guessed = without_unit(clock.source, clock.column, jumps.interval, expected)
        raise (guessed if is_guess and guessed else None) or InputError(
            f"{clock.source}, {clock.column}: its stamps give {rate:.6g} Hz, not the "
            f"given {expected:.6g} Hz",
            "rate-contradicted",
            "leave out the rate to use the stamps, or give time=False to ignore them",
        )
    notices = _notices(clock, found, seconds, is_guess=is_guess)
    is_told = expected is not None or not is_guess
    slowest, fastest = tuning.RATES_OF_SENSORS if is_told else tuning.RATES_OF_SECONDS
    are_seconds = tuning.LEAST_STEP <= jumps.interval < tuning.LARGEST_STEP
    if rate > fastest and are_seconds and clock.seconds is not None and expected is None:
        text = f"its steps are {1.0 / rate:.3g} s by the unit in its name, a rate of {rate:.6g} Hz"
        raise clock.error(
            None, text, f"write the unit it has, such as '{_name_of(clock.column)} [s]'"
        )
    if not slowest <= rate <= fastest:
        hint = "the time column states no unit: name it, such as 'time [s]' or 'time [ms]'"
        shown_hint = None if is_told else hint
        notices.append(notice("rate-unlikely", "", {"rate": rate}, hint=shown_hint))
    if kept is not None:
        jumps = replace(jumps, rows=kept[jumps.rows], repeated=copies)
    # One stamp may come late: the grid is where most of them are.
    steps = (clock.stamps - clock.stamps[0]) / jumps.interval
    first = float(clock.stamps[0]) + jumps.interval * median(steps - np.rint(steps))
    start = (clock.origin + first) * seconds
    return Timing(rate, jumps, (*notices, *last), found.jitter, start)


def _copies(clock: Clock) -> IntArray:
    """Rows, alone or in pieces, that were written again: they are the same as an earlier one."""
    none = np.empty(0, dtype=np.int64)
    if np.all(np.diff(clock.stamps) > 0.0):
        return none
    order = np.argsort(clock.stamps, kind="stable")
    again = np.diff(clock.stamps[order], prepend=np.nan) == 0.0
    beside = again & (np.diff(order, prepend=0) == 1)
    alike = int(np.count_nonzero(beside | np.append(beside[1:], False)))
    if 2 * alike > order.size or not np.any(again):
        return none  # bursts: coarse samples repeat by chance
    copies = again & clock.same(order)
    many = np.count_nonzero(copies) > tuning.COPIES * np.count_nonzero(again)
    return np.sort(order[copies]) if many else none


def _unwrapped(stamps: FloatArray, unit: float) -> FloatArray | None:
    """Stamps that began again after 16 or 32 bit, a day or a week, continued; None if none did."""
    with np.errstate(all="ignore"):
        steps = np.diff(stamps)
        back = np.flatnonzero(steps < 0.0)
        if not back.size:
            return None
        usual = median(steps)
        if usual == 0.0 and np.any(steps > 0.0):  # in bursts most are none
            usual = median(steps[steps > 0.0])
        for period in (2.0**16, 2.0**32, _DAY / unit, 7.0 * _DAY / unit):
            forward = steps[back] + period
            if usual > 0.0 and np.all((forward > 0.0) & (forward < tuning.LONGEST_OF_WRAP * usual)):
                wraps = np.zeros(stamps.size)
                wraps[back + 1] = period
                return np.asarray(stamps + np.cumsum(wraps))
    return None


def _not_even(clock: Clock, found: NoGrid) -> InputError:
    """The error about the first stamp that is on no grid."""
    if not found.stamp:
        early = "from here on stamps are early"
        if np.all(np.diff(clock.stamps) >= 0.0):
            text = f"{early}, as if they jittered by intervals or were rounded too coarsely"
            return clock.error(found.row, text)
        back = f"the clock goes back: {early}, or the rows are not in order"
        return clock.error(found.row, back, _CUT)
    stamp = f"time stamp {clock.stamps[found.row]:.15g} {found.stamp}{more_such(found.count)}"
    is_restart = found.count * tuning.FEWEST_SAMPLES < clock.stamps.size
    hint = _CUT if is_restart else f"sort the rows or use a part with an even clock, or, {_WAY_OUT}"
    return clock.error(found.row, f"{stamp}, so that no even clock fits most of them", hint)


def _unit(clock: Clock, step: float, expected: float | None) -> tuple[float, bool]:
    """The unit in seconds, and whether it is a guess."""
    if clock.seconds is not None:
        return clock.seconds, False
    if expected is not None and clock.own_unit:
        return 1.0 / expected / step, True
    if expected is not None:
        logs = {unit: abs(math.log(step * unit) + math.log(expected)) for unit in UNITS}
        return min(logs, key=lambda unit: logs[unit]), True
    if error := without_unit(clock.source, clock.column, step):
        raise error
    return 1.0, True


def _name_of(column: str) -> str:
    return bare(column[8:-1]) if column.endswith(("'", '"')) else "time"


def without_unit(
    source: str, column: str, step: float, expected: float | None = None
) -> InputError | None:
    """What stamps without a unit may be, and the rate stated; None if seconds of a sensor."""
    if tuning.LEAST_STEP <= step < tuning.LARGEST_STEP or not step > 0.0:
        return None
    slowest, fastest = tuning.RATES_OF_SENSORS
    rates = {unit: 1.0 / (step * unit) for unit in UNITS}
    likely = sorted(
        (unit for unit, rate in rates.items() if slowest <= rate <= fastest),
        key=lambda unit: abs(math.log(rates[unit]) - 0.5 * math.log(slowest * fastest)),
    )
    each = [f"{rates[unit]:.6g} Hz if they are {UNITS[unit]}" for unit in likely]
    each += [] if expected is None else [f"not the given {expected:.6g} Hz"]
    text = ", ".join([f"{source}, {column}: steps of {step:.6g} without a unit", *each])
    name = _name_of(column)
    rate, called = 100.0, "by its unit"
    if likely:
        rate, called = rates[likely[0]], repr(f"{name} [{_SHORT[likely[0]]}]")
    hint = f"name the column {called}, or give the sampling rate, rate={rate:.6g}"
    return InputError(text, "time-unit", hint, {"rate": rate, "column": called})


def _check_jumps(clock: Clock, found: Grid, seconds: float) -> None:
    """Reject a clock whose rate changes much, or whose jumps are not lost rows."""
    jumps, n = found.jumps, clock.stamps.size
    if found.is_lattice:
        half = np.abs(jumps.steps - 1.0 - jumps.missing) > tuning.HALF_WAY
        if np.count_nonzero(half) >= tuning.FEWEST_IN_RHYTHM:
            text = f"steps are half-way between multiples of {jumps.interval:.6g} here and later"
            row = int(jumps.rows[half][0])
            raise clock.error(row, f"{text}, as if the stamps were rounded too coarsely")
        return
    off_grid = int(np.count_nonzero(jumps.is_off_grid))
    if found.change is not None:
        first, then = (rate / seconds for rate in found.change.rates)
        if max(first / then, then / first) > tuning.SHARP_CHANGE:
            place = f"{clock.source}, {clock.column}, near {clock.where(found.change.row)}"
            text = f"{place}: the sampling rate goes from {first:.4g} to {then:.4g} Hz"
            raise InputError(text, "rate-changes", "cut the file there and use one part")
    if jumps.are_rounding or (found.uneven or jumps).have_rhythm:
        text = f"a step of two intervals, and {jumps.rows.size - 1:,} more such at even distances"
        raise clock.error(int(jumps.rows[0]), f"{text}, as if the stamps were rounded too coarsely")
    if off_grid > tuning.MOST_OFF_GRID * n and found.uneven is None:
        usual = f"the usual one of {jumps.interval:.6g}, so that the sampling rate is not known"
        text = f"{off_grid:,} of {n:,} steps are not near a whole number of {usual}"
        raise clock.error(None, text)
    if found.uneven is None and found.change is None and jumps.strays(clock.stamps):
        text = f"its steps differ at random from the usual one of {jumps.interval:.6g}, and the"
        text += " differences add up as if rows were lost"
        raise clock.error(None, text)
    if jumps.are_bursts:
        text = f"every {jumps.rows[1] - jumps.rows[0]} rows the clock steps by {jumps.steps[0]:.3g}"
        why = "rows are written in bursts, and stamps are times of writing, not of"
        raise clock.error(None, f"{text} of the usual steps: {why} sampling")
    if jumps.total > n:
        longest = int(np.argmax(jumps.missing))
        text = f"the clock jumps by {jumps.missing[longest]:,.6g} sampling intervals, and in all"
        text += f" {jumps.total:,.6g} samples are missing, with {n:,} present: more than half of"
        text += " the recording"
        raise clock.error(int(jumps.rows[longest]), text, _CUT)


def _notices(clock: Clock, found: Grid, seconds: float, *, is_guess: bool) -> list[Notice]:
    """The rate and the jitter, jumps, a change of the rate, and what is uneven."""
    jumps, jitter, uneven = found.jumps, found.jitter, found.uneven
    interval = jumps.interval * seconds
    rate, steps = 1.0 / interval, ""
    if jitter >= tuning.JITTER_SHOWN:
        rms = jitter * interval
        size = f"{rms:.3g} s" if rms >= _SHORTEST_SHOWN else f"{1e6 * rms:.3g} us"
        steps = f"; their steps vary by {size} rms ({100.0 * jitter:.2f} % of a step)"
    units = UNITS.get(seconds, clock.own_unit) + (", inferred from the steps" if is_guess else "")
    values = {"rate": rate, "unit": seconds, "jitter": jitter}
    notices = [notice("time-stamps", "", values, column=clock.column, units=units, steps=steps)]

    def when(row: int) -> float:
        return float(clock.stamps[row] - clock.stamps[0]) * seconds

    if count := jumps.rows.size:
        digits, far = 1 - math.floor(math.log10(interval)), int(np.argmax(jumps.missing))
        length = round(float(jumps.steps[far] - 1.0) * interval, digits)
        time = round(when(int(jumps.rows[far]) - 1), digits)
        values = {"count": count, "missing": jumps.total, "longest": length, "time": time}
        variant = "many" if count > 1 else ""
        notices.append(notice("clock-jumps", "", values, variant=variant))
    if off := int(np.count_nonzero(jumps.is_off_grid)):
        these = f"{off:,} of these jumps {'are' if off > 1 else 'is'}"
        which = these if count > 1 else "the jump is"
        notices.append(notice("clock-off-grid", "", {"count": off}, which=which))
    if found.change is not None:
        before, after = (each / seconds for each in found.change.rates)
        row, time = clock.where(found.change.row), when(found.change.row)
        values = {"before": before, "after": after, "rate": rate, "time": time}
        notices.append(notice("rate-changes", "", values, row=row))
    if uneven is not None and uneven.is_coarse:
        shared = clock.stamps.size / uneven.last.size
        notices.append(notice("stamps-coarse", "", {"rows": shared}))
    if uneven is not None and uneven.burst > 1:
        notices.append(notice("stamps-in-bursts", "", {"rows": uneven.burst}))
    if uneven is not None:
        astray = np.flatnonzero(np.abs(uneven.late) > tuning.ASTRAY + uneven.burst)
        if astray.size:
            worst = astray[np.argmax(np.abs(uneven.late[astray]))]
            values = {"count": astray.size, "largest": float(uneven.late[worst]) * interval}
            stamps = f"{astray.size:,} time stamp{'s are' if astray.size > 1 else ' is'}"
            place = clock.where(int(uneven.last[worst]))
            notices.append(notice("stamps-astray", "", values, stamps=stamps, place=place))
    return notices


def ask_for_unknown(table: Table, roles: Roles, stated: float | None) -> None:
    """Raise one InputError that asks for the rate and for the units that are not known.

    The steps of time stamps are looked at later, unless the units are to be asked for anyway.
    """
    time, missing = roles.time, roles.units.missing
    rate = None
    if time is None and stated is None:
        problem = f"{table.source} has no time column and no rate was given"
        rate = InputError(problem, "rate", "give it in Hz, e.g. rate=100", {"rate": 100.0})
    elif time is not None and stated is None:
        # Complain before a long file is read.
        seconds = stated_seconds(table.source, table.names[time])
        if missing and seconds is None:
            steps = np.diff(table.load([time])[time])
            usual = float(np.median(steps)) if steps.size else 0.0  # too few are reported later
            rate = without_unit(table.source, table.column(time), usual)
    if not missing:
        if rate is not None:
            raise rate
        return
    text = f"does not give the unit of {' and '.join(missing.values())}"
    codes = [f"{key}-unit-missing" if key in SI_UNIT else "unit-missing" for key in missing]
    examples = [f'"{key}": "{_EXAMPLES.get(key, "deg/s")}"' for key in missing]
    hint = f"units={{{', '.join(examples)}}}"
    if rate is None:
        it, code = "it" if len(codes) == 1 else "them", " ".join(dict.fromkeys(codes))
        raise InputError(f"{table.source} {text}", code, f"give {it}, e.g. {hint}")
    # The advice about a time column ends the advice of the command line.
    codes.insert(len(codes) if rate.code == "time-unit" else 0, rate.code)
    hint = f"give them, e.g. rate={rate.values['rate']:.6g}, {hint}"
    code = " ".join(dict.fromkeys(codes))
    raise InputError(f"{rate.problem}, and it {text}", code, hint, rate.values)


def timing_in(table: Table, roles: Roles, samples: Samples, stated: float | None) -> Timing | None:
    """What the time stamps say, checked against the stated rate if there is one."""
    if roles.time is None or samples.stamps is None:
        return None

    def same(order: IntArray) -> BoolArray:
        found = np.arange(order.size) > 0
        for values in (each[order] for each in samples.series.values()):
            both = np.isnan(values[1:]) & np.isnan(values[:-1])
            found[1:] &= (values[1:] == values[:-1]) | both
        return found

    found, column = table.meanings[roles.time], table.column(roles.time)
    stamps, odd = samples.stamps, list[Notice]()
    if stated is not None:
        odd.append(notice("rate-stated", "", {"rate": stated}))
    if found.seconds in (None, 1.0) and is_time_of_day(stamps):
        stamps = seconds_of_day(stamps)
        odd.append(notice("time-of-day"))
    unit = (found.seconds, found.stated)
    origin = table.origins.get(roles.time, 0.0)
    clock = Clock(table.source, column, stamps, *unit, table.where, same, origin)
    timing = timing_of(clock, stated)
    return replace(timing, notices=(*timing.notices, *odd))


def contradicted(table: Table, ignored: Columns, rate: float) -> tuple[Notice, ...]:
    """Say that stamps which are not used have another rate (Hz) than the given one."""
    for index, column in ignored.items():
        with suppress(ZeroDivisionError, ValueError):  # few stamps, or no step
            stamps = column[~np.isnan(column)]
            unit = table.meanings[index].seconds or 1.0
            known = mean_rate(stamps, unit) if np.min(np.diff(stamps)) < 0.0 else None
            mean = known or (stamps.size - 1) / (float(np.ptp(stamps)) * unit)
            own = 1.0 / (usual_step(stamps) * unit)
            if not (agree(rate, own) and agree(rate, mean)):
                values = {"rate": rate, "own": own, "mean": mean}
                return (notice("rate-ignores-stamps", "", values, column=table.column(index)),)
    return ()


# -- times of day ---------------------------------------------------------------------------------


def is_time_of_day(stamps: FloatArray) -> bool:
    """Whether stamps (n,), read as hhmmss.ss of NMEA 0183, pass minutes by a usual step."""
    minutes, seconds = np.divmod(stamps, 100.0)
    if not np.all((stamps >= 0.0) & (stamps < 240000.0) & (seconds < 60.0) & (minutes % 100 < 60)):
        return False
    turns = np.diff(minutes) != 0.0
    count = int(np.count_nonzero(turns))
    if not 0 < count < tuning.MOST_TURNS * turns.size:
        return False
    steps = np.diff(seconds_of_day(stamps))
    usual = median(steps[~turns], overwrite=True)
    even = np.abs(steps[turns] - usual) < 0.5 * abs(usual)
    return int(np.count_nonzero(even)) > 0.5 * count


def seconds_of_day(stamps: FloatArray) -> FloatArray:
    """Times of day, hhmmss.ss (n,), in seconds since the first midnight."""
    minutes, seconds = np.divmod(stamps, 100.0)
    hours, minutes = np.divmod(minutes, 100.0)
    # To the microsecond: that is what hhmmss.ss leaves.
    found = np.round(3600.0 * hours + 60.0 * minutes + seconds, 6)
    midnights = np.diff(found, prepend=found[:1]) < -0.5 * _DAY
    return np.asarray(found + _DAY * np.cumsum(midnights))
