"""Sensor states: tables over k samples against sums, and against simulated integrals."""

import numpy as np
import pytest

import gmwm
from gmwm import AR, ARIMA, GaussMarkov, RandomWalk, RateRamp, Resonance, Sinusoid, WhiteNoise
from gmwm.errors import InputError
from gmwm.ins import SensorModels
from gmwm.ins.filter.states import SensorStates
from marks import every

DT = 0.02
TERMS = [
    GaussMarkov(0.3, 0.05),
    GaussMarkov(0.3, 500.0),
    RandomWalk(0.2),
    RateRamp(-0.4),
    Resonance(0.5, 4.0, 0.05),
    Sinusoid(0.7, 3.0),
    gmwm.QuantizationNoise(0.01),
    AR([1.5, -0.7], 0.3),
    gmwm.ARMA([0.6], [0.3], 0.2),
    ARIMA([0.5], 1, [], 0.1),
]
IDS = [repr(term) for term in TERMS]


def states_of(term, k_max=12, bias=0.0, white=None, **options):
    model = term if white is None else term + WhiteNoise(white)
    models = {"gyro": WhiteNoise(1.0), "accel": WhiteNoise(1.0), "accel_y": model}
    return SensorStates.of(SensorModels.of(models, {"accel_y": bias}), DT, k_max, **options)


def matrices(states, k):
    """Transition, noise and cross-covariance of a table with one block of one or two states."""
    m = states.m
    Phi, Q = np.diag(states.table.phi[k]), np.diag(states.table.noise[k])
    if m == 2:
        Phi[0, 1], Phi[1, 0] = states.table.phi_off[k]
        Q[0, 1] = Q[1, 0] = states.table.noise_off[k, 0]
        assert states.table.noise_off[k, 0] == states.table.noise_off[k, 1]
    return Phi, Q


@pytest.mark.parametrize("term", TERMS, ids=IDS)
def test_tables_are_sums_over_samples(term):
    states, form = states_of(term, drift_known=True), term.state_space(DT)
    F, Q, h = form.transition, form.process_noise, form.output
    np.testing.assert_array_equal(states.covariance, form.initial_covariance)
    np.testing.assert_array_equal(states.mean, form.initial_mean)
    for k in (0, 1, 2, 7, 12):
        powers = [np.linalg.matrix_power(F, j) for j in range(k + 1)]
        Phi, noise = matrices(states, k)
        np.testing.assert_allclose(Phi, powers[k], atol=1e-13)
        gain = DT * sum((h @ powers[j] for j in range(k)), np.zeros(h.size))
        np.testing.assert_allclose(states.table.gain[k], gain, atol=1e-13)
        # The noise of sample i reaches the state at k by F^(k-1-i), and the integral by the sum of
        # the outputs at the samples i + 1 .. k - 1.
        total, cross, integral = np.zeros(F.shape), np.zeros(h.size), 0.0
        for i in range(k):
            late = powers[k - 1 - i]
            seen = DT * sum((h @ powers[j - i - 1] for j in range(i + 1, k)), np.zeros(h.size))
            total = total + late @ Q @ late.T
            cross = cross + late @ Q @ seen
            integral += seen @ Q @ seen
        np.testing.assert_allclose(noise, total, atol=1e-13)
        np.testing.assert_allclose(states.table.cross[k], cross, atol=1e-14)
        assert states.table.integral[k, 4] == pytest.approx(integral, abs=1e-15)


@pytest.mark.parametrize(
    "term", every(3, [t for t in TERMS if not isinstance(t, RateRamp)]), ids=repr
)
def test_the_integral_of_simulated_errors_has_the_variance_of_the_tables(term):
    k, draws, white = 9, 400, 0.05
    states = states_of(term, white=white)
    rng = np.random.default_rng(11)
    model = term + WhiteNoise(white)
    sums = np.array([DT * model.simulate(k, DT, rng).sum() for _ in range(draws)])
    gain = states.table.gain[k]
    expected = gain @ states.covariance @ gain + states.table.integral[k, 4]
    # A variance of n normal draws scatters by sqrt(2/n); those of a line and of steps by less.
    assert np.mean(sums**2) == pytest.approx(expected, rel=4.5 * np.sqrt(2.0 / draws))


