"""Bags of ROS 1 and 2, written by rosbags."""

from __future__ import annotations

import shutil
import sqlite3

import numpy as np
import pytest

import gmwm
from bags import (
    IMU_TYPE,
    ROS1,
    ROS2,
    START,
    TEMPERATURE_TYPE,
    TEXT_TYPE,
    at_rest,
    imu,
    imu_topic,
    stamps,
    temperature,
    text,
    write1,
    write2,
)
from gmwm.readers.names import CANONICAL
from reading import refusal

X = at_rest()


def exact(recording, samples=X):
    return all(
        np.array_equal(recording[name].values, column)
        for name, column in zip(CANONICAL, samples.T, strict=True)
    )


@pytest.fixture
def bag1(tmp_path):
    return write1(tmp_path / "static.bag", {"/imu": imu_topic(ROS1, X)})


@pytest.mark.parametrize(
    ("clock", "stamps"), [("header", "header stamps"), ("log", "times of rec")]
)
def test_notices_speak_of_messages_and_not_of_columns(bag1, clock, stamps):
    notices = {each.code: each.text for each in gmwm.read(bag1, clock=clock).notices}
    assert notices["time-stamps"].startswith(f"time stamps ({stamps}")
    assert notices["units-from-names"].startswith("units from sensor_msgs/Imu: gyro_x, ")


# -- every way a bag is stored --------------------------------------------------------------------


@pytest.mark.parametrize("compression", [None, "BZ2", "LZ4"])
def test_ros1(tmp_path, compression):
    found = gmwm.read(write1(tmp_path / "a.bag", {"/imu": imu_topic(ROS1, X)}, compression))
    assert exact(found)
    assert found.rate == pytest.approx(100.0, rel=1e-12)


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize(
    ("storage", "compression"),
    [("SQLITE3", c) for c in (None, "FILE", "MESSAGE")]
    + [("MCAP", c) for c in (None, "FILE", "MESSAGE", "STORAGE")],
)
def test_ros2(tmp_path, storage, compression, big):
    path = write2(tmp_path / "bag", {"/imu": imu_topic(ROS2, X)}, storage, compression, big)
    found = gmwm.read(path)
    assert exact(found)
    assert found.source == "bag"


@pytest.mark.parametrize(("storage", "suffix"), [("SQLITE3", ".db3"), ("MCAP", ".mcap")])
def test_the_file_alone(tmp_path, storage, suffix):
    folder = write2(tmp_path / "bag", {"/imu": imu_topic(ROS2, X)}, storage)
    assert exact(gmwm.read(folder / f"bag{suffix}"))


@pytest.mark.parametrize("big", [False, True])
def test_alignment_behind_frames_of_every_length(tmp_path, big):
    for length in range(10):
        messages = imu_topic(ROS2, X[:70], frame="f" * length)
        path = write2(tmp_path / f"two{length}", {"/imu": messages}, big=big)
        assert exact(gmwm.read(path), X[:70])
        messages = imu_topic(ROS1, X[:70], frame="f" * length)
        assert exact(gmwm.read(write1(tmp_path / f"{length}.bag", {"/imu": messages})), X[:70])


def test_frames_that_change_within_a_topic(tmp_path):
    def bag(name, frame):
        kind, messages = imu_topic(ROS1, X)
        messages = [
            (time, imu(ROS1, stamp, six, frame(i)))
            for i, ((time, _), stamp, six) in enumerate(zip(messages, stamps(200), X, strict=True))
        ]
        return write1(tmp_path / name, {"/imu": (kind, messages)})

    assert exact(gmwm.read(bag("once.bag", lambda i: "f" * max(i - 190, 0))))
    with pytest.raises(gmwm.InputError, match="messages of 2 frame_id in turns"):
        gmwm.read(bag("turns.bag", lambda i: f"imu{i % 2}"))


# -- topics ---------------------------------------------------------------------------------------


def test_other_topics_and_empty_ones_do_no_harm(tmp_path):
    words = [(START + 10**7 * i, text(ROS2, "x" * i)) for i in range(50)]
    topics = {"/imu": imu_topic(ROS2, X), "/chat": (TEXT_TYPE, words), "/imu2": (IMU_TYPE, [])}
    assert exact(gmwm.read(write2(tmp_path / "bag", topics)))


def test_several_imus_ask_for_a_topic(tmp_path):
    other = at_rest(seed=4)
    topics = {"/imu0": imu_topic(ROS1, X), "/imu1": imu_topic(ROS1, other)}
    path = write1(tmp_path / "a.bag", topics)
    message = refusal(path)
    assert "/imu0 (200 messages), /imu1 (200 messages)" in message
    assert 'topic="/imu0"' in message
    found = gmwm.read(path, topic="/imu1")
    assert exact(found, other)
    assert [n.values["topic"] for n in found.notices if n.code == "topic"] == ["/imu1"]
    assert exact(gmwm.read(path, topic="imu0"))
    assert "no topic '/imu3'" in refusal(path, topic="/imu3")
    assert "not one gyro" in refusal(path, topic=["/imu0", "/imu1"])


