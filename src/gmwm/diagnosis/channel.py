"""A channel as its checks see it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from gmwm._core.typing import BoolArray, FloatArray, known_of
from gmwm.diagnosis.innovations import Innovations

if TYPE_CHECKING:
    from gmwm.diagnosis.tails import Tails

Spans = tuple[tuple[int, int], ...]
"""Intervals of samples: the first, and the one after the last."""


class Held(NamedTuple):
    """Samples that repeat the one before without being measured.

    share, chance: Part of the samples that do, and part that chance explains.
    is_even: Whether they come at a regular interval.
    """

    share: float = 0.0
    chance: float = 0.0
    is_even: bool = False


@dataclass(frozen=True, eq=False)
class Examined:
    """A channel with its prediction errors and what was found first.

    name, unit, dt: Of the channel; dt in s.
    values: (n,), samples, NaN where missing.
    step, smallest: To which the largest and the smallest samples are rounded, u; 0 if not.
    errors: Prediction errors.
    events: Spikes and shocks.
    shocks: Those that do not touch a move of the whole sensor.
    outliers: Share of outliers spread over the record.
    tails: Law of the noise if its tails are heavy.
    usable: (n,) of bool, prediction errors outside events.
    quiet: (n,), samples, NaN in events too.
    """

    name: str
    unit: str
    dt: float
    values: FloatArray
    step: float
    smallest: float
    errors: Innovations
    events: Spans
    shocks: Spans
    outliers: float
    tails: Tails | None
    usable: BoolArray
    quiet: FloatArray
    held: Held = field(default_factory=Held)

    @property
    def scatter(self) -> float:
        """Usual standard deviation of what cannot be predicted of a sample, u."""
        return self.errors.level

    @cached_property
    def present(self) -> FloatArray:
        """Samples in their order, none missing."""
        return known_of(self.values)

    @cached_property
    def noise(self) -> FloatArray:
        """Samples outside events in their order, none missing."""
        return known_of(self.quiet)
