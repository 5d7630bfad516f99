"""The faults that a log shows, looked for before the sensor models are blamed.

Time offset, lever arm, heading, clock rate, scales, axis signs, outliers: each is a filter that
allows for it, with the parameters under which the fixes are most probable. Constant errors are
estimated by least squares from the innovations and their derivatives (Friedland 1969, *IEEE Trans.
Autom. Control* 14, 359-367).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.text import per_cent
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.measurements import KINDS
from gmwm.ins.increments import Imu
from gmwm.ins.logs.measured import Measured
from gmwm.ins.logs.replay import Replay
from gmwm.issues import Notice, notice

TESTS = 17
"""Tests of a log: size of the innovations of three kinds and of all, whiteness, time offset, lever
arm, heading, clock rate, the first two together, directions, rates, scales and signs of both
sensors, outliers."""

LEVEL = tuning.CONTRADICTED / TESTS
"""Level of each test: right models are blamed with ``tuning.CONTRADICTED`` at most (Bonferroni)."""


@dataclass(frozen=True, eq=False)
class Fault:
    """A fault that a filter allows for.

    code, where: What is wrong, and with what.
    replay: The log under the changed assumption.
    gain: Increase of the log-likelihood of the fixes, over the size of the innovations that are
        left: where something else is wrong too, everything explains a part of it.
    cost: Gain that chance exceeds with the probability of a false alarm.
    values, errors: Estimates, in SI units, and standard errors.
    rivals: Names of other faults that explain the log nearly as well.
    """

    code: str
    where: str
    replay: Replay
    gain: float
    cost: float
    values: dict[str, float] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    rivals: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What is wrong with what."""
        return f"{self.code} {self.where}".strip()

    @property
    def excess(self) -> float:
        """Gain beyond chance."""
        return self.gain - self.cost


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


def outliers(base: Replay) -> list[Fault]:
    """Few fixes that are far off: a gate rejects them when they come.

    Where it rejects the first one, the fix that made the initial state may be the outlier.
    """
    starts = [base]
    if np.sum(base.standard[:1] ** 2) > 2.0 * cost(3, max(base.innovations.kind.size, 1)):
        starts.append(replace(base, sd=replace(base.sd, position=tuning.ANYWHERE)))
    return [each for start in starts if (each := _rejected(base, start))]


def _rejected(base: Replay, start: Replay) -> Fault | None:
    """Fixes that a gate rejects as outliers, and the first fix if the start is not the base's."""
    gate = LEVEL / max(start.innovations.kind.size, 1)
    gated = replace(start, aiding=replace(start.aiding, gate=gate)).innovations
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
        "time": base.start + (0.0 if first else float(gated.time[~gated.used][0])),
    }
    gain = relative_gain(here.log_likelihood - log_sd - base.log_likelihood, here)
    return Fault("outliers", most, here, gain, count * cost(3, total), values)


def far_heading(base: Replay) -> tuple[Fault, ...]:
    """A heading that is wrong by much, as of an IMU that is mounted rotated."""
    angles = np.arange(1, tuning.HEADINGS) * (2.0 * np.pi / tuning.HEADINGS)
    tried = [base.turned_by(float(angle), tuning.ROUGH_HEADING) for angle in angles]
    best = int(np.argmax([each.log_likelihood for each in tried]))
    if not difference(tried[best], base) > cost(1):
        return ()
    angle = float(angles[best])
    return fitted(base, base.turned_by(angle, tuning.FINE_HEADING), ("heading",), angle)


def far_rate(base: Replay) -> tuple[Fault, ...]:
    """A clock whose rate is wrong by much: at the start of the log, then in more of it."""
    rate, length = 0.0, tuning.RATE_SPAN
    tried = np.arange(-3, 4) * tuning.RATE_STEP
    while length < 2.0 * base.imu.n * base.imu.dt:
        part = base.within(0.0, length)
        each = [part.slower(rate + by) for by in tried]
        rate += float(tried[int(np.argmax([one.log_likelihood for one in each]))])
        tried, length = tried / 3.0, 3.0 * length
    return fitted(base, base.slower(rate), ("clock-rate",), rate) if rate else ()


