"""Every recording calibrated in turn, the others navigated with: what does not hang on one of them.

Filters differ in their sensor models only, and every one has a slow state on every axis. What is
compared comes from the recording that is calibrated alone; intervals allow for the few recordings.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from gmwm import filter_numbers
from gmwm._core import __version__
from gmwm._core.distributions import norm
from gmwm._core.documents import Document
from gmwm._core.files import folder_to_fill, write_text
from gmwm._core.runs import Earlier
from gmwm._core.text import bullets, plain_table, wrapped
from gmwm._core.typing import FloatArray, Progress
from gmwm.calibration import Calibration, calibrate
from gmwm.errors import InputError
from gmwm.filter_numbers import FilterNumbers
from gmwm.ins import tuning
from gmwm.ins.sensors import AXES, Recorded, SensorModels
from gmwm.ins.simulation import GROUPS, Experiment, FilterErrors, Validation
from gmwm.issues import Notice, notice
from gmwm.readers import Recording
from gmwm.study.navigation import TEN, Calibrated, aligned, check_channels, scenario_of, times
from gmwm.study.summary import saved

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIRST = "GMWM"  # the others are compared with it
_BOUND = float(norm.ppf(0.975))  # of the interval whose coverage is counted
_D = TypeVar("_D", bound=Document)


@dataclass(frozen=True)
class Interval:
    """A value with its bootstrap interval of 95 %."""

    value: float
    lower: float
    upper: float

    def __str__(self) -> str:
        """Value and ends in three digits, without an exponent."""
        return f"{_short(self.value)} ({_short(self.lower)}-{_short(self.upper)})"


@dataclass(frozen=True, eq=False)
class Rotation:
    """How filters navigated with each recording calibrated in turn.

    stretches: How many of each are navigated with.
    turns: With each recording calibrated; its runs are the stretches of the others, in their order.
    """

    sources: tuple[str, ...]
    stretches: tuple[int, ...]
    turns: tuple[Validation, ...]
    notices: tuple[Notice, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the filters; the others are compared with the first."""
        return self.turns[0].names

    # -- numbers; with one recording calibrated (``turn``) or, by default, over all turns ----------

    def ratio(self, name: str, quantity: str, turn: int | None = None) -> Interval:
        """Root mean square of an error at the ends of outages against the first filter's."""
        part = slice(0, 2) if quantity == "horizontal" else slice(2, 3)

        def squares(runs: FilterErrors, end: int) -> FloatArray:
            return np.asarray(np.sum(runs.error[:, end, part] ** 2, axis=1))

        other, first = (self._table(each, squares) for each in (name, FIRST))
        both = np.isfinite(other) & np.isfinite(first)
        above, below = (np.where(both, each, np.nan) for each in (other, first))
        return self._interval(above, below, turn, np.sqrt)

    def nees(self, name: str, group: str, turn: int | None = None) -> Interval:
        """NEES per degree of freedom at the ends of outages, of a group of errors."""
        index, part = list(GROUPS).index(group), GROUPS[group]
        size = part.stop - part.start
        table = self._table(name, lambda runs, end: runs.nees[:, end, index] / size)
        return self._interval(table, np.isfinite(table).astype(float), turn)

    def coverage(self, name: str, group: str, turn: int | None = None) -> Interval:
        """Fraction of errors within the predicted interval of 95 % at the ends of outages."""
        part = GROUPS[group]

        def inside(runs: FilterErrors, end: int) -> FloatArray:
            standard = runs.error[:, end, part] / runs.sd[:, end, part]
            hits = np.mean(np.abs(standard) < _BOUND, axis=1)
            return np.where(np.isfinite(standard[:, 0]), hits, np.nan)

        table = self._table(name, inside)
        return self._interval(table, np.isfinite(table).astype(float), turn)

    def _table(self, name: str, measure: Callable[[FilterErrors, int], FloatArray]) -> FloatArray:
        """Mean over the outages, by recording calibrated, recording navigated with and stretch."""
        n = len(self.sources)
        table = np.full((n, n, max(self.stretches)), np.nan)
        for i, turn in enumerate(self.turns):
            runs = turn.study[name]
            ends = [runs.index(outage.end) for outage in turn.study.outages]
            values = np.mean([measure(runs, end) for end in ends], axis=0)
            others = [j for j in range(n) if j != i]
            cuts = np.cumsum([self.stretches[j] for j in others])[:-1]
            for j, own in zip(others, np.split(values, cuts), strict=True):
                table[i, j, : own.size] = own
        return table

    def _interval(
        self,
        above: FloatArray,
        below: FloatArray,
        turn: int | None,
        root: Callable[[FloatArray], FloatArray] = np.asarray,
    ) -> Interval:
        """Ratio of the sums of two tables."""
        seed = self.turns[0].experiment.seed
        weights = crossed_weights(self.stretches, turn, tuning.BOOTSTRAP_DRAWS, seed)
        rows = slice(None) if turn is None else turn
        with np.errstate(invalid="ignore", divide="ignore"):
            value = float(root(np.asarray(np.nansum(above[rows]) / np.nansum(below[rows]))))
            sums = (np.einsum("dcts,cts->d", weights, np.nan_to_num(e)) for e in (above, below))
            drawn = root(np.divide(*sums))
        drawn = drawn[np.isfinite(drawn)]
        if not drawn.size:
            return Interval(value, float("nan"), float("nan"))
        tail = 0.5 - 0.5 * tuning.CONFIDENCE
        lower, upper = np.quantile(drawn, [tail, 1.0 - tail])
        return Interval(value, float(lower), float(upper))

    # -- words and figures ------------------------------------------------------------------------

    def __str__(self) -> str:
        turns, both = range(len(self.sources)), ("horizontal", "vertical")
        by_turn = [f"{i + 1} calibrated" for i in turns]

        def ratios_and_nees(name: str) -> list[Interval]:
            ratios = [self.ratio(name, each) for each in both]
            return ratios + [self.nees(name, each) for each in both]

        def covered(name: str) -> list[Interval]:
            found = [self.coverage(name, each) for each in both]
            shares = [Interval(100.0 * x.value, 100.0 * x.lower, 100.0 * x.upper) for x in found]
            return [*shares, self.nees(name, "position")]

        blocks = [self._head()]

        def add(title: str, heads: list[str], row: Callable[[str], list[Interval]]) -> None:
            rows = [[name, *(str(each) for each in row(name))] for name in self.names]
            blocks.append([*wrapped(title), plain_table(("filter", *heads), rows)])

        add(
            "All calibrated recordings, at the ends of outages, before the first fix: errors "
            f"relative to {FIRST}; NEES per degree of freedom",
            [*(f"{each} RMS" for each in both), *(f"NEES {each}" for each in both)],
            ratios_and_nees,
        )
        add(
            "Share within predicted 95 % intervals, %; NEES of the position, which includes the "
            "correlation of horizontal and vertical",
            [*both, "NEES position"],
            covered,
        )
        title = f"Horizontal RMS relative to {FIRST}, by calibrated recording"
        add(title, by_turn, lambda name: [self.ratio(name, "horizontal", i) for i in turns])
        title = "NEES of the position, by calibrated recording"
        add(title, by_turn, lambda name: [self.nees(name, "position", i) for i in turns])
        return "\n\n".join(map("\n".join, blocks))

    def _head(self) -> list[str]:
        turn = self.turns[0]
        truth, ends = turn.study.truth, [f"{each.end:g}" for each in turn.study.outages]
        n, runs = len(self.sources), sum(each.study[FIRST].runs for each in self.turns)
        text = (
            f"{turn.experiment.title}: {truth.duration:g} s at {1.0 / truth.dt:g} Hz, outages that "
            f"end at {', '.join(ends)} s; each of {n} recordings calibrated in turn, errors from "
            f"the others: {runs} runs, seed {turn.experiment.seed}"
        )
        lines = wrapped(text, indent=2)
        for i, (source, size) in enumerate(zip(self.sources, self.stretches, strict=True)):
            lines += wrapped(f"{source}, {size} stretches", f"{i + 1} ", 2)
        return lines + bullets(self.notices)

    def plot(self) -> Figure:
        """Ratio of horizontal errors and NEES of each filter: every turn, and all together."""
        from gmwm import plotting

        def row(
            measure: Callable[[str, str, int | None], Interval], name: str, what: str
        ) -> tuple[list[float], tuple[float, float, float]]:
            whole = measure(name, what, None)
            single = [measure(name, what, i).value for i in range(len(self.turns))]
            return single, (whole.value, whole.lower, whole.upper)

        ratios = {name: row(self.ratio, name, "horizontal") for name in self.names[1:]}
        judged = {name: row(self.nees, name, "position") for name in self.names}
        panels = {"horizontal RMS against GMWM": ratios, "NEES of the position": judged}
        return plotting.intervals(panels)


