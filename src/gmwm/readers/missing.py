"""Samples that are missing, and numbers that stand for a missing sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gmwm._core.spool import scaled
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.issues import Notice, Severity, notice
from gmwm.readers import tuning

_CODES = {float(sign * (10**k - 1)) for k in range(3, 8) for sign in (-1, 1)} | {-999.25, -99.99}
_ENDS = {
    float(end): bits
    for bits in (64, 32, 24, 16)
    for end in (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1, 2**bits - 1)
}
_ODD = np.array([*_CODES, *_ENDS])


@dataclass(frozen=True)
class Missing:
    """How many samples of a series are missing."""

    n: int = 0  # samples, missing ones included
    samples: int = 0  # missing samples
    # gaps, longest: runs of missing samples, and the length of the longest.
    gaps: int = 0
    longest: int = 0

    @classmethod
    def of(cls, values: FloatArray) -> Missing:
        """Count NaN."""
        gone = np.isnan(values)
        edges = np.flatnonzero(np.diff(gone, prepend=False, append=False))
        lengths = edges[1::2] - edges[::2]
        longest = int(np.max(lengths, initial=0))
        return cls(gone.size, int(np.sum(lengths)), lengths.size, longest)


def missing_notices(found: Mapping[str, Missing]) -> list[Notice]:
    """One for all channels that miss equally many samples in equally many gaps."""
    notices = []
    for each in dict.fromkeys(each for each in found.values() if each.samples):
        names = [name for name, other in found.items() if other == each]
        variant = "all" if each.samples == each.n else "many" if each.gaps > 1 else "one"
        values = {"missing": each.samples, "gaps": each.gaps, "longest": each.longest}
        where, them = ", ".join(names), "each " if len(names) > 1 else ""
        notices.append(
            notice("missing-samples", where, values, variant=variant, n=each.n, each=them)
        )
    return notices


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
    clean = scaled(values, 1.0)
    clean[gone] = np.nan
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
