"""State spaces put together, and series made of them or of a spectrum."""

import numpy as np
import pytest

from gmwm import GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, Resonance, WhiteNoise
from gmwm.process import spectral, state_space
from gmwm.process.state_space import StateSpace, block_diagonal

PARTS = [
    process.state_space(0.5)
    for process in (
        WhiteNoise(2.0), GaussMarkov(1.0, 3.0), Resonance(0.5, 0.2, 0.1), GaussMarkov(2.0, 9.0),
        RateRamp(0.3), QuantizationNoise(0.1),
    )
]  # fmt: skip


def test_blocks_stand_on_the_diagonal():
    one, two = np.array([[1.0]]), np.array([[2.0, 3.0], [4.0, 5.0]])
    np.testing.assert_array_equal(
        block_diagonal([one, np.zeros((0, 0)), two]), [[1, 0, 0], [0, 2, 3], [0, 4, 5]]
    )
    assert block_diagonal([]).shape == (0, 0)


def test_a_sum_has_the_states_and_the_variance_of_its_parts():
    whole = StateSpace.stack(PARTS)
    assert whole.n_states == sum(part.n_states for part in PARTS)
    assert whole.measurement_noise == sum(part.measurement_noise for part in PARTS)
    np.testing.assert_allclose(
        whole.output_variance(7), sum(part.output_variance(7) for part in PARTS)
    )
    twice = [name for name in whole.names if name.startswith("Gauss-Markov")]
    assert twice == ["Gauss-Markov 1", "Gauss-Markov 2"]
    assert whole.names[1] == "resonance" and len(set(whole.names)) == whole.n_states


def test_the_output_variance_is_that_of_the_recursion():
    walk = RandomWalk(2.0).state_space(0.25)
    np.testing.assert_allclose(walk.output_variance(4), [0.0, 1.0, 2.0, 3.0])
    form = StateSpace.scalar("x", 0.5, 3.0, 8.0)
    np.testing.assert_allclose(form.output_variance(3), [8.0, 5.0, 4.25])
    np.testing.assert_allclose(StateSpace.white(1.5).output_variance(2), 1.5)


def test_a_series_is_that_of_its_recursion_in_any_block(monkeypatch):
    form = StateSpace.stack([*PARTS[1:4]])
    series = state_space.from_state_space(form, 50, np.random.default_rng(1))
    rng = np.random.default_rng(1)
    root = state_space._root(form.process_noise)
    np.testing.assert_allclose(root @ root.T, form.process_noise, atol=1e-12)
    state = state_space._root(form.initial_covariance) @ rng.standard_normal(form.n_states)
    noise = rng.standard_normal((50, form.n_states))
    for k in range(50):
        assert series[k] == pytest.approx(form.output @ state)
        state = form.transition @ state + root @ noise[k]
    monkeypatch.setattr(state_space, "_BLOCK", 7)
    again = state_space.from_state_space(form, 50, np.random.default_rng(1))
    np.testing.assert_allclose(again, series)


def test_a_first_order_recursion_starts_with_its_own_scale():
    innovation = np.array([2.0, 1.0, -1.0])
    state_space.first_order(innovation, 0.5, 3.0, 10.0)
    np.testing.assert_allclose(innovation, [20.0, 13.0, 3.5])


def test_a_ramp_begins_at_zero_and_measurement_noise_is_added():
    ramp = state_space.from_state_space(RateRamp(0.3).state_space(0.5), 4, np.random.default_rng(1))
    np.testing.assert_allclose(ramp, 0.15 * np.arange(4))
    white = state_space.from_state_space(StateSpace.white(9.0), 20_000, np.random.default_rng(2))
    assert np.std(white) == pytest.approx(3.0, rel=0.02)


@pytest.mark.parametrize("process", [WhiteNoise(2.0), GaussMarkov(1.0, 3.0), RandomWalk(2.0)])
def test_a_series_of_a_spectrum_has_its_covariances(process):
    rng, n = np.random.default_rng(3), 64
    series = np.array([spectral.from_psd(process.psd, n, 0.5, rng) for _ in range(1500)])
    if isinstance(process, RandomWalk):
        np.testing.assert_array_equal(series[:, 0], 0.0)
        expected = 4.0 * 0.5 * np.array([10, 30, 60])
        np.testing.assert_allclose(np.var(series[:, [10, 30, 60]], axis=0), expected, rtol=0.15)
        return
    expected = process.autocovariance(np.array([0, 1, 5]), 0.5)
    found = [np.mean(series[:, : n - lag] * series[:, lag:]) for lag in (0, 1, 5)]
    np.testing.assert_allclose(found, expected, atol=0.03 * expected[0])


def test_eigenvalues_of_a_circle_are_the_power_of_its_series():
    spectrum = np.array([4.0, 0.0, 9.0, 0.0, 0.0])
    rng = np.random.default_rng(4)
    power = np.zeros(5)
    for _ in range(1500):
        power += np.abs(np.fft.rfft(spectral.circulant(spectrum, 8, rng))) ** 2 / 8 / 1500
    np.testing.assert_allclose(power, spectrum, rtol=0.12, atol=1e-20)


@pytest.mark.parametrize(("slope", "is_bounded"), [(0.05, True), (0.1, False)])
def test_a_spectrum_that_grows_without_bound_starts_at_zero(slope, is_bounded):
    x = spectral.from_psd(lambda f, dt: f**-slope, 64, 1.0, np.random.default_rng(1))
    assert bool(x[0]) is is_bounded


def test_state_spaces_can_be_compared():
    """It ended in an error of numpy: arrays have no one answer."""
    form = RandomWalk(2.0).state_space(0.25)
    assert form == form
    assert form != RandomWalk(2.0).state_space(0.25)
