"""Errors of a filter over many runs, and their sizes at the end of an outage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter import Outputs, Solution
from gmwm.ins.imu import SensorErrors
from gmwm.ins.trajectory import Trajectory

GROUPS = {
    "position": slice(0, 3),
    "velocity": slice(3, 6),
    "attitude": slice(6, 9),
    "navigation": slice(0, 9),
    "horizontal": slice(0, 2),
    "vertical": slice(2, 3),
}
"""Navigation errors that are judged together, and the two parts of the position: both can be right
where their correlation is wrong."""


@dataclass(frozen=True, eq=False)
class FilterErrors:
    """Errors of one filter over R runs at K epochs.

    Attributes
    ----------
    time : (K,) ndarray
        s.
    before : (K,) ndarray of bool
        Whether the measurements of the epoch were not in yet.
    error, sd : (R, K, 9) ndarray
        Estimate less truth of position (m), velocity (m/s) and attitude (rad), and the standard
        deviation that the filter predicted; NaN from where a filter diverged.
    nees : (R, K, 6) ndarray
        Normalised error squared of the `GROUPS`.
    log_det : (R, K, 6) ndarray
        Logarithm of the determinant of the predicted covariance of the `GROUPS`.
    sensor_error, sensor_sd : (R, K, 6) ndarray
        Estimate less truth of the sensors' errors, without their white noise; NaN where the truth
        is not known, as at the very last epoch, which no sample follows.
    sensor_nees : (R, K) ndarray
        Of all sensors that have states; NaN as long as one of them is known without error.
    nis : (R, 2) ndarray
        Sum of the normalised innovations squared of a run, and how many components it sums.
    whiteness : (R,) ndarray
        Autocorrelation of the standardised innovations from one fix to the next in its standard
        error: standard normal if they are white, whatever their size.
    """

    time: FloatArray
    before: BoolArray
    error: FloatArray
    sd: FloatArray
    nees: FloatArray
    log_det: FloatArray
    sensor_error: FloatArray
    sensor_sd: FloatArray
    sensor_nees: FloatArray
    nis: FloatArray
    whiteness: FloatArray

    @property
    def runs(self) -> int:
        """Number of runs R."""
        return len(self.error)

    @property
    def diverged(self) -> int:
        """Runs in which the filter diverged."""
        return int(np.count_nonzero(np.isnan(self.error[:, -1, 0])))

    def index(self, time: float, *, before: bool = True) -> int:
        """Place of an epoch; InputError if it was not kept."""
        return place_of(time, self.time, self.before == before)


def place_of(time: float, kept: FloatArray, of_kind: BoolArray) -> int:
    """Place of a time among those that were kept and are of a kind."""
    found = np.flatnonzero((np.abs(kept - time) < tuning.SAME_TIME) & of_kind)
    if found.size == 0:
        raise InputError(f"no errors were kept at {time:g} s: give the end of an outage")
    return int(found[0])


PER_RUN = tuple(name for name in FilterErrors.__annotations__ if name not in ("time", "before"))
"""Arrays of `FilterErrors` whose first axis is the run."""


def errors_of_run(
    solution: Solution, truth: Trajectory, errors: SensorErrors, outputs: Outputs
) -> dict[str, FloatArray]:
    """Figures of a run, by the names of `PER_RUN`; NaN where the solution does not reach."""
    done = solution.time.size
    error = solution.errors(truth)
    groups = [normalised(error[:, p], solution.covariance[:, p, p]) for p in GROUPS.values()]
    nees, log_det = np.moveaxis(np.reshape(groups, (len(GROUPS), 2, done)), 0, -1)
    sensor_error, sensor_nees = np.full((done, 6), np.nan), np.full(done, np.nan)
    if errors.slow is not None:
        # The states of an epoch are those of the sample that follows it; the last one has none.
        at = outputs.epoch[:done]
        known = at < len(errors.slow)
        sensor_error[known] = solution.sensor_errors[known] - errors.slow[at[known]]
        sensor_nees = normalised(sensor_error, solution.sensor_covariance)[0]
    sensor_sd = np.sqrt(np.diagonal(solution.sensor_covariance, axis1=1, axis2=2))
    reached = (error, solution.sd, nees, log_det, sensor_error, sensor_sd, sensor_nees)
    result = {}
    for key, values in zip(PER_RUN, reached, strict=False):
        result[key] = np.full((outputs.epoch.size, *values.shape[1:]), np.nan)
        result[key][:done] = values
    standard, kinds = solution.innovations.standard, solution.innovations.kind
    seen = standard[np.isfinite(standard)]
    result["nis"] = np.array([np.sum(seen**2), float(seen.size)])
    result["whiteness"] = np.array(lag_one([standard[kinds == each] for each in np.unique(kinds)]))
    return result


def normalised(error: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squares of errors (K, d) in units of their covariance (K, d, d), and its log determinant.

    Only what has a variance at some epoch counts: a sensor without states has no error that is
    estimated. NaN where one that counts has none yet, as a random walk that starts at zero.
    """
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    alive = np.any(variance > 0.0, axis=0)
    squares, log_det = np.full((2, len(error)), np.nan)
    settled = np.all(variance[:, alive] > 0.0, axis=1)
    if np.any(alive) and np.any(settled):
        error, covariance = error[settled][:, alive], covariance[settled][:, alive][:, :, alive]
        solved = np.linalg.solve(covariance, error[..., None])[..., 0]
        squares[settled] = np.sum(error * solved, axis=1)
        log_det[settled] = np.linalg.slogdet(covariance)[1]
    return squares, log_det


