"""Wavelet covariances of channels that are sampled together: what they share at each level.

The Haar MODWT coefficients W of two channels a, b at level j have the covariance nu_j^ab, estimated
by the mean of their product where both exist. By the polarization identity it is half of what the
wavelet variance of the sum of both exceeds the sum of their variances by, so that levels, gaps and
what missing samples add are those of `gmwm.wavelet_variance`.

For Gaussian noise with real cross-spectra, Isserlis' theorem gives

    cov(nu_j^ab, nu_k^cd) = sum_h c_jk(h) / (M_j M_k) (g^ac(h) g^bd(h) + g^ad(h) g^bc(h)),

see `gmwm.variance.covariance.haar`. Where the spectral matrix is a sum of parts Q_k s_k(f), these
are sums over pairs of parts of one form, which is found by polarization too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.process import PSD
from gmwm.readers import Channel, block_means
from gmwm.variance.covariance.haar import haar_covariance
from gmwm.variance.covariance.lags import block_density
from gmwm.variance.gaps import Runs
from gmwm.variance.levels import Levels, level_changes
from gmwm.variance.series import checked_samples


@dataclass(frozen=True, eq=False)
class WaveletCovariance:
    """Haar MODWT wavelet covariances of p channels, level by level.

    Attributes
    ----------
    names : tuple of str
    tau : (J,) ndarray
        Averaging times 2^(j-1) blocks, s.
    values : (J, p, p) ndarray
        Unbiased estimates; wavelet variances on the diagonal, in products of the channels' units.
    n : int
        Number of blocks, with missing ones.
    dt : float
        Sampling interval, s.
    block : int
        Samples per block; the levels are those of means over blocks.
    inflation : (J, J) ndarray
        Growth of the covariance of the estimates by gaps over that of a complete record.
    change : (J, p) ndarray
        What missing samples added to the variances, relative to them; it has been subtracted.
    """

    names: tuple[str, ...]
    tau: FloatArray
    values: FloatArray
    n: int
    dt: float
    block: int
    inflation: FloatArray
    change: FloatArray

    @property
    def correlation(self) -> FloatArray:
        """Correlation of the coefficients of a level, (J, p, p)."""
        deviation = np.sqrt(np.einsum("jaa->ja", self.values))
        return np.asarray(self.values / (deviation[:, :, None] * deviation[:, None, :]))

    @property
    def pairs(self) -> tuple[IntArray, IntArray]:
        """Channels a <= b of the P = p (p + 1) / 2 different elements of a level."""
        first, second = np.triu_indices(len(self.names))
        return first, second

    @property
    def vector(self) -> FloatArray:
        """The different elements, pair by pair, (P J,)."""
        first, second = self.pairs
        return self.values[:, first, second].T.ravel()

    def covariance_under(self, form: FloatArray, parts: FloatArray) -> FloatArray:
        """Covariance of `vector` for Gaussian noise of the spectral matrix sum_k Q_k s_k(f).

        Parameters
        ----------
        form : (K, K, J, J) ndarray
            `form` of the spectra s_k.
        parts : (K, p, p) ndarray
            The matrices Q_k, symmetric.

        Returns
        -------
        (P J, P J) ndarray
        """
        first, second = self.pairs
        size = (first.size, self.tau.size)
        total = np.zeros((*size, *size))
        for c, d in ((first, second), (second, first)):
            one = np.moveaxis(parts, 0, -1)[first[:, None], c]
            other = np.moveaxis(parts, 0, -1)[second[:, None], d]
            total += np.einsum("prk,prm,kmjl->pjrl", one, other, form)
        grown = np.sqrt((1.0 + self.change[:, first]) * (1.0 + self.change[:, second])).T.ravel()
        return np.asarray(total.reshape(grown.size, -1) * np.outer(grown, grown))

    def form(self, spectra: Sequence[PSD]) -> FloatArray:
        """Covariance of the covariances of two channels of spectra s_k and s_m, (K, K, J, J).

        The change by gaps is left out.
        """
        levels, size = slice(0, self.tau.size), len(spectra)

        def under(*parts: PSD) -> FloatArray:
            def density(f: FloatArray, dt: float) -> FloatArray:
                if self.block == 1:
                    return np.asarray(sum(part(f, dt) for part in parts))
                found = [block_density(part, self.dt, f * dt, self.block) for part in parts]
                return np.asarray(dt * sum(found))

            return haar_covariance(density, self.n, self.block * self.dt)[levels, levels]

        square = [under(each) for each in spectra]
        form = np.empty((size, size, self.tau.size, self.tau.size))
        for k in range(size):
            form[k, k] = 0.5 * square[k]
        for k, m in combinations(range(size), 2):
            apart = square[k] + square[m]
            form[k, m] = form[m, k] = 0.25 * (under(spectra[k], spectra[m]) - apart)
        return form * self.inflation


def wavelet_covariance(channels: Sequence[Channel], *, block: int = 1) -> WaveletCovariance:
    """Haar wavelet covariances of channels that are sampled together.

    Samples that one of them lacks are left out of all.

    Parameters
    ----------
    channels : sequence of Channel
        Two or more, of one sampling interval and number of samples.
    block : int, optional
        Samples whose means are taken first: for slow errors of long records. A mean of less than
        half of them counts as missing.

    Raises
    ------
    InputError
        If they do not belong together, or one has no wavelet variance.
    """
    if len(channels) < 2 or len({(each.dt, each.n) for each in channels}) > 1:
        raise InputError(
            "wavelet covariances need two channels or more of the same rate and length: give "
            "channels of one recording, or cut all to the same length"
        )
    block = checks.whole("block", block, 1, "give a number of samples")
    least = 0.5 - 0.25 / block  # exactly half of the samples are enough
    means = block_means([each.values for each in channels], block, least).T
    alike = [replace(c, values=m, dt=block * c.dt) for c, m in zip(channels, means, strict=True)]
    gone = np.logical_or.reduce([np.isnan(each.values) for each in alike])
    alike = [replace(c, values=np.where(gone, np.nan, c.values)) for c in alike]
    found = [checked_samples(channel) for channel in alike]
    runs: Runs = found[0][1]
    units = [float(np.nanstd(each.values)) for each in alike]
    series = [
        (channel.values - mean) / unit
        for channel, (_, _, mean), unit in zip(alike, found, units, strict=True)
    ]
    apart = np.logical_or.reduce([level_changes(each, runs) for each in series])

    def variances(values: FloatArray) -> tuple[Levels, FloatArray, FloatArray]:
        levels = Levels.of(values, runs, "haar", apart)
        moments, scarcity = levels.moments()
        added, change = levels.added(moments, scarcity)
        return levels, moments[:, 1] - added, change

    size = len(channels)
    values, changes = [], []
    for own in series:
        levels, variance, change = variances(own)
        values.append(variance)
        changes.append(change)
    matrix = np.empty((levels.averaging.size, size, size))
    for a in range(size):
        matrix[:, a, a] = values[a] * units[a] ** 2
    for a, b in combinations(range(size), 2):
        shared = 0.5 * (variances(series[a] + series[b])[1] - values[a] - values[b])
        matrix[:, a, b] = matrix[:, b, a] = shared * units[a] * units[b]
    gaps = levels.effects(np.zeros(levels.averaging.size))
    return WaveletCovariance(
        names=tuple(each.name for each in channels),
        tau=levels.averaging * alike[0].dt,
        values=matrix,
        n=runs.n,
        dt=channels[0].dt,
        block=block,
        inflation=np.ones((levels.averaging.size,) * 2) if gaps is None else gaps.inflation,
        change=np.stack(changes, axis=1),
    )
