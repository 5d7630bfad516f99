"""Possible faults of a log: time offset, lever arm, heading, axis signs, outliers.

Each is a filter that allows for it, with the parameters under which the fixes are most probable.
Constant errors are estimated by least squares from the innovations and their derivatives (Friedland
1969, *IEEE Trans. Autom. Control* 14, 359-367).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.typing import FloatArray
from gmwm.ins.filter import KINDS, FilterInnovations
from gmwm.ins.logs import tuning
from gmwm.ins.logs.replay import Replay

TESTS = 13
"""Tests of a log: size of the innovations of three kinds and of all, whiteness, time offset, lever
arm, heading, the first two together, directions, signs of both sensors, outliers."""

LEVEL = tuning.CONTRADICTED / TESTS
"""Level of each test: right models are blamed with ``tuning.CONTRADICTED`` at most (Bonferroni)."""

Change = Callable[[Replay], Replay]


@dataclass(frozen=True, eq=False)
class Fault:
    """A fault that a filter allows for.

    code, where: What is wrong, and with what.
    change: The assumption, for any log.
    replay: This log under the changed assumption.
    gain: Increase of the log-likelihood of the fixes, over the size of the innovations that are
        left: where something else is wrong too, everything explains a part of it.
    cost: Gain that chance exceeds with the probability of a false alarm.
    values, errors: Estimates, in SI units, and standard errors.
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
        """Gain beyond chance."""
        return self.gain - self.cost


class Candidate(NamedTuple):
    """Faults that are worth a closer look if their first gain is among the largest.

    gain: A first guess, after few runs of the filter.
    refined: Gives the faults; several that are found together have the same gain and cost.
    errors: Standard errors of constant errors, whether there are any or not.
    """

    codes: frozenset[str]
    gain: float
    refined: Callable[[], tuple[Fault, ...]]
    errors: dict[str, float]


def cost(parameters: int, among: int = 1) -> float:
    """Gain of a right model by chance, with its share of the probability of a false alarm."""
    return float(0.5 * chi2.isf(LEVEL / among, parameters))


def difference(replay: Replay, base: Replay) -> float:
    """Gain of the log-likelihood; -inf if the filter diverges."""
    if not np.isfinite(replay.log_likelihood):
        return -np.inf
    return replay.log_likelihood - base.log_likelihood


def relative_gain(gain: float, replay: Replay) -> float:
    """A gain over the mean square of the innovations that are left, where that is above one."""
    return gain / max(1.0, float(np.nanmean(replay.standard**2)))


# -- outliers and axes ----------------------------------------------------------------------------


def outliers(base: Replay) -> Candidate | None:
    """Few fixes that are far off: a gate rejects them when they come.

    Where it rejects the first one, the fix that made the initial state may be the outlier.
    """

    def gated(start: Replay) -> FilterInnovations:
        gate = LEVEL / max(start.innovations.kind.size, 1)
        return replace(start, aiding=replace(start.aiding, gate=gate)).innovations

    seen = gated(base)
    found = [_rejected(base, base, seen)]
    if seen.kind.size and not seen.used[np.argmax(seen.kind == KINDS["position"])]:
        start = base.anywhere()
        found.append(_rejected(base, start, gated(start)))
    best = max((each for each in found if each), key=lambda each: each.excess, default=None)
    if best is None:
        return None
    return Candidate(frozenset({"outliers"}), best.gain, lambda: (best,), {})


def _rejected(base: Replay, start: Replay, gated: FilterInnovations) -> Fault | None:
    """Fixes that a gate rejects as outliers, and the first fix if the start is not the base's."""
    total, first = gated.kind.size, int(start is not base)
    count = int(np.count_nonzero(~gated.used)) + first
    if not 0 < count <= tuning.MOST_OUTLIERS * total + 1.0:
        return None
    rejected = {kind: ~gated.used[gated.kind == KINDS[kind]] for kind in base.kinds}
    here = start.without(rejected)
    # As if each error were a parameter: an outlier costs no density, but for its size.
    log_sd = float(np.nansum(np.log(gated.sd[~gated.used])))
    most = max(rejected, key=lambda kind: np.count_nonzero(rejected[kind]))
    values = {
        "count": float(count),
        "fraction": float(np.mean(rejected[most])),
        "time": 0.0 if first else float(gated.time[~gated.used][0]),
    }

    def change(replay: Replay) -> Replay:
        return (replay.anywhere() if first else replay).without(rejected)

    gain = relative_gain(here.log_likelihood - log_sd - base.log_likelihood, here)
    return Fault("outliers", most, change, here, gain, count * cost(3, total), values)