@pytest.fixture(scope="module")
def d435(tmp_path_factory):
    """Gyros at 400 Hz, accelerometers at 250 Hz that begin 30 ms later, and a thermometer."""
    gyro, accel = at_rest(1600, 1), at_rest(1000, 2)
    gyro[:, 3:], accel[:, :3] = 0.0, 0.0
    warm = [(START + 10**8 * i, temperature(ROS2, START + 10**8 * i, 30.0 + i)) for i in range(41)]
    topics = {
        "/gyro/sample": imu_topic(ROS2, gyro, 400.0),
        "/accel/sample": imu_topic(ROS2, accel, 250.0, start=START + 30_000_000),
        "/gyro/temperature": (TEMPERATURE_TYPE, warm),
    }
    return write2(tmp_path_factory.mktemp("d435") / "d435", topics, "MCAP"), gyro, accel


def test_topics_of_two_rates(d435):
    path, gyro, accel = d435
    found = gmwm.read(path)
    assert [1.0 / found[name].dt for name in ("gyro_x", "accel_x")] == pytest.approx([400.0, 250.0])
    # Cut to what they share: from 30 ms to the end of the gyros at 4 s.
    assert np.array_equal(found["gyro_y"].values, gyro[12:, 1])
    assert np.array_equal(found["accel_z"].values, accel[: found["accel_z"].n, 5])
    assert found["accel_z"].n * found["accel_z"].dt == pytest.approx(found.duration, abs=0.004)
    grid = 0.03 + np.arange(found.n) / 400.0
    assert found["temperature"].values == pytest.approx(30.0 + 10.0 * grid, abs=1e-5)
    half = found.part(1.0, 3.0)
    assert (half["gyro_x"].n, half["accel_x"].n) == (800, 500)
    assert half["accel_x"].values[0] == found["accel_x"].values[250]
    assert {"accel_x", "accel_y", "accel_z", "temperature"} == set(
        gmwm.read(path, channels="accel")
    )
    only = gmwm.read(path, topic="/gyro/sample")
    assert set(only) == {"gyro_x", "gyro_y", "gyro_z", "temperature"}


@pytest.mark.parametrize(
    ("topics", "names"),
    [(["/imu/warm"], ["temperature"]),
     (["/imu/warm", "/case"], ["imu_warm_temperature", "case_temperature"])],
)  # fmt: skip
def test_of_several_thermometers_each_has_the_name_of_its_topic(tmp_path, topics, names):
    warm = {
        name: (TEMPERATURE_TYPE, [(t, temperature(ROS1, t, 30.0 + k)) for t in stamps(200)])
        for k, name in enumerate(topics)
    }
    found = gmwm.read(write1(tmp_path / "a.bag", {"/imu": imu_topic(ROS1, X), **warm}))
    assert [name for name in found if "temperature" in name] == names
    assert [found[name].mean for name in names] == [30.0, 31.0][: len(names)]


@pytest.mark.parametrize("storage", ["ROS1", "SQLITE3", "MCAP"])
@pytest.mark.parametrize(
    ("absent", "there", "word"),
    [("gyro", "accel", "angular rates"), ("accel", "gyro", "accelerations")],
)
def test_a_bag_of_one_sensor_is_read_by_the_name_of_it_only(tmp_path, storage, absent, there, word):
    samples = X.copy()
    samples[:, slice(0, 3) if absent == "gyro" else slice(3, 6)] = 0.0
    # That another IMU has both sensors does not mend the one that is chosen.
    whole = {"/whole": imu_topic(ROS1 if storage == "ROS1" else ROS2, X)}
    for others, options in (({}, {}), (whole, {"topic": "/imu"})):
        path = tmp_path / f"one{len(others)}.bag"
        if storage == "ROS1":
            write1(path, {"/imu": imu_topic(ROS1, samples), **others})
        else:
            write2(path, {"/imu": imu_topic(ROS2, samples), **others}, storage)
        with pytest.raises(gmwm.InputError, match=f"no {word}.* in /imu: .*channels=") as caught:
            gmwm.read(path, **options)
        assert caught.value.values == {"sensor": there}
        found = gmwm.read(path, channels=there, **options)
        assert {name.partition("_")[0] for name in found} == {there}
        assert not [each for each in found.notices if each.severity != "note"]


@pytest.mark.parametrize("options", [{}, {"topic": "/gyro/sample"}, {"channels": "accel"}])
def test_sensors_of_two_topics_are_there(d435, options):
    found = gmwm.read(d435[0], **options)
    assert not [each for each in found.notices if each.severity != "note"]


def test_topics_without_common_time(tmp_path):
    gyro, accel = X.copy(), X.copy()
    gyro[:, 3:], accel[:, :3] = 0.0, 0.0
    topics = {
        "/gyro": imu_topic(ROS1, gyro),
        "/accel": imu_topic(ROS1, accel, start=START + 10**10),
    }
    assert "no time in common" in refusal(write1(tmp_path / "a.bag", topics))


# -- stamps ---------------------------------------------------------------------------------------


