"""Errors of a filter over many runs; does it know how good it is?

NEES, coverage, innovations and a proper score, after Bar-Shalom, Li & Kirubarajan (2001),
*Estimation with Applications to Tracking and Navigation*, sec. 5.4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv

from gmwm._core import checks
from gmwm._core.distributions import chi2, norm, student as t
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.filter import Outputs, Solution
from gmwm.ins.sensors import SensorErrors
from gmwm.ins.trajectory.trajectory import Trajectory

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
        raise InputError("in every run one of the two filters diverged: check their sensor models")
    a, b = a[alive], b[alive]
    index = np.random.default_rng(seed).integers(a.size, size=(tuning.BOOTSTRAP_DRAWS, a.size))

    def ratio(first: FloatArray, second: FloatArray) -> FloatArray:
        return np.sqrt(np.mean(first**2, axis=-1) / np.mean(second**2, axis=-1))

    ends = [0.5 - 0.5 * tuning.CONFIDENCE, 0.5 + 0.5 * tuning.CONFIDENCE]
    means, ratios = np.mean(a[index] - b[index], axis=1), ratio(a[index], b[index])
    found = [np.mean(a - b), *np.quantile(means, ends), ratio(a, b), *np.quantile(ratios, ends)]
    return ErrorDifference(*map(float, found))


LEVELS = (0.5, 0.68, 0.95, 0.997)  # at which coverage is counted
_UPPER = 0.5 + 0.5 * tuning.CONFIDENCE
_UNKNOWN = (float("nan"),) * 3


@dataclass(frozen=True)
class Ratio:
    """A statistic that is 1 for a consistent filter.

    lower, upper: Band of 95 % in which it lies if the filter is consistent.
    p_value: Two-sided probability of a value as far from 1, if it is.
    """

    value: float
    lower: float
    upper: float
    p_value: float

    @property
    def within(self) -> bool:
        """Whether it lies in its band."""
        return bool(self.lower <= self.value <= self.upper)


@dataclass(frozen=True)
class Coverage:
    """Fraction of the errors within the predicted interval of a level.

    lower, upper: Interval of 95 % of the fraction: binomial at one epoch (Clopper & Pearson 1934,
        *Biometrika* 26, 404-413), and over a time with as many draws as the scatter between the
        runs is worth (Korn & Graubard 1998, *Survey Methodology* 24, 193-201).
    """

    level: float
    fraction: float
    lower: float
    upper: float

    @property
    def within(self) -> bool:
        """Whether the interval holds the level."""
        return bool(self.lower <= self.level <= self.upper)


@dataclass(frozen=True)
class Consistency:
    """How a filter's own covariance agrees with its true errors.

    Attributes
    ----------
    nees : dict
        Group of `GROUPS`, or "sensors", -> NEES per degree of freedom.
    coverage : dict
        Group -> `Coverage` at each of `LEVELS`, of its components' errors.
    rms : dict
        Group -> root mean square of the errors in their predicted standard deviations.
    score : dict
        Group -> mean of the negative logarithm of the predicted density at the truth; less is
        better, and to predict too much or too little costs alike (Gneiting & Raftery 2007, *JASA*
        102, 359-378).
    """

    nees: dict[str, Ratio]
    coverage: dict[str, tuple[Coverage, ...]]
    rms: dict[str, float]
    score: dict[str, float]

    @property
    def consistent(self) -> bool:
        """Whether no group's NEES contradicts the filter."""
        level = tuning.CONTRADICTED / len(self.nees)
        return all(ratio.p_value > level for ratio in self.nees.values())


def at_epoch(runs: FilterErrors, index: int) -> Consistency:
    """Consistency at one epoch (`FilterErrors.index`) over independent runs: chi-square bands."""
    alive = np.isfinite(runs.error[:, index, 0])
    return _consistency(runs, alive, np.array([index]), single=True)


def over_time(runs: FilterErrors, start: float = 0.0, end: float = np.inf) -> Consistency:
    """Consistency over a time, s, averaged run by run: bands from the scatter between the runs.

    The errors of one run are correlated, so that a run counts as one draw; Student's t.

    Raises InputError if no errors were kept in that time.
    """
    epochs = np.flatnonzero((runs.time >= start) & (runs.time <= end) & ~runs.before)
    if not epochs.size:
        raise InputError(
            f"no errors were kept from {start:g} s to {end:g} s: give a longer time, within "
            f"{runs.time[0]:g} s to {runs.time[-1]:g} s"
        )
    alive = np.all(np.isfinite(runs.error[:, epochs, 0]), axis=1)
    return _consistency(runs, alive, epochs, single=False)


def _consistency(
    runs: FilterErrors, alive: BoolArray, epochs: IntArray, *, single: bool
) -> Consistency:
    """Consistency of some runs at one epoch, or over several."""
    result = Consistency({}, {}, {}, {})

    def judge(name: str, squares: FloatArray, standard: FloatArray, size: int) -> None:
        if single:
            result.nees[name] = chi_square_ratio(squares, size)
        else:
            result.nees[name] = mean_ratio(np.mean(squares, axis=1) / size)
        result.coverage[name] = coverage_of(standard, single)
        result.rms[name] = float(np.sqrt(np.mean(standard**2))) if standard.size else float("nan")

    for i, (name, part) in enumerate(GROUPS.items()):
        size = part.stop - part.start
        squares = runs.nees[alive][:, epochs, i]
        error, sd = runs.error[alive][:, epochs, part], runs.sd[alive][:, epochs, part]
        judge(name, squares, error / sd, size)
        densities = squares + runs.log_det[alive][:, epochs, i] + size * np.log(2.0 * np.pi)
        result.score[name] = float(0.5 * np.mean(densities)) if squares.size else float("nan")
    settled = epochs[np.all(np.isfinite(runs.sensor_nees[alive][:, epochs]), axis=0)]
    if np.any(alive) and settled.size:
        # Only sensors that have states.
        error, sd = runs.sensor_error[alive][:, settled], runs.sensor_sd[alive][:, settled]
        known = np.all(sd > 0.0, axis=(0, 1))
        standard = np.asarray(error[..., known] / sd[..., known])
        judge("sensors", runs.sensor_nees[alive][:, settled], standard, int(np.sum(known)))
    return result


