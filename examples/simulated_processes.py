"""Two processes without a closed form, estimated by simulation."""

import numpy as np

import gmwm
from gmwm import Process, WhiteNoise, parameter


class RoundedNoise(Process):
    """White noise behind a converter whose steps are as large as the noise."""

    sigma: float = parameter("u")
    lsb: float = parameter("u")

    def draw(self, n, dt, rng):
        return self.lsb * np.rint(self.sigma / self.lsb * rng.standard_normal(n))


class HeldBias(Process):
    """Bias instability as a value that is held for a time and then drawn anew."""

    level: float = parameter("u", role="scale")
    hold: float = parameter("s")

    def draw(self, n, dt, rng):
        length = max(round(self.hold / dt), 1)
        blocks = self.level * rng.standard_normal(-(-n // length) + 1)
        start = int(rng.integers(length))
        return np.repeat(blocks, length)[start : start + n]


def main() -> None:
    """Print truth, estimate and interval of both."""
    rounded = RoundedNoise(sigma=0.7, lsb=1.0)
    x = rounded.simulate(20_000, 1.0, seed=1)
    fit = gmwm.fit(RoundedNoise(lsb=1.0), x, dt=1.0, method="simulated")
    low, high = fit.interval()["sigma"]
    white = gmwm.fit(WhiteNoise(), x, dt=1.0).params["N"]
    print("white noise of 0.7 rounded to whole steps")
    print(f"  sigma  {fit.params['sigma']:.4f}  ({low:.4f} .. {high:.4f})")
    print(f"  taken for white noise: {white:.4f}")

    truth = WhiteNoise(1.0) + HeldBias(level=0.5, hold=60.0)
    x = truth.simulate(20_000, 1.0, seed=2)
    fit = gmwm.fit(truth.opened(), x, dt=1.0, method="simulated")
    print("white noise of 1 and a bias of 0.5 held for 60 s")
    for key, (low, high) in fit.interval().items():
        print(f"  {key:<6} {fit.params[key]:.4f}  ({low:.4f} .. {high:.4f})")


if __name__ == "__main__":
    main()
