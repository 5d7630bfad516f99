"""The report in a browser: nothing is fetched or cut off, and its controls do what they say.

One start of the browser and one page for all of them.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

import gmwm
from browser import Browser, needs_chromium
from gmwm import GaussMarkov, LowPassNoise, RandomWalk, Resonance, Sinusoid, WhiteNoise
from gmwm.issues import Notice
from gmwm.report import write_report

pytestmark = needs_chromium


@pytest.fixture(scope="module")
def shown(calibration, recording):
    """With a tie, and samples left out."""
    rival = WhiteNoise(4e-4) + GaussMarkov(3e-4, 30.0)
    return replace(calibration, rivals={"gyro_x": (rival,)}, left_out={"gyro_x": ((3000, 3100),)})


@pytest.fixture(scope="module")
def path(shown, recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    (folder / "sheet.yaml").write_text("gyro: {N: 1.2 deg/sqrt(h), B: 40 deg/h}\n")
    origin = {
        "command": f"gmwm calibrate {'folder/' * 12}bench.csv",
        "sha256": 8 * "0123456789abcdef",
    }
    return write_report(shown, folder / "report.html", recording, datasheet=folder / "sheet.yaml",
                        provenance=origin)  # fmt: skip


@pytest.fixture(scope="module")
def tab(path, tmp_path_factory):
    browser = Browser(tmp_path_factory.mktemp("profile"))
    try:
        browser.size(1300)
        # What got in all the same would not run.
        text = path.read_text(encoding="utf-8")
        foreign = '<script>document.title = "foreign"</script><img src="http://127.0.0.1/x.png">'
        path.write_text(text.replace("<header>", f"{foreign}<header>", 1), encoding="utf-8")
        browser.open(path)
        yield browser
    finally:
        browser.close()


def trace(tab, name, place="plot-1"):
    """Heights of a curve as drawn, ``None`` if it is hidden."""
    return tab.run(
        f"(function () {{ var t = document.getElementById('{place}')._fullData.find("
        f"function (t) {{ return t.name === {name!r}; }});"
        " return t.visible === true ? Array.from(t.y) : null; }())"
    )


def test_every_figure_is_drawn_and_nothing_foreign_runs(tab, path):
    assert tab.run("document.title") != "foreign"
    places = tab.run(
        "Array.from(document.querySelectorAll('.plot')).map(function (p) {"
        " return [p.id, !!p.querySelector('svg.main-svg')]; })"
    )
    assert len(places) == 3 + 1 + 4 * 3
    assert all(drawn for _, drawn in places)
    assert [each for each in tab.requests() if not each.startswith(("file:", "data:", "blob:"))
            ] == []  # fmt: skip
    complaints = [each["entry"]["text"] for each in tab.errors() if "entry" in each]
    assert len(complaints) == len(tab.errors()) == 2
    assert all("Content Security Policy" in text for text in complaints)


# What is in a cell of numbers and has a part of it on another line.
BROKEN = """(function () {
  var found = [], node, walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while ((node = walk.nextNode())) {
    if (!node.parentNode.closest('td.num')) { continue; }
    for (var word of node.textContent.matchAll(/[^\\s/\\-]{1,12}/g)) {
      var range = document.createRange();
      range.setStart(node, word.index);
      range.setEnd(node, word.index + word[0].length);
      var tops = Array.from(range.getClientRects()).map(function (r) { return r.top; });
      if (tops.length && Math.max(...tops) - Math.min(...tops) > 4) { found.push(word[0]); }
    }
  }
  return found; })()"""


@pytest.mark.parametrize(("width", "is_opened"), [(1300, False), (420, False), (420, True)])
def test_nothing_is_cut_off(tab, path, width, is_opened):
    try:
        tab.size(width)
        if is_opened:  # narrow from the start
            tab.open(path)
        tab.run("new Promise(function (done) { setTimeout(done, 400); })")  # figures follow
        assert tab.run("document.documentElement.scrollWidth") <= width
        plots = tab.run("Array.from(document.querySelectorAll('.plot svg.main-svg')).map("
                        "function (p) { return p.getBoundingClientRect().right; })")  # fmt: skip
        assert max(plots) <= width
        assert tab.run(BROKEN) == []
    finally:
        tab.size(1300)


def test_units_change_the_curves_and_the_axis(tab, calibration):
    def choose(value):
        tab.run(
            f"(function () {{ var s = document.querySelector('[data-units]'); s.value = '{value}';"
            " s.dispatchEvent(new Event('change')); }())"
        )

    def title():
        return tab.run("document.getElementById('plot-1').layout.yaxis.title.text")

    name = "data, 95 % interval"
    field = np.array(trace(tab, name))
    assert title() == "Allan deviation [deg/h]"
    try:
        choose("si")
        assert title() == "Allan deviation [rad/s]"
        assert trace(tab, name) == pytest.approx(calibration["gyro_x"].wv.allan_deviation, rel=1e-4)
        assert "rad/s/sqrt(Hz)" in tab.run("document.querySelector('.sensor').innerText")
        texts = tab.run("document.getElementById('plot-1')._fullData.slice(-1)[0].text")
        assert "rad/s/sqrt(Hz)" in texts[0]
    finally:
        choose("field")
    assert trace(tab, name) == pytest.approx(field)


def test_sliders_move_the_curve_of_the_filter(tab, calibration):
    def slide(letter, value):
        tab.run(
            "(function () { var s = document.querySelector("
            f"'[data-whatif=plot-1][data-letter={letter}]'); s.value = {value};"
            " s.dispatchEvent(new Event('input')); }())"
        )

    numbers = gmwm.bound(calibration["gyro_x"], horizon=60.0)
    assert trace(tab, "filter N and K") is None  # until a slider is moved
    slide("N", 0)
    before = np.array(trace(tab, "filter N and K"))
    drawn = "document.getElementById('plot-1')._fullData.find"
    tau = np.array(tab.run(drawn + "(function (t) { return t.name === 'filter N and K'; }).x"))
    per_si = np.degrees(1.0) * 3600.0

    def believed(N, K):
        return per_si * np.sqrt(N**2 / tau + K**2 * tau / 3.0)

    assert before == pytest.approx(believed(numbers.N, numbers.K), rel=1e-4)
    slide("N", 0.3)
    slide("K", -1)
    moved = trace(tab, "filter N and K")
    assert moved == pytest.approx(believed(10**0.3 * numbers.N, 0.1 * numbers.K), rel=1e-4)
    tab.run("document.querySelector('[data-reset=plot-1]').click()")
    assert trace(tab, "filter N and K") == pytest.approx(before)


def copied(tab, title):
    """What a button copies, by the selection that it makes."""
    tab.run(
        "Array.from(document.querySelectorAll('button[data-copy]')).find("
        f"function (b) {{ return b.textContent.startsWith({title!r}); }}).click()"
    )
    return tab.run("getSelection().toString()")


def test_copy_buttons_give_yaml_and_python(tab, calibration):
    numbers = {name: gmwm.bound(fit, horizon=60.0) for name, fit in calibration.items()}
    content = yaml.safe_load(copied(tab, "YAML, Kalibr"))
    gyro = gmwm.bound(calibration["gyro_x"], horizon=60.0)
    assert content["gyroscope_noise_density"] == pytest.approx(gyro.N, rel=1e-5)
    assert content["gyroscope_random_walk"] == pytest.approx(gyro.K, rel=1e-5)
    assert content["update_rate"] == 100
    spaces = {}
    exec(compile(copied(tab, "Python, axis"), "copied", "exec"), spaces)
    by_axis = yaml.safe_load(copied(tab, "YAML, axis"))
    assert by_axis == spaces["imu_noise"]
    for name, each in numbers.items():
        assert by_axis[name]["N"] == pytest.approx(each.N, rel=1e-5)
    assert by_axis["accel_x"]["K"] > 0.0  # the upper bound of a walk that was not found
    compile(copied(tab, "Python, GTSAM"), "copied", "exec")
    assert "gyroparams(" in copied(tab, "MATLAB")


CONTRAST = """
(function () {
  function light(c) {
    var p = c.match(/[\\d.]+/g).slice(0, 3).map(function (v) {
      v /= 255; return v <= 0.03928 ? v / 12.92 : Math.pow((v + 0.055) / 1.055, 2.4); });
    return 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
  }
  function behind(node) {
    for (; node; node = node.parentElement) {
      var c = getComputedStyle(node).backgroundColor;
      if (c !== "rgba(0, 0, 0, 0)" && c !== "transparent") { return c; }
    }
    return "rgb(255, 255, 255)";
  }
  var worst = [99, ""];
  document.querySelectorAll("body *").forEach(function (node) {
    var own = Array.from(node.childNodes).some(function (n) {
      return n.nodeType === 3 && n.textContent.trim(); });
    if (!own || !node.getClientRects().length) { return; }
    if (/SCRIPT|STYLE|OPTION/i.test(node.tagName)) { return; }
    var style = getComputedStyle(node);
    var a = light(node instanceof SVGElement ? style.fill : style.color), b = light(behind(node));
    var ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < worst[0]) { worst = [ratio, node.tagName + " " + node.textContent.slice(0, 40)]; }
  });
  return worst;
}())
"""


@pytest.mark.slow
def test_six_axes_with_much_to_say_take_eight_pages(tab, tmp_path):
    model = (
        WhiteNoise(5e-4) + RandomWalk(1e-4) + GaussMarkov(3e-4, 0.1) + GaussMarkov(2e-4, 8.0)
        + Resonance(1e-4, 10.0, 0.03) + Sinusoid(1e-4, 0.56)
        + LowPassNoise(4e-4, bandwidth=25.0, order=1, damping=0.7071)
    )  # fmt: skip
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    samples = {name: model.simulate(4000, 0.01, seed) for seed, name in enumerate(names)}
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    many = gmwm.Recording.from_arrays(samples, 100.0, units)
    found = gmwm.calibrate(many, model.with_params({"N": None}))
    text = (
        "a periodic line at 0.4626 Hz, amplitude 0.145 mg, 23.6 times the noise around it, with "
        "harmonics at 1.69 and {} Hz"
    )
    done = "counted as additive noise, which is nearly true"
    notices = [
        Notice(f"{severity}-{k}", severity, names[k % 6], text.format(k), {}, done)
        for severity, count in (("warning", 12), ("note", 14))
        for k in range(count)
    ]
    same = f"2 models describe the data equally well: {model.title()}; {model.title()}"
    notices += [Notice("ambiguity", "note", name, same) for name in names]
    full = replace(found, notices=(*found.notices, *notices))
    tab.open(write_report(full, tmp_path / "six.html", many))
    assert len(re.findall(rb"/Type\s*/Page\b", tab.pdf())) <= 8


def test_a_comparison_fits_a_telephone_and_fetches_nothing(calibration, tab, tmp_path):
    one = replace(calibration, fits={"gyro_x": calibration["gyro_x"]}, source="one.csv")
    samples = (WhiteNoise(5e-4) + RandomWalk(3e-4)).simulate(8000, 0.01, 77)
    other = replace(one.fits["gyro_x"], wv=gmwm.wavelet_variance(samples, 0.01))
    wv = replace(other.wv, name="gyro_x", quantity="gyro", unit="rad/s")
    two = replace(one, fits={"gyro_x": replace(other, wv=wv)}, source="two.csv")
    found = gmwm.compare([one, two])
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text("gyro: {N: 1.2 deg/sqrt(h), K: 40 deg/h/sqrt(h)}\n")
    tab.size(1300)
    tab.open(found.report(tmp_path / "compare.html", datasheet=sheet))
    cut = "Array.from(document.querySelectorAll('.wide')).filter(function (w) {"
    assert tab.run(f"{cut} return w.scrollWidth > w.clientWidth; }}).length") == 0
    tab.size(420)
    tab.open(found.report(tmp_path / "compare.html"))
    assert tab.run("document.documentElement.scrollWidth") <= 420
    assert tab.run(BROKEN) == []
    assert tab.run("document.querySelectorAll('.multiples svg').length") == 1
    assert [each for each in tab.requests() if not each.startswith(("file:", "data:"))] == []


def test_a_validation_fits_a_telephone_and_can_be_read(tab, tmp_path, made_up):
    found = made_up({"A": 3.0, "B": 1.0}, ((20, 10),))
    page = found.report(tmp_path / "validation.html")
    try:
        tab.size(420)
        for scheme in ("light", "dark"):
            tab.scheme(scheme)
            tab.open(page)
            assert tab.run("document.documentElement.scrollWidth") <= 420
            assert tab.run(BROKEN) == []
            ratio, where = tab.run(CONTRAST)
            assert ratio >= 4.5, (scheme, where)
        wide = (
            "Array.from(document.querySelectorAll('.fit')).map(function (f) {"
            " return f.scrollWidth > f.clientWidth; })"
        )
        assert tab.run(wide) == [False]
    finally:
        tab.scheme("light")