def lag_one(parts: Sequence[FloatArray]) -> float:
    """Autocorrelation of standardised innovations of each kind, (E, 3), in its standard error."""
    products = [np.zeros(0), *((part[1:] * part[:-1]).ravel() for part in parts)]
    together = np.concatenate(products)
    together = together[np.isfinite(together)]
    scale = np.sqrt(np.sum(together**2))
    return float(np.sum(together) / scale) if scale > 0.0 else float("nan")


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


def spread(runs: FilterErrors, time: float) -> dict[str, ErrorSizes]:
    """Errors before the first fix after an outage that ends at ``time`` (s).

    Raises InputError if the filter diverged in every run.
    """
    predicted, result = _sizes(runs.sd[:, runs.index(time)]), {}
    for name, values in sizes(runs, time).items():
        alive = np.isfinite(values)
        if not np.any(alive):
            raise InputError("the filter diverged in every run: check its sensor models")
        size, expected = values[alive], predicted[name][alive]
        rms, believed = np.sqrt(np.mean(size**2)), np.sqrt(np.mean(expected**2))
        found = (np.mean(size), rms, np.median(size), np.quantile(size, 0.95), believed)
        result[name] = ErrorSizes(*map(float, found))
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
        raise InputError(f"{a.size} and {b.size} runs cannot be paired: give runs of one study")
    alive = np.isfinite(a) & np.isfinite(b)
    if not np.any(alive):
        raise InputError("one or the other filter diverged in every run: check their sensor models")
    a, b = a[alive], b[alive]
    index = np.random.default_rng(seed).integers(a.size, size=(tuning.BOOTSTRAP_DRAWS, a.size))

    def ratio(first: FloatArray, second: FloatArray) -> FloatArray:
        return np.sqrt(np.mean(first**2, axis=-1) / np.mean(second**2, axis=-1))

    ends = [0.5 - 0.5 * tuning.CONFIDENCE, 0.5 + 0.5 * tuning.CONFIDENCE]
    means, ratios = np.mean(a[index] - b[index], axis=1), ratio(a[index], b[index])
    found = [np.mean(a - b), *np.quantile(means, ends), ratio(a, b), *np.quantile(ratios, ends)]
    return ErrorDifference(*map(float, found))
