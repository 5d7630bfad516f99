"""``gmwm motion``: files of IMUs on one body to deviations in motion."""

import json

import numpy as np
import pytest

from bags import ROS1, ROS2, imu_topic, write1, write2
from flight_logs import IMU, imu_messages, integrated, write_dataflash, write_ulog
from marks import every

AXES = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]


@pytest.fixture(scope="module")
def samples():
    """Of three IMUs at 50 Hz for 40 s, in deg/s and m/s^2, with white noise on one motion."""
    rng, time = np.random.default_rng(3), np.arange(2000) * 0.02
    waves = rng.uniform(0.1, 2.0, (12, 6)) * time[:, None, None] * 2.0 * np.pi
    signal = np.sin(waves + rng.uniform(0.0, 6.0, (12, 6))).sum(axis=1) * [10.0] * 6
    return [signal + 0.1 * rng.normal(size=signal.shape) for _ in range(3)]


@pytest.fixture(scope="module")
def files(samples, tmp_path_factory):
    folder, time = tmp_path_factory.mktemp("imus"), np.arange(2000) * 0.02
    head = ",".join(["time [s]", *(f"{n} [{'deg/s' if 'gyro' in n else 'm/s^2'}]" for n in AXES)])
    paths = [folder / f"imu{k + 1}.csv" for k in range(3)]
    for path, own in zip(paths, samples, strict=True):
        values = np.column_stack([time, own])
        np.savetxt(path, values, "%.5f", ",", header=head, comments="")
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
    assert (code, error) == (
        2,
        "gmwm: 4 files are not a multiple of 3 IMUs: give a file of each IMU for every flight\n",
    )


def px4(folder, samples):
    topics = [integrated(own, k, 20_000) for k, own in enumerate(samples)]
    return write_ulog(folder / "flight.ulg", *topics)


def ardupilot(folder, samples):
    by_imu = [imu_messages(own, k, 20_000) for k, own in enumerate(samples)]
    messages = [message for each in zip(*by_imu, strict=True) for message in each]
    return write_dataflash(folder / "flight.bin", [IMU], messages)


def bag1(folder, samples):
    topics = {f"/imu{k}": imu_topic(ROS1, own, 50.0) for k, own in enumerate(samples)}
    return write1(folder / "flight.bag", topics)


def bag2(folder, samples):
    topics = {f"/imu{k}": imu_topic(ROS2, own, 50.0) for k, own in enumerate(samples)}
    return write2(folder / "flight", topics)


LOGS = {px4: "imu {}", bag1: "/imu{}", ardupilot: "imu {}", bag2: "/imu{}"}


@pytest.mark.parametrize("write", every(2, LOGS))
def test_command_takes_all_imus_of_a_log(run, samples, files, tmp_path, write):
    """As files of their own: but for rounding, the curves are the same."""
    log = write(tmp_path, [own * ([np.pi / 180.0] * 3 + [1.0] * 3) for own in samples])
    of_files = json.loads(run("motion", *files, "--json")[1])
    code, out, error = run("motion", log, "--json")
    assert (code, error) == (0, "")
    found = json.loads(out)
    assert found["imus"] == [LOGS[write].format(k) for k in range(3)]
    for own, other in zip(found["curves"], of_files["curves"], strict=True):
        assert own["variance"] == pytest.approx(other["variance"], rel=0.02)
    code, out, _ = run("motion", log, log, "--logs")
    assert code == 0
    assert "2 flights" in out


def test_command_takes_some_topics_of_a_log(run, samples, tmp_path):
    log = px4(tmp_path, samples)
    topics = [part for k in (2, 0) for part in ("--topic", f"vehicle_imu[{k}]")]
    code, out, _ = run("motion", log, *topics, "--json")
    assert code == 0
    assert json.loads(out)["imus"] == ["imu 2", "imu 0"]
    code, _, error = run("motion", log, *topics[:2])
    assert (code, error) == (2, "gmwm: flight.ulg has one IMU: give a file of each IMU\n")


def test_command_rejects_increments_that_the_logger_thinned(run, samples, tmp_path):
    topics = [integrated(own, k, 500_000, 5000) for k, own in enumerate(samples)]
    code, _, error = run("motion", write_ulog(tmp_path / "flight.ulg", *topics))
    assert code == 2
    assert "each row of vehicle_imu covers 5 ms, and rows are 500 ms apart" in error


def test_command_gives_numbers_of_a_class(run, files, no_pages):
    """And exports them."""
    code, out, error = run("motion", *files, "--at", "low", "-o", "low.json", "--report", "a.html")
    assert (code, error) == (0, "")
    assert out.endswith("wrote low.json\nwrote a.html\n")
    assert "largest axis and IMU, SI" in out
    code, out, error = run("export", "low.json", "--to", "kalibr")
    assert (code, error) == (0, "")
    assert "N+K for outages up to 1 s, motion" in out
    code, _, error = run("motion", *files, "--at", "rest")
    assert (code, error) == (2, "gmwm: no class 'rest': there are low, middle, high\n")
    code, _, error = run("motion", *files, "--limits", "3,x")
    assert (code, error) == (2, "gmwm: --limits 3,x: write two levels, e.g. 1,4\n")
