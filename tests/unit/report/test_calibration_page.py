"""The HTML report: complete, self-contained, safe, and drawn by a real browser."""

import json
import re
from base64 import b64encode
from dataclasses import replace
from hashlib import sha256
from html import escape
from html.parser import HTMLParser

import matplotlib.pyplot as plt
import numpy as np
import pytest
import yaml

import gmwm
from gmwm import Channel, InputError, Process, RandomWalk, WhiteNoise, parameter
from gmwm.calibration import axis_numbers
from gmwm.cli.console import in_options
from gmwm.datasheet import read_datasheet
from gmwm.issues import Notice
from gmwm.plotting import COMPONENT_COLOURS
from gmwm.report import figure as figures, write_report
from gmwm.report.calibration import _needed as needed, first_screen, page
from gmwm.report.figure import (
    density_figure,
    deviation_figure,
    leftover_figures,
    residual_figure,
    series_figure,
)
from gmwm.report.health import health, trust
from gmwm.report.numbers import certified, navigation
from gmwm.report.page import duration_text, resource

VOID = {"meta", "wbr", "link", "br", "img", "input", "hr"}
NAVIGATION = "plot-navigation"
RESIDUALS = "plot-residuals-"


class Page(HTMLParser):
    """Elements, text and scripts of a page."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.elements, self.scripts, self.styles, self.texts = [], [], [], []
        self.cells = []
        self._open = []
        self.feed(text)
        self.close()
        assert not self._open, f"never closed: {self._open}"

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag in VOID:
            return
        self._open.append(tag)
        for name, parts in (("script", self.scripts), ("style", self.styles)):
            if tag == name:
                parts.append("")
        if tag == "tr":
            self.cells.append([])
        if tag in ("td", "th"):
            self.cells[-1].append("")

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        inside = self._open[-1] if self._open else ""
        if inside == "script":
            self.scripts[-1] += data
        elif inside == "style":
            self.styles[-1] += data
        else:
            self.texts.append(data)
            if {"td", "th"} & set(self._open):
                self.cells[-1][-1] += data

    @property
    def plotly(self):
        return self.scripts[-2]

    def count(self, tag):
        return sum(name == tag for name, _ in self.elements)

    @property
    def text(self):
        return " ".join("".join(self.texts).split())

    def figures(self):
        """The channels' figures, as given to plotly, in strict JSON; see `navigation_figure`."""
        return [figure for place, figure in self._drawn() if re.fullmatch(r"plot-\d+", place)]

    def residual_figures(self):
        return [figure for place, figure in self._drawn() if RESIDUALS in place]

    def navigation_figure(self):
        (found,) = [figure for place, figure in self._drawn() if place == NAVIGATION]
        return found

    def _drawn(self):
        elements = [attributes for tag, attributes in self.elements if tag == "script"]
        for attributes, script in zip(elements, self.scripts, strict=True):
            if attributes.get("type") == "application/json":
                yield attributes["data-plot"], self._figure(script)

    @staticmethod
    def _figure(script):

        def refuse(constant):
            raise AssertionError(f"{constant} in a figure")

        return json.loads(script, parse_constant=refuse)


@pytest.fixture(scope="module")
def html(calibration):
    return page(calibration)


@pytest.fixture(scope="module")
def parsed(html):
    return Page(html)


# -- self-contained -------------------------------------------------------------------------------


def test_nothing_is_fetched(parsed):
    for tag, attributes in parsed.elements:
        assert tag not in ("link", "iframe", "img", "object", "embed", "base"), tag
        for name in ("src", "srcset", "data", "poster", "hint"):
            assert name not in attributes, f"<{tag} {name}={attributes[name]}>"
        if "href" in attributes:
            assert attributes["href"].startswith("#")
        assert "url(" not in attributes.get("style", "")
        assert attributes.get("http-equiv", "").lower() != "refresh"
    for style in parsed.styles:
        assert "@import" not in style
        assert "url(" not in style
    for script in parsed.scripts:
        assert "http" not in script or script is parsed.plotly
    assert len(parsed.plotly) > 1_000_000 and "plotly.js v" in parsed.plotly[:200]


def test_nothing_runs_but_the_two_scripts_of_the_page(parsed):
    policies = [a["content"] for _, a in parsed.elements if "Policy" in a.get("http-equiv", "")]
    rules = dict(rule.strip().split(" ", 1) for rule in policies[0].split(";"))
    assert rules["default-src"] == "'none'"
    hashes = {
        f"'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'"
        for script in parsed.scripts[-2:]
    }
    assert set(rules["script-src"].split()) == hashes


# -- complete -------------------------------------------------------------------------------------


def test_every_channel_is_there(parsed, calibration):
    headings = [attributes.get("id") for tag, attributes in parsed.elements if tag == "h2"]
    above = ["sensor", "filter", "actions", "health", "by-axis", "navigation"]
    assert headings == [*above, *calibration]
    links = [attributes["href"] for tag, attributes in parsed.elements if tag == "a"]
    # The name, and the findings where it is not valid.
    in_table = [
        link
        for name, fit in calibration.items()
        for link in ([f"#{name}"] if fit.valid else [f"#{name}", "#health"])
    ]
    assert links == [*in_table, "#by-axis", "#health"]
    plots = [a["id"] for t, a in parsed.elements if t == "div" and a.get("class") == "plot"]
    overviews = 3  # gyros, accelerometers, others
    assert len(plots) == len(parsed.scripts) - 2 == overviews + 2 * len(calibration) + 1
    assert len(set(plots)) == len(plots)
    drawn = [a["data-plot"] for t, a in parsed.elements if t == "script" and "data-plot" in a]
    assert drawn == plots


