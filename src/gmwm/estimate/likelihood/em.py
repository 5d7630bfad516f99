"""Expectation-maximization on the state-space form.

Dempster, Laird & Rubin (1977), *JRSS B* 39, 1-38; Shumway & Stoffer (1982), *Journal of Time
Series Analysis* 3, 253-264; for inertial sensors Stebler, Guerrier, Skaloud & Victoria-Feser
(2011), *Measurement Science and Technology* 22, 085204. A constant and the slope of a ramp have
flat priors, so that the iteration climbs the likelihood of `gmwm.estimate.likelihood.likelihood`.
Its steps are extrapolated (the squared iterative method of Varadhan & Roland 2008, *Scandinavian
Journal of Statistics* 35, 335-353), as plain EM needs thousands of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gmwm._core import checks
from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.likelihood.conclusion import (
    Top,
    conclude_likelihood,
    redundant_term,
    upper_bound,
)
from gmwm.estimate.likelihood.expectation import Expectation, expect
from gmwm.estimate.likelihood.likelihood import (
    Columns,
    KalmanLikelihood,
    LogLikelihood,
    objective_of,
)
from gmwm.estimate.likelihood.maximization import (
    StateMoments,
    check_supported,
    em_space,
    updated,
    white,
)
from gmwm.estimate.likelihood.scoring import Maximum, observed_information, regular_inverse
from gmwm.estimate.likelihood.series import Series
from gmwm.estimate.problem import Coordinates, Slope, spectral_information
from gmwm.estimate.result import Estimates, Fit
from gmwm.process import Model, Process, StateSpace, as_model
from gmwm.readers import Channel

DRIFTS = ("ramp", "state")
_TINY = 1e-12  # keeps the stopping rule defined where the log-likelihood is zero


@dataclass(frozen=True, eq=False)
class Stage:
    """Parameters during the iteration.

    initial, drive: (p,) or None, mean of the first state and input of each step, where the drift
        enters a state.
    """

    processes: tuple[Process, ...]
    initial: FloatArray | None = None
    drive: FloatArray | None = None


@dataclass(frozen=True)
class EM:
    """Expectation-maximization, ``method="em"``.

    Parameters
    ----------
    start : Process or Model, optional
        The same model with starting values; by default the estimates of the method of moments.
    tolerance : float, optional
        It stops when the log-likelihood gains less than this fraction of itself.
    max_iterations : int, optional
    accelerate : bool, optional
        Whether steps are extrapolated.
    drift : {"ramp", "state"}, optional
        A ramp added to the signal, or an input to the first state as in Stebler et al. (2011),
        which a Gauss-Markov state forgets.

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
        for process in Coordinates(model).noise:
            check_supported(process)
        series = Series.of(model, channel, self.start, gaps=True)
        iteration = Iteration(series, self.drift == "state")
        run = iteration.run(self.tolerance, int(self.max_iterations), self.accelerate)
        return _concluded(series, iteration, *run)


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
        self.columns = series.columns
        if in_state:
            if not self.columns.drift_is_free:
                raise InputError('drift = "state" needs a RateRamp() of free slope in the model')
            if all(term.is_white for term in self._terms):
                raise InputError('drift = "state" needs a RandomWalk or GaussMarkov to drive')
            self.columns = Columns.without_regressors(series.columns.centred, self.dt)

    @property
    def dt(self) -> float:
        """Sampling interval, s."""
        return self.series.columns.dt

    def expectation(self, stage: Stage) -> Expectation:
        """The E step."""
        space = StateSpace.stack([em_space(p, self.dt) for p in stage.processes])
        if not self.in_state:
            return expect(self.columns, space)
        held = StateSpace(
            space.transition,
            space.process_noise,
            space.output,
            space.measurement_noise,
            space.initial_mean,
            space.process_noise,
            space.names,
        )
        return expect(self.columns, held, stage.initial, stage.drive)

    def maximization(self, stage: Stage, e: Expectation) -> Stage:
        """The M step."""
        later, cross = e.later, e.cross
        drive = stage.drive
        if drive is not None:
            # Remove the input from what follows: E (x[k+1] - u)(...)'.
            later = later - np.outer(drive, e.later_sum) - np.outer(e.later_sum, drive)
            later = later + e.steps * np.outer(drive, drive)
            cross = cross - np.outer(drive, e.earlier_sum)
        processes = []
        position = 0
        for process, like in zip(stage.processes, self._terms, strict=True):
            if process.is_white:
                processes.append(white(process, like, e.residual, e.count, self.dt))
                continue
            size = em_space(process, self.dt).n_states
            block = np.ix_(*[range(position, position + size)] * 2)
            moments = StateMoments(
                later[block], cross[block], e.earlier[block], e.first[block], e.steps
            )
            processes.append(updated(process, like, moments, self.dt))
            position += size
        if not self.in_state:
            return Stage(tuple(processes))
        space = StateSpace.stack([em_space(p, self.dt) for p in processes])
        drift = (e.later_sum - space.transition @ e.earlier_sum) / e.steps
        drive = np.zeros(space.n_states)
        drive[0] = drift[0]
        return Stage(tuple(processes), e.start, drive)

    def run(
        self, tolerance: float, max_iterations: int, accelerate: bool
    ) -> tuple[Stage, list[float], bool]:
        """Iterate; returns the best stage, the log-likelihoods, and whether it converged.

        Each of the log-likelihoods is after one M step; none is below the one before.
        """
        stage = Stage(self.series.start)
        if self.in_state:
            size = sum(em_space(p, self.dt).n_states for p in stage.processes)
            stage = Stage(stage.processes, np.zeros(size), np.zeros(size))
        e = self.expectation(stage)
        trace: list[float] = []
        while len(trace) < max_iterations:
            previous, before = stage, e.log_likelihood
            first = self.maximization(stage, e)
            after = self.expectation(first)
            if not after.log_likelihood > before:
                # Rounding errors, or an M step that leaves the first state out, at the top.
                return stage, [*trace, before], True
            trace.append(after.log_likelihood)
            stage, e = first, after
            if accelerate and len(trace) < max_iterations:
                stage, e = self._extrapolated(previous, first, e)
                trace.append(e.log_likelihood)
            gain = e.log_likelihood - before
            if gain < tolerance * (0.5 * abs(e.log_likelihood + before) + _TINY):
                return stage, trace, True
        return stage, trace, False

    def _extrapolated(
        self, stage: Stage, first: Stage, reached: Expectation
    ) -> tuple[Stage, Expectation]:
        """A long step in the direction of two, if it climbs; else the second of them, if it does.

        ``reached`` is the expectation of the first.
        """
        second = self.maximization(first, reached)
        coordinates = self.series.coordinates
        zs = [coordinates.pack(s.processes) for s in (stage, first, second)]
        r, v = zs[1] - zs[0], zs[2] - 2.0 * zs[1] + zs[0]
        norm = float(np.linalg.norm(v))
        length = (
            min(float(np.linalg.norm(r)) / norm, tuning.LONGEST_EXTRAPOLATION)
            if norm > 0.0
            else 1.0
        )
        step = 2.0 * length * r + length**2 * v
        # Where an amplitude has all but vanished EM hardly moves: do not jump there.
        if (
            length > 1.0
            and not self.in_state
            and np.max(np.abs(step)) < tuning.FARTHEST_EXTRAPOLATION
        ):
            there = self._reached(zs[0] + step, stage)
            if there is not None and there[1].log_likelihood >= reached.log_likelihood:
                return there
        e = self.expectation(second)
        return (second, e) if e.log_likelihood >= reached.log_likelihood else (first, reached)

    def _reached(self, z: FloatArray, like: Stage) -> tuple[Stage, Expectation] | None:
        """The stage of these coordinates, where it is one."""
        try:
            stage = Stage(self.series.coordinates.processes(z, like.processes))
            with np.errstate(all="ignore"):
                return stage, self.expectation(stage)
        except (InputError, np.linalg.LinAlgError, ZeroDivisionError):
            return None


