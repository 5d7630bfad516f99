"""What may be wrong with a log: each is tried as a filter that allows for it.

An explanation changes what the filter assumes. Its parameters are those under which the fixes are
most probable, and its gain is by how much more probable they are (a likelihood ratio). Constant
errors, which move the innovations in proportion, are estimated by least squares from the
innovations and their derivatives (Friedland 1969, *IEEE Trans. Autom. Control* 14, 359-367).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.typing import FloatArray
from gmwm.ins import tuning
from gmwm.ins.field.replay import Replay
from gmwm.ins.filter import KINDS

TESTS = 19
"""Ways in which a log can contradict a filter, or be explained better: each gets its share of the
probability of a false alarm."""

LEVEL = tuning.CONTRADICTED / TESTS
"""Of each test: right models are blamed with ``tuning.CONTRADICTED`` at most (Bonferroni)."""

Change = Callable[[Replay], Replay]


@dataclass(frozen=True, eq=False)
class Explanation:
    """A change of what a filter assumes.

    code, where: What is wrong, and with what.
    change: What is assumed of any log.
    replay: This log under the changed assumptions.
    gain: Of the log-likelihood of the fixes.
    cost: Gain that is reached by chance with the probability of a false alarm.
    values, errors: What was estimated, in SI units, and standard errors.
    """

    code: str
    where: str
    change: Change
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

    codes: What would be found.
    gain: A first guess, after few runs of the filter.
    refined: What is found; several that go together have the same gain and cost.
    errors: Standard errors of constant errors that are estimated together, whether there are any or
        not.
    """

    codes: frozenset[str]
    gain: float
    refined: Callable[[], tuple[Explanation, ...]]
    errors: dict[str, float] = field(default_factory=dict)


def cost(parameters: int, among: int = 1) -> float:
    """Gain of a right model by chance, with its share of the probability of a false alarm."""
    return float(0.5 * chi2.isf(LEVEL / among, parameters))


@dataclass(frozen=True)
class Constant:
    """A constant error: how it is allowed for, steps of its derivatives, and what is possible.

    smooth: Allows for it too, less exactly, but with the same noise between two fixes.
    where: With what it is wrong.
    """

    code: str
    names: tuple[str, ...]
    change: Callable[[Replay, FloatArray], Replay]
    step: float
    prior: float
    smooth: Callable[[Replay, FloatArray], Replay] | None = None
    where: str = ""


def _clock(
    code: str, name: str, course: Callable[[FloatArray], FloatArray], longest: float = 1.0
) -> Constant:
    """Stamps that are off by a constant times a course over the filter's time, which grows to
    ``longest``.
    """
    return Constant(
        code, (name,), lambda r, x: r.later(lambda time: -x[0] * course(time)), 0.05 / longest,
        tuning.LARGEST_OFFSET / longest, lambda r, x: r.along(lambda time: -x[0] * course(time)),
    )  # fmt: skip


def _scale(kind: str) -> Constant:
    return Constant(
        "scale-error", ("x", "y", "z"), lambda r, x: r.with_factors(kind, 1.0 / (1.0 + x)), 0.01,
        tuning.LARGEST_SCALE_ERROR, where=kind,
    )  # fmt: skip


_CLOCK = _clock("time-offset", "time offset", np.ones_like)
_ARM = Constant(
    "lever-arm", ("forward", "right", "down"), lambda r, x: r.with_arm_longer(x), 0.5,
    tuning.LARGEST_ARM,
)  # fmt: skip
_HEADING = Constant(
    "heading", ("heading",), lambda r, x: r.turned_by(float(x[0])), 0.01, 0.5 * np.pi
)  # fmt: skip
TOGETHER = ((_CLOCK,), (_ARM,), (_HEADING,), (_CLOCK, _ARM))
"""What is tried. Along a straight track at constant speed a time offset is a lever arm, so that one
of the two alone takes up what the other does; both together are right."""


def constant_errors(base: Replay) -> Iterator[Candidate]:
    """Stamps, antenna, heading: five runs of the filter and one."""
    columns = {
        each.code: _columns(
            base, partial(each.change, base), _steps((each,)), np.zeros(len(each.names))
        )
        for each in (_CLOCK, _ARM, _HEADING)
    }  # fmt: skip
    for errors in TOGETHER:
        found = [column for each in errors for column in columns[each.code]]
        _, covariance, gain = _step(base, found, errors, np.zeros(len(found)))

        def refined(errors: tuple[Constant, ...] = errors) -> tuple[Explanation, ...]:
            return _fitted(base, base, errors)

        names = [name for each in errors for name in each.names]
        deviations = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        yield Candidate(
            frozenset(each.code for each in errors), gain, refined, deviations
        )  # fmt: skip