def test_the_page_says_what_was_found(parsed, calibration):
    fit = calibration["gyro_x"]
    notices = [notice for fit in calibration.fits.values() for notice in fit.notices]
    notes = gmwm.error_budget(calibration).notes
    assert notices and notes, "the fixture must have some"
    for words in (
        "80 s at 100 Hz. Usable: gyro_x and voltage. Not valid: accel_x. No model: gyro_y.",
        "8,000 samples a channel",
        f"gmwm {gmwm.__version__}, numpy",
        "Column not used: 'temp'",
        f"objective {fit.objective:.4g} on {fit.dof} degrees of freedom",
        *(notice.sentence for notice in notices),
        *(f"{note[0].upper()}{note[1:]}." for note in notes),
    ):
        assert words in parsed.text
    assert ["gyro_y", "no model: constant at 0 rad/s"] in parsed.cells
    # What is not valid is said before the headline.
    warned = parsed.text.index("The model of accel_x is not valid: read the notices first.")
    assert warned < parsed.text.index("After a 60 s outage")


def test_the_sensor_table_has_the_numbers_of_the_calibration(parsed, calibration):
    rows = {row[0]: row[1:] for row in reversed(parsed.cells) if row}
    for name, axis in calibration.numbers.items():
        if not axis.valid:
            assert rows[name][0].startswith("not valid: ")
            continue
        for letter, cell in zip("NBK", rows[name], strict=True):
            texts = [axis.text(letter, units=units) for units in ("field", "si")]
            at = f" at {axis.tau:.3g} s" if letter == "B" else ""
            shown = "".join(f"{'no limit' if text == '-' else text + at}" for text in texts)
            assert cell.replace("±", "+-").replace("≤", "<=").replace("\xa0", " ") == shown
    assert rows["gyro"] == [
        "N, angle random walkdeg/sqrt(h)rad/s/sqrt(Hz)",
        "B, bias instabilitydeg/hrad/s",
        "K, rate random walkdeg/h/sqrt(h)rad/s^2/sqrt(Hz)",
    ]


def test_numbers_that_are_not_valid_are_marked(calibration):
    assert not calibration["accel_x"].valid
    found = certified(calibration)
    warnings = [row["warning"] for row in first_screen(calibration, found)["filter"]]
    short = "use N alone: too short for 60 s"
    assert warnings == [short, "do not use yet: accel_x is not valid"]
    fits = {name: replace(fit, notices=()) for name, fit in calibration.items()}
    right = first_screen(right := replace(calibration, fits=fits), certified(right))
    assert [row["warning"] for row in right["filter"]] == [short, short]
    assert all(row["why"] == "" for table in right["sensors"] for row in table["rows"])
    as_yaml, as_python = (found.texts[f"{each}, axis by axis"] for each in ("YAML", "Python"))
    for text in (as_yaml, as_python):
        (line,) = [line for line in text.splitlines() if "# the fit failed" in line]
        assert "accel_x" in line
    spaces = {}
    exec(compile(as_python, "text", "exec"), spaces)
    assert yaml.safe_load(as_yaml) == spaces["imu_noise"]


def test_how_well_a_curve_fits_is_said_of_the_levels_that_tell(calibration):
    fit = calibration["gyro_x"]
    at = fit.goodness
    known = at.tau[at.dof > 30.0]
    assert at.known_to == known[-1] < fit.wv.tau[-1]
    share = 100.0 * np.max(np.abs(at.misfit[at.dof > 30.0]))
    assert trust("gyro_x", fit, calibration)[1] == (
        f"within {share:.2g} % of the data up to {known[-1]:.2g} s"
    )


def test_one_p_value_and_one_misfit(calibration):
    misfit = Notice("misfit", "note", "", "describes the Allan deviation to 7 %")
    fit = replace(calibration["gyro_x"], discrepancy=0.01, notices=(misfit,))
    shown = Page(page(replace(calibration, fits={"gyro_x": fit})))
    assert shown.text.count("p = ") == 1
    assert f"p = {fit.p_value_allowed:.2g} with a model error of 1 % of the variance" in shown.text
    assert "to 7 %" not in shown.text


def test_parameters_in_si_and_in_the_units_of_the_field(parsed, calibration):
    gyro, accel = calibration["gyro_x"].params, calibration["accel_x"].params
    degrees = 180.0 / np.pi
    for value, unit in (
        (gyro["N"], "rad/s/sqrt(Hz)"),
        (gyro["N"] * degrees * 60.0, "deg/sqrt(h)"),
        (gyro["N"] * degrees * 3600.0, "deg/h/sqrt(Hz)"),
        (gyro["K"], "rad/s^2/sqrt(Hz)"),
        (gyro["K"] * degrees * 3600.0 * 60.0, "deg/h/sqrt(h)"),
        (accel["N"], "m/s^2/sqrt(Hz)"),
        (accel["N"] / 9.80665e-6, "ug/sqrt(Hz)"),
        (accel["N"] * 60.0, "m/s/sqrt(h)"),
        (calibration["voltage"].params["N"], "u/sqrt(Hz)"),
    ):
        rows = [row for row in parsed.cells if row[4:5] == [unit]]
        assert any(
            float(row[2].replace(",", "")) == pytest.approx(value, rel=1e-3) for row in rows
        ), unit