@dataclass(frozen=True)
class InnovationTest:
    """What a filter can be asked where no truth is known.

    nis: Normalised innovation squared per degree of freedom.
    whiteness: p-value of no correlation from one fix to the next.
    """

    nis: Ratio
    whiteness: float

    def __str__(self) -> str:
        mark = " " if self.nis.within else "*"
        band = f"(band {self.nis.lower:.4f} .. {self.nis.upper:.4f})"
        return f"{self.nis.value:>8.5g}{mark} {band}, p = {self.whiteness:.2g}"


def innovation_test(runs: FilterErrors) -> InnovationTest:
    """Innovations of all runs: their size and their whiteness."""
    total, count = np.nansum(runs.nis, axis=0)
    scores = runs.whiteness[np.isfinite(runs.whiteness)]
    p_value = float("nan")
    if scores.size:
        p_value = float(2.0 * norm.sf(abs(np.sum(scores)) / np.sqrt(scores.size)))
    return InnovationTest(_ratio(total, count), p_value)


def chi_square_ratio(squares: FloatArray, size: int) -> Ratio:
    """Mean of independent normalised errors squared of ``size`` degrees of freedom each."""
    return _ratio(float(np.sum(squares)), float(size * squares.size))


def _ratio(total: float, dof: float) -> Ratio:
    if not dof > 0.0 or not np.isfinite(total):
        return Ratio(float("nan"), *_UNKNOWN)
    lower, upper = chi2.ppf([1.0 - _UPPER, _UPPER], dof) / dof
    p_value = 2.0 * min(chi2.sf(total, dof), chi2.cdf(total, dof))
    return Ratio(float(total / dof), float(lower), float(upper), float(min(p_value, 1.0)))


def mean_ratio(values: FloatArray) -> Ratio:
    """Mean of independent values whose expectation is 1, of a distribution that is not known."""
    runs = values.size
    mean = float(np.mean(values)) if runs else float("nan")
    if runs < 2:
        return Ratio(mean, *_UNKNOWN)
    error = float(np.std(values, ddof=1) / np.sqrt(runs))
    width = float(t.ppf(_UPPER, runs - 1)) * error
    p_value = float(2.0 * t.sf(abs(mean - 1.0) / error, runs - 1)) if error > 0.0 else float("nan")
    return Ratio(mean, max(1.0 - width, 0.0), 1.0 + width, p_value)


def serial_ratio(standard: FloatArray) -> Ratio:
    """Mean square of uncorrelated errors of one run in their standard deviations, (K, d).

    Squares of Gaussian errors are correlated in time as the squares of the errors' correlations
    are, which leave so many degrees of freedom. They are taken about zero, so that an error that
    stays counts once, relative to its size, so that a wrong size is seen, and up to the first lag
    without any (Geyer 1992, *Stat. Sci.* 7, 473-483).
    """
    count, size = standard.shape
    power = np.abs(np.fft.rfft(standard, 2 * count, axis=0)) ** 2
    correlation = np.fft.irfft(power, axis=0)[:count]
    correlation /= np.maximum(correlation[0], np.finfo(float).tiny)
    until = np.logical_and.accumulate(correlation > 0.0, axis=0)
    share = 1.0 - np.arange(count) / count
    times = 2.0 * np.sum((until * correlation**2).T / share, axis=1) - 1.0
    dof = size**2 * count / float(np.sum(times))
    return _ratio(dof * float(np.mean(standard**2)), dof)


def coverage_of(standard: FloatArray, single: bool) -> tuple[Coverage, ...]:
    """Coverage of standardised errors (R, K, d).

    single: Whether K is 1: each run is a draw, since components are correlated; else the error is
        the scatter between runs.
    """
    runs, result = len(standard), []
    for level in LEVELS:
        each = np.mean(np.abs(standard) < norm.ppf(0.5 + 0.5 * level), axis=(1, 2))
        mean, draws = float(np.mean(each)) if runs else float("nan"), float(runs)
        error = float(np.var(each, ddof=1)) / runs if runs > 1 and not single else 0.0
        if error > 0.0:
            few, many = t.ppf(_UPPER, [max(runs - 1, 1), standard.size - 1])
            draws = min(mean * (1.0 - mean) / error, float(standard.size)) * (many / few) ** 2
        lower = upper = float("nan")
        if draws > 0.0:
            hits, tail = mean * draws, 1.0 - _UPPER
            lower = float(betaincinv(hits, draws - hits + 1.0, tail)) if hits > 0.0 else 0.0
            upper = float(betaincinv(hits + 1.0, draws - hits, 1.0 - tail)) if hits < draws else 1.0
        result.append(Coverage(level, mean, lower, upper))
    return tuple(result)
