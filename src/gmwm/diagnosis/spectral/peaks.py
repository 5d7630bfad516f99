"""What rises above the smooth background of a spectrum."""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.spectral.lines import Line, find_lines
from gmwm.diagnosis.spectral.resonances import Bump, find_resonances
from gmwm.diagnosis.spectral.spectrum import background, bands, spectrum


def peaks(values: FloatArray, dt: float) -> tuple[tuple[Line, ...], tuple[Bump, ...]]:
    """Lines, and resonances of what they leave.

    values: (n,), samples, NaN where missing.
    dt: s.
    Returns: None of a series that is too short, or of which more than half is missing.
    """
    if (
        values.size < tuning.FEWEST_OF_SPECTRUM
        or np.count_nonzero(~np.isnan(values)) < values.size / 2
    ):
        return (), ()
    power = spectrum(values, dt)
    if not np.any(power.density > 0.0):
        return (), ()
    lines = find_lines(power, background(power, bands(power)))
    occupied = np.zeros(power.density.size, dtype=bool)
    for line in lines:
        margin = (line.stop - line.start) // 2
        occupied[max(line.start - margin, 0) : line.stop + margin] = True
    if 2 * np.count_nonzero(occupied) > occupied.size:
        return lines, ()  # a square wave: hardly anything is left to be a background
    rest = bands(power, occupied)
    return lines, find_resonances(power, rest, background(power, rest), occupied)
