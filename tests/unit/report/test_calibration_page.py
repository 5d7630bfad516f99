"""The HTML report: complete, self-contained, safe, and drawn by a real browser."""

import json
import re
import shutil
import subprocess
from base64 import b64encode
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser

import numpy as np
import pytest

import gmwm
from gmwm import (
    Channel,
    InputError,
    Process,
    QuantizationNoise,
    RandomWalk,
    Recording,
    WhiteNoise,
    parameter,
)
from gmwm._core.notices import Notice
from gmwm.report import write_report
from gmwm.report.budget import navigation
from gmwm.report.calibration import duration_text, needed, number, page
from gmwm.report.figure import deviation_figure

DT = 0.01
VOID = {"meta", "link", "br", "img", "input", "hr"}
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


def channel(name, values, quantity):
    unit = {"gyro": "rad/s", "accel": "m/s^2"}.get(quantity, "V")
    return Channel(name, values, DT, quantity, unit)


@pytest.fixture(scope="module")
def calibration():
    rng = np.random.default_rng(4)
    n = 8000
    white = WhiteNoise(1e-3)
    walk = WhiteNoise(4e-4) + RandomWalk(3e-4)
    rec = Recording(
        (
            channel("gyro_x", walk.simulate(n, DT, rng), "gyro"),
            channel("gyro_y", np.zeros(n), "gyro"),
            channel("accel_x", white.simulate(n, DT, rng), "accel"),
            channel("voltage", white.simulate(n, DT, rng), None),
        ),
        source="bench.csv",
        notices=(Notice("columns-not-used", "note", "", "column not used: 'temp'"),),
    )
    models = {
        "gyro_x": walk.opened(),
        "gyro_y": white,
        "accel_x": WhiteNoise() + QuantizationNoise() + RandomWalk(),
        "voltage": WhiteNoise(),
    }
    return gmwm.calibrate(rec, models)


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
        for name in ("src", "srcset", "data", "poster", "action"):
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


def test_plotly_is_inside(parsed):
    assert len(parsed.plotly) > 1_000_000
    assert "plotly.js v" in parsed.plotly[:200]


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
    assert headings == ["health", "models", "navigation", *calibration]
    links = [attributes["href"] for tag, attributes in parsed.elements if tag == "a"]
    assert links == [f"#{name}" for name in calibration]
    plots = [a["id"] for t, a in parsed.elements if t == "div" and a.get("class") == "plot"]
    assert len(plots) == len(parsed.scripts) - 2 == 2 * len(calibration) + 1
    assert len(set(plots)) == len(plots)
    drawn = [a["data-plot"] for t, a in parsed.elements if t == "script" and "data-plot" in a]
    assert drawn == plots


def test_head_line(parsed):
    assert "Stochastic error models of bench.csv" in parsed.text
    assert "80 s static at 100 Hz, 8,000 samples a channel" in parsed.text
    assert f"gmwm {gmwm.__version__}" in parsed.text


def test_notes_and_skipped_channels(parsed):
    assert "Column not used: 'temp'" in parsed.text
    assert ["gyro_y", "skipped: constant at 0 rad/s", "skipped"] in parsed.cells


def test_notices_are_sentences(parsed, calibration):
    notices = [notice for fit in calibration.fits.values() for notice in fit.notices]
    assert notices, "the fixture must have some"
    for notice in notices:
        assert notice.sentence in parsed.text


def test_valid_and_not_valid(calibration):
    for valid in (True, False):
        notices = () if valid else (Notice("misfit", "bad", "", "misses the data"),)
        fits = {name: replace(fit, notices=notices) for name, fit in calibration.fits.items()}
        shown = Page(page(replace(calibration, fits=fits)))
        verdicts = {row[0]: row[-1] for row in shown.cells if row[0] in fits and len(row) == 5}
        assert verdicts == dict.fromkeys(fits, "valid" if valid else "not valid")


