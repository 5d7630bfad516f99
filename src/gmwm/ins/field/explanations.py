"""What may be wrong with a log: each is tried as a filter that allows for it.

An explanation changes what the filter assumes. Its parameters are those under which the fixes are
most probable, and its gain is by how much more probable they are (a likelihood ratio). Constant
errors, which move the innovations in proportion, are estimated by least squares from the
innovations and their derivatives (Friedland 1969, *IEEE Trans. Autom. Control* 14, 359-367).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import chi2

from gmwm._core.typing import FloatArray
from gmwm.ins import tuning
from gmwm.ins.field.replay import Replay
from gmwm.ins.filter import KINDS

TESTS = 14
"""Ways in which a log can contradict a filter, or be explained better: each gets its share of the
probability of a false alarm."""

LEVEL = tuning.CONTRADICTED / TESTS
"""Of each test, so that a right model is blamed with ``tuning.CONTRADICTED`` at most (Bonferroni)."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """A change of what a filter assumes.

    Attributes
    ----------
    code, where : str
        What is wrong, and with what.
    replay : Replay
        The log under the changed assumptions.
    gain : float
        Of the log-likelihood of the fixes.
    cost : float
        Gain that is reached by chance with the probability of a false alarm.
    values, errors : dict
        What was estimated, in SI units, and standard errors.
    """

    code: str
    where: str
    replay: Replay
    gain: float
    cost: float
    values: dict[str, float] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)

    @property
    def excess(self) -> float:
        """Gain beyond what chance gives."""
        return self.gain - self.cost


@dataclass(frozen=True, eq=False)
class Candidate:
    """An explanation that is worth a closer look if its first gain is among the largest.

    Attributes
    ----------
    key : str
        To tell it from the others.
    gain : float
        A first guess, after few runs of the filter.
    refined : callable
    errors : dict
        Standard errors of constant errors, whether there are any or not.
    """

    key: str
    gain: float
    refined: Callable[[], Explanation | None]
    errors: dict[str, float] = field(default_factory=dict)


def cost(parameters: int, among: int = 1) -> float:
    """Gain of a right model by chance, with its share of the probability of a false alarm."""
    return float(0.5 * chi2.isf(LEVEL / among, parameters))


# -- constant errors ------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Constant:
    """A constant error: how it is allowed for, steps of its derivatives, and what is possible."""

    code: str
    names: tuple[str, ...]
    change: Callable[[Replay, FloatArray], Replay]
    step: float
    prior: float


CONSTANTS = (
    _Constant("time-offset", ("time offset",), lambda r, x: r.later(-float(x[0])), 0.05,
              tuning.LARGEST_OFFSET),
    _Constant("lever-arm", ("forward", "right", "down"), lambda r, x: r.with_arm_longer(x), 0.5,
              tuning.LARGEST_ARM),
    _Constant("heading", ("heading",), lambda r, x: r.turned(float(x[0])), 0.01, 0.5 * np.pi),
)  # fmt: skip


def constant_errors(base: Replay) -> Iterator[Candidate]:
    """Stamps, antenna, heading: four runs of the filter and one."""
    for each in CONSTANTS:
        zero = np.zeros(len(each.names))
        _, covariance, gain = _step(base, base, each, zero)

        def refined(each: _Constant = each) -> Explanation | None:
            return _fitted(base, base, each)

        errors = dict(zip(each.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        yield Candidate(each.code, gain, refined, errors)


def far_heading(base: Replay) -> Candidate:
    """A heading that is wrong by much, as of an IMU that is mounted rotated."""
    angles = np.arange(1, tuning.HEADINGS) * (2.0 * np.pi / tuning.HEADINGS)
    tried = [base.turned(float(angle), tuning.ROUGH_HEADING) for angle in angles]
    best = int(np.argmax([each.log_likelihood for each in tried]))
    gain = _difference(tried[best], base)

    def refined() -> Explanation | None:
        near = base.turned(float(angles[best]), tuning.FINE_HEADING)
        return _fitted(base, near, CONSTANTS[2], float(angles[best]))

    return Candidate("far-heading", gain, refined)


def _fitted(base: Replay, here: Replay, error: _Constant, start: float = 0.0) -> Explanation | None:
    origin, theta = here, np.zeros(len(error.names))
    covariance = np.eye(theta.size) * error.prior**2
    for _ in range(tuning.ROUNDS):
        move, covariance, promised = _step(origin, here, error, theta)
        limit = tuning.LARGEST_OFFSET if error.code == "time-offset" else np.inf
        tried = np.clip(theta + move, -limit, limit)
        new = error.change(origin, tried)
        if not new.log_likelihood > here.log_likelihood:
            break
        theta, here = tried, new
        if promised < tuning.SETTLED_GAIN:
            break
    gain = _difference(here, base)
    if not np.any(theta) and start == 0.0:
        return None
    values = dict(zip(error.names, (theta + start).tolist(), strict=True))
    errors = dict(zip(error.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    if error.code == "heading":
        values["heading"] = float((values["heading"] + np.pi) % (2.0 * np.pi) - np.pi)
    return Explanation(error.code, "", here, gain, cost(theta.size), values, errors)


def _step(
    origin: Replay, here: Replay, error: _Constant, theta: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Gauss-Newton: the move, the covariance after it, and the gain that it promises."""
    columns = []
    for i in range(theta.size):
        aside = theta.copy()
        aside[i] += error.step
        columns.append((error.change(origin, aside).standard - here.standard) / error.step)
    J = np.stack([each.ravel() for each in columns], axis=1)
    z = here.standard.ravel()
    seen = np.isfinite(z) & np.all(np.isfinite(J), axis=1)
    J, z = J[seen], z[seen]
    information = J.T @ J + np.eye(theta.size) / error.prior**2
    score = J.T @ z + theta / error.prior**2
    covariance = np.linalg.inv(information)
    move = -covariance @ score
    return move, covariance, float(-0.5 * score @ move)