def test_interval_error_and_length_of_a_parameter(parsed, calibration):
    fit = calibration["gyro_x"]
    (row,) = [row for row in parsed.cells if row[4:5] == ["rad/s/sqrt(Hz)"]]
    found = [float(text) for text in row[3].split(" to ")]
    assert found == pytest.approx(fit.interval()["N"], rel=1e-3)
    first = next(row for row in parsed.cells if row[4:5] == ["deg/sqrt(h)"])
    assert first[:2] == ["N", "white noise"]
    assert first[5:] == [f"{100 * fit.stderr['N'] / fit.params['N']:.2g} %", "long enough"]
    bounded = next(row for row in parsed.cells if row[0] == "K" and row[2].startswith("<"))
    assert bounded[5:] == ["", "not identified"]


def test_upper_bounds_are_shown_as_such(parsed, calibration):
    bounds = calibration["accel_x"].upper_bounds
    assert bounds, "the fixture must have one"
    shown = [row for row in parsed.cells if row[3:4] == ["95 % upper limit"]]
    for key in bounds:
        row = next(row for row in shown if row[0] == key)
        assert row[2].startswith("< ")
        assert float(row[2][2:].replace(",", "")) == pytest.approx(
            calibration["accel_x"][key].usual.upper, rel=1e-3
        )


# -- what it means for navigation -----------------------------------------------------------------


def test_the_error_budget_is_in_the_report(parsed, calibration):
    times = [1.0, 10.0, 60.0, 600.0]
    assert not calibration["accel_x"].valid
    rows = [row for row in parsed.cells if row[:1] == ["horizontal position not valid"]]
    assert [row[0] for row in parsed.cells if row[:1] and "tilt" in row[0]] == ["tilt"] * 2
    for row, calibrated in zip(rows, (True, False), strict=True):
        total = gmwm.error_budget(calibration, times, calibrated=calibrated).total()["position"]
        shown = [float(cell.replace(",", "").removeprefix("≈ ")) for cell in row[1:5]]
        assert shown == pytest.approx(total, rel=6e-3)
        tilt = gmwm.error_budget(calibration, times, calibrated=calibrated).total()["attitude"]
        assert [cell.startswith("≈") for cell in row[1:5]] == [t > np.radians(10) for t in tilt]
        assert row[5] == "m"
        assert re.fullmatch(r"gyro_x .*, \d+ %", row[6])
    head = next(row for row in parsed.cells if row[0] == "error after an outage of (1 sigma)")
    assert head[1:5] == ["1 s", "10 s", "60 s", "600 s"]


def test_every_term_of_the_error_budget_is_listed(parsed, calibration):
    budget = gmwm.error_budget(calibration)
    shown = [
        tuple(row[:3]) for row in parsed.cells if len(row) == 8 and row[0].split()[0] in calibration
    ]
    marks = {name: "" if fit.valid else " not valid" for name, fit in calibration.items()}
    assert shown == [
        (r.channel + marks[r.channel], r.component, r.quantity)
        for r in budget.rows
        if any(r.values)
    ]


def test_the_headline_of_a_minute(parsed, calibration):
    budgets = [gmwm.error_budget(calibration, [60.0], calibrated=c) for c in (True, False)]
    metres = [budget.total()["position"][0] for budget in budgets]
    sentence = re.search(r"After a 60 s outage from exact .*? unknown\.", parsed.text).group()
    found = re.findall(r"([\d.,]+) m of horizontal position", sentence)
    assert [float(text.replace(",", "")) for text in found] == pytest.approx(metres, rel=6e-3)


def test_the_growth_figure(parsed, calibration):
    figure = parsed.navigation_figure()
    names = [trace["name"] for trace in figure["data"]]
    assert names == ["gyro_x", "accel_x", "total, slow errors known", "total, nothing known"]
    assert figure["layout"]["yaxis"]["title"]["text"] == "Horizontal position [m]"
    for trace, calibrated in zip(figure["data"][2:], (True, False), strict=True):
        total = gmwm.error_budget(calibration, calibrated=calibrated).total()["position"]
        assert [trace["y"][0], trace["y"][-1]] == pytest.approx(total[[0, -1]], rel=1e-4)


def test_without_inertial_sensors_nothing_is_said_of_navigation(calibration):
    fits = {"voltage": calibration["voltage"]}
    shown = Page(page(replace(calibration, fits=fits)))
    headings = [a.get("id") for t, a in shown.elements if t == "h2"]
    assert headings[-3:] == ["health", "by-axis", "voltage"]


def test_a_channel_without_an_axis_has_rows_of_its_own(calibration):
    fits = {"gyro": calibration["gyro_x"]}
    shown = Page(page(replace(calibration, fits=fits)))
    names = [row[0] for row in shown.cells if row[:1] and row[0].startswith("gyro ")]
    assert names[:3] == ["gyro attitude", "gyro velocity", "gyro position"]
    assert "After a 60 s outage" not in shown.text


def test_a_term_without_a_budget_is_told(calibration):
    fit = calibration["gyro_x"]
    odd = replace(fit, model=fit.model + OnlySimulated(1.0))
    content = navigation(replace(calibration, fits={"gyro_x": odd}))
    assert content["problem"].startswith("OnlySimulated can only be simulated")


class OnlySimulated(Process):
    level: float = parameter("u")

    def draw(self, n, dt, rng):
        return self.level * rng.standard_normal(n)


