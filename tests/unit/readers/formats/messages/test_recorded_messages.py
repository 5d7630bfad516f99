# ruff: noqa: E501 - tables
"""Messages, topics and damage to containers, byte by byte: what each gives, or its message."""

import struct
from types import SimpleNamespace

import numpy as np
import pytest

from gmwm import InputError
from gmwm.readers.formats.hdf5 import _HEAP, _SIGNATURE, _check_heaps
from gmwm.readers.formats.messages.endings import cut_off, end_of_content
from gmwm.readers.formats.messages.parts import MessageTable
from gmwm.readers.formats.messages.ros_messages import CDR, IMU, ROS1, TEMPERATURE, decode
from gmwm.readers.formats.messages.rosbag import _check_pages, _counts, _is_ros1, _sensors
from gmwm.readers.formats.messages.topics import Topic, Wanted, choose, choose_first, left_out
from gmwm.readers.formats.messages.ulog import _Stream
from recorded import assert_as_recorded, refused


def message(k, frame=b"imu\0", order="<", kind="cdr", cut=0):
    """Of an IMU: header, then 37 numbers."""
    head = {
        "cdr": b"\0\1\0\0" if order == "<" else b"\0\0\0\0",
        "ros1": struct.pack("<I", k),
        "odd": b"\0\7\0\0",
    }[kind]
    data = head + struct.pack(f"{order}III", 10 + k, 7 * k, len(frame)) + frame
    if kind != "ros1":
        data += bytes(-(len(data) - 4) % 8)
    data += struct.pack(f"{order}37d", *(k + 0.5 * i for i in range(37)))
    return data[: len(data) - cut]


def test_messages():
    found = {}
    for name, serialization, raw in (
        ("cdr", CDR, [message(k) for k in range(5)]), ("ros1", ROS1, [message(k, kind="ros1") for k in range(5)]),
        ("frames", CDR, [message(k, b"a" * (k % 3 * 7 + 1)) for k in range(6)]), ("big", CDR, [message(k, order=">") for k in range(3)]),
        ("mixed", CDR, [message(k, order="<>"[k % 2]) for k in range(5)]), ("frames of ros1", ROS1, [message(k, b"b" * (k % 4), kind="ros1") for k in range(6)]),
        ("cut", CDR, [message(0), message(1), message(2, cut=1)]), ("short", CDR, [message(0), message(1)[:15], message(2)]),
        ("least", CDR, [message(0), message(1)[:16]]), ("odd", CDR, [message(0), message(1, kind="odd")]), ("all cut", ROS1, [message(0, kind="ros1", cut=8)] * 2),
    ):  # fmt: skip

        def act(raw=raw, serialization=serialization):
            stamps, numbers = decode(
                raw, IMU, [0, 4, 5, 29, 36], serialization, "message {}".format
            )
            return [stamps, numbers]

        found[name] = refused(act)
    for frame in range(10):
        found[f"offset {frame}"] = [CDR.offset(frame), ROS1.offset(frame)]
    found["columns"] = [dict(IMU.columns), IMU.count, TEMPERATURE.count]

    class Reader:
        start_time, end_time = 100, 200
        connections = tuple(SimpleNamespace(topic=t, msgtype=f"sensor_msgs/msg/{k}", msgcount=n) for t, k, n in (
            ("/a", "Imu", 3), ("/a", "Imu", 2), ("/b", "Imu", 0), ("/t", "Temperature", 4), ("/c", "Image", 5)))  # fmt: skip

        def __init__(self, later):
            self.later = later

        def messages(self, connections, start=None):
            assert [each.topic for each in connections] == ["/a", "/a"]
            assert start in (None, 150)
            return [(None, start, raw) for raw in self.later]

    found["counts"] = _counts(Reader([]))
    bag = SimpleNamespace(path=SimpleNamespace(name="a.bag"), serialization=CDR)
    zeros = message(0)[:24] + bytes(37 * 8)
    no_gyro = bytearray(message(1))
    for of in (9, 18, 27):
        no_gyro[-8 * (37 - of) :][:8] = struct.pack("<d", -1.0)
    for name, head, later in (
        ("both", [message(1)], []), ("later", [zeros], [message(1)]), ("never", [zeros], [zeros]), ("none", [], []), ("one", [bytes(no_gyro)], [zeros]),
    ):  # fmt: skip
        found[f"sensors {name}"] = sorted(
            _sensors(Reader(later), "/a", bag, [(None, 0, raw) for raw in head])
        )
    assert_as_recorded("readers/messages", found)


def test_topics():
    both, gyro, accel, more = (
        Topic("/a/", 5),
        Topic("b", 1200, frozenset(["gyro"])),
        Topic("c", 3, frozenset(["accel"])),
        Topic("d", 4),
    )
    found = {"shown": list(map(str, (both, gyro, accel)))}
    for name, topics in (
        ("one", [both]),
        ("gyro", [gyro]),
        ("pair", [gyro, accel]),
        ("two", [both, more]),
        ("three", [gyro, accel, both]),
        ("same", [gyro, gyro]),
    ):
        for wanted, by_channel in (
            ((), False), ((), True), (("b",), False), (("b", "c"), False), (("b", "c"), True),
            (("c", "c"), False), (("a", "d"), False),
        ):  # fmt: skip
            asked = Wanted(wanted, "header", by_channel, False)
            found[f"{name} {wanted} {by_channel}"] = [
                refused(lambda a=asked, t=topics: [each.name for each in choose("log", t, a)]),
                refused(lambda a=asked, t=topics: [each.name for each in choose_first("log", [[], t, [more]], a)]),
            ]  # fmt: skip
    found["left out"] = [
        left_out([[both], [gyro, accel]], chosen)
        for chosen in ((both,), (gyro, accel), (both, gyro, accel))
    ]
    assert_as_recorded("readers/topics", found)


