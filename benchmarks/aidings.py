"""Certificates for poses and odometry: exact covariance analysis against simulated filters.

    python benchmarks/aidings.py [--runs 80] [--seed 500] [--aiding pose odometry wheels]

Each run drives the whole nonlinear filter with simulated sensors and aiding of `gmwm.ins`, with the
true models and with those of a data sheet, which have no slow terms. At the end of outages: NEES
per degree of freedom of what `gmwm.certify` judges, predicted and simulated with its standard
error. That is the position, or, of odometry and wheels, the way since the aiding ended.
"""

from __future__ import annotations

import argparse

import numpy as np

from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.ins import (
    AIDINGS,
    Outage,
    Scenario,
    SensorModels,
    Simulated,
    covariance_analysis,
    loiter_with_outages,
    monte_carlo,
)
from gmwm.ins.geometry import matrix_from_rpy, ned_difference
from gmwm.ins.simulation import FilterErrors

TRUTH = SensorModels.of(
    {
        "gyro": WhiteNoise(1e-4) + GaussMarkov(5e-5, 60.0),
        "accel": WhiteNoise(1e-3) + GaussMarkov(2e-3, 30.0),
    }
)
FILTERS = {
    "truth": TRUTH,
    "data sheet": SensorModels.of(
        {
            "gyro": WhiteNoise(1e-4) + RandomWalk(1e-7),
            "accel": WhiteNoise(1e-3) + RandomWalk(1e-6),
        }
    ),
}
OUTAGES, DT = (10.0, 30.0), 0.05  # s


def errors_since(scenario: Scenario, found: FilterErrors, outage: Outage) -> np.ndarray:
    """Errors of the way in an outage, in body axes at its start, (runs, 3), m."""
    truth = scenario.trajectory
    start, end = (round(time / truth.dt) for time in (outage.start, outage.end))
    before = found.error[:, found.index(outage.start, before=False)]
    after = found.error[:, found.index(outage.end)]
    way = ned_difference(truth.lla[end], truth.lla[start])
    turned = np.cross(before[:, 6:], way)
    return (after[:, :3] - before[:, :3] + turned) @ matrix_from_rpy(truth.rpy[start])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=80)
    parser.add_argument("--seed", type=int, default=500)
    parser.add_argument("--aiding", nargs="*", default=list(AIDINGS))
    given = parser.parse_args()
    print(f"{given.runs} runs, seed {given.seed}: NEES, standard error in brackets")
    print("aiding    filter      outage  exact  simulated         rms over exact sd")
    for aiding in given.aiding:
        scenario = loiter_with_outages(OUTAGES, DT, aiding=aiding)
        found = monte_carlo(scenario, Simulated(TRUTH), FILTERS, given.runs, given.seed)
        for name, believed in FILTERS.items():
            exact = covariance_analysis(scenario, TRUTH, believed)
            for outage in scenario.outages:
                at, own = exact.index(outage.end), found[name]
                judged = exact if exact.since is None else exact.since
                P, J = (each[at, :3, :3] for each in (judged.predicted, judged.actual))
                if exact.since is None:
                    error = own.error[:, own.index(outage.end), :3]
                else:
                    error = errors_since(scenario, own, outage)
                nees = np.einsum("ki,ij,kj->k", error, np.linalg.inv(P), error) / 3.0
                spread = np.std(nees, ddof=1) / np.sqrt(nees.size)
                ratio = np.sqrt(np.mean(np.sum(error**2, axis=1)) / np.trace(J))
                expected = float(judged.nees(slice(0, 3))[at])
                print(
                    f"{aiding:9} {name:10} {outage.duration:5g} s {expected:6.3g}"
                    f"  {np.mean(nees):6.3g} ({spread:.2g})      {ratio:.3f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
