"""Every recording calibrated in turn, the others navigated with: what does not hang on one of them.

Filters differ in their sensor models only, and every one has a slow state on every axis. What is
compared comes from the recording that is calibrated alone; intervals allow for the few recordings.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core.distributions import norm
from gmwm._core.tables import plain_table
from gmwm._core.text import bullets, wrapped
from gmwm._core.typing import FloatArray
from gmwm.ins import tuning
from gmwm.ins.simulation import GROUPS, FilterErrors, Validation
from gmwm.issues import Notice
from gmwm.study.summary import markdown_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIRST = "GMWM"  # the others are compared with it
_BOUND = float(norm.ppf(0.975))  # of the interval whose coverage is counted


@dataclass(frozen=True)
class Interval:
    """A value with its bootstrap interval of 95 %."""

    value: float
    lower: float
    upper: float

    def __str__(self) -> str:
        return f"{_short(self.value)} ({_short(self.lower)}-{_short(self.upper)})"


@dataclass(frozen=True, eq=False)
class Rotation:
    """How filters navigated with each recording calibrated in turn.

    sources: The n recordings.
    stretches: How many of each are navigated with.
    turns: With each recording calibrated; its runs are the stretches of the others, in their order.
    """

    sources: tuple[str, ...]
    stretches: tuple[int, ...]
    turns: tuple[Validation, ...]
    notices: tuple[Notice, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Of the filters; the others are compared with the first."""
        return self.turns[0].names

    # -- numbers ----------------------------------------------------------------------------------

    def ratio(self, name: str, quantity: str, turn: int | None = None) -> Interval:
        """Root mean square of an error at the ends of outages against the first filter's.

        quantity: {"horizontal", "vertical"}.
        turn: With this recording calibrated; by default all of them.
        """
        part = slice(0, 2) if quantity == "horizontal" else slice(2, 3)

        def squares(runs: FilterErrors, end: int) -> FloatArray:
            return np.asarray(np.sum(runs.error[:, end, part] ** 2, axis=1))

        other, first = (self._table(each, squares) for each in (name, FIRST))
        both = np.isfinite(other) & np.isfinite(first)
        tables = [np.where(both, each, np.nan) for each in (other, first)]
        return self._interval(tables, turn, np.sqrt)

    def nees(self, name: str, group: str, turn: int | None = None) -> Interval:
        """NEES per degree of freedom at the ends of outages, of a group of errors."""
        index, part = list(GROUPS).index(group), GROUPS[group]

        def judged(runs: FilterErrors, end: int) -> FloatArray:
            return np.asarray(runs.nees[:, end, index] / (part.stop - part.start))

        table = self._table(name, judged)
        return self._interval([table, np.where(np.isfinite(table), 1.0, np.nan)], turn)

    def coverage(self, name: str, group: str, turn: int | None = None) -> Interval:
        """Fraction of errors within the predicted interval of 95 % at the ends of outages."""
        part = GROUPS[group]

        def inside(runs: FilterErrors, end: int) -> FloatArray:
            standard = runs.error[:, end, part] / runs.sd[:, end, part]
            hits = np.mean(np.abs(standard) < _BOUND, axis=1)
            return np.where(np.isfinite(standard[:, 0]), hits, np.nan)

        table = self._table(name, inside)
        return self._interval([table, np.where(np.isfinite(table), 1.0, np.nan)], turn)

    def _table(self, name: str, measure: Callable[[FilterErrors, int], FloatArray]) -> FloatArray:
        """Mean over the outages, by recording calibrated, recording navigated with and stretch."""
        n = len(self.sources)
        table = np.full((n, n, max(self.stretches)), np.nan)
        for i, turn in enumerate(self.turns):
            runs = turn.study[name]
            ends = [runs.index(outage.end) for outage in turn.study.outages]
            values = np.mean([measure(runs, end) for end in ends], axis=0)
            first = 0
            for j, size in enumerate(self.stretches):
                if j != i:
                    table[i, j, :size] = values[first : first + size]
                    first += size
        return table

    def _interval(
        self,
        tables: Sequence[FloatArray],
        turn: int | None,
        root: Callable[[FloatArray], FloatArray] = np.asarray,
    ) -> Interval:
        """Ratio of the sums of two tables."""
        n = len(self.sources)
        weights = _weights(self.stretches, turn, self.turns[0].experiment.seed)
        above, below = (np.nan_to_num(each) for each in tables)
        whole = np.ones((n, n)) if turn is None else np.outer(np.eye(n)[turn], np.ones(n))
        with np.errstate(invalid="ignore", divide="ignore"):
            sums = [np.sum(whole[..., None] * each) for each in (above, below)]
            value = root(np.array(sums[0] / sums[1]))
            drawn = root(
                np.einsum("dcts,cts->d", weights, above) / np.einsum("dcts,cts->d", weights, below)
            )
        drawn = drawn[np.isfinite(drawn)]
        if not drawn.size:
            return Interval(float(value), float("nan"), float("nan"))
        tail = 0.5 - 0.5 * tuning.CONFIDENCE
        lower, upper = np.quantile(drawn, [tail, 1.0 - tail])
        return Interval(float(value), float(lower), float(upper))

    # -- words ------------------------------------------------------------------------------------

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
        for title, head, row in (
            (
                f"All turns, at the ends of outages before the first fix: errors over those of "
                f"{FIRST}; NEES per degree of freedom",
                [*(f"{each} RMS" for each in both), *(f"NEES {each}" for each in both)],
                ratios_and_nees,
            ),
            (
                "Share within predicted 95 % intervals, %; NEES of the position, which includes "
                "the correlation of horizontal and vertical",
                [*both, "NEES position"],
                covered,
            ),
            (
                f"Horizontal RMS over that of {FIRST}, turn by turn",
                by_turn,
                lambda name: [self.ratio(name, "horizontal", i) for i in turns],
            ),
            (
                "NEES of the position, turn by turn",
                by_turn,
                lambda name: [self.nees(name, "position", i) for i in turns],
            ),
        ):
            rows = [[name, *map(str, row(name))] for name in self.names]
            blocks.append([*wrapped(title), plain_table(("filter", *head), rows)])
        return "\n\n".join(map("\n".join, blocks))

    def _head(self) -> list[str]:
        turn = self.turns[0]
        truth, ends = turn.study.truth, [f"{each.end:g}" for each in turn.study.outages]
        n, runs = len(self.sources), sum(each.study[FIRST].runs for each in self.turns)
        text = (
            f"{turn.experiment.title}: {truth.duration:g} s at {1.0 / truth.dt:g} Hz, outages that "
            f"end at {', '.join(ends)} s; each of {n} recordings calibrated in turn, the others "
            f"navigated with: {runs} runs, seed {turn.experiment.seed}"
        )
        lines = wrapped(text, indent=2)
        for i, (source, size) in enumerate(zip(self.sources, self.stretches, strict=True)):
            lines += wrapped(f"{source}, {size} stretches", f"{i + 1} ", 2)
        lines += bullets(self.notices)
        return lines

    def markdown(self) -> str:
        """All turns together, as a table for a page."""
        groups = ("horizontal", "vertical", "position")
        head = ["filter", "horizontal error against GMWM", *(f"NEES {each}" for each in groups)]
        rows = []
        for name in self.names:
            ratio = "1" if name == FIRST else _of(self.ratio(name, "horizontal"))
            judged = [_of(self.nees(name, each)) for each in groups]
            shares = [self.coverage(name, each).value for each in groups[:2]]
            rows.append([name, ratio, *judged, *(f"{100.0 * each:.0f} %" for each in shares)])
        return markdown_table([*head, "within 95 %: horizontal", "vertical"], rows)

    # -- figures ----------------------------------------------------------------------------------

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
def _weights(stretches: tuple[int, ...], turn: int | None, seed: int) -> FloatArray:
    """Of all intervals of a study, or of one turn of it; see `crossed_weights`."""
    calibrated = None if turn is None else np.eye(len(stretches))[turn]
    rng = np.random.default_rng(seed)
    return crossed_weights(stretches, calibrated, tuning.BOOTSTRAP_DRAWS, rng)


