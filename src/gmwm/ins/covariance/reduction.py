"""Reduced sensor models: the best that a filter of few states can believe, and what it costs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from gmwm._core import checks
from gmwm._core.text import bullets
from gmwm._core.typing import FloatArray
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.covariance.analysis import Course
from gmwm.ins.filter import Aiding, Outage, gnss, odometry, poses, wheels
from gmwm.ins.imu import AXES, SensorModels
from gmwm.ins.simulation import Scenario
from gmwm.ins.trajectory import Trajectory, car_drive, fixed_wing_loiter
from gmwm.issues import Notice, notice
from gmwm.process import GaussMarkov, Model, RandomWalk, WhiteNoise

FORMS: dict[str, tuple[str, ...]] = {"N+K": ("N", "K"), "N+GM": ("N", "sigma", "tau")}
"""Forms of a reduced model, with their parameters."""


def _wheels(truth: Trajectory, _: float) -> Aiding:
    """With keyframes that measure nothing, from which the way in an outage counts."""
    interval = max(round(_WHEELS_EVERY / truth.dt), 1) * truth.dt
    return wheels(truth, interval) + odometry(truth, interval).unused()


AIDINGS: dict[str, Callable[[Trajectory, float], Aiding]] = {
    "gnss": lambda truth, _: gnss(truth),
    "pose": poses,
    "odometry": odometry,
    "wheels": _wheels,
}
"""What aids the filter of `loiter_with_outages`, given the trajectory and an interval, s."""

_POSITION_AND_VELOCITY = slice(0, 6)

_WHEELS_EVERY = 0.1  # s, or the nearest multiple of the sampling interval
_STEPS = 60
_SLOPE_STEP = 1e-4  # of the logarithms of factors, for slopes by differences
_FARTHEST = 12.0  # logarithm of a factor, beyond which numbers have no meaning any more


def smallest_score(
    score: Callable[[FloatArray], float], starts: Sequence[FloatArray]
) -> tuple[float, FloatArray]:
    """The search of all reduced numbers: the least score, and the logarithms of factors there.

    score: Of logarithms of factors on the numbers at the start of the search. To it comes a little
        of their squares, so that a factor which does not matter stays at one.
    starts: Where the search begins.
    """

    def cost(logs: FloatArray) -> float:
        # Finite beyond the farthest, too, where a line search may try: it takes differences.
        return score(np.clip(logs, -_FARTHEST, _FARTHEST)) + tuning.INERTIA * float(logs @ logs)

    options = {"eps": _SLOPE_STEP, "gtol": tuning.SLOPE, "maxiter": _STEPS}
    found = [minimize(cost, logs, method="BFGS", options=options) for logs in starts]
    best = min(found, key=lambda each: float(each.fun))
    return float(best.fun), np.clip(best.x, -_FARTHEST, _FARTHEST)


@dataclass(frozen=True)
class ReducedError:
    """Horizontal position error at the end of an outage, 1 sigma, m.

    duration: Of the outage, s.
    full: True error of the filter with the full model.
    read_off, reduced: With the reduced model read off an Allan plot, and with the one found; each
        also as predicted.
    nees: Expected normalised error squared of the position, per degree of freedom, of the latter.
    """

    duration: float
    full: float
    read_off: float
    read_off_predicted: float
    reduced: float
    reduced_predicted: float
    nees: float


@dataclass(frozen=True, eq=False)
class Reduction:
    """A reduced model of each sensor.

    Attributes
    ----------
    form : str
    models : SensorModels
    inflation : dict
        E.g. ``"gyro N"`` -> factor on what is read off an Allan plot: N where averaging begins, at
        1 s, K from the line of slope +1/2 through the deviation at the longest outage, sigma and
        tau from the height and place of its maximum beyond 1 s.
    errors : tuple of ReducedError
        One for each outage length.
    notices : tuple of Notice
        Where the errors are larger than a linear analysis can predict, and what motion they were
        judged on.
    """

    form: str
    models: SensorModels
    inflation: dict[str, float]
    errors: tuple[ReducedError, ...]
    notices: tuple[Notice, ...] = ()

    def __str__(self) -> str:
        factors = ", ".join(f"{name} x {value:.3g}" for name, value in self.inflation.items())
        lines = [
            f"Reduced model {self.form}, factors on what an Allan plot shows:",
            f"  {factors}",
            "",
            "Horizontal error at the end of an outage, 1 sigma [m]; in brackets as predicted",
            f"{'outage':>8} {'full model':>11} {'read off':>21} {'reduced':>21} {'NEES/dof':>9}",
        ]
        for row in self.errors:
            lines.append(
                f"{row.duration:>6g} s {row.full:>11.4g} "
                f"{row.read_off:>10.4g} ({row.read_off_predicted:>8.4g}) "
                f"{row.reduced:>10.4g} ({row.reduced_predicted:>8.4g}) {row.nees:>9.3g}"
            )
        return "\n".join([*lines, *bullets(self.notices)])


def reduce(
    models: SensorModels | Calibration | Mapping[str, Any],
    form: str = "N+K",
    outages: Sequence[float] = (10.0, 30.0, 60.0),
    *,
    scenario: Scenario | None = None,
    trajectory: Trajectory | None = None,
    dt: float = 0.01,
) -> Reduction:
    """The reduced model that makes a small filter consistent, and as accurate as it can be.

    Raises InputError if the form is unknown, there is no outage, or the trajectory is too short
    for them.

    Parameters
    ----------
    models : SensorModels, Calibration or mapping
        The truth; see `SensorModels.of`.
    form : {"N+K", "N+GM"}
        White noise and random walk, or white noise and one Gauss-Markov process, on each axis.
    outages : sequence of float, optional
        Lengths for which it shall be good, s.
    scenario : Scenario, optional
        Where; its outages in place of ``outages``.
    trajectory : Trajectory, optional
        The motion that it is for, with the outages two minutes apart and one GNSS position a second
        of 1 m (vertical 1.5 m). By default a loiter, which a notice reports.
    dt : float, optional
        Sampling interval of the IMU in the default scenario, s.

    Notes
    -----
    Factors on the parameters, common to the axes of a kind, minimise the expected negative
    logarithm of the predicted density at the true position and velocity before the first fix after
    each outage: a proper score, which punishes a covariance that is too small as it does one that
    is too large. The expectations come from `covariance_analysis`, exact for the truth given.
    """
    checks.choice("form", form, list(FORMS))
    truth = SensorModels.of(models)
    assumed = scenario is None and trajectory is None
    if scenario is None:
        scenario = loiter_with_outages(outages, dt, trajectory)
    if not scenario.outages:
        raise InputError("outages is empty: give at least one outage length in seconds")
    course = Course.of(scenario)
    longest = max(outage.duration for outage in scenario.outages)
    start = read_off(truth, form, longest, scenario.trajectory.dt)
    names = [f"{kind} {name}" for kind in ("gyro", "accel") for name in FORMS[form]]

    def scaled(logs: FloatArray) -> SensorModels:
        factors = dict(zip(names, map(float, np.exp(logs)), strict=True))
        changed: dict[str, Model] = {}
        for axis, model in start.models.items():
            kind = axis.partition("_")[0]
            values = {k: float(v or 0.0) * factors[f"{kind} {k}"] for k, v in model.params.items()}
            changed[axis] = model.with_params(values)
        return replace(start, models=changed)

    def score(logs: FloatArray) -> float:
        analysis = course.analyse(truth, scaled(logs))
        by_epoch = analysis.score(_POSITION_AND_VELOCITY)
        return float(np.sum([by_epoch[analysis.index(each.end)] for each in scenario.outages]))

    _, logs = smallest_score(score, [np.zeros(len(names))])
    best = scaled(logs)
    full, read, reduced = (course.analyse(truth, each) for each in (truth, start, best))
    deviations = (full.sd, read.sd, read.predicted_sd, reduced.sd, reduced.predicted_sd)
    errors = []
    for outage in scenario.outages:
        at = full.index(outage.end)
        a, b, c, d, e = (float(np.hypot(*sd[at, :2])) for sd in deviations)
        errors.append(ReducedError(outage.duration, a, b, c, d, e, float(reduced.nees()[at])))
    return Reduction(
        form=form,
        models=best,
        inflation=dict(zip(names, map(float, np.exp(logs)), strict=True)),
        errors=tuple(errors),
        notices=(*reduced.notices, *([notice("judged-on-loiter")] if assumed else ())),
    )


def read_off(models: SensorModels, form: str, longest: float, dt: float) -> SensorModels:
    """Reduced models read off the Allan deviation of full ones; see `Reduction`."""
    reduced: dict[str, Model] = {}
    bias_sd: dict[str, float] = {}
    tau = dt * 2.0 ** np.arange(np.ceil(np.log2(10.0 * longest / dt)) + 1)
    for axis in AXES:
        model = models.models[axis]
        deviation = np.sqrt(2.0 * model.haar_variance(tau, dt))
        read = float(np.interp(np.log(tuning.WHITE_AT), np.log(tau), deviation))
        white = read * math.sqrt(tuning.WHITE_AT)
        if form == "N+K":
            at_end = float(np.interp(np.log(longest), np.log(tau), deviation))
            reduced[axis] = WhiteNoise(white) + RandomWalk(at_end * np.sqrt(3.0 / longest))
            states = model.state_space(dt)
            variance = float(states.output @ states.initial_covariance @ states.output)
            bias_sd[axis] = float(np.sqrt(variance + models.bias_sd[axis] ** 2))
        else:
            slow = np.where(tau > tuning.WHITE_AT, deviation, 0.0)
            # Without the white noise's own part, the maximum is that of the slow terms.
            rest = np.sqrt(np.maximum(slow**2 - white**2 / tau, 0.0))
            top = int(np.argmax(rest))
            height = float(rest[top]) or float(deviation[-1])
            at = max(float(tau[top]), tuning.SHORTEST_PEAK)
            reduced[axis] = WhiteNoise(white) + GaussMarkov.of_peak(height, at)
            bias_sd[axis] = 0.0
    return SensorModels(reduced, bias_sd)


def loiter_with_outages(
    lengths: Sequence[float],
    dt: float = 0.01,
    trajectory: Trajectory | None = None,
    aiding: str = "gnss",
    keyframe: float = 1.0,
) -> Scenario:
    """A loiter with one GNSS position a second of 1 m (vertical 1.5 m), and outages.

    Raises InputError if a length is not positive or not a multiple of ``dt``, or the trajectory
    is too short.

    Parameters
    ----------
    lengths : sequence of float
        Of the outages, s, with two minutes before each.
    dt : float, optional
        Sampling interval of the IMU of the loiter, s.
    trajectory : Trajectory, optional
        Another motion than a loiter of a fixed-wing aircraft, or a car's drive with wheels.
    aiding : {"gnss", "pose", "odometry", "wheels"}, optional
        Absolute poses (5 cm, 0.2 deg) or relative ones (1 cm, 1 mrad) at keyframes, or wheel
        odometry (5 cm/s; 10 cm/s aside and down) ten times a second, in place of GNSS.
    keyframe : float, optional
        Interval of the keyframes, s.
    """
    aids = AIDINGS[checks.choice("aiding", aiding, tuple(AIDINGS))]
    outages, start = list[Outage](), tuning.SETTLING
    for length in lengths:
        outages.append(Outage(start, checks.positive("outage length", length)))
        # Ends at a fix: those of one second.
        start = float(np.ceil(start + length + tuning.SETTLING))
    end = outages[-1].end if outages else 0.0
    if trajectory is None:
        make = car_drive if aiding == "wheels" else fixed_wing_loiter
        trajectory = make(duration=max(start, 2.0 * tuning.SETTLING), dt=dt)
    elif trajectory.duration < end:
        raise InputError(
            f"trajectory: it has {trajectory.duration:g} s, and outages of these lengths two "
            f"minutes apart need {end:g} s: give a longer one, or fewer outages"
        )
    aided = aids(trajectory, keyframe)
    return Scenario(trajectory, aided, tuple(outages), interval=tuning.SETTLING)
