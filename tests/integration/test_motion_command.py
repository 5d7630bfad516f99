"""``gmwm motion``: files of IMUs on one body to deviations in motion."""

import json

import numpy as np
import pytest

AXES = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Three IMUs at 50 Hz for 40 s, in deg/s and m/s^2, with white noise on one motion."""
    folder, rng = tmp_path_factory.mktemp("imus"), np.random.default_rng(3)
    time = np.arange(2000) * 0.02
    waves = rng.uniform(0.1, 2.0, (12, 6)) * time[:, None, None] * 2.0 * np.pi
    signal = np.sin(waves + rng.uniform(0.0, 6.0, (12, 6))).sum(axis=1) * [10.0] * 6
    head = ",".join(["time [s]", *(f"{n} [{'deg/s' if 'gyro' in n else 'm/s^2'}]" for n in AXES)])
    paths = []
    for k in range(3):
        values = np.column_stack([time, signal + 0.1 * rng.normal(size=signal.shape)])
        paths.append(folder / f"imu{k + 1}.csv")
        np.savetxt(paths[-1], values, "%.5f", ",", header=head, comments="")
    return paths


def test_command_prints_saves_and_draws(run, files):
    code, out, _ = run("motion", *files, "-o", "motion.json", "--plot", "motion.png")
    assert code == 0
    assert "Allan deviation of each IMU in motion: 1 flight" in out
    assert out.endswith("wrote motion.json\nwrote motion.png\n")
    code, printed, _ = run("motion", *files, "--json")
    with open("motion.json") as saved:
        assert json.loads(printed) == json.load(saved)
    first = json.loads(printed)["curves"][0]
    assert first["variance"][0] == pytest.approx(np.radians(0.1) ** 2, rel=0.2)


def test_command_takes_several_flights(run, files):
    code, out, _ = run("motion", *files, *files, "--imus", 3)
    assert code == 0
    assert "in motion: 2 flights" in out
    code, _, error = run("motion", *files, files[0], "--imus", 3)
    assert (code, error) == (2, "gmwm: 4 files are no flights of 3 IMUs: give all of each\n")