# -- figures --------------------------------------------------------------------------------------


def test_figures_hold_data_model_and_components(parsed, calibration):
    for fit, figure in zip(calibration.fits.values(), parsed.figures(), strict=True):
        traces = {trace["name"]: trace for trace in figure["data"]}
        positive = [label for label, curve in fit.components.items() if np.any(curve > 0.0)]
        band = "95 % band of the model"
        start = [f"{band}, lower end", band, *positive, "model", DATA, "filter N and K"]
        assert list(traces)[: len(start)] == start
        assert list(traces)[-1] == "N, B, K of the sensor"
        scale = {"gyro": 180.0 / np.pi * 3600.0, "accel": 1.0 / 9.80665e-6, None: 1.0}
        factor = scale[fit.wv.quantity]
        data = traces[DATA]
        assert data["x"] == pytest.approx(fit.wv.tau)
        assert data["y"] == pytest.approx(fit.wv.allan_deviation * factor, rel=1e-4)
        upper = np.array(data["y"]) + data["error_y"]["array"]
        lower = np.array(data["y"]) - data["error_y"]["arrayminus"]
        assert upper == pytest.approx(np.sqrt(2.0 * fit.wv.upper) * factor, rel=1e-3)
        assert lower == pytest.approx(np.sqrt(2.0 * fit.wv.lower) * factor, rel=1e-3)
        model = dict(zip(traces["model"]["x"], traces["model"]["y"], strict=True))
        assert len(model) > 4 * fit.wv.tau.size
        at_octaves = [model[tau] for tau in fit.wv.tau.tolist()]
        assert at_octaves == pytest.approx(np.sqrt(2.0 * fit.implied) * factor, rel=1e-4)


def test_marks_are_the_sensor_numbers_and_the_curve_is_that_of_the_filter(parsed, calibration):
    sensor = calibration.numbers["gyro_x"]
    traces = {trace["name"]: trace for trace in parsed.figures()[0]["data"]}
    marks, per_si = traces["N, B, K of the sensor"], 180.0 / np.pi * 3600.0
    found = list(zip(marks["x"], marks["y"], strict=True))
    values = [each.upper if each.kind == "bound" else each.value for each in sensor]
    n, b, k = (per_si * value for value in values)
    expected = [(1.0, n), (sensor.tau, gmwm.calibration.PLATEAU * b), (3.0, k)]
    for (x, y), (at, value) in zip(found, expected, strict=True):
        assert (x, y) == pytest.approx((at, value), rel=1e-4)
    for label, letter in zip(marks["text"], "NBK", strict=True):
        shown = sensor.text(letter).replace("+-", "±").replace("<=", "≤")
        assert label.startswith(f"{letter} {shown} deg/")
    for letter, slope in {"N": -0.5, "B": 0.0, "K": 0.5}.items():
        x, y = (np.log(traces[f"{letter} line"][key]) for key in "xy")
        assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(slope, abs=1e-4)
    numbers, curve = gmwm.bound(calibration["gyro_x"], horizon=60.0), traces["filter N and K"]
    tau = np.array(curve["x"])
    filtered = per_si * np.sqrt(numbers.N**2 / tau + numbers.K**2 * tau / 3.0)
    assert curve["y"] == pytest.approx(filtered, rel=1e-4)
    assert curve["visible"] is False  # until a slider is moved
    own = first_screen(calibration, certified(calibration))["by_axis"][0]
    assert float(own["N"]["si"].split()[0]) == pytest.approx(numbers.N, rel=5e-3)
    assert float(own["K"]["si"].split()[0]) == pytest.approx(numbers.K, rel=5e-3)
    assert float(own["nees"]) == pytest.approx(numbers.nees[60.0], rel=0.05)


def test_the_band_is_the_interval_of_the_curve(parsed, calibration):
    fit = calibration["gyro_x"]
    low, high = parsed.figures()[0]["data"][:2]
    per_si = 180.0 / np.pi * 3600.0
    _, *ends = fit.deviation_interval(np.array(low["x"]), rivals=())
    for trace, end in zip((low, high), ends, strict=True):
        assert trace["y"] == pytest.approx(per_si * end, rel=1e-3)


def test_a_kind_of_term_has_one_colour_on_every_figure(calibration):
    noise = gmwm.LowPassNoise(3e-4, bandwidth=20.0, order=1.0, damping=0.7071)
    models = (
        WhiteNoise(4e-4) + RandomWalk(3e-4) + gmwm.GaussMarkov(1e-3, 3.0),
        RandomWalk(3e-4) + gmwm.GaussMarkov(1e-3, 1.0) + gmwm.GaussMarkov(1e-3, 30.0) + noise,
    )
    seen = {}
    for model in models:
        fit = replace(calibration["gyro_x"], model=model, keys=(), covariance=np.zeros((0, 0)))
        drawn = {label: line.get_color() for label, line in lines_of(fit.plot()).items()}
        for trace in deviation_figure(fit, calibration.numbers["gyro_x"])["data"]:
            label = trace["name"]
            if label in model.term_labels():
                assert trace["line"]["color"] == drawn[label]
                seen.setdefault(label.rstrip(" 12"), set()).add(drawn[label])
    assert all(len(colours) == 1 for colours in seen.values())
    assert len(set.union(*seen.values())) == len(seen) == 4


