"""An ARMA process turned into the Gauss-Markov processes that it is the sum of."""

import numpy as np
import pytest

import gmwm
from gmwm import ARMA, MLE, GaussMarkov, InputError, WhiteNoise, to_gauss_markov
from gmwm.estimate import estimate

TWO = ARMA([1.4, -0.45], [-0.7], 1.0)
WITH_NOISE = ARMA([1.4, -0.45], [-0.9, 0.1], 2.0)
THREE = ARMA([2.076, -1.204, 0.1275], [-1.867, 0.8691], 3.145e-5)


@pytest.mark.parametrize("arma", [TWO, THREE])
def test_the_sum_has_the_autocovariance_of_the_arma(arma):
    form = to_gauss_markov(arma, dt=0.1)
    lag = np.arange(200)
    expected = arma.autocovariance(lag, 0.1)
    np.testing.assert_allclose(
        form.model.autocovariance(lag, 0.1), expected, rtol=1e-9, atol=1e-12 * expected[0]
    )


def test_equal_orders_leave_white_noise():
    form = to_gauss_markov(WITH_NOISE, dt=0.1)
    f = np.geomspace(1e-3, 5.0, 30)
    np.testing.assert_allclose(form.model.psd(f, 0.1), WITH_NOISE.psd(f, 0.1), rtol=1e-10)
    assert isinstance(form.model.terms[0], WhiteNoise)


@pytest.mark.parametrize("arma", [TWO, WITH_NOISE, THREE])
def test_the_jacobian_is_the_derivative(arma):
    form = to_gauss_markov(arma, dt=0.1)
    values = np.array(list(arma.values.values()))

    def logarithms(moved):
        at = arma.with_values(**dict(zip(arma.values, moved, strict=True)))
        return np.log(list(to_gauss_markov(at, dt=0.1).params.values()))

    steps = np.diag(1e-7 * np.abs(values))
    for k, step in enumerate(steps):
        slope = (logarithms(values + step) - logarithms(values - step)) / (2.0 * step[k])
        scale = 1e-4 * np.max(np.abs(form.jacobian[:, k]))
        np.testing.assert_allclose(form.jacobian[:, k], slope, atol=scale)


def test_likelihood_and_its_errors_do_not_depend_on_the_form():
    truth = GaussMarkov(1.0, 2.0) + GaussMarkov(1.0, 30.0)
    x = truth.simulate(2_000, 1.0, 7)
    sum_ = gmwm.fit(truth.opened(), x, 1.0, method="mle")
    start = ARMA([1.5738, -0.5866], [-0.8], 1.0)
    form = to_gauss_markov(gmwm.fit(ARMA(2, 1), x, 1.0, method=MLE(start=start)))
    for key, error in sum_.stderr.items():
        assert form.params[key] == pytest.approx(sum_.params[key], abs=0.05 * error)
        assert form.stderr[key] == pytest.approx(error, rel=0.05)
        low, high = form.interval()[key]
        assert low < form.params[key] < high
    assert not form.reason
    assert "condition number" in str(form)


@pytest.mark.parametrize(
    ("arma", "reason"),
    [
        (ARMA([1.8, -0.9], [0.1], 1.0), "complex"),
        (ARMA([0.2, 0.35], [0.1], 1.0), "between 0 and 1"),
        (ARMA([1.4, -0.45], [0.7], 1.0), "not positive"),
    ],
)
def test_an_arma_that_is_no_such_sum_has_a_reason(arma, reason):
    form = to_gauss_markov(arma, dt=1.0)
    assert form.model is None and not form.params and reason in form.reason
    assert form.roots.size == 2


def test_an_undetermined_process_has_no_delta_method():
    """Short records leave the slower process as uncertain as a factor e."""
    truth = GaussMarkov(1.0, 2.0) + GaussMarkov(0.5, 100.0)
    start = ARMA([1.596, -0.6005], [-0.8], 1.0)
    forms = []
    for seed in range(3):
        x = truth.simulate(400, 1.0, seed)
        forms.append(to_gauss_markov(estimate(ARMA(2, 1), x, 1.0, MLE(start=start))))
    unknown = [form for form in forms if not form.stderr]
    assert unknown and all(form.reason for form in unknown)


@pytest.mark.parametrize("bad", [WhiteNoise(1.0), ARMA([0.5, 0.1, 0.1], [0.2], 1.0), TWO])
def test_what_is_no_such_arma_is_rejected(bad):
    with pytest.raises(InputError):
        to_gauss_markov(bad, dt=None if bad is TWO else 1.0)
