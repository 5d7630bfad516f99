"""The page of text: its size on any recording, its digits, and what it says to do."""

import io
import re
from contextlib import redirect_stdout
from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import Channel, RandomWalk, Recording, WhiteNoise
from gmwm.cli.calibrate import show
from gmwm.export import TARGETS
from gmwm.issues import Notice
from gmwm.report import summary_text
from marks import slow

DT, SAMPLES = 0.01, 8000
WALK = WhiteNoise(4e-4) + RandomWalk(3e-4)
UNITS = {"gyro": "rad/s", "accel": "m/s^2"}
NAMES = TARGETS["openvins"].keys.names
KEYS = {"gyro": NAMES[:2], "accel": NAMES[2:]}
FILES = ["wrote out/report.html, out/imu.yaml, out/calibration.json", "next: one", "last"]


def channel(name, quantity, seed, dt=DT, unit="V"):
    values = WALK.simulate(round(SAMPLES * DT / dt), dt, seed)
    return Channel(name, values, dt, quantity, UNITS.get(quantity, unit))


def axes(pattern="{}_{}", seed=0, accel_dt=DT):
    return [
        channel(pattern.format(sensor, axis), sensor, seed + i, accel_dt if i > 2 else DT)
        for i, (sensor, axis) in enumerate((s, a) for s in UNITS for a in "xyz")
    ]


def of(*channels, source="bench.csv"):
    return Recording(tuple(channels), source=source)


def dead(name):
    return Channel(name, np.full(SAMPLES, 0.1), DT, "gyro", "rad/s")


RECORDINGS = {
    "six axes": lambda: of(*axes()),
    "gyros alone": lambda: of(*axes()[:3]),
    "one axis": lambda: of(axes()[4]),
    "no quantity": lambda: of(channel("voltage", None, 1)),
    "units of their own": lambda: of(*(channel(u, None, 1, unit=u) for u in ("V", "uT", "Pa"))),
    "two rates": lambda: of(*axes(accel_dt=2 * DT)),
    "nine axes": lambda: of(*axes(), *(channel(f"mag_{a}", None, 9, unit="uT") for a in "xyz")),
    "twenty skipped": lambda: of(*axes()[:1], *(dead(f"gyro_{k}") for k in range(20))),
    "several recordings": lambda: [of(*axes(seed=k)[:2], source=f"{k}.csv") for k in (0, 20, 40)],
    "long names": lambda: of(*axes("{}_of_the_left_front_wheel_{}"), source="x" * 200 + ".csv"),
    "thirty axes": lambda: of(
        *(one for k in range(5) for one in axes(f"{{}}_of_the_imu_{k}_{{}}", seed=10 * k))
    ),
}


@pytest.fixture(scope="module", params=[
    "no quantity", "nine axes", "several recordings",
    *map(slow, ("six axes", "gyros alone", "twenty skipped", "one axis", "units of their own",
                "two rates", "long names", "thirty axes")),
])  # fmt: skip
def calibrated(request):
    return gmwm.calibrate(RECORDINGS[request.param](), {"": WALK.opened()})


def with_defects(calibration):
    """No axis valid, and more to say of each than a page holds."""
    found = [
        gmwm.issues.notice("step", "", {"time": 30.0 + k, "evident": True, "removable": True},
                           height="+1 mg", when=f"{30 + k} s", also="", back="")
        for k in range(5)
    ]  # fmt: skip
    text = "something long that is wrong " * 9
    others = [Notice(f"own-{k}", "bad", "", text, {}, "do this about it") for k in range(5)]
    fits = {n: replace(f, notices=(*f.notices, *found, *others)) for n, f in calibration.items()}
    return replace(calibration, fits=fits)


@pytest.mark.parametrize("change", [lambda found: found, with_defects])
def test_a_page_has_thirty_lines_of_eighty_columns(calibrated, change):
    text = summary_text(change(calibrated), FILES)
    lines = text.splitlines()
    assert len(lines) <= (30 if len(calibrated) <= 9 else 31)  # six axes of two lines each
    assert max(map(len, lines)) <= 80
    assert text.endswith("\n".join(FILES))
    if not all(fit.valid for fit in change(calibrated).values()):  # which the last lines refer to
        assert re.search(r"^1\. .*\w", text, re.MULTILINE)
    assert not re.search(r"\bnan\b|\binf\b|None|…|\n\n\n", text)