def test_parameters_in_si_and_in_the_units_of_the_field(parsed, calibration):
    gyro, accel = calibration["gyro_x"].params, calibration["accel_x"].params
    degrees = 180.0 / np.pi
    for value, unit in (
        (gyro["N"], "rad/s/sqrt(Hz)"),
        (gyro["N"] * degrees * 60.0, "deg/sqrt(h)"),
        (gyro["N"] * degrees * 3600.0, "deg/h/sqrt(Hz)"),
        (gyro["K"], "rad/s/s/sqrt(Hz)"),
        (gyro["K"] * degrees * 3600.0 * 60.0, "deg/h/sqrt(h)"),
        (accel["N"], "m/s^2/sqrt(Hz)"),
        (accel["N"] / 9.80665e-6, "ug/sqrt(Hz)"),
        (accel["N"] * 60.0, "m/s/sqrt(h)"),
        (calibration["voltage"].params["N"], "u/sqrt(Hz)"),
    ):
        rows = [row for row in parsed.cells if row[4:5] == [unit]]
        assert any(float(row[2]) == pytest.approx(value, rel=1e-3) for row in rows), unit


def test_interval_of_a_parameter(parsed, calibration):
    low, high = calibration["gyro_x"].interval()["N"]
    (row,) = [row for row in parsed.cells if row[4:5] == ["rad/s/sqrt(Hz)"]]
    found = [float(text) for text in row[3].split(" to ")]
    assert found == pytest.approx([low, high], rel=1e-3)
    assert row[0] == "N"
    assert row[1] == "white noise"


def test_upper_bounds_are_shown_as_such(parsed, calibration):
    bounds = calibration["accel_x"].upper_bounds
    assert bounds, "the fixture must have one"
    shown = [row for row in parsed.cells if row[3:4] == ["upper bound, 95 %"]]
    for key, bound in bounds.items():
        row = next(row for row in shown if row[0] == key)
        assert row[2].startswith("< ")
        assert float(row[2][2:]) == pytest.approx(bound, rel=1e-3)


def test_fitness_is_told(parsed, calibration):
    fit = calibration["gyro_x"]
    assert f"objective {fit.objective:.4g} on {fit.dof} degrees of freedom" in parsed.text


# -- what it means for navigation -----------------------------------------------------------------


def test_the_error_budget_is_in_the_report(parsed, calibration):
    times = [1.0, 10.0, 60.0, 600.0]
    rows = [row for row in parsed.cells if row[:1] == ["horizontal position"]]
    for row, calibrated in zip(rows, (True, False), strict=True):
        total = gmwm.error_budget(calibration, times, calibrated=calibrated).total()["position"]
        shown = [float(cell.replace(",", "")) for cell in row[1:5]]
        assert shown == pytest.approx(total, rel=6e-3)
        assert row[5] == "m"
        assert re.fullmatch(r"gyro_x .*, \d+ %", row[6])
    head = next(row for row in parsed.cells if row[0] == "error after coasting for (1 sigma)")
    assert head[1:5] == ["1 s", "10 s", "60 s", "600 s"]


def test_every_term_of_the_error_budget_is_listed(parsed, calibration):
    budget = gmwm.error_budget(calibration)
    shown = [tuple(row[:3]) for row in parsed.cells if len(row) == 8 and row[0] in calibration]
    assert shown == [(r.channel, r.component, r.quantity) for r in budget.rows if any(r.values)]


def test_the_notes_of_the_error_budget(parsed, calibration):
    notes = gmwm.error_budget(calibration).notes
    assert notes, "the fixture must have some"
    for note in notes:
        assert f"{note[0].upper()}{note[1:]}." in parsed.text


def test_the_headline_of_a_minute(parsed, calibration):
    budgets = [gmwm.error_budget(calibration, [60.0], calibrated=c) for c in (True, False)]
    metres = [budget.total()["position"][0] for budget in budgets]
    sentence = re.search(r"A minute without aiding costs .*? of them\.", parsed.text).group()
    found = re.findall(r"([\d.,]+) m of horizontal position", sentence)
    assert [float(text.replace(",", "")) for text in found] == pytest.approx(metres, rel=6e-3)


