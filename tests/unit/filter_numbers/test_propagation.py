"""The filter of one axis: against sums over samples, closed forms and a simulated filter."""

import math

import numpy as np
import pytest

import gmwm
from error_models import DT, TRUTHS
from gmwm import BiasInstability, GaussMarkov, Process, RandomWalk, WhiteNoise
from gmwm.errors import InputError
from gmwm.filter_numbers import Chain
from gmwm.process import as_model

FREE = (0.0, 0.0, 0.0)
TINY = as_model(WhiteNoise(1e-30))


def free(order):
    """Nothing is known, nothing is aided, and the start is right."""
    return Chain(order, 1.0, settled=0.0, initial_sd=FREE)


def weights(order, n, dt):
    """Of the samples in the last integral."""
    # A power of the age, integrated over the step of the sample.
    age = (n - np.arange(n)) * dt
    return (age**order - (age - dt) ** order) / math.factorial(order)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_white_noise_and_walk_grow_as_they_are_known_to(order):
    N, K, t = 2e-3, 3e-5, 100.0
    chain = free(order)
    white = chain.errors(as_model(WhiteNoise(N)), TINY, DT, (t,)).actual[0, -1, -1]
    expected = N**2 * t ** (2 * order - 1) / {1: 1, 2: 3, 3: 20}[order]
    assert white == pytest.approx(expected, rel=1e-3)
    walk = chain.errors(as_model(RandomWalk(K)), TINY, DT, (t,)).actual[0, -1, -1]
    expected = K**2 * t ** (2 * order + 1) / {1: 3, 2: 20, 3: 252}[order]
    assert walk == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_growth_is_that_of_a_sum_over_samples(order):
    truth, n, dt = WhiteNoise(1e-3) + GaussMarkov(2e-3, 3.0), 400, 0.05
    lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    covariance = truth.autocovariance(lags, dt)
    w = weights(order, n, dt)
    found = free(order).errors(truth, TINY, dt, (n * dt,)).actual[0, -1, -1]
    assert found == pytest.approx(w @ covariance @ w, rel=1e-9)


@pytest.mark.parametrize("name", TRUTHS)
@pytest.mark.parametrize("order", [1, 3])
def test_a_filter_that_believes_the_truth_is_consistent_in_every_direction(name, order):
    errors = Chain(order, 1.0, 60.0).errors(
        TRUTHS[name], TRUTHS[name], DT, (1.0, 60.0, 600.0), true_sd=1e-4, believed_sd=1e-4,
        every_fix=True,
    )  # fmt: skip
    assert errors.worst() == pytest.approx(1.0, abs=1e-5)
    assert errors.nees() == pytest.approx(1.0, abs=1e-5)
    assert errors.tightness() == pytest.approx(1.0, abs=1e-5)
    assert errors.time[0] == -59.0
    assert list(errors.time[-4:]) == [0.0, 1.0, 60.0, 600.0] or errors.time[-4] < 0.0


def filtered(errors, dt, fixes, noise, start, N, K, sd, rng):
    """Errors of velocity and position of a filter, written here once more, and what it believes."""
    runs, n = errors.shape
    per = round(1.0 / dt)
    x = start * rng.standard_normal((runs, 2))
    b = np.zeros(runs)
    P = np.diag([*start**2, sd**2])
    A = np.array([[1.0, 0.0, dt], [dt, 1.0, dt**2 / 2.0], [0.0, 0.0, 1.0]])
    g = np.array([dt, dt**2 / 2.0])
    Q = np.zeros((3, 3))
    Q[:2, :2] = N**2 / dt * np.outer(g, g)
    Q[2, 2] = K**2 * dt
    A[:2, 2] = -g
    for k in range(n):
        rate = errors[:, k] - b
        x = np.column_stack([x[:, 0] + dt * rate, x[:, 1] + dt * x[:, 0] + dt**2 / 2.0 * rate])
        P = A @ P @ A.T + Q
        if (k + 1) % per == 0 and k < fixes * per:
            gain = P[:, 1] / (P[1, 1] + noise**2)
            innovation = x[:, 1] + noise * rng.standard_normal(runs)
            x -= np.outer(innovation, gain[:2])
            b -= gain[2] * innovation
            P -= np.outer(gain, P[1])
    return x, P[:2, :2]