def test_a_ramp_is_a_slope_that_is_not_known():
    """What a calibration saw is its size; which way it goes after switching on, nobody knows."""
    states = states_of(RateRamp(-0.4))
    assert not np.any(states.mean)
    np.testing.assert_allclose(states.covariance, np.diag([0.0, 0.16]))
    with_bias = states_of(RateRamp(-0.4), bias=3.0)
    assert with_bias.m == 2
    np.testing.assert_allclose(with_bias.covariance, np.diag([9.0, 0.16]))


def test_a_bias_joins_a_random_walk_or_stands_alone():
    walk = states_of(RandomWalk(0.2), bias=3.0)
    assert walk.names == ("accel_y: random walk",)
    assert walk.covariance[0, 0] == 9.0
    alone = states_of(GaussMarkov(0.3, 5.0), bias=3.0)
    assert alone.names == ("accel_y: Gauss-Markov", "accel_y: bias")
    np.testing.assert_array_equal(np.diag(alone.covariance), [0.09, 9.0])
    np.testing.assert_array_equal(alone.table.phi[:, 1], 1.0)
    np.testing.assert_array_equal(alone.table.noise[:, 1], 0.0)


def test_states_are_in_the_order_of_the_axes():
    models = {
        "gyro": WhiteNoise(1.0) + GaussMarkov(1.0, 3.0),
        "accel_x": WhiteNoise(1.0),
        "accel_y": Resonance(1.0, 2.0, 0.1) + GaussMarkov(1.0, 3.0) + WhiteNoise(1.0),
        "accel_z": RandomWalk(1.0),
    }
    states = SensorStates.of(SensorModels.of(models), DT, 3)
    assert states.table.axis.tolist() == [0, 1, 2, 4, 4, 4, 5]
    pair = [i for i, partner in enumerate(states.table.partner) if partner != i]
    assert [states.table.partner[i] for i in pair] == pair[::-1]
    assert all("resonance" in states.names[i] for i in pair)
    np.testing.assert_allclose(states.table.integral[:, 3], np.arange(4) * DT)


def test_extra_markov_states_touch_no_sensor():
    before = states_of(Resonance(0.5, 4.0, 0.05))
    after = states_of(Resonance(0.5, 4.0, 0.05), slow=(("north", 2.0, 7.0), ("down", 3.0, 7.0)))
    assert after.m == before.m + 2
    assert after.table.axis[-2:].tolist() == [-1, -1]
    assert after.table.partner.tolist() == [1, 0, 2, 3]
    for k in (0, 1, 12):
        decay = np.exp(-k * DT / 7.0)
        np.testing.assert_allclose(after.table.phi[k, -2:], decay)
        np.testing.assert_allclose(
            after.table.noise[k, -2:], [4.0 * (1 - decay**2), 9.0 * (1 - decay**2)]
        )
    assert not np.any(after.table.gain[:, -2:]) and not np.any(after.table.output[-2:])
    np.testing.assert_array_equal(after.covariance[-2:, -2:], np.diag([4.0, 9.0]))
    np.testing.assert_array_equal(after.table.phi[:, :2], before.table.phi)


@pytest.mark.parametrize(
    "term", [gmwm.BiasInstability(0.1), AR([0.5, 0.1, 0.1], 1.0), ARIMA([0.5], 1, [0.3], 0.7)]
)
def test_large_blocks_are_refused_with_a_mend(term):
    with pytest.raises(InputError, match=r"accel_y: .* states in a filter, more than two: approx"):
        states_of(term)


def test_states_of_equal_models_are_computed_once():
    """The faults of a log are looked for by a thousand filters with the same models."""
    model = GaussMarkov(0.3, 0.05)
    assert states_of(model) is states_of(GaussMarkov(0.3, 0.05))
    others = [states_of(model, bias=0.1), states_of(model, k_max=3), states_of(model, white=2.0)]
    assert all(other is not states_of(model) for other in others)
