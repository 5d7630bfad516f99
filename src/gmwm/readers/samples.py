"""The samples of the columns that a recording needs, as it keeps them."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from gmwm._core import memory
from gmwm._core.spool import Spool, scaled
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.issues import Notice, Severity, notice
from gmwm.readers import tuning
from gmwm.readers.columns import AuxiliaryColumn, Roles
from gmwm.readers.table import Columns, Table

_CODES = {float(sign * (10**k - 1)) for k in range(3, 8) for sign in (-1, 1)} | {-999.25, -99.99}
_ENDS = {
    float(end): bits
    for bits in (64, 32, 24, 16)
    for end in (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1, 2**bits - 1)
}
_ODD = np.array([*_CODES, *_ENDS])


@dataclass(frozen=True)
class Samples:
    """What is read of a table."""

    series: dict[str, FloatArray]  # of each channel, (n,), in the unit as kept; NaN where missing
    auxiliary: Sequence[AuxiliaryColumn]  # those of them that are auxiliary
    stamps: FloatArray | None  # (n,), of the time column, in its own unit
    ignored: Columns  # those of the column that the caller ignores
    unreadable: Sequence[Notice]  # auxiliary channels that are left out
    masked: Sequence[Notice]  # numbers that are no samples


def samples_of(table: Table, roles: Roles) -> Samples:
    """Read the columns, mask what is no sample, and convert the units.

    Auxiliary columns that cannot be read or have another length are left out.
    """
    wanted = {*roles.columns, *(column.index for column in roles.auxiliary)}
    kept, notices = list(roles.auxiliary), list[Notice]()
    try:
        arrays = load_columns(table, sorted(wanted))
    except InputError:
        if not roles.auxiliary:
            raise
        arrays, kept = load_columns(table, roles.columns), []
        n = arrays[roles.columns[0]].size
        for column in roles.auxiliary:
            with suppress(InputError):
                values = load_columns(table, [column.index])[column.index]
                if values.size == n:
                    arrays[column.index] = values
                    kept.append(column)
        names = ", ".join(repr(column.name) for column in roles.auxiliary if column not in kept)
        what = f"auxiliary channels that cannot be read, or have another length ({names})"
        notices.append(notice("columns-unreadable", what=what))
    n = arrays[roles.columns[0]].size
    most = max(n - int(np.count_nonzero(np.isnan(arrays[i]))) for i in roles.channels.values())
    if most < tuning.FEWEST_SAMPLES:
        of_any = "" if most == n else " of any channel"
        text = f"{table.source} has {most} samples{of_any}"
        least = f"needs at least {tuning.FEWEST_SAMPLES}"
        raise InputError(f"{text}, but {least}: record longer")
    ignored: Columns = {}
    if roles.ignored is not None:
        with suppress(InputError):
            ignored = load_columns(table, [roles.ignored])
    masked = list[Notice]()
    for name, index in roles.channels.items():
        largest = tuning.BEYOND_SENSORS / roles.units.known[name].scale
        arrays[index], found = without_sentinels(name, arrays[index], largest, table.where)
        masked += found
    series = {name: arrays[index] for name, index in roles.channels.items()}
    series |= {column.name: arrays[column.index] for column in kept}
    stamps = None if roles.time is None else arrays[roles.time]
    arrays.clear()  # the converted ones take their places one by one
    unit_of = roles.units.known | {column.name: column.unit for column in kept}
    for name, unit in unit_of.items():
        series[name] = scaled(series[name], unit.scale, unit.offset)
    return Samples(series, kept, stamps, ignored, notices, masked)


def load_columns(table: Table, columns: Sequence[int]) -> Columns:
    """Read some columns; those of a file beyond `gmwm._core.memory.held` are mapped from disk."""
    try:
        with memory.limited(memory.held()):
            return table.load(columns)
    except InputError as error:
        if error.code != "memory":
            raise
    spools = {column: Spool(1) for column in columns}
    with memory.limited(max(memory.budget() / (1 << 30), tuning.GIGABYTES_OF_BLOCK)):
        for block in table.segments(columns, tuning.ROWS_OF_BLOCK):
            for column, values in block.items():
                spools[column].append(values)
    if not spools[columns[0]].n:
        raise InputError(f"{table.source} holds no samples: record longer")
    return {column: spool.array()[:, 0] for column, spool in spools.items()}


def without_sentinels(
    name: str, values: FloatArray, largest: float, where: Callable[[int], str]
) -> tuple[FloatArray, list[Notice]]:
    """Mask numbers that are no samples, and report them; a copy if there is any.

    These are numbers beyond the range of any sensor; error codes (999, -9999, ...) and the smallest
    and largest integers of 16 to 64 bit, if far outside all others; and numbers that come again and
    again, exactly, with nothing between them and the others.

    largest: Magnitude beyond the range of any sensor, in the unit of the file.
    where: Row -> its place in the file.
    """
    some = values[:: -(-values.size // tuning.SAMPLED_FOR_RANGE)]
    some = some[~np.isnan(some)]
    # The range is that of samples: codes among them would make it as wide as themselves.
    usual = some[(np.abs(some) <= largest) & np.isfinite(some) & ~np.isin(some, _ODD)]
    if not usual.size:
        return values, []
    low, first, middle, third, high = np.quantile(usual, [0.05, 0.25, 0.5, 0.75, 0.95])
    width = high - low
    # Codes without a meaning are among the usual ones: a quarter of the samples at most.
    narrow = min(tuning.OF_QUARTILES * (third - first), width) if third > first else width
    reach = tuning.FAR_OUTSIDE * narrow
    # Almost always, and without arrays as long as the values.
    if np.fmax.reduce(values) <= middle + reach and np.fmin.reduce(values) >= middle - reach:
        return values, []
    far = np.flatnonzero(np.abs(values - middle) > reach)
    numbers, which = np.unique(values[far], return_inverse=True)
    chosen = np.array([_meaning(each, largest) != "" for each in numbers.tolist()])
    chosen &= np.abs(numbers - middle) > tuning.FAR_OUTSIDE * width
    if narrow > 0.0:
        chosen |= _are_isolated(values, far, numbers, which, middle)
    gone = far[chosen[which]]
    if not gone.size:
        return values, []
    most = tuning.MOST_SENTINELS * values.size
    severity: Severity = "bad" if gone.size > most else "warning"
    notices = []
    own = [[i] for i in np.flatnonzero(chosen & (np.abs(numbers) <= largest)).tolist()]
    beyond = np.flatnonzero(chosen & (np.abs(numbers) > largest)).tolist()
    for group in [*own, beyond] if beyond else own:
        rows = far[np.isin(which, group)]
        number = max(numbers[group].tolist(), key=abs)
        data = {"count": rows.size, "value": number, "row": int(rows[0])}
        words: dict[str, Any] = {
            "samples": f"{rows.size:,} samples are" if rows.size > 1 else "a sample is",
            "alike": " and the like" if len(group) > 1 else "",
            "meaning": _meaning(number, largest) or "far from all others with nothing between",
            "place": where(int(rows[0])),
        }
        notices.append(notice("sentinel", name, data, severity=severity, **words))
    clean = scaled(values, 1.0)
    clean[gone] = np.nan
    return clean, notices


def _are_isolated(
    values: FloatArray, far: IntArray, numbers: FloatArray, which: IntArray, middle: float
) -> BoolArray:
    """Whether each number comes several times, and from nowhere: motion passes through others."""
    counts = np.bincount(which, minlength=numbers.size)
    again = counts >= tuning.LEAST_REPEATS
    if not np.any(again):
        return again
    # Beside another code, or the same one, is no transition. A sensor at the end of its range stays
    # there: transitions are counted at the ends of each run of equal numbers.
    passing = np.zeros(values.size + 2, dtype=bool)
    passing[far + 1] = ~again[which]
    begins = np.diff(far, prepend=-2) > 1
    begins[1:] |= np.diff(which) != 0
    runs = np.bincount(which, begins, minlength=numbers.size)
    transitions = np.bincount(which, passing[far] | passing[far + 2], minlength=numbers.size)
    again &= transitions <= tuning.TRANSITIONS * runs
    others = np.sort(values[far[~again[which]]])
    reach = 0.5 * np.abs(numbers - middle)
    near = np.searchsorted(others, numbers + reach) - np.searchsorted(others, numbers - reach)
    return np.asarray(again & (near <= tuning.TRANSITIONS * counts))


def _meaning(number: float, largest: float) -> str:
    """What a number stands for; empty for a number like others."""
    if number in _ENDS:
        end = "largest" if number > 0.0 else "smallest"
        return f"the {end} integer of {_ENDS[number]} bit"
    if number in _CODES:
        return "an error code"
    return "beyond the range of any sensor" if abs(number) > largest else ""
