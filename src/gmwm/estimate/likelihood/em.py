"""Expectation-maximization on the state-space form.

Dempster, Laird & Rubin (1977), *JRSS B* 39, 1-38; Shumway & Stoffer (1982), *Journal of Time
Series Analysis* 3, 253-264; for inertial sensors Stebler, Guerrier, Skaloud & Victoria-Feser
(2011), *Measurement Science and Technology* 22, 085204. A constant and the slope of a ramp have
flat priors, so that the iteration climbs the likelihood of `gmwm.estimate.likelihood.likelihood`.
Its steps are extrapolated (the squared iterative method of Varadhan & Roland 2008, *Scandinavian
Journal of Statistics* 35, 335-353), as plain EM needs thousands of them.

White noise, random walks and Gauss-Markov processes have an M step in closed form. The stationary
first state of a Gauss-Markov process takes part in it, so that the iteration climbs the exact
likelihood; its maximum is the root of a cubic (Beach & MacKinnon 1978, *Econometrica* 46, 51-58).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.likelihood.conclusion import (
    Maximum,
    Top,
    conclude_likelihood,
    observed_information,
    redundant_term,
)
from gmwm.estimate.likelihood.kalman import smooth
from gmwm.estimate.likelihood.likelihood import (
    Columns,
    KalmanLikelihood,
    Regression,
    Series,
    arrays_of,
    objective_of,
    stacked,
)
from gmwm.estimate.problem.information import spectral_information
from gmwm.estimate.problem.ramp import ols_slope
from gmwm.estimate.result.fit import Fit
from gmwm.issues import notice
from gmwm.process import Model, Process, StateSpace, as_model
from gmwm.readers import Channel
from gmwm.variance import as_wavelet_variance

DRIFTS = ("ramp", "state", "removed")
_TINY = 1e-12  # keeps the stopping rule defined where the log-likelihood is zero
_FASTEST, _SLOWEST = 1.0 - 1e-12, 1e-12  # of 1 - phi


@dataclass(frozen=True)
class EM:
    """Expectation-maximization, ``method="em"``.

    For white noise, random walk, Gauss-Markov processes and a rate ramp.

    Parameters
    ----------
    start : Process or Model, optional
        The same model with starting values; by default the estimates of the method of moments.
    tolerance : float, optional
        It stops when the log-likelihood gains less than this fraction of itself.
    max_iterations : int, optional
    accelerate : bool, optional
        Whether steps are extrapolated.
    drift : {"ramp", "state", "removed"}, optional
        A ramp added to the signal; an input to the first state as in Stebler et al. (2011), which a
        Gauss-Markov state forgets; or a line of ordinary least squares that is removed before, as
        in Stebler et al. (2012), without a standard error.

    Raises
    ------
    InputError
        For a value that is not one of these.
    """

    start: Process | Model | None = None
    tolerance: float = 1e-10
    max_iterations: int = 10_000
    accelerate: bool = True
    drift: str = "ramp"

    name: ClassVar[str] = "em"

    def __post_init__(self) -> None:
        if self.start is not None:
            as_model(self.start)
        checks.positive("tolerance", self.tolerance, "give a small positive number, e.g. 1e-10")
        checks.whole("max_iterations", self.max_iterations, 1)
        checks.truth("accelerate", self.accelerate)
        checks.choice("drift", self.drift, DRIFTS)

    def estimate(self, model: Model, channel: Channel) -> Fit:
        """Fit the open parameters of a model to samples, some of which may be missing."""
        for term in model.terms:
            if not (term.is_white or term.is_walk or term.is_exponential or term.is_drift):
                raise InputError(
                    f'method = "em" does not support {term!r}: it takes WhiteNoise, RandomWalk, '
                    'RateRamp and GaussMarkov; "mle" supports the others, "gmwm" a Sinusoid too'
                )
        if self.drift == "removed":
            line = ols_slope(as_wavelet_variance(channel, None)).value
            ramps = [t.with_values(R=line) if t.is_drift and t.is_open else t for t in model.terms]
            model = Model(tuple(ramps))
        series = Series.of(model, channel, self.start, exact=True)
        iteration = Iteration(series, self.drift == "state")
        return _conclude(series, iteration, *iteration.run(self))


@dataclass(frozen=True, eq=False)
class Stage:
    """Parameters during the iteration.

    initial, drive: (p,), mean of the first state and input of each step, where the drift enters a
        state; zero otherwise.
    """

    processes: tuple[Process, ...]
    initial: FloatArray
    drive: FloatArray


@dataclass(frozen=True, eq=False)
class Expectation:
    """The moments that the M step needs, for p states.

    later, cross, earlier: (p, p), sums over k of E x[k+1] x[k+1]', E x[k+1] x[k]' and E x[k] x[k]'.
    first: (p, p), E x[0] x[0]'.
    start, later_sum, earlier_sum: (p,), E x[0] and the sums of E x[k+1] and E x[k].
    residual: Sum of the expected squares of the measurement noise.
    log_likelihood: Of the parameters that the expectation was taken under.
    """

    later: FloatArray
    cross: FloatArray
    earlier: FloatArray
    first: FloatArray
    start: FloatArray
    later_sum: FloatArray
    earlier_sum: FloatArray
    steps: int
    residual: float
    count: int
    log_likelihood: float


def expect(
    columns: Columns, space: StateSpace, initial: FloatArray, drive: FloatArray
) -> Expectation:
    """Smooth the series under a state space, with the regressors' coefficients integrated out.

    initial, drive: (p,), mean of the first state and constant input of each step.
    """
    y, h, p = columns.matrix, space.output, space.n_states
    n, m = y.shape
    starts, inputs = np.zeros((m, p)), np.zeros((m, p))
    starts[0], inputs[0] = initial, drive
    x, c, d, v, s = smooth(arrays_of(space), y, starts, inputs)
    present = np.isfinite(s)
    innovations = v[present] / np.sqrt(s[present])[:, None]
    regression = Regression.of(innovations.T @ innovations)
    weights = np.concatenate([[1.0], -regression.beta])
    mean = np.einsum("c,kci->ki", weights, x)
    # The uncertainty of the coefficients adds to the covariance of the states.
    root = np.linalg.cholesky(regression.covariance) if m > 1 else np.zeros((0, 0))
    spread = np.einsum("kci,ce->kei", x[:, 1:], root)

    def second(a: slice, b: slice, covariance: FloatArray) -> FloatArray:
        total = mean[a].T @ mean[b] + covariance.sum(axis=0)
        return np.asarray(total + np.tensordot(spread[a], spread[b], axes=([0, 1], [0, 1])))

    last, first = slice(1, None), slice(None, -1)
    seen = y[present]
    residual = seen @ weights - mean[present] @ h
    unknown = seen[:, 1:] @ root - spread[present] @ h
    of_states = np.einsum("i,kij,j->", h, c[present], h)
    count = int(np.sum(present))
    return Expectation(
        later=second(last, last, c[1:]),
        cross=second(last, first, d),
        earlier=second(first, first, c[:-1]),
        first=second(slice(0, 1), slice(0, 1), c[:1]),
        start=mean[0],
        later_sum=mean[1:].sum(axis=0),
        earlier_sum=mean[:-1].sum(axis=0),
        steps=n - 1,
        residual=float(residual @ residual + np.sum(unknown**2) + of_states),
        count=count,
        log_likelihood=regression.log_likelihood(count, float(np.sum(np.log(s[present])))),
    )


class Iteration:
    """The EM iteration of one series.

    in_state: Whether the drift is an input to the first state, as in Stebler et al. (2011). Then
        the mean of the series is removed, the mean of the first state is estimated, and its
        covariance is that of one step.
    Raises InputError if the drift is to enter a state and there is none, or no drift to estimate.
    """

    def __init__(self, series: Series, in_state: bool) -> None:
        self.series, self.in_state = series, in_state
        self._terms = series.coordinates.noise
        self.columns, self.dt = series.columns, series.columns.dt
        if in_state:
            if not self.columns.drift_is_free:
                raise InputError('drift = "state" needs a RateRamp() of free slope in the model')
            if all(term.is_white for term in self._terms):
                raise InputError('drift = "state" needs a RandomWalk or GaussMarkov in the model')
            self.columns = Columns.without_regressors(series.columns.centred, self.dt)

    def expectation(self, stage: Stage) -> Expectation:
        """The E step."""
        space = stacked(stage.processes, self.dt)
        if self.in_state:
            space = replace(space, initial_covariance=space.process_noise)
        return expect(self.columns, space, stage.initial, stage.drive)

    def maximization(self, stage: Stage, e: Expectation) -> Stage:
        """The M step: open parameters in closed form, given ones stay."""
        drive = stage.drive
        # Remove the input from the later state: E (x[k+1] - u)(...)'.
        later = e.later - np.outer(drive, e.later_sum) - np.outer(e.later_sum, drive)
        later = later + e.steps * np.outer(drive, drive)
        cross = e.cross - np.outer(drive, e.earlier_sum)
        processes, k = [], 0
        for process, like in zip(stage.processes, self._terms, strict=True):
            if process.is_white:
                if like.values["N"] is None:
                    density = float(np.sqrt(e.residual / e.count * self.dt))
                    process = process.with_values(N=density)
                processes.append(process)
                continue
            own = tuple(float(m[k, k]) for m in (later, cross, e.earlier, e.first))
            if not process.is_walk:
                process = _gauss_markov(process, like, own, e.steps, self.dt)
            elif like.values["K"] is None:
                squares = own[0] - 2.0 * own[1] + own[2]
                process = process.with_values(K=float(np.sqrt(squares / e.steps / self.dt)))
            processes.append(process)
            k += 1
        if not self.in_state:
            return Stage(tuple(processes), stage.initial, drive)
        transition = stacked(processes, self.dt).transition
        drift = (e.later_sum - transition @ e.earlier_sum) / e.steps
        return Stage(tuple(processes), e.start, np.where(np.arange(drift.size) == 0, drift, 0.0))

    def run(self, method: EM) -> tuple[Stage, list[float], bool]:
        """Iterate; returns the best stage, the log-likelihoods, and whether it converged.

        Each of the log-likelihoods is after one M step; none is below the one before.
        """
        nothing = np.zeros(sum(not process.is_white for process in self._terms))
        stage = Stage(self.series.start, nothing, nothing)
        e = self.expectation(stage)
        trace: list[float] = []
        while len(trace) < method.max_iterations:
            previous, before = stage, e.log_likelihood
            first = self.maximization(stage, e)
            after = self.expectation(first)
            if not after.log_likelihood > before:  # rounding errors, at the top
                return stage, [*trace, before], True
            trace.append(after.log_likelihood)
            stage, e = first, after
            if method.accelerate and len(trace) < method.max_iterations:
                stage, e = self._extrapolated(previous, first, e)
                trace.append(e.log_likelihood)
            gain = e.log_likelihood - before
            if gain < method.tolerance * (0.5 * abs(e.log_likelihood + before) + _TINY):
                return stage, trace, True
        return stage, trace, False

    def _extrapolated(
        self, stage: Stage, first: Stage, reached: Expectation
    ) -> tuple[Stage, Expectation]:
        """A long step in the direction of two, if it climbs; else the second, if that does."""
        second = self.maximization(first, reached)
        coordinates = self.series.coordinates
        zs = [coordinates.pack(s.processes) for s in (stage, first, second)]
        r, v = zs[1] - zs[0], zs[2] - 2.0 * zs[1] + zs[0]
        norm, length = float(np.linalg.norm(v)), 1.0
        if norm > 0.0:
            length = min(float(np.linalg.norm(r)) / norm, tuning.LONGEST_EXTRAPOLATION)
        step = 2.0 * length * r + length**2 * v
        # Where an amplitude has all but vanished EM hardly moves: do not jump there.
        is_near = np.max(np.abs(step), initial=0.0) < tuning.FARTHEST_EXTRAPOLATION
        if length > 1.0 and not self.in_state and is_near:
            try:
                far = replace(stage, processes=coordinates.processes(zs[0] + step, stage.processes))
                with np.errstate(all="ignore"):
                    e = self.expectation(far)
                if e.log_likelihood >= reached.log_likelihood:
                    return far, e
            except (InputError, np.linalg.LinAlgError, ZeroDivisionError):
                pass  # no parameters there
        e = self.expectation(second)
        return (second, e) if e.log_likelihood >= reached.log_likelihood else (first, reached)


def _gauss_markov(
    process: Process, like: Process, moments: tuple[float, ...], steps: int, dt: float
) -> Process:
    """A Gauss-Markov process with the parameters of the M step that ``like`` has open."""
    n, sigma = steps + 1, like.values["sigma"]
    later, cross, earlier, first = moments
    delta = -float(np.expm1(-dt / float(process.values["tau"] or np.inf)))  # 1 - phi
    drift = Polynomial([1.0, -1.0])  # phi in terms of 1 - phi, whose digits matter
    loss = Polynomial([0.0, 2.0, -1.0])  # 1 - phi^2
    squares = later - 2.0 * cross * drift + earlier * drift**2
    if like.values["tau"] is None:
        total = squares + first * loss
        if sigma is None:
            condition = n * total.deriv() * loss - total * loss.deriv()
        else:
            condition = steps * sigma**2 * loss.deriv() * loss
            condition = condition + squares.deriv() * loss - squares * loss.deriv()

        def log_likelihood(delta: float) -> float:
            size = float(loss(delta))
            if sigma is None:
                return float(-0.5 * (n * np.log(total(delta)) - np.log(size)))
            return -0.5 * (steps * np.log(size) + float(squares(delta)) / sigma**2 / size)

        # The root between 0 and 1 of highest likelihood; the present value where there is none.
        inside = [
            float(root.real)
            for root in np.atleast_1d(condition.roots())
            if abs(root.imag) < 1e-9 * max(abs(root), 1e-300) and _SLOWEST < root.real < _FASTEST
        ]
        delta = max([*inside, min(delta, _FASTEST)], key=log_likelihood)
        process = process.with_values(tau=float(-dt / np.log1p(-delta)))
    if sigma is None:
        variance = (float(squares(delta)) / float(loss(delta)) + first) / n
        process = process.with_values(sigma=float(np.sqrt(variance)))
    return process


def _conclude(
    series: Series, iteration: Iteration, stage: Stage, trace: Sequence[float], converged: bool
) -> Fit:
    coordinates, columns, processes = series.coordinates, series.columns, stage.processes
    likelihood = KalmanLikelihood(columns)
    notices = []
    if not converged:
        values, hint = {"iterations": len(trace)}, "allow more, or start closer"
        notices.append(notice("not-converged", "", values, variant="em", hint=hint))
    absent: list[int] = []  # terms on their way to zero, which EM never reaches
    while True:
        present = [i for i in range(len(processes)) if i not in absent]
        part, left = coordinates.without(absent), tuple(processes[i] for i in present)
        if not converged or iteration.in_state:
            break
        redundant = redundant_term(part, left, likelihood)
        if redundant is None:
            break
        absent.append(present[redundant])
    # The expected information stands in where there is no maximum.
    objective, z = objective_of(likelihood, part, left), part.pack(left)
    expected = spectral_information(part, left, columns.n, columns.dt)
    observed = observed_information(objective, z, expected)
    is_maximum = bool(np.all(np.linalg.eigvalsh(observed) > 0.0))
    information = observed if is_maximum else expected
    top = Top(part, left, Maximum(z, objective(z), is_maximum), information, likelihood)
    if not is_maximum:
        hint = "lower the tolerance"
        notices.append(notice("not-converged", variant="no-maximum", hint=hint))
    drift = None
    if iteration.in_state:
        drift = float(stage.drive[0]) / iteration.dt
        first = next(p for p in processes if not p.is_white)
        if not first.is_walk:
            notices.append(notice("drift-in-state", term=first.title()))
    return conclude_likelihood(series, processes, absent, top, "em", notices, trace, drift)
