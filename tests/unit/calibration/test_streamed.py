"""Calibration of files beyond a memory budget."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import gmwm
from gmwm.cli.main import cli
from gmwm.errors import InputError

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
    found = gmwm.calibrate_stream(file, MODEL, rate=100, units=UNITS, rows=3000)
    whole = gmwm.calibrate(gmwm.read(file, rate=100, units=UNITS), MODEL, screening=())
    assert list(found) == list(whole) == ["gyro_x", "gyro_y"]
    for name, fit in whole.items():
        for key, error in fit.stderr.items():
            assert abs(found[name].params[key] - fit.params[key]) < 0.02 * error
    assert found.skipped.keys() == {"accel_z"}
    assert (found.n, found.rate) == (20_000, pytest.approx(100.0))
    assert [notice.code for notice in found.notices if notice.severity == "warning"] == ["streamed"]
    assert not found.is_examined


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


def test_a_file_without_a_usable_channel(tmp_path):
    np.save(tmp_path / "flat.npy", np.zeros((5000, 3)))
    with pytest.raises(InputError, match=r"flat.npy: .*constant"):
        gmwm.calibrate_stream(tmp_path / "flat.npy", rate=100, units={"gyro": "rad/s"})
