"""The result of a validation by navigating: tables, figures, sentences."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from gmwm._core.pages import Reported
from gmwm._core.text import bullets, plain_table, wrapped
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Outage
from gmwm.ins.geometry import ned_difference
from gmwm.ins.simulation.consistency import (
    LEVELS,
    QUANTITIES,
    Consistency,
    ErrorDifference,
    ErrorSizes,
    FilterErrors,
    InnovationTest,
    at_epoch,
    difference,
    innovation_test,
    over_time,
    spread,
)
from gmwm.ins.simulation.trials import Experiment, MonteCarlo, RunOptions, monte_carlo, pooled_sizes
from gmwm.issues import Notice, notice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARGIN = 30.0  # s shown before and after an outage
_GROUPS = ("horizontal", "vertical", "position", "velocity", "attitude", "sensors")
_SHORT = {"horizontal": "hor.", "vertical": "vert."}


@dataclass(frozen=True, eq=False)
class Validation(Reported):
    """How filters with different sensor models navigated."""

    experiment: Experiment
    study: MonteCarlo

    @classmethod
    def of(cls, experiment: Experiment, **options: Unpack[RunOptions]) -> Validation:
        """Do the runs of an experiment; see `gmwm.ins.monte_carlo`."""
        e = experiment
        return cls(e, monte_carlo(e.scenario, e.source, e.filters, e.runs, e.seed, **options))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the filters; the others are compared with the first."""
        return tuple(self.study.filters)

    @property
    def reached(self) -> tuple[str, ...]:
        """Filters that reached the end of each outage in at least one run."""
        found = []
        for name in self.names:
            runs = self.study[name]
            ends = [runs.index(outage.end) for outage in self.study.outages]
            if all(np.any(np.isfinite(runs.error[:, end, 0])) for end in ends):
                found.append(name)
        return tuple(found)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What to know of the filters' models and the runs: too few, filters that diverged."""
        models = (
            replace(each, source=name)
            for name, own in self.experiment.filters.items()
            for each in own.notices
        )
        diverged = (
            notice("diverged", name, {"diverged": runs.diverged, "runs": runs.runs}, variant="runs")
            for name, runs in self.study.filters.items()
            if runs.diverged
        )
        return (*models, *self.study.notices, *diverged)

    def spreads(self, name: str) -> list[dict[str, ErrorSizes]]:
        """Errors of a filter before the first fix after each outage."""
        return [spread(self.study[name], outage.end) for outage in self.study.outages]

    def at_ends(self, name: str) -> list[Consistency]:
        """Consistency of a filter before the first fix after each outage."""
        runs = self.study[name]
        return [at_epoch(runs, runs.index(outage.end)) for outage in self.study.outages]

    def with_gnss(self, name: str) -> Consistency:
        """Consistency of a filter while GNSS is on, once it has settled."""
        duration = self.study.truth.duration
        first = min((outage.start for outage in self.study.outages), default=duration)
        start = min(tuning.SETTLED * duration, 0.5 * first)
        return over_time(self.study[name], start, first)

    def innovations(self, name: str) -> InnovationTest:
        """Innovations of a filter over the whole record."""
        return innovation_test(self.study[name])

    def against_first(self, name: str, quantity: str) -> ErrorDifference:
        """A filter's errors after all outages against those of the first one, run by run."""
        first, other = (pooled_sizes(self.study, each) for each in (self.names[0], name))
        return difference(other, first, quantity, self.experiment.seed)

    def __str__(self) -> str:
        truth, runs = self.study.truth, self.study[self.names[0]].runs
        head = (
            f"{self.experiment.title}: {truth.duration:g} s at {1.0 / truth.dt:g} Hz, {runs} "
            f"{'run' if runs == 1 else 'runs'}, seed {self.experiment.seed}"
        )
        blocks = ["\n".join([*wrapped(head, indent=2), *bullets(self.notices)])]
        for i, outage in enumerate(self.study.outages):
            blocks.append(
                f"Errors after {outage.duration:g} s without GNSS, at {outage.end:g} s, before the "
                f"first fix\n{self._errors(i)}"
            )
        judged = []
        for name in self.names:
            ends = zip(self.study.outages, self.at_ends(name), strict=True)
            judged.append((name, "GNSS on", self.with_gnss(name)))
            judged += [(name, f"at {outage.end:g} s", found) for outage, found in ends]
        head = "NEES per degree of freedom: 1 if the filter is consistent, * out of band\n"
        columns = ["filter", "", *(_SHORT.get(group, group) for group in _GROUPS)]
        rows = [
            [name, label, *(_starred(found, group) for group in _GROUPS)]
            for name, label, found in judged
        ]
        blocks.append(head + plain_table(columns, rows))
        columns = ["filter", "", *(f"{100.0 * level:g} %" for level in LEVELS)]
        for group in ("horizontal", "vertical") if self.study.outages else ():
            head = f"{group.capitalize()} errors within predicted intervals, %\n"
            rows = [
                [name, label, *map(_percent, each.coverage[group])] for name, label, each in judged
            ]
            blocks.append(head + plain_table(columns, rows))
        head = "Innovations: NIS per degree of freedom, p-value of whiteness\n"
        rows = [[name, str(self.innovations(name)).strip()] for name in self.names]
        blocks.append(head + plain_table(["filter", ""], rows))
        if self.study.outages and len(self.names) > 1:
            blocks.append(
                f"Horizontal error against {self.names[0]}, over all outages (=: not significant)\n"
                + self._differences()
            )
        return "\n\n".join(blocks)

    def _errors(self, outage: int) -> str:
        """Table of the errors at the end of an outage."""
        found = {name: self.spreads(name)[outage] for name in self.reached}
        rows = []
        for quantity, unit in QUANTITIES.items():
            for i, (name, spreads) in enumerate(found.items()):
                s = spreads[quantity]
                values = (s.mean, s.rms, s.median, s.p95, s.predicted)
                label = f"{quantity} [{unit}]" if i == 0 else ""
                rows.append([name, label, *(f"{value:.4g}" for value in values)])
        return plain_table(["filter", "", "mean", "RMS", "median", "95 %", "predicted"], rows)

    def _differences(self) -> str:
        """Table of the horizontal errors against the first filter."""
        rows = []
        for name in self.names[1:]:
            if not {name, self.names[0]} <= set(self.reached):
                rows.append([name, "-", "-"])
                continue
            d = self.against_first(name, "horizontal")
            ratio = f"{d.ratio:.3g} ({d.ratio_lower:.3g} .. {d.ratio_upper:.3g})"
            mark = "" if d.significant else " ="
            means = f"{d.value:+.3g} ({d.lower:+.3g} .. {d.upper:+.3g}){mark}"
            rows.append([name, ratio, means])
        return plain_table(["filter", "ratio of RMS", "difference of means [m]"], rows)

    def plot_track(self) -> Figure:
        """The track with its outages and each filter's first run (Figure 7 of the paper)."""
        from gmwm import plotting

        truth, start = self.study.truth, self.study.truth.lla[0]
        whole = ned_difference(truth.lla[:: max(round(1.0 / truth.dt), 1)], start)
        parts: dict[str, FloatArray] = {}
        solutions: dict[str, list[FloatArray]] = {name: [] for name in self.names}
        for outage in self.study.outages:
            first, last = round(outage.start / truth.dt), round(outage.end / truth.dt)
            every = max(round(0.1 / truth.dt), 1)
            part = truth.lla[np.append(np.arange(first, last, every), last)]
            parts[f"run 1, {_span(outage)}"] = ned_difference(part, start)[:, 1::-1]
            for name in self.names:
                solution = self.study.example[name]
                inside = (solution.time >= outage.start) & (solution.time <= outage.end)
                inside &= solution.before | (solution.time < outage.end)
                path = ned_difference(solution.lla[inside], start)
                solutions[name].append(path[:, 1::-1])
        return plotting.track(whole[:, 1::-1], parts, solutions)

    def plot_errors(self, outage: int = 0) -> Figure:
        """True errors of the first run about an outage, with what was predicted (Figure 8).

        Raises InputError if there is no such outage.
        """
        from gmwm import plotting

        if not 0 <= outage < len(self.study.outages):
            raise InputError(
                f"outage = {outage}: the experiment has {len(self.study.outages)} outages, "
                "counted from 0"
            )
        span, panels = self.study.outages[outage], {}
        for name in self.names:
            solution = self.study.example[name]
            shown = (solution.time >= span.start - _MARGIN) & (solution.time <= span.end + _MARGIN)
            order = [1, 0, 2]  # east, north, down
            error = solution.errors(self.study.truth)[shown][:, order]
            error[:, 2] *= -1.0
            panels[name] = (solution.time[shown], error, solution.sd[shown][:, order])
        return plotting.errors(panels, [(span.start, span.end)], title=f"run 1, {_span(span)}")

    def plot_growth(self) -> Figure:
        """Planimetric and altimetric errors during the outages over all runs (Figure 9)."""
        from gmwm import plotting

        panels: dict[str, Any] = {}
        for outage in self.study.outages:
            panels[_span(outage)] = {
                name: _growth(self.study[name], outage) for name in self.reached
            }
        if not panels:
            raise InputError("the experiment has no outage to draw: add one")
        return plotting.growth(panels, self.study[self.names[0]].runs)


