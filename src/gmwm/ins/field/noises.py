"""Explanations by noise: outliers, fixes or sensors unlike their models, coloured fixes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from gmwm._core.typing import FloatArray
from gmwm.ins import tuning
from gmwm.ins.field.explanations import LEVEL, Candidate, Explanation, cost, difference
from gmwm.ins.field.replay import Replay
from gmwm.ins.filter import KINDS, FilterInnovations

Scaling = Callable[[Replay, float], Replay]
"""A log with a standard deviation times the exponential of a number."""


def outliers(base: Replay) -> Candidate | None:
    """Few fixes that are far off: those that a gate rejects when they come.

    Where it rejects the first one, the fix that made the initial state may be the outlier.
    """
    gated = _gated(base)
    found = [_left_out(base, base, gated)]
    if gated.kind.size and not gated.used[np.argmax(gated.kind == KINDS["position"])]:
        start = base.anywhere()
        found.append(_left_out(base, start, _gated(start)))
    best = max((each for each in found if each), key=lambda each: each.excess, default=None)
    return Candidate(frozenset({"outliers"}), best.gain, lambda: (best,)) if best else None


def _gated(start: Replay) -> FilterInnovations:
    gate = LEVEL / max(start.innovations.kind.size, 1)
    return replace(start, aiding=replace(start.aiding, gate=gate)).innovations


def _left_out(base: Replay, start: Replay, gated: FilterInnovations) -> Explanation | None:
    """What a gate rejected left out, and the first fix if the start is not that of ``base``."""
    total, first = gated.kind.size, int(start is not base)
    count = int(np.count_nonzero(~gated.used)) + first
    if not 0 < count <= tuning.MOST_OUTLIERS * total + 1.0:
        return None
    rejected = {kind: ~gated.used[gated.kind == KINDS[kind]] for kind in base.kinds()}
    here = start.without(rejected)
    # Each is as if its error were a parameter: it costs no density, but for its size.
    log_sd = float(np.nansum(np.log(gated.sd[~gated.used])))
    most = max(rejected, key=lambda kind: np.count_nonzero(rejected[kind]))
    values = {"count": float(count), "fraction": float(np.mean(rejected[most])),
              "time": 0.0 if first else float(gated.time[~gated.used][0])}  # fmt: skip

    def change(replay: Replay) -> Replay:
        return (replay.anywhere() if first else replay).without(rejected)

    return Explanation(
        "outliers", most, change, here, here.log_likelihood - log_sd - base.log_likelihood,
        count * cost(3, total), values,
    )  # fmt: skip


def fix_noise(base: Replay) -> Iterator[Candidate]:
    """Standard deviations of the fixes that are too small or too large, kind by kind."""
    for kind in base.kinds():
        size = float(np.log(np.sqrt(base.test(kind).nis.value)))
        scaled = partial(_fixes_scaled, kind=kind)
        first = max(difference(scaled(base, share * size), base) for share in (0.5, 1.0))
        yield Candidate(
            frozenset({"fix-noise"}), first, partial(_factor, base, scaled, "fix-noise", kind)
        )


def coloured(base: Replay) -> Candidate | None:
    """Errors of the positions that are alike from fix to fix."""
    positions = base.aiding.of("position")
    if positions is None or np.any(np.asarray(base.aiding.coloured_sd)):
        return None
    shape = np.median(positions.sd, axis=0)
    shortest = 2.0 * float(np.median(np.diff(positions.time))) if positions.time.size > 1 else 1.0

    def change(replay: Replay, x: Sequence[float] | FloatArray) -> Replay:
        white, sd, tau = np.exp(np.clip(x, tuning.LEAST_WHITE, -tuning.LEAST_WHITE))
        tau = float(np.clip(tau * shortest, shortest, tuning.LONGEST_COLOUR))
        return replay.with_fixes_scaled(float(white), "position").coloured(sd * shape, tau)

    starts = [(white, np.log(sd), np.log(tau)) for white in (0.0, -1.2)
              for sd, tau in ((1.0, 5.0), (2.5, 25.0))]  # fmt: skip
    gains = [difference(change(base, start), base) for start in starts]
    best = np.array(starts[int(np.argmax(gains))])

    def refined() -> tuple[Explanation, ...]:
        x = minimize(
            lambda x: -max(change(base, x).log_likelihood, _WORST), best, method="Nelder-Mead",
            options={"maxfev": tuning.TRIALS, "xatol": 0.05, "fatol": 0.05,
                     "initial_simplex": best + np.vstack([np.zeros(3), 0.7 * np.eye(3)])},
        ).x  # fmt: skip
        replay = change(base, x)
        sd = np.asarray(replay.aiding.coloured_sd)
        values = {"north": float(sd[0]), "east": float(sd[1]), "down": float(sd[2]),
                  "tau": replay.aiding.coloured_tau, "factor": float(np.exp(x[0]))}  # fmt: skip
        found = Explanation(
            "coloured", "position", lambda replay: change(replay, x), replay,
            difference(replay, base), cost(3), values,
        )  # fmt: skip
        return (found,)

    return Candidate(frozenset({"coloured"}), max(gains), refined)


def sensor_noise(base: Replay) -> Iterator[Candidate]:
    """White noise or slow errors of gyros or accelerometers unlike their models."""
    for kind in ("gyro", "accel"):
        for code, white in (("sensor-white-noise", True), ("sensor-slow-errors", False)):
            scaled = partial(_sensors_scaled, kind=kind, white=white)
            first = max(
                difference(scaled(base, sign * tuning.SCALE_STEP), base) for sign in (-1, 1)
            )
            yield Candidate(frozenset({code}), first, partial(_factor, base, scaled, code, kind))


def _fixes_scaled(replay: Replay, log: float, kind: str) -> Replay:
    return replay.with_fixes_scaled(float(np.exp(log)), kind)


def _sensors_scaled(replay: Replay, log: float, kind: str, white: bool) -> Replay:
    return replay.with_sensors_scaled(float(np.exp(log)), kind, white)


def _factor(base: Replay, scaled: Scaling, code: str, where: str) -> tuple[Explanation, ...]:
    """The most probable factor on a standard deviation, by its logarithm."""

    def likelihood(x: float) -> float:
        return max(scaled(base, x).log_likelihood, _WORST)

    log = float(minimize_scalar(
        lambda x: -likelihood(x), bounds=(-tuning.LARGEST_SCALE, tuning.LARGEST_SCALE),
        method="bounded", options={"xatol": 0.02, "maxiter": 20},
    ).x)  # fmt: skip
    best, aside = scaled(base, log), 0.1
    bend = 2.0 * likelihood(log) - likelihood(log + aside) - likelihood(log - aside)
    factor, error = float(np.exp(log)), aside / np.sqrt(bend) if bend > 0.0 else np.inf
    found = Explanation(
        code, where, lambda replay: scaled(replay, log), best, difference(best, base), cost(1),
        {"factor": factor}, {"factor": factor * float(error)},
    )  # fmt: skip
    return (found,)


_WORST = -1e12  # in place of -inf, for minimizers that subtract
