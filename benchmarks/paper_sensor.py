"""The paper's rule of choice on the paper's sensor: gyros or accelerometers of Table VI, 4.5 h.

    python benchmarks/paper_sensor.py [--sensor accel] [--runs 27] [--seed 0]

Prints the number of Gauss-Markov terms by ``gmwm.select(rule="merge")``, how many fits are not
valid, and how often a correlation time is held. For the accelerometer also the upper limit (95 %)
of the term of 5 ug and 25 s beside the models without it.
"""

import argparse
import warnings
from collections import Counter

import numpy as np

import gmwm
from gmwm import GaussMarkov, WhiteNoise

DEGREE_HOUR, MICRO_G = np.deg2rad(1.0) / 3600.0, 9.80665e-6
SENSORS = {
    "gyro": (DEGREE_HOUR, ((113.0, 2000.0), (65.0, 20.0), (206.0, 0.1))),
    "accel": (MICRO_G, ((5.0, 25.0), (13.0, 500.0))),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sensor", choices=SENSORS, default="gyro")
    parser.add_argument("--runs", type=int, default=27)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    warnings.simplefilter("ignore", gmwm.FitWarning)
    unit, terms = SENSORS[given.sensor]
    truth = gmwm.Model(
        (WhiteNoise(140.0 * unit), *(GaussMarkov(sigma * unit, tau) for sigma, tau in terms))
    )
    counts, invalid, held, limits = Counter[int](), 0, 0, []
    for seed in range(given.seed, given.seed + given.runs):
        x = gmwm.simulate(truth, n=1_620_000, rate=100, seed=seed)
        best = gmwm.select(x, rate=100, rule="merge")
        number = sum(isinstance(term, GaussMarkov) for term in best.model.terms)
        counts[number] += 1
        invalid += not best.fit.valid
        held += any(each.code == "time-held" for each in best.fit.notices)
        if given.sensor == "accel" and number == 1:
            more = gmwm.fit(best.chosen.model + GaussMarkov(tau=25.0), best.fit.wv)
            place = [each.values["tau"] for each in more.model.terms[1:]].index(25.0) + 1
            limits.append(more[f"sigma_{place}"].upper / unit)
    print(f"{given.runs} of the {given.sensor}, 4.5 h at 100 Hz")
    for number, count in sorted(counts.items()):
        print(f"white noise + {number} Gauss-Markov: {count}")
    print(f"not valid: {invalid}; a correlation time held: {held}")
    if limits:
        low, middle, high = np.quantile(limits, [0.1, 0.5, 0.9])
        print(f"upper limit at 25 s: {middle:.1f} ug (10 to 90 %: {low:.1f} to {high:.1f} ug)")


if __name__ == "__main__":
    main()