def crossed_weights(
    stretches: Sequence[int], calibrated: FloatArray | None, draws: int, rng: np.random.Generator
) -> FloatArray:
    """How often a bootstrap draws each run, (draws, n, n, S).

    Recordings that are calibrated, recordings that are navigated with and the stretches of these
    are drawn with replacement, each of them once a draw for all runs that they are in: the crossed
    ("pigeonhole") bootstrap, which is conservative for many recordings (Owen 2007, *Annals of
    Applied Statistics* 1, 386-411). Of four, with eight stretches each, intervals of 95 % hold the
    truth in 99 % of simulated studies where recordings do not differ, in 90 % where they differ as
    much as stretches, and in 84 % where they differ twice as much.

    stretches: Of each of the n recordings, S at most.
    calibrated: (n,) or None, weights of those that are calibrated, if they are not drawn.
    """
    n = len(stretches)
    even = np.full(n, 1.0 / n)
    first = np.tile(calibrated, (draws, 1)) if calibrated is not None else None
    by = rng.multinomial(n, even, draws) if first is None else first
    of = np.zeros((draws, n, max(stretches)))
    if calibrated is None:
        times_drawn = rng.multinomial(n, even, draws)
    else:
        # The calibrated one is not navigated with: the others are drawn among themselves.
        others = np.where(calibrated > 0.0, 0.0, 1.0)
        times_drawn = rng.multinomial(n - 1, others / np.sum(others), draws)
    for i, size in enumerate(stretches):
        of[:, i, :size] = rng.multinomial(size, np.full(size, 1.0 / size), draws)
    weights = by[:, :, None, None] * (times_drawn[:, :, None] * of)[:, None]
    weights[:, np.arange(n), np.arange(n)] = 0.0
    return np.asarray(weights)


def _short(value: float) -> str:
    """Three digits, without an exponent."""
    if not np.isfinite(value):
        return "-"
    digits = 0 if abs(value) >= 99.95 else 1 if abs(value) >= 9.995 else 2
    return f"{value:.{digits}f}"


def _of(found: Interval) -> str:
    return f"{_short(found.value)} ({_short(found.lower)} to {_short(found.upper)})"
