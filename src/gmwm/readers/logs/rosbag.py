"""ROS bags by `rosbags`, without a ROS installation: ROS 1, ROS 2 in SQLite or MCAP.

Read in blocks of messages, so that memory holds no more than the columns that are asked for.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import islice
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.issues import notice
from gmwm.readers.logs.ros_messages import (
    CDR,
    COVARIANCE_OF,
    IMU,
    ROS1,
    TEMPERATURE,
    Message,
    Serialization,
    decode,
)
from gmwm.readers.logs.topics import MessageTable, Topic, choose
from gmwm.readers.registry import Wanted
from gmwm.readers.table import Columns, damage_named, library

_BLOCK = 1024  # messages: 0.3 MB of sensor_msgs/Imu, which stay in the cache
_SEEN = 64  # messages from which it is judged what a topic holds

_ROS1, _MCAP, _SQLITE = b"#ROSBAG", b"\x89MCAP", b"SQLite format 3"

_TYPES = {"sensor_msgs/msg/Imu": IMU, "sensor_msgs/msg/Temperature": TEMPERATURE}
_STAMPS = "time [ns]"

_Record = tuple[Any, int, bytes]


@dataclass(frozen=True)
class _Bag:
    """A bag: a file, or a folder of ROS 2."""

    path: Path
    is_ros1: bool

    @property
    def serialization(self) -> Serialization:
        return ROS1 if self.is_ros1 else CDR

    @contextmanager
    def opened(self) -> Iterator[Any]:
        """The reader of `rosbags`; what it raises is one sentence."""
        with damage_named(self.path.name, self._damage):
            yield self._reader

    @cached_property
    def _reader(self) -> Any:
        """Open until the bag is dropped: its index may take as long to read as its messages."""
        kind = "rosbag1" if self.is_ros1 else "rosbag2"
        for file in sorted(self.path.glob("*.db3")) if self.path.is_dir() else [self.path]:
            _check_pages(file)
        reader = library(f"rosbags.{kind}", "ros", self.path.name).Reader(self.path)
        reader.open()
        weakref.finalize(self, reader.close)
        return reader

    def _damage(self, error: Exception) -> str:
        text = str(error).replace(str(self.path), self.path.name).rstrip(".")
        tools = "rosbag reindex or decompress" if self.is_ros1 else "ros2 bag reindex or convert"
        return (
            f"is damaged or of an unknown kind{f' ({text})' if text else ''}: get a whole copy, "
            f"or try {tools}"
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class BagTable(MessageTable):
    """A topic of a bag: one message a row, its stamp and numbers in it.

    is_log: Whether the stamps are the times at which the messages were recorded.
    start: Stamp that is written as zero, ns.
    """

    bag: _Bag
    message: Message
    is_log: bool
    start: int

    def parts(self, columns: Sequence[int]) -> Iterator[Columns]:
        """Columns of one block of messages after another.

        Raises InputError if every header has the same stamp.
        """
        wanted = [column for column in columns if column > 0]
        numbers = [self.message.columns[self.names[column]] for column in wanted]
        row, first, changes = 0, 0, False
        with self.bag.opened() as reader:
            # Records that are let go at once are cheap; of those held, so are messages alone.
            parts = itemgetter(1, 2) if self.is_log else itemgetter(2)
            records = map(parts, _messages(reader, self.topic.name))
            while block := list(islice(records, _BLOCK)):
                times, raw = zip(*block, strict=True) if self.is_log else ((), block)
                where = partial(self._place, row)
                stamps, found = decode(raw, self.message, numbers, self.bag.serialization, where)
                if self.is_log:
                    stamps = np.array(times, np.int64)
                first = first if row else int(stamps[0])
                changes = changes or bool(np.any(stamps != first))
                row += len(block)
                part = dict(zip(wanted, found, strict=True))
                yield {0: (stamps - self.start).astype(float)} | part if 0 in columns else part
        if 0 in columns and row > 1 and not changes:
            raise InputError(
                f"{self.source}, topic {self.topic.name}: every header has the same stamp",
                "no-stamps",
                'use the time of recording, clock="log"',
            )

    def _place(self, first: int, row: int) -> str:
        return f"{self.source}, {self.where(first + row)}"


def open_bag(path: Path, wanted: Wanted) -> tuple[BagTable, ...]:
    """Open a bag.

    path: A file, or the folder of a bag of ROS 2.
    Returns: one table for each topic, those of thermometers last.
    Raises InputError if it is damaged, holds no IMU or half of one, or topics have to be chosen.
    """
    is_folder = path.is_dir()
    if is_folder and not (path / "metadata.yaml").is_file():
        raise InputError(
            f"{path.name} has no metadata.yaml: name the .db3 or .mcap file in it, or write one "
            "with ros2 bag reindex"
        )
    bag = _Bag(path, not is_folder and _is_ros1(path))
    with bag.opened() as reader:
        counts, others = _counts(reader)
        of_imu, warmth = counts["sensor_msgs/msg/Imu"], counts["sensor_msgs/msg/Temperature"]
        if not of_imu:
            listed = ", ".join(others[:8]) + (", ..." if len(others) > 8 else "")
            raise InputError(
                f"{path.name} has no messages of sensor_msgs/Imu: "
                + (f"it has {listed}; record the topic of the IMU" if others else "it is empty")
            )
        heads = {topic: list(islice(_messages(reader, topic), _SEEN)) for topic in of_imu}
        found = [
            Topic(topic, count, _sensors(reader, topic, bag, heads[topic]))
            for topic, count in of_imu.items()
        ]
        chosen = choose(path.name, found, wanted)
        is_log = wanted.clock == "log"
        _, start, message = heads[chosen[0].name][0]
        if not is_log:
            stamps, _ = decode([message], IMU, [], bag.serialization, lambda i: path.name)
            start = int(stamps[0])

    def table(topic: Topic, message: Message, names: Iterable[str]) -> BagTable:
        return BagTable(
            source=path.name,
            names=(_STAMPS, *names),
            stamps="times of recording" if is_log else "header stamps",
            origin="sensor_msgs/Imu",
            topic=topic,
            bag=bag,
            message=message,
            is_log=is_log,
            start=start,
        )

    tables = []
    for topic in chosen:
        sensors = topic.sensors or frozenset(SI_UNIT)
        names = [name for name in IMU.columns if name.partition("_")[0] in sensors]
        tables.append(table(topic, IMU, names))
        told = " and ".join(sorted(sensors))
        tables[-1].notices.append(notice("topic", "", {"topic": topic.name}, sensors=told))
    for name, count in warmth.items():
        # By the topic if there are several.
        prefix = "" if len(warmth) == 1 else name.strip("/").replace("/", "_") + "_"
        warm = Message(TEMPERATURE.count, {f"{prefix}temperature [degC]": 0})
        tables.append(table(Topic(name, count), warm, warm.columns))
    return tuple(tables)


def _check_pages(path: Path) -> None:
    """Refuse a file of SQLite that ends inside a page, whose rest SQLite takes for zeros.

    Its size is in the header (SQLite, Database File Format, 1.3.2).
    """
    with path.open("rb") as stream:
        head = stream.read(18)
    size = int.from_bytes(head[16:], "big")
    if head.startswith(_SQLITE) and path.stat().st_size % (65536 if size == 1 else size or 1):
        raise ValueError(f"{path.name} ends inside a page")


def _is_ros1(path: Path) -> bool:
    with damage_named(path.name), path.open("rb") as stream:
        head = stream.read(16)
    for magic, suffix in ((_ROS1, ".bag"), (_MCAP, ".mcap"), (_SQLITE, ".db3")):
        if head.startswith(magic):
            if path.suffix.lower() != suffix and magic != _ROS1:
                raise InputError(f"{path.name} is a bag of ROS 2: name it {path.stem}{suffix}")
            return magic == _ROS1
    what = "is not a ROS bag" if head else "is empty"
    raise InputError(f"{path.name} {what}: check that it is the right file, and a whole one")


def _counts(reader: Any) -> tuple[dict[str, dict[str, int]], list[str]]:
    """Messages of the topics of each type that is read, and all topics with their types."""
    counts: dict[str, dict[str, int]] = {kind: {} for kind in _TYPES}
    others = []
    for each in reader.connections:
        if each.msgcount:
            others.append(f"{each.topic} ({each.msgtype.replace('/msg/', '/')})")
            if each.msgtype in counts:
                of_type = counts[each.msgtype]
                of_type[each.topic] = of_type.get(each.topic, 0) + each.msgcount
    return counts, sorted(set(others))


def _messages(reader: Any, topic: str, start: int | None = None) -> Iterator[_Record]:
    connections = [
        each for each in reader.connections if each.topic == topic and each.msgtype in _TYPES
    ]
    return iter(reader.messages(connections, start=start))


def _sensors(reader: Any, topic: str, bag: _Bag, head: Sequence[_Record]) -> frozenset[str]:
    """Sensors of which a topic holds something else than zeros, at its start and in its middle."""
    first = {"gyro": IMU.columns["gyro_x [rad/s]"], "accel": IMU.columns["accel_x [m/s^2]"]}
    found: set[str] = set()
    middle = (reader.start_time + reader.end_time) // 2
    place = f"{bag.path.name}, a message of {topic}"
    for records in (head, islice(_messages(reader, topic, middle), _SEEN)):
        raw = [message for _, _, message in records]
        for sensor, index in first.items() if raw else ():
            wanted = [index, index + 1, index + 2, COVARIANCE_OF[sensor]]
            _, (*axes, covariance) = decode(raw, IMU, wanted, bag.serialization, lambda row: place)
            if np.any(np.array(axes)) and not np.all(covariance == -1.0):
                found.add(sensor)
        if len(found) == len(first):
            break
    return frozenset(found)