def test_the_growth_figure(parsed, calibration):
    figure = parsed.navigation_figure()
    names = [trace["name"] for trace in figure["data"]]
    assert names == ["gyro_x", "accel_x", "total, slow errors known", "total, nothing known"]
    assert figure["layout"]["yaxis"]["title"]["text"] == "Horizontal position error, 1 sigma [m]"
    for trace, calibrated in zip(figure["data"][2:], (True, False), strict=True):
        total = gmwm.error_budget(calibration, calibrated=calibrated).total()["position"]
        assert [trace["y"][0], trace["y"][-1]] == pytest.approx(total[[0, -1]], rel=1e-5)


def test_without_inertial_sensors_nothing_is_said_of_navigation(calibration):
    fits = {"voltage": calibration["voltage"]}
    shown = Page(page(replace(calibration, fits=fits)))
    assert [a.get("id") for t, a in shown.elements if t == "h2"] == ["health", "models", "voltage"]


def test_a_channel_without_an_axis_has_rows_of_its_own(calibration):
    fits = {"gyro": calibration["gyro_x"]}
    shown = Page(page(replace(calibration, fits=fits)))
    names = [row[0] for row in shown.cells if row[:1] and row[0].startswith("gyro ")]
    assert names[:3] == ["gyro attitude", "gyro velocity", "gyro position"]
    assert "A minute without" not in shown.text


def test_a_term_without_a_budget_is_told(calibration):
    fit = calibration["gyro_x"]
    odd = replace(fit, model=fit.model + OnlySimulated(1.0))
    content = navigation(replace(calibration, fits={"gyro_x": odd}))
    assert content["problem"].startswith("OnlySimulated is known by simulation only")


class OnlySimulated(Process):
    level: float = parameter("u")

    def draw(self, n, dt, rng):
        return self.level * rng.standard_normal(n)


# -- figures --------------------------------------------------------------------------------------


def test_figures_hold_data_model_and_components(parsed, calibration):
    for fit, figure in zip(calibration.fits.values(), parsed.figures(), strict=True):
        traces = {trace["name"]: trace for trace in figure["data"]}
        positive = [label for label, curve in fit.components.items() if np.any(curve > 0.0)]
        assert list(traces) == [*positive, "model", "data, 95 % interval"]
        for trace in traces.values():
            assert trace["x"] == pytest.approx(fit.wv.tau)
            assert np.all(np.array(trace["y"]) > 0.0)
        scale = {"gyro": 180.0 / np.pi * 3600.0, "accel": 1.0 / 9.80665e-6, None: 1.0}
        factor = scale[fit.wv.quantity]
        data = traces["data, 95 % interval"]
        assert data["y"] == pytest.approx(fit.wv.allan_deviation * factor)
        upper = np.array(data["y"]) + data["error_y"]["array"]
        lower = np.array(data["y"]) - data["error_y"]["arrayminus"]
        assert upper == pytest.approx(np.sqrt(2.0 * fit.wv.upper) * factor)
        assert lower == pytest.approx(np.sqrt(2.0 * fit.wv.lower) * factor)
        assert traces["model"]["y"] == pytest.approx(np.sqrt(2.0 * fit.implied) * factor)


def test_axes_are_logarithmic_and_have_units(parsed):
    units = []
    for figure in parsed.figures():
        x, y = figure["layout"]["xaxis"], figure["layout"]["yaxis"]
        assert x["type"] == y["type"] == "log"
        assert x["title"]["text"] == "averaging time [s]"
        units.append(y["title"]["text"])
        data = figure["data"][-1]
        low, high = y["range"]
        assert low < np.log10(min(data["y"])) <= np.log10(max(data["y"])) < high
    assert units == [f"Allan deviation [{unit}]" for unit in ("deg/h", "ug", "V")]


def test_a_component_of_zero_is_not_drawn(calibration):
    fit = calibration["gyro_x"]
    nil = replace(fit, model=fit.model.with_params({"K": 0.0}))
    assert [t["name"] for t in deviation_figure(fit)["data"]][:2] == ["white noise", "random walk"]
    assert "random walk" not in [trace["name"] for trace in deviation_figure(nil)["data"]]


