"""Sensor numbers: N, B and K of known models, their intervals, and how they are shown."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, Model, Process, QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.calibration import PLATEAU, axis_numbers, fast_density, upper_limit
from gmwm.issues import notice
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
        (WhiteNoise(2.0) + QuantizationNoise(0.02) + gmwm.Sinusoid(0.3, 5.0), 2.0),
        (gmwm.LowPassNoise(2.0, 20.0, 2, 0.7), 2.0),
        (WhiteNoise(1.0) + gmwm.LowPassNoise(2.0, 20.0, 2, 0.7), np.hypot(1.0, 2.0)),
    ],
)
def test_N_is_the_density_of_all_that_averages_out(model, density):
    assert density_of(model) == pytest.approx(density, rel=0.02)


def test_a_resonance_counts_with_the_foot_of_its_spectrum():
    resonance = gmwm.Resonance(3.0, 20.0, 0.1)
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
    model = WhiteNoise(0.1) + gmwm.BiasInstability(1.0) + RandomWalk(1e-3)
    numbers = axis_numbers(fitted(model, free=["B"], n=1_000_000))
    assert numbers.B.value == pytest.approx(1.0, rel=0.15)


def test_B_is_an_upper_limit_where_the_deviation_falls_to_the_end():
    fit = fitted(WhiteNoise(1.0))
    numbers = axis_numbers(fit)
    assert numbers.B.kind == "bound"
    white = 1.0 / np.sqrt(numbers.tau)
    walk = numbers.K.upper * np.sqrt(numbers.tau / 3.0)
    assert white < numbers.B.upper * PLATEAU < 1.1 * np.hypot(white, walk)


def test_numbers_without_a_standard_error_print():
    B = axis_numbers(fitted(WhiteNoise(2.0) + RandomWalk(0.5))).B
    assert B.kind == "estimated" and B.stderr is None
    assert str(B).startswith("B  ") and " .. " in str(B)


def test_K_is_a_limit_where_a_model_that_fits_equally_well_has_no_walk():
    """Of flicker noise the chosen walk's interval held the truth in 0 of 17 records."""
    fit = fitted(WhiteNoise(1.0) + RandomWalk(0.05))
    alone = axis_numbers(fit).K
    without = WhiteNoise(1.0) + gmwm.BiasInstability(0.5)
    larger = WhiteNoise(1.0) + RandomWalk(2.0 * alone.upper)
    found = axis_numbers(fit, [without, larger]).K
    assert (found.kind, found.value, found.upper) == ("bound", 0.0, 2.0 * alone.upper)
    found = axis_numbers(fit, [larger]).K
    assert (found.kind, found.value) == ("estimated", alone.value)
    assert (found.lower, found.upper) == (alone.lower, 2.0 * alone.upper)
    slope = replace(fit, notices=(notice("ramp-or-walk", "", {}, ramp="R", slow="K"),))
    found = axis_numbers(slope).K
    assert (found.kind, found.upper) == ("bound", alone.upper)


def test_what_the_model_lacks_has_an_upper_limit():
    numbers = axis_numbers(fitted(WhiteNoise(1.0)))
    assert numbers.K.kind == "bound"
    assert 0.0 < numbers.K.upper < 0.02


def test_a_model_without_fast_terms_has_a_limit_of_N():
    numbers = axis_numbers(fitted(QuantizationNoise(1.0) + RandomWalk(0.5)))
    assert numbers.N.kind == "bound"
    assert 0.0 < numbers.N.upper < 0.2


def test_intervals_hold_the_truth_in_95_per_cent():
    """24 runs: 20 to 24 of them with a probability of 0.99."""
    truth = WhiteNoise(1.0) + GaussMarkov(8.0, 0.03) + RandomWalk(0.2)
    density = np.hypot(1.0, np.sqrt(2 * 0.03) * 8.0)
    inside = {"N": 0, "B": 0, "K": 0}
    for seed in range(24):
        fit = fitted(truth, seed, n=100_000)
        lowest = np.min(np.sqrt(2.0 * truth.haar_variance(fit.wv.tau, DT))) / PLATEAU
        for number, value in zip(axis_numbers(fit), (density, lowest, 0.2), strict=True):
            inside[number.key] += number.lower <= value <= number.upper
    assert min(inside.values()) >= 20, inside


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


@pytest.mark.parametrize("dt", [0.001, 0.01, 1.0, 10.0])
def test_density_of_white_noise_whatever_the_sampling_interval(dt):
    assert fast_density(Model((WhiteNoise(3e-4),)), dt) == pytest.approx(9e-8, rel=1e-9)


@pytest.mark.parametrize(
    "slow", [RandomWalk(1.0), gmwm.RateRamp(1.0), GaussMarkov(1.0, 1e4), gmwm.BiasInstability(1.0)]
)
def test_slow_terms_have_no_density(slow):
    assert fast_density(Model((slow,)), DT) == 0.0


def test_no_B_lies_below_the_data():
    """A model without the walk that the data have: its deviation goes on falling."""
    x = (WhiteNoise(1e-3) + RandomWalk(1e-4)).simulate(50_000, 0.1, 1)
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), Channel("gyro_x", x, 0.1, "gyro", "rad/s"))
    white = Model((WhiteNoise(1e-3),))
    blind = replace(fit, model=white, keys=(), covariance=np.zeros((0, 0)))
    numbers = axis_numbers(blind)
    at = int(np.searchsorted(fit.wv.tau, numbers.tau))
    lowest = numbers.B.upper * PLATEAU
    assert lowest > 5.0 * np.sqrt(2.0 * blind.implied[-1])
    assert lowest >= np.sqrt(2.0 * fit.wv.lower[at]) * (1.0 - 1e-12)


def test_the_limit_of_K_holds_and_is_a_number():
    """24 records with a K = 0.001 too small to be seen: 21 or more with a probability of 0.97."""
    truth = WhiteNoise(1.0) + RandomWalk(0.001)
    limits = [
        upper_limit(gmwm.fit(WhiteNoise(), truth.simulate(4000, 1.0, seed), dt=1.0), "K")
        for seed in range(24)
    ]
    assert sum(limit >= 0.001 for limit in limits) >= 21
    assert np.all(np.isfinite(limits))
