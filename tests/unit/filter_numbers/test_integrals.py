"""Repeated integrals: closed forms, brute force over covariances, and simulation."""

import numpy as np
import pytest
from scipy.linalg import expm, toeplitz
from scipy.special import gammaln
from scipy.stats import chi2

import gmwm
from gmwm import BiasInstability, Process, QuantizationNoise, RateRamp, WhiteNoise, parameter
from gmwm.filter_numbers.propagation import integral_rms
from marks import EXAMPLES, FIRST, slow

FINE = 1e-7  # dt/t at which sums and integrals agree to 1e-6


def rms(process, t, dt, known=False):
    return integral_rms(process, [t], dt, known_start=known)[:, 0]


def staircase_weights(t, dt):
    """Weight of each held sample in the three integrals up to ``t``, by integrating its step."""
    start = np.arange(0.0, t - 1e-9 * dt, dt)
    ends = np.minimum(start + dt, t)
    powers = np.arange(1, 4)[:, None]
    factorial = np.array([1.0, 2.0, 6.0])[:, None]
    return ((t - start) ** powers - (t - ends) ** powers) / factorial


def by_covariance(covariance, t, dt):
    weights = staircase_weights(t, dt)
    return np.sqrt(np.einsum("ik,kl,il->i", weights, covariance, weights))


class SpectrumOf(Process):
    """Another process of which only the spectrum is told."""

    level: float = parameter("u", "scale")

    def __init__(self, inner, level=1.0):
        object.__setattr__(self, "inner", inner)
        super().__init__(level)

    def psd(self, f, dt):
        return self.level**2 * self.inner.psd(f, dt)

    def lines(self):
        return self.inner.lines()

    def drift_rate(self):
        return self.inner.drift_rate()


class PowerLaw(Process):
    """S(f) ~ f^-slope."""

    level: float = parameter("u", "scale")
    slope: float = parameter("-", lower=0.0, upper=4.0)

    def psd(self, f, dt):
        return self.level**2 * dt * (2.0 * np.sin(np.pi * f * dt)) ** -self.slope


# -- closed forms ---------------------------------------------------------------------------------


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize(
    ("process", "forms"),
    [
        (WhiteNoise(0.3), lambda t: 0.3 * t ** np.array([0.5, 1.5, 2.5]) / [1, 3**0.5, 20**0.5]),
        (
            gmwm.RandomWalk(0.02),
            lambda t: 0.02 * t ** np.array([1.5, 2.5, 3.5]) / np.sqrt([3.0, 20.0, 252.0]),
        ),
        (RateRamp(-0.1), lambda t: 0.1 * np.array([t**2 / 2, t**3 / 6, t**4 / 24])),
    ],
    ids=["white", "walk", "ramp"],
)
def test_textbook_formulas(process, forms, known):
    for t in (0.7, 10.0, 600.0):
        np.testing.assert_allclose(rms(process, t, FINE * t, known), forms(t), rtol=1e-6)


def continuous(a, q, h, p0, t):
    """Van Loan's method on the continuous-time system with three integrals appended."""
    p = len(h)
    n = p + 3
    drift = np.zeros((n, n))
    drift[:p, :p] = a
    drift[p, :p] = h
    drift[p + 1, p] = drift[p + 2, p + 1] = 1.0
    noise = np.zeros((n, n))
    noise[:p, :p] = q
    block = expm(np.block([[-drift, noise], [np.zeros((n, n)), drift.T]]) * t)
    transition = block[n:, n:].T
    start = np.zeros((n, n))
    start[:p, :p] = p0
    covariance = transition @ start @ transition.T + transition @ block[:n, n:]
    return np.sqrt(np.diag(covariance)[p:])


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("t", [0.5, 4.0, 20.0])
def test_gauss_markov_and_resonance_against_continuous_time(t, known):
    sigma, tau = 0.7, 6.0
    p0 = np.zeros((1, 1)) if known else np.array([[sigma**2]])
    expected = continuous(np.array([[-1 / tau]]), np.array([[2 * sigma**2 / tau]]), [1.0], p0, t)
    np.testing.assert_allclose(
        rms(gmwm.GaussMarkov(sigma, tau), t, FINE * t, known), expected, rtol=1e-6
    )

    frequency, zeta = 0.05, 0.2
    w = 2 * np.pi * frequency
    a = np.array([[0.0, w], [-w, -2 * zeta * w]])
    q = np.diag([0.0, 4 * zeta * w * sigma**2])
    p0 = np.zeros((2, 2)) if known else sigma**2 * np.eye(2)
    found = rms(gmwm.Resonance(sigma, frequency, zeta), t, 1e-4 * t, known)
    np.testing.assert_allclose(found, continuous(a, q, [1.0, 0.0], p0, t), rtol=1e-3)


