"""The robust variance and its covariance: roots, contamination, and simulated sampling laws."""

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.signal import fftconvolve
from scipy.special import eval_hermitenorm
from scipy.stats import binom, chi2, norm

import gmwm
from gmwm.variance.covariance.haar import dyadic_levels, haar_counts, haar_covariance
from gmwm.variance.kernels import cumulative
from gmwm.variance.levels import haar_coefficients
from gmwm.variance.robust import (
    consistency,
    excess_series,
    pair_shares,
    robust_covariance,
    robust_variance,
    tuning_constant,
)
from marks import slow
from places import SHARED

MTIG = SHARED / "data/mtig/mtig_contaminated_gyro_x.csv.gz"
EFFICIENCIES = [0.1, 0.3, 0.6, 0.9, 0.99]


def chi(r, c):
    return r**2 * np.maximum(1.0 - (r / c) ** 2, 0.0) ** 4


def normal_mean(function, c):
    """Mean under the standard normal law of a function that vanishes beyond c, by quad."""
    factor = np.sqrt(2.0 / np.pi)
    integral, _ = quad(lambda r: function(r) * np.exp(-0.5 * r * r), 0.0, c, epsabs=1e-13)
    return factor * integral


def haar_levels(x, most=99):
    """Coefficients of each level of a series."""
    integral = cumulative(x, x.mean())
    return [haar_coefficients(integral, 0, x.size, int(m)) for m in dyadic_levels(x.size)[:most]]


def estimates(x, most=99, efficiency=0.6):
    """Classical and robust variances, (J, 2)."""
    levels = haar_levels(x, most)
    return np.array([(w @ w / w.size, robust_variance(w, efficiency)) for w in levels])


# Tuning ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("c", [2.6, 4.4, 12.0, 60.0])
def test_consistency_is_the_gaussian_mean(c):
    assert consistency(c) == pytest.approx(normal_mean(lambda r: chi(r, c), min(c, 15)), rel=1e-10)


@pytest.mark.parametrize("efficiency", EFFICIENCIES)
def test_tuning_constant_gives_the_variance_ratio_of_m_estimators(efficiency):
    c = tuning_constant(efficiency)
    a = consistency(c)
    # Sandwich: var = E psi^2 / (E d psi / d nu^2)^2, the derivative taken numerically.
    h = 1e-4
    bread = (
        normal_mean(lambda r: chi(r / np.sqrt(1 + h), c), c * np.sqrt(1 + h))
        - normal_mean(lambda r: chi(r / np.sqrt(1 - h), c), c * np.sqrt(1 - h))
    ) / (2 * h)
    meat = normal_mean(lambda r: chi(r, c) ** 2, c) - a**2
    assert 2.0 / (meat / bread**2) == pytest.approx(efficiency, rel=1e-5)
    assert bread < 0.0


def test_tuning_constant_rises_with_the_efficiency():
    values = [tuning_constant(e) for e in np.linspace(0.001, 0.999, 60)]
    assert np.all(np.diff(values) > 0.0)
    assert tuning_constant(1.0 - 1e-12) >= values[-1]
    assert 2.39 < tuning_constant(1e-300) < tuning_constant(1e-20) < values[0]


@pytest.mark.parametrize("efficiency", [0.3, 0.6, 0.9])
def test_excess_series_are_the_hermite_coefficients_of_the_influence(efficiency):
    series = excess_series(efficiency)
    assert series.sum() == pytest.approx(2.0 / efficiency - 2.0, rel=1e-12)
    c = tuning_constant(efficiency)
    second = normal_mean(lambda r: chi(r, c) * (r**2 - 1.0), c)
    factorial = 24.0
    for p in range(3):
        q = 4 + 2 * p
        moment = normal_mean(lambda r, q=q: chi(r, c) * eval_hermitenorm(q, r), c)
        assert series[p] == pytest.approx(4.0 * moment**2 / second**2 / factorial, rel=1e-8)
        factorial *= (q + 1) * (q + 2)


# The estimate ------------------------------------------------------------------------------------


