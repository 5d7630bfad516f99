from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.ins import experiment_from
from gmwm.ins.fields import read_document
from gmwm.ins.logs import LogSpec
from gmwm.ins.sensors import AXES
from gmwm.ins.spec import ExperimentSpec
from gmwm.process import RandomWalk
from places import REPOSITORY

MODELS = {"gyro": {"N": 1e-4}, "accel": {"N": 1e-2}}
LEAST = {
    "trajectory": "car",
    "duration": 30,
    "rate": 20,
    "truth": MODELS,
    "filters": {"A": "truth"},
}


def test_what_is_not_said_is_as_usual() -> None:
    found = experiment_from({"trajectory": "loiter", "truth": MODELS, "filters": {"A": "truth"}})
    assert (found.runs, found.seed, found.title) == (100, 0, "loiter")
    assert found.scenario.outages == ()
    (position,) = found.scenario.aiding.fixes
    assert position.time[1] - position.time[0] == pytest.approx(1.0)
    assert found.filters == {"A": found.truth}


def test_every_key_reaches_the_scenario() -> None:
    found = experiment_from(
        LEAST
        | {
            "duration": "0.5 min",
            "rate": "0.02 kHz",
            "outages": [["0.3 min", "6 s"], [5, 2]],
            "gnss": {"interval": 0.5, "position_sd": [1, 2, 3], "velocity_sd": "10 m/min",
                     "lever_arm": ["1 m", 0, -2], "coloured_sd": 0.5, "coloured_tau": "1 min"},
            "initial_sd": {"position": 3, "velocity": 0.2, "tilt": "1 deg", "heading": "2 deg"},
            "runs": 7,
            "seed": 3,
        }
    )  # fmt: skip
    scenario = found.scenario
    assert scenario.trajectory.duration == pytest.approx(30.0)
    assert scenario.trajectory.dt == pytest.approx(0.05)
    assert [(o.start, o.duration) for o in scenario.outages] == [(5.0, 2.0), (18.0, 6.0)]
    position, velocity = scenario.aiding.fixes
    np.testing.assert_allclose(np.diff(position.time), 0.5)
    np.testing.assert_allclose(position.sd[0], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(velocity.sd[0], 10.0 / 60.0)
    np.testing.assert_allclose(scenario.aiding.lever_arm, [1.0, 0.0, -2.0])
    np.testing.assert_allclose(scenario.aiding.coloured_sd, 0.5)
    assert scenario.aiding.coloured_tau == 60.0
    expected = [3.0, 0.2, np.radians(1.0), np.radians(2.0)]
    sd = scenario.initial_sd
    np.testing.assert_allclose([sd.position, sd.velocity, sd.tilt, sd.heading], expected)
    assert (found.runs, found.seed) == (7, 3)


def test_outages_may_touch_and_end_with_the_trajectory() -> None:
    found = experiment_from(LEAST | {"outages": [[10, 5], [15, 5], [25, 5]]})
    assert [o.end for o in found.scenario.outages] == [15.0, 20.0, 30.0]


def test_a_random_walk_in_real_errors_starts_anywhere(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    rows = rng.standard_normal((1300, 6)) + np.sin(np.arange(1300) / 200.0)[:, None]
    names = ",".join(AXES)
    np.savetxt(tmp_path / "still.csv", rows, "%.6g", ",", header=names, comments="")
    truth = {"recordings": ["still.csv"], "rate": 20, "units": {"gyro": "rad/s", "accel": "m/s^2"}}
    walking = {"gyro": {"N": 1, "K": 0.1}, "accel": {"N": 1}}
    filters = {"walking": walking, "told": {**walking, "gyro": {"N": 1, "K": 0.1, "bias": 0.5}}}
    found = experiment_from(LEAST | {"truth": truth, "filters": filters}, tmp_path)
    assert found.truth is None
    assert found.source.available == 2
    walks = found.filters["walking"]
    assert all(isinstance(walks.models[f"gyro_{a}"].terms[1], RandomWalk) for a in "xyz")
    assert walks.bias_sd["gyro_x"] > 0.0
    assert walks.bias_sd["accel_x"] == 0.0
    assert found.filters["told"].bias_sd["gyro_x"] == 0.5


def test_a_document(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(
        "\ufefftrajectory: car\nrate:\nbase: &b {x: 1}\nother: {<<: *b, x: 2}\n", "utf-8"
    )
    expected = {"trajectory": "car", "base": {"x": 1}, "other": {"x": 2}}
    assert read_document(path) == expected


def test_no_experiment() -> None:
    no_mapping: Any = 5
    with pytest.raises(InputError, match="write KEY: VALUE"):
        experiment_from(no_mapping)
    with pytest.raises(InputError, match="appears twice"):
        experiment_from(LEAST | {"filters": {1: "truth", "1": "truth"}})


def test_every_key_is_documented() -> None:
    page = (REPOSITORY / "docs/navigation.md").read_text()
    table = page.split("| key | what")[1].split("Paths are relative")[0]
    for name in ExperimentSpec.model_fields:
        assert f"`{name}`" in table
    page = (REPOSITORY / "docs/own-log.md").read_text()
    example = page.split("As a file:")[1].split("```")[1]
    for name in LogSpec.model_fields:
        assert f"\n{name}:" in example


def test_a_key_that_is_there_twice_is_named_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("trajectory: car\nrate: 100\nrate: 200\n", "utf-8")
    with pytest.raises(InputError, match="line 3: 'rate' appears twice"):
        read_document(path)


def test_a_trajectory_from_a_file(tmp_path: Path) -> None:
    """It has its own rate, and may be cut to what is in it."""
    t = 0.1 * np.arange(301)
    table = np.stack([t, 46 + 1e-5 * t, 7 + 1e-5 * t, 400 + t, 0 * t, 0 * t, 9 * t], axis=-1)
    header = "time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,yaw_deg"
    np.savetxt(tmp_path / "way.csv", table, "%.12g", ",", header=header, comments="")
    given = {"trajectory": "way.csv", "truth": MODELS, "filters": {"A": "truth"}}
    assert experiment_from(given, tmp_path).scenario.trajectory.duration == pytest.approx(30.0)
    for duration in (12.0, 30.0):
        cut = experiment_from(given | {"duration": duration}, tmp_path).scenario.trajectory
        assert cut.duration == pytest.approx(duration)
        assert cut.dt == pytest.approx(0.1)
    for wrong, words in (
        ({"duration": 30.1}, "give at most that"),
        ({"rate": 10}, "has its own"),
        ({"trajectory": "gone.csv"}, "is not a file"),
    ):
        with pytest.raises(InputError, match=words):
            experiment_from(given | wrong, tmp_path)


def test_recordings_have_the_rate_of_the_trajectory(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    names = "gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
    np.savetxt(tmp_path / "imu.csv", rng.normal(size=(1400, 6)), "%.6g", ",", header=names,
               comments="")  # fmt: skip
    truth = {"recordings": ["imu.csv"], "rate": 20,
             "units": {"gyro": "rad/s", "accel": "m/s^2"}}  # fmt: skip
    given = LEAST | {"truth": truth, "filters": {"A": MODELS}}
    found = experiment_from(given, tmp_path)
    assert found.source.available == 2  # of 30 s in 70 s
    assert found.truth is None
    with pytest.raises(InputError, match="20 Hz and the trajectory 25 Hz"):
        experiment_from(given | {"rate": 25}, tmp_path)
