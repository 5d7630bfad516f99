"""Real data filtered: the solution, and whether the innovations agree with the filter's model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gmwm._core.files import written
from gmwm._core.pages import Reported
from gmwm._core.text import brief, bullets, wrapped
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.filter import Solution
from gmwm.ins.filter.measurements import KINDS
from gmwm.ins.geometry import ned_difference
from gmwm.ins.logs.alignment import Alignment, align
from gmwm.ins.logs.faults import LEVEL, Faults, fault_notice
from gmwm.ins.logs.measured import Measured, ReferenceErrors
from gmwm.ins.logs.replay import Replay, innovation_sizes
from gmwm.ins.simulation.consistency import InnovationTest
from gmwm.issues import Notice, Severity, notice, worst_first

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEADER = (
    "time_s,latitude_deg,longitude_deg,height_m,velocity_north_mps,velocity_east_mps,"
    "velocity_down_mps,roll_deg,pitch_deg,yaw_deg,sd_north_m,sd_east_m,sd_down_m,"
    "sd_velocity_north_mps,sd_velocity_east_mps,sd_velocity_down_mps,sd_tilt_north_deg,"
    "sd_tilt_east_deg,sd_heading_deg"
)


@dataclass(frozen=True)
class LongestOutage:
    """The longest time without a position fix.

    start, end: s since the filter's start.
    sd: Predicted standard deviations of the position to the north, east and down before the fix at
        its end, m; NaN if the filter diverged before.
    distance: Horizontal distance of the fix at its end from where it was expected, m; ``None`` if
        there is none.
    """

    start: float
    end: float
    sd: tuple[float, float, float]
    distance: float | None


@dataclass(frozen=True, eq=False)
class Navigated(Reported):
    """A solution of real data."""

    measured: Measured
    alignment: Alignment
    solution: Solution
    longest_outage: LongestOutage
    against: ReferenceErrors | None = None

    @classmethod
    def of(cls, measured: Measured, interval: float = 1.0) -> Navigated:
        """Align and filter; the solution is kept every ``interval`` (s).

        Raises InputError if the initial state cannot be known, or no fix follows it.
        """
        alignment = align(measured)
        replay = Replay.of(measured, alignment)
        positions = replay.aiding.of("position")
        if positions is None:
            raise InputError("no position fix after the first: add fixes or cut the log earlier")
        ends = np.concatenate([[0.0], positions.time, [replay.imu.n * replay.imu.dt]])
        longest = int(np.argmax(np.diff(ends)))
        start, end = ends[longest : longest + 2].tolist()
        solution = replay.solution(interval, (end,))
        # The one epoch that is kept before its measurements is the nearest to the end; none, if the
        # filter diverged earlier.
        sd = np.vstack([solution.sd[solution.before, :3], np.full(3, np.nan)])[0].tolist()
        innovations = solution.innovations
        is_next = np.abs(innovations.time - end) < 1e-5
        value = innovations.value[is_next & (innovations.kind == KINDS["position"]), :2]
        is_known = len(value) and np.all(np.isfinite(value[0]))
        distance = float(np.hypot(*value[0])) if is_known else None
        outage = LongestOutage(start, end, (sd[0], sd[1], sd[2]), distance)
        found = cls(measured, alignment, solution, outage)
        if measured.reference is None:
            return found
        clock = found.clock(solution.time)
        return replace(found, against=measured.reference.compared(solution, clock))

    def test(self, kind: str | None = None) -> InnovationTest:
        """Size and whiteness of the innovations of one of `kinds`, by default of all."""
        return innovation_sizes(self.solution.innovations, kind)

    @cached_property
    def faults(self) -> Faults:
        """Faults of the log, by tens of runs of the filter."""
        replay = Replay.of(self.measured, self.alignment)
        return Faults.of(replay, self.measured, search=not self._bad_inputs)

    @property
    def _bad_inputs(self) -> list[Notice]:
        """Faults that the files show before any filter; others would only imitate them."""
        return [each for each in self.measured.notices if each.severity == "bad"]

    @property
    def fault_notices(self) -> tuple[Notice, ...]:
        """Faults that were found, by code and values."""
        return tuple(fault_notice(each, self.measured.start) for each in self.faults.found)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of fixes that were used."""
        fixes = self.measured.aiding.fixes
        return tuple(e.kind for e in fixes if e.time.size and e.kind != "standstill")

    @property
    def rejections(self) -> tuple[Notice, ...]:
        """Fixes that were beyond their gate and not used, kind by kind."""
        innovations = self.solution.innovations
        sizes, notices = np.sqrt(innovations.nis), []
        for kind, code in KINDS.items():
            own = innovations.kind == code
            size = np.where(own & ~innovations.used, sizes, -1.0)
            if np.any(size >= 0.0):
                far = int(np.argmax(size))
                values = {
                    "count": int(np.count_nonzero(size >= 0.0)),
                    "of": int(np.count_nonzero(own)),
                    "size": float(size[far]),
                    "time": float(self.clock(innovations.time[far])),
                }
                notices.append(notice("fixes-rejected", kind, values))
        return tuple(notices)

    @property
    def farthest(self) -> tuple[float, float]:
        """Largest innovation in its expected standard deviation, and its time on the clock, s."""
        size = np.nanmax(np.abs(self.solution.innovations.standard), axis=1, initial=0.0)
        i = int(np.argmax(size))
        return float(size[i]), float(self.clock(self.solution.innovations.time[i]))

    def clock(self, time: npt.ArrayLike) -> FloatArray:
        """Times of the files, s, of times since the filter's start."""
        first = self.measured.start + self.alignment.epoch * self.measured.imu.dt
        return np.asarray(time, dtype=float) + first

    @property
    def fits(self) -> bool:
        """Whether the innovations do not contradict the filter's model."""
        # Kind by kind: too large positions and too small velocities must not make each other good.
        return (
            self.solution.diverged_at is None
            and not self._misfits
            and not self.test().whiteness <= LEVEL  # NaN of too few
            and not self.faults.found
        )

    @property
    def _misfits(self) -> dict[str, float]:
        """Kinds whose innovations have another size than expected -> how many times it is."""
        tests = {kind: self.test(kind).nis for kind in self.kinds}
        tests["all"] = self.test().nis
        found = {k: float(np.sqrt(t.value)) for k, t in tests.items() if t.p_value <= LEVEL}
        return found if set(found) == {"all"} else {k: v for k, v in found.items() if k != "all"}

    @cached_property
    def verdict(self) -> Notice:
        """Whether the filter's model fits these data; only the innovations show it.

        A fault of the log comes before a fault of the sensor models.
        """
        if bad := self._bad_inputs:
            text = "The innovations agree, but the data are wrong: "
            text = text if self.fits else "The filter cannot fit these data: "
            return replace(bad[0], text=text + "; ".join(map(str, bad)), hint="")
        sizes = self._misfits
        largest = max(sizes.values(), default=1.0)
        if self.faults.found:
            return self._fault_verdict(self.fault_notices)
        if self.solution.diverged_at is not None:
            return notice("diverged", values={"time": self.solution.diverged_at})
        if self.fits:
            return self._consistent
        if largest > tuning.LOST:
            stuck, up = (
                [each for each in self.measured.notices if each.code == code]
                for code in ("stuck", "axis-up")
            )
            first = f"{', '.join(each.where for each in stuck)}, which held one value, then at "
            first = first if stuck else ""
            first += f"accel_z, which points up ({up[0].hint}), then at " if up else ""
            return notice("lost", values=sizes, times=brief(largest), first=first)
        if not sizes:
            return notice("not-white", values={"whiteness": self.test().whiteness})
        shown = " and ".join(
            f"{brief(size)} times as large{'' if kind == 'all' else f' in {kind}'}"
            for kind, size in sizes.items()
        )
        assumed = {each.where for each in self.measured.notices if each.code == "sd-assumed"}
        hint = " and ".join(f"{kind}_sd" for kind in sizes if kind in assumed)
        hint = f"give {hint}" if hint else ""
        is_mild = all(1.0 / tuning.MILD < size < tuning.MILD for size in sizes.values())
        code = "too-large" if largest >= 1.0 else "too-small"
        words: dict[str, Any] = {"sizes": shown, "hint": hint}
        if sizes.keys() <= assumed and is_mild:
            return notice(code, values=sizes, severity="note", variant="assumed", **words)
        if min(sizes.values()) < 1.0 < largest:
            code = "mixed-sizes"
        return notice(code, values=sizes, **words)

    @property
    def _consistent(self) -> Notice:
        """The verdict where the innovations agree: what a reference says, if there is one."""
        if self.against is None:
            return notice("consistent")
        source, sizes = self.against.source, self.against.disagreeing
        if not sizes:
            return notice("consistent", source, variant="reference")
        worse = max(sizes.values()) > 1.0
        severity: Severity = "bad" if worse else "note"
        errors = self.against.in_words
        return notice("errors-contradict", source, sizes, severity=severity, errors=errors)

    def _fault_verdict(self, faults: tuple[Notice, ...]) -> Notice:
        first, is_explained = faults[0], self.faults.explained
        text = "The filter's model does not fit these data: " + "; ".join(map(str, faults))
        text += (
            ". With that, the innovations are as large as expected, and white."
            if is_explained
            else ". That does not explain all: something else is wrong too."
        )
        values = {**first.values, "explained": is_explained, "faults": len(faults)}
        severity = worst_first(faults)[0].severity
        return replace(first, severity=severity, text=text, values=values, hint="", source="")

    def __str__(self) -> str:
        imu = self.measured.imu
        length = imu.n * imu.dt - self.alignment.epoch * imu.dt
        lines = [f"{self.measured.title}: {length:.6g} s at {imu.rate:.6g} Hz"]
        lines += bullets(self.notices)
        lines += ["", "Innovations: NIS per degree of freedom, p-value of whiteness"]
        lines += [f"{kind:10} {self.test(kind)}" for kind in self.kinds]
        far, at = self.farthest
        lines.append(f"largest: {far:.3g} sigma at {at:.10g} s")
        verdict, hint = self.verdict.text, self.verdict.hint
        for sentence in (*self.accuracy, f"{verdict} ({hint})" if hint else verdict):
            lines += ["", *wrapped(sentence)]
        return "\n".join(lines)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Notices of the sensor models, the files, the start, and of rejected fixes."""
        given = (*self.measured.sensors.notices, *self.measured.notices)
        up = [each for each in given if each.code == "axis-up"]
        if up and any(each.code == "axis-signs" for each in self.faults.found):
            given = tuple(each for each in given if each not in up)  # the fault says which axes
        return (*given, *self.alignment.notices, *self.rejections)

    @property
    def accuracy(self) -> list[str]:
        """Sentences on the predicted accuracy: at the end, and in the longest outage."""
        sentences = []
        if self.solution.diverged_at is not None:
            at = float(self.clock(self.solution.diverged_at))
            sentences.append(f"The filter diverged at {at:.10g} s and was stopped")
        elif self.solution.time.size:
            sd = self.solution.sd[-1]
            is_right = self.verdict.severity in ("good", "note")
            caveat = "" if is_right else " (if its model were right, which it is not)"
            sentences.append(
                f"Predicted accuracy at the end, 1 sigma{caveat}: horizontal "
                f"{np.hypot(sd[0], sd[1]):.3g} m, vertical {sd[2]:.3g} m, velocity "
                f"{np.linalg.norm(sd[3:6]):.3g} m/s, tilt "
                f"{np.degrees(np.hypot(sd[6], sd[7])):.3g} deg, heading "
                f"{np.degrees(sd[8]):.3g} deg"
            )
        outage = self.longest_outage
        begin, end = self.clock(np.array([outage.start, outage.end]))
        text = (
            f"Longest time without a position fix: {outage.end - outage.start:.4g} s, from "
            f"{begin:.10g} s to {end:.10g} s"
        )
        if np.all(np.isfinite(outage.sd)):
            text += (
                "; predicted error at its end, 1 sigma: horizontal "
                f"{np.hypot(outage.sd[0], outage.sd[1]):.3g} m, vertical {outage.sd[2]:.3g} m"
            )
        if outage.distance is not None:
            text += f"; the next fix was {outage.distance:.3g} m away (horizontal)"
        found = [] if self.against is None else [self.against.sentence()]
        return [*sentences, text, *found]

    def to_dict(self) -> dict[str, Any]:
        """What was found, in JSON types: the verdict, faults, tests of the innovations."""
        return {
            "title": self.measured.title,
            "verdict": self.verdict.to_dict(),
            "faults": [each.to_dict() for each in self.fault_notices],
            "notices": [each.to_dict() for each in self.notices],
            "innovations": {
                kind: {
                    "nis": test.nis.value,
                    "nis_p_value": test.nis.p_value,
                    "whiteness": None if np.isnan(test.whiteness) else test.whiteness,
                }
                for kind, test in ((kind, self.test(kind)) for kind in self.kinds)
            },
            "reference": None if self.against is None else self.against.to_dict(),
        }

    def write_solution(self, path: Path) -> Path:
        """Write the solution as a CSV file.

        Raises InputError if it cannot be written.
        """
        kept = ~self.solution.before
        solution, sd = self.solution, self.solution.sd[kept]
        time, height = self.clock(solution.time[kept]), solution.lla[kept, 2]
        angles = np.degrees(solution.lla[kept, :2])
        angles[:, 1] = (angles[:, 1] + 180.0) % 360.0 - 180.0
        motion = np.hstack([solution.velocity[kept], np.degrees(solution.rpy[kept])])
        deviations = np.hstack([sd[:, :6], np.degrees(sd[:, 6:])])
        columns = np.column_stack([time, angles, height, motion, deviations])
        digits = ["%.6f", "%.10f", "%.10f", "%.4f", *["%.5f"] * 6, *["%.4g"] * 9]
        with written(path) as stream:
            np.savetxt(stream, columns, digits, delimiter=",", header=_HEADER, comments="")
        return path

    def plot_track(self) -> Figure:
        """The solution's track and the fixes."""
        from gmwm import plotting

        kept = ~self.solution.before
        origin = self.alignment.state.lla
        positions = next(each for each in self.measured.aiding.fixes if each.kind == "position")
        track = ned_difference(self.solution.lla[kept], origin)[:, 1::-1]
        fixes = ned_difference(positions.value, origin)[:, 1::-1]
        inside = self.solution.time[kept]
        without = (inside >= self.longest_outage.start) & (inside <= self.longest_outage.end)
        return plotting.measured_track(track, fixes, track[without])

    def plot_innovations(self) -> Figure:
        """Innovations with the bands that the filter expected."""
        from gmwm import plotting

        innovations = self.solution.innovations
        panels = {}
        for kind in self.kinds:
            of_kind = innovations.kind == KINDS[kind]
            unit = "m/s" if kind == "velocity" else "m"
            panels[f"{kind} [{unit}]"] = (
                self.clock(innovations.time[of_kind]),
                innovations.value[of_kind],
                innovations.sd[of_kind],
            )
        return plotting.innovations(panels)
