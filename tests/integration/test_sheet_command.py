"""``gmwm sheet``: from a data sheet to files for a filter."""

import json

import pytest
import yaml

import gmwm

SHEET = """
name: MEMS one
gyro: {angle_random_walk: 0.2 deg/sqrt(h), bias_instability: 8 deg/h}
accel: {velocity_random_walk: 80 ug/sqrt(Hz), bias_instability: 40 ug}
"""


@pytest.fixture
def sheet(tmp_path):
    (tmp_path / "sheet.yaml").write_text(SHEET)
    return tmp_path / "sheet.yaml"


def test_from_a_sheet_to_kalibr_and_back(run, sheet, tmp_path):
    code, printed, _ = run("sheet", "sheet.yaml", "--rate", "200", "-o", "numbers.json")
    assert code == 0
    assert max(map(len, printed.splitlines())) <= 80
    code, _, _ = run("export", "numbers.json", "--to", "kalibr", "-o", "imu.yaml")
    assert code == 0
    written = yaml.safe_load((tmp_path / "imu.yaml").read_text())
    assert "record an hour" in (tmp_path / "imu.yaml").read_text()
    numbers = gmwm.load(tmp_path / "numbers.json")
    assert written["gyroscope_random_walk"] == pytest.approx(numbers["gyro"].K, rel=1e-5)
    assert f"{numbers['gyro'].K:.2e} rad/s^2" in "".join(printed.splitlines()[:5])  # comes first
    code, printed, _ = run("sheet", "sheet.yaml", "--imu", "imu.yaml")
    assert code == 0
    judged = gmwm.datasheet(sheet).judged({"gyro": numbers["gyro"]})["gyro"]
    assert f"gyro: {judged[0]:.2g} to {judged[1]:.2g}" in printed


def test_page_and_json(run, sheet, tmp_path):
    code, printed, _ = run("sheet", "sheet.yaml", "--report", "page.html", "--json")
    assert code == 0
    assert set(json.loads(printed)["channels"]) == {"gyro", "accel"}
    page = (tmp_path / "page.html").read_text()
    assert page.count("<svg") == 2
    assert "gyroscope_random_walk" in page


def test_list_and_what_is_missing(run):
    code, printed, _ = run("sheet", "--list")
    assert (code, bool(printed)) == (0, True)
    code, _, said = run("sheet")
    assert (code, said.count("\n")) == (2, 1)
    code, _, said = run("sheet", printed.split()[0], "--unit-spread", "0.5")
    assert code == 2
    assert "give a factor of 1 or more" in said
