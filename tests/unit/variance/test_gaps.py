"""Series with missing samples: what they add, and which coefficients are left out."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.linalg import toeplitz
from scipy.stats import chi2, norm

import gmwm
from gmwm import GaussMarkov, Model, QuantizationNoise, RandomWalk, RateRamp, Resonance, WhiteNoise
from gmwm.estimate import estimate
from gmwm.variance.gaps import (
    Runs,
    bridged,
    common_share,
    lags_to,
    pair_factor,
    spread_by_lags,
    unmasked,
    window_centres,
    window_count,
)
from gmwm.variance.kernels import pairs_at_lag
from marks import slow


def with_gaps(x, gaps):
    x = np.array(x, dtype=float)
    for start, stop in gaps:
        x[start:stop] = np.nan
    return x


def covariance_of(process, n):
    if isinstance(process, RandomWalk):
        k = np.arange(1.0, n + 1.0)
        return process.K**2 * np.minimum.outer(k, k)
    return toeplitz(process.autocovariance(np.arange(n), 1.0))


def haar_rows(runs, m, there):
    """Differences of means of what is there, of the windows within runs, as a matrix."""
    rows = []
    for start, stop in runs:
        for t in range(start, stop - 2 * m + 1):
            row = np.zeros(there.size)
            for half, sign in ((slice(t, t + m), -0.5), (slice(t + m, t + 2 * m), 0.5)):
                row[half] = sign * there[half] / np.sum(there[half])
            rows.append(row)
    return np.array(rows).reshape(-1, there.size)


# -- which gaps there are --------------------------------------------------------------------------


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.integers(1, 12))
def test_runs_count_what_a_loop_counts(present, width):
    values = np.where(present, 0.0, np.nan)
    runs = Runs.of(values)
    windows = [all(present[t : t + width]) for t in range(len(present) - width + 1)]
    assert window_count(runs.edges, width) == sum(windows)
    assert runs.present == sum(present)
    assert runs.is_complete == all(present)


def test_short_gaps_belong_to_runs():
    runs = Runs.of(with_gaps(np.zeros(100), [(0, 5), (20, 21), (40, 44), (60, 65)])).edges
    assert bridged(runs, np.zeros(3, dtype=bool), 5.0).tolist() == [[5, 60], [65, 100]]
    assert bridged(runs, np.array([True, False, False]), 9.0).tolist() == [[5, 20], [21, 100]]


def test_lags_end_at_the_longest_gap():
    assert lags_to(1).tolist() == [0, 1]
    assert lags_to(100)[-4:].tolist() == [81, 87, 94, 101]


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 9), st.integers(0, 9)), min_size=1, max_size=8),
    st.integers(0, 12),
)
def test_pairs_at_a_lag_are_what_a_loop_counts(parts, lag):
    ends = np.cumsum(np.ravel(parts))
    intervals = np.stack([ends[::2], ends[::2] + np.array(parts)[:, 1]], axis=1)
    intervals[:, 1] = np.minimum(intervals[:, 1], np.append(ends[2::2], 10**6))
    inside = np.zeros(200, dtype=bool)
    for start, stop in intervals:
        inside[start:stop] = True
    assert pairs_at_lag(intervals, intervals, lag) == np.sum(
        inside[lag:] & inside[: inside.size - lag]
    )


def test_what_the_windows_of_runs_know():
    whole = window_centres(np.array([[0, 11_000]]), 128)
    assert pair_factor(whole, 64, 11_000) == pytest.approx(1.0)
    halves = window_centres(np.array([[0, 5000], [6000, 11_000]]), 128)
    assert pair_factor(halves, 64, 11_000) == pytest.approx(1.1, rel=0.03)
    left = window_centres(np.array([[0, 5000]]), 128)
    right = window_centres(np.array([[6000, 11_000]]), 64)
    shares = common_share([whole, left, right], np.array([128, 128, 64]), 11_000)
    expected = np.sqrt(5000 / 11_000)
    np.testing.assert_allclose(shares[0, 1:], expected, rtol=0.02)
    assert shares[1, 2] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(np.diag(shares), 1.0)


# -- what missing samples add ----------------------------------------------------------------------

PROCESSES = [
    WhiteNoise(1.0), RandomWalk(1.0), GaussMarkov(1.0, 10.0), Resonance(1.0, 0.05, 0.1)
]  # fmt: skip


@pytest.mark.parametrize("process", PROCESSES, ids=str)
@pytest.mark.parametrize("pattern", ["a tenth", "gaps of 5"])
def test_what_is_subtracted_is_what_missing_samples_add(process, pattern):
    """Expected mean squares from matrices, without sampling."""
    n, rng = 600, np.random.default_rng(3)
    lost = rng.random(n) < 0.1
    if pattern == "gaps of 5":
        lost = np.isin(np.arange(n), np.add.outer(np.arange(17, 580, 49), np.arange(5)))
    runs = Runs.of(np.where(lost, np.nan, 0.0)).edges
    apart, covariance = np.zeros(len(runs) - 1, dtype=bool), covariance_of(process, n)
    square, truth, scarcity = np.zeros((3, 6))
    lags = np.arange(6)
    squares = np.diag(covariance)[lags] + covariance[0, 0] - 2.0 * covariance[0, lags]

    def spread(finer):
        m = 2.0**finer.size
        within = bridged(runs, apart, m / 4)
        k = lags[lags < m / 4]
        return spread_by_lags(finer, runs, within, k, squares[k])

    for j in range(6):
        m = 2**j
        within = bridged(runs, apart, m / 4)
        rows, whole = haar_rows(within, m, ~lost), haar_rows(within, m, np.ones(n))
        square[j], truth[j] = (np.vdot(r @ covariance, r) / len(r) for r in (rows, whole))
        scarcity[j] = np.mean(np.sum(rows**2, axis=1)) - 0.5 / m
    found, _ = unmasked(square, scarcity, spread)
    np.testing.assert_allclose(found, truth, rtol=0.035)


def test_a_drift_goes_on_through_a_gap():
    k = np.arange(2000.0)
    noise = 1e-6 * np.random.default_rng(1).standard_normal(k.size)
    x = with_gaps(0.3 * k + noise, [(300, 320), (900, 901), (1500, 1590)])
    found = gmwm.wavelet_variance(x, dt=1.0)
    np.testing.assert_allclose(found.variance, (0.15 * found.tau) ** 2, rtol=1e-5)
    assert found.tau.size == 10


def test_fine_levels_are_those_of_the_coefficients_that_exist():
    x = with_gaps(np.random.default_rng(1).standard_normal(300).cumsum(), [(100, 103), (150, 190)])
    found = gmwm.wavelet_variance(x, dt=0.5)
    runs = Runs.of(x).edges
    for j in range(4):  # a gap of 3 counts from an averaging time of 12 on
        rows = haar_rows(runs, 2**j, np.ones(300))
        mean_square = np.mean((rows @ np.where(np.isnan(x), 1e6, x)) ** 2)
        assert found.variance[j] == pytest.approx(mean_square, rel=1e-9)
        assert found.counts[j] == len(rows)


MODELS = [
    Model((WhiteNoise(1.0),)),
    WhiteNoise(1.0) + RandomWalk(0.03),
    Model((RandomWalk(1.0),)),
    WhiteNoise(1.0) + GaussMarkov(1.0, 100.0),
    WhiteNoise(0.1) + Resonance(1.0, 0.1, 0.05),
    QuantizationNoise(1.0) + WhiteNoise(1.0),
]


def singles(share):
    return lambda rng, n: rng.random(n) < share


def shocks(number, n):
    return lambda rng, _: np.isin(
        np.arange(n), (rng.integers(100, n - 100, number)[:, None] + np.arange(18)).ravel()
    )


def differences(model, lost, n, runs, seed):
    """Variances of complete series, of the same with gaps, and the predicted growth."""
    rng = np.random.default_rng(seed)
    whole, part, growth = [], [], []
    for _ in range(runs):
        x = model.simulate(n, 1.0, rng)
        found = gmwm.wavelet_variance(np.where(lost(rng, n), np.nan, x), dt=1.0)
        whole.append(gmwm.wavelet_variance(x, dt=1.0).variance)
        assert found.tau.size == len(whole[-1])
        part.append(found.variance)
        growth.append(np.diag(found.gaps.inflation))
    return np.array(whole), np.array(part), np.mean(growth, axis=0)


def check_levels(model, lost, n, runs, seed, most):
    """No bias above ``most`` standard errors beyond chance, and the sampling variance as said."""
    whole, part, growth = differences(model, lost, n, runs, seed)
    deviation = np.std(whole, axis=0, ddof=1)
    added = (part - whole) / deviation
    known = np.std(added, axis=0, ddof=1) / np.sqrt(runs)
    chance = norm.ppf(1.0 - 1e-4 / added.shape[1])
    assert np.all(np.abs(np.mean(added, axis=0)) < most + chance * known)
    # The ratio of two correlated sample variances has the standard deviation 2 sqrt(1 - r^2)/
    # sqrt(runs) in logarithms, r being their correlation; levels of few degrees of freedom more.
    ratio = np.log(growth * deviation**2 / np.var(part, axis=0, ddof=1))
    r = np.array([np.corrcoef(*pair)[0, 1] for pair in zip(whole.T, part.T, strict=True)])
    spread = 2.0 * np.sqrt((1.0 - r**2) / runs)
    assert np.all(ratio > np.log(0.85) - 1.5 * chance * spread), ratio
    assert np.all(ratio < np.log(1.2) + 1.5 * chance * spread), ratio


@pytest.mark.parametrize("model", [MODELS[1], slow(MODELS[4]), MODELS[5]], ids=repr)
def test_levels_of_a_gappy_series_are_those_of_the_complete_one(model):
    check_levels(model, singles(0.01), 17_000, 40, 1, 0.3)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS, ids=repr)
@pytest.mark.parametrize(
    "lost",
    [singles(0.001), singles(0.01), shocks(50, 100_000), shocks(400, 100_000)],
    ids=["0.1 %", "1 %", "50 shocks", "400 shocks"],
)
def test_levels_of_long_gappy_series_are_those_of_the_complete_one(model, lost):
    # Between octaves the variances of a narrow resonance are not as smooth as is assumed.
    check_levels(model, lost, 100_000, 200, 1, 1.2 if model is MODELS[4] else 0.3)


# -- damage of all kinds ---------------------------------------------------------------------------


def test_reversed_data_have_the_same_levels():
    x = (WhiteNoise(1.0) + RandomWalk(0.1)).simulate(20_000, 1.0, 1)
    x[np.random.default_rng(2).random(x.size) < 0.05] = np.nan
    x[7000:7100] = np.nan
    there, back = (gmwm.wavelet_variance(series, dt=1.0) for series in (x, x[::-1]))
    np.testing.assert_allclose(there.variance, back.variance, rtol=1e-6)
    np.testing.assert_allclose(there.gaps.change, back.gaps.change, rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("n", [8, 9, 17, 100, 1023, 1025, 4097])
@pytest.mark.parametrize("share", [0.05, 0.3, 0.6])
def test_every_length_and_share_gives_levels_or_one_sentence(n, share):
    rng = np.random.default_rng(n)
    x = np.where(rng.random(n) < share, np.nan, rng.standard_normal(n))
    try:
        found = gmwm.wavelet_variance(x, dt=1.0)
    except gmwm.InputError as error:
        assert "consecutive samples" in str(error)
        return
    assert np.all(np.isfinite(found.variance)) and np.all(np.isfinite(found.covariance))
    assert np.all(np.linalg.eigvalsh(found.covariance) > 0.0)
    assert np.all(found.counts >= 1.0)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 990), st.integers(1, 500)), max_size=6), st.integers(0, 9))
def test_any_pattern_is_finite(gaps, seed):
    rng = np.random.default_rng(seed)
    x = with_gaps(rng.standard_normal(1000), [(a, a + size) for a, size in gaps])
    if Runs.of(x).longest < 8:
        return
    found = gmwm.wavelet_variance(x, dt=1.0)
    assert np.all(np.isfinite(found.variance)) and np.all(found.counts >= 1.0)
    assert np.all(np.isfinite(found.covariance))


def white(f, dt):
    """Density of white noise of unit variance."""
    return np.full_like(f, dt)


def test_gaps_at_the_ends_cost_what_they_hold():
    x = WhiteNoise(1.0).simulate(10_000, 1.0, 1)
    found = gmwm.wavelet_variance(with_gaps(x, [(0, 700), (9800, 10_000)]), dt=1.0)
    expected = gmwm.wavelet_variance(x[700:9800], dt=1.0)
    np.testing.assert_allclose(found.variance, expected.variance, rtol=1e-9)
    ratio = [np.diag(each.covariance_under(white)) for each in (found, expected)]
    np.testing.assert_allclose(ratio[0] / ratio[1], 1.0, rtol=0.02)
    # The last level has 0.03 degrees of freedom by chance, by the spectrum that it shows itself.
    np.testing.assert_allclose(found.dof[:-1], expected.dof[:-1], rtol=0.03)


def test_a_gap_of_half_the_record_ends_the_curve_and_is_reported():
    x = (WhiteNoise(1.0) + RandomWalk(0.1)).simulate(10_000, 1.0, 1)
    found = gmwm.wavelet_variance(with_gaps(x, [(2500, 7500)]), dt=1.0)
    assert found.tau[-1] == 1024.0
    (notice,) = found.notices
    assert notice.code == "curve-shortened"
    assert notice.values == {"levels": 2, "tau": 1024.0, "complete": 4096.0}
    again = gmwm.WaveletVariance.from_dict(found.to_dict())
    np.testing.assert_array_equal(again.variance, found.variance)
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), found)
    assert notice in fit.notices and fit.valid
    assert not gmwm.wavelet_variance(with_gaps(x, [(2500, 2600)]), dt=1.0).notices


def test_levels_without_gaps_know_what_their_coefficients_know():
    threes = [(i, i + 3) for i in range(5, 19_000, 5)]
    gaps = gmwm.wavelet_variance(
        with_gaps(WhiteNoise(1.0).simulate(20_000, 1.0, 1), threes), dt=1.0
    ).gaps
    without = gaps.change == 0.0
    assert np.any(without) and not np.all(without)
    assert np.all(np.diag(gaps.inflation) >= 1.0)


def test_recorded_steps_pass_through_short_gaps():
    """Those within a gap do not: see test_levels_apart.py."""
    x = WhiteNoise(1.0).simulate(20_000, 1.0, 1) + 30.0 * (np.arange(20_000) > 9_100)
    gappy = with_gaps(x, [(8_995, 9_005), (400, 401)])
    whole, found = (gmwm.wavelet_variance(series, dt=1.0) for series in (x, gappy))
    np.testing.assert_allclose(found.variance[7:], whole.variance[7:], rtol=0.02)


# -- fits ------------------------------------------------------------------------------------------


GAPPY = [
    WhiteNoise(1.0) + GaussMarkov(0.7, 40.0),
    slow(WhiteNoise(1.0) + RandomWalk(0.03) + RateRamp(2e-3)),
]


@pytest.mark.parametrize("truth", GAPPY, ids=repr)
def test_fits_of_gappy_series_are_as_good_as_their_intervals(truth):
    """Standardised errors of 12 fits; with a fifth of the record missing in 16 gaps."""
    n, runs = 8000, 12
    rng = np.random.default_rng(5)
    squares, invalid = [], 0
    for _ in range(runs):
        starts = rng.choice(n - 100, 16, replace=False)
        x = with_gaps(truth.simulate(n, 1.0, rng), [(a, a + 100) for a in starts])
        fit = estimate(truth.opened(), x, dt=1.0)
        invalid += not fit.valid
        errors = [(fit.params[k] - truth.params[k]) / s for k, s in fit.stderr.items()]
        squares.append(np.square(errors))
    assert invalid <= 1  # at one in a thousand, two are 4e-4
    # Of normal errors; the 1e-3 tails of chi-square, with a tenth for their own standard errors.
    low, high = chi2.ppf([1e-3, 1.0 - 1e-3], runs) / runs
    means = np.mean(squares, axis=0)
    assert np.all(means > low - 0.1) and np.all(means < high + 0.1), means


def test_likelihood_and_moments_agree_on_a_gappy_series():
    truth = WhiteNoise(1.0) + GaussMarkov(0.7, 40.0)
    x = with_gaps(truth.simulate(10_000, 1.0, 3), [(500, 700), (4000, 5000)])
    moments = gmwm.fit(truth.opened(), x, dt=1.0)
    exact = gmwm.fit(truth.opened(), x, dt=1.0, method="mle")
    for key, error in exact.stderr.items():
        assert moments.params[key] == pytest.approx(exact.params[key], abs=1.5 * error)
        assert moments.stderr[key] == pytest.approx(error, rel=0.4)


@pytest.mark.parametrize("lost", ["0.1 %", slow("1 %"), slow("30 shocks"), "100 shocks"])
@pytest.mark.parametrize("seed", [1, *map(slow, range(2, 21))])
def test_a_few_missing_samples_make_no_ramp(lost, seed):
    """One hour at 100 Hz; with as few as these 18 of 20 records were given a ramp."""
    n = 360_000
    rng = np.random.default_rng(seed)
    x = (WhiteNoise(1e-4) + RandomWalk(2e-6)).simulate(n, 0.01, rng)
    if lost.endswith("%"):
        mask = rng.random(n) < float(lost.split()[0]) / 100.0
    else:
        starts = rng.integers(0, n - 20, int(lost.split()[0]))
        mask = np.isin(np.arange(n), (starts[:, None] + np.arange(20)).ravel())
    found = gmwm.select(gmwm.wavelet_variance(np.where(mask, np.nan, x), 0.01))
    assert not any(term.is_drift for term in found.model.terms), found.model


def test_a_slope_across_a_long_gap_has_an_offset():
    """What a random walk does within a long gap is no drift."""
    n = 20_000
    x = WhiteNoise(1.0).simulate(n, 1.0, 1) + 100.0 * (np.arange(n) > n // 2)
    gappy = with_gaps(x, [(6_000, 14_000)])
    fit = gmwm.fit(WhiteNoise() + RateRamp(), gappy, dt=1.0)
    assert abs(fit.params["R"]) < 4.0 * fit.stderr["R"]
    # Two runs of 6,000: their slopes each have the variance 12 / 6000^3.
    assert fit.stderr["R"] == pytest.approx(np.sqrt(6.0 / 6000.0**3), rel=0.1)


def test_a_drift_that_no_block_shows_is_refused():
    x = WhiteNoise(1.0).simulate(100_000, 1.0, 1)
    x[np.arange(x.size) % 20 >= 8] = np.nan
    with pytest.raises(gmwm.InputError, match="fit a model without RateRamp"):
        gmwm.fit(WhiteNoise() + RateRamp(), x, dt=1.0)


def test_covariance_of_a_gappy_series_costs_one_of_a_complete_one():
    x = WhiteNoise(1.0).simulate(5000, 1.0, 1)
    complete = gmwm.wavelet_variance(x, dt=1.0)
    x[::50] = np.nan
    gappy = gmwm.wavelet_variance(x, dt=1.0)
    psd = WhiteNoise(1.0).psd
    expected = complete.covariance_under(psd) * gappy.gaps.inflation
    np.testing.assert_allclose(gappy.covariance_under(psd), expected, rtol=1e-12)


def test_data_covariance_and_robust_variances_of_gappy_series():
    rng = np.random.default_rng(3)
    x = rng.standard_normal(50_000)
    y = np.where(rng.random(x.size) < 0.02, np.nan, x)
    for options in ({"robust": True}, {"data_covariance": "octave"}):
        whole, part = (gmwm.wavelet_variance(s, dt=1.0, **options) for s in (x, y))
        assert part.tau.size == whole.tau.size
        known = whole.dof > 30.0
        error = np.sqrt(2.0 / whole.dof[known])
        difference = part.variance[known] / whole.variance[known] - 1.0
        assert np.all(np.abs(difference) < 0.8 * error)
    ratio = np.diag(part.data_covariance) / np.diag(whole.data_covariance)
    assert np.all(np.abs(np.log(ratio[known])) < 0.5)


@pytest.mark.parametrize("more", [0, 1, 10, 100])
def test_few_windows_before_a_long_gap_are_known_as_well_as_alone(more):
    # The longest averaging time has 1 + more windows, nearly all of them the same samples.
    present = 4096 + more
    x = np.full(6000, np.nan)
    x[:present] = np.random.default_rng(1).normal(size=present)

    one, alone = (gmwm.wavelet_variance(each, 1.0) for each in (x, x[:present]))
    assert one.gaps.counts[-1] == 1 + more
    ratio = np.diag(one.covariance_under(white)) / np.diag(alone.covariance_under(white))
    np.testing.assert_allclose(ratio, 1.0, rtol=0.04)
