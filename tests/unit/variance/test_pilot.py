"""The spectrum that has given wavelet variances, and means over several recordings."""

import numpy as np
import pytest

from gmwm import RandomWalk, WhiteNoise, wavelet_variance
from gmwm.process.spectral import haar_variance
from gmwm.variance import PooledVariance
from gmwm.variance.levels import pilot_psd

DT, M = 0.01, 2.0 ** np.arange(14)


@pytest.mark.parametrize(
    "process", [WhiteNoise(0.3), RandomWalk(2.0), WhiteNoise(0.3) + RandomWalk(2.0)]
)
def test_its_variances_are_those_given_and_its_level_that_of_the_process(process):
    variance = process.haar_variance(DT * M, DT)
    psd = pilot_psd(variance, M, DT)
    np.testing.assert_allclose(haar_variance(psd, DT * M, DT), variance, rtol=0.03)
    f = np.geomspace(0.3 / (DT * M[-1]), 0.2 / DT, 20)
    np.testing.assert_allclose(psd(f, DT), process.psd(f, DT), rtol=0.3)


def test_several_recordings_count_by_their_degrees_of_freedom():
    rng = np.random.default_rng(1)
    parts = [wavelet_variance(rng.normal(size=n), dt=1.0) for n in (1000, 5000, 300)]
    pooled = PooledVariance.of(parts)
    assert pooled.n_all == 6300
    np.testing.assert_allclose(np.sum(pooled.shares, axis=0), 1.0)
    for j in range(pooled.tau.size):
        there = [part for part in parts if part.tau.size > j]
        weight = np.array([part.dof[j] for part in there])
        expected = weight @ [part.variance[j] for part in there] / np.sum(weight)
        assert pooled.variance[j] == pytest.approx(expected)
        assert pooled.counts[j] == sum(part.counts[j] for part in there)
    psd = WhiteNoise(1.0).psd
    whole = pooled.covariance_under(psd)
    alone = [part.covariance_under(psd) for part in parts]
    share = pooled.shares[:, 0]
    assert whole[0, 0] == pytest.approx(
        sum(w**2 * each[0, 0] for w, each in zip(share, alone, strict=True))
    )
    last = pooled.tau.size - 1
    assert whole[last, last] == pytest.approx(alone[1][last, last])