@pytest.mark.parametrize("known", [True, False])
def test_a_line_has_a_random_phase_in_both_cases(known):
    amplitude, t = 3.0, 17.0
    process = gmwm.Sinusoid(amplitude, 0.03)
    w = 2 * np.pi * 0.03
    # From cos(w s + phase), mean square over the phase: |transform of (t - s)^(m-1)/(m-1)!|^2 / 2.
    turn = np.exp(1j * w * t)
    gains = [
        (turn - 1) / (1j * w),
        (turn - 1 - 1j * w * t) / (1j * w) ** 2,
        (turn - 1 - 1j * w * t + (w * t) ** 2 / 2) / (1j * w) ** 3,
    ]
    expected = amplitude * np.abs(gains) / np.sqrt(2.0)
    np.testing.assert_allclose(rms(process, t, FINE * t, known), expected, rtol=1e-6)


def test_quantization_is_bounded_as_an_angle():
    q, t, dt = 0.4, 50.0, 0.01
    known, unknown = rms(QuantizationNoise(q), t, dt, True), rms(QuantizationNoise(q), t, dt)
    assert known[0] == pytest.approx(q)
    assert unknown[0] == pytest.approx(np.sqrt(2.0) * q)
    # The residual at the start is a tilt that stays; without it, the angle is white.
    assert unknown[1:] == pytest.approx([q * t, q * t**2 / 2], rel=1e-3)
    assert known[1] == pytest.approx(q * np.sqrt(t * dt), rel=1e-3)
    assert known[2] == pytest.approx(q * np.sqrt(t**3 * dt / 3), rel=1e-3)


# -- brute force ----------------------------------------------------------------------------------

STATIONARY = [
    process
    for process in EXAMPLES
    if type(process).autocovariance is not Process.autocovariance
    and process.has_finite_state_space
    and not getattr(process, "d", 0)
]


@pytest.mark.parametrize("process", STATIONARY, ids=repr)
def test_stationary_start_equals_the_quadratic_form_of_the_autocovariance(process):
    dt = 0.13
    for steps in (1.0, 2.0, 3.0, 36.25, 77.0):
        lags = np.arange(int(np.ceil(steps)))
        covariance = toeplitz(process.autocovariance(lags, dt))
        expected = by_covariance(covariance, steps * dt, dt)
        np.testing.assert_allclose(rms(process, steps * dt, dt), expected, rtol=1e-9)


@pytest.mark.parametrize("steps", [20, 600])
def test_flicker_from_its_first_sample(steps):
    dt, level = 0.05, 0.3
    k = np.arange(steps)
    variogram = 4 / np.pi * np.cumsum(np.append(0.0, 1.0 / (2.0 * np.arange(1, steps) - 1.0)))
    covariance = 0.5 * (variogram[:, None] + variogram - variogram[np.abs(np.subtract.outer(k, k))])
    expected = level * by_covariance(covariance, steps * dt, dt)
    found = rms(BiasInstability(level), steps * dt, dt)
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def flicker_response(n):
    """Moving-average coefficients of fractionally integrated noise of order 1/2."""
    k = np.arange(n)
    return np.exp(gammaln(k + 0.5) - gammaln(k + 1.0)) / np.sqrt(np.pi)


def test_flicker_of_known_past():
    n, dt, level = 40_000, 0.01, 2.0
    response = flicker_response(n)
    # An innovation of age j acts through the repeated sums of the response.
    sums, expected = response, []
    for order in range(1, 4):
        sums = np.cumsum(sums)
        expected.append(level * dt**order * np.sqrt(np.sum(sums**2)))
    found = rms(BiasInstability(level), n * dt, dt, True)
    np.testing.assert_allclose(found, expected, rtol=1e-3)


# -- by the spectrum ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "process",
    [
        WhiteNoise(0.2),
        QuantizationNoise(0.1),
        gmwm.GaussMarkov(0.5, 0.4),
        gmwm.Resonance(0.4, 3.0, 0.05),
        gmwm.RandomWalk(0.3),
        gmwm.AR([0.9], 0.1),
        gmwm.Sinusoid(0.3, 0.7713),
        RateRamp(-0.2),
    ],
    ids=repr,
)
@pytest.mark.parametrize("known", [True, False])
def test_a_spectrum_alone_gives_the_same(process, known):
    times, dt = [1.0, 60.0, 600.0], 0.01
    expected = integral_rms(process, times, dt, known_start=False)
    found = integral_rms(SpectrumOf(process), times, dt, known_start=known)
    np.testing.assert_allclose(found, expected, rtol=0.01)


def test_a_spectrum_that_is_too_steep():
    with pytest.raises(gmwm.InputError, match=r"rises too fast .*: give the process a state_space"):
        rms(PowerLaw(1.0, 3.2), 10.0, 0.1)


def test_simulation_alone_is_not_enough():
    class Rounded(Process):
        lsb: float = parameter("u")

        def draw(self, n, dt, rng):
            return self.lsb * np.rint(rng.standard_normal(n))

    with pytest.raises(gmwm.InputError, match=r"Rounded can only be simulated"):
        rms(Rounded(1.0), 10.0, 0.1)