def test_it_solves_its_equation():
    w = np.random.default_rng(0).standard_t(8, size=4001)
    for efficiency in EFFICIENCIES[1:]:
        c = tuning_constant(efficiency)
        found = robust_variance(w, efficiency)
        assert np.mean(chi(w / np.sqrt(found), c)) == pytest.approx(consistency(c), rel=1e-11)


@settings(max_examples=150, deadline=None)
@given(
    st.integers(1, 400),
    st.integers(0, 2**31),
    st.floats(-50, 50),
    st.floats(0.0, 0.45),
    st.sampled_from(EFFICIENCIES),
)
def test_scale_equivariance_even_order_free(size, seed, log_scale, share, efficiency):
    rng = np.random.default_rng(seed)
    w = rng.normal(size=size) * np.where(rng.random(size) < share, 30.0, 1.0)
    base = robust_variance(w, efficiency)
    assert np.isfinite(base) and base > 0.0
    scale = np.exp(log_scale)
    other = robust_variance(-scale * rng.permutation(w), efficiency)
    # Where the equation has hardly a solution its root moves with the rounding.
    assert other == pytest.approx(scale**2 * base, rel=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.01, 0.2), st.sampled_from([2.0, 5.0, 10.0, 1e3, 1e5]))
def test_the_root_next_to_the_mad_under_contamination(seed, share, size):
    rng = np.random.default_rng(seed)
    w = rng.normal(size=1000)
    w[rng.random(1000) < share] *= size
    found = robust_variance(w)
    start = (np.median(np.abs(w)) / norm.ppf(0.75)) ** 2
    # All falling roots on a fine grid over four decades about the start.
    c = tuning_constant(0.6)
    s = start * np.logspace(-2, 2, 401)
    u = np.minimum((w[:, None] / c) ** 2 / s, 1.0)
    excess = np.mean(u * ((1 - u) * (1 - u)) ** 2, axis=0) * c**2 - consistency(c)
    falling = np.flatnonzero((excess[:-1] >= 0.0) & (excess[1:] < 0.0))
    assume(falling.size)
    nearest = falling[np.argmin(np.abs(np.log(s[falling] / start)))]
    assert s[nearest] * (1 - 1e-9) <= found <= s[nearest + 1] * (1 + 1e-9)


@pytest.mark.parametrize("share", [0.01, 0.05, 0.1, 0.2])
def test_far_outliers_move_it_by_what_the_equation_says(share):
    w = np.random.default_rng(6).normal(size=200_000)
    spoiled = w.copy()
    spoiled[: int(share * w.size)] = 1e4
    # mean chi = (1 - share) E chi(Z/s) = a has its root at s^2 < 1.
    c = tuning_constant(0.6)
    a = consistency(c)

    def equation(s):
        return (1 - share) * normal_mean(lambda z: chi(z / s, c), c * s) - a

    expected = brentq(equation, 0.58, 1.05) ** 2
    # sd of the estimate: sqrt(2/(0.6 n)) at clean data, at most three times that here.
    bound = 4.0 * 3.0 * np.sqrt(2.0 / 0.6 / w.size)
    assert abs(robust_variance(spoiled) - expected) < bound


@pytest.mark.parametrize("rounded", [0.6, 0.9, 0.999])
def test_more_than_half_zeros_start_from_the_mean_square(rounded):
    rng = np.random.default_rng(8)
    w = np.where(rng.random(3000) < rounded, 0.0, rng.choice([-0.01, 0.01], 3000))
    found = robust_variance(w)
    assert 0.0 < found <= 4.0 * np.mean(w**2)


def test_coarsely_rounded_noise_stays_near_its_variance():
    rng = np.random.default_rng(9)
    for step in (0.5, 1.0, 2.0):
        x = step * np.rint(rng.normal(size=50_000) / step)
        for classical, robust in estimates(x, most=4):
            assert 0.5 < robust / classical < 2.0


def test_constant_and_tiny_levels():
    assert robust_variance(np.zeros(1)) == 0.0
    assert robust_variance(np.zeros(1000)) == 0.0
    one = robust_variance(np.array([3.0]))
    assert robust_variance(np.array([-3.0, 3.0, 3.0])) == pytest.approx(one, rel=1e-12)
    assert 0.5 < one / 9.0 < 2.0
    assert np.isfinite(robust_variance(np.array([0.0, 0.0, 5.0])))
    assert np.isfinite(robust_variance(np.array([1e-300, 1.0])))


