"""How often the true model is chosen: `gmwm.select` on simulated series of known form."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from gmwm._core.runs import do_runs
from gmwm._core.tables import plain_table
from gmwm.process import (
    GaussMarkov,
    Model,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Sinusoid,
    WhiteNoise,
    as_model,
)
from gmwm.selection import select

LENGTHS = (100_000, 1_000_000)

TRUTHS: tuple[Model, ...] = (
    as_model(WhiteNoise(1.0)),
    WhiteNoise(1.0) + RandomWalk(0.003),
    QuantizationNoise(3.0) + WhiteNoise(1.0),
    QuantizationNoise(3.0) + WhiteNoise(1.0) + RandomWalk(0.003),
    as_model(GaussMarkov(1.0, 30.0)),
    WhiteNoise(1.0) + GaussMarkov(0.5, 50.0),
    WhiteNoise(1.0) + GaussMarkov(0.5, 50.0) + RandomWalk(0.003),
    WhiteNoise(1.0) + GaussMarkov(1.0, 8.0) + GaussMarkov(1.0, 800.0),
    WhiteNoise(1.0) + GaussMarkov(1.0, 3.0) + GaussMarkov(1.0, 60.0) + GaussMarkov(1.0, 1500.0),
    WhiteNoise(1.0)
    + RandomWalk(0.02)
    + GaussMarkov(2.0, 3.0)
    + GaussMarkov(1.5, 40.0)
    + GaussMarkov(1.5, 700.0),
    WhiteNoise(1.0) + RateRamp(1e-4),
    WhiteNoise(1.0) + GaussMarkov(0.5, 50.0) + Sinusoid(0.3, 0.0565),
)
"""One-sample noise of 1, dt = 1 s; each term has 5 % of the variance at some level at least."""


@dataclass(frozen=True)
class Choice:
    """What was chosen for one true model at one length.

    right: Runs in which the very model was chosen.
    surplus: Terms more than the truth has -> runs.
    """

    truth: Model
    n: int
    runs: int
    right: int
    surplus: Counter[int]


def choice_study(runs: int, seed: int, jobs: int, lengths: Sequence[int] = LENGTHS) -> list[Choice]:
    """Choose models for ``runs`` series of every truth and length, in parallel processes."""
    cases = [(index, n) for n in lengths for index in range(len(TRUTHS))]
    found = do_runs(partial(_choose, cases, runs, seed), len(cases) * runs, {}, jobs=jobs)
    right, surplus = (found[name].reshape(-1, runs) for name in ("right", "surplus"))
    return [
        Choice(TRUTHS[index], n, runs, int(np.sum(right[i])), Counter(surplus[i].tolist()))
        for i, (index, n) in enumerate(cases)
    ]


def _choose(
    cases: Sequence[tuple[int, int]], runs: int, seed: int, number: int
) -> dict[str, bool | int]:
    """Whether the true model is chosen for one series of all cases, and its surplus terms."""
    case, run = divmod(number, runs)
    index, n = cases[case]
    truth = TRUTHS[index]
    series = truth.simulate(n, 1.0, np.random.default_rng([seed + run, index, n]))
    lines = tuple(Sinusoid(frequency=t.frequency) for t in truth.terms if isinstance(t, Sinusoid))
    chosen = select(series, dt=1.0, extra=lines).model
    kinds = [Counter(type(term).__name__ for term in m.terms) for m in (truth, chosen)]
    return {"right": kinds[0] == kinds[1], "surplus": len(chosen.terms) - len(truth.terms)}


def choice_table(choices: Sequence[Choice]) -> str:
    """The study as a table."""
    runs, rows = choices[0].runs, []
    for choice in choices:
        fewer = sum(count for more, count in choice.surplus.items() if more < 0)
        many = sum(count for more, count in choice.surplus.items() if more > 1)
        counts = (choice.right, fewer, choice.surplus[1], many)
        shares = [f"{count / runs:.0%}" for count in counts]
        rows.append([f"{choice.n:,}", *shares, choice.truth.title()])
    table = plain_table(("n", "right", "fewer", "+1", "+2..", "true model"), rows)
    note = "right: the true terms; fewer, +1, +2..: terms too few or too many"
    return f"Models chosen by gmwm.select, {runs} series each\n\n{table}\n\n{note}"
