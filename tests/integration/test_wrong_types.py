"""Values of the wrong type, size or shape: one sentence, never a traceback of another kind."""

import json
from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import Channel, GaussMarkov, InputError, RandomWalk, RateRamp, WhiteNoise
from gmwm._core import checks
from gmwm.estimate import METHODS

TRUTH = WhiteNoise(0.2) + RandomWalk(0.02)
MODEL = TRUTH.opened()
X = TRUTH.simulate(1000, 1.0, seed=1)
WV = gmwm.wavelet_variance(X, 1.0)
FIT = gmwm.fit(MODEL, WV)


def refused(call, words):
    """Whether the call ends in one sentence with these words."""
    with pytest.raises(InputError) as caught:
        call()
    said = str(caught.value)
    assert words in said
    assert "\n" not in said
    assert len(said) < 300


# -- numbers --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "value", ["a", None, True, 1j, [1.0], np.ones(2), np.nan, np.inf, 10**400, {}, np.ones(10**4)]
)
def test_what_is_no_number_is_refused_everywhere(value):
    refused(lambda: checks.positive("x", value), "x = ")
    refused(lambda: checks.whole("x", value, 0), "x = ")
    refused(lambda: checks.share("x", value, 0.5), "x = ")
    refused(lambda: checks.sampling_interval(value), "dt")
    refused(lambda: checks.samples(value), "n = ")


@pytest.mark.parametrize("value", [8, 8.0, np.int32(8), np.float32(8), np.float64(8)])
def test_numbers_of_every_type_are_taken(value):
    assert checks.positive("x", value) == checks.whole("x", value, 8) == 8
    assert isinstance(checks.whole("x", value, 0), int)
    assert checks.samples(value, 8) == 8


@pytest.mark.parametrize(
    ("n", "dt", "seed", "words"),
    [
        ("a", 1.0, None, "n = 'a'"), (0, 1.0, None, "n = 0"), (1e13, 1.0, None, "too long"),
        (10, "a", None, "dt = 'a'"), (10, np.nan, None, "dt = nan"), (10, 1.0, -1, "seed = -1"),
        (10, 1.0, "a", "seed = 'a'"), (10, 1.0, 1.5, "seed = 1.5"),
    ],
)  # fmt: skip
def test_simulation_of_nothing(n, dt, seed, words):
    refused(lambda: gmwm.simulate(TRUTH, n, dt, seed), words)
    refused(lambda: WhiteNoise(1.0).simulate(n, dt, seed), words)


def test_a_series_that_fills_the_memory_is_said_to(monkeypatch):
    def full(*_):
        raise MemoryError

    monkeypatch.setattr(WhiteNoise, "draw", full)
    refused(lambda: gmwm.simulate(WhiteNoise(1.0), 100, 1.0), "memory")


# -- options --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "option", "values"),
    [
        ("em", "tolerance", ("a", -1.0)),
        ("em", "max_iterations", ("a", 1.5)),
        ("em", "accelerate", ("yes", 1)),
        ("em", "drift", (["ramp"],)),
        ("gmwm", "discrepancy", ("a", 1.0)),
        ("gmwm", "weights", (np.ones(3), ["model"])),
        ("simulated", "replications", ("a", 0)),
        ("simulated", "seed", ("a", -1)),
        ("allan", "regions", ({"N": (-1.0, 10.0)}, {"N": 3}, "N")),
    ],
)
def test_options_of_a_fit(method, option, values):
    for value in values:
        refused(lambda each=value: METHODS[method](**{option: each}), option)


def test_start_of_a_fit():
    refused(lambda: METHODS["mle"](start="a"), "'a' is not a term")


@pytest.mark.parametrize(
    ("option", "values"),
    [
        ("efficiency", ("a",)), ("confidence", ("a", 95)), ("robust", ("yes",)),
        ("wavelet", (["db4"], 4)), ("data_covariance", ("foo", np.ones(2))),
    ],
)  # fmt: skip
def test_options_of_a_wavelet_variance(option, values):
    for value in values:
        refused(lambda each=value: gmwm.wavelet_variance(X, 1.0, **{option: each}), option)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"max_gauss_markov": "a"}, "max_gauss_markov = 'a'"),
        ({"max_gauss_markov": 1.5}, "max_gauss_markov = 1.5"),
        ({"extra": "a"}, "extra = 'a': give a list"),
        ({"extra": WhiteNoise()}, "extra = WhiteNoise(): give a list"),
        ({"extra": ["a"]}, "extra = 'a': give processes"),
        ({"candidates": "N + K"}, "give a list, as in candidates="),
        ({"candidates": ["N + X"]}, "'X' is not a term"),
        ({"candidates": ["R"]}, 'add one, as in "N + R"'),
        ({"candidates": ["N"], "rule": "merge"}, "leave out extra and rule"),
    ],
)
def test_options_of_a_selection(options, words):
    refused(lambda: gmwm.select(WV, **options), words)