def lines_of(axes):
    found = {line.get_label(): line for line in axes.get_lines()}
    plt.close(axes.figure)
    return found


def test_white_noise_behind_a_low_pass_is_one_row(calibration):
    truth = WhiteNoise(3e-4) + gmwm.LowPassNoise(4e-4, bandwidth=15.0, order=1.0, damping=0.7071)
    samples = Channel("gyro_x", truth.simulate(60_000, 0.01, 5), 0.01, "gyro", "rad/s")
    fit = gmwm.fit(truth.opened().with_params({"lowpass_order": 1.0, "lowpass_damping": 0.7071}),
                   gmwm.wavelet_variance(samples))  # fmt: skip
    shown = Page(page(replace(calibration, fits={"gyro_x": fit}, rivals={})))
    row = next(row for row in shown.cells if row[0] == "N, bandwidth")
    assert float(row[2]) == pytest.approx(np.degrees(5e-4) * 60.0, rel=0.02)
    low, high = (float(each) for each in row[3].split(" to "))
    assert low < float(row[2]) < high
    assert re.fullmatch(r"white noise: \d+ % of its power has a bandwidth of 1\d(\.\d)? Hz", row[1])
    assert not any(row[0].startswith("lowpass") or row[0] == "N" for row in shown.cells if row)


def test_what_is_copied_is_what_is_exported(calibration):
    inertial = {name: fit for name, fit in calibration.items() if fit.wv.quantity}
    found = certified(calibration)
    for title, target in (("YAML, Kalibr", "kalibr"), ("Python, GTSAM", "gtsam")):
        expected = gmwm.export(replace(calibration, fits=inertial), target, horizon=60.0)
        assert found.texts[title] == expected


def test_what_filter_numbers_cover_is_said(calibration):
    truth = WhiteNoise(2e-4) + gmwm.GaussMarkov(1e-3, 20.0)
    samples = Channel("gyro_x", truth.simulate(40_000, 0.01, 5), 0.01, "gyro", "rad/s")
    fit = gmwm.fit(truth.opened(), gmwm.wavelet_variance(samples))
    one = replace(calibration, fits={"gyro_x": fit}, rivals={})
    found = first_screen(one, certified(one))
    assert re.fullmatch(
        r"gyro K also carries Gauss-Markov \d+ deg/h, \d+ s \(gyro_x\)",
        found["filter"][0]["covers"],
    )
    assert found["by_axis"][0]["covers"] in found["filter"][0]["covers"]


def test_shared_numbers_stand_above_those_of_the_axes(calibration):
    quiet = WhiteNoise(2e-4) + RandomWalk(1e-4)
    samples = Channel("gyro_y", quiet.simulate(8000, 0.01, 5), 0.01, "gyro", "rad/s")
    other = gmwm.fit(quiet.opened(), gmwm.wavelet_variance(samples))
    both = replace(calibration, fits={"gyro_x": calibration["gyro_x"], "gyro_y": other})
    shared = gmwm.bound(both, horizon=60.0, shared=True)
    found = first_screen(both, certified(both))
    (row,) = found["filter"]  # without accelerometers too
    assert row["name"] == "gyro"
    assert float(row["N"].split()[0]) == pytest.approx(shared["gyro_y"].N, rel=5e-3)
    assert float(row["K"].split()[0]) == pytest.approx(shared["gyro_y"].K, rel=5e-3)
    assert "the accelerometer is missing" in found["note"]
    assert [each["nees"][0] for each in found["by_axis"]] == ["1", "1"]


def test_models_that_tie_and_the_data_sheet_are_drawn(calibration, tmp_path):
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text("gyro: {N: 1.2 deg/sqrt(h), K: 60 deg/h/sqrt(h)}\n")
    rivals = {"gyro_x": (WhiteNoise(4e-4) + gmwm.GaussMarkov(1e-3, 30.0),)}
    shown = Page(page(replace(calibration, rivals=rivals), datasheet=sheet))
    assert set(read_datasheet(sheet).entries) == {"gyro"}  # before there are channels, too
    traces = {trace["name"]: trace for trace in shown.figures()[0]["data"]}
    tau, stated = (np.array(traces["data sheet"][key]) for key in "xy")
    expected = np.sqrt(72.0**2 / tau[-1] + 1.0**2 * tau[-1] / 3.0)
    assert stated[-1] == pytest.approx(expected, rel=1e-3)
    assert "95 % band of the models that fit equally well" in traces
    n, _, k = calibration.numbers["gyro_x"]
    assert k.kind == "estimated"
    parts = (f"N 1.2 deg/sqrt(h) (measured: {n.usual.value / 1.2:.3g} times)",
             f"K 60 deg/h/sqrt(h) (measured: {k.usual.value / 60.0:.3g} times)")  # fmt: skip
    assert f"Data sheet: {', '.join(parts)}." in shown.text
    (row,) = [row for row in shown.cells if row[:1] == ["data sheet, gyro"]]
    assert row[1].startswith("1.2") and row[2] == ""


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("gyro: {N: 1.2}", "not a number with a unit"),
        ("gyro: {N: 1.2 ug}", "does not measure"),
        ("gyro: {N: -1 deg/sqrt(h)}", "positive number"),
        ("gyro: {Z: 1 deg}", "is not one of N, B, K"),
        ("magnetometer: {N: 1 deg}", "is not a sensor"),
        ("gyro: 3", "needs numbers with names"),
        ("- 1", "holds no sensors"),
        ("{", "invalid YAML"),
    ],
)
def test_data_sheets_that_cannot_be_used(calibration, tmp_path, text, what):
    path = tmp_path / "sheet.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=what):
        read_datasheet(path, {name: fit.wv.quantity or "" for name, fit in calibration.items()})
    with pytest.raises(InputError, match=what):
        read_datasheet(path)