def wrong_signs(base: Replay) -> Iterator[Fault]:
    """Axes of the gyros or of the accelerometers that point the other way.

    Two of both kinds are a mounting and no fault; of one kind they are axes of another body. A sign
    that the motion does not show is zero.
    """
    ways = np.array(list(product((1.0, -1.0), repeat=3)))
    for kind in ("gyro", "accel"):
        tried = [base.with_signs(kind, signs) for signs in ways]
        likelihoods = np.array([each.log_likelihood for each in tried])
        here, most = tried[int(np.argmax(likelihoods))], np.max(likelihoods)
        alike = ways[likelihoods >= most - tuning.AMBIGUOUS]
        shown = np.where(np.all(alike == alike[0], axis=0), alike[0], 0.0)
        values = dict(zip(("x", "y", "z"), shown.tolist(), strict=True))
        gain = relative_gain(difference(here, base), here)
        yield Fault("axis-signs", kind, here, gain, cost(1, len(ways)), values)


# -- constant errors ------------------------------------------------------------------------------

# Name, code and kind of sensor, step of its derivatives, usual size.
_CONSTANTS = (
    ("time offset", "time-offset", 0.05, tuning.LARGEST_OFFSET),
    *((name, "lever-arm", 0.5, tuning.LARGEST_ARM) for name in ("forward", "right", "down")),
    ("heading", "heading", 0.01, 0.5 * np.pi),
    ("clock rate", "clock-rate", 1e-4, tuning.USUAL_RATE),
    *((axis, "scale-error gyro", 1e-3, tuning.USUAL_SCALE) for axis in "xyz"),
    *((axis, "scale-error accel", 1e-3, tuning.USUAL_SCALE) for axis in "xyz"),
)
_NAMES, _CODES = (np.array([each[i] for each in _CONSTANTS]) for i in (0, 1))
_STEPS, _USUAL = np.array([sizes for _, _, *sizes in _CONSTANTS], dtype=float).T
# Stamps that are farther off leave no fix near; a scale that is farther off has another cause.
_MOST = np.where(_CODES == "time-offset", _USUAL, np.inf)
_MOST[_USUAL == tuning.USUAL_SCALE] = tuning.LARGEST_SCALE
_TOGETHER = (*((code,) for code in dict.fromkeys(_CODES)), ("time-offset", "lever-arm"))
"""Errors that are tried. Along a straight track at constant speed a time offset is a lever arm, so
that one of the two alone takes up the other; both together are right."""


def changed(replay: Replay, errors: FloatArray, is_smooth: bool = False) -> Replay:
    """A log without the constant errors of `_CONSTANTS`, (12,), in SI units.

    is_smooth: Allow for late stamps less exactly, but with the same noise between two fixes.
    """
    offset, arm, heading, rate = errors[0], errors[1:4], errors[4], errors[5]
    if np.any(errors[6:]):
        gyro, accel = 1.0 / (1.0 + errors[6:].reshape(2, 3))
        imu = Imu(replay.imu.dt, replay.imu.rotation * gyro, replay.imu.velocity * accel)
        replay = replace(replay, imu=imu)
    if rate:
        replay = replay.slower(float(rate))
    if offset:
        replay = replay.along(-offset) if is_smooth else replay.later(-offset)
    if np.any(arm):
        replay = replay.with_arm_longer(arm)
    return replay.turned_by(float(heading)) if heading else replay


def constant_errors(base: Replay, known: Collection[str] = ()) -> list[tuple[Fault, ...]]:
    """Each alone, and stamps with antenna, but for the known ones."""
    none, found = np.zeros(_CODES.size), []
    columns = _columns(base, partial(changed, base), none, none == 0.0)
    for codes in _TOGETHER:
        own = np.isin(_CODES, codes)
        gain = gauss_newton(base, columns[:, own], none[own], own)[2]
        if gain > cost(1) and not any(code in known for code in codes):
            found.append(fitted(base, base, codes))
    return found


