"""The faults that a log shows: looked for before the sensor models are blamed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gmwm._core.text import per_cent
from gmwm.errors import InputError
from gmwm.ins.imu import Imu
from gmwm.ins.logs import tuning
from gmwm.ins.logs.hypotheses import (
    LEVEL,
    Candidate,
    Fault,
    constant_errors,
    cost,
    far_heading,
    outliers,
    wrong_signs,
)
from gmwm.ins.logs.measured import Measured
from gmwm.ins.logs.replay import Replay, alignment_of
from gmwm.issues import Notice, notice


@dataclass(frozen=True, eq=False)
class Faults:
    """Faults that explain the innovations of a log better than that all is right.

    found: Each given the ones before it; empty if there is none.
    alternatives: Codes that explain the log nearly as well as the first.
    explained: Whether the innovations agree with the filter that allows for the faults.
    replay: The log with the faults allowed for.
    resolution: Constant error -> its standard error from this motion, s, m, rad.
    """

    found: tuple[Fault, ...]
    alternatives: tuple[str, ...]
    explained: bool
    replay: Replay
    resolution: dict[str, float]

    @classmethod
    def of(cls, whole: Replay, measured: Measured | None = None) -> Faults:
        """Look for faults.

        measured: The log as it was, to be aligned anew where the filter is lost.
        """
        base = whole.within(tuning.LARGEST_OFFSET + tuning.OFFSET_MARGIN, tuning.DIAGNOSED)
        near = cls._near(base)
        offsets = [abs(each.values.get("time offset", 0.0)) for each in near.found]
        is_suspected = base.is_lost or max(offsets, default=0.0) >= tuning.LARGEST_OFFSET
        far = far_offset(measured) if measured is not None and is_suspected else None
        if measured is None or far is None:
            return near
        offset, replay, start = far
        delay = start - alignment_of(measured).epoch * measured.imu.dt
        base = replay.within(tuning.LARGEST_OFFSET + tuning.OFFSET_MARGIN, tuning.DIAGNOSED)

        def effort(each: Faults) -> tuple[bool, int, float]:
            fixes = max(each.replay.standard.shape[0], 1)  # the two may leave others out
            return not each.explained, len(each.found), -each.replay.log_likelihood / fixes

        return min(near, cls._near(base)._with_offset(offset, delay), key=effort)

    @classmethod
    def _near(cls, base: Replay) -> Faults:
        """Faults one after the other, each the most probable, while they are beyond chance."""
        here, found = base, list[Fault]()
        alternatives: tuple[str, ...] = ()
        resolution: dict[str, float] = {}
        while len(found) < tuning.MOST_FAULTS:
            first = list(constant_errors(here))
            alone = {name: e for each in first[:-1] for name, e in each.errors.items()}
            # Of stamps and antenna the errors of both together: one could be taken for the other.
            resolution = alone | first[-1].errors
            known = {each.code for each in found} - {"outliers", "axis-signs"}
            worth = [
                each
                for each in _candidates(here, first)
                if not each.codes & known and each.gain > cost(1)
            ]
            refined = [faults for each in worth if (faults := each.refined())]
            refined.sort(key=lambda faults: -faults[0].excess)
            if not refined or refined[0][0].excess <= 0.0:
                break
            best, *others = refined
            if not found:
                least = max(best[0].excess - tuning.AMBIGUOUS, 0.0)
                codes = {each[0].code for each in others if each[0].excess > least}
                hidden = any(
                    resolution[name] > tuning.SEEN * alone[name]
                    for name in best[0].values.keys() & alone.keys()
                )
                if len(best) == 1 and best[0].code in first[-1].codes and hidden:
                    codes |= first[-1].codes
                alternatives = tuple(sorted(codes - {each.code for each in best}))
            found += best
            here = found[-1].replay
        found, here = _with_outliers_anew(base, found, here)
        return cls(tuple(found), alternatives, not contradicted(here), here, resolution)

    def _with_offset(self, offset: float, delay: float) -> Faults:
        """The offset as the first fault, then these; ``delay`` of the filter's start in s."""
        near = [each for each in self.found if each.code == "time-offset"]
        # A standstill counts even where it is not a fault itself.
        left = near or next(constant_errors(self.replay)).refined()
        by = offset + sum(each.values["time offset"] for each in left)
        error = left[0].errors if left else {"time offset": self.resolution["time offset"]}

        def change(replay: Replay) -> Replay:
            return replay.later(lambda time: np.full_like(time, -by))

        values = {"time offset": by}
        found = [Fault("time-offset", "", change, self.replay, np.inf, cost(1), values, error)]
        for each in (each for each in self.found if each not in near):
            times = {"time": each.values["time"] + delay} if "time" in each.values else {}
            found.append(replace(each, values=each.values | times))
        alternatives = () if near else self.alternatives
        return replace(self, found=tuple(found), alternatives=alternatives)


