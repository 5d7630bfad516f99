"""``gmwm calibrate``: what each option does to the report that it writes."""

import html
import re

import numpy as np
import pytest

N = 5000
READING = ("--rate", "100", "--gyro-unit", "deg/s", "--accel-unit", "g", "--model", "N", "-q")
STEP = 0.08  # deg/s


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A gyro whose bias steps, another one, and an accelerometer: white noise."""
    rng = np.random.default_rng(5)
    gyro = 0.1 * rng.standard_normal((N, 2))
    gyro[3000:, 0] += STEP
    rows = np.column_stack([gyro, 1.0 + 1e-3 * rng.standard_normal(N)])
    path = tmp_path_factory.mktemp("data") / "static.csv"
    np.savetxt(path, rows, "%.6f", ",", header="gyro_x,gyro_y,accel_z", comments="")
    return path


@pytest.fixture
def report(run, file, tmp_path):
    """A function of further options: the text of the report, and the page."""

    def _report(*options):
        code, _, told = run("calibrate", file, *READING, *options, "-o", "out")
        assert code == 0, told
        page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
        shown = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL)
        return " ".join(html.unescape(re.sub("<[^>]+>", " ", shown)).split()), page

    return _report


def test_what_is_found_and_taken_off(report):
    text, _ = report()
    assert "static.csv: 50 s at 100 Hz. Usable: gyro_y and accel_z. Not valid: gyro_x." in text
    assert re.search(r"gyro_x not valid : bias step at 30\S* s", text)
    assert re.search(r"severe gyro_x A step of .*? --remove-departures", text)
    text, _ = report("--remove-departures")
    assert "at 100 Hz, 49.7 s of it used, bias steps subtracted. Usable: gyro_y and" in text
    assert re.search(r"Notes .*?gyro_x A step of .*?subtracted", text)
    assert "not valid" not in text
    assert "calibrate static.csv" not in text  # the command has the path that was given
    assert "--remove-departures -o out" in text


def test_a_data_sheet_and_an_exported_file(report, run, tmp_path):
    (tmp_path / "sheet.yaml").write_text("gyro: {N: 0.3 deg/sqrt(h), B: 7 deg/h}\n")
    text, page = report("--datasheet", "sheet.yaml", "--export", "kalibr", "--leave", "all")
    assert "data sheet : sheet.yaml" in text
    ratios = re.findall(r"Data sheet: N 0\.3 deg/sqrt\(h\) \(measured: (\S+) times\)", text)
    assert list(map(float, ratios)) == pytest.approx([2.0, 2.0], rel=0.1)  # 0.1 deg/s at 100 Hz
    assert page.count('"name":"data sheet"') == 2
    # Nothing is looked for, and what is copied is what was written.
    assert "The recording was not checked for defects." in text
    _, written, _ = run("export", "out/calibration.json", "--to", "kalibr", "--force")
    copied = re.findall("<pre[^>]*>(.*?)</pre>", page, flags=re.DOTALL)
    values = [line for line in written.splitlines() if line[:1] not in ("", "#")]
    assert values in [
        [line for line in html.unescape(text).splitlines() if line[:1] not in ("", "#")]
        for text in copied
    ]