def fitted(
    base: Replay, here: Replay, codes: tuple[str, ...], start: float = 0.0
) -> tuple[Fault, ...]:
    """Constant errors by Gauss-Newton, one fault each; ``start`` is in ``here`` already."""
    own = np.isin(_CODES, codes)
    theta, covariance, of = np.zeros(_CODES.size), np.empty(0), partial(changed, here)
    for _ in range(tuning.ROUNDS):
        columns = _columns(here, of, theta, own)
        move, covariance, promised = gauss_newton(here, columns, theta[own], own)
        tried = theta.copy()
        tried[own] = np.clip(theta[own] + move, -_MOST[own], _MOST[own])
        new = of(tried)
        if not new.log_likelihood > here.log_likelihood:
            break
        theta, here = tried, new
        if promised < tuning.SETTLED_GAIN:
            break
    if not np.any(theta) and start == 0.0:
        return ()
    # Of two errors each has to earn its own: one that explains all names no other.
    price = sum(cost(int(np.count_nonzero(code == _CODES))) for code in codes)
    # An unusually large error is improbable, however little the data contradict it.
    unusual = 0.5 * float(np.sum((theta / _USUAL) ** 2))
    gain = difference(here, base) - unusual
    if "time-offset" in codes and np.isfinite(base.log_likelihood):
        # With the same noise between fixes, which has a gain by chance.
        along = changed(base, theta, is_smooth=True)
        regular = difference(along, base)
        if len(codes) == 1:  # beside the antenna, the less exact one would tell them apart
            columns = _columns(along, partial(changed, base, is_smooth=True), theta, own)
            covariance = gauss_newton(along, columns, theta[own], own)[1]
        # The gain of the stamps is the exact one; it counts if it does not come of other noise.
        least = price + unusual
        if len(codes) > 1 and (arm := fitted(base, base, codes[1:])):  # explains most by itself
            least = difference(arm[0].replay, base) + cost(1)
        gain = gain if regular > least else min(gain, regular - unusual)
    gain, errors = relative_gain(gain, here), np.zeros(_CODES.size)
    errors[own] = np.sqrt(np.diag(covariance))
    if start != 0.0:
        theta[own] += start
        theta[4] = (theta[4] + np.pi) % (2.0 * np.pi) - np.pi
    found = []
    for part in (np.equal(_CODES, code) for code in codes):
        # A part of both that chance explains has not earned it, whatever the other one gains.
        size = theta[part] @ np.linalg.solve(covariance[np.ix_(part[own], part[own])], theta[part])
        if len(codes) > 1 and 0.5 * size < cost(int(np.count_nonzero(part))):
            return ()
        values, spread = (
            dict(zip(_NAMES[part].tolist(), each[part].tolist(), strict=True))
            for each in (theta, errors)
        )
        code, _, where = str(_CODES[part][0]).partition(" ")
        found.append(Fault(code, where, here, gain, price, values, spread))
    return tuple(found)


def _columns(
    here: Replay, of: Callable[[FloatArray], Replay], theta: FloatArray, own: BoolArray
) -> FloatArray:
    """Derivatives of the innovations in their standard deviations by some errors, (3 E, p)."""
    steps = np.diag(_STEPS)[own]
    moved = [(of(theta + step).standard - here.standard) / np.sum(step) for step in steps]
    return np.stack([each.ravel() for each in moved], axis=1)


def gauss_newton(
    here: Replay, J: FloatArray, theta: FloatArray, own: BoolArray
) -> tuple[FloatArray, FloatArray, float]:
    """A Gauss-Newton step, the covariance after it, and the gain that it promises."""
    information = _USUAL[own] ** -2.0  # before the data
    z = here.standard.ravel()
    seen = np.isfinite(z) & np.all(np.isfinite(J), axis=1)
    J, z = J[seen], z[seen]
    score = J.T @ z + information * theta
    covariance: FloatArray = np.asarray(np.linalg.inv(J.T @ J + np.diag(information)), float)
    move = -covariance @ score
    return move, covariance, float(-0.5 * score @ move)