def contradicted(replay: Replay, level: float = LEVEL) -> bool:
    """Whether the innovations have another size than expected, or depend on those before."""
    if not np.isfinite(replay.log_likelihood):
        return True
    tests = [replay.test(kind) for kind in replay.kinds]
    return any(each.nis.p_value <= level or each.whiteness <= level for each in tests)


def _candidates(here: Replay, constants: Sequence[Candidate]) -> Iterator[Candidate]:
    """Possible faults; the costly ones only where the filter is lost."""
    yield from constants
    cleaned = outliers(here)
    if cleaned is not None:
        yield cleaned
    if contradicted(here, tuning.SUSPECTED) and here.is_lost:
        yield far_heading(here)
        yield from wrong_signs(here)


def _with_outliers_anew(
    base: Replay, found: list[Fault], here: Replay
) -> tuple[list[Fault], Replay]:
    """Outliers found again, given faults found after them that made good fixes look bad."""
    codes = [each.code for each in found]
    if "outliers" not in codes or codes[-1] == "outliers":
        return found, here
    others = [each for each in found if each.code != "outliers"]
    replay = base
    for each in others:
        replay = each.change(replay)
    cleaned = outliers(replay)
    if cleaned is None:
        return (others, replay) if not contradicted(replay) else (found, here)
    (again,) = cleaned.refined()
    place = codes.index("outliers")
    return [*others[:place], again, *others[place:]], again.replay


# -- stamps that are off by many seconds ----------------------------------------------------------


def far_offset(measured: Measured) -> tuple[float, Replay, float] | None:
    """A time offset of seconds, as of GPS time for UTC.

    The start is as wrong as the stamps, so that the innovations show no way: the filter is aligned
    and run with offsets all over, then nearer and nearer to the best.

    Returns: Delay of the stamps, s; the log without it, aligned anew; and the start of its filter,
        s since the first epoch of the IMU. ``None`` if no offset makes the innovations small.
    """
    imu = measured.imu
    n = min(imu.n, round(tuning.DIAGNOSED / imu.dt))
    part = replace(measured, imu=Imu(imu.dt, imu.rotation[:n], imu.velocity[:n]))
    part = _earlier(part, 0.0)
    step = tuning.FAR_STEP
    steps = round(tuning.FARTHEST_OFFSET / step)
    sizes = {each * step: _size(part, each * step) for each in range(-steps, steps + 1)}
    best = min(sizes, key=sizes.__getitem__)
    while step > tuning.FAR_NEAR:
        step *= 0.5
        sizes |= {each: _size(part, each) for each in (best - step, best + step)}
        best = min(sizes, key=sizes.__getitem__)
    if not sizes[best] < min(tuning.FAR_BETTER * sizes[0.0], tuning.LOST):
        return None  # as lost as before, or nearly
    earlier = _earlier(part, best)
    alignment = alignment_of(earlier)
    return best, Replay.of(earlier, alignment), alignment.epoch * imu.dt


