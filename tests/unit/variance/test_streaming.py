"""Wavelet variance of streams against that of the whole series."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gmwm
from gmwm.errors import InputError
from gmwm.variance import stream_kernels

FINE = 10
"""Levels of 1 to 512 samples, all windows of which are seen."""


def noise(n, seed, offset=0.0, walk=0.02):
    rng = np.random.default_rng(seed)
    return offset + rng.normal(size=n) + walk * np.cumsum(rng.normal(size=n))


def with_gaps(x, rng, number, longest):
    x = x.copy()
    for _ in range(number):
        begin = rng.integers(0, x.size)
        x[begin : begin + rng.integers(1, longest + 1)] = np.nan
    return x


def streamed(x, cuts=(), **options):
    stream = gmwm.StreamingVariance(0.1, **options)
    for block in np.split(x, sorted(cuts)):
        stream.update(block)
    return stream


def everything(wv):
    found = [wv.tau, wv.variance, wv.mean, wv.blocks, wv.block, wv.n, wv.fourth_cumulant]
    if wv.gaps is not None:
        found += [wv.gaps.missing, wv.gaps.counts, wv.gaps.change, wv.gaps.inflation]
    return found


def assert_same(first, second, rtol=0.0):
    scale = np.sqrt(np.max(first.variance))
    for a, b in zip(everything(first), everything(second), strict=True):
        np.testing.assert_allclose(a, b, rtol=rtol, atol=rtol * scale, equal_nan=True)


def assert_close_to_all_windows(found, whole):
    """To rounding where all windows are seen, within 1 % of a standard error elsewhere.

    Of a level with few windows, some of the last are not seen: within a quarter.
    """
    assert found.tau.tolist() == whole.tau.tolist()
    np.testing.assert_allclose(found.variance[:FINE], whole.variance[:FINE], rtol=1e-10)
    np.testing.assert_allclose(
        found.mean[:FINE], whole.mean[:FINE], atol=1e-10 * np.sqrt(np.max(whole.variance))
    )
    error = np.sqrt(np.diag(whole.covariance))
    limit = np.where(whole.counts > 2.0 * whole.averaging, 0.01, 0.25)
    assert np.all(np.abs(found.variance - whole.variance) < limit * error)
    deviation = np.sqrt(np.maximum(whole.variance, error))
    assert np.all(np.abs(found.mean - whole.mean) < limit * deviation)


@settings(max_examples=6, deadline=None)
@given(
    st.integers(8, 12_000),
    st.integers(0, 2**31),
    st.floats(-1e6, 1e6),
    st.lists(st.integers(0, 12_000), max_size=6),
)
def test_any_blocks_are_the_series(n, seed, offset, cuts):
    x = noise(n, seed, offset)
    found = streamed(x, [min(cut, n) for cut in cuts]).result()
    assert_same(found, streamed(x).result())
    assert_close_to_all_windows(found, gmwm.wavelet_variance(x, dt=0.1))


def test_single_samples_and_empty_blocks():
    x = noise(300, 2)
    stream = gmwm.StreamingVariance(0.1)
    for value in x:
        stream.update([])
        stream.update([value])
    assert_same(stream.result(), streamed(x).result())
    # A result is of what was there so far.
    assert_close_to_all_windows(stream.result(), gmwm.wavelet_variance(x, dt=0.1))


def test_reversed_series_have_the_same_variances_and_opposite_means():
    x = with_gaps(noise(2**15, 3), np.random.default_rng(3), 20, 50)
    x[[0, -1]] = 0.0  # gaps at the ends are none
    there, back = streamed(x).result(), streamed(x[::-1].copy()).result()
    np.testing.assert_allclose(there.variance, back.variance, rtol=1e-9)
    np.testing.assert_allclose(there.mean, -back.mean, atol=1e-9)


@pytest.fixture(scope="module")
def six():
    """Two channels of a walk, checkpointed in the middle."""
    return np.stack([noise(20_000, 4, 9.81), noise(20_000, 5, walk=0.0)], axis=1)


def test_channels_are_series(six):
    units = {"gyro_x": "rad/s", "accel_z": "m/s^2"}
    stream = gmwm.StreamingVariance(0.1, units)
    for block in np.array_split(six, 7):
        stream.update(block)
    found = stream.result()
    assert list(found) == list(units)
    for i, (name, unit) in enumerate(units.items()):
        assert (found[name].name, found[name].unit) == (name, unit)
        assert_same(found[name], streamed(np.ascontiguousarray(six[:, i])).result())
    assert found["gyro_x"].quantity == "gyro"
    assert "gyro_x, accel_z" in repr(stream)


def test_checkpoints_go_on_to_the_last_bit(six, tmp_path):
    stream = gmwm.StreamingVariance(0.1, ("a", "b"))
    stream.update(six[:7001])
    stream.save(tmp_path / "stream.npz")
    again = gmwm.StreamingVariance.load(tmp_path / "stream.npz")
    copy = pickle.loads(pickle.dumps(stream))  # as processes send it
    for each in (stream, again, copy):
        each.update(six[7001:])
    for name, found in stream.result().items():
        assert_same(found, again.result()[name])
        assert_same(found, copy.result()[name])


def test_a_fit_of_a_stream():
    model = gmwm.WhiteNoise() + gmwm.RandomWalk()
    truth = gmwm.WhiteNoise(0.2) + gmwm.RandomWalk(0.003)
    x = gmwm.simulate(truth, n=200_000, dt=0.1, seed=6)
    ours = gmwm.fit(model, streamed(x).result())
    whole = gmwm.fit(model, gmwm.wavelet_variance(x, dt=0.1))
    for key, error in whole.stderr.items():
        assert abs(ours.params[key] - whole.params[key]) < 0.02 * error


# -- gaps ------------------------------------------------------------------------------------------


def missing_singly(n, rng):
    return rng.random(n) < 0.1


def missing_every_third(n, rng):
    return np.arange(n) % 3 == 2


def missing_in_gaps(n, rng):
    gone = np.zeros(n, dtype=bool)
    for begin in rng.integers(0, n, 12):
        gone[begin : begin + 20] = True
    return gone


def missing_for_long(n, rng):
    gone = np.zeros(n, dtype=bool)
    gone[2 * n // 5 : n // 2] = True
    return gone


@pytest.mark.parametrize(
    "missing", [missing_singly, missing_every_third, missing_in_gaps, missing_for_long]
)
@pytest.mark.parametrize("walk", [0.0, 0.05])
def test_gaps_shorten_no_curve_and_change_no_variance(missing, walk):
    found, whole = [], []
    for seed in range(24):
        rng = np.random.default_rng(seed)
        x = noise(6000, 100 + seed, walk=walk)
        whole.append(streamed(x).result())
        x[missing(x.size, rng)] = np.nan
        found.append(streamed(x).result())
        assert found[-1].tau.tolist() == whole[-1].tau.tolist()
        assert found[-1].gaps.missing == np.count_nonzero(np.isnan(x))
    variances = np.array([wv.variance for wv in found])
    difference = variances - [wv.variance for wv in whole]
    mean = np.mean(difference, axis=0) / np.mean(variances, axis=0)
    error = np.std(difference, axis=0) / np.mean(variances, axis=0) / np.sqrt(len(found))
    # Within the chance of 96 comparisons, and 2 % that averages of gaps are taken for.
    assert np.all(np.abs(mean) < 4.5 * error + 0.02), (mean, error)
    # The errors that are stated are those that there are.
    fine = slice(0, 7)
    spread = np.std(variances, axis=0)[fine]
    stated = np.mean([np.sqrt(np.diag(wv.covariance)) for wv in found], axis=0)[fine]
    assert np.all((spread / stated > 0.5) & (spread / stated < 1.6)), spread / stated


def test_one_early_gap_costs_an_instant_of_a_long_stream():
    x = np.random.default_rng(1).normal(size=400_000)
    x[1000:1040] = np.nan
    found, exact = streamed(x).result(), gmwm.wavelet_variance(x, 0.1)
    np.testing.assert_array_equal(found.tau, exact.tau)
    np.testing.assert_allclose(found.variance, exact.variance, rtol=0.01)


def test_half_missing_singly_biases_no_coarse_level():
    # White noise of 1: what few windows give less what gaps add was bounded from below too early,
    # and these three levels were 11 % too large, with an error of 3 %.
    excess = []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        x = rng.normal(size=1024)
        whole = streamed(x).result()
        x[rng.random(x.size) < 0.5] = np.nan
        found = streamed(x).result()
        excess.append((2.0 * found.tau * (found.variance - whole.variance))[6:9])
    error = np.std(np.mean(excess, axis=1)) / np.sqrt(300)
    assert abs(np.mean(excess)) < 2.0 * error < 0.08


# -- numbers that are hard to add up ---------------------------------------------------------------


def exact_moments(steps, m):
    """Mean and mean square of the coefficients of integers, without any rounding till the end."""
    integral = np.concatenate([[0], np.cumsum(steps.astype(object))])
    w = integral[2 * m :] - 2 * integral[m:-m] + integral[: -2 * m]
    return float(sum(w)) / (2 * m * w.size), float(sum(w * w)) / (4 * m * m * w.size)


@pytest.mark.parametrize("drift", [0, 3])
def test_offsets_of_a_million_times_the_noise(drift):
    rng = np.random.default_rng(7)
    # Steps of 2^-20 of the noise, which floating-point numbers hold beside the offset.
    steps = rng.normal(scale=2**20, size=30_000).astype(np.int64)
    steps += 10**6 * 2**20 + drift * np.arange(steps.size) * 2**10
    found = streamed(steps * 2.0**-20).result()
    for level in (0, 4, 9):
        mean, square = exact_moments(steps, 2**level)
        assert found.variance[level] == pytest.approx(square * 2.0**-40, rel=1e-12)
        assert found.mean[level] == pytest.approx(mean * 2.0**-20, abs=1e-13 + 1e-12 * abs(mean))


def test_coarse_levels_of_a_drifting_offset():
    rng = np.random.default_rng(8)
    n = 2**18
    x = rng.normal(size=n) + 1e6 + 5e-3 * np.arange(n)
    x[0] = -1e6  # what everything refers to
    found = streamed(x).result()
    integral = np.concatenate([[0.0], np.cumsum(x.astype(np.longdouble) - 1e6)])
    for level in range(FINE, found.tau.size):
        m = 2**level
        w = (integral[2 * m :] - 2 * integral[m:-m] + integral[: -2 * m]) / (2 * m)
        w = w[:: m // 512]
        assert found.variance[level] == pytest.approx(float(np.mean(w * w)), rel=1e-9)


# -- what cannot be used ---------------------------------------------------------------------------


def test_infinite_blocks_change_nothing():
    stream = streamed(noise(10_000, 9))
    before = stream.result()
    block = noise(5000, 10)
    block[4321] = np.inf
    with pytest.raises(InputError, match=r"infinite at index 4321 \(sample 14,321\)"):
        stream.update(block)
    assert_same(stream.result(), before)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: gmwm.StreamingVariance(0.0), "dt"),
        (lambda: gmwm.StreamingVariance(0.1, ("a", "a")), "give different names"),
        (lambda: gmwm.StreamingVariance(0.1, ()), "at least one"),
        (lambda: gmwm.StreamingVariance(0.1, {"a": "deg/s"}), "rad/s"),
        (lambda: gmwm.StreamingVariance(0.1).update(np.zeros((3, 2))), "shape"),
        (lambda: gmwm.StreamingVariance(0.1).update(["x"]), "not a number"),
        (lambda: streamed(np.zeros(7)).result(), "8 or more"),
        (lambda: streamed(np.full(100, 3.0)).result(), r"constant \(3\)"),
        (lambda: streamed(np.full(100, np.nan)).result(), "0 samples"),
        (lambda: streamed(np.array([1.0, np.nan, 2.0, np.nan] * 9)).result(), "no two consecutive"),
        (lambda: gmwm.StreamingVariance.load(__file__), "write it with save"),
    ],
)
def test_a_sentence_for_what_cannot_be_used(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_gaps_are_counted_by_length_and_those_before_the_first_sample_are_none():
    x = noise(350, 1)
    for start, stop in ((0, 40), (100, 150), (200, 201), (203, 204), (300, 350)):
        x[start:stop] = np.nan
    gaps = streamed(x, [20, 120, 203, 310])._series[0].sums.gaps
    assert {int(i): gaps[i].tolist() for i in np.flatnonzero(gaps[:, 0])} == {0: [2, 2], 6: [1, 50]}


def test_a_sum_keeps_what_larger_numbers_would_swallow():
    total = np.zeros(2)
    for value in (1.0, 1e100, 1.0, -1e100):
        stream_kernels.add(total, 0, 1, value)
    assert total.sum() == 2.0


def test_memory_that_was_never_written_is_never_used(monkeypatch):
    """Whatever is in it: a signalling NaN warns where anything is added to it."""
    empty, signalling = np.empty, np.array(0x7FF0000000000001, dtype=np.uint64)

    def spoilt(shape, dtype=float):
        found = empty(shape, dtype)
        found.view(np.uint64)[...] = signalling
        return found

    x = noise(30_000, 3, offset=5.0)
    x[4000:4003] = np.nan
    expected = streamed(x)
    monkeypatch.setattr("gmwm.variance.streaming.np.empty", spoilt)
    stream = streamed(x, [9001])
    assert_same(stream.result(), expected.result())
    stored = stream._series[0].arrays()
    assert all(np.all(np.isfinite(stored[name])) for name in ("data", "present", "blocks"))
