"""Filter numbers as a result: values, tables, files."""

import math
from dataclasses import FrozenInstanceError, replace

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


def test_text_names_units_and_every_number():
    lines = str(WALK).splitlines()
    assert lines[0] == "N+K for 60 s, bound"
    assert [line.split() for line in lines[1:4]] == [
        ["N", "0.3438", "deg/sqrt(h)"],
        ["K", "61.88", "deg/h/sqrt(h)"],
        ["initial_sd", "6.188", "deg/h"],
    ]
    lines = WALK.text("si").splitlines()
    assert [line.split() for line in lines[1:4]] == [
        ["N", "0.0001", "rad/s/sqrt(Hz)"],
        ["K", "5e-06", "rad/s^2/sqrt(Hz)"],
        ["initial_sd", "3e-05", "rad/s"],
    ]
    assert "after 600 s without aiding: NEES 0.75" in str(WALK)
    assert str(NOTICE) in str(WALK)
    text = str(SENSOR)
    assert "static.csv: N+K for 60 s, bound" in text
    for part in ("deg/sqrt(h)", "ug/sqrt(Hz)", "sigma_2", "NEES 600 s", "0.91", "gyro_x: "):
        assert part in text
    assert "rad/s^2/sqrt(Hz)" in SENSOR.text("si")
    for numbers in (WALK, SENSOR):
        with pytest.raises(InputError, match="units = 'SI': choose from field, si"):
            numbers.text("SI")
    assert "<pre>" in SENSOR._repr_html_()
    assert repr(SENSOR) == "<FilterNumbers of static.csv: N+K for 60 s, gyro_x, accel_x>"


def test_errors_that_only_some_axes_have():
    axes = {"none": WALK, "known": replace(WALK, stderr={"N": 1e-6, "K": 2e-7})}
    rows = [line.split() for line in str(FilterNumbers(axes)).splitlines()]
    values = {row[0]: row[1:] for row in rows[2:7] if row and row[0] in axes}
    assert values["none"] == ["0.3438", "-", "61.88", "-", "6.188"]
    assert values["known"] == ["0.3438", "0.0034", "61.88", "2.5", "6.188"]


@pytest.mark.parametrize("name", ["gyro_x", "x" * 58, "x" * 90])
def test_tables_fit_a_terminal(name):
    known = replace(WALK, stderr={"N": 1.234e-6, "K": 2.345e-7})
    numbers = FilterNumbers({name: known, "accel_x": TWO}, "static.csv")
    for text in (str(numbers), numbers.text("si")):
        tables = text.partition("NEES: predicted")[0]
        assert max(map(len, tables.splitlines())) <= 80


def test_table():
    pandas = pytest.importorskip("pandas")
    table, shown = SENSOR.to_frame(units="si"), SENSOR.to_frame()
    assert isinstance(table, pandas.DataFrame)
    assert list(table["channel"]) == ["gyro_x", "accel_x"]
    assert (table.loc[0, "K"], table.loc[0, "K_unit"]) == (5e-6, "rad/s^2/sqrt(Hz)")
    assert (shown.loc[0, "K_unit"], shown.loc[1, "N_unit"]) == ("deg/h/sqrt(h)", "ug/sqrt(Hz)")
    assert shown.loc[0, "K"] == pytest.approx(np.degrees(5e-6) * 3600.0**1.5)
    assert table.loc[1, "tau_2"] == shown.loc[1, "tau_2"] == 500.0
