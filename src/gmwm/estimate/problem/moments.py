"""The moments that a model is fitted to: wavelet variances, the slope of a ramp, their covariance.

They depend on the model through the ramp (its slope is removed from the data) and through the
noise (which implies the covariance).

The curves of a model are in closed form, or simulated for processes that are known by simulation
only (indirect inference): the mean over R series as long as the data, or one series R times as
long, made with the same random numbers whatever the parameters, takes the place of the closed
form, and the covariance of the moments grows by (1 + 1/R) (Gourieroux, Monfort & Renault 1993, *J.
Applied Econometrics* 8, S85-S118; eq. (13) ff. of Stebler et al. 2012).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gmwm._core.distributions import norm, student
from gmwm._core.frozen import frozen
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.problem.ramp import RampRegression, Slope, ols_slope, walks_beside
from gmwm.estimate.problem.regressors import Coefficients, CurveRegression, Regression
from gmwm.process import PSD, Model, Process, Shape
from gmwm.variance import WaveletVariance, pilot_psd, wavelet_variance

if TYPE_CHECKING:
    from gmwm.estimate.result.fit import Fit

_COEFFICIENT_STEP = 1e-2  # of a standard error
_FARTHEST, _HALVINGS = 40.0, 40  # deviations of a normal number that can be; of their range


@dataclass(frozen=True)
class Simulation:
    """How moments are simulated.

    single: Whether they are one series of their total length.
    """

    replications: int
    seed: int
    single: bool = False

    def curve(
        self, process: Process, tau: FloatArray, n: int, dt: float, wavelet: str
    ) -> FloatArray:
        """Mean wavelet variance over the simulated series, u^2, same shape as ``tau``.

        Between levels it is interpolated in logarithms.
        """
        times, variance = _simulated(self, process, n, dt, wavelet)
        if not np.any(variance > 0.0):
            return np.zeros_like(tau)
        level = np.log(np.maximum(variance, np.finfo(float).tiny))
        return np.asarray(np.exp(np.interp(np.log(tau), np.log(times), level)))


@lru_cache(maxsize=1024)
def _simulated(
    simulation: Simulation, process: Process, n: int, dt: float, wavelet: str
) -> tuple[FloatArray, FloatArray]:
    """Averaging times and mean wavelet variances; a fit asks for the same terms repeatedly."""
    total: FloatArray | float = 0.0
    times = np.ones(1)
    count, length = simulation.replications, n
    if simulation.single:
        count, length = 1, n * simulation.replications
    for replication in range(count):
        rng = np.random.default_rng([simulation.seed, replication])
        series = process.simulate(length, dt, rng)
        if np.all(series == series[0]):
            continue  # rounded to nothing: no variance
        wv = wavelet_variance(series, dt, wavelet=wavelet)
        times, total = wv.tau, total + wv.variance
    return times, np.asarray(total / count)


@dataclass(frozen=True, eq=False)
class Scales:
    """The levels of a wavelet variance, without its values.

    tau: (J,), averaging times, s.
    dt: Sampling interval, s.
    n: Length of the record, samples.
    simulation: How curves without a closed form are simulated.
    simulate_all: Whether all curves are simulated.
    shared: Cache of starting shapes and their curves, for fits of several models to these levels.
    """

    tau: FloatArray
    dt: float
    n: int
    wavelet: str = "haar"
    simulation: Simulation = Simulation(10, 0)
    simulate_all: bool = False
    shared: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, wv: WaveletVariance) -> Scales:
        return _of_levels(tuple(wv.tau.tolist()), wv.dt, wv.n, wv.wavelet)

    def curve(self, model: Process | Model) -> FloatArray:
        """Wavelet variance of a model, u^2, (J,)."""
        if isinstance(model, Model):
            return np.sum([self.curve(term) for term in model.terms], axis=0)
        if self.is_simulated(model):
            return self.simulation.curve(model, self.tau, self.n, self.dt, self.wavelet)
        return np.asarray(model.wavelet_variance(self.tau, self.dt, self.wavelet), dtype=float)

    def unit_curve(self, process: Process, shape: Shape) -> FloatArray:
        """Wavelet variance of a process at another shape and unit amplitude, u^2, (J,)."""
        if self.wavelet == "haar" and not self.is_simulated(process):
            return process.unit_haar_variance(shape, self.tau, self.dt)
        return self.curve(process.at_unit(shape))

    def is_simulated(self, process: Process) -> bool:
        """Whether the curve of a process is simulated."""
        return self.simulate_all or not process.has_spectrum()

    def spectrum(self, model: Model) -> PSD:
        """Spectrum of a model, or a smooth one with its wavelet variances if it has none."""
        if all(term.has_spectrum() for term in model.terms):
            return model.psd
        curve = self.curve(model)
        if not np.any(curve > 0.0):
            raise InputError(
                f"{model!r} has no variance when simulated: check its draw, or add WhiteNoise()"
            )
        positive = np.maximum(curve, 1e-12 * np.max(curve))
        return pilot_psd(positive, np.rint(self.tau / self.dt), self.dt)


@lru_cache(maxsize=16)
def _of_levels(tau: tuple[float, ...], dt: float, n: int, wavelet: str) -> Scales:
    """One object for all series of the same levels."""
    return Scales(frozen(np.array(tau)), dt, n, wavelet)


@dataclass(frozen=True, eq=False)
class Moments:
    """The moments of a series, given what is known of its ramp or curve.

    found: Coefficients of the ramp, or of the curve beside the noise, removed from the wavelet
        variances; ``None`` where there is neither.
    """

    wv: WaveletVariance
    found: Coefficients | None
    is_free: bool
    scales: Scales

    @classmethod
    def of(cls, wv: WaveletVariance, model: Model, scales: Scales | None = None) -> Moments:
        """Moments before a first fit, with a least-squares slope where the model has a ramp."""
        scales = scales or Scales.of(wv)
        ramp = next((term for term in model.terms if term.is_drift), None)
        if wv.regressors is not None:
            if ramp is not None:
                raise InputError(
                    "with covariates the model cannot have a rate ramp: leave R out, and add time "
                    "as a covariate"
                )
            size = wv.regressors.removed.size
            return cls(wv, Coefficients(np.zeros(size), np.zeros((size, size))), True, scales)
        if ramp is None:
            return cls(wv, None, False, scales)
        if not ramp.is_open:
            return cls(wv, Slope(ramp.drift_rate(), 0.0), False, scales)
        return cls(wv, ols_slope(wv), True, scales)

    @property
    def slope(self) -> Coefficients | None:
        """Of a ramp, where it is estimated."""
        return self.found if self.is_free and self.wv.regressors is None else None

    @property
    def regression(self) -> Regression:
        """The regressors beside the noise."""
        curve = self.wv.regressors
        return RampRegression(self.wv) if curve is None else CurveRegression(self.wv, curve)

    @property
    def detrended(self) -> FloatArray:
        """Wavelet variances without the drift, u^2, (J,): less than those of the noise."""
        if self.found is None:
            return self.wv.variance
        return self.regression.detrended(self.found.values)

    @property
    def taken(self) -> FloatArray:
        """What the estimated coefficients take of the variances of the noise, u^2, (J,)."""
        if self.found is None:
            return np.zeros_like(self.wv.variance)
        return self.regression.taken(self.found.covariance)

    @property
    def target(self) -> FloatArray:
        """Wavelet variances of the noise alone, u^2, (J,): what was taken is added."""
        return self.detrended + self.taken

    def coefficient_covariances(self, terms: Sequence[Process]) -> FloatArray | None:
        """Covariance that each term gives the coefficients; None where none are estimated."""
        if self.found is None or not self.is_free:
            return None
        psds = [self.scales.spectrum(Model((term,))) for term in terms]
        return self.regression.covariances(self.found, psds)

    def lost(self, terms: Sequence[Process]) -> FloatArray | None:
        """What the estimated coefficients take of each term, u^2, (J, terms); None without any."""
        found = self.coefficient_covariances(terms)
        return None if found is None else self.regression.taken(found).T

    def under(self, noise: Model, part: float = 1.0) -> Moments:
        """The moments with the coefficients moved by ``part`` of the way to those under a noise."""
        if self.found is None or not self.is_free or not _has_power(noise):
            return self
        new = self.regression.estimated(self.scales.spectrum(noise))
        return replace(self, found=self.found.towards(new, part))

    def covariance(self, noise: Model) -> FloatArray:
        """Covariance of `target` that a noise implies, u^4, (J, J)."""
        wv = self.wv
        if not _has_power(noise):
            return wv.covariance
        psd = self.scales.spectrum(noise)
        covariance = wv.covariance_under(psd, noise.lines())
        if self.is_free and self.found is not None:
            covariance = self.regression.covariance(covariance, psd, self.found)
        if drift := noise.drift_rate():  # beside noise, one that stays in the data
            means = wv.mean_covariance_under(psd)
            # Below the levels where they are known, means are those of the slope seen there.
            levels = np.arange(wv.tau.size)
            known = np.maximum(levels, int(np.argmax(np.diag(means) > 0.0)))
            scale = 2.0 * drift * wv.drift_response**2 / wv.drift_response[known]
            covariance = covariance + np.outer(scale, scale) * means[np.ix_(known, known)]
        if any(self.scales.is_simulated(term) for term in noise.terms):
            covariance = covariance * (1.0 + wv.n_all / wv.n / self.scales.simulation.replications)
        return covariance


@dataclass(frozen=True, eq=False)
class FittedMoments:
    """The moments at a fitted model: those of the data, those of the model, their covariance.

    target: (J,), wavelet variances of the data without the drift of the model, u^2.
    implied: (J,), those of the model's noise, u^2.
    statistical: (J, J), covariance of ``target`` if the model is right, u^4.
    discrepancy: Relative error allowed for at each level.
    taken: (J,), what was added to ``target`` because an estimated slope took it, u^2.
    """

    scales: Scales
    target: FloatArray
    implied: FloatArray
    statistical: FloatArray
    discrepancy: float
    taken: FloatArray

    @classmethod
    def of(
        cls, model: Model, wv: WaveletVariance, discrepancy: float, *, is_free: bool
    ) -> FittedMoments:
        """Moments of the data at a model with values; of a ramp, whether it was estimated."""
        noise = tuple(term for term in model.terms if not term.is_drift)
        scales = Scales.of(wv)
        moments = Moments(wv, None, False, scales)
        if wv.regressors is not None:
            moments = Moments.of(wv, model, scales).under(model)
        elif len(noise) < len(model.terms):
            slope = Slope(model.drift_rate(), 0.0)
            moments = Moments(wv, slope, is_free, scales)
            if noise and (under := moments.under(Model(noise)).found):
                # Not the printed error, which averages over random walks that are left open.
                found = Coefficients(slope.values, under.covariance, under.weights)
                moments = replace(moments, found=found)
        if not noise:  # straight lines of the Allan plot may leave a ramp alone
            nothing = np.zeros_like(wv.tau)
            return cls(scales, moments.target, nothing, wv.covariance, discrepancy, nothing)
        implied, statistical = scales.curve(Model(noise)), moments.covariance(Model(noise))
        return cls(scales, moments.target, implied, statistical, discrepancy, moments.taken)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of ``target`` with the discrepancy, u^4, (J, J)."""
        return self.statistical + np.diag((self.discrepancy * self.implied) ** 2)