@lru_cache(maxsize=16)
def crossed_weights(
    stretches: tuple[int, ...], calibrated: int | None, draws: int, seed: int
) -> FloatArray:
    """How often a bootstrap draws each run, (draws, n, n, S).

    Recordings that are calibrated, recordings that are navigated with and the stretches of these
    are drawn with replacement, each of them once a draw for all runs that they are in: the crossed
    ("pigeonhole") bootstrap, which is conservative for many recordings (Owen 2007, *Annals of
    Applied Statistics* 1, 386-411). Of four, with eight stretches each, intervals of 95 % hold the
    truth in 99 % of simulated studies where recordings do not differ, in 90 % where they differ as
    much as stretches, and in 84 % where they differ twice as much.

    stretches: Of each of the n recordings, S at most.
    calibrated: The one that is calibrated, if it is not drawn; the others are then drawn among
        themselves to be navigated with.
    """
    n, rng = len(stretches), np.random.default_rng(seed)
    even = np.full(n, 1.0 / n)
    if calibrated is None:
        by = rng.multinomial(n, even, draws)
        times_drawn = rng.multinomial(n, even, draws)
    else:
        by = np.tile(np.eye(n)[calibrated], (draws, 1))
        times_drawn = rng.multinomial(n - 1, (1.0 - np.eye(n)[calibrated]) / (n - 1.0), draws)
    of = np.zeros((draws, n, max(stretches)))
    for i, size in enumerate(stretches):
        of[:, i, :size] = rng.multinomial(size, np.full(size, 1.0 / size), draws)
    weights = by[:, :, None, None] * (times_drawn[:, :, None] * of)[:, None]
    weights[:, np.arange(n), np.arange(n)] = 0.0
    return np.asarray(weights)