# -- simulation -----------------------------------------------------------------------------------

RUNS, N, DT = 300, 257, 0.02


def simulated_known(process, rng):
    """Series whose states are zero at the start, by the plain recursion."""
    if isinstance(process, BiasInstability):
        noise = process.B * rng.standard_normal((RUNS, N))
        response = toeplitz(flicker_response(N), np.zeros(N))
        return noise @ response.T
    form = process.state_space(DT)
    if process.lines():
        return np.array([process.simulate(N, DT, rng) for _ in range(RUNS)])
    values, vectors = np.linalg.eigh(form.process_noise)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    state = np.tile(form.initial_mean, (RUNS, 1))
    series = np.empty((RUNS, N))
    for k in range(N):
        series[:, k] = state @ form.output
        state = state @ form.transition.T + rng.standard_normal(state.shape) @ root.T
    return series + np.sqrt(form.measurement_noise) * rng.standard_normal(series.shape)


def integrated(series):
    """The held samples integrated one, two and three times, by running sums."""
    total = np.zeros((3, series.shape[0]))
    for y in series.T:
        total[2] += DT * total[1] + DT**2 / 2 * total[0] + DT**3 / 6 * y
        total[1] += DT * total[0] + DT**2 / 2 * y
        total[0] += DT * y
    return total


@pytest.mark.parametrize("known", [True, False], ids=["known", "unknown"])
@pytest.mark.parametrize("process", [*FIRST, PowerLaw(0.5, 1.2), slow(PowerLaw(0.5, 0.4))])
def test_simulated_errors_have_the_predicted_size(process, known):
    rng = np.random.default_rng(12)
    if process.is_band_limited:
        pytest.skip("white noise in its place: see below")
    if known and isinstance(process, PowerLaw):
        pytest.skip("no states to be known")
    if known:
        series = simulated_known(process, rng)
    else:
        series = np.array([process.simulate(N, DT, rng) for _ in range(RUNS)])
    found = integrated(series)
    expected = rms(process, N * DT, DT, known)
    if isinstance(process, RateRamp):
        np.testing.assert_allclose(np.abs(found), np.tile(expected, (RUNS, 1)).T, rtol=1e-9)
        return
    squares = (found / expected[:, None]) ** 2
    if process.lines():  # bounded, not Gaussian
        error = np.std(squares, axis=1) / np.sqrt(RUNS)
        assert np.all(np.abs(np.mean(squares, axis=1) - 1.0) < 4.5 * error + 1e-9)
        return
    # A known flicker is computed in continuous time: half a sample in N.
    slack = 1.0 + (1.0 / N if isinstance(process, BiasInstability) else 0.0)
    low, high = chi2.ppf([1e-5, 1.0 - 1e-5], RUNS) / RUNS
    assert np.all((squares.mean(axis=1) > low / slack) & (squares.mean(axis=1) < high * slack))


@pytest.mark.parametrize("process", [each for each in EXAMPLES if each.is_band_limited], ids=repr)
def test_a_filtered_noise_adds_up_like_white_noise_beyond_the_memory_of_its_filter(process):
    dt, n = 2.0, 2000
    expected = by_covariance(toeplitz(process.autocovariance(np.arange(n), dt)), n * dt, dt)
    np.testing.assert_allclose(rms(process, n * dt, dt), expected, rtol=0.01)
    np.testing.assert_allclose(rms(process, n * dt, dt), rms(WhiteNoise(process.N), n * dt, dt))


@pytest.mark.parametrize("process", FIRST)
def test_knowing_the_start_never_hurts(process):
    times = [0.05, 1.0, 60.0, 600.0]
    known = integral_rms(process, times, 0.01, known_start=True)
    unknown = integral_rms(process, times, 0.01, known_start=False)
    assert np.all(known <= unknown * (1.0 + 1e-9))
    assert np.all(known[:, 1:] > 0.0)


# -- laws -----------------------------------------------------------------------------------------

POWER_OF_TIME = {
    "u": 0.0, "u^2": 0.0, "-": 0.0, "u s": 1.0, "s": 1.0, "Hz": -1.0,
    "u/sqrt(Hz)": 0.5, "u/s/sqrt(Hz)": -0.5, "u/s": -1.0,
}  # fmt: skip


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("process", FIRST)
def test_the_unit_of_time_does_not_matter(process, known):
    # The same in minutes: every number with seconds in its unit changes by a power of 60.
    scale = 1.0 / 60.0
    values = {
        p.name: process.values[p.name] * scale ** POWER_OF_TIME[p.unit] for p in process.parameters
    }
    times = np.array([0.05, 1.0, 60.0])
    seconds = integral_rms(process, times, 0.01, known_start=known)
    minutes = integral_rms(
        process.with_values(**values), scale * times, scale * 0.01, known_start=known
    )
    back = scale ** np.arange(1.0, 4.0)[:, None]
    np.testing.assert_allclose(minutes, back * seconds, rtol=1e-6)