# Contaminated series -----------------------------------------------------------------------------


def expected_bias(m, variance, share=0.01, efficiency=0.6):
    """Bias at averaging time m if samples are replaced, independently, by N(0, variance).

    A coefficient with k of its 2 m samples replaced is N(0, (2 m - k + k variance)/(2 m)) times
    the variance of clean ones.
    """
    c = tuning_constant(efficiency)
    k = np.arange(2 * m + 1)
    weight = binom.pmf(k, 2 * m, share)
    ratio = (2 * m - k + k * variance) / (2 * m)
    keep = weight > 1e-9

    def equation(s):
        scale = np.sqrt(s / ratio[keep])
        means = [normal_mean(lambda z, q=q: chi(z / q, c), min(c * q, 12.0)) for q in scale]
        return weight[keep] @ means - consistency(c)

    return brentq(equation, 0.9, 1.0 + share * variance + 0.1, xtol=1e-6) - 1.0


@pytest.mark.parametrize(("variance", "least", "fine"), [(9.0, 0.25, 1), (100.0, 0.05, 3)])
def test_bias_from_one_percent_of_outliers(variance, least, fine):
    """A quarter or a twentieth of the classical bias at fine levels, and why not at coarse ones."""
    runs, n, most = 4, 250_000, 6
    rng = np.random.default_rng(21)
    added = np.empty((runs, most, 2))
    for run in range(runs):
        x = rng.normal(size=n)
        clean = estimates(x, most)
        hit = rng.random(n) < 0.01
        x[hit] = np.sqrt(variance) * rng.normal(size=np.count_nonzero(hit))
        truth = 0.5 / dyadic_levels(n)[:most, None]
        added[run] = (estimates(x, most) - clean) / truth
    bias = added.mean(axis=0)
    error = added.std(axis=0, ddof=1) / np.sqrt(runs)
    classical = 0.01 * (variance - 1.0)
    # t quantile 3 degrees of freedom, 1 - 1e-3.
    assert np.all(np.abs(bias[:, 0] - classical) < 10.2 * error[:, 0])
    assert np.all(np.abs(bias[:fine, 1]) < least * classical)
    expected = np.array([expected_bias(2**j, variance) for j in range(most)])
    assert np.all(np.abs(bias[:, 1] - expected) < 10.2 * error[:, 1])
    # Coarse coefficients all hold outliers: Gaussian with the raised variance, up to 4 m = 64.
    assert np.all(np.diff(bias[fine - 1 :, 1]) > 0.0) and np.all(bias[:, 1] < bias[:, 0])


def test_contaminated_recording():
    if not MTIG.exists():
        pytest.skip("the contaminated recording is not beside the repository")
    ratio = np.divide(*estimates(np.loadtxt(MTIG, skiprows=1), most=8, efficiency=0.7264).T)
    published = [1.64, 1.30, 1.20, 1.16, 1.14, 1.11, 1.08, 1.05]
    np.testing.assert_allclose(ratio, published, atol=0.006)


# The covariance ----------------------------------------------------------------------------------

PROCESSES = [
    gmwm.WhiteNoise(1.0),
    gmwm.RandomWalk(1.0),
    gmwm.GaussMarkov(1.0, 50.0),
    gmwm.GaussMarkov(1.0, 3000.0),
    gmwm.WhiteNoise(1.0) + gmwm.GaussMarkov(0.3, 200.0) + gmwm.RandomWalk(0.001),
]


def autocovariance(process, n):
    """At lags -n .. n; for a walk that of its differences, up to a constant."""
    if isinstance(process, gmwm.RandomWalk):
        return -0.5 * process.K**2 * np.abs(np.arange(-n, n + 1.0))
    if isinstance(process, gmwm.Model):
        return np.sum([autocovariance(p, n) for p in process.terms], axis=0)
    one_sided = process.autocovariance(np.arange(n + 1), 1.0)
    return np.concatenate([one_sided[:0:-1], one_sided])


