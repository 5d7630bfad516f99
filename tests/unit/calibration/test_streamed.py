"""Calibration of files beyond a memory budget."""

import json
import re
import tracemalloc

import numpy as np
import pytest
from click.testing import CliRunner

import gmwm
from gmwm.cli.main import cli
from gmwm.errors import InputError
from marks import slow

MODEL = gmwm.WhiteNoise() + gmwm.RandomWalk()
UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("streamed") / "static.csv"
    truth = gmwm.WhiteNoise(1e-3) + gmwm.RandomWalk(1e-3)
    columns = [gmwm.simulate(truth, n=20_000, dt=0.01, seed=seed) for seed in (1, 2)]
    rows = np.stack([*columns, np.full(20_000, 9.81)], axis=1)
    np.savetxt(path, rows, "%.9g", ",", header="gyro_x,gyro_y,accel_z", comments="")
    return path


def test_models_are_those_of_the_whole(file):
    found = gmwm.calibrate_stream(file, MODEL, screening=(), rate=100, units=UNITS, rows=3000)
    whole = gmwm.calibrate(gmwm.read(file, rate=100, units=UNITS), MODEL, screening=())
    assert list(found) == list(whole) == ["gyro_x", "gyro_y"]
    for name, fit in whole.items():
        for key, error in fit.stderr.items():
            assert abs(found[name].params[key] - fit.params[key]) < 0.02 * error
    assert found.skipped.keys() == {"accel_z"}
    assert (found.n, found.rate) == (20_000, pytest.approx(100.0))
    assert [notice.code for notice in found.notices if notice.severity == "warning"] == ["streamed"]
    assert not found.is_examined


@pytest.fixture(scope="module")
def spoilt(tmp_path_factory):
    """A line in both channels, and shocks in one, over four stretches."""
    rng = np.random.default_rng(4)
    n = 80_000
    x = rng.normal(size=(n, 2)) * 1e-3
    x += 1e-3 * np.sin(2.0 * np.pi * 7.3 * 0.01 * np.arange(n))[:, None]
    for at in (30_000, 30_500, 70_000):
        x[at : at + 20, 0] += 0.5
    path = tmp_path_factory.mktemp("spoilt") / "spoilt.npy"
    np.save(path, x)
    return path


READING = {"rate": 100, "units": UNITS, "channels": {"gyro_x": 0, "gyro_y": 1}, "rows": 20_000}


@pytest.mark.parametrize("reading", [gmwm.stream, gmwm.health_stream])
def test_memory_does_not_grow_with_the_file(reading, tmp_path):
    def peak(stretches):
        rng = np.random.default_rng(3)
        np.save(tmp_path / "long.npy", rng.normal(size=(stretches * 10_000, 2)) * 1e-3)
        tracemalloc.start()
        try:
            reading(tmp_path / "long.npy", **(READING | {"rows": 10_000}))
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(2)  # what is loaded and compiled stays
    assert peak(40) < peak(4) + 2**19  # the longer file has 5.8 MB more


def test_shocks_and_lines_are_found_stretch_by_stretch(spoilt):
    found = gmwm.health_stream(spoilt, **READING)
    assert found.n == 80_000 and found.events("gyro_y") == ()
    for at in (30_000, 30_500, 70_000):
        assert any(start <= at and stop >= at + 20 for start, stop in found.events("gyro_x"))
    (event,) = found.of("gyro_x", "event")
    assert event.values["count"] == 3 and event.values["stretches"] == 2
    assert event.values["stretch_start"] in (200.0, 600.0)
    for name in ("gyro_x", "gyro_y"):
        (line,) = found.of(name, "line")
        assert line.values["frequency"] == pytest.approx(7.3, rel=1e-3)
        ((frequency, amplitude),) = found.lines(name)
        assert frequency == pytest.approx(7.3, rel=1e-3)
        assert amplitude == pytest.approx(1e-3, rel=0.05)
    (length,) = found.of(code="length")
    assert length.values["duration"] == 800.0
    assert gmwm.Health.from_dict(found.to_dict()).events("gyro_x") == found.events("gyro_x")