def rarer_errors(base: Replay) -> Iterator[Candidate]:
    """A clock that drifts, from the start of the filter or from an offset on, and scale errors."""
    drift = _clock("clock-drift", "drift", lambda time: time, base.imu.n * base.imu.dt)
    for errors in ((drift,), (_CLOCK, drift), (_scale("gyro"),), (_scale("accel"),)):
        columns = [
            column for each in errors for column in _columns(
                base, partial(each.change, base), _steps((each,)), np.zeros(len(each.names))
            )
        ]  # fmt: skip
        gain = _step(base, columns, errors, np.zeros(len(columns)))[2]
        codes = frozenset(each.code for each in errors)
        yield Candidate(codes, gain, partial(_fitted, base, base, errors))


def clock_step(base: Replay) -> Candidate | None:
    """Stamps that are off by a constant from some fix on: a clock was set, or samples were lost.

    The fix is looked for between parts of the log and where the innovations are largest, then
    nearer and nearer.
    """
    positions = base.aiding.of("position")
    if positions is None or positions.time.size < tuning.STEP_PARTS:
        return None
    time = positions.time

    def at(i: int) -> Constant:
        since = 0.5 * float(time[i - 1] + time[i])
        return _clock("clock-step", "time offset", lambda time: np.where(time >= since, 1.0, 0.0))

    def promised(i: int) -> float:
        column = _columns(base, partial(at(i).change, base), _steps((_CLOCK,)), np.zeros(1))
        return _step(base, column, (_CLOCK,), np.zeros(1))[2]

    def gain(i: int, by: FloatArray) -> float:
        return difference(at(i).change(base, by), base) if 0 < i < time.size else -np.inf

    sizes = np.nan_to_num(base.innovations.nis[base.innovations.kind == KINDS["position"]])
    far = np.flatnonzero(sizes > chi2.isf(LEVEL / sizes.size, 3))
    parts = np.linspace(0, time.size, tuning.STEP_PARTS + 1)[1:-1]
    starts = {1, *(int(i) for i in (*parts, *far[:1], np.argmax(sizes)) if 0 < i < time.size)}
    gains = {i: promised(i) for i in sorted(starts)}
    start = max(gains, key=gains.__getitem__)
    if start == 1:
        return None  # a constant offset is as good

    def refined() -> tuple[Explanation, ...]:
        best, by = start, np.zeros(1)
        for reach in (time.size // tuning.STEP_PARTS, tuning.STEP_NEAR):
            # By the step that fits there, which is wrong as long as the place is.
            fitted = _fitted(base, base, (at(best),))
            if not fitted:
                return ()
            by = np.array(list(fitted[0].values.values()))
            while reach > 0:
                nearer = max((best, best - reach, best + reach), key=lambda i: gain(i, by))
                reach, best = reach // 2 if nearer == best else reach, nearer
        (step,) = _fitted(base, base, (at(best),))

        def edge(outside: int) -> int:
            """The farthest fix that is as good for a start of the step: it may stand there."""
            inside = best
            while abs(outside - inside) > 1:
                middle = (inside + outside) // 2
                is_good = gain(middle, by) > step.gain - tuning.AMBIGUOUS
                inside, outside = (middle, outside) if is_good else (inside, middle)
            return inside

        first, last = edge(0), edge(time.size)
        if first == 1:
            return ()
        values = {**step.values, "after": float(time[first - 1]), "before": float(time[last])}
        return (replace(step, cost=cost(1, time.size), values=values),)

    return Candidate(frozenset({"clock-step"}), gains[start], refined)


def far_heading(base: Replay) -> Candidate:
    """A heading that is wrong by much, as of an IMU that is mounted rotated."""
    angles = np.arange(1, tuning.HEADINGS) * (2.0 * np.pi / tuning.HEADINGS)
    tried = [base.turned_by(float(angle), tuning.ROUGH_HEADING) for angle in angles]
    best = int(np.argmax([each.log_likelihood for each in tried]))
    angle = float(angles[best])

    def refined() -> tuple[Explanation, ...]:
        return _fitted(base, base.turned_by(angle, tuning.FINE_HEADING), (_HEADING,), angle)

    return Candidate(frozenset({"heading"}), difference(tried[best], base), refined)


def wrong_signs(base: Replay) -> Iterator[Candidate]:
    """Axes of the gyros or of the accelerometers that point the other way.

    Two of both kinds are a mounting and no fault; of one kind they are axes of another body. A sign
    that the motion does not show is zero.
    """
    for kind in ("gyro", "accel"):
        ways = list(product((1.0, -1.0), repeat=3))
        tried = [base.with_factors(kind, signs) for signs in ways]
        likelihoods = np.array([each.log_likelihood for each in tried])
        best = int(np.argmax(likelihoods))
        alike = np.array(ways)[likelihoods >= likelihoods[best] - tuning.AMBIGUOUS]
        shown = np.where(np.all(alike == alike[0], axis=0), alike[0], 0.0)
        values = dict(zip(("x", "y", "z"), shown.tolist(), strict=True))
        change = partial(Replay.with_factors, kind=kind, factors=ways[best])
        gain, price = difference(tried[best], base), cost(1, len(ways))
        found = Explanation("axis-signs", kind, change, tried[best], gain, price, values)
        yield Candidate(frozenset({"axis-signs"}), gain, partial(tuple, (found,)))


def _fitted(
    base: Replay, here: Replay, errors: tuple[Constant, ...], start: float = 0.0
) -> tuple[Explanation, ...]:
    """Constant errors by Gauss-Newton, one explanation each; ``start`` is in ``here`` already."""
    origin, parts = here, _parts(errors)
    # Stamps that are farther off leave no fix near.
    most = np.concatenate([
        np.full(len(each.names), each.prior if each.smooth else np.inf) for each in errors
    ])  # fmt: skip
    theta = np.zeros(parts[-1].stop)

    def changed(x: FloatArray) -> Replay:
        replay = origin
        for each, part in zip(errors, parts, strict=True):
            replay = each.change(replay, x[part])
        return replay

    covariance = np.eye(theta.size)
    for _ in range(tuning.ROUNDS):
        columns = _columns(here, changed, _steps(errors), theta)
        move, covariance, promised = _step(here, columns, errors, theta)
        tried = np.clip(theta + move, -most, most)
        new = changed(tried)
        if not new.log_likelihood > here.log_likelihood:
            break
        theta, here = tried, new
        if promised < tuning.SETTLED_GAIN:
            break
    if not np.any(theta) and start == 0.0:
        return ()
    # Of two errors each has to earn its own: what one alone explains names no other.
    price = sum(cost(len(each.names)) for each in errors)
    # What no sensor has is no explanation, however little the data say against it.
    unusual = 0.5 * float(_prior(errors) @ theta**2)
    gain = difference(here, base) - unusual
    if errors[0].smooth is not None and np.isfinite(base.log_likelihood):
        regular, without = _smoothly(base, errors, theta)
        if len(errors) == 1:  # beside the antenna, what is less exact would tell them apart
            covariance = without
        # The stamps' own gain is the exact one; it counts if it is no matter of other noise.
        gain = gain if regular > price + unusual else min(gain, regular - unusual)
    deviations = np.sqrt(np.diag(covariance))
    if start != 0.0:
        theta[0] = (theta[0] + start + np.pi) % (2.0 * np.pi) - np.pi
    found = []
    for each, part in zip(errors, parts, strict=True):
        values = dict(zip(each.names, theta[part].tolist(), strict=True))
        spread = dict(zip(each.names, deviations[part].tolist(), strict=True))

        def change(replay: Replay, each: Constant = each, x: FloatArray = theta[part]) -> Replay:
            return each.change(replay, x)

        found.append(Explanation(each.code, each.where, change, here, gain, price, values, spread))
    return tuple(found)


def _smoothly(
    base: Replay, errors: tuple[Constant, ...], theta: FloatArray
) -> tuple[float, FloatArray]:
    """Gain and covariance without what comes of other noise: as much, by chance, as that is."""

    def changed(x: FloatArray) -> Replay:
        replay = base
        for each, part in zip(errors, _parts(errors), strict=True):
            replay = (each.smooth or each.change)(replay, x[part])
        return replay

    here = changed(theta)
    columns = _columns(here, changed, _steps(errors), theta)
    return difference(here, base), _step(here, columns, errors, theta)[1]


def _steps(errors: tuple[Constant, ...]) -> FloatArray:
    return np.concatenate([np.full(len(each.names), each.step) for each in errors])


def _prior(errors: tuple[Constant, ...]) -> FloatArray:
    """Inverse variances."""
    return np.concatenate([np.full(len(each.names), each.prior**-2) for each in errors])


def _parts(errors: tuple[Constant, ...]) -> list[slice]:
    ends = np.cumsum([len(each.names) for each in errors]).tolist()
    return [slice(end - len(each.names), end) for each, end in zip(errors, ends, strict=True)]


def _columns(
    here: Replay, changed: Callable[[FloatArray], Replay], steps: FloatArray, theta: FloatArray
) -> list[FloatArray]:
    """Derivatives of the innovations in their standard deviations."""
    return [
        (changed(theta + step * unit).standard - here.standard) / step
        for step, unit in zip(steps, np.eye(theta.size), strict=True)
    ]


def _step(
    here: Replay, columns: list[FloatArray], errors: tuple[Constant, ...], theta: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Gauss-Newton: the move, the covariance after it, and the gain that it promises."""
    prior = _prior(errors)
    J = np.stack([each.ravel() for each in columns], axis=1)
    z = here.standard.ravel()
    seen = np.isfinite(z) & np.all(np.isfinite(J), axis=1)
    J, z = J[seen], z[seen]
    score = J.T @ z + prior * theta
    covariance = np.linalg.inv(J.T @ J + np.diag(prior))
    move = -covariance @ score
    return move, covariance, float(-0.5 * score @ move)


def difference(replay: Replay, base: Replay) -> float:
    """Gain of the log-likelihood; -inf if the filter diverges."""
    if not np.isfinite(replay.log_likelihood):
        return -np.inf
    return replay.log_likelihood - base.log_likelihood
