"""Wavelet covariances of channels: expectation, Isserlis covariance, gaps, blocks."""

import numpy as np
import pytest

from gmwm import Channel, GaussMarkov, InputError, WhiteNoise, wavelet_covariance, wavelet_variance

PARTS = (WhiteNoise(1.0), GaussMarkov(1.0, 30.0))
MATRICES = np.array([[[1.0, 0.2], [0.2, 2.0]], [[0.5, -0.6], [-0.6, 1.0]]])


def channels(rng, n, dt=1.0, matrices=MATRICES, parts=PARTS):
    """Channels of which each part has a covariance matrix."""
    size = matrices.shape[1]
    values = sum(
        np.linalg.cholesky(matrix) @ np.stack([part.simulate(n, dt, rng) for _ in range(size)])
        for part, matrix in zip(parts, matrices, strict=True)
    )
    return [Channel(name, own, dt) for name, own in zip("abcdef", values, strict=False)]


def expected(data):
    curves = np.stack([part.haar_variance(data.tau, data.dt) for part in PARTS])
    first, second = data.pairs
    return np.einsum("kp,kj->pj", MATRICES[:, first, second], curves).ravel()


def test_the_diagonal_holds_the_wavelet_variances():
    own = channels(np.random.default_rng(1), 1000)
    found = wavelet_covariance(own)
    for k, channel in enumerate(own):
        alone = wavelet_variance(channel)
        np.testing.assert_allclose(found.tau, alone.tau)
        np.testing.assert_allclose(found.values[:, k, k], alone.variance, rtol=1e-9)


def test_elements_are_means_of_products_of_coefficients():
    own = channels(np.random.default_rng(2), 100)
    level = [np.convolve(c.values, [0.25, 0.25, -0.25, -0.25], "valid") for c in own]
    np.testing.assert_allclose(
        wavelet_covariance(own).values[1, 0, 1], np.mean(level[0] * level[1])
    )


@pytest.mark.parametrize("gaps", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_estimates_have_the_mean_and_covariance_that_they_are_said_to_have(gaps):
    rng, runs = np.random.default_rng(3), 150
    hidden = rng.random(1024) < 0.1
    found = []
    for _ in range(runs):
        own = channels(rng, 1024)
        if gaps:
            own[0].values[hidden] = np.nan
            own[1].values[500:510] = np.nan
        found.append(wavelet_covariance(own))
    data, vectors = found[0], np.array([each.vector for each in found])
    covariance = data.covariance_under(data.form([part.psd for part in PARTS]), MATRICES)
    error = np.mean(vectors, axis=0) - expected(data)
    assert np.max(np.abs(error) / np.sqrt(np.diag(covariance) / runs)) < 4.5
    # Of a variance from 150 runs 12 %; coarse levels have few degrees of freedom, and heavy tails.
    ratio = np.var(vectors, axis=0).reshape(3, -1) / np.diag(covariance).reshape(3, -1)
    assert np.all(np.abs(ratio[:, :6] - 1.0) < 0.5)
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.15)


def test_samples_missing_at_the_ends_shorten_the_record():
    own = channels(np.random.default_rng(6), 600)
    inside = wavelet_covariance([Channel(c.name, c.values[50:550], c.dt) for c in own])
    own[0].values[:50] = own[1].values[550:] = np.nan
    found = wavelet_covariance(own)
    np.testing.assert_allclose(found.values, inside.values[: found.tau.size], rtol=1e-9)


def test_levels_of_block_means_are_those_of_the_samples_at_their_averaging_times():
    own = channels(np.random.default_rng(4), 40_000, matrices=MATRICES * [[[1]], [[100]]])
    fine, coarse = wavelet_covariance(own), wavelet_covariance(own, block=4)
    np.testing.assert_allclose(coarse.tau, fine.tau[2:])
    np.testing.assert_allclose(coarse.correlation[:7], fine.correlation[2:9], atol=0.05)
    form = [each.form([part.psd for part in PARTS]) for each in (fine, coarse)]
    sd = [np.sqrt(each.covariance_under(f, MATRICES).diagonal()) for each, f in
          zip((fine, coarse), form, strict=True)]  # fmt: skip
    ratio = sd[1].reshape(3, -1) / sd[0].reshape(3, -1)[:, 2:]
    assert np.all((ratio > 0.97) & (ratio < 1.4)) and np.all(ratio[:, 3:] < 1.03)


def test_half_of_a_block_is_enough_for_its_mean():
    own = channels(np.random.default_rng(5), 400)
    for each in own:
        each.values[[40, 141, 243]] = np.nan
    np.testing.assert_array_equal(wavelet_covariance(own, block=2).change, 0.0)


@pytest.mark.parametrize(
    "own",
    [
        [Channel("a", np.arange(64.0) % 3, 1.0)],
        [Channel("a", np.arange(64.0) % 3, 1.0), Channel("b", np.arange(65.0) % 3, 1.0)],
        [Channel("a", np.arange(64.0) % 3, 1.0), Channel("b", np.arange(64.0) % 5, 2.0)],
    ],
)
def test_channels_that_do_not_belong_together_are_rejected(own):
    with pytest.raises(InputError, match="the same rate and length"):
        wavelet_covariance(own)
