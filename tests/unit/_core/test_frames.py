"""Results as tables of pandas, and their one-line looks."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import InputError, RandomWalk, Recording, WhiteNoise


@pytest.fixture(scope="module")
def recording():
    rng = np.random.default_rng(3)
    arrays = {name: 1e-3 * rng.normal(size=4000) for name in ("gyro_x", "gyro_y")}
    return Recording.from_arrays(arrays, 100.0, {"gyro": "rad/s"}, source="a.csv")


@pytest.fixture(scope="module")
def results(recording):
    wv = gmwm.wavelet_variance(recording["gyro_x"])
    return {
        "wv": wv,
        "fit": gmwm.fit(WhiteNoise() + RandomWalk(), wv),
        "selection": gmwm.select(wv, max_gauss_markov=1),
        "calibration": gmwm.calibrate(recording, WhiteNoise()),
        "health": gmwm.health(recording),
        "recording": recording,
    }


def test_levels(results):
    wv = results["wv"]
    si, field = wv.to_frame(units="si"), wv.to_frame()
    np.testing.assert_array_equal(si["tau"], wv.tau)
    np.testing.assert_array_equal(si["allan_deviation"], wv.allan_deviation)
    assert np.all(si["lower"] < si["upper"])
    assert (si["unit"][0], field["unit"][0]) == ("rad/s", "deg/h")
    per_si = np.degrees(3600.0)
    np.testing.assert_allclose(field["allan_deviation"], per_si * wv.allan_deviation)
    np.testing.assert_allclose(field["variance"], per_si**2 * wv.variance)


def test_parameters(results):
    si, field = (results["fit"].to_frame(units=units).set_index("key") for units in ("si", "field"))
    assert list(si.index) == ["N", "K"]
    assert si.loc["N", "value"] == results["fit"].params["N"]
    assert (si.loc["N", "unit"], field.loc["N", "unit"]) == ("rad/s/sqrt(Hz)", "deg/sqrt(h)")
    assert field.loc["N", "value"] == pytest.approx(np.degrees(si.loc["N", "value"]) * 60.0)


def test_candidates(results):
    table = results["selection"].to_frame()
    assert len(table) == len(results["selection"])
    assert table["model"][table["chosen"]].item() == results["selection"].model.title()
    assert table["tie"][0] and table["chosen"][0]


def test_channels(results):
    table = results["calibration"].to_frame("terms")
    assert list(table["channel"]) == ["gyro_x", "gyro_y"]
    assert list(table["key"]) == ["N", "N"]


def test_sensor_numbers(results):
    calibration = results["calibration"]
    table = calibration.to_frame()
    assert list(table["number"]) == ["N", "B", "K"] * len(calibration)
    si = calibration.to_frame(units="si").set_index(["channel", "number"])
    assert si.loc[("gyro_x", "N"), "value"] == calibration.numbers["gyro_x"].N.value
    assert si.loc[("gyro_x", "N"), "unit"] == "rad/s/sqrt(Hz)"


def test_notices(results):
    table = results["health"].to_frame()
    assert list(table["code"]) == [notice.code for notice in results["health"].notices]
    assert table["values"][0]["rate"] == 100.0


def test_without_pandas_it_says_what_to_install(results, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match=r"pip install 'gmwm\[pandas\]'"):
        results["wv"].to_frame()


def test_a_name_cannot_bring_markup(results):
    named = replace(results["wv"], name="<script>")
    assert "<script>" not in named._repr_html_()
