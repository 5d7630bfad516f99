"""Crosstalk between channels, and channels that follow the temperature."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt

from gmwm._core.distributions import norm, student
from gmwm._core.text import readable
from gmwm._core.typing import FloatArray, inner
from gmwm.diagnosis import tuning
from gmwm.diagnosis.drift import part_means
from gmwm.issues import Notice, Severity, notice
from gmwm.readers import Recording


def crosstalk_notices(errors: dict[str, npt.NDArray[np.float32]]) -> list[Notice]:
    """Find pairs of channels whose prediction errors are correlated.

    The correlation of two white series has the variance 1/n, whatever the spectra of the channels
    were; one that matters is above 0.05.

    errors: Channel name -> prediction errors in units of their standard deviation, clipped, zero
        where it is unknown, which adds nothing to a sum of products.
    """
    pairs = list(combinations(errors, 2))
    notices = []
    for one, other in pairs:
        a, b = errors[one], errors[other]
        n = int(np.count_nonzero((a != 0.0) & (b != 0.0)))
        if n < tuning.FEWEST_KNOWN:
            continue
        r = inner(a, b) / np.sqrt(inner(a, a) * inner(b, b))
        if abs(r) * np.sqrt(n) <= norm.isf(0.5 * tuning.FALSE_ALARM / len(pairs)):
            continue
        if abs(r) > tuning.CORRELATED:
            severity: Severity = "warning" if abs(r) > tuning.STRONGLY_CORRELATED else "note"
            values = {"correlation": r, "samples": float(n), "channels": f"{one}, {other}"}
            both = f"{one} and {other}"
            notices.append(notice("crosstalk", "", values, severity=severity, both=both))
    return notices


def temperature_notices(recording: Recording) -> list[Notice]:
    """Find channels that follow a temperature channel, each with the one it follows most closely.

    Changes from one of 64 parts of the record to the next are correlated: what only drifts in
    the same direction does not count.
    """
    thermometers = [c for c in recording.values() if c.quantity == "temperature"]
    if recording.n < tuning.PARTS * tuning.SHORTEST_PART or not thermometers:
        return []
    pairs = len(thermometers) * len(recording.inertial)
    # Thermometers are often slower than the other sensors.
    warmer = {c.name: np.diff(part_means(c.values, least=0.0)) for c in thermometers}
    notices = []
    for channel in recording.inertial:
        step = np.diff(part_means(channel.values))
        found = [
            (size, r, slope, thermometer)
            for thermometer in thermometers
            for size, r, slope in _correlation(warmer[thermometer.name], step, pairs)
        ]
        if found:
            _, r, slope, thermometer = max(found, key=lambda one: one[0])
            values = {"correlation": r, "slope": slope}
            per = f"{readable(slope, channel.unit)} per {thermometer.unit or 'unit'}"
            notices.append(
                notice("temperature", channel.name, values, name=thermometer.name, per=per)
            )
    return notices


def _correlation(
    warmer: FloatArray, step: FloatArray, pairs: int
) -> list[tuple[float, float, float]]:
    """Student's t, correlation and slope, if there is a correlation."""
    known = ~np.isnan(warmer + step)
    n = int(np.count_nonzero(known))
    if n < tuning.FEWEST_PARTS or np.std(warmer[known]) == 0.0 or np.std(step[known]) == 0.0:
        return []
    r = float(np.corrcoef(warmer[known], step[known])[0, 1])
    size = abs(r) * np.sqrt((n - 2) / max(1.0 - r**2, 1e-12))
    if size <= student.isf(0.5 * tuning.FALSE_ALARM / pairs, n - 2):
        return []
    return [(float(size), r, float(np.polyfit(warmer[known], step[known], 1)[0]))]
