"""Numbers that stand for no sample: error codes, overflows, the ends of an integer's range."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gmwm._core.notices import Notice, Severity
from gmwm._core.spool import scaled
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.readers import tuning

_CODES = {float(sign * (10**k - 1)) for k in range(3, 8) for sign in (-1, 1)} | {-999.25, -99.99}
_ENDS = {
    float(end): bits
    for bits in (64, 32, 24, 16)
    for end in (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1, 2**bits - 1)
}
_ODD = np.array([*_CODES, *_ENDS])

_ISOLATED = "far from all others with nothing between"


def without_sentinels(
    name: str, values: FloatArray, largest: float, where: Callable[[int], str]
) -> tuple[FloatArray, list[Notice]]:
    """Make missing what is no sample, and report it.

    That is a number beyond the range of any sensor, or far outside all others and an error code
    (999, -9999, ...) or the smallest or largest integer of 16, 24, 32 or 64 bit, or one that comes
    again and again, exactly, with nothing between it and the others: what moves passes through.

    name: Of the channel.
    values: (n,), in the unit of the file; NaN where one is missing.
    largest: Magnitude beyond the range of any sensor, in the same unit.
    where: Row -> where that is in the file.
    Returns: a copy if any number is made missing, else ``values``; list of Notice, one for each
        number that occurs, of code "sentinel".
    """
    some = values[:: -(-values.size // tuning.SAMPLED_FOR_RANGE)]
    some = some[~np.isnan(some)]
    if not some.size:
        return values, []
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
    severity: Severity = "bad" if gone.size > tuning.MOST_SENTINELS * values.size else "warning"
    clean = scaled(values, 1.0)
    clean[gone] = np.nan
    notices = []
    beyond = [i for i in np.flatnonzero(chosen).tolist() if abs(numbers[i]) > largest]
    others = [i for i in np.flatnonzero(chosen).tolist() if i not in beyond]
    for group in (*([i] for i in others), beyond):
        if not group:
            continue
        rows = far[np.isin(which, group)]
        number = float(numbers[group[int(np.argmax(np.abs(numbers[group])))]])
        count = rows.size
        times = f"{count:,} samples are" if count > 1 else "a sample is"
        also = " and the like" if len(group) > 1 else ""
        text = (
            f"{times} {number:.10g}{also}, {_meaning(number, largest) or _ISOLATED}, first at "
            f"{where(int(rows[0]))}: taken as missing"
        )
        data = {"count": int(count), "value": number, "row": int(rows[0])}
        notices.append(Notice("sentinel", severity, name, text, data, "look at the recorder"))
    return clean, notices


def _are_isolated(
    values: FloatArray, far: IntArray, numbers: FloatArray, which: IntArray, middle: float
) -> BoolArray:
    """Which of the numbers that are far outside come several times, and from nowhere.

    The samples before and after are none that are far outside, and hardly any other lies within
    half of the distance to the middle.
    """
    counts = np.bincount(which, minlength=numbers.size)
    again = counts >= tuning.LEAST_REPEATS
    if not np.any(again):
        return again
    is_far = np.zeros(values.size + 2, dtype=bool)
    is_far[far + 1] = True
    # Beside another code, or the same one, is no transition.
    repeated = np.zeros(values.size + 2, dtype=bool)
    repeated[far + 1] = again[which]
    passing = is_far & ~repeated
    beside = passing[far] | passing[far + 2]
    transitions = np.bincount(which, beside, minlength=numbers.size)
    again &= transitions <= tuning.TRANSITIONS * counts
    others = np.sort(values[far[~again[which]]])
    reach = 0.5 * np.abs(numbers - middle)
    near = np.searchsorted(others, numbers + reach) - np.searchsorted(others, numbers - reach)
    return np.asarray(again & (near <= tuning.TRANSITIONS * counts))


def _meaning(number: float, largest: float) -> str:
    """What a number stands for; nothing if it is one like others."""
    if number in _ENDS:
        end = "largest" if number > 0.0 else "smallest"
        return f"the {end} integer of {_ENDS[number]} bit"
    if number in _CODES:
        return "an error code"
    return "beyond the range of any sensor" if abs(number) > largest else ""