def far_heading(base: Replay) -> Candidate:
    """A heading that is wrong by much, as of an IMU that is mounted rotated."""
    angles = np.arange(1, tuning.HEADINGS) * (2.0 * np.pi / tuning.HEADINGS)
    tried = [base.turned_by(float(angle), tuning.ROUGH_HEADING) for angle in angles]
    best = int(np.argmax([each.log_likelihood for each in tried]))
    angle = float(angles[best])

    def refined() -> tuple[Fault, ...]:
        return fitted(base, base.turned_by(angle, tuning.FINE_HEADING), (_HEADING,), angle)

    return Candidate(frozenset({"heading"}), difference(tried[best], base), refined, {})


def wrong_signs(base: Replay) -> Iterator[Candidate]:
    """Axes of the gyros or of the accelerometers that point the other way.

    Two of both kinds are a mounting and no fault; of one kind they are axes of another body. A sign
    that the motion does not show is zero.
    """
    for kind in ("gyro", "accel"):
        ways = list(product((1.0, -1.0), repeat=3))
        tried = [base.with_signs(kind, signs) for signs in ways]
        likelihoods = np.array([each.log_likelihood for each in tried])
        best = int(np.argmax(likelihoods))
        alike = np.array(ways)[likelihoods >= likelihoods[best] - tuning.AMBIGUOUS]
        shown = np.where(np.all(alike == alike[0], axis=0), alike[0], 0.0)
        values = dict(zip(("x", "y", "z"), shown.tolist(), strict=True))
        change = partial(Replay.with_signs, kind=kind, signs=ways[best])
        here, price = tried[best], cost(1, len(ways))
        gain = difference(here, base)
        fault = Fault("axis-signs", kind, change, here, relative_gain(gain, here), price, values)
        yield Candidate(frozenset({"axis-signs"}), gain, partial(tuple, (fault,)), {})


# -- constant errors ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Constant:
    """A constant error: how it is allowed for, the steps of its derivatives, and its usual size.

    smooth: Allows for it too, less exactly, but with the same noise between two fixes.
    """

    code: str
    names: tuple[str, ...]
    change: Callable[[Replay, FloatArray], Replay]
    step: float
    usual: float
    smooth: Callable[[Replay, FloatArray], Replay] | None = None


_CLOCK = Constant(
    "time-offset",
    ("time offset",),
    lambda r, x: r.later(lambda time: np.full_like(time, -x[0])),
    0.05,
    tuning.LARGEST_OFFSET,
    lambda r, x: r.along(lambda time: np.full_like(time, -x[0])),
)
_ARM = Constant(
    "lever-arm", ("forward", "right", "down"), Replay.with_arm_longer, 0.5, tuning.LARGEST_ARM
)
_HEADING = Constant(
    "heading", ("heading",), lambda r, x: r.turned_by(float(x[0])), 0.01, 0.5 * np.pi
)
_TOGETHER = ((_CLOCK,), (_ARM,), (_HEADING,), (_CLOCK, _ARM))
"""Errors that are tried. Along a straight track at constant speed a time offset is a lever arm, so
that one of the two alone takes up the other; both together are right."""


def constant_errors(base: Replay) -> Iterator[Candidate]:
    """Stamps, antenna, heading, and the first two together: five runs of the filter and one."""
    columns = {
        each.code: _columns(base, partial(each.change, base), (each,), np.zeros(len(each.names)))
        for each in (_CLOCK, _ARM, _HEADING)
    }
    for errors in _TOGETHER:
        own = [column for each in errors for column in columns[each.code]]
        _, covariance, gain = gauss_newton(base, own, errors, np.zeros(len(own)))
        names = [name for each in errors for name in each.names]
        deviations = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        codes = frozenset(each.code for each in errors)
        yield Candidate(codes, gain, partial(fitted, base, base, errors), deviations)


