"""A program that uses gmwm as its users do."""

from pathlib import Path

import numpy as np

import gmwm
from gmwm import GaussMarkov, InputError, Model, Process, RandomWalk, WhiteNoise, parameter


class Hum(Process):
    """A process of one's own."""

    level: float = parameter("u/sqrt(Hz)", role="scale")
    slope: float = parameter("-", upper=2.0)

    def psd(
        self, f: np.ndarray[tuple[int, ...], np.dtype[np.float64]], dt: float
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return np.asarray(self.level**2 * (2.0 * f * dt) ** -self.slope)


def corrected(truth: Model) -> dict[str, float]:
    """Estimates of a simulated series."""
    series = gmwm.simulate(truth, n=10_000, dt=0.01, seed=1)
    fit = gmwm.fit(truth.opened(), series, dt=0.01, method=gmwm.GMWM(weights="diagonal"))
    tau: gmwm.Estimate = fit["tau"]
    if not fit.valid or tau.upper > 1e3:
        print(fit.message, [f"{name}: {why}" for name, why in fit.reasons.items()])
    width: float = tau.upper - tau.lower
    return {**fit.params, "width": width}


def main(path: Path) -> None:
    """From a file to numbers."""
    try:
        recording = gmwm.read(path, rate=100.0, units={"gyro": "deg/s", "accel": "g"})
    except InputError as error:
        print(error)
        return
    wv = gmwm.wavelet_variance(recording["gyro_x"])
    selection = gmwm.select(wv, max_gauss_markov=2)
    noise: float = selection.model.white_density()
    bound = gmwm.cramer_rao(WhiteNoise(1e-3) + RandomWalk(1e-5), n=wv.n, dt=wv.dt)
    calibration = gmwm.calibrate(recording, jobs=2)
    for name, fit in calibration.items():
        print(name, fit.params, fit.interval(0.9), bound.stderr, noise)
    calibration.report("report.html")
    calibration.save("calibration.json")
    numbers = gmwm.bound(calibration, "N+K", horizon=10.0)
    walk: float = numbers["gyro_x"].K
    small: gmwm.AxisFilterNumbers = gmwm.reduce(calibration["gyro_x"], "N+2GM", outages=(10, 60))
    certificate = gmwm.certify(calibration, {"gyro": (1e-4, walk), "accel": (1e-3, 1e-5)})
    print(small.sigma, certificate.worst.nees, certificate.recommended.horizon)
    text: str = gmwm.export(numbers, "openvins")
    print(len(text))
    print(corrected(WhiteNoise(N=0.1) + GaussMarkov(sigma=1.0, tau=3.0)), Hum(level=1.0).values)
    print(GaussMarkov(sigma=1.0, tau=3.0).tau * 2.0)


main(Path("static.csv"))
