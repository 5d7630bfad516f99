"""Covariance of the wavelet variance estimates of a Gaussian process, from its spectrum.

For two levels j, k with M_j, M_k coefficients W free of end effects,

    cov(nu2_j, nu2_k) = 2 / (M_j M_k) sum_h c_jk(h) g_jk(h)^2,

where g_jk is the cross-covariance of W_j and W_k at lag h and c_jk(h) the number of pairs at that
lag (Percival 1995, *Biometrika* 82, 619-631; Serroukh, Walden & Percival 2000, *JASA* 95, 184-196):
a spectral integral, multiplied for coarse levels by a ratio of sums over lags by FFT; see
docs/derivations.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from gmwm._core import checks
from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray
from gmwm.process import PSD, Panels, evaluated, in_hertz, quadrature, resolved_share, wavelet
from gmwm.variance.covariance.lags import LagGrid, block_of, block_spectrum


@compiled(fastmath={"reassoc", "contract"})
def lag_sums(
    once: FloatArray, averaging: IntArray, zero: FloatArray, counts: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sums over the lags of covariances and their squares, for each pair of levels, (L, L).

    The gain of a Haar filter over its phase is (1 - cos(2 pi m f)) / (2 m sin(pi f)), so that a
    covariance is a second difference over the averaging time m of the coarser level.

    once: (L, size), covariances by lag of a level with that of which it is the second difference,
        one period.
    averaging: (L,) of int, averaging times, rising, in lags.
    zero: (L, L), what the bin at zero frequency adds, which no difference shows.
    counts: (L, L, H), weights of the lags from zero on, of those that there are.
    weights: (H,), of all of them.
    Returns: mean (L, L), sum of covariances times counts; above the diagonal, as are the others;
        square, whole (L, L), sums of their squares, times counts and times weights.
    """
    levels, size = once.shape
    lags, longest = weights.size, averaging[-1]
    shape = (levels, levels)
    mean, square, whole = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    around = np.empty(lags + 2 * longest)
    middle = around[longest : longest + lags]
    for j in range(levels):
        at = -longest % size
        for h in range(around.size):
            around[h] = once[j, at]
            at = at + 1 if at + 1 < size else 0
        for k in range(j, levels):
            m = averaging[k]
            # Slices: an index that might be negative is looked at before each use.
            later = around[longest + m : longest + m + lags]
            earlier = around[longest - m : longest - m + lags]
            scale, own = 0.5 / m, counts[j, k]
            plain, squared, total = 0.0, 0.0, 0.0
            for h in range(lags):
                value = scale * (middle[h] - 0.5 * (later[h] + earlier[h])) + zero[j, k]
                plain += own[h] * value
                squared += own[h] * value * value
                total += weights[h] * value * value
            mean[j, k], square[j, k], whole[j, k] = plain, squared, total
    return mean, square, whole


# Mean of sin^4(x) sin^4(s x) over x, less the square of the mean of sin^4(x), for s = 1 and 2.
_MEAN_PRODUCT_EXCESS = {1: 35.0 / 128.0 - 9.0 / 64.0, 2: 7.0 / 64.0 - 9.0 / 64.0}


def haar_counts(n: int, m: FloatArray) -> FloatArray:
    """Number of Haar coefficients free of end effects: n - 2 m + 1."""
    return n - 2.0 * np.asarray(m, dtype=float) + 1.0


def dyadic_levels(n: int) -> FloatArray:
    """Averaging times 1, 2, 4, ... in samples with at least one coefficient."""
    return np.exp2(np.arange(int(n).bit_length() - 1, dtype=float))


def _tent_sum(distance: FloatArray, block: int) -> FloatArray:
    """Sum of a kink of unit slope under a tent: (y^3 - y)/(6 b) with y = b - |x|."""
    y = np.maximum(block - np.abs(distance), 0.0)
    return np.asarray((y**3 - y) / (6.0 * block))