# -- the search -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Faults:
    """Faults that explain the innovations of a log better than that all is right.

    found: Each given the ones before it; empty if there is none.
    explained: Whether the innovations agree with the filter that allows for the faults.
    replay: The log with the faults allowed for.
    """

    found: tuple[Fault, ...]
    explained: bool
    replay: Replay

    @classmethod
    def of(cls, whole: Replay, measured: Measured | None = None, *, search: bool = True) -> Faults:
        """Look for faults, if there is to be a ``search``.

        measured: The log as it was, to be aligned anew without a time offset at its limit, or leap
            seconds where the filter is lost: the start is as wrong as the stamps.
        """
        span = tuning.LARGEST_OFFSET + tuning.OFFSET_MARGIN, tuning.DIAGNOSED
        base = whole.within(*span)
        if not search:
            return cls((), not contradicted(base), base)
        near = cls._near(base)
        if measured is None or not (near._is_far or (base.is_lost and not near.explained)):
            return near._without_doubtful(base)
        own = [each.values["time offset"] for each in near.found if each.code == "time-offset"]
        for offset in (*own, tuning.LEAP_SECONDS, -tuning.LEAP_SECONDS):
            try:
                replay = Replay.of(_earlier(measured, offset)).within(*span)
            except InputError:  # no fix or no heading is left
                continue
            far = cls._near(replay)
            if far.explained and not far._is_far:
                return far._with_offset(offset)
        return near._without_doubtful(base)

    def _without_doubtful(self, base: Replay) -> Faults:
        """No findings where three, or ones that leave a misfit, do not explain all."""
        if self.explained or not self.found:
            return self
        left, before = (each.test().nis.value for each in (self.replay, base))
        most = np.fmin(tuning.MOST_LEFT, 0.5 * (1.0 + before))  # NaN if the filter diverged
        is_sure = left <= most and not self._is_far and 2 * len(self.found) <= tuning.MOST_FAULTS
        return self if is_sure else replace(self, found=(), replay=base)

    @property
    def _is_far(self) -> bool:
        """Whether an error is so large that more of a time offset may be behind it."""
        largest = {"time offset": tuning.FAR_OFFSET * tuning.LARGEST_OFFSET}
        largest |= dict.fromkeys(("forward", "right"), tuning.FAR_ARM * tuning.LARGEST_ARM)
        values = [(name, size) for each in self.found for name, size in each.values.items()]
        return any(abs(size) > largest.get(name, np.inf) for name, size in values)

    @classmethod
    def _near(cls, base: Replay) -> Faults:
        """Faults one after the other, each the most probable, while they are beyond chance."""
        here, found = base, list[Fault]()
        while len(found) < tuning.MOST_FAULTS:
            known = {each.name for each in found}
            tried = [*constant_errors(here, known), *((each,) for each in outliers(here))]
            if contradicted(here, tuning.SUSPECTED) and here.is_lost:  # these are costly
                tried += [(each,) for each in wrong_signs(here)]
                if "heading" not in known:
                    tried.append(far_heading(here))
                if "clock-rate" not in known:
                    tried.append(far_rate(here))
            best = max(filter(None, tried), key=lambda faults: faults[0].excess, default=())
            if not best or best[0].excess <= 0.0:
                break
            own, least = {each.name for each in best}, best[0].excess - cost(1)
            close = (each[0] for each in tried if each and own.isdisjoint(e.name for e in each))
            rivals = [each.name for each in close if each.excess > least]
            if np.cos(best[0].replay.state.rpy[0]) < 0.0 and best[0].code != "axis-signs":
                rivals.append("axis-signs")  # no vehicle starts upside down
            found += [replace(each, rivals=tuple(dict.fromkeys(rivals))) for each in best]
            here = best[0].replay
        return cls(tuple(found), not contradicted(here), here)

    def _with_offset(self, offset: float) -> Faults:
        """The offset as the first fault, then these."""
        near = [each for each in self.found if each.code == "time-offset"]
        name, own, none = "time offset", _CODES == "time-offset", np.zeros(_CODES.size)
        values = {name: offset + sum(each.values[name] for each in near)}
        columns = _columns(self.replay, partial(changed, self.replay), none, own)
        variance = gauss_newton(self.replay, columns, none[own], own)[1].item()
        error = near[0].errors if near else {name: float(np.sqrt(variance))}
        first = Fault("time-offset", "", self.replay, np.inf, cost(1), values, error)
        return replace(self, found=(first, *(each for each in self.found if each not in near)))


def contradicted(replay: Replay, level: float = LEVEL) -> bool:
    """Whether the innovations have another size than expected, or depend on those before."""
    if not np.isfinite(replay.log_likelihood):
        return True
    tests = [replay.test(kind) for kind in replay.kinds]
    return any(each.nis.p_value <= level or each.whiteness <= level for each in tests)