def simulated_nees(x, P):
    """Mean and its standard error."""
    observed = np.einsum("ri,ij,rj->r", x, np.linalg.inv(P), x) / 2.0
    return observed.mean(), observed.std(ddof=1) / np.sqrt(len(x))


def test_a_simulated_filter_has_the_errors_that_are_predicted():
    """400 runs of the filter itself; the truth is not what it believes."""
    truth, N, K, sd = WhiteNoise(1e-3) + GaussMarkov(5e-3, 20.0), 1.5e-3, 5e-4, 4e-3
    dt, fixes, coast, runs, noise = 0.1, 30, 20.0, 400, 0.05
    rng = np.random.default_rng(4)
    n = fixes * round(1.0 / dt) + round(coast / dt)
    errors = np.array([truth.simulate(n, dt, rng) for _ in range(runs)])
    start = np.array([0.02, 0.1])
    x, P = filtered(errors, dt, fixes, noise, start, N, K, sd, rng)
    chain = Chain(2, noise, float(fixes), 1.0, tuple(start))
    found = chain.errors(truth, WhiteNoise(N) + RandomWalk(K), dt, (coast,), believed_sd=sd)
    assert found.predicted[0] == pytest.approx(P, rel=1e-6)
    mean, error = simulated_nees(x, P)
    assert abs(mean - found.nees()[0]) < 4.0 * error
    assert np.mean(x[:, 1] ** 2) == pytest.approx(
        found.actual[0, 1, 1], rel=4.0 / np.sqrt(runs / 2)
    )


def test_flicker_noise_over_ten_minutes_has_its_lowest_frequencies():
    """By a bank of processes, finer than that of the package; a record of 1/f that is as long as a
    run lacks what lies below, and shows errors that are too small.
    """
    N, B, dt, fixes, coast, runs = 1e-4, 5e-5, 1.0, 120, 600.0, 1000
    truth = WhiteNoise(N) + BiasInstability(B)
    numbers = gmwm.bound({"accel_x": truth}, "N+K", coast, dt=dt)["accel_x"]
    rng = np.random.default_rng(5)
    n, start = fixes + round(coast / dt), np.array([0.01, 0.1])
    chain = Chain(2, 1.0, float(fixes), 1.0, tuple(start))
    found = chain.errors(truth, numbers.model, dt, (coast,), believed_sd=numbers.initial_sd)
    tau = np.geomspace(0.3, 1e6, 28)
    variance = B**2 / np.pi * np.log(tau[1] / tau[0])
    slow = np.sqrt(variance) * rng.standard_normal((runs, tau.size))
    bank, keep = np.empty((runs, n)), np.exp(-dt / tau)
    drive = np.sqrt(variance * (1.0 - keep**2))
    for k in range(n):
        bank[:, k] = np.sum(slow, axis=1)
        slow = slow * keep + drive * rng.standard_normal(slow.shape)
    f = np.fft.rfftfreq(n, dt)[1:]
    height = np.sqrt(BiasInstability(B).psd(f, dt) * n / dt)
    waves = rng.standard_normal((2, runs, f.size)) / np.sqrt(2.0)
    short = np.fft.irfft(np.pad((waves[0] + 1j * waves[1]) * height, ((0, 0), (1, 0))), n)
    expected = found.nees()[0]
    white = N / np.sqrt(dt) * rng.standard_normal((runs, n))
    for flicker, is_whole in ((bank, True), (short, False)):
        x, P = filtered(
            flicker + white, dt, fixes, 1.0, start, numbers.N, numbers.K, numbers.initial_sd, rng
        )
        mean, error = simulated_nees(x, P)
        if is_whole:
            assert found.predicted[0] == pytest.approx(P, rel=1e-6)
            assert abs(mean - expected) < 4.0 * error
        else:
            assert mean < expected - 5.0 * error


def test_a_process_known_by_simulation_only_is_refused():
    class Drawn(Process):
        def draw(self, n, dt, rng):
            return rng.standard_normal(n)

    with pytest.raises(InputError, match="only be simulated"):
        free(1).errors(WhiteNoise(1.0) + Drawn(), TINY, DT, (1.0,))
