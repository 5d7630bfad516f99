from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gmwm
from gmwm import BiasInstability, GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, WhiteNoise
from gmwm.errors import InputError
from gmwm.ins.fields import read_models, sensor_models, value
from gmwm.ins.sensors import SensorModels

ACCEL = {"N": 1e-2}


@settings(deadline=None)  # pint is imported in the first example
@given(st.floats(min_value=-1e12, max_value=1e12).filter(lambda x: x == 0.0 or abs(x) > 1e-60))
def test_a_number_is_itself_as_a_number_and_as_text(number: float) -> None:
    assert value(number, "s") == number
    assert value(repr(number), "s") == number
    assert value(f" {number!r} s", "s") == number


@pytest.mark.parametrize("number", [1e61, -1e300, 1e-61, "1e308 s", "-5e-324", "1e999", "1e150 h"])
def test_numbers_that_nothing_has_are_refused(number: float | str) -> None:
    with pytest.raises(InputError, match="outside the plausible range"):
        value(number, "s")


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("1 deg", "rad", np.pi / 180.0),
        ("2 min", "s", 120.0),
        ("3 mg", "m/s^2", 3e-3 * 9.80665),
        ("1e1deg/h", "rad/s", np.pi / 18.0 / 3600.0),
        ("-.5 h", "s", -1800.0),
        ("140 deg/h/sqrt(Hz)", "rad/s/sqrt(Hz)", np.radians(140.0 / 3600.0)),
        ("1 deg/sqrt(h)", "rad/s/sqrt(Hz)", np.radians(1.0) / 60.0),
    ],
)
def test_units(text: str, unit: str, expected: float) -> None:
    assert value(text, unit) == pytest.approx(expected, rel=1e-12)


NO_SECONDS = [None, True, [1], {"a": 1}, "", "abc", "1 2", "--1", "nan", "inf", float("nan"),
              float("inf"), "1 parsec", "1e999", "1 m"]  # fmt: skip


@pytest.mark.parametrize("bad", NO_SECONDS)
def test_no_number_of_seconds(bad: object) -> None:
    with pytest.raises(InputError) as caught:
        value(bad, "s")
    assert "\n" not in str(caught.value)


def test_every_letter_becomes_its_process() -> None:
    gyro = {
        "N": "1 deg/sqrt(h)", "K": 1e-6, "Q": "2 arcsec", "B": "3 deg/h", "R": "-4 deg/h/h",
        "GM": [["5 deg/h", "1 h"], [1e-4, 2]], "bias": "6 deg/h",
    }  # fmt: skip
    found = sensor_models({"gyro": gyro, "accel": ACCEL}, "x")
    hour = np.radians(1.0) / 3600.0
    terms = found.models["gyro_y"].terms
    by_kind = {type(term): term for term in terms}
    assert pytest.approx(60.0 * hour) == by_kind[WhiteNoise].N
    assert by_kind[RandomWalk].K == 1e-6
    assert pytest.approx(np.radians(2.0 / 3600.0)) == by_kind[QuantizationNoise].Q
    assert pytest.approx(3.0 * hour) == by_kind[BiasInstability].B
    assert pytest.approx(-4.0 * hour / 3600.0) == by_kind[RateRamp].R
    markov = sorted((t.tau, t.sigma) for t in terms if isinstance(t, GaussMarkov))
    assert markov == [(2.0, 1e-4), (3600.0, pytest.approx(5.0 * hour))]
    assert found.bias_sd["gyro_z"] == pytest.approx(6.0 * hour)
    assert found.bias_sd["accel_z"] == 0.0


def test_an_axis_goes_before_its_kind() -> None:
    found = sensor_models({"gyro": {"N": 1.0}, "gyro_y": {"N": 2.0}, "accel": ACCEL}, "x")
    assert [found.models[f"gyro_{axis}"].params["N"] for axis in "xyz"] == [1.0, 2.0, 1.0]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"gyro": {"N": 1.0}}, "x: sensor models: accel_x has none"),
        ({"gyro": 5, "accel": ACCEL}, "x, gyro: 5: write KEY: VALUE; keys are N, K"),
        ({"gyro": {}, "accel": ACCEL}, "x, gyro: there is no noise"),
        ({"gyro": {"GM": []}, "accel": ACCEL}, "x, gyro: there is no noise"),
        ({"gyro": {"GM": [[1]]}, "accel": ACCEL}, r"write \[\[sigma, tau\]"),
        ({"gyro": {"GM": "ab"}, "accel": ACCEL}, r"write \[\[sigma, tau\]"),
        ({"gyro": {"GM": ["ab"]}, "accel": ACCEL}, r"write \[\[sigma, tau\]"),
        ({"gyro": {"N": -1}, "accel": ACCEL}, "x, gyro, N: WhiteNoise"),
        ({"gyro": {"GM": [[1, -1]]}, "accel": ACCEL}, "x, gyro, GM: GaussMarkov"),
        (
            {"gyro": {"n": 1}, "accel": ACCEL},
            "x, gyro: 'n' is unknown: there are N, K, Q, B, R, GM, bias",
        ),
        ({"gyro": {"N": 1, "bias": -1}, "accel": ACCEL}, "bias_sd of gyro_x"),
        ({"gyro_w": {"N": 1}}, "'gyro_w' is unknown: there are gyro, accel, gyro_x"),
        ({7: {"N": 1}}, "7 is unknown"),
    ],
)
def test_what_is_no_model(given: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        sensor_models(given, "x")


def test_filter_numbers_are_sensor_models(tmp_path):
    truth = {"gyro": WhiteNoise(1e-4) + RandomWalk(1e-6), "accel": WhiteNoise(1e-3)}
    axes = {f"{kind}_{axis}": truth[kind] for kind in truth for axis in "xyz"}
    numbers = gmwm.bound(axes, "N+K+GM", bias_sd=0.01)
    path = numbers.save(tmp_path / "numbers.json")

    models = read_models("filters", path.name, tmp_path)
    assert models.models == {name: each.model for name, each in numbers.items()}
    assert models.bias_sd == {name: each.initial_sd for name, each in numbers.items()}
    assert SensorModels.of(numbers) == models
    given = SensorModels.of(numbers, {"gyro": 0.5})
    assert (given.bias_sd["gyro_x"], given.bias_sd["accel_x"]) == (0.5, 0.0)


def test_numbers_of_one_axis_are_not_enough(tmp_path):
    path = gmwm.bound(WhiteNoise(1.0) + RandomWalk(0.1)).save(tmp_path / "one.json")
    with pytest.raises(InputError, match=r"one.json: sensor models"):
        read_models("filters", path.name, tmp_path)