def test_damaged_containers(tmp_path):
    path, found = tmp_path / "a.db3", {}
    head = _SIGNATURE + bytes([0, 0, 0, 0, 0, 8, 8, 0])

    def size_of(index, text):
        return len(text) + 16 * (index == 0 and text != b"")  # free space counts its head

    def heap(*objects, size=None):
        body = b"".join(
            struct.pack("<HHIQ", i, 1, 0, size_of(i, text)) + text + bytes(-len(text) % 8)
            for i, text in objects
        )
        return _HEAP + struct.pack("<Q", 16 + len(body) if size is None else size) + body

    unit = b"units\0\0\0\x19abc\x10\0\0\0" + b"12345678" + b"\0\0\0\0\x01" + bytes(7) + b"%s"
    for name, data in {
        "good": head + heap((1, b"rad/s"), (2, b"12345678")), "free": head + heap((1, b"x"), (0, b"")), "free sized": head + heap((0, b"y" * 16)),
        "beyond": head + heap((1, b"x"), size=999), "exact": head + heap((1, b"x")), "second": head + heap((1, b"x")) + heap((0, b"")),
        "at zero": heap((0, b"")) + head, "newer": _SIGNATURE + bytes([2, 8, 8, 0]) + heap((0, b"")), "other size": _SIGNATURE + bytes([0] * 5 + [8, 4, 0]) + heap((0, b"")),
        "newer other": _SIGNATURE + bytes([2, 8, 4, 0]) + bytes(8) + heap((0, b"")), "long unit": head + heap((1, b"x")) + unit.replace(b"%s", struct.pack("<I", 10**6)),
        "four bytes": _SIGNATURE + bytes([2, 4, 8, 0, 0, 0, 0, 0]) + heap((0, b"")), "short unit": head + heap((1, b"x")) + unit.replace(b"%s", struct.pack("<I", 5)),
        "sized then free": head + heap((1, b"123456789"), (0, b"")),
    }.items():  # fmt: skip
        path.write_bytes(data)
        with path.open("rb") as stream:
            found[name] = refused(lambda s=stream: _check_heaps(s))
    for size, length in (
        (4096, 8192),
        (4096, 8193),
        (1, 65536),
        (1, 4096),
        (0, 5000),
        (512, 1024),
        (512, 1000),
    ):
        path.write_bytes((b"SQLite format 3\0" + size.to_bytes(2, "big")).ljust(length, b"\0"))
        found[f"pages {size} {length}"] = (refused(lambda: _check_pages(path)) or [""])[0].replace(
            str(tmp_path), ""
        )
    for name, data in (("a.bag", b"#ROSBAG V2.0\n"), ("a.mcap", b"\x89MCAP0\r\n"), ("a.db3", b"SQLite format 3\0"), ("b.bag", b"\x89MCAP0\r\n"),
                       ("c.x", b"#ROSBAG V2.0\n"), ("d.bag", b""), ("e.bag", b"hello")):  # fmt: skip
        (tmp_path / name).write_bytes(data)
        found[name] = refused(lambda n=name: _is_ros1(tmp_path / n))
    for data in (
        b"",
        b"\0\0\0",
        b"abc",
        b"abc\0\0",
        b"abc\xff",
        b"a\0\xff\xff",
        b"x" + bytes(70_000),
        bytes(70_000),
        b"\0a",
    ):
        path.write_bytes(data)
        found[f"end {data[:5]} {len(data)}"] = end_of_content(path)
    found["cut off"] = cut_off(1.25)
    for data in (b"12345678", b"123", b"123\0\0", b""):
        path.write_bytes(data)
        for size in (3, 5, -1):
            with _Stream(path) as stream:
                parts = [stream.read(size).decode() for _ in range(3)]
                found[f"stream {data} {size}"] = [parts, stream.is_cut]
    assert_as_recorded("readers/damaged_containers", found)


class Table(MessageTable):
    source = "log"
    sizes = (3, 4, 2)

    def parts(self, columns):
        at = 0
        for size in self.sizes:
            yield {i: 10.0 * i + np.arange(at, at + size) for i in columns}
            at += size


def test_tables_of_messages():
    found = {"where": Table(Topic("/a", 9), ("t", "x")).where(4)}
    for count in (8, 9, 10):
        table = Table(Topic("/a", count), ("t", "x"))
        found[f"load {count}"] = refused(
            lambda t=table: {str(k): v for k, v in t.load([0, 1]).items()}
        )
    for rows in (1, 3, 4, 7, 8, 100):
        found[f"rows {rows}"] = [part[1] for part in table.segments([1], rows)]
    with pytest.raises(InputError, match="message 5 of /a"):
        table.checked({1: np.array([0.0, np.inf])}, 4)
    assert_as_recorded("readers/tables_of_messages", found)
