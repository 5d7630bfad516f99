"""Kalman filter and smoother against dense Gaussian algebra."""

import numpy as np
import pytest
from scipy.linalg import solve_triangular

import gmwm
from gmwm import AR, MA, GaussMarkov, QuantizationNoise, RandomWalk, Resonance, Sinusoid, WhiteNoise
from gmwm.estimate.likelihood.kalman import Space, smooth, whiten
from gmwm.process import as_model

MODELS = [
    GaussMarkov(0.5, 20.0),
    WhiteNoise(0.2) + GaussMarkov(0.5, 7.0) + RandomWalk(0.1),
    as_model(QuantizationNoise(0.7)),
    QuantizationNoise(0.7) + GaussMarkov(0.3, 5.0),
    AR([1.5, -0.7], 0.3),
    MA([-0.9, 0.3], 0.2),
    gmwm.ARIMA([0.5], 1, [0.3], 0.7) + WhiteNoise(0.4),
    Resonance(0.4, 0.05, 0.1),
    Resonance(0.4, 0.2, 0.05) + WhiteNoise(0.1),
    WhiteNoise(0.3) + Sinusoid(1.0, 0.03),
    as_model(WhiteNoise(0.3)),
]
GAPS = {
    "none": [],
    "first": [0],
    "first three": [0, 1, 2],
    "last": [29],
    "some": [4, 5, 6, 11, 20],
    "both ends": [0, 1, 13, 28, 29],
    "every other": list(range(1, 30, 2)),
}
N = 30

models = pytest.mark.parametrize("model", MODELS, ids=repr)


def arguments(space):
    return Space(
        space.transition,
        space.process_noise,
        space.output,
        space.measurement_noise,
        space.initial_covariance,
    )


def state_covariance(space, n):
    """Covariance of all states, (n p, n p), term by term."""
    p = space.n_states
    total = np.zeros((n, p, n, p))
    diagonal = space.initial_covariance
    for k in range(n):
        block = diagonal
        for later in range(k, n):
            total[later, :, k, :] = block
            total[k, :, later, :] = block.T
            block = space.transition @ block
        diagonal = space.transition @ diagonal @ space.transition.T + space.process_noise
    return total.reshape(n * p, n * p)


def sample_covariance(space, n):
    read = np.kron(np.eye(n), space.output)
    return read @ state_covariance(space, n) @ read.T + space.measurement_noise * np.eye(n)


def columns(n, gap, seed=1):
    """A series with missing samples beside a constant and a ramp."""
    y = np.random.default_rng(seed).normal(size=n)
    y[gap] = np.nan
    return np.column_stack([y, np.ones(n), np.linspace(-1.0, 1.0, n)])


@models
def test_whitening_is_the_inverse_of_the_cholesky_factor(model):
    space = model.state_space(1.0)
    whole = sample_covariance(space, N)
    for gap in GAPS.values():
        y = columns(N, gap)
        present = ~np.isnan(y[:, 0])
        root = np.linalg.cholesky(whole[np.ix_(present, present)])
        innovations, log_variance, count = whiten(arguments(space), y)
        assert count == np.sum(present)
        assert np.all(innovations[~present] == 0.0)
        expected = solve_triangular(root, y[present], lower=True)
        np.testing.assert_allclose(innovations[present], expected, rtol=1e-8, atol=1e-9)
        assert log_variance == pytest.approx(2.0 * np.sum(np.log(np.diag(root))), abs=1e-9)


