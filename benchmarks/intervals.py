"""How often 95 % intervals hold the truth, and upper limits of a walk lie above it.

An hour at 100 Hz (360,000 samples), complete and with 0.1 % of the samples missing at random. The
true kinds of terms are fitted, every run counts, valid or not.

    python benchmarks/intervals.py intervals [--runs 400] [--store intervals.jsonl]
    python benchmarks/intervals.py limits [--runs 400] [--store intervals.jsonl]

"intervals": `Fit.interval` of each parameter of N+K, N+B and N+2GM. "limits": the upper 95 % limit
of a walk whose variance is 0, 4.4, 15, 30, 60 and 120 standard errors of that of no walk: the bound
where K is only bounded, the upper end of the 90 % interval where it is found. In brackets the
binomial interval (95 %, Clopper-Pearson) of each fraction.

Runs are appended to the store as they end, those that are in it are not done again, so that a
second call goes on; run k has the seed k. A table is printed every 50 runs of all cases.
"""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import beta

import gmwm
from gmwm import BiasInstability, Fit, FitWarning, GaussMarkov, Model, RandomWalk, WhiteNoise

N, DT, SAMPLES = 1e-4, 0.01, 360_000
LOST = 1e-3
CHUNK = 50
WHITE = WhiteNoise(N)
TRUTHS: dict[str, Model] = {
    "N+K": WHITE + RandomWalk(5e-6),
    "N+B": WHITE + BiasInstability(1.5e-5),
    "N+2GM": WHITE + GaussMarkov(3e-4, 5.0) + GaussMarkov(2e-4, 100.0),
}
SIGMAS = (0.0, 4.4, 15.0, 30.0, 60.0, 120.0)


def least_error() -> float:
    """Standard error of K^2 where there is no walk."""
    faint = 1e-10
    bound = gmwm.cramer_rao(WHITE + RandomWalk(faint), SAMPLES, DT)
    return 2.0 * faint * bound.stderr["K"]


def cases(study: str) -> dict[str, Model]:
    """True models by name."""
    if study == "intervals":
        return TRUTHS
    error = least_error()
    return {f"K at {s:g}": WHITE + RandomWalk(float(np.sqrt(s * error))) for s in SIGMAS}


def fitted(truth: Model, gaps: bool, seed: int) -> Fit:
    """The true kinds of terms, fitted to one series."""
    rng = np.random.default_rng(seed)
    x = truth.simulate(SAMPLES, DT, rng)
    if gaps:
        x[rng.random(SAMPLES) < LOST] = np.nan
    return gmwm.fit(truth.opened(), x, dt=DT)


def run(study: str, truth: Model, gaps: bool, seed: int) -> dict[str, Any]:
    """What is counted: by parameter, whether it is held."""
    fit, true = fitted(truth, gaps, seed), truth.params
    if study == "intervals":
        held = {k: bool(low <= true[k] <= high) for k, (low, high) in fit.interval().items()}
        return {"valid": fit.valid, "held": held}
    bounded = "K" in fit.upper_bounds
    upper = fit.upper_bounds["K"] if bounded else fit.interval(0.9)["K"][1]
    return {"valid": fit.valid, "held": {"K": bool(upper >= true["K"])}, "bounded": bounded}


def fraction(hits: int, runs: int) -> str:
    """With its binomial interval."""
    low = beta.ppf(0.025, hits, runs - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, runs - hits) if hits < runs else 1.0
    return f"{100 * hits / runs:5.1f} ({100 * low:.0f}..{100 * high:.0f})"


def rows(study: str, done: dict[tuple[str, str, bool, int], dict[str, Any]]) -> Iterator[str]:
    """The table."""
    for name, truth in cases(study).items():
        for gaps in (False, True):
            found = [each for key, each in done.items() if key[:3] == (study, name, gaps)]
            if not found:
                continue
            head = f"{name:<9} {'0.1 % missing' if gaps else 'complete':<13} {len(found):>4} runs"
            if study == "limits":
                near = [each for each in found if each["bounded"]]
                held = sum(each["held"]["K"] for each in found)
                below = sum(not each["held"]["K"] for each in near)
                yield (
                    f"{head}  limit holds {fraction(held, len(found))} %, only bounded in "
                    f"{len(near)}, {below} of these below"
                )
                continue
            parts = (
                f"{key} {fraction(sum(each['held'][key] for each in found), len(found))}"
                for key in truth.params
            )
            valid = sum(each["valid"] for each in found)
            yield f"{head}  {'  '.join(parts)} %  valid {valid}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("study", choices=["intervals", "limits"])
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--store", type=Path, default=Path("intervals.jsonl"))
    given = parser.parse_args()
    warnings.simplefilter("ignore", FitWarning)
    done: dict[tuple[str, str, bool, int], dict[str, Any]] = {}
    if given.store.exists():
        for line in given.store.read_text().splitlines():
            each = json.loads(line)
            done[each["study"], each["case"], each["gaps"], each["seed"]] = each
    models = cases(given.study)
    with given.store.open("a") as store:
        for seed in range(given.runs):
            for name, truth in models.items():
                for gaps in (False, True):
                    key = (given.study, name, gaps, seed)
                    if key in done:
                        continue
                    done[key] = run(given.study, truth, gaps, seed)
                    head = dict(zip(("study", "case", "gaps", "seed"), key, strict=True))
                    print(json.dumps(head | done[key]), file=store, flush=True)
            if (seed + 1) % CHUNK == 0 or seed + 1 == given.runs:
                kept = {key: each for key, each in done.items() if key[3] <= seed}
                print("", *rows(given.study, kept), sep="\n", flush=True)


if __name__ == "__main__":
    main()
