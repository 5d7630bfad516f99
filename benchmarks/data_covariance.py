"""Full covariance of the wavelet variances of a million samples: from the data and from a model."""

import argparse
import resource
from time import perf_counter

import numpy as np

import gmwm
from gmwm import GaussMarkov, WhiteNoise


def seconds(action):
    """Best of three."""
    times = []
    for _ in range(3):
        start = perf_counter()
        action()
        times.append(perf_counter() - start)
    return min(times)


def main() -> None:
    """Print times, side by side, and the peak memory."""
    model = WhiteNoise(1.0) + GaussMarkov(0.5, 100.0)
    x = model.simulate(1_000_000, 1.0, seed=1)
    plain = seconds(lambda: gmwm.wavelet_variance(x, dt=1.0))
    levels = gmwm.wavelet_variance(x, dt=1.0).tau.size
    print(f"{x.size:,} samples, {levels} levels: seconds (over the variance alone)")
    print(f"variance alone               {plain:6.2f}")
    for window in ("none", "octave"):
        both = seconds(lambda w=window: gmwm.wavelet_variance(x, dt=1.0, data_covariance=w))
        more = both - plain
        print(f"covariance, window {window:<8}  {more:6.2f}  ({more / plain:.0f})")
    implied = seconds(lambda: gmwm.haar_covariance(model.psd, x.size, 1.0))
    print(f"covariance, of the model     {implied:6.3f}  ({implied / plain:.2f})")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    data = np.asarray(x).nbytes / 2**20
    print(f"peak memory {peak:,.0f} MB, of which {data:,.0f} MB are the data")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
