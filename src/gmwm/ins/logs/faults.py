"""The faults that a log shows: looked for before the sensor models are blamed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gmwm._core.text import per_cent
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.logs.hypotheses import (
    LEVEL,
    Fault,
    constant_errors,
    cost,
    far_heading,
    outliers,
    wrong_signs,
)
from gmwm.ins.logs.measured import Measured
from gmwm.ins.logs.replay import Replay
from gmwm.issues import Notice, notice


@dataclass(frozen=True, eq=False)
class Faults:
    """Faults that explain the innovations of a log better than that all is right.

    found: Each given the ones before it; empty if there is none.
    explained: Whether the innovations agree with the filter that allows for the faults.
    replay: The log with the faults allowed for.
    resolution: Constant error -> its standard error from this motion, s, m, rad.
    """

    found: tuple[Fault, ...]
    explained: bool
    replay: Replay
    resolution: dict[str, float]

    @classmethod
    def of(cls, whole: Replay, measured: Measured | None = None) -> Faults:
        """Look for faults.

        measured: The log as it was, to be aligned anew without leap seconds where the filter is
            lost: the start is as wrong as the stamps.
        """
        span = tuning.LARGEST_OFFSET + tuning.OFFSET_MARGIN, tuning.DIAGNOSED
        base = whole.within(*span)
        near = cls._near(base)
        if measured is None or near.explained or not base.is_lost:
            return near
        for offset in (tuning.LEAP_SECONDS, -tuning.LEAP_SECONDS):
            try:
                replay = Replay.of(_earlier(measured, offset)).within(*span)
            except InputError:  # no fix or no heading is left
                continue
            far = cls._near(replay)
            if far.explained:
                return far._with_offset(offset)
        return near

    @classmethod
    def _near(cls, base: Replay) -> Faults:
        """Faults one after the other, each the most probable, while they are beyond chance."""
        here, found = base, list[Fault]()
        resolution: dict[str, float] = {}
        while len(found) < tuning.MOST_FAULTS:
            known = {each.code for each in found}
            tried, resolution = constant_errors(here, known)
            tried += [(each,) for each in outliers(here)]
            if contradicted(here, tuning.SUSPECTED) and here.is_lost:  # these are costly
                tried += [(each,) for each in wrong_signs(here)]
                if "heading" not in known:
                    tried.append(far_heading(here))
            best = max(filter(None, tried), key=lambda faults: faults[0].excess, default=())
            if not best or best[0].excess <= 0.0:
                break
            found += best
            here = best[0].replay
        return cls(tuple(found), not contradicted(here), here, resolution)

    def _with_offset(self, offset: float) -> Faults:
        """The offset as the first fault, then these."""
        near = [each for each in self.found if each.code == "time-offset"]
        name = "time offset"
        values = {name: offset + sum(each.values[name] for each in near)}
        error = near[0].errors if near else {name: self.resolution[name]}
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
    fixes = []
    for each in measured.aiding.fixes:
        time = each.time - offset
        inside = (time > 0.0) & (time < measured.imu.n * measured.imu.dt)
        fixes.append(replace(each.part(inside), time=time[inside]))
    return replace(measured, aiding=replace(measured.aiding, fixes=tuple(fixes)))


def fault_notice(fault: Fault, start: float) -> Notice:
    """A fault as a notice; ``start`` is the IMU's first epoch on the clock of the files, s."""
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
    values, errors = fault.values, fault.errors
    parts = ", ".join(f"{values[name]:.2f} m {name} ({errors[name]:.1g})" for name in values)
    # A part that the motion does not show stays as it was: an estimate of it is mostly error.
    unseen = [name for name in values if tuning.SEEN * errors[name] > tuning.UNSEEN["m"]]
    if len(unseen) == len(values):
        hint = "measure it: this motion does not show any of its parts well enough"
        return {"parts": parts, "hint": hint}
    arm = ",".join(
        f"{each - (values[name] if name in unseen else 0.0):.2f}"
        for name, each in zip(values, np.asarray(fault.replay.aiding.lever_arm), strict=True)
    )
    hint = f"give the lever arm {arm}, " + (
        f"and measure it {' and '.join(unseen)}, which this motion does not show and is left as it "
        "was"
        if unseen
        else "or measure it"
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
