"""Is a random walk invented? Pure white noise of three hours, fitted as white noise and walk.

Prints in how many records the interval of K begins at zero, in how many the selection takes white
noise alone, and the random walk that would be read off a line of slope +1/2 through the last
octaves (IEEE Std 952), as is usually done.

    python benchmarks/white_noise.py [--seeds 100]
"""

from __future__ import annotations

import argparse

import numpy as np

import gmwm
from gmwm import RandomWalk, WhiteNoise

N = np.radians(0.005)  # rad/s/sqrt(Hz)
RATE, HOURS = 100.0, 3.0


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=100)
    seeds = parser.parse_args().seeds
    n = round(HOURS * 3600.0 * RATE)
    from_zero = alone = 0
    bounds, read_off = [], []
    for seed in range(seeds):
        series = WhiteNoise(N).simulate(n, 1.0 / RATE, seed)
        wv = gmwm.wavelet_variance(series, dt=1.0 / RATE)
        low, high = gmwm.fit(WhiteNoise() + RandomWalk(), wv).interval()["K"]
        from_zero += low == 0.0
        bounds.append(high)
        alone += [term.label for term in gmwm.select(wv).model.terms] == ["white noise"]
        # K = sqrt(3/tau) times the Allan deviation on a line of slope +1/2.
        read_off.append(np.max((np.sqrt(3.0 / wv.tau) * wv.allan_deviation)[-3:]))
    degrees = np.degrees([np.median(bounds), np.median(read_off)])
    print(
        f"{seeds} records of {HOURS:g} h at {RATE:g} Hz, N = 0.005 deg/s/sqrt(Hz), no random walk"
    )
    print(f"interval of K begins at zero       {from_zero} of {seeds}")
    print(f"white noise alone is selected      {alone} of {seeds}")
    print(f"upper bound of K, median           {degrees[0]:.2g} deg/s/sqrt(s)")
    print(f"K read off the last three octaves  {degrees[1]:.2g} deg/s/sqrt(s)")


if __name__ == "__main__":
    main()
