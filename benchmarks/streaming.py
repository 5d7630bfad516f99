"""Wavelet variance of all levels: exact, of a stream, allantools, and one sum of the samples.

``python benchmarks/streaming.py`` prints seconds and ratios for 1e7 samples, interleaved, medians
of ``--rounds``; then processor time per sample of the stream for 1e6, 1e7 and 1e8 samples from a
generator, how far memory grows from 2e6 to 2e7 samples, and how far levels of 1e6 samples are from
those of all windows.

Wall-clock times of a busy machine say little: processor time stands beside them.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable, Iterator

import allantools
import numpy as np

import gmwm

BLOCK = 100_000


def clocks(job: Callable[[], object]) -> tuple[float, float]:
    """Wall-clock and processor seconds."""
    wall, processor = time.perf_counter(), time.process_time()
    job()
    return time.perf_counter() - wall, time.process_time() - processor


def streamed(blocks: Iterator[np.ndarray]) -> gmwm.WaveletVariance:
    stream = gmwm.StreamingVariance(dt=1.0)
    for block in blocks:
        stream.update(block)
    return stream.result()


def generated(n: int) -> Iterator[np.ndarray]:
    """One block over and over, each time of another mean: noise takes longer than all else."""
    block = np.random.default_rng(1).normal(size=BLOCK)
    for i in range(n // BLOCK):
        yield block + 0.01 * (i % 7)


def table(n: int, rounds: int) -> None:
    x = np.random.default_rng(0).normal(size=n)
    octaves = 2.0 ** np.arange(n.bit_length() - 1)
    jobs = {
        "allantools oadev": lambda: allantools.oadev(x, 1.0, "freq", taus=octaves),
        "exact": lambda: gmwm.wavelet_variance(x, dt=1.0),
        "stream": lambda: streamed(np.array_split(x, max(n // BLOCK, 1))),
        "one numpy sum": lambda: np.sum(x),
    }
    jobs["exact"](), jobs["stream"]()  # compiled code is loaded
    found = {name: [] for name in jobs}
    for _ in range(rounds):
        for name, job in jobs.items():
            found[name].append(clocks(job))
    median = {name: np.median(each, axis=0) for name, each in found.items()}
    print(f"{n:.0e} samples, {octaves.size} levels, medians of {rounds} rounds")
    print(f"{'':18} {'wall [s]':>9} {'proc. [s]':>9} {'oadev/it':>9} {'it/sum':>7}")
    for name, (wall, processor) in median.items():
        peer, floor = median["allantools oadev"][1], median["one numpy sum"][1]
        print(
            f"{name:18} {wall:9.4f} {processor:9.4f} {peer / processor:9.1f} "
            f"{processor / floor:7.1f}"
        )
    print("ratios are those of processor time")


def per_sample(sizes: list[int], rounds: int) -> None:
    streamed(generated(BLOCK))  # compiled code is loaded
    found = {}
    for n in sizes:
        times = []
        for _ in range(rounds if n < 10**8 else 1):
            making = clocks(lambda n=n: sum(block[0] for block in generated(n)))[1]
            times.append(clocks(lambda n=n: streamed(generated(n)))[1] - making)
        found[n] = min(times) / n * 1e9  # what other programs take from the cache is not ours
    text = ", ".join(f"{each:.2f} ns at {n:.0e}" for n, each in found.items())
    print(f"processor time of the stream per sample, without making it: {text}")


def memory(sizes: list[int]) -> None:
    for n in sizes:
        streamed(generated(n))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"peak memory of the process after a stream of {n:.0e} samples: {peak:.0f} MiB")


def agreement(n: int) -> None:
    white = gmwm.WhiteNoise(1.0)
    for model in (white, white + gmwm.RandomWalk(3e-3), white + gmwm.GaussMarkov(0.3, 40.0)):
        x = model.simulate(n, 1.0, seed=11) + 1e6
        exact = gmwm.wavelet_variance(x, dt=1.0)
        error = np.sqrt(np.diag(exact.covariance_under(model.psd)))
        far = np.abs(streamed(np.array_split(x, 37)).variance - exact.variance) / error
        print(f"{model!r}: at most {np.max(far):.4f} standard errors at any of {far.size} levels")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=float, default=1e7)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--generate", type=float, nargs="*", default=[1e6, 1e7, 1e8])
    parser.add_argument("--memory", type=float, nargs="*", default=[2e6, 2e7])
    parser.add_argument("--agreement", type=float, default=1e6)
    given = parser.parse_args()
    memory([int(n) for n in given.memory])  # before anything large is made
    if given.generate:
        per_sample([int(n) for n in given.generate], given.rounds)
    if given.agreement:
        agreement(int(given.agreement))
    if given.samples:
        table(int(given.samples), given.rounds)


if __name__ == "__main__":
    main()