@dataclass(frozen=True, eq=False)
class CurveCoefficients:
    """Coefficients of the regressors that a wavelet variance holds.

    values: (p,), u.
    covariance: (p, p), u^2.
    spread: (k, p * p), errors of ``covariance`` by each of k independent errors of the noise; with
        weights what it is less under each of k random walks.
    weights: (k,), probabilities of walks; empty where the fitted noise is taken alone.
    """

    values: FloatArray
    covariance: FloatArray
    spread: FloatArray
    weights: FloatArray

    @classmethod
    def of(cls, fit: Fit, *, may_lack: bool = False) -> CurveCoefficients:
        """By generalized least squares under the noise of a fit.

        Errors average over all random walks that the record allows, see
        `gmwm.estimate.problem.ramp`. Another term that came out as zero counts with its mean size
        within its limit.

        may_lack: Whether there may be a walk where the model has none.
        """
        wv, curve = fit.wv, fit.wv.regressors
        if curve is None:
            raise ValueError("the wavelet variance has no regressors")
        scales, regression = Scales.of(wv), CurveRegression(wv, curve)
        found = regression.estimated(scales.spectrum(fit.model))

        def covariance(model: Model) -> FloatArray:
            return regression.covariances(found, [scales.spectrum(model)])[0]

        open_keys = {*fit.keys, *fit.upper_bounds}
        walks = walks_beside(fit.model, open_keys, wv, may_lack=may_lack)
        if walks is not None:
            off, weights = walks.values - found.values, walks.weights
            each = walks.covariances + off[:, :, None] * off[:, None, :]
            total = np.tensordot(weights, each, 1)
            spread = (each - total).reshape(weights.size, -1)
            return cls(curve.removed + found.values, total, spread, weights)
        total = covariance(fit.model)
        for item in fit.model.parameters:
            limit, term = fit.upper_bounds.get(item.key, np.inf), fit.model.terms[item.term]
            if fit.params[item.key] == 0.0 and np.isfinite(limit) and limit > 0.0:
                largest = term.with_values(**{item.parameter.name: float(limit)})
                total = total + tuning.MEAN_OF_LIMIT * covariance(Model((largest,)))
        spread = _noise_errors(regression, found, fit.model, fit.keys, fit.covariance)
        return cls(curve.removed + found.values, total, spread, np.zeros(0))

    def errors(self, contrast: FloatArray, level: float) -> FloatArray:
        """Half the interval of ``contrast @ values``, u, (m,), for contrasts (m, p).

        Over walks it holds the probability of their mixture. Else it is Student's: a variance that
        is known to a relative error of r has 2/r^2 degrees of freedom (Satterthwaite 1946,
        *Biometrics Bulletin* 2, 110-114).
        """
        size = contrast.shape[1]
        variance = np.einsum("ki,ij,kj->k", contrast, self.covariance, contrast)
        off = np.einsum("ki,mij,kj->km", contrast, self.spread.reshape(-1, size, size), contrast)
        if not self.weights.size:
            square = np.sum(off**2, axis=1)
            dof = np.full_like(square, np.inf)
            dof = np.maximum(np.divide(2.0 * variance**2, square, out=dof, where=square > 0.0), 1.0)
            half = student.ppf(0.5 + 0.5 * level, dof) * np.sqrt(np.maximum(variance, 0.0))
            return np.asarray(half)
        deviation = np.sqrt(np.maximum(variance[:, None] + off, 0.0)) + np.finfo(float).tiny
        low, high = np.zeros(len(contrast)), _FARTHEST * np.max(deviation, axis=1)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            outside = 2.0 * norm.sf(middle[:, None] / deviation) @ self.weights
            low, high = np.where(outside > 1.0 - level, (middle, high), (low, middle))
        return high


