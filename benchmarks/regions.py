"""Numbers for the whole confidence region of a fit, tried on parameter sets drawn from it.

Run with ``python benchmarks/regions.py chains | flight``; the tables of docs/filter-numbers.md.
``chains`` has 200 sets of each of four fits, by exact covariance analysis; ``flight`` has the whole
navigation filter on a loiter with ten sets of a sensor, by Monte Carlo beside covariance analysis.
"""

from __future__ import annotations

import argparse
from textwrap import fill
from time import process_time

import numpy as np

import gmwm
from gmwm import GaussMarkov, Model, RandomWalk, WhiteNoise
from gmwm.filter_numbers import Chain
from gmwm.filter_numbers.spectra.region import ParameterRegion
from gmwm.ins import SensorModels, covariance_analysis, loiter_with_outages, monte_carlo
from gmwm.ins.simulation import Simulated
from gmwm.study.navigation import TABLE_6

LEVEL, DRAWS, SEED = 0.95, 200, 99
HORIZON, DT = 60.0, 0.1
FITS = {
    "1 GM": (WhiteNoise(8e-5) + GaussMarkov(4e-5, 60.0), 1),
    "2 GM": (WhiteNoise(5e-5) + GaussMarkov(4e-4, 5.0) + GaussMarkov(1e-4, 300.0), 16),
    "walk + GM": (WhiteNoise(1e-4) + RandomWalk(2e-6) + GaussMarkov(1e-4, 30.0), 16),
    "paper gyro": (TABLE_6.models["gyro_x"], 16),
}
"""Truth, and hours of its record."""

SENSOR = {
    "gyro": WhiteNoise(1e-4) + GaussMarkov(5e-5, 60.0),
    "accel": WhiteNoise(1e-3) + GaussMarkov(2e-3, 30.0),
}
SETS, RUNS, OUTAGES = 10, 100, (10.0, 60.0)


def _say(text: str) -> None:
    print(fill(text, 96))


def _fitted(truth: Model, hours: int, seed: int) -> gmwm.Fit:
    return gmwm.fit(truth.opened(), truth.simulate(round(hours * 3600 / DT), DT, seed), DT)


def _drawn(fit: gmwm.Fit, number: int) -> list[Model]:
    region = ParameterRegion.of(fit, LEVEL)
    return [region.model_at(p) for p in region.draws(number, np.random.default_rng(SEED))]


def chains() -> None:
    """Worst direction of any chain of integrators for any drawn parameter set."""
    _say(
        f"{DRAWS} parameter sets of the {LEVEL:.0%} region of a fit, bounds for {HORIZON:g} s. The "
        "error is integrated once to three times, after 0 or 120 s of fixes. region, estimate: "
        "largest eigenvalue at 0.1, 1 and 10 horizons, with the bound of the region or of the "
        "estimate. sets: how many the bound of the estimate does not cover."
    )
    print(f"{'truth':<12}{'hours':>6}  {'form':<8}{'region':>10}{'estimate':>10}{'sets':>6}")
    for name, (truth, hours) in FITS.items():
        fit = _fitted(truth, hours, hours)
        models = _drawn(fit, DRAWS)
        for form in ("N+K", "N+K+GM"):
            found = []
            for level in (LEVEL, None):
                numbers = gmwm.bound(fit, form, HORIZON, level=level)
                found.append([_worst(model, numbers) for model in models])
            region, estimate = np.array(found)
            print(f"{name:<12}{hours:>6}  {form:<8}{region.max():>10.5f}{estimate.max():>10.3f}"
                  f"{np.sum(estimate > 1.001):>6}", flush=True)  # fmt: skip


def _worst(truth: Model, numbers: gmwm.AxisFilterNumbers) -> float:
    times = (0.1 * HORIZON, HORIZON, 10.0 * HORIZON)
    return max(
        float(
            Chain(order, 1.0, settled)
            .errors(truth, numbers.model, DT, times, believed_sd=numbers.initial_sd)
            .worst()
            .max()
        )
        for order in (1, 2, 3)
        for settled in (0.0, 120.0)
    )


def flight() -> None:
    """NEES of the real filter with the bound of a region, for ten sets of its parameters."""
    start = process_time()
    fits = {kind: _fitted(truth, 1, i) for i, (kind, truth) in enumerate(SENSOR.items(), 1)}
    numbers = gmwm.bound(fits, horizon=HORIZON, level=LEVEL)
    believed = SensorModels.of(
        {kind: each.model for kind, each in numbers.items()},
        {kind: each.initial_sd for kind, each in numbers.items()},
    )
    scenario = loiter_with_outages(OUTAGES, DT)
    limit = _largest(9, RUNS)
    _say(
        f"INS/GNSS on a loiter, N+K for the {LEVEL:.0%} region of fits from an hour; {RUNS} runs "
        f"of each of {SETS} parameter sets. At the end of outages of 10 and 60 s, for position, "
        "velocity and attitude: NEES per degree of freedom and the largest eigenvalue, by "
        "covariance analysis (exact), and measured. For a consistent filter the standard error of "
        f"a NEES is {np.sqrt(2.0 / 9.0 / RUNS):.2f}, and in 95 % of such tables all measured "
        f"eigenvalues are below {limit:.2f}."
    )
    heads = f"{'exact':>10}{'largest':>9}{'measured':>10}{'largest':>9}" * len(OUTAGES)
    print(f"{'set':<5}{'gyro sigma, tau':>20}{'accel sigma, tau':>20}" + heads)
    drawn = {kind: _drawn(fit, SETS) for kind, fit in fits.items()}
    for i in range(SETS):
        truth = SensorModels.of({kind: models[i] for kind, models in drawn.items()})
        analysis = covariance_analysis(scenario, truth, believed)
        runs = monte_carlo(scenario, Simulated(truth), {"own": believed}, RUNS, seed=i)["own"]
        cells = []
        for outage in scenario.outages:
            error = runs.error[:, runs.index(outage.end)]
            at = analysis.index(outage.end)
            for covariance in (analysis.actual[at], error.T @ error / RUNS):
                values = np.linalg.eigvals(np.linalg.solve(analysis.predicted[at], covariance)).real
                cells += [np.mean(values), np.max(values)]
        shown = "".join(f"{c:>{w}.3g}" for c, w in zip(cells, (10, 9, 10, 9) * 2, strict=True))
        pairs = [(f"{model.params['sigma']:.2e}", f"{model.params['tau']:.1f}")
                 for model in (truth.models["gyro_x"], truth.models["accel_x"])]  # fmt: skip
        print(f"{i + 1:<5}" + "".join(f"{', '.join(p):>20}" for p in pairs) + shown, flush=True)
    print(f"{process_time() - start:.0f} s of processor time")


def _largest(size: int, runs: int) -> float:
    """Quantile of the largest eigenvalue of a table of sample covariances of unit ones."""
    rng = np.random.default_rng(1)
    draws = rng.standard_normal((2000, runs, size))
    values = np.linalg.eigvalsh(np.einsum("kri,krj->kij", draws, draws) / runs)[:, -1]
    return float(np.quantile(values, 0.95 ** (1.0 / (SETS * len(OUTAGES)))))


if __name__ == "__main__":
    tables = {"chains": chains, "flight": flight}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "parts", nargs="*", default=list(tables), help="chains, flight; by default both"
    )
    for part in parser.parse_args().parts:
        tables[part]()
