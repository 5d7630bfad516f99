"""Every process obeys the same laws: closed form = spectral integral = mean over simulation."""

import json

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gmwm
from gmwm.process import CATALOGUE, Process
from gmwm.process.spectral import haar_gain, haar_variance
from gmwm.variance import haar_covariance, wavelet_variance
from marks import EXAMPLES, FIRST, slow
from places import GOLDEN

CURVES = json.loads((GOLDEN / "haar_wavelet_variance.json").read_text())["curves"]
LEVELS = 2.0 ** np.arange(20)


def name(value: object) -> str:
    return repr(value)


@pytest.mark.parametrize("curve", CURVES, ids=lambda c: f"{c['process']}-{c['parameters']}")
def test_closed_form_equals_sixty_digit_values(curve):
    process = getattr(gmwm, curve["process"])(**curve["parameters"])
    np.testing.assert_allclose(
        process.haar_variance(LEVELS * curve["dt"], curve["dt"]),
        curve["haar_wavelet_variance"],
        rtol=1e-9,
    )


def test_every_built_in_process_has_examples():
    assert [kind.__name__ for kind in CATALOGUE if not kind.examples()] == []


def test_one_process_is_opened_as_a_model_is():
    assert gmwm.WhiteNoise(0.2).opened() == gmwm.WhiteNoise()
    assert gmwm.GaussMarkov(1.0, 2.0).opened() == gmwm.GaussMarkov()


@pytest.mark.parametrize("process", EXAMPLES, ids=name)
def test_closed_form_equals_spectral_integral(process):
    if isinstance(process, gmwm.RateRamp):
        pytest.skip("a ramp is deterministic: it has no spectrum")
    for dt in (1.0, 0.01):
        tau = LEVELS * dt
        integral = haar_variance(process.psd, tau, dt)
        for frequency, amplitude in process.lines():
            alias = abs(frequency * dt - np.rint(frequency * dt))
            gain = np.array([haar_gain(m, np.array([alias]))[0] for m in LEVELS])
            integral = integral + 0.5 * amplitude**2 * gain
        np.testing.assert_allclose(process.haar_variance(tau, dt), integral, rtol=1e-9)


@pytest.mark.parametrize("process", EXAMPLES, ids=name)
def test_closed_form_at_averaging_times_that_are_not_powers_of_two(process):
    lengths, dt = np.array([3, 7, 100, 1023]), 0.25
    if process.lines() or isinstance(process, gmwm.RateRamp):
        expected = [mean_square_difference(process, m, dt) for m in lengths]
    else:
        expected = haar_variance(process.psd, lengths * dt, dt)
    np.testing.assert_allclose(process.haar_variance(lengths * dt, dt), expected, rtol=1e-8)


def mean_square_difference(process, m, dt):
    """Half the difference of two means over m samples each, squared, over all phases of a line."""
    t = dt * np.arange(2 * m)
    if isinstance(process, gmwm.RateRamp):
        series = process.values["R"] * t[None]
    else:
        ((frequency, amplitude),) = process.lines()
        phases = np.array([0.0, 0.5 * np.pi])
        series = amplitude * np.cos(2 * np.pi * frequency * t + phases[:, None])
    return np.mean(((np.mean(series[:, m:], axis=1) - np.mean(series[:, :m], axis=1)) / 2.0) ** 2)


@pytest.mark.parametrize("process", FIRST)
def test_closed_form_equals_mean_over_simulation(process):
    n, runs, dt = 2048, 20, 0.25
    rng = np.random.default_rng(20)
    waves = [wavelet_variance(process.simulate(n, dt, rng), dt).variance for _ in range(runs)]
    expected = process.haar_variance(2.0 ** np.arange(11) * dt, dt)
    if isinstance(process, gmwm.RateRamp):
        np.testing.assert_allclose(waves[0], expected, rtol=1e-9)
        return
    if process.lines():
        # Without noise the mean square of a line departs from its expectation only by the part
        # of a period that is left over.
        assert np.all(np.abs(np.mean(waves, axis=0)[:6] / expected[:6] - 1.0) < 0.05)
        return
    covariance = haar_covariance(process.psd, n, dt)
    error = np.sqrt(np.diag(covariance) / runs)
    z = (np.mean(waves, axis=0) - expected) / error
    assert np.max(np.abs(z)) < 4.5, z


