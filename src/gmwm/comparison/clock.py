"""Whether the clocks of two recordings differ: lines, resonances and densities that scale together.

A recording whose rate is stated r times too high has all of its frequencies r times too high, and
its noise density N, which is per root of hertz, by 1/sqrt(r) too low. A line that moved alone is
one of an engine, and so are its harmonics.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from gmwm._core.notices import Notice, Severity
from gmwm.calibration import Calibration, white_density
from gmwm.comparison import tuning

_KINDS = {"Sinusoid": "line", "Resonance": "resonance"}


@dataclass(frozen=True)
class Feature:
    """A line or a resonance of a channel.

    kind: {"line", "resonance"}.
    frequency: Hz.
    """

    channel: str
    kind: str
    frequency: float


@dataclass(frozen=True)
class ClockRatio:
    """A suspected ratio of the clocks of two recordings.

    ratio: Frequencies of the second over those of the first.
    frequencies: Of distinct lines and resonances in the first and the second recording, Hz.
    others: Distinct lines and resonances that moved otherwise.
    densities: Median over the channels of N in the second over N in the first; 1/sqrt(ratio) if the
        clock is all.
    channels: How many channels have one.
    """

    ratio: float
    frequencies: tuple[tuple[float, float], ...]
    others: int
    densities: float
    channels: int

    @property
    def expected_densities(self) -> float:
        """What `densities` would be if nothing but the clock differed."""
        return float(self.ratio**-0.5)


def suspected_clocks(calibrations: Mapping[str, Calibration]) -> list[Notice]:
    """Ratios of clocks that recordings suggest, to that of the recording that has fewest."""
    known = {label: features(each) for label, each in calibrations.items()}
    found: dict[tuple[str, str], ClockRatio] = {}
    for a, b in combinations(calibrations, 2):
        if known[a] and known[b]:
            changes = _densities(calibrations[a], calibrations[b])
            ratio = clock_ratio(known[a], known[b], changes)
            if ratio is not None:
                found[a, b] = ratio
    if not found:
        return []
    reference = min(calibrations, key=lambda label: sum(label in pair for pair in found))
    own = {pair: ratio for pair, ratio in found.items() if reference in pair} or found
    return [_notice(*pair, ratio) for pair, ratio in own.items()]


def _notice(a: str, b: str, found: ClockRatio) -> Notice:
    shown = ", ".join(f"{f:.4g} -> {g:.4g}" for f, g in found.frequencies)
    others = f"{found.others} other{'s' * (found.others > 1)}"
    rest = f" ({others} moved otherwise)" if found.others else ""
    expected = found.expected_densities
    text = (
        f"its clock may differ by a factor of {found.ratio:.4f} from that of {a}: lines and "
        f"resonances {shown} Hz{rest}, N {found.densities:.4f} times ({expected:.4f} expected; "
        f"median of {found.channels} channels)"
    )
    values = {
        "ratio": found.ratio,
        "reference": a,
        "lines": len(found.frequencies),
        "others": found.others,
        "densities": found.densities,
        "expected": expected,
    }
    # What moved otherwise is no clock, so the rest may be none either.
    severity: Severity = "note" if found.others else "warning"
    return Notice("clock-ratio", severity, "", text, values, "check the rates of both", b)


def _densities(first: Calibration, second: Calibration) -> dict[str, float]:
    """N of the second recording over N of the first, by channel; lines have no part in it."""
    found = {}
    for name in (name for name in first if name in second):
        before, after = white_density(first[name]), white_density(second[name])
        if before > 0.0 and after > 0.0:
            found[name] = after / before
    return found


def features(calibration: Calibration) -> tuple[Feature, ...]:
    """Lines and resonances of the models and of what was found in the recording."""
    found: list[Feature] = []
    for name, fit in calibration.items():
        for term in fit.model.terms:
            kind, frequency = _KINDS.get(type(term).__name__), term.values.get("frequency")
            if kind and frequency:
                found.append(Feature(name, kind, frequency))
    for notice in calibration.notices:
        frequency = notice.values.get("frequency")
        if notice.code in _KINDS.values() and frequency and notice.where in calibration:
            new = Feature(notice.where, notice.code, float(frequency))
            if not any(_is_same(new, each) for each in found):
                found.append(new)
    return tuple(found)


def clock_ratio(
    first: Sequence[Feature], second: Sequence[Feature], densities: Mapping[str, float]
) -> ClockRatio | None:
    """A ratio by which everything that has a frequency moved, if there is one.

    densities: Channel -> N of the second recording over N of the first.
    """
    pairs = [
        (a.frequency, b.frequency)
        for a in first
        for b in second
        if (a.channel, a.kind) == (b.channel, b.kind) and abs(_log(a, b)) < _LARGEST
    ]
    if any(abs(np.log(b / a)) < tuning.SMALLEST_CLOCK for a, b in pairs) or not densities:
        return None  # something stayed where it was
    changes = np.log(list(densities.values()))
    best: ClockRatio | None = None
    for a, b in pairs:
        shift = float(np.log(b / a))
        # Of the lines at one place any may be the one that moved there; each counts once.
        moved = _distinct(p for p in pairs if abs(np.log(p[1] / p[0]) - shift) < tuning.SAME_CLOCK)
        ratio = float(np.exp(np.mean([np.log(q / p) for p, q in moved])))
        expected = -0.5 * np.log(ratio)
        nearer = abs(float(np.median(changes)) - expected) < tuning.DENSITY_PART * abs(expected)
        follow = np.abs(changes - expected) < tuning.FOLLOWS * abs(expected)
        alone = len(moved) == 1
        is_shown = follow.all() and follow.size >= tuning.FEWEST_DENSITIES if alone else nearer
        if is_shown and (best is None or len(moved) > len(best.frequencies)):
            rest = {p for p in pairs if not any(_is_near(p[0], q[0]) for q in moved)}
            others = len(_distinct(rest))
            middle = float(np.exp(np.median(changes)))
            best = ClockRatio(ratio, moved, others, middle, changes.size)
    return best


_LARGEST = float(np.log(tuning.LARGEST_CLOCK))


def _is_near(a: float, b: float) -> bool:
    return bool(abs(np.log(a / b)) < tuning.DISTINCT)


def _log(a: Feature, b: Feature) -> float:
    return float(np.log(b.frequency / a.frequency))


def _is_same(a: Feature, b: Feature) -> bool:
    same = (a.channel, a.kind) == (b.channel, b.kind)
    return same and abs(_log(a, b)) < tuning.DISTINCT


def _distinct(pairs: Iterable[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Pairs of frequencies; those of one line in several channels once."""
    found: list[tuple[float, float]] = []
    for pair in sorted(pairs):
        if not found or np.log(pair[0] / found[-1][0]) > tuning.DISTINCT:
            found.append(pair)
    return tuple(found)
