"""The diffuse likelihood against dense algebra."""

import numpy as np
import pytest

import gmwm
from gmwm import AR, ARMA, GaussMarkov, QuantizationNoise, RandomWalk, Sinusoid, WhiteNoise
from gmwm.estimate.likelihood.likelihood import Columns, KalmanLikelihood

MODELS = [
    (WhiteNoise(0.3),),
    (WhiteNoise(0.2), GaussMarkov(0.5, 7.0), RandomWalk(0.1)),
    (QuantizationNoise(0.7),),
    (QuantizationNoise(0.7), RandomWalk(0.2)),
    (AR([1.5, -0.7], 0.3), WhiteNoise(0.5)),
    (ARMA([0.6, 0.2], [0.5], 0.3),),
    (gmwm.Resonance(0.4, 0.2, 0.1),),
    (WhiteNoise(0.3), Sinusoid(1.0, 0.03)),
    (GaussMarkov(1.0, 1e5), WhiteNoise(0.1)),
]
models = pytest.mark.parametrize("processes", MODELS, ids=repr)
N, DT = 60, 0.5


def noise_covariance(processes, n, dt):
    """Autocovariances of the stationary terms, and min(t, s) of a walk from zero."""
    k = np.arange(n)
    lag = np.abs(k[:, None] - k)
    total = np.zeros((n, n))
    for process in processes:
        if isinstance(process, RandomWalk):
            total += process.K**2 * dt * np.minimum(k[:, None], k)
        else:
            total += process.autocovariance(lag, dt)
    return total


def restricted(y, covariance, regressors):
    """Log-density of the contrasts of y with the regressors, less log det X'X / 2."""
    present = ~np.isnan(y)
    x, y = regressors[present], y[present]
    inverse = np.linalg.inv(covariance[np.ix_(present, present)])
    information = x.T @ inverse @ x
    beta = np.linalg.solve(information, x.T @ inverse @ y)
    rest = y - x @ beta
    determinants = [np.linalg.slogdet(m)[1] for m in (information, np.linalg.inv(inverse))]
    free = y.size - x.shape[1]
    value = -0.5 * (free * np.log(2.0 * np.pi) + sum(determinants) + rest @ inverse @ rest)
    return value, beta, np.linalg.inv(information)


def series(n=N, seed=1, missing=()):
    y = np.random.default_rng(seed).normal(size=n)
    y[list(missing)] = np.nan
    return y


@models
@pytest.mark.parametrize(
    ("missing", "drift"), [((), "open"), ((0,), None), ((0, 1, 2, 20, 21, 40, N - 1), 0.3),
                           ((0, 1, 2, 20, 21, 40, N - 1), "open")], ids=repr
)  # fmt: skip
def test_it_is_the_dense_restricted_likelihood(processes, missing, drift):
    y = series(missing=missing)
    has_drift = drift is not None
    given = None if drift == "open" else drift
    likelihood = KalmanLikelihood(Columns(y, DT, given, has_drift))
    regressors = np.ones((N, 1))
    k = np.arange(N)
    if drift == "open":
        regressors = np.column_stack([regressors, k / (0.5 * (N - 1)) - 1.0])
    target = y - (given or 0.0) * DT * k
    value, beta, covariance = restricted(target, noise_covariance(processes, N, DT), regressors)
    assert likelihood(processes) == pytest.approx(value, rel=1e-9, abs=1e-7)
    if drift == "open":
        slope, per_second = likelihood.columns.slope(processes), 1.0 / (0.5 * (N - 1) * DT)
        assert slope.value == pytest.approx(beta[1] * per_second, rel=1e-7)
        assert slope.variance == pytest.approx(covariance[1, 1] * per_second**2, rel=1e-7)


@models
def test_a_constant_does_not_matter(processes):
    y = series(500, missing=(0, 30, 31))
    plain = KalmanLikelihood(Columns(y, DT, None, False))(processes)
    for offset in (1.0, -1e3, 1e6):
        moved = KalmanLikelihood(Columns(y + offset, DT, None, False))(processes)
        # Doubles of 1e6 hold 1e-10: so much the samples themselves have changed.
        assert moved == pytest.approx(plain, rel=1e-9, abs=1e-13 * abs(offset) * 500 + 1e-8)


@models
def test_a_ramp_does_not_matter_where_the_drift_is_free(processes):
    y = series(500, missing=(0, 30, 31))
    plain = KalmanLikelihood(Columns(y, DT, None, True))
    for offset, slope in ((0.0, 1.0), (5.0, -0.1), (1e6, 10.0)):
        ramp = KalmanLikelihood(Columns(y + offset + slope * DT * np.arange(500), DT, None, True))
        assert ramp(processes) == pytest.approx(plain(processes), rel=1e-8, abs=1e-6)
        found = ramp.columns.slope(processes).value
        before = plain.columns.slope(processes).value
        assert found - slope == pytest.approx(before, abs=1e-8)


@models
def test_a_given_drift_is_removed(processes):
    y = series(300)
    plain = KalmanLikelihood(Columns(y, DT, None, False))(processes)
    ramp = KalmanLikelihood(Columns(y + 0.7 * DT * np.arange(300), DT, 0.7, True))(processes)
    assert ramp == pytest.approx(plain, rel=1e-9)


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_every_unit_of_the_signal_is_as_good(offset):
    """Scaling a series by s scales the density of its n - 1 contrasts by s^-(n-1)."""
    y = series(400, seed=2)
    processes = (WhiteNoise(0.3), GaussMarkov(0.5, 20.0))
    plain = KalmanLikelihood(Columns(y, 1.0, None, False))(processes)
    for scale in (1e-8, 1e5):
        scaled = [p.with_amplitude(p.values[p.linear_parameter.name] ** 2 * scale**2)
                  for p in processes]  # fmt: skip
        value = KalmanLikelihood(Columns(scale * (y + offset), 1.0, None, False))(scaled)
        # The regressor is not scaled: its information is, by s^-2.
        assert value == pytest.approx(plain - 399 * np.log(scale), rel=1e-8)


def test_the_first_and_last_missing_samples_are_as_if_they_were_not_there():
    y = series(200, seed=3)
    padded = np.concatenate([[np.nan] * 7, y, [np.nan] * 5])
    processes = (WhiteNoise(0.3), GaussMarkov(0.5, 20.0), QuantizationNoise(0.1))
    assert KalmanLikelihood(Columns(padded, DT, None, False))(processes) == pytest.approx(
        KalmanLikelihood(Columns(y, DT, None, False))(processes), rel=1e-12
    )


@models
def test_without_regressors_it_is_the_dense_likelihood(processes):
    y = series(missing=(17, 18))
    value, _, _ = restricted(y, noise_covariance(processes, N, DT), np.ones((N, 0)))
    likelihood = KalmanLikelihood(Columns.without_regressors(y, DT))
    assert likelihood(processes) == pytest.approx(value, rel=1e-9, abs=1e-7)