# -- fixes ----------------------------------------------------------------------------------------


def outliers(base: Replay) -> Candidate | None:
    """Few fixes that are far off: those without which the rest fit."""
    count = {kind: int(np.sum(base.innovations.kind == KINDS[kind])) for kind in base.kinds()}
    total = sum(count.values())
    rejected = {kind: np.zeros(each, dtype=bool) for kind, each in count.items()}
    limit = float(chi2.isf(LEVEL / max(total, 1), 3))
    here = base
    for _ in range(tuning.CLEANINGS):
        far = _farthest(here, limit)
        if not np.any(far):
            break
        for kind, out in rejected.items():
            out[np.flatnonzero(~out)[far[here.innovations.kind == KINDS[kind]]]] = True
        if sum(int(np.sum(out)) for out in rejected.values()) > tuning.MOST_OUTLIERS * total + 1.0:
            return None
        here = base.without(rejected)
    gone = {kind: int(np.sum(out)) for kind, out in rejected.items() if np.any(out)}
    if not gone:
        return None
    # Each is as if its error were a parameter: it costs no density, but for its size.
    log_sd, times = 0.0, []
    for kind, out in rejected.items():
        of_kind = base.innovations.kind == KINDS[kind]
        log_sd += float(np.nansum(np.log(base.innovations.sd[of_kind][out])))
        times += base.innovations.time[of_kind][out].tolist()
    gain = here.log_likelihood - log_sd - base.log_likelihood
    most = max(gone, key=lambda each: gone[each])
    values = {"count": float(len(times)), "fraction": gone[most] / count[most], "time": min(times)}
    found = Explanation("outliers", most, here, gain, len(times) * cost(3, total), values)
    return Candidate("outliers", gain, lambda: found)


def _farthest(replay: Replay, limit: float) -> np.typing.NDArray[np.bool_]:
    """Fixes that are far off and not in the wake of one farther: a filter that took it needs time.

    Those of one time are its wake too, for they are used one after the other.
    """
    nis = np.nan_to_num(replay.innovations.nis)
    kinds = max(len(replay.kinds()), 1)

    def largest(width: int) -> FloatArray:
        padded = np.pad(nis, width * kinds, constant_values=0.0)
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * width * kinds + 1)
        return np.asarray(windows.max(axis=1))

    near, around = largest(1), largest(tuning.WAKE)
    return np.asarray((nis > limit) & (nis >= near) & (nis >= tuning.WAKE_SHARE * around))


