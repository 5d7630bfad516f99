"""Errors at the end of an outage, before the first fix: what a user sees of a sensor model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.simulation.filter_errors import FilterErrors
from gmwm.ins.simulation.trials import MonteCarlo

QUANTITIES = {"horizontal": "m", "vertical": "m", "velocity": "m/s", "attitude": "deg"}
"""Errors that are compared, with their units."""


@dataclass(frozen=True)
class ErrorSizes:
    """Sizes of an error over the runs.

    predicted: Root mean square that the filter predicted.
    """

    mean: float
    rms: float
    median: float
    p95: float
    predicted: float


@dataclass(frozen=True)
class ErrorDifference:
    """A filter's mean error less that of another, in the same runs.

    lower, upper: Bootstrap interval of 95 % over the runs.
    ratio, ratio_lower, ratio_upper: The same as a ratio of the root mean squares.
    """

    value: float
    lower: float
    upper: float
    ratio: float
    ratio_lower: float
    ratio_upper: float

    @property
    def significant(self) -> bool:
        """Whether zero lies outside the interval of the difference."""
        return bool(self.lower > 0.0 or self.upper < 0.0)


def sizes(runs: FilterErrors, time: float) -> dict[str, FloatArray]:
    """Size of each error of `QUANTITIES` in every run, (R,), before the fixes of an epoch."""
    return _sizes(runs.error[:, runs.index(time)])


def _sizes(error: FloatArray) -> dict[str, FloatArray]:
    return {
        "horizontal": np.hypot(error[:, 0], error[:, 1]),
        "vertical": np.abs(error[:, 2]),
        "velocity": np.linalg.norm(error[:, 3:6], axis=1),
        "attitude": np.degrees(np.linalg.norm(error[:, 6:], axis=1)),
    }


def pooled_sizes(study: MonteCarlo, name: str) -> dict[str, FloatArray]:
    """Root mean square over the outages of a run, of each error of `QUANTITIES`, (R,)."""
    if not study.outages:
        raise InputError("the study has no outage: give one at least")
    each = [sizes(study[name], outage.end) for outage in study.outages]
    return {
        quantity: np.sqrt(np.mean([part[quantity] ** 2 for part in each], axis=0))
        for quantity in QUANTITIES
    }


def spread(runs: FilterErrors, time: float) -> dict[str, ErrorSizes]:
    """Errors before the first fix after an outage.

    Raises InputError if the filter diverged in every run.

    Parameters
    ----------
    runs : FilterErrors
    time : float
        End of the outage, s.
    """
    predicted = _sizes(runs.sd[:, runs.index(time)])
    result = {}
    for name, values in sizes(runs, time).items():
        alive = np.isfinite(values)
        if not np.any(alive):
            raise InputError("the filter diverged in every run: check its sensor models")
        values = values[alive]
        result[name] = ErrorSizes(
            mean=float(np.mean(values)),
            rms=float(np.sqrt(np.mean(values**2))),
            median=float(np.median(values)),
            p95=float(np.quantile(values, 0.95)),
            predicted=float(np.sqrt(np.mean(predicted[name][alive] ** 2))),
        )
    return result


def difference(
    first: Mapping[str, FloatArray], second: Mapping[str, FloatArray], quantity: str, seed: int = 0
) -> ErrorDifference:
    """Paired difference of two filters, with its bootstrap interval over the runs.

    Raises InputError if the runs are not the same, or in none of them both filters reached the end.

    Parameters
    ----------
    first, second : mapping of str to (R,) ndarray
        From `sizes`, of the same runs.
    quantity : str
        One of `QUANTITIES`.
    seed : int, optional
    """
    checks.choice("quantity", quantity, list(QUANTITIES))
    a, b = first[quantity], second[quantity]
    if a.size != b.size:
        raise InputError(f"{a.size} and {b.size} runs cannot be paired: give those of one study")
    alive = np.isfinite(a) & np.isfinite(b)
    if not np.any(alive):
        raise InputError("one or the other filter diverged in every run: check their sensor models")
    a, b = a[alive], b[alive]
    index = np.random.default_rng(seed).integers(a.size, size=(tuning.BOOTSTRAP_DRAWS, a.size))
    drawn = np.mean(a[index] - b[index], axis=1)
    ratios = np.sqrt(np.mean(a[index] ** 2, axis=1) / np.mean(b[index] ** 2, axis=1))
    ends = [0.5 - 0.5 * tuning.CONFIDENCE, 0.5 + 0.5 * tuning.CONFIDENCE]
    ratio = float(np.sqrt(np.mean(a**2) / np.mean(b**2)))
    lower, upper = map(float, np.quantile(drawn, ends))
    ratio_lower, ratio_upper = map(float, np.quantile(ratios, ends))
    return ErrorDifference(float(np.mean(a - b)), lower, upper, ratio, ratio_lower, ratio_upper)