def _earlier(measured: Measured, offset: float) -> Measured:
    """Fixes with earlier stamps, those in the time of the IMU."""
    end = measured.imu.n * measured.imu.dt
    moved = (replace(each, time=each.time - offset) for each in measured.aiding.fixes)
    fixes = tuple(each.part((each.time > 0.0) & (each.time < end)) for each in moved)
    return replace(measured, aiding=replace(measured.aiding, fixes=fixes))


def fault_notice(fault: Fault, start: float) -> Notice:
    """A fault as a notice; ``start`` is the IMU's first epoch on the clock of the files, s."""
    values: dict[str, Any] = {**fault.values}
    values |= {f"{name} error": each for name, each in fault.errors.items()}
    if "time" in values:
        values["time"] += start
    variant = {"outliers": "fixes", "heading": "wrong"}.get(fault.code, "")
    words, also = _words(fault), ", ".join(fault.rivals)
    found = notice(fault.code, fault.where, values, severity="bad", variant=variant, **words)
    if not also:
        return found
    text = f"{found.text}, or another fault that explains the log nearly as well ({also})"
    return replace(found, text=text, values={**values, "rivals": also})


def _words(fault: Fault) -> dict[str, Any]:
    """What the sentence of a fault is filled with."""
    values, errors = fault.values, fault.errors
    if fault.code == "outliers":
        count = int(values["count"])
        fixes = "1 fix is an outlier" if count == 1 else f"{count} fixes are outliers"
        return {"fixes": fixes, "share": per_cent(values["fraction"]), "hint": "leave them out"}
    if fault.code == "time-offset":
        offset, scale = values["time offset"], ""
        if round(abs(offset)) == tuning.LEAP_SECONDS:
            scale = f", as GPS time is ahead of UTC by {tuning.LEAP_SECONDS:g} s"
        late, change = ("late", "subtract it from") if offset > 0.0 else ("early", "add it to")
        error = errors["time offset"]
        return {"size": abs(offset), "late": late, "error": error, "scale": scale, "change": change}
    if fault.code == "clock-rate":
        rate, error = values["clock rate"], errors["clock rate"]
        fast = "fast" if rate < 0.0 else "slow"
        return {"share": abs(rate), "fast": fast, "error_share": error, "factor": 1.0 + rate}
    if fault.code == "scale-error":
        parts = ", ".join(f"{x:.1%} {axis} ({errors[axis]:.1%})" for axis, x in values.items())
        # A small error beside a large one may be of the other axes.
        seen = [f"{fault.where}_{a}" for a, x in values.items() if abs(x) > tuning.SEEN * errors[a]]
        return {"parts": parts, "axes": ", ".join(seen) or "all axes"}
    if fault.code == "heading":
        yaw = np.degrees(fault.replay.state.rpy[2]) % 360.0
        hint = f"give the heading {yaw:.1f} deg, or turn the axes to forward, right, down"
        by, error_deg = np.degrees(values["heading"]), np.degrees(errors["heading"])
        return {"by": by, "error_deg": error_deg, "hint": hint}
    if fault.code == "lever-arm":
        return _arm_words(fault)
    wrong, unseen = (
        [f"{fault.where}_{axis}" for axis, sign in values.items() if sign == wanted]
        for wanted in (-1.0, 0.0)
    )
    unknown = f" (this motion does not show the sign of {', '.join(unseen)})" if unseen else ""
    reverse = ", ".join(wrong or unseen)
    return {"wrong": ", ".join(wrong) or "an axis", "unseen": unknown, "reverse": reverse}


def _arm_words(fault: Fault) -> dict[str, Any]:
    values, errors = fault.values, fault.errors
    parts = ", ".join(f"{values[name]:.2f} m {name} ({errors[name]:.1g})" for name in values)
    # A part that the motion does not show stays as it was: an estimate of it is mostly error.
    unseen = [name for name in values if tuning.SEEN * errors[name] > tuning.UNSEEN]
    known = [0.0 if name in unseen else values[name] for name in values]
    arm = np.asarray(fault.replay.aiding.lever_arm) - list(values.values()) + known
    hint = f"give the lever arm {','.join(f'{each:.2f}' for each in arm)}, or measure it"
    if unseen:
        also = f"measure {' and '.join(unseen)}, which this motion does not show"
        hint = hint.replace(", or measure it", f"; {also}")
    if len(unseen) == len(values):
        hint = "measure it: this motion does not show any of its parts well enough"
    return {"parts": parts, "hint": hint}
