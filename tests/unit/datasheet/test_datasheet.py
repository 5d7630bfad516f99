"""Data sheets: what they state, which models agree with them, and numbers for a filter."""

import numpy as np
import pytest

import gmwm
from gmwm.filter_numbers import Chain

SHEET = {"gyro": {"N": "0.2 deg/sqrt(h)", "B": "8 deg/h"}}
N, B = np.radians(0.2) / 60.0, np.radians(8.0) / 3600.0
LOWEST = np.sqrt(2.0 * np.log(2.0) / np.pi) * B


def with_lines(**lines):
    return gmwm.datasheet({"gyro": {**SHEET["gyro"], **lines}})


def first_flat(model):
    """Allan deviation where its logarithmic slope is first above -0.02."""
    tau = np.geomspace(0.05, 1e5, 2000)
    deviation = np.sqrt(2.0 * model.haar_variance(tau, 1e-3))
    slope = np.diff(np.log(deviation)) / np.diff(np.log(tau))
    return deviation[np.argmax(slope >= -0.02)]


def test_random_walk_has_the_lowest_deviation_of_the_closed_form():
    model = gmwm.datasheet(SHEET).models("gyro")["gyro_N+K"]
    assert model.params["K"] == pytest.approx(np.sqrt(3.0) * LOWEST**2 / (2.0 * N), rel=2e-3)


@pytest.mark.parametrize("lines", [{}, {"K": "20 deg/h/sqrt(h)"}, {"correlation_time": "100 s"}])
def test_models_are_flat_where_the_sheet_says(lines):
    models = with_lines(**lines).models("gyro")
    for label, model in models.items():
        assert first_flat(model) == pytest.approx(LOWEST, rel=5e-3), label
        assert model.params["N"] == pytest.approx(N)
        if "K" in lines:
            assert model.params["K"] == pytest.approx(np.radians(20.0) / 3600.0 / 60.0)
        if "correlation_time" in lines:
            assert model.params["tau"] == 100.0
    assert len({label.partition(" ")[0] for label in models}) == (
        1 if "correlation_time" in lines else 3 - len(lines)
    )


def test_lowest_deviation_is_not_divided():
    sheets = ({"B": "8 deg/h"}, {"lowest_deviation": f"{8.0 * LOWEST / B:.9f} deg/h"})
    models = [
        gmwm.datasheet({"gyro": {"N": "0.2 deg/sqrt(h)", **each}}).models("gyro") for each in sheets
    ]
    for label, model in models[0].items():
        assert dict(models[1][label].params) == pytest.approx(dict(model.params), rel=1e-6)


def test_noise_density_is_one_sided_or_read_off_an_allan_plot():
    sheet = gmwm.datasheet({"gyro": {"noise_density": "0.008 deg/s/sqrt(Hz)", "B": "8 deg/h"}})
    white = {model.params["N"] for model in sheet.models("gyro").values()}
    # The sheet of the ADIS16470 states 0.34 deg/sqrt(h) beside this density.
    assert np.degrees(min(white)) * 60.0 == pytest.approx(0.34, abs=0.005)
    assert max(white) / min(white) == pytest.approx(np.sqrt(2.0))
    # What is stated as a variance of white noise over a bandwidth.
    noise = f"{np.radians(0.008) * 10.0:.9f} rad/s"
    same = gmwm.datasheet({"gyro": {"rms_noise": noise, "bandwidth": "100 Hz", "B": "8 deg/h"}})
    assert max(m.params["N"] for m in same.models("gyro").values()) == pytest.approx(min(white))


@pytest.mark.parametrize("form", ["N+K", "N+K+GM"])
def test_numbers_are_consistent_under_every_model(form):
    sheet = with_lines()
    numbers = sheet.numbers(form, 60.0, unit_spread=1.5)["gyro"]
    for spread in (1.0, 1.5):
        for label, model in sheet.models("gyro", spread).items():
            errors = Chain.usual("gyro").worse(
                model, numbers.model, 0.01, [10.0, 60.0, 600.0], 0.0, numbers.initial_sd
            )
            assert np.all(errors.nees() <= 1.001), (label, spread)
    assert max(numbers.nees.values()) <= 1.001
    assert [n.code for n in numbers.notices] == ["from-data-sheet"]
    K = [gmwm.bound(model, form).K for model in sheet.models("gyro", 1.5).values()]
    assert 0.9 * max(K) <= numbers.K


def test_units_that_are_noisier_scale_the_numbers():
    sheet = with_lines(turn_on_bias="0.1 deg/s")
    usual, noisy = (sheet.numbers(unit_spread=spread)["gyro"] for spread in (1.0, 2.0))
    ratios = noisy.N / usual.N, noisy.K / usual.K
    assert ratios == pytest.approx((2.0, 2.0), rel=1e-4)
    assert usual.initial_sd == pytest.approx(np.radians(0.1), rel=0.01)


