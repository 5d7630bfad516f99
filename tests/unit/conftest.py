"""What tests of several rooms fraction: validations of made-up errors, without any filter."""

from types import SimpleNamespace

import numpy as np
import pytest

from gmwm.ins import FilterErrors, MonteCarlo, Outage, SensorModels, car_drive
from gmwm.ins.filter.filter import Solution
from gmwm.ins.geometry import matrix_from_rpy
from gmwm.ins.simulation.consistency import GROUPS
from gmwm.ins.simulation.validation import Validation
from gmwm.issues import Notice
from gmwm.process import WhiteNoise, as_model

FACTORS = {"right": 1.0, "bold": 3.0, "timid": 0.3}
"""Name -> true errors in units of the predicted ones."""

NOTE = Notice("made-up", "note", "", "a note")


@pytest.fixture(scope="session")
def made_up():
    """A function that makes a `Validation` of which it is known what it must say."""
    return _made_up


def _made_up(factors=None, outages=((20, 10), (40, 15)), runs=40, seed=1, duration=60.0, dead=()):
    """A validation whose errors are normal, ``factor`` times as large as predicted."""
    factors = factors or FACTORS
    rng = np.random.default_rng(seed)
    truth = car_drive(duration=duration, dt=0.1)
    spans = tuple(Outage(float(start), float(length)) for start, length in outages)
    draws = rng.standard_normal((runs, 400, 9))
    filters = {name: _runs(each, spans, draws, rng, name in dead) for name, each in factors.items()}
    example = {name: _solution(runs, truth) for name, runs in filters.items()}
    experiment = SimpleNamespace(title="made up", seed=seed, filters={
        name: SensorModels({"gyro_x": as_model(WhiteNoise(1e-4))}) for name in factors
    })  # fmt: skip
    return Validation(experiment, MonteCarlo(filters, spans, example, truth, (NOTE,)))


def _runs(factor, spans, draws, rng, dead):
    before = {float(span.end) for span in spans}
    epochs = sorted([*((float(t), False) for t in range(61)), *((t, True) for t in before)],
                    key=lambda each: (each[0], not each[1]))  # fmt: skip
    time = np.array([t for t, _ in epochs])
    early = np.array([flag for _, flag in epochs])
    without = np.zeros(time.size)
    for span in spans:
        inside = (time >= span.start) & ((time < span.end) | ((time == span.end) & early))
        without[inside] = time[inside] - span.start
    count = draws.shape[0]
    sd = np.tile(
        (1.0 + 0.2 * without**1.5)[:, None] * np.repeat([1.0, 0.1, 1e-3], 3), (count, 1, 1)
    )
    error = factor * sd * draws[:, : time.size]
    if dead:
        error[:, time > 5.0] = np.nan
    z = (error / sd) ** 2
    nees = np.stack([np.sum(z[..., part], axis=-1) for part in GROUPS.values()], axis=-1)
    sensor = factor * rng.standard_normal((count, time.size, 6))
    white = rng.standard_normal((count, 300)) * factor
    return FilterErrors(
        time=time, before=early, error=error, sd=sd, nees=nees, log_det=np.zeros_like(nees),
        sensor_error=sensor, sensor_sd=np.ones_like(sensor),
        sensor_nees=np.sum(sensor**2, axis=-1),
        nis=np.stack([np.sum(white**2, axis=1), np.full(count, 300.0)], axis=1),
        whiteness=rng.standard_normal(count),
    )  # fmt: skip


def _solution(runs, truth):
    alive = np.isfinite(runs.error[0, :, 0])
    time = runs.time[alive]
    index = np.rint(time / truth.dt).astype(int)
    count = int(np.count_nonzero(alive))
    return Solution(
        time=time, before=runs.before[alive], lla=truth.lla[index] + 1e-7,
        velocity=truth.velocity[index], matrix=matrix_from_rpy(truth.rpy[index]),
        covariance=np.tile(np.eye(9), (count, 1, 1)) * (runs.sd[0, alive] ** 2)[:, None, :],
        sensor_errors=np.zeros((count, 6)), sensor_covariance=np.zeros((count, 6, 6)),
        innovations=None, state_names=(), states=np.zeros(0), state_covariance=np.zeros((0, 0)),
    )  # fmt: skip