def centred_pairs(first: float, second: float, x: FloatArray, block: int) -> FloatArray:
    """Number of pairs of coefficients whose centres are about ``x`` samples apart.

    The number for ``first`` and ``second`` coefficients is a trapezoid in the lag. The pairs at
    lags between multiples of ``block`` are divided linearly between the neighbours.
    """
    outer, inner = 0.5 * (first + second), 0.5 * abs(first - second)
    pairs = block * np.clip(outer - np.abs(x), 0.0, min(first, second))
    pairs += _tent_sum(x - outer, block) + _tent_sum(x + outer, block)
    pairs -= _tent_sum(x - inner, block) + _tent_sum(x + inner, block)
    return np.asarray(pairs)


@dataclass(frozen=True, eq=False)
class _LagSums:
    """What the sums over lags of the coarse levels need, without the spectrum.

    first: The finest of the coarse levels.
    averaging: (L,) of int, averaging times, blocks.
    slopes: (L, F), gains over their phases and the sine of the frequency; 0 at frequency zero.
    at_zero: (L,), gains over their phases at frequency zero.
    weights: (H,), 2 for lags that stand for their negative too, else 1.
    counts: (L, L, H), share of the pairs of coefficients that exist at each lag, times
        ``weights``.
    """

    first: int
    grid: LagGrid
    averaging: npt.NDArray[np.intp]
    slopes: FloatArray
    at_zero: FloatArray
    weights: FloatArray
    counts: FloatArray

    def of(self, spectrum: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Sums over the lags for a spectrum of block means, as `lag_sums` has them, (L, L)."""
        base = self.slopes * spectrum
        zero = np.outer(self.at_zero, self.at_zero * (spectrum[0] / self.grid.size))
        once = self.grid.transform(base)
        found = lag_sums(once, self.averaging, zero, self.counts, self.weights)
        return found[0], found[1], found[2]


@lru_cache(maxsize=16)  # recordings that are fitted jointly; 3 MB each
def _lag_sums(n: int, averaging: tuple[float, ...] = ()) -> _LagSums:
    """Set-up of the sums over lags, on means of blocks of samples; averaging times are rounded."""
    m = np.array(averaging) if averaging else dyadic_levels(n)
    block, shortest = block_of(n)
    first = int(np.searchsorted(m, shortest))
    grid = LagGrid.holding(3 * n / block, block)
    available = haar_counts(n, m[first:])
    lag = (block * np.arange(grid.size // 2 + 1)).astype(float)
    weights = np.full(lag.size, 2.0)
    weights[[0, -1]] = 1.0
    counts = np.empty((available.size, available.size, lag.size))
    for j, own in enumerate(available):
        for k, other in enumerate(available[: j + 1]):
            pairs = centred_pairs(own, other, lag, block) / (block * min(own, other))
            counts[j, k] = counts[k, j] = pairs
    steps = (m[first:] // block).astype(np.intp)
    sine, scaled = np.sin(np.pi * grid.frequency), steps[:, None]
    amplitude = np.sin(np.pi * scaled * grid.frequency) ** 2 / (scaled * sine)
    slopes = amplitude / sine
    slopes[:, 0] = 0.0
    return _LagSums(first, grid, steps, slopes, amplitude[:, 0].copy(), weights, weights * counts)


def _end_effects(psd: PSD, dt: float, sums: _LagSums) -> FloatArray:
    """Sum over the lags that occur, relative to the sum over all lags, for the coarse levels."""
    _, square, whole = sums.of(block_spectrum(psd, dt, sums.grid))
    ratio = np.ones_like(square)
    above = np.triu_indices_from(ratio)
    own, of_all = square[above], whole[above]
    own = np.divide(own, of_all, out=np.ones_like(own), where=of_all > 0.0)  # 1 without any noise
    ratio[above] = ratio.T[above] = own
    return ratio


def _excess(
    averaging: tuple[float, ...], frequency: FloatArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Quadrature corrections for replaced lobes: rows, columns, and weights at the nodes.

    Where lobes were replaced by their mean, the mean of a product of two gains is not the product
    of the means if the averaging times are equal or differ by a factor of two.
    """
    m = np.array(averaging)
    rows, columns, weights = [], [], []
    resolved = [resolved_share(each, frequency) for each in averaging]
    for ratio, excess in _MEAN_PRODUCT_EXCESS.items():
        for j, k in np.argwhere(m == ratio * m[:, None]).tolist():
            averaged = 1.0 - resolved[j] * resolved[k]
            if np.any(averaged > 0.0):
                rows.append(j)
                columns.append(k)
                scale = excess / (m[j] * m[k]) ** 2
                weights.append(scale * averaged / np.sin(np.pi * frequency) ** 4)
    found = np.array(weights).reshape(-1, frequency.size)
    return np.array(rows, dtype=int), np.array(columns, dtype=int), found


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Weights of the integrals of products of two gains against the square of a spectrum.

    starts: (P,), first node of each panel.
    frequency: (P * 12,), points of the panels, cycles per sample.
    weight: (pairs, P, 12).
    first, second: (pairs,), levels.
    """

    starts: IntArray
    frequency: FloatArray
    weight: FloatArray
    first: IntArray
    second: IntArray


@lru_cache(maxsize=4)
def _pairs(averaging: tuple[float, ...]) -> _Pairs:
    grid = quadrature(averaging)
    panels = Panels.of(np.log(np.tan(np.pi * grid.frequency)))
    first, second = np.triu_indices(len(averaging))
    weighted = grid.weight * grid.gain
    weight = np.concatenate(
        [panels.gathered(own * weighted[j:]) for j, own in enumerate(grid.gain)]
    )
    rows, columns, excess = _excess(averaging, grid.frequency)
    place = np.zeros((len(averaging), len(averaging)), dtype=int)
    place[first, second] = np.arange(first.size)
    weight[place[rows, columns]] += panels.gathered(grid.weight * excess)
    frequency = np.arctan(np.exp(panels.points.ravel())) / np.pi
    frequency.flags.writeable = False  # what spectra make of them is kept
    return _Pairs(panels.starts, frequency, weight, first, second)


def integrals(psd: PSD, dt: float, m: FloatArray) -> FloatArray:
    """2 int |H_j|^2 |H_k|^2 S^2 df over all frequencies, (J, J), in u^4.

    Where S^2 is a polynomial on a panel of nodes, the weights of a few points hold the lobes of the
    gains; other panels, about a narrow resonance or a kink, are summed node by node.
    """
    averaging = tuple(m.tolist())
    pairs = _pairs(averaging)
    square = (evaluated(psd, in_hertz(pairs.frequency, dt), dt) / dt) ** 2
    square = square.reshape(pairs.weight.shape[1:])
    smooth = Panels.are_smooth(square)
    square[~smooth] = 0.0
    integral = np.empty((m.size, m.size))
    values = pairs.weight.reshape(pairs.first.size, -1) @ square.ravel()
    integral[pairs.first, pairs.second] = integral[pairs.second, pairs.first] = values
    if not np.all(smooth):
        integral += _node_by_node(psd, dt, averaging, ~smooth)
    return 4.0 * integral


@lru_cache(maxsize=2)  # the spectra of a search are rough in the same places; 2 MB each
def _nodes_of(averaging: tuple[float, ...], panels: bytes) -> tuple[Any, ...]:
    """Frequencies, weights and gains of the nodes of some panels, and their `_excess`."""
    grid, starts = quadrature(averaging), _pairs(averaging).starts
    width = np.diff(starts, append=grid.frequency.size)
    nodes = np.flatnonzero(np.repeat(np.frombuffer(panels, dtype=bool), width))
    frequency = grid.frequency[nodes]
    frequency.flags.writeable = False
    return frequency, grid.weight[nodes], grid.gain[:, nodes], *_excess(averaging, frequency)


def _node_by_node(
    psd: PSD, dt: float, averaging: tuple[float, ...], chosen: npt.NDArray[np.bool_]
) -> FloatArray:
    """A quarter of the integrals over some panels, from all of their nodes."""
    frequency, weight, gain, rows, columns, excess = _nodes_of(averaging, chosen.tobytes())
    density = evaluated(psd, in_hertz(frequency, dt), dt) / dt
    scaled = gain * (np.sqrt(weight) * density)
    integral = scaled @ scaled.T
    correction = excess @ (weight * density**2)
    integral[rows, columns] += correction
    apart = rows != columns
    integral[columns[apart], rows[apart]] += correction[apart]
    return np.asarray(integral)


def mean_covariance(psd: PSD, n: int, dt: float) -> FloatArray:
    """Covariance of the means over time of the Haar coefficients of the levels, (J, J), in u^2.

    A drift adds a multiple of it to the covariance of the wavelet variances. It is zero at fine
    levels, where a drift that the record can show is far below the noise.
    """
    sums = _lag_sums(n)
    mean = sums.of(block_spectrum(psd, dt, sums.grid))[0]
    m = dyadic_levels(n)
    counts = haar_counts(n, m)[sums.first :] / sums.grid.block
    result = np.zeros((m.size, m.size))
    mean /= np.maximum.outer(counts, counts)
    result[sums.first :, sums.first :] = mean + np.triu(mean, 1).T
    return result


def haar_covariance(
    psd: PSD | Any,
    n: int,
    dt: float | None = None,
    *,
    rate: float | None = None,
    averaging: Sequence[float] | FloatArray = (),
) -> FloatArray:
    """Covariance of the Haar wavelet variance estimates of a Gaussian series.

    Parameters
    ----------
    psd : callable or Model
        ``psd(f, dt)``, two-sided, in u^2/Hz; or a model that has one.
    n : int
        Number of samples.
    dt, rate : float
        Sampling interval, s, or rate, Hz.
    averaging : (J,) array_like, optional
        Averaging times, whole numbers of samples, rising, the last at most ``n`` / 2; by default
        1, 2, 4, ...

    Returns
    -------
    (J, J) ndarray
        In u^4.
    """
    dt = checks.sampling_interval(dt, rate)
    psd = getattr(psd, "psd", psd)
    m = np.asarray(averaging, dtype=float) if len(averaging) else dyadic_levels(n)
    counts = haar_counts(n, m)
    covariance = integrals(psd, dt, m) / np.maximum.outer(counts, counts)
    sums = _lag_sums(n, tuple(m.tolist()) if len(averaging) else ())
    covariance[sums.first :, sums.first :] *= _end_effects(psd, dt, sums)
    return covariance


def line_covariance(
    lines: Sequence[tuple[float, float]],
    psd: PSD,
    dt: float,
    kind: str | FloatArray,
    counts: FloatArray,
) -> FloatArray:
    """Contribution of spectral lines to the covariance: their product with the noise around them.

    A line of amplitude a at frequency f adds 2 a^2 |H_j|^2 |H_k|^2 S(f) / max(M_j, M_k), with the
    gains H of the wavelet of a name, or of Haar filters of averaging times in samples.
    """
    total = np.zeros((counts.size, counts.size))
    for frequency, amplitude in lines:
        f = np.abs(frequency * dt - np.rint(frequency * dt))
        if isinstance(kind, str):
            gain = wavelet(kind).gains(counts.size, f)
        else:
            gain = (np.sin(np.pi * kind * f) ** 2 / (kind * np.sin(np.pi * f))) ** 2
        density = float(evaluated(psd, np.array([f]) / dt, dt)[0]) / dt
        total += 2.0 * amplitude**2 * density * np.outer(gain, gain)
    return np.asarray(total / np.maximum.outer(counts, counts))
