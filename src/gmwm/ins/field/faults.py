"""The fault that a log shows: looked for before the sensor models are blamed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gmwm._core.notices import Notice, Severity
from gmwm._core.text import brief, per_cent
from gmwm.ins import tuning
from gmwm.ins.field.explanations import (
    LEVEL,
    Candidate,
    Explanation,
    clock_step,
    constant_errors,
    cost,
    far_heading,
    rarer_errors,
    wrong_signs,
)
from gmwm.ins.field.far_stamps import FarStamps
from gmwm.ins.field.measured import Measured
from gmwm.ins.field.noises import coloured, fix_noise, outliers, sensor_noise
from gmwm.ins.field.replay import Replay, alignment_of
from gmwm.ins.geometry import STANDARD_GRAVITY

_CONSTANT = frozenset({"time-offset", "clock-drift", "lever-arm", "heading"})


@dataclass(frozen=True, eq=False)
class Faults:
    """What explains the innovations of a log better than that all is right.

    found: Each given those before it; empty if there is none.
    alternatives: Codes that explain the log nearly as well as the first.
    explained: Whether the innovations agree with the filter, with these allowed for, and none is a
        noise that no sensor has.
    replay: The log with these allowed for.
    resolution: Constant error -> its standard error from this motion, s, m, rad.
    """

    found: tuple[Explanation, ...]
    alternatives: tuple[str, ...]
    explained: bool
    replay: Replay
    resolution: dict[str, float]

    @classmethod
    def of(cls, whole: Replay, measured: Measured | None = None) -> Faults:
        """Look for faults.

        measured: The log as it was, to be aligned anew where the filter is lost.
        """
        near = cls._near(whole)
        if measured is None or not (whole.diagnosed().is_lost or _is_at_its_end(near)):
            return near
        far = FarStamps.of(measured)
        if far is None:
            return near
        later = far.start - alignment_of(measured).epoch * measured.imu.dt
        return min(near, cls._near(far.replay)._beside(far.offset, later), key=cls._effort)

    @classmethod
    def _near(cls, whole: Replay) -> Faults:
        """Faults that leave the filter near enough to be seen in its innovations.

        One after the other, the explanation is taken that makes the fixes most probable, as long as
        it is more than chance would give.
        """
        base = whole.diagnosed()
        here, found = base, list[Explanation]()
        alternatives: tuple[str, ...] = ()
        resolution: dict[str, float] = {}
        while len(found) < tuning.MOST_FAULTS:
            first = list(constant_errors(here))
            alone = {name: e for each in first[:-1] for name, e in each.errors.items()}
            # Those of stamps and antenna together, for each could be taken for the other.
            resolution = alone | first[-1].errors
            known = _CONSTANT & {each.code for each in found}
            refined = _best(_candidates(here, first, known))
            if not refined or refined[0][0].excess <= 0.0:
                break
            best = refined[0]
            if not found:
                alternatives = tuple(
                    each[0].code for each in refined[1:]
                    if each[0].excess > max(best[0].excess - tuning.AMBIGUOUS, 0.0)
                    and each[0].code not in {one.code for one in best}
                )  # fmt: skip
                if len(best) == 1 and best[0].code in first[-1].codes and any(
                    resolution[name] > tuning.SEEN * alone[name] for name in best[0].values
                ):  # fmt: skip
                    other = first[-1].codes - {best[0].code}
                    alternatives = tuple(sorted({*alternatives, *other}))
                if _may_be_a_bias(best[0]):
                    alternatives = tuple(sorted({*alternatives, "sensor-slow-errors"}))
            found += best
            here = found[-1].replay
        found, here = _cleaned_again(base, found, here)
        explained = not contradicted(here) and not any(map(_is_beyond_noise, found))
        return cls(tuple(found), alternatives, explained, here, resolution)

    def _effort(self) -> tuple[bool, int, float]:
        """The less, the better this explains a log, also if others leave other fixes out."""
        return not self.explained, len(self.found), -self.replay.log_likelihood_of_one

    def _beside(self, offset: float, later: float) -> Faults:
        """What was found with stamps that are earlier by an offset, with that as the first fault.

        later: By how much the filter started later, s.
        """
        near = [each for each in self.found if each.code == "time-offset"]
        # What is left counts also where it is no fault of its own.
        left = near or next(constant_errors(self.replay)).refined()
        by = offset + sum(each.values["time offset"] for each in left)
        error = left[0].errors if left else {"time offset": self.resolution["time offset"]}
        stamps = Explanation(
            "time-offset", "", lambda log: log.later(lambda time: np.full_like(time, -by)),
            self.replay, np.inf, cost(1), {"time offset": by}, error,
        )  # fmt: skip
        others = [
            replace(each, values=each.values | {
                name: each.values[name] + later for name in _TIMES & each.values.keys()
            })
            for each in self.found if each not in near
        ]  # fmt: skip
        alternatives = () if near else self.alternatives
        return replace(self, found=(stamps, *others), alternatives=alternatives)


def contradicted(replay: Replay, level: float = LEVEL) -> bool:
    """Whether the innovations have another size than expected, or depend on those before."""
    if not np.isfinite(replay.log_likelihood):
        return True
    tests = [replay.test(kind) for kind in replay.kinds()]
    return any(each.nis.p_value <= level or each.whiteness <= level for each in tests)


def _candidates(here: Replay, constants: list[Candidate], known: frozenset[str]) -> list[Candidate]:
    """Those worth a look; the costly ones only where something is wrong."""
    found = [*constants]
    cleaned = outliers(here)
    if cleaned is not None:
        found.append(cleaned)
    if contradicted(here, tuning.SUSPECTED) or any(each.gain > cost(1) for each in found):
        if here.is_lost:
            found += [far_heading(here), *wrong_signs(here)]
        found += rarer_errors(here)
        found += [each for each in (clock_step(here), coloured(here)) if each is not None]
        found += [*fix_noise(here), *sensor_noise(here)]
    return [each for each in found if not each.codes & known]


def _best(candidates: list[Candidate]) -> list[tuple[Explanation, ...]]:
    """The most probable explanations, best first; a fault of the log before one of the sensors that
    is hardly more probable.
    """
    promising = [each for each in candidates if each.gain > cost(1)]
    promising = sorted(promising, key=lambda each: -each.gain)[: tuning.REFINED]
    refined = [each.refined() for each in promising]
    found = sorted((each for each in refined if each), key=lambda each: -each[0].excess)
    if not found:
        return []
    least = max(found[0][0].excess - tuning.AMBIGUOUS, 0.0)

    def is_second(each: tuple[Explanation, ...]) -> bool:
        return each[0].code.startswith("sensor-") or not each[0].excess > least

    return sorted(found, key=is_second)


def _cleaned_again(
    base: Replay, found: list[Explanation], here: Replay
) -> tuple[list[Explanation], Replay]:
    """Outliers anew, where something else was found after them that made good fixes look bad."""
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


def _is_at_its_end(found: Faults) -> bool:
    """Whether stamps are off by the most that is looked for near."""
    return any(abs(each.values.get("time offset", 0.0)) >= tuning.LARGEST_OFFSET
               for each in found.found)  # fmt: skip


def _is_beyond_noise(fault: Explanation) -> bool:
    """Whether a sensor would be so much worse than its model that another fault must be behind it.

    Enough noise explains anything. Vibration may be that of accelerometers.
    """
    if not fault.code.startswith("sensor-") or fault.values["factor"] < tuning.NOT_NOISE:
        return False
    return (fault.code, fault.where) != ("sensor-white-noise", "accel")


def _may_be_a_bias(fault: Explanation) -> bool:
    """Whether only the vertical shows a scale error: gravity is constant there, as a bias is."""
    return (fault.code, fault.where) == ("scale-error", "accel") and all(
        abs(fault.values[axis]) < tuning.SEEN * fault.errors[axis] for axis in ("x", "y")
    )


# -- words ----------------------------------------------------------------------------------------

_TIMES = frozenset({"after", "before", "time"})

_MOTION = {
    "time offset": ("time-offset", "a time offset of the fixes", "s", 1.0),
    "forward": ("lever-arm", "a lever arm forward", "m", 1.0),
    "right": ("lever-arm", "a lever arm to the right", "m", 1.0),
    "down": ("lever-arm", "a lever arm down", "m", 1.0),
    "heading": ("heading", "a wrong initial heading", "deg", float(np.degrees(1.0))),
}


def fault_notice(fault: Explanation, start: float, assumed: Mapping[str, Notice]) -> Notice:
    """A fault as a notice: ``values`` holds what was estimated, SI, and standard errors.

    start: What the clock on which a step is dated shows where the filter starts, s.
    assumed: Kind of fixes -> that their standard deviations were assumed, which is no fault of
        the log.
    """
    values: dict[str, Any] = {**fault.values}
    values |= {f"{name} error": each for name, each in fault.errors.items()}
    values |= {name: values[name] + start for name in _TIMES & values.keys()}
    text, hint = _WORDS[fault.code](replace(fault, values=values))
    severity = _severity(fault)
    if fault.code == "fix-noise" and fault.where in assumed:
        severity = "note" if severity == "warning" else "warning"
        text, hint = _assumed_sd(fault.values["factor"], assumed[fault.where])
        values["assumed"] = True
    return Notice(fault.code, severity, fault.where, text, values, hint)


def resolution_notice(faults: Faults) -> Notice:
    """How small a constant error this motion shows, and which it does not show."""
    seen: list[tuple[str, float, str]] = []
    unseen: list[tuple[str, float, str]] = []
    values: dict[str, float] = {}
    for name, (_, what, unit, factor) in _MOTION.items():
        if name not in faults.resolution:
            continue
        least = tuning.SEEN * faults.resolution[name]
        values[name] = faults.resolution[name]
        usual = tuning.UNSEEN["heading" if name == "heading" else unit]
        (unseen if least > usual else seen).append((what, least * factor, unit))
    text = "; ".join(f"{what} of {least:.2g} {unit}" for what, least, unit in seen)
    text = f"this motion would show, from here on: {text}" if seen else (
        "this motion would show no constant error"
    )  # fmt: skip
    if unseen:
        text += "; it would not show " + ", ".join(what for what, *_ in unseen)
    return Notice("resolution", "note", "", text, values)


def _severity(fault: Explanation) -> Severity:
    mild = 1.0 / tuning.MILD < fault.values.get("factor", np.inf) < tuning.MILD
    return "warning" if fault.code == "fix-noise" and mild else "bad"


def _time(fault: Explanation) -> tuple[str, str]:
    offset = fault.values["time offset"]
    text = (
        f"the fixes are stamped {abs(offset):.3g} s too {'late' if offset > 0.0 else 'early'} "
        f"(standard error {fault.errors['time offset']:.1g} s)"
    )
    if round(abs(offset)) == tuning.LEAP_SECONDS:
        text += f", as GPS time is ahead of UTC by {tuning.LEAP_SECONDS:g} s"
    return text, "subtract it from their times" if offset > 0.0 else "add it to their times"


def _step(fault: Explanation) -> tuple[str, str]:
    offset, late = fault.values["time offset"], fault.values["time offset"] > 0.0
    return (
        f"between {fault.values['after']:.10g} s and {fault.values['before']:.10g} s the stamps of "
        f"the fixes jump by {abs(offset):.3g} s {'forward' if late else 'back'} against the IMU "
        f"(standard error {fault.errors['time offset']:.1g} s): a clock was set, or the IMU lost "
        "samples",
        f"{'subtract it from' if late else 'add it to'} their times from there on",
    )


def _drift(fault: Explanation) -> tuple[str, str]:
    drift = fault.values["drift"]
    return (
        f"the clock of the fixes {'gains' if drift > 0.0 else 'loses'} {abs(1e6 * drift):.3g} ppm "
        f"on the IMU's (standard error {brief(1e6 * fault.errors['drift'], 1)} ppm)",
        f"stamp both by one clock, or divide the IMU's rate by {1.0 + drift:.6f}",
    )


def _scale(fault: Explanation) -> tuple[str, str]:
    parts = ", ".join(
        f"{per_cent(fault.values[axis])} {axis} ({per_cent(fault.errors[axis], 1)})"
        for axis in ("x", "y", "z")
    )
    text = f"the scale is wrong by {parts}, standard errors in brackets"
    if _may_be_a_bias(fault):
        text += (
            "; this motion does not tell it from a bias of z of "
            f"{abs(fault.values['z']) * STANDARD_GRAVITY:.2g} m/s^2"
        )
    size = {axis: abs(fault.values[axis]) / fault.errors[axis] for axis in ("x", "y", "z")}
    seen = [axis for axis in size if size[axis] > min(tuning.SEEN, 0.9 * max(size.values()))]
    return text, f"calibrate the scale of {', '.join(f'{fault.where}_{axis}' for axis in seen)}"


def _arm(fault: Explanation) -> tuple[str, str]:
    parts = ", ".join(
        f"{fault.values[name]:.2f} m {name} ({fault.errors[name]:.1g})"
        for name in ("forward", "right", "down")
    )
    # What the motion does not show stays as it was: an estimate of it is mostly error.
    names = ("forward", "right", "down")
    usual = tuning.UNSEEN["m"]
    unseen = [name for name in names if tuning.SEEN * fault.errors[name] > usual]
    arm = ",".join(
        f"{each - (fault.values[name] if name in unseen else 0.0):.2f}"
        for name, each in zip(names, np.asarray(fault.replay.aiding.lever_arm), strict=True)
    )
    if len(unseen) == len(names):
        advice = "measure it: this motion shows none of its parts well enough"
    elif unseen:
        parts_unseen = " and ".join(unseen)
        advice = (
            f"give the lever arm {arm}, and measure it {parts_unseen}, which this motion does not "
            "show and is left as it was"
        )
    else:
        advice = f"give the lever arm {arm}, or measure it"
    return (
        f"the antenna is off the lever arm by {parts}, standard errors in brackets", advice,
    )  # fmt: skip


def _heading(fault: Explanation) -> tuple[str, str]:
    by, yaw = np.degrees(fault.values["heading"]), np.degrees(fault.replay.state.rpy[2]) % 360.0
    return (
        f"the heading that the filter started with is wrong by {by:.1f} deg (standard error "
        f"{np.degrees(fault.errors['heading']):.1g} deg): the IMU is mounted rotated, or drives "
        "backwards",
        f"give the heading {yaw:.1f} deg, or turn the axes to forward, right, down",
    )


def _signs(fault: Explanation) -> tuple[str, str]:
    turned, unseen = (
        [f"{fault.where}_{axis}" for axis, sign in fault.values.items() if sign == wanted]
        for wanted in (-1.0, 0.0)
    )
    text = f"the sign of {', '.join(turned) or 'an axis'} is the wrong one"
    if unseen:
        text += f" (this motion does not show that of {', '.join(unseen)})"
    return text, (
        "bring gyros and accelerometers to the same axes forward, right, down: turn "
        f"{', '.join(turned or unseen)} round, and check every gyro by hand, for a drive does not "
        "show them all: positive while the right side goes down (x), the front goes up (y), it "
        "turns right (z)"
    )


def _outliers(fault: Explanation) -> tuple[str, str]:
    count = int(fault.values["count"])
    share = per_cent(fault.values["fraction"])
    return (
        f"{count} {'fix is an outlier' if count == 1 else 'fixes are outliers'} ({share})",
        "leave them out",
    )


def _coloured(fault: Explanation) -> tuple[str, str]:
    size = ", ".join(f"{fault.values[name]:.2g}" for name in ("north", "east", "down"))
    return (
        f"the errors of the fixes are coloured: {size} m (north, east, down) with a correlation "
        f"time of {fault.values['tau']:.2g} s, beside white noise of {fault.values['factor']:.2g} "
        "times their standard deviations",
        "the filter is too sure of its position by that; let it estimate the coloured error",
    )


def _fix_noise(fault: Explanation) -> tuple[str, str]:
    factor = fault.values["factor"]
    return (
        f"the fixes are {brief(factor)} times their standard deviations",
        f"multiply those by {factor:.2g}",
    )


def _assumed_sd(factor: float, assumed: Notice) -> tuple[str, str]:
    shown, right = (
        ",".join(f"{scale * assumed.values[name]:.2g}" for name in ("north", "east", "down"))
        for scale in (1.0, factor)
    )
    unit = "m/s" if assumed.where == "velocity" else "m"
    return (
        f"the errors of the fixes are {factor:.2g} times the standard deviations assumed here, "
        f"{shown.replace(',', ', ')} {unit}",
        f"{assumed.hint} {right}",
    )


def _white(fault: Explanation) -> tuple[str, str]:
    factor = fault.values["factor"]
    text = f"white noise is {brief(factor)} times the model's"
    if factor > tuning.NOT_NOISE:
        return text, "vibration adds to it, but look first at units, axes and stamps"
    return (
        text,
        f"the sensor model is wrong: multiply N by {factor:.2g}, or calibrate again; vibration "
        "adds to it",
    )


def _slow(fault: Explanation) -> tuple[str, str]:
    factor = fault.values["factor"]
    text = f"slow errors and biases are {brief(factor)} times the model's"
    if factor > tuning.NOT_NOISE:
        return text, "look at units, axes and stamps, and at the bias, before the model"
    return text, "the sensor model or the bias is wrong: calibrate again, or give the bias"


_WORDS: dict[str, Callable[[Explanation], tuple[str, str]]] = {
    "time-offset": _time,
    "clock-step": _step,
    "clock-drift": _drift,
    "scale-error": _scale,
    "lever-arm": _arm,
    "heading": _heading,
    "axis-signs": _signs,
    "outliers": _outliers,
    "coloured": _coloured,
    "fix-noise": _fix_noise,
    "sensor-white-noise": _white,
    "sensor-slow-errors": _slow,
}
