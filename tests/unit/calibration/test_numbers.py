"""Sensor numbers: N, B and K of known models, their intervals, and how they are shown."""

import numpy as np
import pytest

import gmwm
from gmwm import (
    BiasInstability,
    GaussMarkov,
    LowPassNoise,
    Model,
    Process,
    QuantizationNoise,
    RandomWalk,
    Resonance,
    Sinusoid,
    WhiteNoise,
)
from gmwm.calibration import PLATEAU, axis_numbers
from gmwm.readers import Channel

DT, N = 0.01, 200_000
DEG_PER_SQRT_H = np.deg2rad(1.0) / 60.0


def fitted(model, seed=1, n=N, free=None):
    """Fit of a simulated gyro.

    free: Keys of the parameters that are estimated; all by default.
    """
    model = Model((model,)) if isinstance(model, Process) else model
    x = gmwm.simulate(model, n=n, dt=DT, seed=seed)
    wv = gmwm.wavelet_variance(Channel("gyro_x", x, DT, "gyro", "rad/s"))
    return gmwm.fit(model.with_params(dict.fromkeys(free or model.params)), wv)


def density_of(model):
    """N of a model of which only the first amplitude is estimated."""
    model = Model((model,)) if isinstance(model, Process) else model
    return axis_numbers(fitted(model, free=list(model.params)[:1])).N.value


@pytest.mark.parametrize(
    ("model", "density"),
    [
        (WhiteNoise(2.0), 2.0),
        (WhiteNoise(2.0) + RandomWalk(0.01), 2.0),
        (WhiteNoise(3.0) + GaussMarkov(10.0, 0.02), np.hypot(3.0, np.sqrt(2 * 0.02) * 10.0)),
        (WhiteNoise(2.0) + GaussMarkov(1.0, 20.0), 2.0),
        (WhiteNoise(2.0) + QuantizationNoise(0.02) + Sinusoid(0.3, 5.0), 2.0),
        (LowPassNoise(2.0, 20.0, 2, 0.7), 2.0),
        (WhiteNoise(1.0) + LowPassNoise(2.0, 20.0, 2, 0.7), np.hypot(1.0, 2.0)),
    ],
)
def test_N_is_the_density_of_all_that_averages_out(model, density):
    assert density_of(model) == pytest.approx(density, rel=0.02)


def test_a_resonance_counts_with_the_foot_of_its_spectrum():
    resonance = Resonance(3.0, 20.0, 0.1)
    foot = float(resonance.psd(np.array([0.01]), DT)[0])
    assert density_of(WhiteNoise(1.0) + resonance) == pytest.approx(
        np.hypot(1.0, foot**0.5), rel=0.02
    )


def test_N_of_white_noise_is_its_own_estimate():
    fit = fitted(WhiteNoise(1.0) + RandomWalk(0.05))
    numbers = axis_numbers(fit)
    assert fit["N"] == numbers.N
    assert fit["K"] == numbers.K


def test_B_is_the_plateau_of_flicker_noise():
    model = WhiteNoise(0.1) + BiasInstability(1.0) + RandomWalk(1e-3)
    numbers = axis_numbers(fitted(model, free=["B"], n=1_000_000))
    assert numbers.B.value == pytest.approx(1.0, rel=0.15)


def test_B_is_an_upper_limit_where_the_deviation_falls_to_the_end():
    fit = fitted(WhiteNoise(1.0))
    numbers = axis_numbers(fit)
    last = fit.wv.tau[-1]
    assert numbers.B.kind == "bound"
    assert numbers.tau == last
    assert 1.0 < numbers.B.upper / (1.0 / np.sqrt(last) / PLATEAU) < 1.1


def test_what_the_model_lacks_has_an_upper_limit():
    numbers = axis_numbers(fitted(WhiteNoise(1.0)))
    assert numbers.K.kind == "bound"
    assert 0.0 < numbers.K.upper < 0.02


def test_a_model_without_fast_terms_has_a_limit_of_N():
    numbers = axis_numbers(fitted(QuantizationNoise(1.0) + RandomWalk(0.5)))
    assert numbers.N.kind == "bound"
    assert 0.0 < numbers.N.upper < 0.2


def test_intervals_hold_the_truth_in_95_per_cent():
    """40 runs: 34 to 40 of them with a probability of 0.97."""
    truth = WhiteNoise(1.0) + GaussMarkov(8.0, 0.03) + RandomWalk(0.2)
    density = np.hypot(1.0, np.sqrt(2 * 0.03) * 8.0)
    inside = {"N": 0, "B": 0, "K": 0}
    for seed in range(40):
        fit = fitted(truth, seed, n=100_000)
        lowest = np.min(np.sqrt(2.0 * truth.haar_variance(fit.wv.tau, DT))) / PLATEAU
        for number, value in zip(axis_numbers(fit), (density, lowest, 0.2), strict=True):
            inside[number.key] += number.lower <= value <= number.upper
    assert min(inside.values()) >= 34, inside


def test_values_are_shown_in_units_of_data_sheets_and_of_SI():
    numbers = axis_numbers(fitted(WhiteNoise(0.2 * DEG_PER_SQRT_H) + RandomWalk(1e-6)))
    assert numbers.text("N").startswith("0.19")
    assert numbers.N.usual.unit == "deg/sqrt(h)"
    assert numbers.text("N", units="si").startswith("5.8")
    assert numbers.N.in_units("si").unit == "rad/s/sqrt(Hz)"
    with pytest.raises(gmwm.InputError, match="field, si"):
        numbers.text("N", units="deg")


@pytest.mark.parametrize(
    ("value", "lower", "upper", "text"),
    [
        (2.6612, 2.6512, 2.6712, "2.661 +-0.010"),
        (2.6612, 2.62, 2.70, "2.66 +-0.04"),
        (1690.0, 1290.0, 2090.0, "1,700 +-400"),
        (150.0, 40.0, 290.0, "150 (40 to 290)"),
        (5.0e-5, 4.98e-5, 5.02e-5, "5.00e-05 +-2e-07"),
        (2.0, 2.0, 2.0, "2"),
    ],
)
def test_an_error_has_the_digits_that_are_known(value, lower, upper, text):
    from gmwm._core.text import with_error

    assert with_error(value, lower, upper) == text
