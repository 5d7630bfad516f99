"""Filter numbers as a result: values, tables, files."""

import math
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

import gmwm
from gmwm import AxisFilterNumbers, FilterNumbers, GaussMarkov, InputError, RandomWalk, WhiteNoise
from gmwm.filter_numbers import Predicted
from gmwm.issues import Notice

NOTICE = Notice("quantization-left-out", "note", "", "quantization noise is left out", {"Q": 1e-6})
WALK = AxisFilterNumbers(
    "N+K", WhiteNoise(1e-4) + RandomWalk(5e-6), 60.0, 3e-5, "bound",
    (Predicted(60.0, 0.91, 1.12), Predicted(600.0, 0.75, 1.4)), (NOTICE,), "gyro",
)  # fmt: skip
TWO = AxisFilterNumbers(
    "N+2GM", WhiteNoise(1e-3) + GaussMarkov(2e-3, 5.0) + GaussMarkov(1e-3, 500.0), 10.0, 0.0,
    "reduce", (Predicted(10.0, math.nan, math.nan),), (), "accel",
)  # fmt: skip
SENSOR = FilterNumbers({"gyro_x": WALK, "accel_x": TWO}, "static.csv", 100.0, 3600.0)


def test_numbers_that_a_form_has_and_those_that_it_lacks():
    assert (WALK.N, WALK.K, WALK.sigma, WALK.tau) == (1e-4, 5e-6, (), ())
    assert (TWO.N, TWO.K, TWO.sigma, TWO.tau) == (1e-3, 0.0, (2e-3, 1e-3), (5.0, 500.0))
    assert WALK.nees == {60.0: 0.91, 600.0: 0.75}
    assert WALK.tightness == {60.0: 1.12, 600.0: 1.4}
    assert (WALK.unit, TWO.unit) == ("rad/s", "m/s^2")


def test_a_sensor_is_a_mapping_of_its_channels():
    assert list(SENSOR) == ["gyro_x", "accel_x"]
    assert SENSOR["gyro_x"] is WALK
    assert SENSOR.of("accel") == {"accel_x": TWO}
    assert [notice.where for notice in SENSOR.notices] == ["gyro_x"]
    assert (SENSOR.form, SENSOR.horizon) == ("N+K", 60.0)
    with pytest.raises(KeyError, match="there are gyro_x, accel_x"):
        SENSOR["gyro_z"]


def test_it_does_not_change():
    with pytest.raises(FrozenInstanceError):
        WALK.horizon = 10.0
    with pytest.raises(TypeError):
        SENSOR.axes["gyro_x"] = TWO


def test_files_bring_back_what_was_saved(tmp_path):
    path = SENSOR.save(tmp_path / "numbers.json")
    again = gmwm.load(path)
    assert isinstance(again, FilterNumbers)
    assert again["gyro_x"] == WALK
    assert again.to_dict() == SENSOR.to_dict()
    assert math.isnan(again["accel_x"].nees[10.0])
    assert AxisFilterNumbers.load(WALK.save(tmp_path / "axis.json")) == WALK
    unknown = FilterNumbers({"x": WALK})
    assert math.isnan(FilterNumbers.from_dict(unknown.to_dict()).rate)


def test_a_damaged_file_is_refused():
    content = WALK.to_dict()
    for change in ({"form": "N"}, {"horizon_s": "long"}, {"model": [{"process": "X"}]}):
        with pytest.raises(InputError, match="make it again"):
            AxisFilterNumbers.from_dict(content | change)


def test_table():
    pandas = pytest.importorskip("pandas")
    table, shown = SENSOR.to_frame(units="si"), SENSOR.to_frame()
    assert isinstance(table, pandas.DataFrame)
    assert list(table["channel"]) == ["gyro_x", "accel_x"]
    assert (table.loc[0, "K"], table.loc[0, "K_unit"]) == (5e-6, "rad/s^2/sqrt(Hz)")
    assert (shown.loc[0, "K_unit"], shown.loc[1, "N_unit"]) == ("deg/h/sqrt(h)", "ug/sqrt(Hz)")
    assert shown.loc[0, "K"] == pytest.approx(np.degrees(5e-6) * 3600.0**1.5)
    assert table.loc[1, "tau_2"] == shown.loc[1, "tau_2"] == 500.0