def _noise_errors(
    regression: Regression,
    found: Coefficients,
    model: Model,
    keys: Sequence[str],
    covariance: FloatArray,
) -> FloatArray:
    """Errors of the coefficients' covariance by each of k independent ones of the noise, (k, p p).

    keys, covariance: Estimated parameters of a model, and (d, d), their covariance.
    """
    scales, deviation = Scales.of(regression.wv), np.sqrt(np.diag(covariance))
    changes = np.zeros((len(keys), found.covariance.size))
    for row, key in enumerate(keys):
        value = model.params[key] or 0.0
        step = _COEFFICIENT_STEP * min(deviation[row], abs(value))
        ends = (model.with_params({key: value + sign * step}) for sign in (1.0, -1.0))
        if step > 0.0:
            above, below = regression.covariances(found, [scales.spectrum(each) for each in ends])
            changes[row] = (above - below).ravel() / (2.0 * step)
    values, vectors = np.linalg.eigh(covariance) if len(keys) else (np.zeros(0), changes)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))).T @ changes)


def slope_dof(
    model: Model, keys: Sequence[str], covariance: FloatArray, wv: WaveletVariance
) -> float:
    """Degrees of freedom of the variance of a ramp's slope, see `CurveCoefficients.errors`.

    keys, covariance: Estimated parameters of a model, and (d, d), their covariance.
    """
    noise = Model(tuple(term for term in model.terms if not term.is_drift) or model.terms)
    own = [k for k, key in enumerate(keys) if key in noise.params]
    if not own or not all(term.has_spectrum() for term in noise.terms) or not _has_power(noise):
        return np.inf
    regression = RampRegression(wv)
    found = regression.estimated(noise.psd)
    own_keys, own_covariance = [keys[k] for k in own], covariance[np.ix_(own, own)]
    error = _noise_errors(regression, found, noise, own_keys, own_covariance)
    square = float(np.sum(error**2))
    return 2.0 * found.variance**2 / square if square > 0.0 else np.inf


