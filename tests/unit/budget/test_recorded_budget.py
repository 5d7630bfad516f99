# ruff: noqa: E501 - tables
"""Integrals of every process and budgets of some models: every number, as it was."""

import numpy as np

import gmwm
from gmwm import (
    ARMA,
    BiasInstability,
    GaussMarkov,
    LowPassNoise,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Resonance,
    Sinusoid,
    WhiteNoise,
)
from gmwm.budget.integrals import _nodes, _squared_gain, _steps, integral_rms
from recorded import assert_as_recorded, refused, summed

PROCESSES = (
    WhiteNoise(2.0), QuantizationNoise(3.0), RandomWalk(0.5), RateRamp(-0.3), GaussMarkov(0.7, 5.0),
    GaussMarkov(0.7, 900.0), Sinusoid(0.4, 0.11), Resonance(0.6, 0.2, 0.05), BiasInstability(0.9),
    LowPassNoise(1.0, 0.2, 2.0, 0.7), ARMA([0.5], [0.3], 1.0),
)  # fmt: skip
TIMES = (0.5, 0.8, 1.0, 3.7, 60.0, 900.25)


def test_integrals():
    found = {}
    for process in PROCESSES:
        for known in (False, True):
            dt = 1.0 if isinstance(process, ARMA) else 0.5
            times = [t for t in TIMES if t >= dt]
            found[f"{process!r} {known}"] = refused(
                lambda p=process, t=times, dt=dt, k=known: integral_rms(p, t, dt, known_start=k)
            )
    found["steps"] = [
        _steps(np.array(times), 0.1)[0] for times in ([0.3, 0.29999999, 0.2999999, 0.35], [1e5, 1e5 + 0.05])
    ]  # fmt: skip
    found["rests"] = np.round(_steps(np.array([0.3, 0.2999999, 0.35, 0.30000001]), 0.1)[1], 9)
    for n in (1.0, 5.5, 128.0, 129.0, 1e4):
        frequency, weight, resolved = _nodes(n)
        found[f"nodes {n}"] = [frequency.size, float(weight.sum()), float(weight @ frequency),
                               float(weight @ resolved), float(frequency[0]), float(frequency[-1])]  # fmt: skip
    frequency = np.array([0.0, 1e-7, 1e-5, 1e-3, 0.02, 0.3, 0.5])
    moment = np.array([50.0, 170.0, 430.0])
    for start in (False, True):
        for resolved in (0.0, 1.0):
            gain = _squared_gain(frequency, np.full(7, resolved), 10, 0.25, 1.0, start, moment)
            found[f"gain {start} {resolved}"] = gain
    assert_as_recorded("budget/integrals", found)


def test_budgets():
    found = {}
    slow = WhiteNoise(1e-3) + GaussMarkov(1e-4, 100.0) + RandomWalk(1e-6)
    models = {
        "gyro_x": slow, "gyro_y": WhiteNoise(1e-3) + RateRamp(-1e-7), "gyro_z": slow,
        "accel_x": WhiteNoise(2e-2), "accel_z": WhiteNoise(1e-2) + RandomWalk(1e-4), "mag_x": slow,
    }  # fmt: skip
    for name, given, times in (
        ("all", models, (1.0, 10.0, 60.0)), ("one", {"gyro_z": slow}, (30.0,)),
        ("accel", {"accel_y": slow}, (1.0, 600.0)), ("long", {"gyro_x": slow}, (60.0, 601.0)),
        ("steep", {"gyro_x": WhiteNoise(0.05)}, (1.0, 10.0, 20.0)),
        ("short", {"gyro": slow}, (0.01, 0.02)),
    ):  # fmt: skip
        for calibrated in (True, False):
            budget = gmwm.error_budget(given, times, dt=0.01, calibrated=calibrated)
            largest = [
                budget.largest(quantity, of)
                for of in budget.groups for quantity in budget.quantities(of)
            ]  # fmt: skip
            found[f"{name} {calibrated}"] = [
                summed(budget.to_dict()), str(budget), budget.notes,
                {row.component: share for row, share in largest},
            ]  # fmt: skip
    x = WhiteNoise(1e-3).simulate(2000, 0.01, 1)
    fit = gmwm.fit(WhiteNoise(), gmwm.Channel("gyro_x", x, 0.01, "gyro", "rad/s"))
    for times in ((1.9,), (2.0,), (2.1,)):
        found[f"of {times}"] = gmwm.error_budget(fit, times).notes
    for bad in ((), (0.009,), ("a",), (np.nan,), (np.inf,)):
        found[f"bad {bad}"] = refused(lambda t=bad: gmwm.error_budget(models, t, dt=0.01))
    curves = gmwm.error_budget(models, (1.0, 60.0), dt=0.01).curves("horizontal", "position")
    found["curves"] = {label: curve[[0, 16, 32]] for label, curve in curves.items()}
    assert_as_recorded("budget/budgets", found)
