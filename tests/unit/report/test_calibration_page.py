"""The HTML report: complete, self-contained, safe, and drawn by a real browser."""

import json
import re
from base64 import b64encode
from dataclasses import replace
from hashlib import sha256
from html import escape
from html.parser import HTMLParser

import numpy as np
import pytest

import gmwm
from gmwm import InputError, WhiteNoise
from gmwm.datasheet import read_datasheet
from gmwm.issues import Notice
from gmwm.report import write_report
from gmwm.report.calibration import first_screen, page
from gmwm.report.figure import (
    density_figure,
    leftover_figures,
    series_figure,
)
from gmwm.report.health import health
from gmwm.report.numbers import certified

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


def test_what_is_copied_is_what_is_exported(calibration):
    inertial = {name: fit for name, fit in calibration.items() if fit.wv.quantity}
    found = certified(calibration)
    for title, target in (("YAML, Kalibr", "kalibr"), ("Python, GTSAM", "gtsam")):
        expected = gmwm.export(replace(calibration, fits=inertial), target, horizon=60.0)
        assert found.texts[title] == expected


def test_models_that_tie_and_the_data_sheet_are_drawn(calibration, tmp_path):
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text("gyro: {N: 1.2 deg/sqrt(h), K: 60 deg/h/sqrt(h)}\n")
    slow = gmwm.GaussMarkov(1e-3, 30.0) + gmwm.RandomWalk(1e-4)
    rivals = {"gyro_x": (WhiteNoise(4e-4) + slow,)}
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
        ("gyro: {N: 1.2 ug}", "cannot be converted"),
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


# -- health and length ----------------------------------------------------------------------------


LENGTH = Notice("length", "good", "", "an hour")  # which every examined recording has


def issue(severity, text, where="gyro_x", **more):
    return Notice("drift", severity, where, text, hint=f"done about {text}", **more)


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