def test_series_and_spectrum_leave_out_what_was_masked(calibration, recording):
    series = np.array(recording["accel_x"].values)
    series[3000:3100] += 1.0
    channel = replace(recording["accel_x"], values=series)
    fit = calibration["accel_x"]
    drawn = series_figure(fit, channel, [(3000, 3100)])
    (gone,) = drawn["layout"]["shapes"]
    assert gone["x0"] < 30.0 < 31.0 < gone["x1"]
    largest = max(value for value in drawn["data"][1]["y"] if value is not None)
    assert largest < 0.5 / 9.80665e-6
    data, *_, model = density_figure(fit, channel, [(3000, 3100)])["data"]
    # White noise of N lies at N.
    assert np.median(data["y"][-40:]) == pytest.approx(fit.params["N"] / 9.80665e-6, rel=0.05)
    assert model["y"][-1] == pytest.approx(fit.model.psd(np.array([50.0]), 0.01)[0] ** 0.5
                                           / 9.80665e-6, rel=1e-3)  # fmt: skip


def test_axes_are_logarithmic_and_have_units(parsed):
    units = []
    for figure in parsed.figures():
        x, y = figure["layout"]["xaxis"], figure["layout"]["yaxis"]
        assert x["type"] == y["type"] == "log"
        assert x["title"]["text"] == "averaging time [s]"
        units.append(y["title"]["text"])
        data = next(trace for trace in figure["data"] if trace["name"] == DATA)
        low, high = y["range"]
        assert low < np.log10(min(data["y"])) <= np.log10(max(data["y"])) < high
    assert units == [f"Allan deviation [{unit}]" for unit in ("deg/h", "ug", "V")]


def test_a_component_of_zero_is_not_drawn(calibration):
    fit = calibration["gyro_x"]
    nil = replace(fit, model=fit.model.with_params({"K": 0.0}))
    numbers = calibration.numbers["gyro_x"]
    names = [[t["name"] for t in deviation_figure(each, numbers)["data"]] for each in (fit, nil)]
    assert names[0][2:4] == ["white noise", "random walk"]
    assert "random walk" not in names[1]


def test_an_interval_without_an_upper_end_leaves_the_figure_in_numbers():
    """White noise whose only coefficient at the coarsest level happens to be small."""
    odd = Channel("gyro_x", np.random.default_rng(14).normal(size=64), 0.01, "gyro", "rad/s")
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), odd)
    json.dumps(deviation_figure(fit, axis_numbers(fit)), allow_nan=False)


def test_a_pattern_that_averages_out_is_not_noise():
    """Averages over its period of four samples and more do not change at all."""
    odd = Channel("gyro_x", (np.arange(2000) % 4 < 2) * 1e-3, 0.01, "gyro", "rad/s")
    with pytest.raises(gmwm.InputError, match="not noise that these processes describe"):
        gmwm.fit(WhiteNoise() + RandomWalk(), odd)


def test_residuals_are_in_per_cent_of_the_deviation(parsed, calibration):
    for fit, figure in zip(calibration.fits.values(), parsed.residual_figures(), strict=True):
        at = fit.goodness
        (points,) = figure["data"]
        assert points["x"] == pytest.approx(at.tau)
        low, high = figure["layout"]["yaxis"]["range"]
        assert [row[0] for row in points["customdata"]] == pytest.approx(100 * at.misfit, rel=1e-3)
        shown = np.clip(100 * at.misfit, 0.96 * low, 0.96 * high)
        assert points["y"] == pytest.approx(shown, rel=1e-3)
        assert low == -high


@pytest.mark.parametrize("last", [400.0, 0.09])
def test_residuals_are_within_the_axis_or_triangles_at_its_edge(calibration, last):
    fit = calibration["gyro_x"]
    wv = replace(fit.wv, variance=fit.wv.variance * np.r_[np.ones(fit.wv.tau.size - 1), last])
    figure = residual_figure(replace(fit, wv=wv))
    (points,) = figure["data"]
    misfit, (low, high) = points["customdata"][-1][0], figure["layout"]["yaxis"]["range"]
    beyond = not low < misfit < high
    assert beyond == (last > 1.0) and (beyond or misfit < -60.0)
    assert points["marker"]["symbol"][-1] == ("triangle-up" if beyond else "circle")
    assert points["text"][-1] == (f"{misfit:+.0f} %" if beyond else "")
    assert (points["marker"]["symbol"][0], points["text"][0]) == ("circle", "")


