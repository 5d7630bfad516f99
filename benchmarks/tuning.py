"""What halving and doubling each tuning constant of estimation and selection does.

Run with ``python benchmarks/tuning.py`` (about a quarter of an hour on two cores). The truths are
none of those that set a constant, the paper's and the demo's. Integers are rounded and at least 1,
probabilities and fractions at most 0.99.

Columns: the fraction of fits of the right model that are valid, and of a wrong one that are
rejected; the fraction of selections that choose the terms of the truth; and how far the estimates
of the right model move, in standard errors (root mean square).
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from joblib import Parallel, delayed

import gmwm
from gmwm import (
    GaussMarkov,
    Model,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    WhiteNoise,
)
from gmwm.estimate import tuning as estimation
from gmwm.selection import tuning as selection

SEEDS = range(4)
SAMPLES, SHORT, DT = 25_000, 1_500, 0.02
LIKELIHOODS = ("mle", "whittle", "em")
BY_LIKELIHOOD = ("white + walk", "white + ramp")

TRUTHS: dict[str, tuple[Model, Model]] = {
    "white + walk": (
        WhiteNoise(1e-3) + RandomWalk(8e-5),
        WhiteNoise() + GaussMarkov(tau=0.3),
    ),
    "quantization + white + Gauss-Markov": (
        QuantizationNoise(6e-5) + WhiteNoise(3e-4) + GaussMarkov(1.5e-3, 4.0),
        WhiteNoise() + RandomWalk(),
    ),
    "white + 2 Gauss-Markov": (
        WhiteNoise(1e-3) + GaussMarkov(5e-3, 0.4) + GaussMarkov(3e-3, 12.0),
        WhiteNoise() + GaussMarkov(),
    ),
    "white + ramp": (
        WhiteNoise(1e-3) + RateRamp(2.5e-6),
        WhiteNoise() + 2 * GaussMarkov(),
    ),
    "white + Gauss-Markov": (
        WhiteNoise(1e-3) + GaussMarkov(1.2e-3, 3.0),
        WhiteNoise() + RandomWalk(),
    ),
}
"""Name -> the truth and a wrong model of it."""


@dataclass(frozen=True)
class Outcome:
    """What came of all fits under one setting."""

    valid: float
    rejected: float
    chosen: float
    estimates: np.ndarray
    errors: np.ndarray

    def moved_from(self, other: Outcome) -> float:
        """Root mean square of the change of the estimates, in standard errors of the other."""
        with np.errstate(invalid="ignore", divide="ignore"):
            change = (self.estimates - other.estimates) / other.errors
        return float(np.sqrt(np.nanmean(np.where(np.isfinite(change), change, np.nan) ** 2)))


def outcome(changes: dict[tuple[str, str], float]) -> Outcome:
    """Fit and select everything with some constants changed: (room, name) -> value."""
    warnings.simplefilter("ignore", gmwm.FitWarning)
    rooms = {"estimate": estimation, "selection": selection}
    before = {key: getattr(rooms[key[0]], key[1]) for key in changes}
    for (room, name), value in changes.items():
        setattr(rooms[room], name, value)
    try:
        return _outcome()
    finally:
        for (room, name), value in before.items():
            setattr(rooms[room], name, value)


def _outcome() -> Outcome:
    valid, rejected, chosen = [], [], []
    estimates: list[float] = []
    errors: list[float] = []
    for name, (truth, wrong) in TRUTHS.items():
        right = truth.opened()
        for seed in SEEDS:
            x = truth.simulate(SAMPLES, DT, 100 + seed)
            wv = gmwm.wavelet_variance(x, DT)
            fits = [gmwm.fit(right, wv)]
            chosen.append(_kinds(gmwm.select(wv).model) == _kinds(right))
            rejected.append(not gmwm.fit(wrong, wv).valid)
            if seed == 0 and name in BY_LIKELIHOOD:
                fits += [gmwm.fit(right, x[:SHORT], DT, method=each) for each in LIKELIHOODS]
            valid.append(fits[0].valid)
            for fit in fits:
                estimates += [fit.params[key] for key in right.params]
                errors += [fit.stderr.get(key, np.nan) for key in right.params]
    lines = gmwm.fit(WhiteNoise() + RandomWalk(), TRUTHS["white + walk"][0].simulate(
        40 * SAMPLES, DT, 7), DT, method="allan")  # fmt: skip
    estimates += [lines.params.get(key, np.nan) for key in ("N", "K")]
    errors += [lines.stderr.get(key, np.nan) for key in ("N", "K")]
    return Outcome(
        float(np.mean(valid)), float(np.mean(rejected)), float(np.mean(chosen)),
        np.array(estimates), np.array(errors),
    )  # fmt: skip


def _kinds(model: Model) -> list[str]:
    return sorted(type(term).__name__ for term in model.terms)


def constants() -> Iterator[tuple[str, str, float]]:
    """Room, name and value of every constant."""
    rooms: dict[str, ModuleType] = {"estimate": estimation, "selection": selection}
    for room, module in rooms.items():
        for name, value in vars(module).items():
            if name.isupper():
                yield room, name, value


def changed(value: float, factor: float) -> float:
    """The constant times the factor, of its own kind."""
    if isinstance(value, int):
        return max(round(value * factor), 1)
    return min(value * factor, 0.99) if value < 1.0 else value * factor


def main() -> None:
    """Print the table, those that matter first."""
    settings = [
        (room, name, value, factor) for room, name, value in constants() for factor in (0.5, 2.0)
    ]
    tasks = [{}] + [{(room, name): changed(value, f)} for room, name, value, f in settings]
    usual, *others = Parallel(n_jobs=2)(delayed(outcome)(task) for task in tasks)
    print(f"{len(TRUTHS)} truths, {len(SEEDS)} seeds each; as they are: valid {usual.valid:.0%}, "
          f"rejected {usual.rejected:.0%}, chosen {usual.chosen:.0%}\n")  # fmt: skip
    head = "| constant | value | valid | rejected | chosen | moved |"
    print(head, "| --- | --- | --- | --- | --- | --- |", sep="\n")
    rows: dict[tuple[str, str, float], list[Outcome]] = {}
    for (room, name, value, _), found in zip(settings, others, strict=True):
        rows.setdefault((room, name, value), []).append(found)
    still = []
    for (room, name, value), pair in sorted(rows.items(), key=lambda row: -_weight(row[1], usual)):
        if _weight(pair, usual) < 0.02:
            still.append(f"`{name}`")
            continue
        cells = [
            ", ".join(f"{100 * getattr(each, part):.0f} %" for each in pair)
            for part in ("valid", "rejected", "chosen")
        ]
        moved = ", ".join(f"{each.moved_from(usual):.2g}" for each in pair)
        print(f"| `{room}.{name}` | {value:g} | {' | '.join(cells)} | {moved} |")
    print(f"\nNo fraction moves and no estimate by 0.02 standard errors: {', '.join(still)}.")


def _weight(pair: list[Outcome], usual: Outcome) -> float:
    """How much a constant matters: the largest change of anything."""
    parts = ("valid", "rejected", "chosen")
    fractions = [abs(getattr(o, part) - getattr(usual, part)) for o in pair for part in parts]
    return max([*fractions, *(each.moved_from(usual) for each in pair)])


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