@pytest.mark.parametrize(
    ("factor", "is_said"),
    [(1e-3, True), (1.0, False), (1e3, True)],
    ids=["small", "as is", "large"],
)
def test_a_noise_density_a_thousand_times_off_is_said(factor, is_said):
    sheets = ((0.15, 0.5), (0.3, 8.0), (2.0, 25.0))  # deg/sqrt(h), deg/h
    for N, lowest in sheets[:1] if is_said else sheets:
        gyro = {"N": f"{N * factor} deg/sqrt(h)", "lowest_deviation": f"{lowest} deg/h"}
        codes = [n.code for n in gmwm.datasheet({"gyro": gyro}).numbers().notices]
        assert ("unlikely-sheet" in codes) == is_said


def test_numbers_in_use_are_judged():
    sheet = with_lines()
    least, largest = sheet.judged({"gyro": (N, 1e-9)})["gyro"]
    assert least < largest
    assert largest > 10.0  # a K of nearly nothing
    assert sheet.judged({"gyro": (10.0 * N, 1e-2)})["gyro"][1] < 0.05


def test_pages_and_names_are_kept():
    content = {
        "name": "ONE",
        "document": "rev. A",
        "gyro": {**SHEET["gyro"], "B": "8 deg/h (p. 3)"},
    }
    sheet = gmwm.datasheet(content)
    assert (sheet.name, sheet.document, sheet.pages["gyro"]) == ("ONE", "rev. A", {"B": "p. 3"})
    assert sheet.entries == gmwm.datasheet(SHEET).entries
    assert "ONE (rev. A)" in str(sheet)
    assert set(content) == {"name", "document", "gyro"}  # not changed


WRONG = [
    ({}, "holds no sensors"),
    ({"gyro": {"N": "0.2"}}, "not a number with a unit"),
    ({"gyro": {"N": "0.2 deg"}}, "cannot be converted"),
    ({"gyro": {"N": "0.2 deg/sqrt(h)", "angle_random_walk": "0.2 deg/sqrt(h)"}}, "twice"),
    ({"gyro": {"noise": "0.2 deg/sqrt(h)"}}, "noise_density"),
    ({"gyro": {"B": "8 deg/h"}}, "no white noise is stated"),
    ({"gyro": {"N": "0.2 deg/sqrt(h)"}}, "no slow noise is stated"),
    ({"gyro": {**SHEET["gyro"], "K": "2000 deg/h/sqrt(h)"}}, "leave out K"),
    ({"gyro": {**SHEET["gyro"], "correlation_time": "1 s"}}, "leave out correlation_time"),
    ("nosuch", "no data sheet of 'nosuch'"),
]


@pytest.mark.parametrize(("content", "said"), WRONG)
def test_what_cannot_be_used_is_rejected(content, said):
    with pytest.raises(gmwm.InputError, match=said):
        gmwm.datasheet(content).numbers()


def test_one_sensor_may_have_too_little():
    sheet = gmwm.datasheet({**SHEET, "accel": {"N": "80 ug/sqrt(Hz)"}})
    assert list(sheet.numbers()) == ["gyro"]
    assert "accel: no slow noise is stated" in str(sheet)


@pytest.mark.parametrize(
    "second",
    [
        "noise_density: 2 deg/s/sqrt(Hz)",
        "lowest_deviation: 20 deg/h",
        "rms_noise: 1 deg/s, bandwidth: 50 Hz",
    ],
)
def test_numbers_that_contradict_each_other_are_rejected(tmp_path, second):
    (tmp_path / "s.yaml").write_text(f"gyro: {{N: 0.2 deg/sqrt(h), B: 8 deg/h, {second}}}")
    with pytest.raises(gmwm.InputError, match="contradict each other by a factor of"):
        gmwm.datasheet(tmp_path / "s.yaml")


@pytest.mark.parametrize("turn_on", ["", ", turn_on_bias: 2 deg/s"])
def test_a_file_says_whether_its_start_has_the_turn_on_bias_and_what_is_unlikely(turn_on):
    text = "N: 150 deg/sqrt(h), B: 70 deg/h"
    entry = dict(part.split(": ") for part in f"{text}{turn_on}".split(", "))
    sheet = gmwm.datasheet({"gyro": entry, "accel": {"N": "100 ug/sqrt(Hz)", "B": "50 ug"}})
    found = gmwm.export(sheet.numbers(rate=100.0), "kalibr")
    assert ("plus accel turn-on\n" in found) == bool(turn_on)
    assert ("plus turn-on bias" in found) == (not turn_on)
    assert "unlikely, check the units of the sheet: gyro" in found