def _short(value: float) -> str:
    if not np.isfinite(value):
        return "-"
    digits = 0 if abs(value) >= 99.95 else 1 if abs(value) >= 9.995 else 2
    return f"{value:.{digits}f}"


# -- the study ------------------------------------------------------------------------------------


def rotate(
    vehicle: str,
    recordings: Sequence[Recording],
    folder: Path,
    *,
    runs: int | None = None,
    seed: int = 0,
    jobs: int = 1,
    earlier: Earlier = "refuse",
    progress: Progress | None = None,
) -> Rotation:
    """Calibrate every recording in turn, and navigate with the others.

    recordings: Two at least.
    folder: Where calibrations and finished runs are kept, so that work that was interrupted goes
        on.
    runs: Most stretches of each recording; by default all that do not overlap.
    earlier: {"resume", "replace", "refuse"}, what to do with what the folder holds.
    Raises InputError if there are fewer than two recordings, an axis is missing, one is too short,
        or the folder holds runs that are not to be resumed.
    """
    if len(recordings) < 2:
        raise InputError("give two recordings or more: each is calibrated in turn")
    scenario, tell = scenario_of(vehicle), progress or (lambda *_: None)
    horizon = max(outage.duration for outage in scenario.outages)
    parts = [Recorded.of(each, scenario.trajectory.duration) for each in recordings]
    parts = [replace(part, stretches=part.stretches[:runs]) for part in parts]
    kept = folder / "calibrations"
    if earlier == "refuse" and kept.exists():
        raise InputError(
            f"{folder} holds calibrations of an earlier study: resume it, or give another folder",
            "earlier-runs",
        )
    turns: list[Validation] = []
    notices: list[Notice] = []
    with folder_to_fill(kept):
        for i, recording in enumerate(recordings):
            tell(i, len(recordings), recording.source)
            filters, found = _filters(recording, parts[i].bias_sd, horizon, kept)
            others = [part for j, part in enumerate(parts) if j != i]
            source = replace(
                others[0],
                stretches=tuple(each for part in others for each in part.stretches),
                source=", ".join(part.source for part in others),
            )
            total, title = len(source.stretches), f"{vehicle}, real errors"
            planned = Experiment(scenario, source, filters, None, total, seed, title)
            kept_runs = folder / f"{vehicle}-{i + 1}"
            turns.append(Validation.of(planned, jobs=jobs, folder=kept_runs, earlier="resume"))
            found += turns[-1].notices
            notices += [replace(each, source=recording.source) for each in found]
    tell(len(recordings), len(recordings), "")
    sources = tuple(recording.source for recording in recordings)
    stretches = tuple(len(part.stretches) for part in parts)
    return Rotation(sources, stretches, tuple(turns), tuple(notices))