def fix_noise(base: Replay) -> Iterator[Candidate]:
    """Standard deviations of the fixes that are too small or too large, kind by kind."""
    for kind in base.kinds():
        size = np.sqrt(base.test(kind).nis.value)

        def change(log: float, kind: str = kind) -> Replay:
            return base.with_fixes_scaled(float(np.exp(log)), kind)

        first = max(_difference(change(s * np.log(size)), base) for s in (0.5, 1.0))

        def refined(kind: str = kind, change: Callable[[float], Replay] = change) -> Explanation:
            return _factor(base, change, "fix-noise", kind)

        yield Candidate(f"fix-noise {kind}", first, refined)


def coloured(base: Replay) -> Candidate | None:
    """Errors of the positions that are alike from fix to fix."""
    positions = next((f for f in base.aiding.fixes if f.kind == "position" and f.time.size), None)
    if positions is None or np.any(np.asarray(base.aiding.coloured_sd)):
        return None
    shape = np.median(positions.sd, axis=0)
    shortest = 2.0 * float(np.median(np.diff(positions.time))) if positions.time.size > 1 else 1.0

    def change(x: Sequence[float] | FloatArray) -> Replay:
        white, sd, tau = np.exp(np.clip(x, -6.0, 8.0))
        scaled = base.with_fixes_scaled(float(max(white, 0.02)), "position")
        return scaled.coloured(sd * shape, float(np.clip(tau, shortest, 1e4)))

    starts = [(white, np.log(sd), np.log(tau)) for white in (0.0, -1.2)
              for sd, tau in ((1.0, 5.0 * shortest), (2.5, 25.0 * shortest))]  # fmt: skip
    gains = [_difference(change(start), base) for start in starts]
    best = int(np.argmax(gains))

    def refined() -> Explanation | None:
        found = minimize(
            lambda x: -max(change(x).log_likelihood, -1e12), starts[best], method="Nelder-Mead",
            options={"maxfev": tuning.TRIALS, "xatol": 0.05, "fatol": 0.05,
                     "initial_simplex": np.array(starts[best]) + np.vstack([
                         np.zeros(3), 0.7 * np.eye(3)])},
        )  # fmt: skip
        replay = change(found.x)
        sd = np.asarray(replay.aiding.coloured_sd)
        values = {"north": float(sd[0]), "east": float(sd[1]), "down": float(sd[2]),
                  "tau": replay.aiding.coloured_tau, "factor": float(np.exp(found.x[0]))}  # fmt: skip
        return Explanation(
            "coloured", "position", replay, _difference(replay, base), cost(3), values
        )

    return Candidate("coloured", max(gains), refined)


# -- sensors --------------------------------------------------------------------------------------


def sensor_noise(base: Replay) -> Iterator[Candidate]:
    """White noise or slow errors of gyros or accelerometers unlike their models."""
    for kind in ("gyro", "accel"):
        for white in (True, False):

            def change(log: float, kind: str = kind, white: bool = white) -> Replay:
                return base.with_sensors_scaled(float(np.exp(log)), kind, white)

            first = max(_difference(change(sign * tuning.SCALE_STEP), base) for sign in (-1, 1))

            def refined(
                kind: str = kind, white: bool = white, change: Callable[[float], Replay] = change
            ) -> Explanation:
                code = "sensor-white-noise" if white else "sensor-slow-errors"
                return _factor(base, change, code, kind)

            yield Candidate(f"sensor {kind} {white}", first, refined)


def _factor(
    base: Replay, change: Callable[[float], Replay], code: str, where: str
) -> Explanation:
    """The most probable factor on a standard deviation, by its logarithm."""
    found = minimize_scalar(
        lambda x: -max(change(float(x)).log_likelihood, -1e12),
        bounds=(-tuning.LARGEST_SCALE, tuning.LARGEST_SCALE), method="bounded",
        options={"xatol": 0.02, "maxiter": 20},
    )  # fmt: skip
    log, aside = float(found.x), 0.1
    replay = change(log)
    curvature = (
        2.0 * replay.log_likelihood
        - change(log + aside).log_likelihood
        - change(log - aside).log_likelihood
    ) / aside**2
    error = 1.0 / np.sqrt(curvature) if curvature > 0.0 else np.inf
    values, errors = {"factor": float(np.exp(log))}, {"factor": float(np.exp(log) * error)}
    return Explanation(code, where, replay, _difference(replay, base), cost(1), values, errors)


def _difference(replay: Replay, base: Replay) -> float:
    if not np.isfinite(replay.log_likelihood):
        return -np.inf
    return replay.log_likelihood - base.log_likelihood