def _concluded(
    series: Series, iteration: Iteration, stage: Stage, trace: Sequence[float], converged: bool
) -> Fit:
    coordinates, columns = series.coordinates, series.columns
    notices = []
    if not converged:
        text = f"EM did not converge in {len(trace)} iterations: allow more, or start closer"
        notices.append(Notice("not-converged", "bad", "", text, {"iterations": len(trace)}))
    absent: list[int] = []
    if converged and not iteration.in_state:
        absent = _vanishing(coordinates, stage.processes, KalmanLikelihood(columns))
    part = coordinates.without(absent)
    top = _top(part, [p for i, p in enumerate(stage.processes) if i not in absent], columns)
    if not top.maximum.converged:
        text = "EM did not reach a maximum of the likelihood: lower the tolerance"
        notices.append(Notice("not-converged", "bad", "", text))
    slope = None
    if columns.drift_is_free:
        regression = KalmanLikelihood(columns).regression(top.processes)
        slope = Slope(*columns.slope(regression))
    if iteration.in_state and stage.drive is not None and slope is not None:
        slope = Slope(float(stage.drive[0]) / iteration.dt, slope.variance)
        first = next(p for p in stage.processes if not p.is_white)
        if not first.is_walk:
            text = f"a drift that enters the {first.title()} state is not a ramp of the signal"
            notices.append(Notice("drift-in-state", "bad", "", text))
    found = Estimates(
        coordinates=coordinates,
        processes=[
            p.with_amplitude(0.0) if i in absent else p for i, p in enumerate(stage.processes)
        ],
        covariance=regular_inverse(top.information),
        absent={i: upper_bound(stage.processes[i], part, top, columns) for i in absent},
        slope=slope,
    )
    return conclude_likelihood(
        series, found, method="em", log_likelihood=trace[-1], notices=notices, trace=trace
    )


def _top(coordinates: Coordinates, processes: Sequence[Process], columns: Columns) -> Top:
    """Where EM has arrived; the expected information where there is no maximum."""
    likelihood = KalmanLikelihood(columns)
    objective, z = objective_of(likelihood, coordinates, processes), coordinates.pack(processes)
    expected = spectral_information(coordinates, processes, columns.n, columns.dt)
    observed = observed_information(objective, z, expected)
    is_maximum = bool(np.all(np.linalg.eigvalsh(observed) > 0.0))
    information = observed if is_maximum else expected
    return Top(tuple(processes), Maximum(z, objective(z), is_maximum), information, likelihood)


def _vanishing(
    coordinates: Coordinates, processes: Sequence[Process], likelihood: LogLikelihood
) -> list[int]:
    """Terms on their way to zero, which EM never reaches."""
    absent: list[int] = []
    while True:
        present = [i for i in range(len(processes)) if i not in absent]
        redundant = redundant_term(
            coordinates.without(absent), [processes[i] for i in present], likelihood
        )
        if redundant is None:
            return absent
        absent.append(present[redundant])