def test_a_stream_is_screened_as_a_recording_is(spoilt):
    reading = {key: value for key, value in READING.items() if key != "rows"}
    found = gmwm.calibrate_stream(spoilt, **READING)
    whole = gmwm.calibrate(gmwm.read(spoilt, **reading))
    for name, fit in whole.items():
        assert found[name].valid and fit.valid
        assert found[name].params.keys() == fit.params.keys()
        for key, error in fit.stderr.items():
            assert abs(found[name].params[key] - fit.params[key]) < 0.1 * error
    assert found.is_examined
    assert found.left_out["gyro_x"] == gmwm.health_stream(spoilt, **READING).events("gyro_x")
    (line,) = [n for n in found.notices if n.code == "line" and n.where == "gyro_y"]
    assert line.hint == "a term of the model, which N and K of a filter leave out"
    (event,) = [n for n in found.notices if n.code == "event"]
    assert event.values["left_out"]
    # As it is, shocks and lines are in the noise.
    raw = gmwm.calibrate_stream(spoilt, MODEL, screening=(), **READING)
    assert raw["gyro_x"].params["N"] > 2.0 * found["gyro_x"].params["N"]


@pytest.mark.parametrize(("times", "rows"), [(2, 13_333), slow(3, 20_000)])
def test_a_channel_that_is_written_several_times_has_its_own_rate(tmp_path, times, rows):
    x = np.random.default_rng(5).normal(size=(60_000, 2)) * 1e-3
    x[:, 1] = np.repeat(x[:, 1], times)[1:60_001]
    np.save(tmp_path / "twice.npy", x)
    reading = {key: value for key, value in READING.items() if key != "rows"}
    whole = gmwm.calibrate(gmwm.read(tmp_path / "twice.npy", **reading), MODEL)
    found = gmwm.calibrate_stream(tmp_path / "twice.npy", MODEL, **{**READING, "rows": rows})
    assert list(found) == list(whole) == ["gyro_x", "gyro_y"]
    fit, of_whole = found["gyro_y"], whole["gyro_y"]
    assert (fit.wv.dt, fit.wv.n) == (pytest.approx(0.01 * times), of_whole.wv.n)
    assert fit.wv.gaps is None
    assert abs(fit.params["N"] - of_whole.params["N"]) < 0.02 * of_whole.stderr["N"]


def repeats(x):
    x[:10_000] = np.repeat(x[:10_000:3], 3)[:10_000]


def straightens(x):
    x[:10_000] = np.interp(np.arange(10_000) / 4.0, np.arange(10_000), x[:10_000])


@pytest.mark.parametrize(
    ("change", "code", "missing"),
    [(repeats, "repeated-samples", 6666), (straightens, "interpolated", 10_000)],
)
def test_samples_of_one_stretch_that_were_not_measured_cost_that_stretch(
    tmp_path, change, code, missing
):
    found = stretched(tmp_path, change)
    fit = found["gyro_x"]
    assert fit.valid and abs(fit.params["N"] / 1e-4 - 1.0) < 4.0 * fit.stderr["N"] / 1e-4
    assert fit.wv.gaps is not None
    assert fit.wv.gaps.missing == pytest.approx(missing, abs=1)
    (notice,) = [n for n in found.notices if n.code == code]
    assert notice.values["stretches"] == 1.0


def test_a_channel_that_is_interpolated_all_over_is_skipped(tmp_path):
    x = np.random.default_rng(5).normal(size=(60_000, 2)) * 1e-3
    x[:, 1] = np.interp(np.arange(60_000) / 4.0, np.arange(60_000), x[:, 1])
    np.save(tmp_path / "straight.npy", x)
    found = gmwm.calibrate_stream(tmp_path / "straight.npy", MODEL, **READING)
    assert list(found) == ["gyro_x"]
    assert found.skipped["gyro_y"].code == "interpolated"


def test_what_stretches_do_not_show_is_reported(spoilt):
    found = gmwm.calibrate_stream(spoilt, MODEL, **READING)
    texts = [notice.text for notice in found.notices if notice.code == "streamed"]
    assert len(texts) == 2
    for lost in ("drift, tilt, motion and temperature", "2 times", "at rest", "robust"):
        assert any(lost in text for text in texts)
    (streamed,) = gmwm.health_stream(spoilt, **READING).of(code="streamed")
    assert streamed.values == {"stretches": 4}


def test_a_channel_that_moved_is_not_silent(tmp_path):
    x = np.random.default_rng(5).normal(size=(60_000, 2)) * 1e-3
    x[45_000:47_000] += np.sin(0.01 * np.arange(2_000))[:, None]
    np.save(tmp_path / "moved.npy", x[:, :1])
    reading = {**READING, "channels": {"gyro_x": 0}}
    moved = gmwm.calibrate_stream(tmp_path / "moved.npy", MODEL, **reading)
    assert not moved["gyro_x"].valid
    assert "not-static" in [notice.code for notice in moved.notices]
    static = gmwm.calibrate_stream(tmp_path / "moved.npy", MODEL, still=False, **reading)
    assert "not-static" not in [notice.code for notice in static["gyro_x"].notices]
    with pytest.raises(InputError, match="screening for 'x' is unknown"):
        gmwm.calibrate_stream(tmp_path / "moved.npy", MODEL, screening=("x",), **reading)