# Period of four samples: averages over four and more do not change at all. And white noise whose
# only coefficient at the coarsest level happens to be small: its interval has no upper end.
ODD_SERIES = {
    "no variance": (np.arange(2000) % 4 < 2) * 1e-3,
    "no upper end": np.random.default_rng(14).normal(size=64),
}


@pytest.mark.parametrize("what", ODD_SERIES)
def test_a_level_that_says_nothing_leaves_the_figure_in_numbers(what):
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), channel("gyro_x", ODD_SERIES[what], "gyro"))
    json.dumps(deviation_figure(fit), allow_nan=False)


def test_residual_figures(parsed, calibration):
    for fit, figure in zip(calibration.fits.values(), parsed.residual_figures(), strict=True):
        at = fit.goodness
        stems, points = figure["data"]
        assert points["x"] == pytest.approx(at.tau)
        assert points["y"] == pytest.approx(at.residual)
        assert [row[0] for row in points["customdata"]] == pytest.approx(100.0 * at.misfit)
        assert stems["y"][1::3] == points["y"]
        low, high = figure["layout"]["yaxis"]["range"]
        assert low < min(points["y"]) <= max(points["y"]) < high


# -- health and length ----------------------------------------------------------------------------


LENGTH = Notice("length", "good", "", "an hour")  # which every examined recording has


def issue(severity, text, where="gyro_x", **more):
    return Notice("drift", severity, where, text, action=f"done about {text}", **more)


def test_health_is_first_and_worst_first(calibration):
    notices = (
        LENGTH,
        issue("good", "fine", ""),
        issue("bad", "broken", "accel_x"),
        issue("warning", "shaken"),
        issue("note", "seen"),
    )
    shown = Page(page(replace(calibration, notices=notices)))
    headings = [a.get("id") for t, a in shown.elements if t == "h2"]
    assert headings[0] == "health"
    assert "1 severe issue, 1 warning and 1 note." in shown.text
    order = [shown.text.index(words) for words in ("Broken", "Shaken", "Seen", "Fine")]
    assert order == sorted(order)
    folded = shown.text.index("What was looked at and is fine")
    assert order[2] < folded < order[3]
    assert ["warning", "Shaken", "Done about shaken"] in shown.cells


def test_notices_of_several_recordings_say_which(calibration):
    found = [issue("warning", f"moved {k} times", source=f"run{k}.csv") for k in (1, 2)]
    notices = (LENGTH, *found)
    shown = Page(page(replace(calibration, notices=notices)))
    assert ["gyro_x, run1.csv"] in shown.cells
    assert ["gyro_x, run2.csv"] in shown.cells
    assert "2 warnings." in shown.text


def test_what_was_not_examined_says_so(calibration):
    notices = tuple(n for n in calibration.notices if n.code == "columns-not-used")
    shown = Page(page(replace(calibration, notices=notices)))
    assert "was not examined" in shown.text
    assert "column not used: 'temp'" in shown.text
    harmless = Page(page(replace(calibration, notices=(LENGTH, issue("good", "fine")))))
    assert "Nothing was found that spoils the estimates." in harmless.text


def test_an_ambiguous_choice_is_reported_with_the_channel(calibration):
    tie = Notice("ambiguity", "note", "gyro_x", "2 models describe the data equally well")
    shown = Page(page(replace(calibration, notices=(tie,))))
    assert shown.text.index("gyro_x: white noise") < shown.text.index("2 models describe")
    assert shown.text.index("2 models describe") < shown.text.index("accel_x: white noise")


