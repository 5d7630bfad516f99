"""Simulated sensors, their data sheets, and what these say of a filter's numbers.

For each sensor (white noise with a random walk, flicker noise, a Gauss-Markov process of 5 to
500 s, or both of the last and a walk) a sheet is made from its Allan deviation: N, and B where the
curve is first flat, within 1,440 s, over 0.664. Curves without such a place have no B to state and
are drawn again. Printed: how often K of `gmwm.bound` of a recording of 4 h at 10 Hz lies between
both ends that the sheet's models leave, and the NEES under the truth of a filter with the bound
over all of them, beside that of the bound on the truth itself: what the form N+K alone costs.

    python benchmarks/sheets.py --sensors 200 --seed 11 [--lowest]

With ``--lowest``, B is the lowest point within 1,440 s, which may lie behind a hump.
"""

from __future__ import annotations

import argparse

import numpy as np

import gmwm
from gmwm import BiasInstability, GaussMarkov, Model, RandomWalk, WhiteNoise
from gmwm.filter_numbers import Chain

DT, N_SAMPLES, HORIZON = 0.1, 144_000, 60.0
TIMES = (10.0, 60.0, 600.0)
TAU = np.geomspace(0.1, 1440.0, 800)
SPREADS = (1.0, 1.25)  # unit_spread; the last is the default
KINDS = ("N+K", "N+B", "N+GM", "N+GM+K", "N+B+K")


def drawn(kind: str, rng: np.random.Generator) -> Model:
    """A sensor: slow noise that meets its white noise at 5 to 500 s."""
    N = 10.0 ** rng.uniform(-5.0, -3.0)
    level = N / np.sqrt(10.0 ** rng.uniform(0.7, 2.7))
    model = Model((WhiteNoise(N),))
    if "B" in kind:
        model += BiasInstability(level / 0.664)
    if "GM" in kind:
        tau = 5.0 * 10.0 ** rng.uniform(0.0, 2.0)
        peak = 10.0 ** rng.uniform(-0.3, 0.7)  # of its deviation over that of white noise there
        model += GaussMarkov(peak * N / np.sqrt(1.89 * tau) / 0.617, tau)
    if "K" in kind:
        model += RandomWalk(np.sqrt(3.0) * level**2 / N * rng.uniform(0.1, 1.0))
    return model


def stated(model: Model, lowest: bool) -> dict[str, float] | None:
    """N and B as a sheet has them; ``None`` if the curve is nowhere flat."""
    variance = 2.0 * model.haar_variance(TAU, 1e-3)
    flat = np.flatnonzero(np.diff(np.log(variance)) / np.diff(np.log(TAU)) >= -0.04)
    if not flat.size:
        return None
    least = np.min(variance) if lowest else variance[flat[0]]
    return {"N": model.terms[0].N, "B": float(np.sqrt(least)) / 0.664}


def sheet_of(values: dict[str, float]) -> gmwm.Datasheet:
    units = {"N": "rad/s/sqrt(Hz)", "B": "rad/s"}
    return gmwm.datasheet({"gyro": {k: f"{v:.9e} {units[k]}" for k, v in values.items()}})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sensors", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--lowest", action="store_true")
    given = parser.parse_args()
    rng, rows, without = np.random.default_rng(given.seed), [], 0
    while len(rows) < given.sensors:
        kind = KINDS[len(rows) % len(KINDS)]
        truth = drawn(kind, rng)
        values = stated(truth, given.lowest)
        if values is None:
            without += 1
            continue
        sheet = sheet_of(values)
        ends = [gmwm.bound(one, horizon=HORIZON).K for one in sheet.models("gyro").values()]
        x = gmwm.simulate(truth, n=N_SAMPLES, dt=DT, seed=int(rng.integers(1 << 31)))
        found = gmwm.select(gmwm.wavelet_variance(x, dt=DT)).fit
        recorded = gmwm.bound(found.model, horizon=HORIZON, dt=DT).K
        nees, known = [], gmwm.bound(truth, horizon=HORIZON)
        own = (sheet.numbers(horizon=HORIZON, unit_spread=each)["gyro"] for each in SPREADS)
        for one in (known, *own):
            errors = Chain.usual("gyro").worse(truth, one.model, DT, TIMES, 0.0, one.initial_sd)
            nees.append(errors.nees())
        rows.append((kind, min(ends), max(ends), recorded, nees))
    print(f"{given.sensors} sensors, seed {given.seed}; {without} without a flat place left out")
    print("sensor     n  unit_spread  K between the ends   NEES: median (largest)")
    for kind in (*KINDS, "all"):
        own = [row for row in rows if kind in (row[0], "all")]
        low, high, recorded = (np.array([row[k] for row in own]) for k in (1, 2, 3))
        for k, spread in enumerate((0.0, *SPREADS)):
            held = np.mean((recorded >= low / (spread or 1.0)) & (recorded <= spread * high))
            between = f"{100.0 * held:14.0f} %" if spread else f"{'truth known':>16}"
            nees = np.array([row[4][k] for row in own])
            text = ", ".join(
                f"{time:g} s {np.median(values):.2f} ({values.max():.2f})"
                for time, values in zip(TIMES, nees.T, strict=True)
            )
            print(f"{kind:8} {len(own):3d} {spread:12g} {between}     {text}")


if __name__ == "__main__":
    main()