def test_lines_are_seen_on_white_and_on_dark_screens():
    def light(colour, brighter=1.0):
        parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
        parts = np.minimum(brighter * parts, 1.0)
        parts = np.where(parts <= 0.03928, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        return parts @ [0.2126, 0.7152, 0.0722]

    style = resource("report.css")
    dark = style[style.index("prefers-color-scheme: dark") :]
    ground = light(re.search(r"--page: (#\w+)", dark)[1])
    brighter = float(re.search(r"brightness\((.*?)\)", dark)[1])
    for colour in (*COMPONENT_COLOURS, figures._FILTER, figures._SHEET):
        assert 1.05 / (light(colour) + 0.05) >= 3.0, colour
        assert (light(colour, brighter) + 0.05) / (ground + 0.05) >= 4.5, colour


# -- health and length ----------------------------------------------------------------------------


LENGTH = Notice("length", "good", "", "an hour")  # which every examined recording has


def issue(severity, text, where="gyro_x", **more):
    return Notice("drift", severity, where, text, hint=f"done about {text}", **more)


def test_a_step_that_spoils_a_fit_is_the_first_finding(calibration):
    values = {"evident": True, "removable": True, "time_lower": 28.36, "time_upper": 30.32}
    hint = (
        "calibrate only the part before or after the step, or subtract it (remove_departures=True)"
    )
    step = Notice("step", "bad", "", "a step of +2.7 mg at 29.3 s", values, hint)
    fits = {**calibration.fits, "accel_x": replace(calibration["accel_x"], notices=(step,))}
    crosstalk = issue("warning", "correlated noise", "")
    spoilt = in_options(replace(calibration, fits=fits, notices=(LENGTH, crosstalk)))
    first, second = health(spoilt)["rows"]
    assert (first.severity, first.where) == ("bad", "accel_x")
    assert first.text == "a step of +2.7 mg at 29.3 s"
    assert first.hint == "rerun with --remove-departures: keeps about 78 s of 80 s"
    assert second.severity == "warning"


def test_every_reason_why_a_channel_is_not_valid_is_a_finding(calibration):
    missed = Notice("misfit", "bad", "", "the model misses the data by 40 %", hint="add a term")
    moved = Notice("not-static", "bad", "", "the sensor moved")
    fits = {**calibration.fits, "gyro_x": replace(calibration["gyro_x"], notices=(missed, moved))}
    for notices in ((LENGTH, moved), ()):
        spoilt = replace(calibration, fits=fits, notices=notices)
        rows = [(row.where, row.text) for row in health(spoilt)["rows"]]
        assert ("gyro_x", "the model misses the data by 40 %") in rows
        # What is a finding of the recording is not said twice.
        assert sum("moved" in text for _, text in rows) == 1
        shown = page(spoilt)
        assert '<a href="#health">the sensor moved</a>' in shown
        assert ["severe", "gyro_x The model misses the data by 40 %", "Add a term"] in Page(
            shown
        ).cells


def test_health_is_in_the_first_lines_and_findings_worst_first(calibration):
    notices = (
        LENGTH,
        issue("good", "fine", ""),
        issue("bad", "broken", "accel_x"),
        issue("warning", "shaken"),
        issue("note", "seen"),
    )
    shown = Page(page(replace(calibration, notices=notices)))
    assert shown.text.startswith(
        "Sensor error models: bench.csv bench.csv: 80 s at 100 Hz. Usable: "
    )
    to_do = shown.text[shown.text.index("What to do") : shown.text.index("All findings")]
    assert "broken" in to_do and "seen" not in to_do
    # With those for which fits are not valid.
    severe = 1 + sum(n.severity == "bad" for fit in calibration.values() for n in fit.notices)
    assert f"{severe} severe issues, 1 warning and" in shown.text
    order = [shown.text.index(words) for words in ("Broken", "Shaken", "Seen", "Fine")]
    assert order == sorted(order)
    folded = shown.text.index("Checks without a finding")
    assert order[2] < folded < order[3]
    assert ["warning", "gyro_x Shaken", "Done about shaken"] in shown.cells


def test_notices_of_several_recordings_say_which(calibration):
    found = [issue("warning", f"moved {k} times", source=f"run{k}.csv") for k in (1, 2)]
    notices = (LENGTH, *found)
    shown = Page(page(replace(calibration, notices=notices)))
    rows = [row[1] for row in shown.cells if row[0] == "warning"]
    assert rows == ["gyro_x, run1.csv Moved 1 times", "gyro_x, run2.csv Moved 2 times"]
    assert "2 warnings." in shown.text


def test_what_was_not_examined_says_so(calibration):
    notices = tuple(n for n in calibration.notices if n.code == "columns-not-used")
    shown = Page(page(replace(calibration, notices=notices)))
    assert "was not checked for defects" in shown.text
    assert "column not used: 'temp'" in shown.text
    fits = {name: fit for name, fit in calibration.items() if fit.valid}
    harmless = replace(calibration, fits=fits, notices=(LENGTH, issue("good", "fine")))
    harmless = Page(page(harmless))
    assert "No defect found." in harmless.text


def test_an_ambiguous_choice_is_reported_with_the_channel(calibration):
    tie = Notice("ambiguity", "note", "gyro_x", "2 models describe the data equally well")
    shown = Page(page(replace(calibration, notices=(tie,))))
    assert shown.text.index("gyro_x: white noise") < shown.text.index("2 models describe")
    assert shown.text.index("2 models describe") < shown.text.index("accel_x: white noise")


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (None, ""),
        (80.0, "long enough"),
        (81.0, "needs 81 s"),
        (7 * 86400.0, "needs 7 days"),
        (3 * 365.25 * 86400.0, "needs 3 years"),
        (1e12, "centuries"),
        (float("inf"), "not identified"),
    ],
)
def test_needed_length_in_words(seconds, words):
    assert needed(seconds, 80.0) == words


# -- safe -----------------------------------------------------------------------------------------


DATA = "data, 95 % interval"
HOSTILE = "<!--<script>alert(\"1\")</script> & <b>'x'</b>"