@models
@pytest.mark.parametrize("gap", ["none", "both ends", "every other"])
def test_smoothing_is_conditioning_on_all_samples(model, gap):
    space = model.state_space(1.0)
    p = space.n_states
    y = columns(N, GAPS[gap])
    rng = np.random.default_rng(2)
    starts, inputs = rng.normal(size=(3, p)), 0.1 * rng.normal(size=(3, p))
    present = ~np.isnan(y[:, 0])
    mean = np.empty((N, 3, p))
    mean[0] = starts
    for k in range(N - 1):
        mean[k + 1] = mean[k] @ space.transition.T + inputs
    prior = state_covariance(space, N)
    read = np.kron(np.eye(N), space.output)[present]
    of_samples = sample_covariance(space, N)[np.ix_(present, present)]
    gain = np.linalg.solve(of_samples, read @ prior).T
    posterior = (prior - gain @ read @ prior).reshape(N, p, N, p)
    states, covariance, lagged, innovations, variances = smooth(arguments(space), y, starts, inputs)
    np.testing.assert_array_equal(np.isfinite(variances), present)
    scale = max(float(np.max(np.abs(prior), initial=0.0)), 1.0)
    for c in range(3):
        expected = mean[:, c].ravel() + gain @ (y[present, c] - read @ mean[:, c].ravel())
        np.testing.assert_allclose(states[:, c].ravel(), expected, rtol=1e-8, atol=1e-8)
    for k in range(N):
        np.testing.assert_allclose(covariance[k], posterior[k, :, k], atol=1e-9 * scale)
        if k < N - 1:
            np.testing.assert_allclose(lagged[k], posterior[k + 1, :, k], atol=1e-9 * scale)
    root = np.linalg.cholesky(of_samples)
    np.testing.assert_allclose(variances[present], np.diag(root) ** 2, rtol=1e-9)
    np.testing.assert_allclose(
        innovations[present, 0] / np.sqrt(variances[present]),
        solve_triangular(root, y[present, 0] - read @ mean[:, 0].ravel(), lower=True),
        rtol=1e-8,
        atol=1e-9,
    )


LONG = 5000


def full_recursion(space, y):
    """Innovations and log-determinant with the gain renewed at every sample."""
    zero = np.zeros((y.shape[1], space.n_states))
    _, _, _, innovations, variances = smooth(arguments(space), y, zero, zero)
    present = np.isfinite(variances)
    whitened = np.zeros_like(innovations)
    whitened[present] = innovations[present] / np.sqrt(variances[present])[:, None]
    return whitened, float(np.sum(np.log(variances[present]))), int(np.sum(present))


@pytest.mark.parametrize(
    "model",
    [
        *MODELS[:10],
        WhiteNoise(1.0) + RandomWalk(1e-4),
        WhiteNoise(1.0) + GaussMarkov(0.1, 1e5) + RandomWalk(1e-5),
        AR([1.98, -0.9801], 1.0) + WhiteNoise(0.1),
        as_model(Resonance(1.0, 1e-4, 0.3)) + WhiteNoise(1.0),
    ],
    ids=repr,
)
def test_a_settled_gain_is_as_good_as_a_new_one(model):
    space = model.state_space(1.0)
    for gap in ((0, 0), (3000, 3001), (3000, 3700), (0, 10), (4900, 5000)):
        y = columns(LONG, slice(*gap), seed=4)
        innovations, log_variance, count = whiten(arguments(space), y)
        expected, expected_log_variance, expected_count = full_recursion(space, y)
        assert count == expected_count
        # A prediction that settles slowly is held while it still moves by up to 1e-13 a sample.
        np.testing.assert_allclose(innovations, expected, rtol=1e-6, atol=1e-6)
        assert log_variance == pytest.approx(expected_log_variance, abs=1e-6)


def test_a_gap_that_begins_at_a_settled_gain_is_seen():
    """The samples after a gap weigh more: the gain must not stay as it was."""
    space = (WhiteNoise(1.0) + RandomWalk(0.3)).state_space(1.0)
    y = columns(LONG, slice(3000, 3700), seed=5)[:, :1].copy()
    y[3700] = 10.0
    innovations = whiten(arguments(space), y)[0][:, 0]
    # After 701 steps the prediction is off by 0.3 sqrt(701) = 7.9 beside the noise of 1.
    assert abs(innovations[3700]) == pytest.approx(10.0 / np.hypot(7.9, 1.0), rel=0.15)
    # The next prediction starts from the sample that ended the gap.
    assert innovations[3701] < -5.0
