"""``gmwm array``: files of IMUs on one board to their weights."""

import json

import numpy as np
import pytest


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Two IMUs at 20 Hz for 200 s, the second twice as noisy."""
    folder, rng = tmp_path_factory.mktemp("board"), np.random.default_rng(1)
    paths = [folder / f"imu{k}.csv" for k in (1, 2)]
    for k, path in enumerate(paths, 1):
        values = np.column_stack([np.arange(4000) * 0.05, 0.1 * k * rng.normal(size=4000)])
        np.savetxt(path, values, "%.5f", ",", header="time [s],gyro_x [deg/s]", comments="")
    return paths


def test_command_prints_and_saves(run, files):
    code, out, _ = run("array", *files, "--horizon", "5", "-o", "array.json")
    assert code == 0 and len(out.splitlines()) <= 30
    assert out.startswith("Weights for outages of 5 s, from 200 s of 2 IMUs together")
    assert "imu1" in out and out.endswith("wrote array.json\n")
    code, printed, _ = run("array", *files, "--horizon", "5", "--json")
    found = json.loads(printed)["axes"][0]
    assert found["lower"][0] < 0.8 < found["upper"][0]
    with open("array.json") as saved:
        assert json.load(saved)["axes"][0]["weights"] == pytest.approx(found["weights"])


def test_bad_input_is_one_sentence(run, files):
    for given, message in (
        (files[:1], "an array has two IMUs or more (1 given)"),
        (files, "outages of 60 s need 960 s or more"),
    ):
        code, out, err = run("array", *given)
        assert (code, out) == (2, "") and message in err and len(err.splitlines()) == 1