def _size(measured: Measured, offset: float) -> float:
    """Mean square of the innovations, robust to outliers; infinite if the filter fails."""
    earlier = _earlier(measured, offset)
    try:
        replay = Replay.of(earlier, alignment_of(earlier))
    except InputError:
        return np.inf
    replay = replay.within(0.0, tuning.DIAGNOSED)
    fixes = sum(e.time.size for e in measured.aiding.fixes if e.kind != "standstill")
    is_short = replay.standard.shape[0] < tuning.FAR_LEFT * fixes
    if is_short or not np.isfinite(replay.log_likelihood):
        return np.inf
    return float(np.expm1(np.nanmean(np.log1p(replay.standard**2))))


def _earlier(measured: Measured, offset: float) -> Measured:
    """Fixes with earlier stamps, those in the time of the IMU."""
    fixes = []
    for each in measured.aiding.fixes:
        time = each.time - offset
        inside = (time > 0.0) & (time < measured.imu.n * measured.imu.dt)
        fixes.append(replace(each.part(inside), time=time[inside]))
    return replace(measured, aiding=replace(measured.aiding, fixes=tuple(fixes)))


# -- notices --------------------------------------------------------------------------------------


def fault_notice(fault: Fault, start: float) -> Notice:
    """A fault as a notice; ``start`` is the filter's on the clock of the files, s."""
    values: dict[str, Any] = {**fault.values}
    values |= {f"{name} error": each for name, each in fault.errors.items()}
    if "time" in values:
        values["time"] += start
    variant = {"outliers": "fixes", "heading": "wrong"}.get(fault.code, "")
    return notice(fault.code, fault.where, values, severity="bad", variant=variant, **_words(fault))


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
    names = ("forward", "right", "down")
    parts = ", ".join(
        f"{fault.values[name]:.2f} m {name} ({fault.errors[name]:.1g})" for name in names
    )
    # A part that the motion does not show stays as it was: an estimate of it is mostly error.
    unseen = [name for name in names if tuning.SEEN * fault.errors[name] > tuning.UNSEEN["m"]]
    arm = ",".join(
        f"{each - (fault.values[name] if name in unseen else 0.0):.2f}"
        for name, each in zip(names, np.asarray(fault.replay.aiding.lever_arm), strict=True)
    )
    hint = f"give the lever arm {arm}, or measure it"
    if len(unseen) == len(names):
        hint = "measure it: this motion shows none of its parts well enough"
    elif unseen:
        hint = (
            f"give the lever arm {arm}, and measure it {' and '.join(unseen)}, which this motion "
            "does not show and is left as it was"
        )
    return {"parts": parts, "hint": hint}


_MOTION = {
    "time offset": ("a time offset of the fixes", "s", 1.0),
    "forward": ("a lever arm forward", "m", 1.0),
    "right": ("a lever arm to the right", "m", 1.0),
    "down": ("a lever arm down", "m", 1.0),
    "heading": ("a wrong initial heading", "deg", float(np.degrees(1.0))),
}


def resolution_notice(faults: Faults) -> Notice:
    """The smallest constant errors that this motion shows, and the ones that it does not show."""
    seen, unseen = [], []
    values: dict[str, float] = {}
    for name, (what, unit, factor) in _MOTION.items():
        if name not in faults.resolution:
            continue
        values[name] = faults.resolution[name]
        least = tuning.SEEN * values[name]
        if least > tuning.UNSEEN["heading" if name == "heading" else unit]:
            unseen.append(what)
        else:
            seen.append(f"{what} of {least * factor:.2g} {unit}")
    shown = "from here on: " + "; ".join(seen) if seen else "no constant error"
    missing = "; it would not show " + ", ".join(unseen) if unseen else ""
    return notice("resolution", values=values, shown=shown, missing=missing)
