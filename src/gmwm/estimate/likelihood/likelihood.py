"""Gaussian likelihood of a series: exact by the Kalman filter, or debiased Whittle by one FFT.

The series is ``c + R t + noise``. The constant and the slope have flat priors and are integrated
out (the diffuse, or restricted, likelihood: Harville 1974, *Biometrika* 61, 383-385; Durbin &
Koopman 2012, *Time Series Analysis by State Space Methods*, ch. 5), so that correlation times of
the order of the record are not taken for a drift that was removed.

Whittle's likelihood (1953, *Arkiv for Matematik* 2, 423-434) is that of the innovations of the
series under starting values that are close, which leaves no leakage; see docs/derivations.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from scipy import fft

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.likelihood.kalman import Space, whiten
from gmwm.estimate.moments.gmwm import GMWM
from gmwm.estimate.moments.weights import dictionary
from gmwm.estimate.problem.information import density
from gmwm.estimate.problem.moments import Scales
from gmwm.estimate.problem.nonnegative import solve_nonnegative
from gmwm.estimate.problem.parameters import Coordinates, keys_by_term
from gmwm.estimate.problem.ramp import Slope
from gmwm.estimate.result.fit import Fit
from gmwm.process import Model, Process, StateSpace, as_model
from gmwm.readers import Channel
from gmwm.variance import MIN_SAMPLES, Runs, WaveletVariance, wavelet_variance
from gmwm.variance.covariance import dyadic_levels

LogLikelihood = Callable[[Sequence[Process]], float]
Objective = Callable[[FloatArray], float]

_NO_VARIANCE = 1e-12  # of a first sample, as a share of that of one step
_SINGLE = 2048  # lowest frequencies kept one by one
_BINS_PER_OCTAVE = 256  # above them


@dataclass(frozen=True, eq=False)
class Regression:
    """Generalized least squares of whitened regressors.

    beta: (k,), coefficients.
    covariance: (k, k).
    residual: Sum of squares that is left.
    log_determinant: Of the regressors' information matrix.
    """

    beta: FloatArray
    covariance: FloatArray
    residual: float
    log_determinant: float

    @classmethod
    def of(cls, products: FloatArray) -> Self:
        """From the (1 + k, 1 + k) products of the whitened series and regressors."""
        information = products[1:, 1:]
        beta = np.linalg.solve(information, products[1:, 0])
        return cls(
            np.asarray(beta),
            np.asarray(np.linalg.inv(information)),
            float(products[0, 0] - products[0, 1:] @ beta),
            float(np.linalg.slogdet(information)[1]),
        )

    def log_likelihood(self, count: int, log_variance: float) -> float:
        """Diffuse log-likelihood of ``count`` samples; a constant of the regressors is left out.

        log_variance: Sum of the logarithms of the variances of the innovations.
        """
        return -0.5 * (
            (count - self.beta.size) * np.log(2.0 * np.pi)
            + log_variance
            + self.log_determinant
            + self.residual
        )


class Columns:
    """A series and its regressors: a constant and, where the model has one, a ramp.

    values: (n,), NaN where missing.
    drift: Given slope, u/s, which is removed; ``None`` to estimate it.
    has_drift: Whether the model has a ramp at all.
    """

    def __init__(self, values: FloatArray, dt: float, drift: float | None, has_drift: bool) -> None:
        n = values.size
        self.dt, self.n = dt, n
        self.drift_is_free = has_drift and drift is None
        k = np.arange(n)
        self._half = max(0.5 * (n - 1), 1.0)
        series = values if not has_drift or drift is None else values - drift * dt * k
        # Remove the mean and the line first: large ones would cost digits.
        series = series - np.nanmean(series)
        columns = [series, np.ones(n)]
        self._removed = 0.0
        if self.drift_is_free:
            ramp = k / self._half - 1.0
            centred = np.where(np.isnan(series), 0.0, ramp - np.mean(ramp[~np.isnan(series)]))
            self._removed = float(np.nansum(centred * series) / np.sum(centred**2))
            columns = [series - self._removed * centred, np.ones(n), ramp]
        self.matrix = np.column_stack(columns)

    @classmethod
    def without_regressors(cls, values: FloatArray, dt: float) -> Self:
        """A series of zero mean alone."""
        columns = cls(values, dt, None, False)
        columns.matrix = np.ascontiguousarray(values[:, None])
        return columns

    @property
    def centred(self) -> FloatArray:
        """The series less its mean alone, (n,)."""
        series = self.matrix[:, 0]
        if self.drift_is_free:
            series = series + self._removed * self.matrix[:, -1]
        return series - np.nanmean(series)

    def slope(self, processes: Sequence[Process]) -> Slope:
        """The slope of the last regressor under a sum of processes."""
        innovations, _, _ = whitened(self, processes)
        regression = Regression.of(innovations.T @ innovations)
        unit = 1.0 / (self._half * self.dt)
        value = (self._removed + float(regression.beta[-1])) * unit
        return Slope(value, float(regression.covariance[-1, -1]) * unit**2)


def stacked(processes: Sequence[Process], dt: float) -> StateSpace:
    """State space of the sum of processes."""
    return StateSpace.stack([process.state_space(dt) for process in processes])


def arrays_of(space: StateSpace) -> Space:
    """The arrays of a state space, with a first state that leaves the first sample a variance.

    A walk from zero with (almost) no other noise leaves it none. As the series begins at an unknown
    constant, the walk can as well have made a step before; no contrast depends on it.
    """
    h, noise, first = space.output, space.process_noise, space.initial_covariance
    if not space.measurement_noise + h @ first @ h > _NO_VARIANCE * (h @ noise @ h):
        first = first + noise
    return Space(space.transition, noise, h, space.measurement_noise, first)


def have_states(processes: Sequence[Process]) -> bool:
    """Whether all processes have a state space."""
    return all(type(process).state_space is not Process.state_space for process in processes)


def with_states(columns: Columns, processes: Sequence[Process]) -> Sequence[Process]:
    """The processes, those without a state space as sums of textbook processes near them.

    Such a sum whitens a series nearly as well, and the spectral likelihood makes up for the rest.
    """
    if have_states(processes):
        return processes
    scales = Scales(dyadic_levels(columns.n) * columns.dt, columns.dt, columns.n)
    design, atoms, curves = dictionary(scales)
    found: list[Process] = []
    for process in processes:
        if have_states([process]):
            found.append(process)
        elif np.any(curve := scales.curve(process)):
            x = solve_nonnegative(curves / curve[:, None], np.ones(curve.size))[0]
            parts = [design.at_shape(*atom) for atom in atoms]
            found += [
                p.with_amplitude(v) for p, v in zip(parts, x.tolist(), strict=True) if v > 0.0
            ]
    return found


def whitened(columns: Columns, processes: Sequence[Process]) -> tuple[FloatArray, float, int]:
    """`gmwm.estimate.likelihood.kalman.whiten` of the columns under a sum of processes."""
    return whiten(arrays_of(stacked(with_states(columns, processes), columns.dt)), columns.matrix)


class KalmanLikelihood:
    """Diffuse log-likelihood of a series under sums of processes with a state space."""

    def __init__(self, columns: Columns) -> None:
        self.columns = columns

    def __call__(self, processes: Sequence[Process]) -> float:
        """Log-likelihood of these processes; a constant of the regressors is left out."""
        innovations, log_variance, count = whitened(self.columns, processes)
        return Regression.of(innovations.T @ innovations).log_likelihood(count, log_variance)


class WhittleLikelihood:
    """Log-likelihood of a series without gaps near some values of its noise, which whiten it.

    With e the innovations over their standard deviations, zero-padded to 2 n samples, I their
    periodogram, c the share of its expectation that the regression takes, and rho the spectrum
    over that of the filter, the log-likelihood is ``-1/4 sum (1 - c) log rho + I / rho`` over all
    2 n frequencies. As rho is smooth and close to one, frequencies are grouped in narrow bins.
    """

    def __init__(self, columns: Columns, filters: Sequence[Process]) -> None:
        filters = with_states(columns, filters)
        innovations, log_variance, _ = whitened(columns, filters)
        products = innovations.T @ innovations
        self.regression = Regression.of(products)
        n = columns.n
        residual = innovations[:, 0] - innovations[:, 1:] @ self.regression.beta
        size = fft.next_fast_len(2 * n, real=True)
        edges = _edges(size // 2 + 1)
        share = np.ones(size // 2 + 1)
        share[0] = 0.5
        if size % 2 == 0:
            share[-1] = 0.5
        share *= 2.0 * n / size  # as if of 2 n frequencies
        index = np.arange(size // 2 + 1)
        weight = np.add.reduceat(share, edges)
        self._frequency = np.add.reduceat(share * index, edges) / weight / size / columns.dt
        self._frequency[0] = 0.25 / size / columns.dt  # spectra may be infinite at zero
        power = share * np.abs(fft.rfft(residual, size)) ** 2 / n
        self._power = np.add.reduceat(power, edges)
        root = np.linalg.cholesky(self.regression.covariance)
        for column in (innovations[:, 1:] @ root).T:
            share = share - share * np.abs(fft.rfft(column, size)) ** 2 / n
        self._share = np.add.reduceat(share, edges)
        self._dt = columns.dt
        self._filter = _transfer(stacked(filters, columns.dt), self._frequency * columns.dt)
        free = n - self.regression.beta.size
        self._constant = -0.5 * (
            free * np.log(2.0 * np.pi) + log_variance + self.regression.log_determinant
        )

    def __call__(self, processes: Sequence[Process]) -> float:
        """Log-likelihood of these processes; comparable with `KalmanLikelihood`."""
        ratio = density(processes, self._frequency, self._dt) / self._dt / self._filter
        return self._constant - 0.5 * float(self._share @ np.log(ratio) + self._power @ (1 / ratio))


def _edges(count: int) -> npt.NDArray[np.intp]:
    """First indices of bins: single ones, then of equal width in the logarithm."""
    single = np.arange(min(_SINGLE, count))
    if count <= _SINGLE:
        return single
    bins = int(np.ceil(np.log2(count / _SINGLE) * _BINS_PER_OCTAVE))
    wide = np.geomspace(_SINGLE, count, bins + 1)[:-1].round().astype(int)
    return np.unique(np.concatenate([single, wide]))


def _transfer(space: StateSpace, frequency: FloatArray) -> FloatArray:
    """Spectrum of a state space at ``frequency`` (cycles per sample), u^2 per cycle per sample."""
    p = space.n_states
    turn = np.exp(2j * np.pi * frequency)
    matrices = turn[:, None, None] * np.eye(p) - space.transition
    rows = np.broadcast_to(space.output, (turn.size, p))[:, :, None]
    gain = np.linalg.solve(matrices.transpose(0, 2, 1), rows)[:, :, 0]
    states = np.einsum("ki,ij,kj->k", gain, space.process_noise, gain.conj()).real
    return np.asarray(space.measurement_noise + states)


def defined(likelihood: LogLikelihood, processes: Sequence[Process]) -> float:
    """The likelihood, minus infinity where the processes give none (no noise at all)."""
    try:
        with np.errstate(all="ignore"):
            value = likelihood(processes)
    except (InputError, np.linalg.LinAlgError, ZeroDivisionError):
        return -np.inf
    return value if np.isfinite(value) else -np.inf


def objective_of(
    likelihood: LogLikelihood, coordinates: Coordinates, like: Sequence[Process]
) -> Objective:
    """The likelihood by coordinates, with given parameters taken from ``like``."""

    def objective(z: FloatArray) -> float:
        try:
            processes = coordinates.processes(z, like)
        except InputError:
            return -np.inf  # a step beyond what a parameter can be
        return defined(likelihood, processes)

    return objective


@dataclass(frozen=True, eq=False)
class Series:
    """A channel ready for a likelihood.

    wv: Of the samples; where gaps leave none, of the series bridged by straight lines.
    is_bridged: Whether ``wv`` is of the bridged series: fine levels are then too low, so that it is
        a starting point but no test of a fit.
    start: Starting values of its terms, all of them positive.
    start_is_valid: Whether they are valid estimates by the method of moments.
    """

    columns: Columns
    wv: WaveletVariance
    is_bridged: bool
    coordinates: Coordinates
    start: tuple[Process, ...]
    start_is_valid: bool

    @classmethod
    def of(
        cls, model: Model, channel: Channel, start: Process | Model | None, *, exact: bool
    ) -> Self:
        """Check the samples and find starting values.

        exact: Whether for an exact likelihood, which needs state spaces and copes with gaps.
        Raises InputError if the samples are no series of numbers, if a likelihood that is not exact
            lacks some, or if ``start`` is not the same model.
        """
        coordinates = Coordinates(model)
        for term in coordinates.noise:
            if exact and not have_states([term]):
                raise InputError(
                    f"{type(term).__name__} has no state-space form, which an exact likelihood "
                    'needs: use method="whittle"'
                )
        values = np.asarray(channel.values, dtype=float)
        # The wavelet variance reports what is no series.
        is_series = values.ndim == 1 and not np.any(np.isinf(values))
        missing = int(np.sum(np.isnan(values))) if is_series else 0
        if missing and values.size - missing < MIN_SAMPLES:
            where = f"channel {channel.name!r}" if channel.name else "the series"
            raise InputError(
                f"{where} has {values.size - missing} samples that are not missing: give "
                f"{MIN_SAMPLES} or more"
            )
        if missing and not exact:
            raise InputError(
                f"{missing:,} samples are missing, but a Fourier transform needs all: use "
                'method="mle"'
            )
        bridged, is_bridged = channel, False
        if missing:
            # Scattered gaps leave no wavelet coefficients at coarse levels, or none at all.
            k = np.arange(values.size)
            known = k[~np.isnan(values)]
            filled = np.interp(k, known, values[known])[known[0] : known[-1] + 1]
            bridged = replace(channel, values=filled)
            is_bridged = Runs.of(values).longest < MIN_SAMPLES
        to_start = wavelet_variance(bridged)
        wv = wavelet_variance(channel) if missing and not is_bridged else to_start
        ramp = next((term for term in model.terms if term.is_drift), None)
        given = None if ramp is None or ramp.is_open else ramp.drift_rate()
        columns = Columns(values, channel.dt, given, ramp is not None)
        if start is None:
            fit = GMWM().estimate(model, to_start)
            first, is_valid = _from_moments(fit, coordinates), fit.valid
        else:
            first, is_valid = _from_user(model, as_model(start), coordinates), False
        return cls(columns, wv, is_bridged, coordinates, first, is_valid)


def _from_moments(fit: Fit, coordinates: Coordinates) -> tuple[Process, ...]:
    """Estimates by the method of moments, with amplitudes of zero replaced by small ones."""
    level = float(np.sqrt(np.min(fit.wv.variance)))
    keys, places = keys_by_term(fit.model), {id(p): k for k, p in enumerate(fit.model.terms)}
    found = []
    for match in _filled(coordinates.noise, fit.model):
        if match is not None and _scale(match) == 0.0:
            name = match.linear_parameter.name
            limit = fit.upper_bounds.get(keys[places[id(match)], name], np.inf)
            small = tuning.SMALL_START * limit if 0.0 < limit < np.inf else 1e-3 * level
            match = match.with_values(**{name: small})
        found.append(match)
    return tuple(found)


def _from_user(model: Model, start: Model, coordinates: Coordinates) -> tuple[Process, ...]:
    found = _filled(coordinates.noise, start)
    is_given = all(match and not match.is_open and _scale(match) > 0.0 for match in found)
    if not is_given or len(found) < sum(not term.is_drift for term in start.terms):
        raise InputError(
            f"start = {start!r}: repeat the model {model!r} with a positive number for every "
            "parameter"
        )
    return tuple(found)


def _filled(terms: Sequence[Process], model: Model) -> list[Any]:
    """For each term the one of a model that is it with its open parameters filled in, or None."""
    left, found = list(model.terms), []
    for term in terms:
        same = (
            p
            for p in left
            if type(p) is type(term)
            and p.values.keys() == term.values.keys()
            and all(v is None or v == p.values[k] for k, v in term.values.items())
        )
        found.append(next(same, None))
        left = [p for p in left if p is not found[-1]]
    return found


def _scale(process: Process) -> float:
    """Value of the linear parameter; 1 where there is none."""
    linear = process.linear_parameter
    return 1.0 if linear is None else process.values[linear.name] or 0.0