# -- data -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (X + 1j, "complex"),
        (np.arange(100).astype("M8[s]"), "dates"),
        (np.arange(100).astype("m8[s]"), "dates"),
        (["a"] * 10, "not a number"),
        ([[1.0], [1.0, 2.0]], "not a number"),
        (X * 1e200, "check the unit"),
        (X * 1e-200, "check the unit"),
    ],
)
@pytest.mark.parametrize(
    "entrance",
    [
        gmwm.deviations,
        gmwm.wavelet_variance,
        gmwm.select,
        lambda *data: gmwm.fit(MODEL, *data, method="mle"),
    ],
)
def test_what_is_no_series(entrance, values, words):
    refused(lambda: entrance(values, 1.0), words)


def test_recordings_that_are_none():
    for entrance in (gmwm.select, lambda data: gmwm.fit(MODEL, data)):
        refused(lambda e=entrance: e([]), "no recordings given: give at least one")
        refused(lambda e=entrance: e((WV, "a")), "'a' is not a recording")
        refused(lambda e=entrance: e([WV, 2.0]), "2.0 is not a recording")


# -- models ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: WhiteNoise(foo=1), "its parameters are N"),
        (lambda: WhiteNoise(1.0, 2.0), "its parameters are N"),
        (lambda: GaussMarkov(1.0, sigma=2.0), "its parameters are sigma, tau"),
        (lambda: gmwm.ARMA(foo=1), "its parameters are ar, ma, sigma2"),
        (lambda: WhiteNoise("0.2"), "N is '0.2': give a number"),
        (lambda: 2.5 * GaussMarkov(), "2.5 * process"),
        (lambda: np.float64(2.5) * GaussMarkov(), "2.5"),
        (lambda: True * GaussMarkov(), "True * process"),
        (lambda: 0 * GaussMarkov(), "0 * process"),
        (lambda: "a" * GaussMarkov(), "'a' * process"),
        (lambda: WhiteNoise() + 1, "1 is not an error model"),
        (lambda: 1 + WhiteNoise(), "1 is not an error model"),
        (lambda: None + WhiteNoise(), "None is not an error model"),
        (lambda: MODEL + "a", "'a' is not a term"),
    ],
)
def test_what_makes_no_model(make, words):
    refused(make, words)


class Own(gmwm.Process):
    sigma: float = gmwm.parameter("u")
    drawn = staticmethod(lambda n: None)

    def draw(self, n, dt, rng):
        return self.drawn(n)


@pytest.mark.parametrize(
    ("drawn", "words"),
    [
        (lambda n: None, "draw of Own returns nothing"),
        (lambda n: np.arange(n - 1.0), "shape (999,): let it return 1,000 samples"),
        (lambda n: 1.0, "shape ()"),
        (lambda n: np.full(n, np.nan), "not finite"),
        (lambda n: np.ones(n) * 1j, "complex"),
        (lambda n: "a", "not a number"),
    ],
)
def test_a_process_of_ones_own_that_draws_no_series(monkeypatch, drawn, words):
    monkeypatch.setattr(Own, "drawn", staticmethod(drawn))
    refused(lambda: Own(1.0).simulate(1000, 1.0), words)
    refused(lambda: gmwm.fit(WhiteNoise() + Own(), WV, method="simulated"), words)


def test_a_process_of_ones_own_that_draws_zeros(monkeypatch):
    monkeypatch.setattr(Own, "drawn", staticmethod(np.zeros))
    refused(lambda: gmwm.fit(Own(), WV, method="simulated"), "no variance")


# -- stored results -------------------------------------------------------------------------------


@pytest.mark.parametrize("place", ["objective", "N"])
def test_a_calibration_with_a_string_for_a_number(tmp_path, place):
    recording = gmwm.Recording((Channel("gyro_x", X, 1.0, "gyro", "rad/s"),))
    path = tmp_path / "calibration.json"
    content = gmwm.calibrate(recording, MODEL).to_dict()
    channel = content["channels"]["gyro_x"]
    if place == "N":
        channel["model"][0]["N"] = "0.2"
    else:
        channel["objective"] = "large"
    path.write_text(json.dumps(content))
    refused(lambda: gmwm.load(path), "calibration.json: the calibration cannot be rebuilt")


# -- 80 columns -----------------------------------------------------------------------------------


def widest(result):
    return max(map(len, str(result).splitlines()))


def test_long_names_and_many_terms_print_within_80_columns():
    many = (
        WhiteNoise()
        + gmwm.QuantizationNoise()
        + RandomWalk()
        + 5 * GaussMarkov()
        + 2 * gmwm.Resonance()
        + RateRamp()
    )
    values = {i.key: 1.23456e-5 * (k + 1) for k, i in enumerate(many.parameters)}
    model, keys, matrix = many.with_params(values), tuple(values), 1e-12 * np.eye(len(values))
    wv = replace(WV, name="accelerometer_x_of_the_second_unit", quantity="accel", unit="m/s^2")
    fit = replace(FIT, model=model, wv=wv, keys=keys, covariance=matrix, upper_bounds={})
    assert widest(fit) <= 80
    assert "5 Gauss-Markov" in str(fit)
    assert widest(gmwm.CramerRao(model, 300, 1.0, keys, matrix, matrix, exact=True)) <= 80