def test_the_part_at_rest_is_one_of_the_record(tmp_path):
    """Times of the notice count from the stretch; what is advised does not."""
    x = np.random.default_rng(5).normal(size=(60_000, 1)) * 1e-3
    x[45_000:47_000, 0] += np.sin(0.01 * np.arange(2_000))
    np.save(tmp_path / "moved.npy", x)
    found = gmwm.health_stream(tmp_path / "moved.npy", **READING | {"channels": {"gyro_x": 0}})
    (moved,) = found.of(code="not-static")
    assert "cut a part at rest from the file" in moved.hint
    start, stop = (float(each) for each in re.findall(r"[\d.]+", moved.hint))
    assert 470.0 <= start < 480.0
    assert stop == pytest.approx(600.0, abs=0.02)
    assert moved.values["stretch_start"] == 400.0
    assert not {"start", "stop"} & moved.values.keys()


def stretched(tmp_path, change, **reading):
    """White noise of four stretches of 10,000 samples that is changed from the second on."""
    x = 1e-3 * np.random.default_rng(6).normal(size=40_000)
    change(x[10_000:])
    np.save(tmp_path / "changed.npy", x[:, None])
    reading = {**READING, "channels": {"gyro_x": 0}, "rows": 10_000, **reading}
    return gmwm.calibrate_stream(tmp_path / "changed.npy", gmwm.WhiteNoise(), **reading)


def dies(x):
    x[10_000:] = 0.0


def swells(x):
    x *= 1.4


@pytest.mark.parametrize(
    ("change", "code", "reason"),
    [(dies, "dead", "samples_change"), (swells, "variance", "noise_steady")],
)
def test_what_one_stretch_does_not_show_makes_the_whole_not_valid(tmp_path, change, code, reason):
    found = stretched(tmp_path, change)
    assert not found["gyro_x"].reasons[reason]
    assert [n.severity for n in found.notices if n.code == code] == ["bad"]
    assert not [n for n in found.notices if n.code == "clean"]


def test_what_is_advised_for_a_step_can_be_done_with_a_stream(tmp_path):
    """It has no part and takes nothing off."""
    x = 1e-3 * np.random.default_rng(8).normal(size=(40_000, 2))
    x[24_000:] += 4e-4
    path = tmp_path / "step.csv"
    np.savetxt(path, x, "%.7g", ",", header="gyro_x,gyro_y", comments="")
    found = gmwm.calibrate_stream(path, MODEL, rate=100, units=UNITS, rows=10_000)
    (step,) = [notice for notice in found["gyro_x"].notices if notice.code == "step"]
    before, after = step.values["time_lower"], step.values["time_upper"]
    assert before < 240.0 < after
    assert step.hint == f"cut the file: use what is before {before:.6g} s or after {after:.6g} s"
    options = [str(path), "--rate", "100", "--gyro-unit", "rad/s", "--model", "N + K"]
    options += ["-o", str(tmp_path / "out"), "--jobs", "1"]
    done = CliRunner().invoke(cli, ["calibrate", *options, "--memory", "0.0005"])
    said = " ".join(done.stdout.split())
    assert "read a stretch at a time" in said
    assert "if there is more memory, --memory GB with --stop" in said
    advised = max(re.findall(r"or (--start \S+), or --remove-departures", said))
    done = CliRunner().invoke(cli, ["calibrate", *options, "--memory", "1", *advised.split()])
    assert done.exit_code in (0, 1)
    assert "a step" not in done.stdout


def test_noise_that_stays_is_clean(tmp_path):
    found = stretched(tmp_path, lambda x: None)
    assert found["gyro_x"].valid
    assert [n.where for n in found.notices if n.code == "clean"] == ["gyro_x"]


def test_a_stretch_without_samples_is_a_gap(tmp_path):
    def ends(x):
        x[20_000:] = np.nan

    found = stretched(tmp_path, ends)
    assert found["gyro_x"].params["N"] == pytest.approx(1e-4, rel=0.03)
    assert found["gyro_x"].wv.gaps.missing == 10_000


@pytest.mark.parametrize("alike", [True, False])
def test_gaps_of_all_stretches_are_told_together(tmp_path, alike):
    """Also where one stretch has them in all channels and another in one only."""
    x = 1e-3 * np.random.default_rng(7).normal(size=(40_000, 2))
    x[2000:6000] = x[15_000:15_500] = x[31_000:32_000] = np.nan
    if not alike:
        x[18_000:18_500, 0] = np.nan
    np.save(tmp_path / "gaps.npy", x)
    reading = {key: value for key, value in READING.items() if key != "rows"}
    whole = gmwm.health(gmwm.read(tmp_path / "gaps.npy", **reading)).of(code="gap")
    found = gmwm.health_stream(tmp_path / "gaps.npy", **reading, rows=10_000).of(code="gap")
    assert [notice.where for notice in whole] == ([""] if alike else ["gyro_x", "gyro_y"])
    assert found == whole
    assert "in 3 gaps, the longest 40 s" in found[-1].text
    assert found[-1].severity == "warning"