def reproduce_rotation(
    figure: str,
    folder: Path,
    *,
    recordings: Sequence[Recording],
    resume: bool,
    **options: Any,
) -> tuple[str, list[Path]]:
    """Figure 8 (helicopter) or 9 (car) with every recording calibrated in turn.

    Returns: what to print, and the files that were written.
    """
    check_channels(figure, recordings, AXES)
    earlier: Earlier = "resume" if resume else "refuse"
    vehicle = "car" if figure == "fig9" else "helicopter"
    rotation = rotate(vehicle, recordings, folder, earlier=earlier, **options)
    text, stem = str(rotation), folder / f"{figure}-rotated"
    return text, [write_text(stem.with_suffix(".txt"), text), *saved(rotation.plot(), stem)]


def _filters(
    recording: Recording, start: dict[str, float], horizon: float, folder: Path
) -> tuple[dict[str, SensorModels], list[Notice]]:
    """Sensor models of the filters, from the one recording that is calibrated."""
    # A calibration depends on the samples, and on the version of the program.
    digest = hashlib.sha256(f"{__version__} {recording.source} {recording.dt!r}".encode())
    for axis in AXES:
        digest.update(np.ascontiguousarray(recording[axis].values).tobytes())
    stem = digest.hexdigest()[:16]

    def kept(kind: type[_D], what: str, make: Callable[[], _D]) -> _D:
        path = folder / f"{stem}-{what}.json"
        if path.exists():
            return kind.load(path)
        made = make()
        made.save(path)
        return made

    calibration = kept(Calibration, "calibration", lambda: calibrate(recording))
    found = Calibrated.of(calibration)
    lines = found.line_models()
    filters = {
        FIRST: aligned(SensorModels.of(calibration), start),
        "lines": aligned(lines, start),
        "lines x 10": aligned(times(lines, TEN), start),
        "N+K read off": aligned(found.curve_models(horizon), start),
    }
    bound, reduce = filter_numbers.bound, filter_numbers.reduce
    for name, what, make in (
        ("N+K bound", "bound-N+K", lambda: bound(calibration, "N+K", horizon)),
        ("N+K+GM bound", "bound-N+K+GM", lambda: bound(calibration, "N+K+GM", horizon)),
        ("N+K reduced", "reduce-N+K", lambda: reduce(calibration, "N+K", [horizon])),
    ):
        filters[name] = SensorModels.of(kept(FilterNumbers, f"{what}-{horizon:g}", make))
    axes = found.lineless()
    return filters, [notice("no-line", "", {"axes": ", ".join(axes)})] if axes else []
