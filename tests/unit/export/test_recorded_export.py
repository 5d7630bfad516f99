# ruff: noqa: E501 - tables
"""Numbers as they are found for files, matrices of terms, and comments: as they were."""

import numpy as np
import pytest

import gmwm
from gmwm import (
    ARMA,
    BiasInstability,
    Channel,
    GaussMarkov,
    LowPassNoise,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Recording,
    Resonance,
    Sinusoid,
    WhiteNoise,
)
from gmwm.export import TARGETS
from gmwm.export.comments import above, below, comment, plain, wrapped
from gmwm.export.found import imu_of
from gmwm.export.imu import Axis, Triad, _letters
from gmwm.export.programs.state_space import channel
from gmwm.process import as_model
from imu_numbers import numbers
from recorded import assert_as_recorded, refused, summed

DT = 0.01


@pytest.fixture(scope="module")
def calibration():
    """Axes that differ: a walk, a walk too small to be found, a Gauss-Markov process."""
    rng = np.random.default_rng(5)
    truths = {
        "gyro_x": WhiteNoise(1e-3) + RandomWalk(1e-4), "gyro_y": as_model(WhiteNoise(2e-3)),
        "gyro_z": WhiteNoise(1e-3) + GaussMarkov(4e-4, 2.0), "accel_x": as_model(WhiteNoise(1e-2)),
        "accel_y": WhiteNoise(2e-2) + RandomWalk(1e-3),
    }  # fmt: skip
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    channels = [
        Channel(name, truth.simulate(2000, DT, rng), DT, name[:-2], units[name[:-2]])
        for name, truth in truths.items()
    ]
    recording = Recording(tuple(channels), "bench.csv")
    return gmwm.calibrate(recording, {name: truth.opened() for name, truth in truths.items()})


def by_time(values):
    return {f"{time:g}": value for time, value in values.items()}


def test_numbers_of_calibrations(calibration):
    found = {}
    for shared in (False, True):
        imu = imu_of([calibration], "N+K", 20.0, 60.0, shared)
        for triad in imu.triads:
            axes = triad.axes if shared else triad.xyz()
            found[f"{triad.quantity} {shared}"] = {
                "axes": [[a.name, a.N, a.K, a.initial_sd, by_time(a.nees), a.rate, sorted(a.upper),
                          [n.text for n in a.notices]] for a in axes],
                "N": triad.N, "K": triad.K, "start": triad.initial_sd, "rate": triad.rate,
                "nees": {name: by_time(nees) for name, nees in (triad.shared_nees or {}).items()},
                "upper": [triad.is_upper(letter) for letter in ("N", "K", "sigma")],
            }  # fmt: skip
        outlook = {quantity: by_time(values) for quantity, values in imu.outlook.items()}
        found[f"{shared}"] = [imu.remarks, imu.cautions, imu.sources, imu.rate, outlook]
    assert_as_recorded("export/numbers", found, rtol=1e-4)


def test_matrices_of_terms():
    found = {}
    for term in (
        WhiteNoise(1.0), QuantizationNoise(2.0), GaussMarkov(0.3, 7.0), RandomWalk(0.1), RateRamp(0.2),
        Resonance(0.5, 3.0, 0.1), Sinusoid(0.3, 4.0), ARMA([0.5], [0.2], 1.0),
        ARMA([-0.5], [], 1.0), BiasInstability(0.2), LowPassNoise(1.0, 5.0, 2.0, 0.7),
        WhiteNoise(1.0) + GaussMarkov(0.3, 7.0) + GaussMarkov(0.2, 0.5) + RandomWalk(0.1),
    ):  # fmt: skip
        for dt in (0.02, 1.0):
            made = refused(lambda t=term, dt=dt: channel(as_model(t), dt, "accel", 0.3))
            found[f"{term!r} {dt}"] = made if isinstance(made, list) else [
                made["states"], made["approximate"], summed(made["discrete"]),
                summed(made["continuous"]),
            ]  # fmt: skip
    assert_as_recorded("export/matrices", found)


def test_comments():
    found = {"plain": [plain(text) for text in ("a\nb\tc", "a\\b", "x\x1b[0m", "y" * 600, "é ok")]}
    lines = ["one -- two", "", "three"]
    found["comment"] = [comment(lines, mark) for mark in ("#", "//", "%", "<!--")]
    found["wrapped"] = wrapped("word " * 40)
    for form in ("N+K", "N+GM"):
        for changes in ({}, {"rate": 0.0}, {"source": "x" * 90, "duration": 0.0}, {"axes": "xz"}):
            for shared in (False, True) if form == "N+K" else (False,):
                imu = refused(
                    lambda f=form, c=changes, s=shared: imu_of([numbers(f, **c)], f, None, 60.0, s)
                )
                found[f"{form} {changes} {shared}"] = imu if isinstance(imu, list) else [
                    above(imu, "a program"), below(imu, "a convention"),
                    [[a.name, a.N, a.K, a.sigma, a.tau] for t in imu.by_axis().triads for a in t.xyz()],
                ]  # fmt: skip
    assert_as_recorded("export/comments", found)


def test_axes_and_what_is_refused():
    found = {"letters": [_letters(names) for names in (
        ["gyro_x", "gyro_z"], ["a", "b"], ["gyro_X", "gyro_x"], ["wz", "wy", "wx"], ["", "x"])]}  # fmt: skip
    one = Axis("gyro_x", 1.0, 0.0, 2.0, 50.0, 0.1)
    found["moved"] = [[axis.sigma, axis.tau] for axis in (one.moved(200.0), one.moved(12.5))]
    found["models"] = [repr(axis.model) for axis in (one, Axis("a", 1.0, 0.5, 0.0, np.nan, 0.0))]
    axes = tuple(
        Axis(f"g_{k}", 1.0 + k, 2.0 - k, 0.0, np.nan, 0.1 * k, upper=frozenset(upper))
        for k, upper in enumerate(("", "K", "NK"))
    )
    for count in (1, 2, 3):
        for part in (axes[:count], axes[-count:]):
            triad = Triad("gyro", part)
            found[f"{count} {part[0].name}"] = [
                triad.N, triad.K, triad.initial_sd, triad.is_upper("N"), triad.is_upper("K"),
                [[a.name, a.N, a.K, sorted(a.upper)] for a in triad.xyz()],
            ]  # fmt: skip
    own, gm = numbers("N+K"), numbers("N+GM")
    for name, given in {
        "none": [], "twice": [own, own], "one sensor": [numbers("N+K", quantities=("gyro",))],
        "other form": [gm], "horizon": [own], "odd": ["x"],
    }.items():  # fmt: skip
        for horizon in (None, 60.0, 61.0, -1.0):
            found[f"{name} {horizon}"] = refused(
                lambda g=given, h=horizon: [imu_of(g, "N+K", h, 60.0, False).horizon]
            )
    for name, each in TARGETS.items():
        found[name] = {key: value for key, value in vars(each).items() if not callable(value)}
    assert_as_recorded("export/axes", found)