def _has_power(noise: Model) -> bool:
    """Whether some term has an amplitude."""
    linear = [(term, term.linear_parameter) for term in noise.terms]
    return any(found is None or term.values[found.name] != 0.0 for term, found in linear)


def weight_root(covariance: FloatArray) -> FloatArray:
    """L with L'L the inverse of a covariance matrix, computed on its correlations."""
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(correlation)
    # Rounding errors must not decide the weights of levels that are nearly copies of each other.
    values = np.maximum(values, 1e-8 * values[-1])
    return np.asarray((vectors / np.sqrt(values)).T / scale)


def chi_square(
    target: FloatArray,
    implied: FloatArray,
    covariance: FloatArray,
    basis: FloatArray,
    taken: FloatArray | float = 0.0,
) -> tuple[FloatArray, float]:
    """Standardised residuals per level and their chi-square, on the cube-root scale.

    ``basis`` (J,) are the wavelet variances to which ``covariance`` belongs. A wavelet variance of
    few degrees of freedom is far from normal, its cube root is not (Wilson & Hilferty 1931, *PNAS*
    17, 684-688). That holds for the variance of the detrended data, to which ``target`` adds what
    the slope took (J,): a constant, which no cube root may hide.
    """
    taken = np.minimum(taken, tuning.LARGEST_TAKEN * np.minimum(implied, basis))
    target, implied, basis = target - taken, implied - taken, basis - taken
    scale = np.sqrt(np.diag(covariance))
    share = (scale / basis) ** 2 / 9.0  # 2/(9 dof)
    root, expected = np.cbrt(target / basis), np.cbrt(implied / basis) * (1.0 - share)
    standard = (root - expected) / np.sqrt(share)
    whitened = weight_root(covariance / np.outer(scale, scale)) @ standard
    return standard, float(whitened @ whitened)


@dataclass(frozen=True, eq=False)
class Compared:
    """Wavelet variances of the data without the drift, beside those of a fitted model, (J,).

    statistical: (J, J), covariance without discrepancy, of the wavelet variances ``basis``.
    taken: See `chi_square`.
    """

    target: FloatArray
    implied: FloatArray
    statistical: FloatArray
    basis: FloatArray
    taken: FloatArray

    @property
    def residual(self) -> FloatArray:
        """Of the model, (J,)."""
        return self.target - self.implied

    def at(self, levels: NDArray[np.intp]) -> Compared:
        """Some levels of it."""
        rows = (each[levels] for each in (self.target, self.implied, self.basis, self.taken))
        target, implied, basis, taken = rows
        return Compared(target, implied, self.statistical[np.ix_(levels, levels)], basis, taken)

    def chi_square(self, covariance: FloatArray) -> float:
        """See `chi_square`; NaN where a basis is not positive."""
        if not np.all(self.basis > 0.0):
            return float("nan")
        return chi_square(self.target, self.implied, covariance, self.basis, self.taken)[1]