def test_time_of_recording(tmp_path):
    kind, messages = imu_topic(ROS1, X)
    late = [(START + i * 5_000_000, message) for i, (_, message) in enumerate(messages)]
    path = write1(tmp_path / "a.bag", {"/imu": (kind, late)})
    assert gmwm.read(path).rate == pytest.approx(100.0)
    assert gmwm.read(path, clock="log").rate == pytest.approx(200.0)
    assert "clock = 'bag'" in refusal(path, clock="bag")


def test_headers_without_stamps(tmp_path):
    kind, messages = imu_topic(ROS1, X)
    bare = [(time, imu(ROS1, 0, six)) for (time, _), six in zip(messages, X, strict=True)]
    path = write1(tmp_path / "a.bag", {"/imu": (kind, bare)})
    assert 'clock="log"' in refusal(path)
    assert exact(gmwm.read(path, clock="log"))


# -- units ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("store", [ROS1, ROS2])
def test_accelerometer_in_g(tmp_path, store):
    samples = X / [1, 1, 1, 9.80665, 9.80665, 9.80665]
    topics = {"/livox/imu": imu_topic(store, samples)}
    path = (write1 if store is ROS1 else write2)(tmp_path / "a.bag", topics)
    assert 'units={"accel": "g"}' in refusal(path)
    found = gmwm.read(path, units={"accel": "g"})
    assert found["accel_z"].mean == pytest.approx(9.8, abs=0.01)


# -- what cannot be used --------------------------------------------------------------------------


def test_truncated(bag1, tmp_path):
    whole = bag1.read_bytes()
    for size in (0, 5, 13, 1000, len(whole) // 2, len(whole) - 100):
        bag1.write_bytes(whole[:size])
        assert refusal(bag1).startswith("static.bag is ")
    for storage, suffix in (("SQLITE3", ".db3"), ("MCAP", ".mcap")):
        folder = write2(tmp_path / storage, {"/imu": imu_topic(ROS2, X)}, storage)
        file = next(each for each in folder.iterdir() if each.suffix == suffix)
        whole = file.read_bytes()
        for size in (0, 10, 100, len(whole) // 2, len(whole) - 1):
            file.write_bytes(whole[:size])
            assert " is " in refusal(folder)
            assert file.name in refusal(file)


def test_unknown_compression(bag1):
    data = bag1.read_bytes()
    bag1.write_bytes(data.replace(b"compression=none", b"compression=gzip"))
    assert "'gzip' is not supported" in refusal(bag1)


def test_folder_without_metadata(tmp_path):
    folder = write2(tmp_path / "bag", {"/imu": imu_topic(ROS2, X)})
    (folder / "metadata.yaml").unlink()
    assert refusal(folder).startswith("bag has no metadata.yaml: name the .db3 or .mcap file")


def test_missing_storage(tmp_path):
    folder = write2(tmp_path / "bag", {"/imu": imu_topic(ROS2, X)})
    (folder / "bag.db3").unlink()
    assert "missing" in refusal(folder)


def test_no_imu(tmp_path):
    path = write1(tmp_path / "a.bag", {"/chat": (TEXT_TYPE, [(START, text(ROS1, "hello"))])})
    assert "a.bag has no messages of sensor_msgs/Imu: it has /chat" in refusal(path)
    assert "it is empty" in refusal(write1(tmp_path / "b.bag", {}))
    for content, words in ((b"", "c.bag is empty"), (b"no bag", "c.bag is not a ROS bag")):
        (tmp_path / "c.bag").write_bytes(content)
        assert words in refusal(tmp_path / "c.bag")


def test_stamps_out_of_order(tmp_path):
    kind, messages = imu_topic(ROS1, X)
    order = np.random.default_rng(1).permutation(200)
    shuffled = [(messages[i][0], messages[j][1]) for i, j in enumerate(order)]
    path = write1(tmp_path / "a.bag", {"/imu": (kind, shuffled)})
    assert "of /imu (counted from 0)" in refusal(path)


def test_infinite_sample(tmp_path):
    samples = X.copy()
    samples[7, 4] = np.inf
    path = write1(tmp_path / "a.bag", {"/imu": imu_topic(ROS1, samples)})
    assert "'accel_y [m/s^2]', message 7 of /imu" in refusal(path)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ("substr(data, 1, 200) WHERE id = 91", "message 90 of /imu (counted from 0) is cut off"),
        ("CAST(X'0007' || substr(data, 3) AS BLOB)", "is not plain CDR"),
    ],
)
def test_messages_that_are_not_those_of_their_type(tmp_path, change, reason):
    folder = write2(tmp_path / "bag", {"/imu": imu_topic(ROS2, X)})
    with sqlite3.connect(folder / "bag.db3") as base:
        base.execute(f"UPDATE messages SET data = {change}")
    base.close()
    assert reason in refusal(folder)


def test_a_part_of_another_name(bag1, tmp_path):
    shutil.copy(bag1, tmp_path / "recording.dat")
    assert exact(gmwm.read(tmp_path / "recording.dat"))


def test_topic_of_a_file_without(tmp_path):
    np.save(tmp_path / "a.npy", X)
    assert "has no topics" in refusal(tmp_path / "a.npy", topic="/imu")
