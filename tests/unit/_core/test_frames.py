"""Results as tables of pandas, and their one-line looks."""

import re
import sys

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
    table = results["wv"].to_frame()
    np.testing.assert_array_equal(table["tau"], results["wv"].tau)
    np.testing.assert_array_equal(table["allan_deviation"], results["wv"].allan_deviation)
    assert np.all(table["lower"] < table["upper"])


def test_parameters(results):
    table = results["fit"].to_frame(units="si").set_index("key")
    assert list(table.index) == ["N", "K"]
    assert table.loc["N", "value"] == results["fit"].params["N"]
    assert table.loc["N", "unit"] == "rad/s/sqrt(Hz)"


def test_candidates(results):
    table = results["selection"].to_frame()
    assert len(table) == len(results["selection"])
    assert table["model"][table["chosen"]].item() == results["selection"].model.title()
    assert table["tie"][0]


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


def test_a_table_of_nothing_has_its_columns(results):
    empty = gmwm.Calibration({}, {}, "", 1.0, 1).to_frame()
    assert list(empty.columns) == list(results["calibration"].to_frame().columns)
    assert len(empty) == 0


def test_without_pandas_it_says_what_to_install(results, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match=r"pip install 'gmwm\[pandas\]'"):
        results["wv"].to_frame()


@pytest.mark.parametrize("name", ["wv", "fit", "selection", "calibration", "health", "recording"])
def test_looks(results, name):
    result = results[name]
    assert "\n" not in repr(result)
    assert len(repr(result)) < 120
    assert re.match(r"<(pre|p)>", result._repr_html_())
