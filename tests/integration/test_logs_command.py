"""Bags on the command line: to Kalibr in one command, and how they are refused."""

import numpy as np
import pytest
import yaml

pytest.importorskip("rosbags")  # where the lowest versions are tested, the extras are absent
from bags import ROS1, at_rest, imu_topic, write1

X = at_rest(2000)


def test_bag_to_kalibr(run, no_pages, tmp_path):
    write1(tmp_path / "static.bag", {"/imu": imu_topic(ROS1, X)})
    fixed = ("--model", "N", "--leave", "all", "-q")
    code, out, told = run("calibrate", "static.bag", "--export", "kalibr", "-o", "out", *fixed[:-1])
    assert (code, told, out.count("imu.yaml")) == (0, "", 1)  # imu.yaml once
    numbers = yaml.safe_load((tmp_path / "out" / "imu.yaml").read_text())
    assert numbers["update_rate"] == pytest.approx(100.0)
    assert numbers["gyroscope_noise_density"] == pytest.approx(1e-4, rel=0.1)
    code, _, told = run("calibrate", "static.bag", "--export", "rviz", "-o", "new", *fixed)
    assert code == 2
    assert "--export" in told and "kalibr" in told
    assert not (tmp_path / "new").exists()


def test_unit_gate(run, no_pages, tmp_path):
    write1(tmp_path / "a.bag", {"/livox/imu": imu_topic(ROS1, X / ([1.0] * 3 + [9.80665] * 3))})
    fixed = ("--model", "N", "--leave", "all", "-q")
    code, _, told = run("calibrate", "a.bag", *fixed)
    assert code == 2
    assert told.count("\n") == 1 and "--accel-unit g" in told
    assert run("calibrate", "a.bag", "--accel-unit", "g", *fixed)[0] == 0


def test_choice_of_topic_and_clock(run, tmp_path):
    topics = {"/imu0": imu_topic(ROS1, X), "/imu1": imu_topic(ROS1, np.roll(X, 1, axis=0))}
    write1(tmp_path / "a.bag", topics)
    code, _, told = run("health", "a.bag")
    assert code == 2
    assert "/imu0" in told and "--topic" in told and told.count("\n") == 1
    assert run("health", "a.bag", "--topic", "/imu1", "--clock", "log", "-q")[0] == 0
    kind, messages = imu_topic(ROS1, X)
    order = np.random.default_rng(1).permutation(2000)
    mixed = [(messages[i][0], messages[j][1]) for i, j in enumerate(order)]
    write1(tmp_path / "b.bag", {"/imu": (kind, mixed)})
    code, _, told = run("health", "b.bag")
    assert code == 2 and told.count("\n") == 1
