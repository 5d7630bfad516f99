"""Real data filtered: the solution, and what its innovations show of the filter's model."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.files import written
from gmwm._core.notices import Notice, worst_first
from gmwm._core.pages import make
from gmwm._core.text import brief, bullets, wrapped
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.field.explanations import LEVEL
from gmwm.ins.field.faults import Faults, fault_notice, resolution_notice
from gmwm.ins.field.measured import Measured
from gmwm.ins.field.replay import Replay, alignment_of, innovation_sizes
from gmwm.ins.field.start import Alignment
from gmwm.ins.filter import KINDS, Solution
from gmwm.ins.geometry import ned_difference
from gmwm.ins.simulation import InnovationTest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLUMNS = (
    "time_s", "latitude_deg", "longitude_deg", "height_m",
    "velocity_north_mps", "velocity_east_mps", "velocity_down_mps",
    "roll_deg", "pitch_deg", "yaw_deg",
    "sd_north_m", "sd_east_m", "sd_down_m",
    "sd_velocity_north_mps", "sd_velocity_east_mps", "sd_velocity_down_mps",
    "sd_tilt_north_deg", "sd_tilt_east_deg", "sd_heading_deg",
)  # fmt: skip


@dataclass(frozen=True)
class Hole:
    """The longest time without a position fix.

    start, end: s since the filter's start.
    sd: Predicted standard deviations of the position to the north, east and down before the fix at
        its end, m; NaN if the filter diverged before.
    distance: Horizontal distance of that fix from where it was expected, m; ``None`` if none
        follows.
    """

    start: float
    end: float
    sd: tuple[float, float, float]
    distance: float | None


@dataclass(frozen=True, eq=False)
class Navigated:
    """A solution of real data.

    Attributes
    ----------
    measured : Measured
    alignment : Alignment
    solution : Solution
    hole : Hole
    """

    measured: Measured
    alignment: Alignment
    solution: Solution
    hole: Hole

    @classmethod
    def of(cls, measured: Measured, interval: float = 1.0) -> Navigated:
        """Align and filter.

        Parameters
        ----------
        measured : Measured
        interval : float, optional
            Of the solution, s.

        Raises
        ------
        InputError
            If the initial state cannot be known, or no fix follows it.
        """
        alignment = alignment_of(measured)
        replay = Replay.of(measured, alignment)
        imu = replay.imu
        positions = replay.aiding.of("position")
        if positions is None:
            raise InputError("no position fix follows the first one: there is nothing to filter")
        ends = np.concatenate([[0.0], positions.time, [imu.n * imu.dt]])
        longest = int(np.argmax(np.diff(ends)))
        start, end = float(ends[longest]), float(ends[longest + 1])
        solution = replay.solution(interval, (end,))
        return cls(measured, alignment, solution, _hole(solution, start, end))

    # -- numbers ----------------------------------------------------------------------------------

    def test(self, kind: str | None = None) -> InnovationTest:
        """Size and whiteness of the innovations.

        Parameters
        ----------
        kind : {"position", "velocity"}, optional
            By default both together.
        """
        return innovation_sizes(self.solution.innovations, kind)

    @cached_property
    def faults(self) -> Faults:
        """What explains the innovations better than that all is right; tens of runs of the filter
        where they contradict it, five where they do not.
        """
        return Faults.of(Replay.of(self.measured, self.alignment), self.measured)

    @property
    def fault_notices(self) -> tuple[Notice, ...]:
        """Faults that were found, by code and values; what this motion would show of others."""
        start = float(self.clock(np.zeros(1))[0])
        assumed = {each.where: each for each in self.measured.notices if each.code == "sd-assumed"}
        return tuple(fault_notice(each, start, assumed) for each in self.faults.found)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of fixes that were used."""
        return tuple(
            each.kind
            for each in self.measured.aiding.fixes
            if each.kind != "standstill" and each.time.size
        )

    @property
    def _usual_size(self) -> float:
        """NIS per degree of freedom by the median, which a few far ones do not move."""
        squares = self.solution.innovations.standard**2
        return float(np.nanmedian(squares) / chi2.ppf(0.5, 1))

    @property
    def rejections(self) -> tuple[Notice, ...]:
        """Fixes that were beyond their gate and not used, kind by kind."""
        innovations = self.solution.innovations
        notices = []
        for kind, code in KINDS.items():
            rejected = np.flatnonzero((innovations.kind == code) & ~innovations.used)
            if not rejected.size:
                continue
            size = np.sqrt(innovations.nis[rejected])
            far = int(np.argmax(size))
            at = float(self.clock(innovations.time[rejected[far : far + 1]])[0])
            of = int(np.count_nonzero(innovations.kind == code))
            text = (
                f"{rejected.size} of {of} are rejected; the farthest is {size[far]:.3g} sigma off "
                f"at {at:.10g} s"
            )
            values = {"count": rejected.size, "of": of, "size": float(size[far]), "time": at}
            notices.append(Notice("fixes-rejected", "warning", kind, text, values))
        return tuple(notices)

    @property
    def farthest(self) -> tuple[float, float]:
        """Largest innovation in its expected standard deviation, and its time on the clock, s."""
        size = np.nanmax(np.abs(self.solution.innovations.standard), axis=1, initial=0.0)
        i = int(np.argmax(size))
        return float(size[i]), float(self.clock(self.solution.innovations.time[i : i + 1])[0])

    def clock(self, time: FloatArray) -> FloatArray:
        """Times of the files, s, of times since the filter's start."""
        imu = self.measured.imu
        return np.asarray(time + self.measured.start + self.alignment.epoch * imu.dt, dtype=float)

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

    @property
    def verdict(self) -> Notice:
        """Whether the filter's model fits these data; only the innovations show it.

        A fault of the log comes before a fault of the sensor models.
        """
        faults, sizes = self.fault_notices, self._misfits
        largest = max(sizes.values(), default=1.0)
        if faults and (self.faults.explained or largest <= tuning.LOST):
            return self._fault_verdict(faults)
        if self.solution.diverged_at is not None:
            return Notice(
                "diverged", "bad", "",
                "The filter diverged: the sensor models or the initial state are far from right, "
                "or a fix is.",
                {"time": self.solution.diverged_at},
            )  # fmt: skip
        if self.fits:
            return Notice(
                "consistent", "good", "",
                "The innovations do not contradict the filter's model: they are as large as it "
                "expects, and white.",
            )  # fmt: skip
        if largest > tuning.LOST:
            up = [each.hint for each in self.measured.notices if each.code == "axis-up"]
            first = f"accel_z, which points up ({up[0]}), then at " if up else ""
            stuck = [each.where for each in self.measured.notices if each.code == "stuck"]
            first = (f"{', '.join(stuck)}, which held one value, then at " if stuck else "") + first
            return Notice(
                "lost", "bad", "",
                f"The filter is lost: innovations are {brief(largest)} times as large as it "
                "expects, and the accuracy that it predicts is not to be believed; look first at "
                f"{first}the heading that it started with, then at the units of the sensors and "
                "the clock of the fixes.",
                sizes,
            )  # fmt: skip
        if sizes:
            cause, why = self._cause(sizes)
            shown = " and ".join(
                f"{brief(size)} times as large{'' if kind == 'all' else f' in {kind}'}"
                for kind, size in sizes.items()
            )
            return Notice(
                cause, "bad", "",
                f"The filter's model does not fit: innovations are {shown} as it expects; {why}.",
                sizes,
            )  # fmt: skip
        return Notice(
            "not-white", "bad", "",
            "The filter's model does not fit: innovations are as large as it expects, but depend "
            "on those before; a slow error of the sensors is missing in their models.",
            {"whiteness": self.test().whiteness},
        )  # fmt: skip

    def _fault_verdict(self, faults: tuple[Notice, ...]) -> Notice:
        first, found = faults[0], self.faults
        severity = worst_first(list(faults))[0].severity
        if found.explained and all(each.values.get("assumed") for each in faults):
            text = "Only the standard deviations assumed for the fixes do not fit these data: "
        else:
            text = "The filter's model does not fit these data: "
            severity = "bad" if severity == "bad" else "warning"
        text += "; ".join(f"{fault}" for fault in faults)
        if found.alternatives:
            text += f"; nearly as probable: {', '.join(found.alternatives)}"
        text += (
            ". With that, the innovations are as large as expected, and white."
            if found.explained
            else ". That does not explain all: something else is wrong too."
        )
        values = {**first.values, "explained": found.explained, "faults": len(faults)}
        return Notice(first.code, severity, first.where, text, values)

    def _cause(self, sizes: dict[str, float]) -> tuple[str, str]:
        """What innovations of these sizes may come from: code and text."""
        if min(sizes.values()) < 1.0 < max(sizes.values()):
            return "mixed-sizes", "the standard deviations of the fixes do not go together"
        if max(sizes.values()) < 1.0:
            return "too-small", (
                "the sensors are better than their models predict, or the fixes than their "
                "standard deviations"
            )
        if self._usual_size < tuning.MOSTLY_FINE:
            return "outliers", (
                "most are not, so that some fixes are outliers, or errors without fixes grow "
                "faster than the sensor models predict"
            )
        return "too-large", (
            "the sensors are worse than their models predict, or the fixes than their standard "
            "deviations"
        )

    # -- words and files --------------------------------------------------------------------------

    def __str__(self) -> str:
        imu = self.measured.imu
        length = imu.n * imu.dt - self.alignment.epoch * imu.dt
        lines = [f"{self.measured.title}: {length:.6g} s at {imu.rate:.6g} Hz"]
        lines += bullets(self.notices)
        lines += ["", "Innovations: NIS per degree of freedom, p-value of whiteness"]
        lines += [f"{kind:10} {self.test(kind)}" for kind in self.kinds]
        far, at = self.farthest
        lines.append(f"largest: {far:.3g} sigma at {at:.10g} s")
        for sentence in (*self.accuracy, self.verdict.text):
            lines += ["", *wrapped(sentence)]
        lines += ["", *wrapped(self.resolution.sentence)]
        return "\n".join(lines)

    @property
    def resolution(self) -> Notice:
        """How small a constant error of the log this motion would show."""
        return resolution_notice(self.faults)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Of the files, the sensor models, the start, and of fixes that were rejected."""
        measured = self.measured
        return (
            *measured.sensors.notices, *measured.notices, *self.alignment.notices,
            *self.rejections,
        )  # fmt: skip

    @property
    def accuracy(self) -> list[str]:
        """What the filter predicts of its errors: at the end, and where fixes were missing."""
        sentences = []
        if self.solution.diverged_at is not None:
            at = float(self.clock(np.array([self.solution.diverged_at]))[0])
            sentences.append(f"The filter diverged at {at:.10g} s and was stopped")
        elif self.solution.time.size:
            sd = self.solution.sd[-1]
            is_right = self.fits or self.verdict.severity == "note"
            caveat = "" if is_right else " (were its model right, which it is not)"
            sentences.append(
                f"Predicted accuracy at the end, 1 sigma{caveat}: horizontal "
                f"{np.hypot(sd[0], sd[1]):.3g} m, vertical {sd[2]:.3g} m, velocity "
                f"{np.linalg.norm(sd[3:6]):.3g} m/s, tilt "
                f"{np.degrees(np.hypot(sd[6], sd[7])):.3g} deg, heading "
                f"{np.degrees(sd[8]):.3g} deg"
            )
        hole = self.hole
        begin, end = self.clock(np.array([hole.start, hole.end]))
        text = (
            f"Longest time without a position fix: {hole.end - hole.start:.4g} s, from "
            f"{begin:.10g} s to {end:.10g} s"
        )
        if np.all(np.isfinite(hole.sd)):
            text += (
                "; predicted error at its end, 1 sigma: horizontal "
                f"{np.hypot(hole.sd[0], hole.sd[1]):.3g} m, vertical {hole.sd[2]:.3g} m"
            )
        if hole.distance is not None:
            text += f"; the next fix was {hole.distance:.3g} m away (horizontal)"
        return [*sentences, text]

    def to_dict(self) -> dict[str, Any]:
        """What was found, in JSON types: the verdict, faults, tests of the innovations."""
        return {
            "title": self.measured.title,
            "verdict": self.verdict.to_dict(),
            "faults": [each.to_dict() for each in self.fault_notices],
            "resolution": self.resolution.to_dict(),
            "notices": [
                each.to_dict() for each in self.notices
            ],
            "innovations": {
                kind: {"nis": test.nis.value, "nis_p_value": test.nis.p_value,
                       "whiteness": None if np.isnan(test.whiteness) else test.whiteness}
                for kind, test in ((kind, self.test(kind)) for kind in self.kinds)
            },
        }  # fmt: skip

    def write_solution(self, path: Path) -> Path:
        """Write the solution as a CSV file.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        kept = ~self.solution.before
        solution, sd = self.solution, self.solution.sd[kept]
        angles = np.degrees(solution.lla[kept, :2])
        angles[:, 1] = (angles[:, 1] + 180.0) % 360.0 - 180.0
        rpy = np.degrees(solution.rpy[kept])
        columns = np.column_stack([
            self.clock(solution.time[kept]), angles, solution.lla[kept, 2], solution.velocity[kept],
            rpy, sd[:, :6], np.degrees(sd[:, 6:]),
        ])  # fmt: skip
        digits = ["%.6f", "%.10f", "%.10f", "%.4f", *["%.5f"] * 3, *["%.5f"] * 3, *["%.4g"] * 9]
        with written(path) as stream:
            np.savetxt(stream, columns, digits, delimiter=",", header=",".join(_COLUMNS),
                       comments="")  # fmt: skip
        return path

    # -- figures ----------------------------------------------------------------------------------

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; see `gmwm.report.write_navigated_report`."""
        page: Path = make("page", self, path)
        return page

    def plot_track(self) -> Figure:
        """The solution's track and the fixes."""
        from gmwm import plotting

        kept = ~self.solution.before
        origin = self.alignment.state.lla
        positions = next(each for each in self.measured.aiding.fixes if each.kind == "position")
        track = ned_difference(self.solution.lla[kept], origin)[:, 1::-1]
        fixes = ned_difference(positions.value, origin)[:, 1::-1]
        inside = self.solution.time[kept]
        without = (inside >= self.hole.start) & (inside <= self.hole.end)
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


def _hole(solution: Solution, start: float, end: float) -> Hole:
    """What was predicted for the end of a time without fixes, and how far off the next one was."""
    # The one epoch that is kept before its measurements is the nearest to the end; none, if the
    # filter diverged earlier.
    early = np.flatnonzero(solution.before)
    sd = solution.sd[early[0], :3] if early.size else np.full(3, np.nan)
    innovations = solution.innovations
    first = np.flatnonzero(
        (np.abs(innovations.time - end) < 1e-5) & (innovations.kind == KINDS["position"])
    )
    distance = None
    if first.size and np.all(np.isfinite(innovations.value[first[0], :2])):
        distance = float(np.hypot(*innovations.value[first[0], :2]))
    return Hole(start, end, (float(sd[0]), float(sd[1]), float(sd[2])), distance)
