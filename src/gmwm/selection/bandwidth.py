"""The sensor's own low-pass, where the finest levels show one.

White noise behind an ordinary filter falls off faster towards short averaging times than any sum of
textbook processes. Its shape is sought beside such a sum, so that what else the series holds does
not matter, and is then one term of given shape for the ranking; the fit of the chosen model
estimates it anew.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.estimate.moments import Design, Profile, dictionary, dictionary_fit
from gmwm.estimate.problem import Scales, objectives_with, solve_nonnegative, weight_root
from gmwm.process import (
    BUTTERWORTH,
    AveragedNoise,
    LowPassNoise,
    Model,
    Process,
    QuantizationNoise,
    Shape,
)
from gmwm.selection import tuning
from gmwm.variance import WaveletVariance

_FAMILIES: tuple[Process, ...] = (
    *(LowPassNoise(order=order, damping=BUTTERWORTH) for order in (1.0, 2.0, 3.0, 4.0)),
    AveragedNoise(),
    LowPassNoise(damping=BUTTERWORTH),
    LowPassNoise(order=2.0),
    LowPassNoise(),
)
"""Filters of one, two and three open shapes, simplest first."""
_ROUNDS = 2
_REACH = 3.0  # of the search from the best shape of the grid, in logarithms


@dataclass(frozen=True)
class Bandwidth:
    """Filtered white noise that a model may have.

    given: Of open amplitude, with the shape that was found.
    free: The same as the fit is to have it: with an open bandwidth, as a low-pass, but of the order
        and damping that were found, which two or three levels know only together.
    """

    given: Process
    free: Process
    n_shapes: int


def sensor_bandwidth(
    wv: WaveletVariance, extra: tuple[Process, ...], penalty: float
) -> Bandwidth | None:
    """The low-pass or moving average that describes the finest levels, if one is needed there.

    extra: Lines and resonances that the series may have.
    """
    reference = dictionary_fit(wv, wv.variance, extra)
    if reference.discrepancy == 0.0:
        return None
    for _ in range(_ROUNDS):
        alone = _Beside.of(wv, extra, reference.covariance, fastest=0.0).objective
        tried = []
        for price, left_out in ((0.0, QuantizationNoise), (penalty, None)):
            problem = _Beside.of(wv, extra, reference.covariance, tuning.FILTER_LIKE, left_out)
            tried += [(*problem.best(each), price) for each in _FAMILIES]
        best, objective, _ = min(tried, key=lambda t: t[1] + penalty * t[0].n_shapes + t[2])
        reference = dictionary_fit(wv, wv.variance, (*extra, best.given))
    needed = tuning.BANDWIDTH_GAIN * penalty * (1 + best.n_shapes)
    return best if alone - objective > needed else None


@dataclass(frozen=True, eq=False)
class _Beside:
    """Least squares of textbook processes and one more term, under one covariance."""

    scales: Scales
    root: FloatArray
    curves: FloatArray
    target: FloatArray

    @classmethod
    def of(
        cls,
        wv: WaveletVariance,
        extra: tuple[Process, ...],
        covariance: FloatArray,
        fastest: float,
        left_out: type[Process] | None = None,
    ) -> Self:
        """With Gauss-Markov processes slower than ``fastest`` samples, and without a kind."""
        scales, root = Scales.of(wv), weight_root(covariance)
        design, atoms, matrix = dictionary(scales, extra)
        kinds = [design.terms[i].process for i, _ in atoms]
        kept = [
            type(kind) is not left_out
            and not (kind.ordered_by == "tau" and shape[0] < fastest * scales.dt)
            for kind, (_, shape) in zip(kinds, atoms, strict=True)
        ]
        return cls(scales, root, matrix[:, kept], wv.variance)

    @property
    def objective(self) -> float:
        """Weighted sum of squares without one more term."""
        residual = solve_nonnegative(self.root @ self.curves, self.root @ self.target)[1]
        return float(residual @ residual)

    def squares(self, curves: FloatArray) -> FloatArray:
        """Weighted sums of squares with each curve in turn, (J, G) to (G,)."""
        root = self.root
        return objectives_with(root @ self.curves, root @ curves, root @ self.target)

    def best(self, free: Process) -> tuple[Bandwidth, float]:
        """A family at its best shape, and the objective there."""
        design = Design(Model((free,)), self.scales)
        start = design.grid(0)[int(np.argmin(self.squares(design.grid_curves(0))))]
        if isinstance(free, AveragedNoise):
            return self._whole_window(free, start)
        profile = Profile(design, self.target, self.root, self.curves)
        point = profile.refine(profile.at([start]), _REACH)
        given = free.with_shape(point.shapes[0])
        n_shapes = design.terms[0].n_shapes
        return Bandwidth(given, given.with_values(bandwidth=None), n_shapes), point.objective

    def _whole_window(self, free: Process, start: Shape) -> tuple[Bandwidth, float]:
        """The best window of a whole number of samples: a moving average has no other."""
        middle, dt = int(np.rint(start[0] / self.scales.dt)), self.scales.dt
        reach = max(middle // 8, 1) + 1
        lengths = range(max(middle - reach, 2), middle + reach + 1)
        curves = [self.scales.unit_curve(free, (m * dt,)) for m in lengths]
        squares = self.squares(np.stack(curves, axis=1))
        best = int(np.argmin(squares))
        given = free.with_values(window=lengths[best] * dt)
        return Bandwidth(given, given, 1), float(squares[best])