def test_names_are_text_not_markup(calibration):
    gyro = calibration["gyro_x"]
    hostile = replace(
        calibration,
        source=HOSTILE,
        fits={HOSTILE: replace(gyro, notices=(Notice("a", "bad", "", f"a {HOSTILE}"),))},
        skipped={f"skip {HOSTILE}": Notice("constant", "bad", "", f"why {HOSTILE}")},
        notices=(
            LENGTH,
            Notice("line", "bad", HOSTILE, f"found {HOSTILE}", hint=f"done {HOSTILE}"),
            Notice("ambiguity", "note", HOSTILE, f"tie {HOSTILE}"),
        ),
    )
    unread = (Notice("columns-not-used", "note", "", f"note {HOSTILE}"),)
    shown = Page(page(replace(hostile, notices=unread)))
    assert f"note {HOSTILE}" in shown.text
    shown = Page(page(hostile))
    assert len(shown.scripts) == 6
    plain = Page(page(hostile).replace(escape(HOSTILE), "plain"))
    assert shown.count("b") == plain.count("b")
    for words in ("skip", "why", "Found", "Done", "tie", "A"):
        assert f"{words} {HOSTILE}" in shown.text
    headings = [attributes.get("id") for tag, attributes in shown.elements if tag == "h2"]
    assert headings[-3:] == ["by-axis", "navigation", HOSTILE]
    assert [row[0] for row in shown.cells if row[-1:] == ["deg"]][-1] == f"{HOSTILE} not valid"


def test_provenance_is_printable_text(calibration):
    given = {f"hash of {HOSTILE}\udcff": "\x1b[31m\udcff"}
    shown = Page(page(calibration, provenance=given))
    assert f"hash of {HOSTILE}\\udcff: \\x1b[31m\\udcff" in shown.text


def test_units_are_text_not_markup(calibration):
    fit = calibration["voltage"]
    hostile = replace(fit, wv=replace(fit.wv, unit=HOSTILE))
    shown = Page(page(replace(calibration, fits={"voltage": hostile}, skipped={})))
    assert len(shown.scripts) == 5
    (figure,) = shown.figures()
    # Plotly knows a little markup of its own, which does no harm.
    assert "alert" in figure["layout"]["yaxis"]["title"]["text"]
    assert f"{HOSTILE}/sqrt(Hz)" in shown.text


# -- files ----------------------------------------------------------------------------------------


def test_the_file(calibration, tmp_path):
    path = tmp_path / "report.html"
    assert write_report(calibration, path) == path
    assert path.read_text(encoding="utf-8") == f"{page(calibration)}\n"
    assert calibration.report(tmp_path / "again.html").read_bytes() == path.read_bytes()


WRITERS = [
    write_report,
    gmwm.report.write_comparison_report,
    gmwm.report.write_fleet_report,
    gmwm.report.write_navigated_report,
    gmwm.report.write_sensor_comparison_report,
    gmwm.report.write_validation_report,
    lambda nothing, path: gmwm.export(nothing, "kalibr", path=path),
]


@pytest.mark.parametrize("write", WRITERS)
def test_a_place_that_cannot_be_written_is_refused_before_the_work(write, tmp_path):
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match=r"report\.html: cannot be written"):
        write(None, tmp_path / "nowhere" / "report.html")
    with pytest.raises(InputError, match=r"in the way: move it, or choose another place$"):
        write(None, str(tmp_path / "folder"))
    assert [each.name for each in tmp_path.iterdir()] == ["folder"]


# -- words ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (40.0, "40 s"),
        (119.4, "119 s"),
        (120.0, "2 min"),
        (35 * 60.0, "35 min"),
        (3599.0, "1 h"),
        (3600.0 * 2 + 46 * 60.0, "2 h 46 min"),
        (3600.0 * 100, "100 h"),
    ],
)
def test_duration(seconds, words):
    assert duration_text(seconds) == words


def test_what_a_curve_leaves_is_drawn_against_the_temperature():
    """Means of the noise, and its size in parts, which follow neither the curve nor its slope."""
    n, rng = 4096, np.random.default_rng(3)
    warm = 45.0 - 20.0 * np.cos(4.0 * np.pi * np.arange(n) / n)
    noise = np.exp(0.02 * (warm - 45.0)) * 1e-3 * rng.standard_normal(n)
    arrays = {"gyro_x": noise + 1e-3 * (warm - 45.0), "temperature": warm}
    rec = gmwm.Recording.from_arrays(arrays, 10.0, {"gyro": "rad/s", "temperature": "degC"})
    given = {"covariates": {"temperature": "linear"}, "screening": (), "jobs": 1}
    cal = gmwm.calibrate(rec, "N", **given)
    fit, curve = cal["gyro_x"], cal.curves["gyro_x"]
    (means,), (parts, growth) = (each["data"] for each in leftover_figures(fit, curve))
    per_si = np.degrees(3600.0)
    assert abs(np.corrcoef(means["x"], means["y"])[0, 1]) < 4.0 / np.sqrt(len(means["x"]))
    assert np.std(means["y"]) < 4e-4 * per_si
    assert growth["y"][-1] / growth["y"][0] == pytest.approx(np.exp(0.02 * 40.0), rel=0.3)
    off = np.array(parts["y"]) / np.interp(parts["x"], growth["x"], growth["y"]) - 1.0
    assert np.sqrt(np.mean(off**2)) < 0.3
    assert "plot-leftover-1-2" in page(cal)