def test_every_sensor_has_filter_numbers(calibrated):
    text = summary_text(calibrated)
    for quantity in UNITS:
        axes = {name: fit for name, fit in calibrated.items() if fit.wv.quantity == quantity}
        for letter, key in zip("NK", KEYS[quantity], strict=True):
            row = re.search(rf"^{key} +filter {letter} (<= )?(\S+) ", text, re.MULTILINE)
            assert (row is not None) == bool(axes)
            if axes:
                shared = next(iter(gmwm.bound(axes, horizon=60.0, shared=True).values()))
                value = pytest.approx(getattr(shared, letter), rel=5e-3)
                assert bool(row[1]) or float(row[2]) == value


# -- the same digits everywhere --------------------------------------------------------------------


@pytest.fixture(scope="module")
def two():
    return gmwm.calibrate(of(*axes()[2:4]), {"": WALK.opened()})


def printed(calibration):
    with redirect_stdout(io.StringIO()) as stream:
        show(calibration)
    return stream.getvalue()


def test_all_places_show_the_same_digits(two, tmp_path):
    """The terminal, `print`, the table, the document and the page of N, B and K."""
    frame = two.to_frame().set_index(["channel", "number"])
    page = two.report(tmp_path / "page.html").read_text(encoding="utf-8")
    for name, axis in two.numbers.items():
        (own,) = re.findall(rf'<a href="#{name}">{name}</a></th>(.*?)</tr>', page)
        shown = re.findall(r'<span class="field">(.*?)</span>', own.replace("≤", "<="))
        assert [each.replace("±", "+-").partition(" at ")[0] for each in shown] == [
            axis.text(letter) for letter in "NBK"
        ]
        (row,) = re.findall(rf"^{name} +(.*)$", printed(two), re.MULTILINE)
        assert re.findall(rf"^{name} +(.*)$", str(two), re.MULTILINE) == [row]
        cells = re.split(r"  +", row)
        for cell, number in zip(cells, axis, strict=True):
            assert cell.partition(" at ")[0] == axis.text(number.key)
            shown = frame.loc[name, number.key]
            assert shown["upper"] == pytest.approx(number.usual.upper, rel=1e-12)
            assert shown["unit"] == number.usual.unit
            assert two.to_dict()["numbers"][name][number.key]["upper"] == number.upper
            if number.kind == "bound":
                assert cell.startswith(("<= ", "-"))
            else:
                assert shown["value"] == pytest.approx(number.usual.value, rel=1e-12)
                value = float(cell.split()[0].replace(",", ""))
                assert value == pytest.approx(number.usual.value, abs=number.usual.upper / 10)


# -- what it says ----------------------------------------------------------------------------------


def test_the_verdict_counts_the_axes(two):
    assert summary_text(two).startswith(
        "bench.csv: 80 s at 100 Hz. Both axes are usable. Too short"
    )
    bad = with_defects(two)
    assert "No axis is usable." in summary_text(bad)
    one = replace(two, fits={**two.fits, "accel_x": bad["accel_x"]})
    assert "Usable: gyro_z. Not valid: accel_x." in summary_text(one)
    assert re.search(r"^accel_x +not valid: bias steps at 30 s and 4 more$",
                     summary_text(one), re.MULTILINE)  # fmt: skip
    states = dict(re.findall(r"^(\S+) +filter .*?(do not use|$)", summary_text(one), re.MULTILINE))
    assert [states[KEYS[each][0]] for each in UNITS] == ["", "do not use"]
    steps = replace(bad["accel_x"].notices[-10], severity="warning")
    inflated = replace(two["accel_x"], notices=(steps,))
    text = summary_text(replace(two, fits={**two.fits, "accel_x": inflated}))
    assert "Usable: gyro_z. Usable with reservation (*): accel_x." in " ".join(text.split())
    assert re.search(r"^accel_x\* ", text, re.MULTILINE)
    assert "\n*: bias steps or drifts enlarge B and K" in text
    assert "\n*: " not in summary_text(two)
    assert len(re.findall(r"^accelerometer_noise.* \*$", text, re.MULTILINE)) == 1


def test_of_two_commands_to_rerun_the_first_comes_first(two):
    cuts = {
        name: Notice(f"own-{name}", "bad", "", name, {}, "rerun with --start 9") for name in two
    }
    fits = {name: replace(fit, notices=(cuts[name],)) for name, fit in two.items()}
    assert "What to do: 1. first, then see what remains (" in printed(replace(two, fits=fits))
    fits["gyro_z"] = two["gyro_z"]
    assert "What to do (" in printed(replace(two, fits=fits))


