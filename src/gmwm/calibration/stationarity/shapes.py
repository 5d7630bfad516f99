"""Shapes of departures from stationary noise, as means of blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray, IntArray
from gmwm.calibration import tuning


@dataclass(frozen=True, eq=False)
class Family:
    """Departures of one kind.

    times: (G, 1), when, how long or how slow each member is, s; (G, 2) of a pulse, which is a step
        and the same back.
    curves: (M, B), block means at unit size.
    members: (G, r), the curves of each.
    """

    kind: str
    times: FloatArray
    curves: FloatArray
    members: IntArray

    @classmethod
    def of(cls, kind: str, times: FloatArray, curves: FloatArray) -> Family:
        """Of members that have their curves to themselves, (G, B) or (G, r, B)."""
        members = np.arange(curves.size // curves.shape[-1]).reshape(len(times), -1)
        return cls(kind, times[:, None], curves.reshape(-1, curves.shape[-1]), members)

    def within(self, low: float, high: float) -> Family:
        """Its members of times between two."""
        some = np.all((low <= self.times) & (high >= self.times), axis=1)
        return Family(self.kind, self.times[some], self.curves, self.members[some])

    @property
    def is_pulse(self) -> bool:
        """Whether each member is a step and the same back."""
        return self.times.shape[1] == 2

    @property
    def has_phase(self) -> bool:
        """Whether each member is a cosine and a sine."""
        return self.members.shape[1] > self.times.shape[1]

    @property
    def rank(self) -> int:
        """Sizes that are free in the search: a pulse has one, up and back."""
        return 2 if self.has_phase else 1


def families(count: int, step: float) -> tuple[Family, ...]:
    """All kinds, for so many blocks of ``step`` seconds.

    Steps at all edges and middles of blocks; transients exp(-t/tau) with tau from one block to a
    third of the record; straight drifts that end after four blocks to two thirds of the record;
    periods of twice to a twenty-fourth of the record, faster ones are lines; a step and the same
    back at edges of blocks, neither of which may be evident alone; and a straight drift of the
    whole record, with which the others compete.
    """
    edge = np.arange(count + 1.0)
    length = float(count)
    at = 0.5 * np.arange(2.0, 2.0 * count - 1.0)
    ramp = np.maximum(edge - at[:, None], 0.0)  # integral of a step
    constants = _ladder(1.0, length / 3.0)[:, None]
    ends = _ladder(4.0, length * 2.0 / 3.0)[:, None]
    cycles = np.arange(tuning.FEWEST_CYCLES, tuning.MOST_CYCLES, 0.25)
    phase = 2.0 * np.pi * cycles[:, None, None] / length * edge
    periods = np.concatenate([np.sin(phase), -np.cos(phase)], axis=1)
    periods *= length / (2.0 * np.pi * cycles[:, None, None])
    steps, whole = np.diff(ramp), at[::2] * step
    pairs = np.transpose(np.triu_indices(whole.size, 1))
    return (
        Family.of("step", at * step, steps),
        Family.of(
            "transient", constants[:, 0] * step, np.diff(-constants * np.exp(-edge / constants))
        ),
        Family.of(
            "drift-at-start",
            ends[:, 0] * step,
            np.diff(-(np.maximum(ends - edge, 0.0) ** 2) / (2.0 * ends)),
        ),
        Family.of("slow-period", length * step / cycles, np.diff(periods)),
        Family("step", whole[pairs], steps[::2], pairs),
        Family.of("drift", np.array([length * step]), np.diff(0.5 * edge[None, :] ** 2 / length)),
    )


def _ladder(low: float, high: float) -> FloatArray:
    """Numbers in even ratios."""
    count = max(round(np.log(high / low) / np.log(tuning.RATIO_OF_TIMES)), 1) + 1
    return np.geomspace(low, high, count)