def test_the_row_of_a_number_that_is_none_is_that_of_the_file(tmp_path):
    def breaks(x):
        x[5_000] = np.inf

    with pytest.raises(InputError, match=r"row 15000 \(counted from 0\): inf"):
        stretched(tmp_path, breaks)


def test_a_clock_that_was_set_between_stretches_is_reported(tmp_path):
    table = np.zeros((40_000, 2))
    table[:, 0] = 0.01 * np.arange(40_000)
    table[20_000:, 0] += 1.7e9
    table[:, 1] = np.random.default_rng(7).normal(size=40_000)
    np.save(tmp_path / "set.npy", table)
    reading = {**READING, "rate": None, "channels": {"gyro_x": 1}, "time": 0, "rows": 10_000}
    for screening in ((), ("events",)):
        found = gmwm.calibrate_stream(
            tmp_path / "set.npy", gmwm.WhiteNoise(), screening=screening, **reading
        )
        assert found.n == 40_000
        assert [n.severity for n in found.notices if n.code == "clock-set"] == ["warning"]


def test_health_of_one_stretch_is_that_of_the_whole(spoilt):
    reading = {key: value for key, value in READING.items() if key != "rows"}
    whole = gmwm.health(gmwm.read(spoilt, **reading))
    assert str(gmwm.health_stream(spoilt, **reading)) == str(whole)


@pytest.mark.parametrize("size", [0.3, 10.0])
def test_a_change_of_level_within_a_gap_is_reported_as_a_step(tmp_path, size):
    x = gmwm.simulate(gmwm.WhiteNoise(1e-4), n=20_000, dt=0.01, seed=3)
    x[10_000:] += size * 1e-3
    x[10_000:10_100] = np.nan
    np.save(tmp_path / "gap.npy", x[:, None])
    channels = {"gyro_x": 0}
    found = gmwm.calibrate_stream(
        tmp_path / "gap.npy", MODEL, rate=100, units=UNITS, channels=channels
    )
    assert not found["gyro_x"].reasons["stationary"]
    (step,) = [n for n in found["gyro_x"].notices if n.code == "step"]
    assert step.values["size"] == pytest.approx(size * 1e-3, rel=0.3)
    assert step.values["time_lower"] <= 101.0 and step.values["time_upper"] >= 100.0


def test_the_command_reads_blocks_beyond_its_memory(file, tmp_path):
    asked = ["calibrate", str(file), "--rate", "100", "--gyro-unit", "rad/s", "--accel-unit",
             "m/s^2", "--model", "N + K", "-q", "-o", str(tmp_path / "out")]  # fmt: skip
    done = CliRunner().invoke(cli, [*asked, "--memory", "0.0005"])
    assert done.exit_code == 0, done.output
    stored = json.loads((tmp_path / "out" / "calibration.json").read_text())
    assert "streamed" in [notice["code"] for notice in stored["notices"]]
    assert sorted(stored["channels"]) == ["gyro_x", "gyro_y"]
    assert (tmp_path / "out" / "report.html").exists()
    refused = CliRunner().invoke(cli, [*asked, "--memory", "0.0005", "--start", "1"])
    assert isinstance(refused.exception, InputError)
    assert refused.exception.code == "memory"


def test_health_beyond_memory_is_that_of_stretches(spoilt):
    asked = ["health", str(spoilt), "--rate", "100", "--gyro-unit", "rad/s",
             "--channel", "gyro_x=0", "--channel", "gyro_y=1", "--json"]  # fmt: skip
    whole = json.loads(CliRunner().invoke(cli, asked).output)
    asked += ["--memory", "0.001"]
    found = json.loads(CliRunner().invoke(cli, asked).output)
    assert found == whole  # one stretch of it
    refused = CliRunner().invoke(cli, [*asked, "--start", "10"])
    assert isinstance(refused.exception, InputError)
    assert refused.exception.code == "memory"


def test_a_file_without_a_usable_channel(tmp_path):
    np.save(tmp_path / "flat.npy", np.zeros((5000, 3)))
    with pytest.raises(InputError, match=r"flat.npy: .*constant"):
        gmwm.calibrate_stream(tmp_path / "flat.npy", rate=100, units={"gyro": "rad/s"})
