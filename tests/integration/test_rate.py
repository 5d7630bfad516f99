"""The sampling rate in Hz, wherever an interval in seconds can be given."""

import numpy as np
import pytest

import gmwm
from gmwm import InputError, RandomWalk, WhiteNoise

MODEL = WhiteNoise(1e-3) + RandomWalk(1e-5)
X = gmwm.simulate(MODEL, 4096, 0.01, seed=1)

NEEDED = {
    "wavelet_variance": lambda **at: gmwm.wavelet_variance(X, **at).tau,
    "fit": lambda **at: list(gmwm.fit("N", X, **at).params.values()),
    "fit mle": lambda **at: list(gmwm.fit("N", X, method="mle", **at).params.values()),
    "select": lambda **at: list(gmwm.select(X, candidates=["N"], **at).fit.params.values()),
    "simulate": lambda **at: gmwm.simulate(MODEL, 10, seed=1, **at),
    "cramer_rao": lambda **at: gmwm.cramer_rao(MODEL, 1000, **at).covariance,
    "StreamingVariance": lambda **at: gmwm.StreamingVariance(**at).dt,
    "haar_covariance": lambda **at: gmwm.haar_covariance(MODEL.psd, 1000, **at),
}
DEFAULT = {
    "bound": lambda **at: gmwm.bound(MODEL, **at).K,
    "reduce": lambda **at: gmwm.reduce(MODEL, **at).K,
    "error_budget": lambda **at: gmwm.error_budget({"gyro_x": MODEL}, (10.0,), **at).rows,
    "certify": lambda **at: gmwm.certify({"gyro_x": MODEL}, {"gyro": (1e-3, 1e-5)}, **at).to_dict(),
}


@pytest.mark.parametrize("name", [*NEEDED, *DEFAULT])
def test_a_rate_is_one_over_an_interval(name):
    call = (NEEDED | DEFAULT)[name]
    assert str(call(rate=50)) == str(call(dt=0.02))


@pytest.mark.parametrize("name", NEEDED)
def test_without_either_the_answer_is_how_to_give_one(name):
    with pytest.raises(InputError, match=r"rate is missing: give it in Hz, as in rate=100"):
        NEEDED[name]()


@pytest.mark.parametrize("name", [*NEEDED, *DEFAULT])
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rate": 100, "dt": 0.01}, "dt = 0.01 and rate = 100: give only one"),
        ({"rate": 0}, "rate = 0: give a positive rate in Hz"),
        ({"rate": "100 Hz"}, "rate = '100 Hz': give a positive rate"),
        ({"rate": np.nan}, "rate = nan"),
    ],
)
def test_a_rate_that_is_none(name, given, words):
    with pytest.raises(InputError, match=words):
        (NEEDED | DEFAULT)[name](**given)


def test_a_wavelet_variance_has_its_own():
    wv = gmwm.wavelet_variance(X, rate=100)
    for call in (lambda: gmwm.fit("N", wv, rate=100), lambda: gmwm.select(wv, rate=100)):
        with pytest.raises(InputError, match="its own rate: leave dt and rate out"):
            call()