def test_errors_and_lengths_are_in_the_table(parsed, calibration):
    fit = calibration["gyro_x"]
    (row,) = [row for row in parsed.cells if row[4:5] == ["rad/s/sqrt(Hz)"]]
    assert row[5] == f"{100 * fit.stderr['N'] / fit.params['N']:.2g} %"
    assert row[6] == "long enough"
    bounded = next(row for row in parsed.cells if row[0] == "K" and row[2].startswith("<"))
    assert bounded[5:] == ["", "not identified"]


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
            Notice("line", "bad", HOSTILE, f"found {HOSTILE}", action=f"done {HOSTILE}"),
            Notice("ambiguity", "note", HOSTILE, f"tie {HOSTILE}"),
        ),
    )
    unread = (Notice("columns-not-used", "note", "", f"note {HOSTILE}"),)
    shown = Page(page(replace(hostile, notices=unread)))
    assert f"note {HOSTILE}" in shown.text
    shown = Page(page(hostile))
    assert len(shown.scripts) == 5
    assert shown.count("b") == len(gyro.params)  # those of the table alone
    for words in ("models of", "skip", "why", "Found", "Done", "tie", "A"):
        assert f"{words} {HOSTILE}" in shown.text
    headings = [attributes["id"] for tag, attributes in shown.elements if tag == "h2"]
    assert headings == ["health", "models", "navigation", HOSTILE]
    assert [row[0] for row in shown.cells if row[-1:] == ["deg"]][-1] == HOSTILE


def test_units_are_text_not_markup(calibration):
    fit = calibration["voltage"]
    hostile = replace(fit, wv=replace(fit.wv, unit=HOSTILE))
    shown = Page(page(replace(calibration, fits={"voltage": hostile}, skipped={})))
    assert len(shown.scripts) == 4
    (figure,) = shown.figures()
    # Plotly knows a little markup of its own, which does no harm.
    assert "alert" in figure["layout"]["yaxis"]["title"]["text"]
    assert f"{HOSTILE}/sqrt(Hz)" in shown.text


# -- files ----------------------------------------------------------------------------------------


def test_the_file(calibration, html, tmp_path):
    path = tmp_path / "report.html"
    assert write_report(calibration, path) == path
    assert path.read_text(encoding="utf-8") == html
    assert calibration.report(tmp_path / "again.html").read_bytes() == path.read_bytes()


def test_a_folder_that_is_not_there(calibration, tmp_path):
    with pytest.raises(InputError, match=r"report\.html: cannot be written"):
        write_report(calibration, tmp_path / "nowhere" / "report.html")


# -- words ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (40.0, "40 s"),
        (119.4, "119 s"),
        (120.0, "2 min"),
        (35 * 60.0, "35 min"),
        (3599.0, "1 h 0 min"),
        (3600.0 * 2 + 46 * 60.0, "2 h 46 min"),
        (3600.0 * 100, "100 h 0 min"),
    ],
)
def test_duration(seconds, words):
    assert duration_text(seconds) == words


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0, "0"),
        (1.0, "1"),
        (2.33333, "2.333"),
        (-0.00123456, "-0.001235"),
        (1234.56, "1235"),
        (1.23456e-7, "1.235e-07"),
        (1e-7, "1.000e-07"),
    ],
)
def test_number(value, words):
    assert number(value) == words


# -- in a browser ---------------------------------------------------------------------------------


def test_a_browser_without_network_draws_every_figure(html, calibration, tmp_path):
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("chromium is not installed")
    path = tmp_path / "report.html"
    # What got in all the same would not run.
    foreign = '<script>document.title = "foreign"</script><img src="http://127.0.0.1/x.png">'
    path.write_text(html.replace("<h1>", f"{foreign}<h1>", 1), encoding="utf-8")
    command = [
        browser, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync",
        "--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={tmp_path / 'profile'}",
        "--enable-logging=stderr", "--virtual-time-budget=8000", "--dump-dom", path.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, timeout=60, check=True)
    drawn = done.stdout.decode()
    assert "<title>foreign" not in drawn
    refused = re.findall(r"CONSOLE.*Content Security Policy directive", done.stderr.decode())
    assert len(refused) == 2, done.stderr.decode()
    starts = [match.start() for match in re.finditer(r'<div class="plot[^>]* id="plot-\d+"', drawn)]
    assert len(starts) == len(calibration)
    for start, end in zip(starts, [*starts[1:], len(drawn)], strict=True):
        section = drawn[start:end].partition("</section>")[0]
        assert '<svg class="main-svg"' in section
        assert "averaging time [s]" in section
        assert section.count('class="legendtext"') >= 3