@pytest.mark.parametrize(
    "process",
    [gmwm.WhiteNoise(1.0), gmwm.RandomWalk(0.1), slow(gmwm.GaussMarkov(1.0, 20.0)),
     slow(gmwm.Resonance(1.0, 0.05, 0.1))],
    ids=name,
)  # fmt: skip
def test_variance_of_the_estimates_is_as_predicted(process):
    """It follows from the spectrum alone, which the other laws compare with each process."""
    n, runs = 512, 400
    rng = np.random.default_rng(21)
    waves = [wavelet_variance(process.simulate(n, 1.0, rng), 1.0).variance for _ in range(runs)]
    predicted = haar_covariance(process.psd, n, 1.0)
    ratio = np.var(waves, axis=0, ddof=1) / np.diag(predicted)
    # The sampling error of a variance, with the kurtosis of a chi-square of few degrees of freedom.
    dof = 2.0 * process.haar_variance(2.0 ** np.arange(9), 1.0) ** 2 / np.diag(predicted)
    error = np.sqrt((2.0 + 12.0 / dof) / runs)
    assert np.max(np.abs(ratio - 1.0) / error) < 4.5, ratio


@pytest.mark.parametrize("process", EXAMPLES, ids=name)
def test_autocovariance_of_the_state_space_is_that_of_the_process(process):
    dt = 0.5
    form = process.state_space(dt)
    lags = np.arange(6)
    state = form.initial_covariance
    found = []
    for _ in lags:
        found.append(form.output @ state @ form.output)
        state = form.transition @ state
    found = np.array(found)
    found[0] += form.measurement_noise
    if process.is_band_limited:
        # White noise of the same density stands for it: its variance is the sum over all lags.
        covariance = process.autocovariance(np.arange(4000), dt)
        total = 2.0 * np.sum(covariance) - covariance[0]
        assert found[0] == pytest.approx(total, rel=1e-3)  # of a sharp bend at 0, a tail
        assert not np.any(found[1:])
        return
    try:
        expected = process.autocovariance(lags, dt)
    except gmwm.InputError:
        # Integrated processes and flicker noise: compare the growth of the variance instead.
        assert np.all(np.diff(form.output_variance(50)) > -1e-12)
        return
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * expected[0])
    np.testing.assert_allclose(form.output_variance(30), expected[0], rtol=1e-9)  # stationary


@pytest.mark.parametrize("process", EXAMPLES, ids=name)
def test_spectrum_integrates_to_the_variance(process):
    try:
        variance = float(process.autocovariance(np.array([0]), 1.0)[0])
    except gmwm.InputError:
        pytest.skip("no variance")
    if process.lines():
        assert variance == pytest.approx(sum(0.5 * a**2 for _, a in process.lines()))
        return
    edges = np.concatenate([[0.0], np.geomspace(1e-14, 0.5, 4000)])
    x, w = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(edges)[:, None]
    f = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * x).ravel()
    integral = 2.0 * np.sum((half * w).ravel() * process.psd(f, 1.0))
    assert integral == pytest.approx(variance, rel=1e-6)


def test_only_integrated_processes_and_flicker_noise_have_no_variance():
    """What the tests above may pass over, and nothing else."""
    without = []
    for process in EXAMPLES:
        try:
            process.autocovariance(np.arange(2), 1.0)
        except gmwm.InputError:
            without.append(type(process).__name__)
    assert set(without) == {"RandomWalk", "RateRamp", "BiasInstability", "ARIMA"}
    assert without.count("ARIMA") == 1


def test_random_walk_state_space_grows_as_it_should():
    form = gmwm.RandomWalk(0.3).state_space(2.0)
    np.testing.assert_allclose(form.output_variance(5), 0.09 * 2.0 * np.arange(5))


def test_flicker_state_space_follows_one_over_f():
    """The bank's wavelet variance stays within a few per cent over its span."""
    process = gmwm.BiasInstability(1.0)
    form = process.state_space(1.0)
    tau = 2.0 ** np.arange(3, 15)
    phi, variance = np.diag(form.transition), np.diag(form.initial_covariance)
    bank = sum(
        gmwm.GaussMarkov(np.sqrt(v), -1.0 / np.log(p)).haar_variance(tau, 1.0)
        for p, v in zip(phi, variance, strict=True)
    )
    np.testing.assert_allclose(bank, process.haar_variance(tau, 1.0), rtol=0.1)