def mehler_sums(process, n, efficiency):
    """What is added to the covariance, from correlations at every single lag, (J, J)."""
    m = dyadic_levels(n).astype(int)
    counts = haar_counts(n, m)
    acvs = autocovariance(process, n)
    filters = [np.concatenate([-np.ones(k), np.ones(k)]) / (2 * k) for k in m]
    lag = np.arange(-(n - 1), n)
    cross = {}
    for j in range(m.size):
        for k in range(j, m.size):
            g = fftconvolve(acvs, fftconvolve(filters[k], filters[j][::-1]))
            cross[j, k] = g[(g.size - 1) // 2 + lag]
    variance = np.array([cross[j, j][n - 1] for j in range(m.size)])
    total = np.empty((m.size, m.size))
    for (j, k), g in cross.items():
        z = g**2 / (variance[j] * variance[k])
        first, second = counts[j], counts[k]
        pairs = np.clip(0.5 * (first + second) - np.abs(lag), 0.0, min(first, second))
        powers = pairs @ (z**2 * np.polyval(excess_series(efficiency)[::-1], z))
        total[j, k] = total[k, j] = powers * variance[j] * variance[k] / (first * second)
    return total


@pytest.mark.parametrize("n", [9, 100, 1025, 5000])
@pytest.mark.parametrize("process", PROCESSES, ids=repr)
def test_what_is_added_equals_the_sum_over_all_lags(process, n):
    expected = mehler_sums(process, n, 0.6)
    classical = haar_covariance(process.psd, n, 1.0)
    added = robust_covariance(process.psd, n, 1.0, 0.6, classical) - classical
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # Straight lines between lags: b^2/m / (0.275 m) with m = 16 b; levels far apart: a guess.
    np.testing.assert_allclose(added / scale, expected / scale, atol=0.02)


@pytest.mark.parametrize("efficiency", [0.3, 0.6, 0.95])
def test_independent_coefficients_have_the_classical_variance_over_the_efficiency(efficiency):
    # First differences of a walk sampled at its own steps are independent.
    psd, n = gmwm.RandomWalk(1.0).psd, 3000
    classical = haar_covariance(psd, n, 1.0)
    ratio = robust_covariance(psd, n, 1.0, efficiency, classical) / classical
    assert ratio[0, 0] == pytest.approx(1.0 / efficiency, rel=1e-6)
    assert np.all(np.diag(ratio) <= 1.0 / efficiency * (1 + 1e-9))
    assert np.all(np.diag(ratio) >= 1.0)


@settings(max_examples=12, deadline=None)
@given(
    st.integers(8, 3_000_000),
    st.sampled_from(
        [
            *PROCESSES,
            gmwm.QuantizationNoise(1.0),
            gmwm.Resonance(1.0, 0.002, 0.02),
            gmwm.BiasInstability(1.0),
            gmwm.WhiteNoise(1.0) + gmwm.Resonance(1.0, 0.1, 0.001),
        ]
    ),
    st.sampled_from([0.1, 0.6, 0.95]),
)
def test_symmetric_positive_definite_and_above_the_classical(n, process, efficiency):
    classical = haar_covariance(process.psd, n, 1.0)
    robust = robust_covariance(process.psd, n, 1.0, efficiency, classical)
    np.testing.assert_array_equal(robust, robust.T)
    scale = np.sqrt(np.outer(np.diag(robust), np.diag(robust)))
    least = np.linalg.eigvalsh(classical / scale)[0]
    assert np.linalg.eigvalsh(robust / scale)[0] >= least - 1e-12
    assert np.linalg.eigvalsh((robust - classical) / scale)[0] >= -1e-12
    assert np.all(np.diag(robust) <= np.diag(classical) / efficiency * (1 + 1e-9))


@pytest.mark.parametrize("block", [1, 4, 32])
@pytest.mark.parametrize(("n", "m_j", "m_k"), [(256, 32, 128), (300, 64, 64), (1000, 32, 256)])
def test_shares_of_pairs_are_counted_one_by_one(n, m_j, m_k, block):
    centre_j = np.arange(n - 2 * m_j + 1) + m_j
    centre_k = np.arange(n - 2 * m_k + 1) + m_k
    lag = np.abs(np.subtract.outer(centre_j, centre_k)).ravel()
    expected = np.zeros(n // block + 2)
    np.add.at(expected, lag // block, 1.0 - (lag % block) / block)
    np.add.at(expected, lag // block + 1, (lag % block) / block)
    found = pair_shares(n, m_j, m_k, block, expected.size)
    np.testing.assert_allclose(found, expected / lag.size, rtol=1e-12, atol=1e-14)


def test_fewer_levels_and_counts_of_a_series_with_gaps():
    psd, n = gmwm.WhiteNoise(1.0).psd, 5000
    full = haar_covariance(psd, n, 1.0)
    m = dyadic_levels(n)
    classical = 2.0 * full[:6, :6]
    found = robust_covariance(psd, n, 1.0, 0.6, classical, counts=0.5 * haar_counts(n, m)[:6])
    expected = 2.0 * robust_covariance(psd, n, 1.0, 0.6, full)[:6, :6]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-4 * np.max(np.abs(expected)))


@pytest.mark.parametrize(
    "process",
    [gmwm.WhiteNoise(1.0), slow(gmwm.RandomWalk(1.0)), gmwm.GaussMarkov(1.0, 50.0)],
    ids=repr,
)
def test_simulated_covariance_of_clean_series(process):
    runs, n = 250, 4096
    rng = np.random.default_rng(5)
    found = np.array([estimates(process.simulate(n, 1.0, rng), 8)[:, 1] for _ in range(runs)])
    classical = haar_covariance(process.psd, n, 1.0)[:8, :8]
    theory = robust_covariance(process.psd, n, 1.0, 0.6, classical)
    truth = process.haar_variance(dyadic_levels(n)[:8], 1.0)
    # Asymptotics need independent coefficients: levels with 40 degrees of freedom or more.
    keep = 2.0 * truth**2 / np.diag(classical) > 40.0
    theory, found, truth = theory[np.ix_(keep, keep)], found[:, keep], truth[keep]
    variance = np.diag(theory)
    # A variance of estimates of relative variance v, chi-square like: kurtosis 6 v, so that the
    # degrees of freedom of a sample variance are (runs - 1)/(1 + 3 v). The theory is of first
    # order: the next one adds of the order of v.
    relative = variance / truth**2
    dof = (runs - 1) / (1.0 + 3.0 * relative)
    ratio = found.var(axis=0, ddof=1) / variance
    level = 1e-3 / truth.size
    assert np.all(ratio > chi2.ppf(level / 2, dof) / dof)
    assert np.all(ratio < chi2.ppf(1 - level / 2, dof) / dof + relative)
    # Fisher's z of the correlations has the standard deviation 1/sqrt(runs - 3); 0.02 is what the
    # sums over blocks may be off.
    rows, columns = np.triu_indices(truth.size, 1)
    z = np.arctanh(np.corrcoef(found.T)[rows, columns])
    expected = np.arctanh((theory / np.sqrt(np.outer(variance, variance)))[rows, columns])
    bound = norm.ppf(1 - 1e-3 / (2 * rows.size)) / np.sqrt(runs - 3)
    assert np.all(np.abs(z - expected) < bound + 0.02)
    # Consistent: the bias is of second order, below the relative variance of an estimate.
    error = 4.0 * np.sqrt(variance / runs)
    assert np.all(np.abs(found.mean(axis=0) - truth) < error + relative * truth)


@pytest.mark.parametrize("process", [gmwm.QuantizationNoise(1.0), gmwm.RandomWalk(1.0)], ids=repr)
@pytest.mark.parametrize("efficiency", [0.6, 0.95])
def test_no_variance_is_larger_than_the_efficiency_says(process, efficiency):
    """Sums over blocks would make that of pure quantization noise twice as large."""
    classical = haar_covariance(process.psd, 4096, 1.0)
    found = robust_covariance(process.psd, 4096, 1.0, efficiency, classical)
    assert np.all(np.diag(found) < 1.000001 * np.diag(classical) / efficiency)
