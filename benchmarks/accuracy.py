"""Accuracy on the scenarios of Stebler et al. (2012), Tables II-IV, against the Cramer-Rao bound.

Run with ``python benchmarks/accuracy.py [RUNS]``; prints the table of the README.
"""

import sys
from time import perf_counter

import numpy as np
from joblib import Parallel, delayed

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise

# Title, truth, n, and for each parameter: name, key, power, relative Cramer-Rao bound.
SCENARIOS = (
    (
        "Table II",
        WhiteNoise(0.2) + RandomWalk(0.02) + RateRamp(0.003),
        6000,
        (
            ("sigma2_WN", "N", 2, 0.01924),
            ("sigma2_RW", "K", 2, 0.1172),
            ("omega", "R", 1, 0.0862),
        ),
    ),
    (
        "Table III",
        WhiteNoise(0.8) + GaussMarkov(0.5, 125.0) + RateRamp(0.001),
        6000,
        (
            ("beta", "tau", -1, 0.2603),
            ("sigma2_GM", "sigma", 2, 0.2155),
            ("sigma2_WN", "N", 2, 0.01911),
            ("omega", "R", 1, 0.0560),
        ),
    ),
    (
        "Table IV",
        GaussMarkov(29.5e-6**0.5, 0.5)
        + GaussMarkov(4.5e-6**0.5, 20.0)
        + GaussMarkov(2.5e-6**0.5, 125.0),
        1_000_000,
        (
            ("beta_1", "tau_3", -1, 0.0810),
            ("sigma2_1", "sigma_3", 2, 0.0723),
            ("beta_2", "tau_2", -1, 0.0429),
            ("sigma2_2", "sigma_2", 2, 0.0364),
            ("beta_3", "tau_1", -1, 0.00473),
            ("sigma2_3", "sigma_1", 2, 0.00185),
        ),
    ),
)


def one_run(truth, n, seed):
    fit = gmwm.fit(truth.opened(), truth.simulate(n, 1.0, seed), dt=1.0)
    return fit.params, fit.interval(), fit.valid


def main(runs):
    print("| scenario | parameter | relative RMSE | / bound | 95 % interval covers |")
    print("| --- | --- | --- | --- | --- |")
    for title, truth, n, parameters in SCENARIOS:
        start = perf_counter()
        results = Parallel(n_jobs=-1)(delayed(one_run)(truth, n, seed) for seed in range(runs))
        seconds = perf_counter() - start
        for name, key, power, bound in parameters:
            true = truth.params[key]
            ratio = np.array([params[key] for params, _, _ in results]) ** power / true**power
            rmse = np.sqrt(np.mean((ratio - 1.0) ** 2))
            inside = [
                bounds[key][0] <= true <= bounds[key][1]
                for _, bounds, _ in results
                if key in bounds
            ]
            print(
                f"| {title} | {name} | {rmse:.3g} | {rmse / bound:.2f} | "
                f"{100 * np.mean(inside):.0f} % |"
            )
        failed = sum(not valid for *_, valid in results)
        print(f"{title}: {runs} runs, {failed} not valid, {seconds:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