@settings(max_examples=200, deadline=None)
@given(st.floats(-3.0, 12.0), st.floats(0.0, 12.0))
def test_gauss_markov_is_exact_for_any_correlation_and_averaging_time(log_tau, log_m):
    m = float(np.rint(10.0**log_m))
    tau = 10.0**log_tau
    found = gmwm.GaussMarkov(1.0, tau).haar_variance(np.array([m]), 1.0)[0]
    with mpmath.workdps(60):
        a = 1 / mpmath.mpf(tau)
        phi = mpmath.exp(-a)
        numerator = m * (1 - phi**2) - phi * (3 - 4 * phi**m + phi ** (2 * m))
        expected = numerator / (2 * mpmath.mpf(m) ** 2 * (1 - phi) ** 2)
    assert found == pytest.approx(float(expected), rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.floats(-5.0, -0.4), st.floats(0.001, 0.95), st.integers(0, 6))
def test_resonance_is_exact_at_any_frequency_and_damping(log_frequency, damping, level):
    frequency = 10.0**log_frequency
    m = 2**level
    found = gmwm.Resonance(1.0, frequency, damping).haar_variance(np.array([float(m)]), 1.0)[0]
    with mpmath.workdps(40):
        zeta = mpmath.mpf(damping)
        w0 = 2 * mpmath.pi * mpmath.mpf(frequency)
        wd = w0 * mpmath.sqrt(1 - zeta**2)

        def covariance(k):
            return mpmath.exp(-zeta * w0 * k) * (
                mpmath.cos(wd * k) + zeta * w0 / wd * mpmath.sin(wd * k)
            )

        weights = np.concatenate([np.ones(m), -np.ones(m)])
        correlation = np.correlate(weights, weights, "full")[2 * m - 1 :]
        terms = [covariance(k) * float(c) * (1 if k == 0 else 2) for k, c in enumerate(correlation)]
        expected = mpmath.fsum(terms) / (4 * m * m)
    assert found == pytest.approx(float(expected), rel=1e-8)


class PowerLaw(Process):
    """A user's process that gives a spectrum and nothing else."""

    level: float = gmwm.parameter("u", role="scale")
    slope: float = gmwm.parameter("-", lower=0.0, upper=1.9)

    def psd(self, f, dt):
        return self.level**2 * dt * (2.0 * np.sin(np.pi * f * dt)) ** -self.slope


def test_a_process_with_a_spectrum_only_does_all_that_a_built_in_one_does():
    truth = PowerLaw(0.5, 1.2) + gmwm.WhiteNoise(2.0)
    assert np.all(truth.haar_variance(LEVELS, 1.0) > 0.0)
    x = truth.simulate(20_000, 1.0, seed=4)
    fit = gmwm.fit(truth.opened(), x, dt=1.0)
    assert fit.valid, fit.message
    for key, (low, high) in fit.interval(0.999).items():
        assert low < truth.params[key] < high


def test_a_process_with_a_spectrum_only_equals_the_built_in_one():
    flicker = PowerLaw(level=0.3 / np.sqrt(1.0), slope=1.0)
    built_in = gmwm.BiasInstability(0.3)
    np.testing.assert_allclose(
        flicker.haar_variance(LEVELS, 1.0), built_in.haar_variance(LEVELS, 1.0), rtol=1e-9
    )


def test_line_covariance_against_simulation():
    model = gmwm.WhiteNoise(1.0) + gmwm.Sinusoid(2.0, 0.03)
    n, runs = 1024, 400
    rng = np.random.default_rng(8)
    found = [wavelet_variance(model.simulate(n, 1.0, rng), 1.0) for _ in range(runs)]
    waves = [each.variance for each in found]
    predicted = found[0].covariance_under(model.psd, model.lines())
    ratio = np.var(waves, axis=0, ddof=1)[:7] / np.diag(predicted)[:7]
    assert np.all(np.abs(ratio - 1.0) < 4.5 * np.sqrt(2.5 / runs)), ratio


def test_simulation_repeats_with_the_seed_and_starts_stationary():
    process = gmwm.GaussMarkov(2.0, 500.0)
    np.testing.assert_array_equal(process.simulate(10, 1.0, 3), process.simulate(10, 1.0, 3))
    rng = np.random.default_rng(5)
    first = np.array([process.simulate(2, 1.0, rng)[0] for _ in range(2000)])
    assert np.std(first) == pytest.approx(2.0, rel=4.0 / np.sqrt(2 * 2000))


def test_the_shortest_simulations():
    for process in EXAMPLES:
        assert [process.simulate(n, 1.0, 0).size for n in (1, 2, 3)] == [1, 2, 3], process
