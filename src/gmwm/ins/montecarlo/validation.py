"""The result of a validation by navigating: tables, figures, sentences."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.pages import make
from gmwm._core.runs import Earlier
from gmwm._core.text import bullets, wrapped
from gmwm._core.typing import FloatArray, Progress
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.geometry import ned_difference
from gmwm.ins.montecarlo.consistency import (
    LEVELS,
    Consistency,
    InnovationTest,
    at_epoch,
    innovation_test,
    over_time,
)
from gmwm.ins.montecarlo.filter_errors import FilterErrors
from gmwm.ins.montecarlo.outage_errors import (
    QUANTITIES,
    Difference,
    Spread,
    difference,
    pooled_sizes,
    spread,
)
from gmwm.ins.montecarlo.scenario import Experiment
from gmwm.ins.montecarlo.trials import MonteCarlo, monte_carlo

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARGIN = 30.0  # s shown before and after an outage
_GROUPS = ("horizontal", "vertical", "position", "velocity", "attitude", "sensors")
_SHORT = {"horizontal": "hor.", "vertical": "vert."}
_COVERED = ("horizontal", "vertical")


@dataclass(frozen=True, eq=False)
class Validation:
    """How filters with different sensor models navigated.

    Attributes
    ----------
    experiment : Experiment
    study : MonteCarlo
    """

    experiment: Experiment
    study: MonteCarlo

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        *,
        jobs: int = 1,
        cluster: str | None = None,
        folder: Path | None = None,
        earlier: Earlier = "resume",
        progress: Progress | None = None,
    ) -> Validation:
        """Do the runs of an experiment; see `gmwm.ins.montecarlo.trials.monte_carlo`."""
        study = monte_carlo(
            experiment.scenario, experiment.source, experiment.filters, experiment.runs,
            experiment.seed, jobs=jobs, cluster=cluster, folder=folder, earlier=earlier,
            progress=progress,
        )  # fmt: skip
        return cls(experiment, study)

    # -- numbers ----------------------------------------------------------------------------------

    @property
    def names(self) -> tuple[str, ...]:
        """Of the filters; the others are compared with the first."""
        return tuple(self.study.filters)

    @property
    def reached(self) -> tuple[str, ...]:
        """Filters of which at least one run reached the end of each outage."""
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
        found = {name: self.study[name] for name in self.names if self.study[name].diverged}
        diverged = (
            Notice(
                "diverged", "bad", name,
                f"diverged in {runs.diverged} of {runs.runs} runs; figures are of the others",
                {"diverged": runs.diverged, "runs": runs.runs},
            )
            for name, runs in found.items()
        )  # fmt: skip
        return (*models, *self.study.notices, *diverged)

    def spreads(self, name: str) -> list[dict[str, Spread]]:
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

    def against_first(self, name: str, quantity: str) -> Difference:
        """A filter's errors after all outages against those of the first one, run by run."""
        first, other = (pooled_sizes(self.study, each) for each in (self.names[0], name))
        return difference(other, first, quantity, self.experiment.seed)

    # -- words ------------------------------------------------------------------------------------

    def __str__(self) -> str:
        width = max(len("filter"), *(len(name) for name in self.names))
        blocks = [self._head()]
        for i, outage in enumerate(self.study.outages):
            blocks.append(
                [
                    f"Errors after {outage.duration:g} s without GNSS, at {outage.end:g} s, before "
                    "the first fix",
                    *self._error_rows(i, width),
                ]
            )
        blocks.append(["NEES per degree of freedom: 1 if the filter is consistent, * out of "
                       "band", *self._nees_rows(width)])  # fmt: skip
        if self.study.outages:
            blocks.append(["Position errors within predicted intervals, %, horizontal and vertical",
                           *self._coverage_rows(width)])  # fmt: skip
        blocks.append(["Innovations: NIS per degree of freedom, p-value of whiteness",
                       *self._innovation_rows(width)])  # fmt: skip
        if self.study.outages and len(self.names) > 1:
            blocks.append(
                [
                    f"Horizontal error against {self.names[0]}, over all outages",
                    *self._difference_rows(width),
                ]
            )
        return "\n\n".join("\n".join(block) for block in blocks)

    def _head(self) -> list[str]:
        truth, runs = self.study.truth, self.study[self.names[0]].runs
        word = "run" if runs == 1 else "runs"
        first = (
            f"{self.experiment.title}: {truth.duration:g} s at {1.0 / truth.dt:g} Hz, {runs} "
            f"{word}, seed {self.experiment.seed}"
        )
        return [*wrapped(first, indent=2), *bullets(self.notices)]

    def _error_rows(self, outage: int, width: int) -> list[str]:
        rows = [f"{'':{width}} {'':16} {'mean':>9} {'RMS':>9} {'median':>9} {'95 %':>9} "
                f"{'predicted':>10}"]  # fmt: skip
        found = {name: self.spreads(name)[outage] for name in self.reached}
        for quantity, unit in QUANTITIES.items():
            for i, name in enumerate(found):
                s = found[name][quantity]
                label = f"{quantity} [{unit}]" if i == 0 else ""
                rows.append(
                    f"{name:{width}} {label:16} {s.mean:>9.4g} {s.rms:>9.4g} {s.median:>9.4g} "
                    f"{s.p95:>9.4g} {s.predicted:>10.4g}"
                )
        return rows

    def _judgements(self, name: str) -> list[tuple[str, Consistency]]:
        """Consistency of a filter with GNSS and at the ends of the outages."""
        ends = zip(self.study.outages, self.at_ends(name), strict=True)
        return [
            ("GNSS on", self.with_gnss(name)),
            *((f"at {outage.end:g} s", each) for outage, each in ends),
        ]

    def _nees_rows(self, width: int) -> list[str]:
        heads = [_SHORT.get(group, group) for group in _GROUPS]
        rows = [f"{'filter':{width}} {'':10}" + "".join(f"{head:>9}" for head in heads)]
        for name in self.names:
            for label, consistency in self._judgements(name):
                cells = [_starred(consistency, group) for group in _GROUPS]
                rows.append(f"{name:{width}} {label:10}" + "".join(f"{c:>9}" for c in cells))
        return rows

    def _coverage_rows(self, width: int) -> list[str]:
        heads = [f"{100.0 * level:g} % " for level in LEVELS] * len(_COVERED)
        parts = "".join(f"{part:>{7 * len(LEVELS)}}" for part in _COVERED)
        rows = [
            f"{'':{width}} {'':10}{parts}",
            f"{'filter':{width}} {'':10}" + "".join(f"{head:>7}" for head in heads),
        ]
        for name in self.names:
            for label, found in self._judgements(name):
                cells = [
                    "- "
                    if np.isnan(c.fraction)
                    else f"{100.0 * c.fraction:.1f}" + " *"[not c.within]
                    for part in _COVERED
                    for c in found.coverage[part]
                ]
                rows.append(f"{name:{width}} {label:10}" + "".join(f"{c:>7}" for c in cells))
        return rows

    def _innovation_rows(self, width: int) -> list[str]:
        return [f"{name:{width}} {self.innovations(name)}" for name in self.names]

    def _difference_rows(self, width: int) -> list[str]:
        rows = [f"{'':{width}} {'ratio of RMS':<26}  difference of means [m], = if none"]
        for name in self.names[1:]:
            if not {name, self.names[0]} <= set(self.reached):
                rows.append(f"{name:{width}} -")
                continue
            d = self.against_first(name, "horizontal")
            ratio = f"{d.ratio:.3g} ({d.ratio_lower:.3g} .. {d.ratio_upper:.3g})"
            mark = "" if d.significant else " ="
            rows.append(
                f"{name:{width}} {ratio:<26}  "
                f"{d.value:+.3g} ({d.lower:+.3g} .. {d.upper:+.3g}){mark}"
            )
        return rows

    # -- figures ----------------------------------------------------------------------------------

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; see `gmwm.report.write_validation_report`."""
        written: Path = make("page", self, path)
        return written

    def plot_track(self) -> Figure:
        """The track with its outages and each filter's first run (Figure 7 of the paper)."""
        from gmwm import plotting

        truth, start = self.study.truth, self.study.truth.lla[0]
        whole = ned_difference(truth.lla[:: max(round(1.0 / truth.dt), 1)], start)
        parts: list[FloatArray] = []
        solutions: dict[str, list[FloatArray]] = {name: [] for name in self.names}
        for outage in self.study.outages:
            first, last = round(outage.start / truth.dt), round(outage.end / truth.dt)
            every = max(round(0.1 / truth.dt), 1)
            part = truth.lla[np.append(np.arange(first, last, every), last)]
            parts.append(ned_difference(part, start)[:, 1::-1])
            for name in self.names:
                solution = self.study.example[name]
                inside = (solution.time >= outage.start) & (solution.time <= outage.end)
                inside &= solution.before | (solution.time < outage.end)
                path = ned_difference(solution.lla[inside], start)
                solutions[name].append(path[:, 1::-1])
        return plotting.track(whole[:, 1::-1], parts, solutions)

    def plot_errors(self, outage: int = 0) -> Figure:
        """True errors of the first run about an outage, with what was predicted (Figure 8).

        Raises
        ------
        InputError
            If there is no such outage.
        """
        from gmwm import plotting

        span = self._outage(outage)
        panels = {}
        for name in self.names:
            solution = self.study.example[name]
            shown = (solution.time >= span.start - _MARGIN) & (solution.time <= span.end + _MARGIN)
            order = [1, 0, 2]  # east, north, down
            error = solution.errors(self.study.truth)[shown][:, order]
            error[:, 2] *= -1.0
            panels[name] = (solution.time[shown], error, solution.sd[shown][:, order])
        return plotting.errors(panels, [(span.start, span.end)])

    def plot_growth(self) -> Figure:
        """Planimetric and altimetric errors during the outages over all runs (Figure 9)."""
        from gmwm import plotting

        panels: dict[str, Any] = {}
        for outage in self.study.outages:
            label = f"outage of {outage.duration:g} s at {outage.start:g} s"
            panels[label] = {
                name: _growth(self.study[name], outage.start, outage.end) for name in self.reached
            }
        if not panels:
            raise InputError("the experiment has no outage: there is nothing to draw")
        return plotting.growth(panels)

    def _outage(self, index: int) -> Any:
        if not 0 <= index < len(self.study.outages):
            raise InputError(
                f"outage = {index}: the experiment has {len(self.study.outages)} of them"
            )
        return self.study.outages[index]


def _growth(
    runs: FilterErrors, start: float, end: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times since the start, and horizontal and vertical RMS, true and predicted."""
    shown = (runs.time >= start) & (runs.time <= end) & (runs.before | (runs.time < end))
    alive = np.all(np.isfinite(runs.error[:, shown, 0]), axis=1)

    def rms(values: FloatArray) -> FloatArray:
        squares = np.mean(values[alive][:, shown, :3] ** 2, axis=0)
        return np.sqrt(np.stack([squares[:, 0] + squares[:, 1], squares[:, 2]], axis=1))

    return runs.time[shown] - start, rms(runs.error), rms(runs.sd)


def _starred(consistency: Consistency, group: str) -> str:
    """NEES of a group with a star if it is out of its band; a single run has no band."""
    ratio = consistency.nees.get(group)
    if ratio is None or np.isnan(ratio.value):
        return "- "
    out = not np.isnan(ratio.lower) and not ratio.within
    return f"{ratio.value:.3g}" + " *"[out]
