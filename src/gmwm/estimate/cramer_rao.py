"""Lower bounds on the covariance of estimates: of any estimates, and from wavelet variances."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gmwm._core import checks
from gmwm._core.documents import Array, Document, Interval, Samples, Text, check_covariance
from gmwm._core.frozen import freeze
from gmwm._core.text import cell, per_cent, plain_table, wrapped
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.likelihood.conclusion import regular_inverse
from gmwm.estimate.likelihood.kalman import Recursion, accumulated, filtered
from gmwm.estimate.likelihood.likelihood import Columns, arrays_of, stacked
from gmwm.estimate.problem.information import spectral_information
from gmwm.estimate.problem.moments import weight_root
from gmwm.estimate.problem.parameters import Coordinates, difference
from gmwm.estimate.problem.ramp import Slope, detrended_covariance
from gmwm.estimate.result.conclusion import Estimates
from gmwm.process import Model, Process, StateSpace, as_model
from gmwm.variance import MIN_SAMPLES
from gmwm.variance.covariance import dyadic_levels, haar_covariance, mean_covariance

_MOST_WORK = 1e9  # multiplications of the exact recursion, some seconds
_VAGUE = 1e6  # variance of the unknown constant, in variances of the series
_STEP = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class CramerRao(Document):
    """How well the parameters of a model can be known from a record.

    Attributes
    ----------
    model : Model
    n : int
        Samples of the record.
    dt : float
        Sampling interval, s.
    keys : tuple of str
        The parameters.
    covariance : (p, p) ndarray
        Lower bound (Cramer-Rao) on the covariance of any unbiased estimate, in products of the
        parameters' SI units. An unknown constant offset is allowed for.
    wavelet_covariance : (p, p) ndarray
        The same for estimates from the Haar wavelet variances alone (and a generalized
        least-squares slope).
    exact : bool
        Whether ``covariance`` is from the exact Gaussian information; from the spectral
        approximation if not.
    """

    SCHEMA: ClassVar[str] = "gmwm.cramer-rao"
    KEYS: ClassVar[Mapping[str, str]] = {"dt": "dt_s"}

    model: Model
    n: Samples
    dt: Interval
    keys: tuple[Text, ...]
    covariance: Array
    wavelet_covariance: Array
    exact: bool

    def __post_init__(self) -> None:
        freeze(self, "covariance", "wavelet_covariance")

    def __repr__(self) -> str:
        return f"<CramerRao of {self.model!r}, n = {self.n:,}, dt = {self.dt:g} s>"

    def check_content(self) -> None:
        if not {*self.keys} <= {*self.model.params}:
            raise ValueError(f"keys do not match the model {self.model!r}")
        check_covariance(self.covariance.tolist(), len(self.keys))
        check_covariance(self.wavelet_covariance.tolist(), len(self.keys), "wavelet_covariance")

    @property
    def stderr(self) -> dict[str, float]:
        """Smallest standard error of each parameter, SI."""
        return self._by_key(self.covariance)

    @property
    def wavelet_stderr(self) -> dict[str, float]:
        """Smallest standard error of each parameter from wavelet variances, SI."""
        return self._by_key(self.wavelet_covariance)

    def _by_key(self, covariance: FloatArray) -> dict[str, float]:
        return dict(zip(self.keys, map(float, np.sqrt(np.diag(covariance))), strict=True))

    def __str__(self) -> str:
        how = "exact Gaussian information" if self.exact else "spectral information"
        title = wrapped(self.model.title(), indent=2)
        rows = []
        for key, best, moments in zip(
            self.keys, self.stderr.values(), self.wavelet_stderr.values(), strict=True
        ):
            value = float(self.model.params[key] or 0.0)
            shares = [per_cent(error / (abs(value) or 1.0), 3) for error in (best, moments)]
            rows.append([key, cell(value, 5), *shares, f"{moments / best:.3f}"])
        heads = ["parameter", "value", "Cramer-Rao", "wavelet var.", "ratio"]
        size = f"{self.n:,} samples at {1.0 / self.dt:g} Hz; {how}"
        end = "bounds are standard errors in per cent of the value"
        return "\n".join([*title, size, "", plain_table(heads, rows), "", end])


def cramer_rao(
    model: Process | Model | str, n: int, dt: float | None = None, *, rate: float | None = None
) -> CramerRao:
    """Lower bound on the covariance of any unbiased estimate of a model's parameters.

    Parameters
    ----------
    model : Process or Model
        With all parameters given; all of them count as unknown.
    n : int
        Samples of the record, 8 or more.
    dt, rate : float
        Sampling interval, s, or rate, Hz.

    Returns
    -------
    CramerRao

    Raises
    ------
    InputError
        If a parameter is open or an amplitude is zero, for a `Sinusoid` (a line is not a random
        process) and for a record or interval that is none.

    Notes
    -----
    Exact for short records of models with a finite state space, from derivatives of the Kalman
    filter's innovations; otherwise the spectral integral of Whittle (1953) from 1/(4 n dt) to
    1/(2 dt). That is an approximation, good to 1 % where a parameter shows at many frequencies;
    for one that shows at the lowest few alone (a bound of half its value or more) it may be off
    by 10 %, and then an estimate may be that much better than "best". For wavelet variances of
    covariance Sigma with derivatives D the bound is (D' Sigma^-1 D)^-1, where the information is
    held to that of the whole series: no wavelet standard error is below the Cramer-Rao one.

    Examples
    --------
    >>> import gmwm
    >>> truth = gmwm.WhiteNoise(N=0.2) + gmwm.RandomWalk(K=0.02)
    >>> bound = gmwm.cramer_rao(truth, n=6000, dt=1.0)
    >>> round(bound.stderr["N"], 5), round(bound.stderr["K"], 5)
    (0.00192, 0.00117)
    """
    model = as_model(model)
    n, dt = checks.samples(n, MIN_SAMPLES), checks.sampling_interval(dt, rate)
    model.require_given()
    for item in model.parameters:
        if item.parameter.linear and not (item.value or 0.0) > 0.0:
            raise InputError(f"{item.key} is zero: leave its process out")
    if any(term.is_line for term in model.terms):
        raise InputError("a Sinusoid is a line, not a random process: leave it out")
    coordinates = Coordinates(model.opened())
    processes = tuple(model.terms[term.place] for term in coordinates.terms)
    exact = _is_short(coordinates, processes, n, dt)
    if exact:
        information = _exact_information(coordinates, processes, n, dt)
    else:
        information = spectral_information(coordinates, processes, n, dt)
    ramp = next((term for term in model.terms if term.is_drift), None)
    slope = None
    if ramp is not None:
        slope = Slope(ramp.drift_rate(), _slope_variance(processes, n, dt))
    moments = _held_to(information, _wavelet_information(coordinates, processes, n, dt, slope))
    everything = range(len(coordinates.owners))
    found = [
        Estimates(coordinates, processes, everything, regular_inverse(matrix), {}, slope).by_key()
        for matrix in (information, moments)
    ]
    (_, keys, series, _), (_, _, variances, _) = found
    return CramerRao(model, int(n), float(dt), keys, series, variances, exact)


def _is_short(coordinates: Coordinates, processes: Sequence[Process], n: int, dt: float) -> bool:
    """Whether the exact recursion exists (flicker noise has no finite state) and is quick."""
    if not all(process.has_finite_state_space for process in processes):
        return False
    try:
        states = stacked(processes, dt).n_states + 1
    except InputError:
        return False
    return n * (states * (1 + len(coordinates.owners))) ** 3 <= _MOST_WORK


def _slope_variance(processes: Sequence[Process], n: int, dt: float) -> float:
    """Variance of the generalized least-squares slope, (u/s)^2."""
    return Columns(np.zeros(n), dt, None, True).slope(processes).variance


def _wavelet_information(
    coordinates: Coordinates, processes: Sequence[Process], n: int, dt: float, slope: Slope | None
) -> FloatArray:
    """Information of the coordinates in the Haar wavelet variances, (d, d)."""
    tau = dyadic_levels(n) * dt
    noise = Model(tuple(processes))
    covariance = haar_covariance(noise.psd, n, dt)
    if slope is not None:
        means = mean_covariance(noise.psd, n, dt)
        covariance = detrended_covariance(covariance, means, 0.5 * tau, slope)
    z = coordinates.pack(processes)

    def curves(at: FloatArray) -> FloatArray:
        return np.array([p.haar_variance(tau, dt) for p in coordinates.processes(at, processes)])

    def taken(at: FloatArray) -> FloatArray:
        variance = _slope_variance(coordinates.processes(at, processes), n, dt)
        return np.asarray((0.5 * tau) ** 2 * variance)

    columns, own = [], curves(z)
    for k, (i, is_amplitude) in enumerate(coordinates.owners):
        column = own[i] if is_amplitude else difference(curves, z, k, _STEP)[i]
        columns.append(column if slope is None else column - difference(taken, z, k, _STEP))
    slopes = weight_root(covariance) @ np.stack(columns, axis=1)
    return np.asarray(slopes.T @ slopes)


def _held_to(most: FloatArray, information: FloatArray) -> FloatArray:
    """The information, limited in every direction to that of the series itself, (d, d)."""
    root = np.linalg.cholesky(regular_inverse(most))
    values, vectors = np.linalg.eigh(root.T @ information @ root)
    back = np.linalg.solve(root.T, vectors)
    return np.asarray((back * np.minimum(values, 1.0)) @ back.T)


def _exact_information(
    coordinates: Coordinates, processes: Sequence[Process], n: int, dt: float
) -> FloatArray:
    """Expected information of the coordinates in n Gaussian samples, (d, d).

    The sum over samples of E (d v)(d v)'/s + (d s)(d s)'/(2 s^2) for innovations v of variance s
    (Schweppe 1965, *IEEE Trans. Information Theory* 11, 61-70).
    """
    z = coordinates.pack(processes)
    level = float(np.mean(stacked(processes, dt).output_variance(min(n, 256))))
    # The unknown constant is the last state.
    constant = StateSpace.scalar("constant", 1.0, 0.0, level * _VAGUE)

    def run(at: FloatArray) -> Recursion:
        own = stacked(coordinates.processes(at, processes), dt)
        space = StateSpace.stack([own, constant])
        nothing = np.zeros((1, space.n_states))
        found = filtered(arrays_of(space), np.zeros((n, 1)), nothing, nothing)
        return Recursion(space.transition, space.output, found.gains, found.variances)

    slopes = []
    for k in range(z.size):
        move = _STEP * np.eye(z.size)[k]
        up, down = run(z + move), run(z - move)
        slopes.append([(a - b) / (2.0 * _STEP) for a, b in zip(up, down, strict=True)])
    derivatives = Recursion(*(np.stack(part) for part in zip(*slopes, strict=True)))
    return np.asarray(accumulated(run(z), derivatives))