def test_intervals_of_filter_numbers_reach_to_models_that_fit_equally_well(two):
    name, fit = next(iter(two.items()))
    key, own = KEYS[fit.wv.quantity][0], gmwm.bound(two, shared=True)[name]
    rival = WhiteNoise(3.0 * own.N) + gmwm.RandomWalk(own.K)
    error = 196.0 * own.stderr["N"] / own.N
    for rivals, ends in (((rival,), [error, 200.0]), ((fit.model,), [error])):
        text = printed(replace(two, rivals={name: rivals}))
        (row,) = re.findall(rf"^{key} .*/sqrt\(Hz\) +(.*) % ", text, re.MULTILINE)
        found = [float(each) for each in re.findall(r"[\d.]+", row)]
        assert found == pytest.approx(ends, abs=0.6)


def test_of_a_short_record_only_n_is_usable(two):
    text = printed(two)
    assert re.search(r"^1\. too short for 60 s outages: use N alone", text, re.MULTILINE)
    for quantity in UNITS:
        for key, word in zip(KEYS[quantity], ("usable", "do not use"), strict=True):
            assert re.search(rf"^{key} .* {word}$", text, re.MULTILINE)


def test_white_noise_behind_a_low_pass_is_one_row(capsys):
    noise = WhiteNoise(2e-4) + gmwm.LowPassNoise(4e-4, bandwidth=10.0, order=2, damping=0.707)
    x = noise.simulate(60_000, DT, seed=1)
    rec = Recording.from_arrays({"gyro_x": x}, 1 / DT, UNITS, source="a.csv")
    model = WhiteNoise() + gmwm.LowPassNoise(order=2, damping=0.707)
    cal = gmwm.calibrate(rec, model)
    show(cal, verbose=True)
    text = capsys.readouterr().out
    (row,) = re.findall(r"^  white noise +(.*\n +.*)$", text, re.MULTILINE)
    share = r"\d+ % of its power has a\s+bandwidth of"
    found = re.fullmatch(rf"N (\S+) \+-(\S+) deg/sqrt\(h\), {share} (\S+) Hz", row)
    total = np.degrees(np.hypot(2e-4, 4e-4)) * 60.0
    assert abs(float(found[1]) - total) < 3.0 * float(found[2])
    assert f"N {cal.numbers['gyro_x'].text('N')} " in row
    assert float(found[3]) == pytest.approx(10.0, rel=0.1)
    assert "low-pass noise   " not in text and "All notices" in text


def test_a_thermometer_that_is_late_is_the_first_thing_to_mend():
    """The screen said only: slow period, find the cause, such as the temperature."""
    phase = 4.0 * np.pi * np.arange(4096) / 4096
    bias = 0.02 * -np.cos(phase) + 0.008 * np.cos(phase) ** 2
    x = bias + (WhiteNoise(1e-3) + RandomWalk(5e-5)).simulate(4096, 0.5, 3)
    arrays = {"gyro_x": x, "temperature": 45.0 - 20.0 * np.cos(phase - 0.4)}
    rec = Recording.from_arrays(arrays, 2.0, {"gyro": "rad/s", "temperature": "degC"})
    cal = gmwm.calibrate(rec, "N + K", covariates={"temperature": "auto"}, jobs=1)
    to_do = " ".join(summary_text(cal).partition("What to do")[2].split())
    assert "1. gyro_x: the bias lags or leads temperature" in to_do
    assert "check the thermometer's clock" in to_do
    assert "slow period" not in to_do


def test_a_thermometer_that_fails_is_named_with_its_recording():
    """The place was empty: in all in ; check the thermometer."""
    parts = []
    for k, spikes in enumerate((1, 2)):
        temperature = np.linspace(25.0, 65.0, 4096)
        x = 1e-4 * temperature + WhiteNoise(1e-3).simulate(4096, 0.5, k)
        temperature[1000 : 1000 * spikes + 1 : 1000] = -127.0
        arrays = {"gyro_x": x, "temperature": temperature}
        rec = Recording.from_arrays(arrays, 2.0, {"gyro": "rad/s", "temperature": "degC"})
        parts.append(replace(rec, source=f"r{k}.csv"))
    cal = gmwm.calibrate(parts, "N", covariates={"temperature": "linear"}, jobs=1)
    to_do = " ".join(summary_text(cal).partition("What to do")[2].split())
    assert re.search(r"temperature jumps or is stuck for \S+ s in r[01].csv; check", to_do)
