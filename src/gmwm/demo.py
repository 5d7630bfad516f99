"""A demonstration on simulated data: the MEMS IMU of the PLANS 2012 paper, Table VI."""

from __future__ import annotations

import numpy as np

from gmwm.process import GaussMarkov, Model, WhiteNoise
from gmwm.process.model import ModelParameter
from gmwm.recording import Channel, Recording
from gmwm.units import SI_UNIT, factor

RATE = 100.0
"""Hz."""

_DEG_PER_HOUR = factor("deg/h", "rad/s")
_GYRO_DENSITY = factor("deg/h/sqrt(Hz)", "rad/s/sqrt(Hz)")
_MICRO_G = factor("ug", "m/s^2")
_ACCEL_DENSITY = factor("ug/sqrt(Hz)", "m/s^2/sqrt(Hz)")


def table_six() -> dict[str, Model]:
    """The paper's Table VI models by quantity, in SI units.

    Gauss-Markov standard deviations in deg/h and ug, correlation times 1/beta in seconds.
    """
    gyro = WhiteNoise(140.0 * _GYRO_DENSITY) + Model(
        tuple(
            GaussMarkov(sigma * _DEG_PER_HOUR, 1.0 / beta)
            for sigma, beta in ((113.0, 0.0005), (65.0, 0.05), (206.0, 10.0))
        )
    )
    accel = WhiteNoise(140.0 * _ACCEL_DENSITY) + Model(
        tuple(
            GaussMarkov(sigma * _MICRO_G, 1.0 / beta) for sigma, beta in ((5.0, 0.04), (13.0, 0.002))
        )
    )
    return {"gyro": gyro, "accel": accel}


def simulated_imu(seconds: float, seed: int) -> tuple[Recording, dict[str, Model]]:
    """A six-axis static recording and the model of each of its channels.

    Parameters
    ----------
    seconds : float
        Length.
    seed : int

    Returns
    -------
    Recording
    dict
        Channel name -> Model that made it.
    """
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE)
    truth = {
        f"{quantity}_{axis}": model for quantity, model in table_six().items() for axis in "xyz"
    }
    channels = []
    for name, model in truth.items():
        quantity = name.split("_")[0]
        values = model.simulate(n, 1.0 / RATE, rng)
        channels.append(Channel(name, values, 1.0 / RATE, quantity, SI_UNIT[quantity]))
    source = f"simulated IMU, seed {seed}"
    return Recording(tuple(channels), source), truth


def matched_truth(fitted: Model, truth: Model) -> tuple[dict[str, float], list[ModelParameter]]:
    """True values beside fitted parameters.

    Gauss-Markov terms are matched one to one by nearest correlation time, other terms by kind.

    Returns
    -------
    dict
        Key of the fitted model -> true value.
    list of ModelParameter
        The parameters of true terms that no fitted term stands for.
    """
    known: dict[str, float] = {}
    distance = []
    for i, term in enumerate(fitted.terms):
        for j, true in enumerate(truth.terms):
            if isinstance(term, GaussMarkov) and isinstance(true, GaussMarkov):
                gap = abs(np.log(float(term.tau or 1.0) / float(true.tau or 1.0)))
                distance.append((float(gap), i, j))
            elif type(term) is type(true):
                distance.append((0.0, i, j))
    pairs: dict[int, int] = {}
    for _, i, j in sorted(distance):
        if i not in pairs and j not in pairs.values():
            pairs[i] = j
    for item in fitted.parameters:
        if item.term in pairs:
            value = truth.terms[pairs[item.term]].values[item.parameter.name]
            known[item.key] = float(value or 0.0)
    unresolved = [item for item in truth.parameters if item.term not in pairs.values()]
    return known, unresolved