def fitted(
    base: Replay, here: Replay, errors: tuple[Constant, ...], start: float = 0.0
) -> tuple[Fault, ...]:
    """Constant errors by Gauss-Newton, one fault each; ``start`` is in ``here`` already."""
    ends = np.cumsum([len(each.names) for each in errors]).tolist()
    parts = [slice(end - len(each.names), end) for each, end in zip(errors, ends, strict=True)]
    # Stamps that are farther off leave no fix near.
    most = np.concatenate(
        [np.full(len(each.names), each.usual if each.smooth else np.inf) for each in errors]
    )
    theta, covariance = np.zeros(parts[-1].stop), np.eye(parts[-1].stop)

    def changed(x: FloatArray, replay: Replay = here, is_smooth: bool = False) -> Replay:
        for each, part in zip(errors, parts, strict=True):
            change = each.smooth if is_smooth and each.smooth else each.change
            replay = change(replay, x[part])
        return replay

    for _ in range(tuning.ROUNDS):
        columns = _columns(here, changed, errors, theta)
        move, covariance, promised = gauss_newton(here, columns, errors, theta)
        tried = np.clip(theta + move, -most, most)
        new = changed(tried)
        if not new.log_likelihood > here.log_likelihood:
            break
        theta, here = tried, new
        if promised < tuning.SETTLED_GAIN:
            break
    if not np.any(theta) and start == 0.0:
        return ()
    # Of two errors each has to earn its own: one that explains all names no other.
    price = sum(cost(len(each.names)) for each in errors)
    # An unusually large error is improbable, however little the data contradict it.
    unusual = 0.5 * float(_information(errors) @ theta**2)
    gain = difference(here, base) - unusual
    if errors[0].smooth is not None and np.isfinite(base.log_likelihood):
        # With the same noise between fixes, which has a gain by chance.
        smoothed = partial(changed, replay=base, is_smooth=True)
        along = smoothed(theta)
        regular = difference(along, base)
        if len(errors) == 1:  # beside the antenna, the less exact one would tell them apart
            columns = _columns(along, smoothed, errors, theta)
            covariance = gauss_newton(along, columns, errors, theta)[1]
        # The gain of the stamps is the exact one; it counts if it does not come of other noise.
        gain = gain if regular > price + unusual else min(gain, regular - unusual)
    gain, deviations = relative_gain(gain, here), np.sqrt(np.diag(covariance))
    if start != 0.0:
        theta[0] = (theta[0] + start + np.pi) % (2.0 * np.pi) - np.pi
    found = []
    for each, part in zip(errors, parts, strict=True):
        values = dict(zip(each.names, theta[part].tolist(), strict=True))
        spread = dict(zip(each.names, deviations[part].tolist(), strict=True))

        def change(replay: Replay, each: Constant = each, x: FloatArray = theta[part]) -> Replay:
            return each.change(replay, x)

        found.append(Fault(each.code, "", change, here, gain, price, values, spread))
    return tuple(found)


def _information(errors: tuple[Constant, ...]) -> FloatArray:
    """Inverse variances before the data."""
    return np.concatenate([np.full(len(each.names), each.usual**-2) for each in errors])


def _columns(
    here: Replay,
    changed: Callable[[FloatArray], Replay],
    errors: tuple[Constant, ...],
    theta: FloatArray,
) -> list[FloatArray]:
    """Derivatives of the innovations in their standard deviations."""
    steps = np.concatenate([np.full(len(each.names), each.step) for each in errors])
    return [
        (changed(theta + step * unit).standard - here.standard) / step
        for step, unit in zip(steps, np.eye(theta.size), strict=True)
    ]


def gauss_newton(
    here: Replay, columns: list[FloatArray], errors: tuple[Constant, ...], theta: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """A Gauss-Newton step, the covariance after it, and the gain that it promises."""
    information = _information(errors)
    J = np.stack([each.ravel() for each in columns], axis=1)
    z = here.standard.ravel()
    seen = np.isfinite(z) & np.all(np.isfinite(J), axis=1)
    J, z = J[seen], z[seen]
    score = J.T @ z + information * theta
    covariance = np.linalg.inv(J.T @ J + np.diag(information))
    move = -covariance @ score
    return move, covariance, float(-0.5 * score @ move)
