"""Matrices of the full model: they make the samples of the model, whichever are used."""

import json

import numpy as np
import pytest
from scipy.linalg import expm

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, Resonance, Sinusoid, WhiteNoise
from gmwm.export.export import channel
from imu_numbers import RATE, numbers

DT = 0.005
MODEL = (
    WhiteNoise(1e-4)
    + GaussMarkov(4e-5, 60.0)
    + GaussMarkov(2e-5, 900.0)
    + RandomWalk(1e-6)
    + Resonance(3e-4, 12.0, 0.1)
    + Sinusoid(1e-4, 20.0)
    + RateRamp(-2e-9)
)


def discretized(matrices, dt):
    """F and noise covariance of samples, by the method of Van Loan (1978)."""
    f, g, q = matrices["F"], matrices["G"], matrices["Q"]
    n = len(f)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -f, g @ q @ g.T, f.T
    big = expm(block * dt)
    transition = big[n:, n:].T
    return transition, transition @ big[:n, n:]


def test_the_continuous_form_has_the_samples_of_the_discrete_one():
    found = channel(MODEL, DT, "gyro")
    discrete, continuous = found["discrete"], found["continuous"]
    transition, noise = discretized(continuous, DT)
    assert transition == pytest.approx(discrete["F"], rel=1e-9, abs=1e-12)
    expected = discrete["G"] @ discrete["Q"] @ discrete["G"].T
    scale = np.sqrt(np.diag(expected)) + 1e-30
    assert (noise - expected) / np.outer(scale, scale) == pytest.approx(
        np.zeros_like(noise), abs=1e-6
    )
    assert continuous["R"][0, 0] / DT == pytest.approx(discrete["R"][0, 0])
    for key in ("H", "x0", "P0"):
        assert np.array_equal(continuous[key], discrete[key])


def test_textbook_values_of_the_continuous_form():
    found = channel(WhiteNoise(1e-4) + GaussMarkov(4e-5, 60.0), DT, "gyro")["continuous"]
    assert found["F"] == pytest.approx(-1.0 / 60.0)
    assert found["Q"] == pytest.approx(2.0 * 4e-5**2 / 60.0)
    assert found["R"] == pytest.approx(1e-8)
    assert found["P0"] == pytest.approx(4e-5**2)
    walk = channel(RandomWalk(3e-6) + WhiteNoise(1e-4), DT, "gyro", initial_sd=2e-4)["continuous"]
    assert walk["F"] == 0.0
    assert walk["Q"] == pytest.approx(9e-12)
    assert walk["P0"] == pytest.approx(4e-8)
    assert channel(RandomWalk(3e-6) + WhiteNoise(1e-4), DT, "gyro")["continuous"]["P0"] == 0.0
    zeta, w0 = 0.1, 2.0 * np.pi * 12.0
    found = channel(Resonance(3e-4, 12.0, zeta) + WhiteNoise(1e-4), DT, "gyro")["continuous"]
    assert found["F"] == pytest.approx(w0 * np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]]), rel=1e-9)
    assert found["G"] == pytest.approx(np.array([[0.0], [1.0]]))
    assert found["Q"] == pytest.approx(4.0 * zeta * w0 * 3e-4**2, rel=1e-6)


def test_covariances_of_the_samples_are_those_of_the_model():
    # Without the terms that are not stationary.
    model = gmwm.Model(tuple(t for t in MODEL.terms if not isinstance(t, RandomWalk | RateRamp)))
    m = channel(model, DT, "gyro")["discrete"]
    power = np.eye(len(m["F"]))
    for lag in range(40):
        found = (m["H"] @ power @ m["P0"] @ m["H"].T)[0, 0] + (m["R"][0, 0] if lag == 0 else 0.0)
        expected = model.autocovariance(np.array([lag]), DT)[0]
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-18)
        power = m["F"] @ power


def test_terms_that_live_on_samples_have_no_continuous_form():
    for term in (gmwm.QuantizationNoise(1e-6), gmwm.ARMA((-0.5,), (), 1e-8)):
        found = channel(term + WhiteNoise(1e-4), DT, "gyro")
        assert found["continuous"] is None
        assert found["discrete"]["F"].shape[0] == len(found["states"])


def test_the_file_and_the_arrays_hold_the_same(tmp_path):
    given = numbers("N+GM")
    text = gmwm.export(given, "state-space", path=tmp_path / "a.json")
    assert (tmp_path / "a.json").read_text() == text
    gmwm.export(given, "state-space", path=tmp_path / "a.npz")
    channels = json.loads(text)["channels"]
    arrays = np.load(tmp_path / "a.npz")
    assert set(channels) == set(given)
    for name, each in channels.items():
        assert each["dt"] == 1.0 / RATE
        assert arrays[f"{name}/states"].tolist() == each["states"]
        for kind in ("discrete", "continuous"):
            for key, value in each[kind].items():
                assert np.array_equal(arrays[f"{name}/{kind}/{key}"], np.array(value)), key


def test_the_walk_of_a_calibration_begins_at_zero():
    model = WhiteNoise(1e-3) + RandomWalk(1e-3)
    x = model.simulate(3000, 0.1, 1)
    rec = gmwm.Recording.from_arrays({"gyro_x": x}, 10.0, {"gyro": "rad/s"})
    calibration = gmwm.calibrate(rec, model.opened(), screening=())
    found = json.loads(gmwm.export(calibration, "state-space"))["channels"]["gyro_x"]
    assert len(found["states"]) == 1
    assert found["discrete"]["P0"] == found["continuous"]["P0"] == [[0.0]]
