"""Shapes of departures from stationary noise, as means of blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.calibration import tuning


@dataclass(frozen=True, eq=False)
class Family:
    """Departures of one kind.

    times: (G,), when, how long or how slow each member is, s.
    curves: (G, r, B), block means of the members at unit size; r curves where a phase is free.
    """

    kind: str
    times: FloatArray
    curves: FloatArray


def families(count: int, step: float) -> tuple[Family, ...]:
    """All kinds, for so many blocks of ``step`` seconds.

    Steps at all edges and middles of blocks; transients exp(-t/tau) with tau from one block to a
    third of the record; straight drifts that end after four blocks to two thirds of the record;
    periods of a half to a twenty-fourth of the record, faster ones are lines; and a straight drift
    of the whole record, with which the others compete.
    """
    edge = np.arange(count + 1.0)
    length = float(count)
    at = 0.5 * np.arange(2.0, 2.0 * count - 1.0)
    ramp = np.maximum(edge - at[:, None], 0.0)  # integral of a step
    constants = _ladder(1.0, length / 3.0)[:, None]
    ends = _ladder(4.0, length * 2.0 / 3.0)[:, None]
    cycles = np.arange(2.0, tuning.MOST_CYCLES, 0.25)
    phase = 2.0 * np.pi * cycles[:, None, None] / length * edge
    periods = np.concatenate([np.sin(phase), -np.cos(phase)], axis=1)
    periods *= length / (2.0 * np.pi * cycles[:, None, None])
    return (
        Family("step", at * step, _means(ramp)),
        Family("transient", constants[:, 0] * step, _means(-constants * np.exp(-edge / constants))),
        Family(
            "drift-at-start",
            ends[:, 0] * step,
            _means(-(np.maximum(ends - edge, 0.0) ** 2) / (2.0 * ends)),
        ),
        Family("slow-period", length * step / cycles, np.diff(periods, axis=-1)),
        Family("drift", np.array([length * step]), _means(0.5 * edge[None, :] ** 2 / length)),
    )


def _means(integrals: FloatArray) -> FloatArray:
    """Block means of curves from their integrals at the edges of blocks, (G, 1, B)."""
    return np.diff(integrals, axis=-1)[:, None, :]


def _ladder(low: float, high: float) -> FloatArray:
    """Numbers in even ratios."""
    count = max(round(np.log(high / low) / np.log(tuning.RATIO_OF_TIMES)), 1) + 1
    return np.geomspace(low, high, count)