def _span(outage: Outage) -> str:
    return f"outage of {outage.duration:g} s from {outage.start:g} s"


def _growth(runs: FilterErrors, outage: Outage) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times since the start, and horizontal and vertical RMS, true and predicted."""
    shown = (runs.time >= outage.start) & (runs.time <= outage.end)
    shown &= runs.before | (runs.time < outage.end)
    alive = np.all(np.isfinite(runs.error[:, shown, 0]), axis=1)

    def rms(values: FloatArray) -> FloatArray:
        squares = np.mean(values[alive][:, shown, :3] ** 2, axis=0)
        return np.sqrt(np.stack([squares[:, 0] + squares[:, 1], squares[:, 2]], axis=1))

    return runs.time[shown] - outage.start, rms(runs.error), rms(runs.sd)


def _starred(consistency: Consistency, group: str) -> str:
    """NEES of a group with a star if it is out of its band; a single run has no band."""
    ratio = consistency.nees.get(group)
    if ratio is None or np.isnan(ratio.value):
        return "- "
    out = not np.isnan(ratio.lower) and not ratio.within
    return f"{ratio.value:.3g}" + " *"[out]


def _percent(coverage: Any) -> str:
    if np.isnan(coverage.fraction):
        return "- "
    return f"{100.0 * coverage.fraction:.1f}" + " *"[not coverage.within]
