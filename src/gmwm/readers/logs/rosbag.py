"""ROS bags by `rosbags`, without a ROS installation: ROS 1, ROS 2 in SQLite or MCAP.

Read in blocks of messages, so that memory holds no more than the columns that are asked for. Behind
the header (stamp and ``frame_id``) of `sensor_msgs/Imu` and `sensor_msgs/Temperature` stand nothing
but 64-bit floating-point numbers, so that messages of one ``frame_id`` are rows of one array. ROS 1
writes them little-endian and unaligned (wiki.ros.org/roscpp/Overview/Messages and Serialization),
ROS 2 in either byte order, aligned to eight bytes counted from the end of the encapsulation header
(OMG CDR, formal/2021-11-01, 9.3; DDSI-RTPS 2.5, 10.2).
"""

import weakref
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gmwm._core.files import opened
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.issues import notice
from gmwm.readers import tuning
from gmwm.readers.logs.topics import MessageTable, Topic, choose
from gmwm.readers.registry import Wanted
from gmwm.readers.table import Columns, damage_named, library

_STAMP, _FRAME = 4, 16
"""Bytes before the stamp, a counter or an encapsulation header, and before ``frame_id``."""

# First number of these parts of `sensor_msgs/Imu`; their covariances follow.
_FIRST = {"gyro": 13, "accel": 25}
_ORDERS = {b"\0\0": ">", b"\0\1": "<"}
"""Byte order of plain CDR, by the first two bytes of its encapsulation header."""


@dataclass(frozen=True)
class Message:
    """A type of message: a header, then numbers."""

    count: int  # numbers behind the header
    columns: Mapping[str, int]  # name of a column, with its unit -> index of its number


IMU = Message(
    37,
    {
        f"{sensor}_{axis} [{SI_UNIT[sensor]}]": first + i
        for sensor, first in _FIRST.items()
        for i, axis in enumerate("xyz")
    },
)


def decode(
    raw: Sequence[bytes],
    message: Message,
    wanted: Sequence[int],
    is_cdr: bool,
    where: Callable[[int], str],
) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """Stamps of the headers, ns, and the wanted numbers behind them, by their indices.

    where: Index of a message -> its place, of one that is too short or of another encoding.
    """
    alike: dict[tuple[int, bytes, bytes], list[int]] = defaultdict(list)
    for i, each in enumerate(raw):  # a topic has one encoding and one frame_id, almost always
        alike[len(each), each[: 2 * is_cdr], each[_FRAME - 4 : _FRAME]].append(i)
    stamps, numbers = np.empty(len(raw), np.int64), np.empty((len(wanted), len(raw)))
    frames = Counter[bytes]()
    for (size, code, frame), group in alike.items():
        order = _ORDERS.get(code) if is_cdr else "<"
        if order is None and size >= _FRAME:
            text = f"{where(group[0])}: encoding 0x{code.hex()} is not plain CDR"
            hint = "record with a usual RMW, or convert the bag with ros2 bag convert"
            raise InputError(f"{text}: {hint}")
        offset = _FRAME + int.from_bytes(frame, "little" if order == "<" else "big")
        frames.update(raw[i][_FRAME:offset] for i in group)
        offset = 4 + -(-(offset - 4) // 8) * 8 if is_cdr else offset
        if size < _FRAME or offset + 8 * message.count > size:
            hint = "record the bag again, or cut it before that message"
            raise InputError(f"{where(group[0])} is cut off: {hint}")
        block, rows = b"".join([raw[i] for i in group]), np.array(group)

        def field(dtype: str, offset: int, block: bytes = block, size: int = size) -> Any:
            return np.ndarray((len(block) // size,), dtype, block, offset, (size,))

        # Seconds after 2038 are unsigned in ROS 1, and in ROS 2 as drivers write them.
        seconds = field(f"{order}u4", offset=_STAMP).astype(np.int64)
        stamps[rows] = seconds * 10**9 + field(f"{order}u4", offset=_STAMP + 4)
        for values, index in zip(numbers, wanted, strict=True):
            values[rows] = field(f"{order}f8", offset=offset + 8 * index)
    if frames.total() - max(frames.values()) > tuning.IN_TURNS * len(raw):
        text = f"{where(0)}: from here on the topic has messages of {len(frames)} frame_id in turns"
        raise InputError(f"{text}: keep those of one sensor", "several-sensors")
    return stamps, numbers


_BLOCK = 1024  # messages: 0.3 MB of sensor_msgs/Imu, which stay in the cache
_SEEN = 64  # messages from which it is judged what a topic holds

_SQLITE = b"SQLite format 3"

_TYPES = ("sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature")
_STAMPS = "time [ns]"

_Record = tuple[Any, int, bytes]


@dataclass(frozen=True)
class _Bag:
    """A bag: a file, or a folder of ROS 2."""

    path: Path
    is_ros1: bool

    @contextmanager
    def opened(self) -> Iterator[Any]:
        """The reader of `rosbags`; what it raises is one sentence."""

        def damage(error: Exception) -> str:
            text = str(error).replace(str(self.path), self.path.name).rstrip(".")
            tool = "rosbag reindex or decompress" if self.is_ros1 else "ros2 bag reindex or convert"
            kind = f"of an unknown kind{f' ({text})' if text else ''}"
            return f"is damaged or {kind}: get a whole copy, or try {tool}"

        with damage_named(self.path.name, damage):
            yield self._reader

    @cached_property
    def _reader(self) -> Any:
        """Open until the bag is dropped: its index may take as long to read as its messages."""
        kind = "rosbag1" if self.is_ros1 else "rosbag2"
        for file in sorted(self.path.iterdir()) if self.path.is_dir() else [self.path]:
            if file.is_dir():
                continue
            with opened(file) as stream:
                head = stream.read(18)
            # SQLite takes the rest of its last page for zeros (Database File Format, 1.3.2).
            size = int.from_bytes(head[16:], "big")
            size = 65536 if size == 1 else size or 1
            if head.startswith(_SQLITE) and file.stat().st_size % size:
                raise ValueError(f"{file.name} ends inside a page")
        reader = library(f"rosbags.{kind}", "ros", self.path.name).Reader(self.path)
        reader.open()
        weakref.finalize(self, reader.close)
        return reader


@dataclass(frozen=True, eq=False, kw_only=True)
class BagTable(MessageTable):
    """A topic of a bag: one message a row, its stamp and numbers in it."""

    bag: _Bag
    message: Message
    is_log: bool  # whether the stamps are the times at which the messages were recorded

    def parts(self, columns: Sequence[int]) -> Iterator[Columns]:
        wanted = [column for column in columns if column > 0]
        numbers = [self.message.columns[self.names[column]] for column in wanted]
        row, first, changes = 0, 0, False
        with self.bag.opened() as reader:
            # Records that are let go at once are cheap; of those held, so are messages alone.
            parts = itemgetter(1, 2) if self.is_log else itemgetter(2)
            records = map(parts, _messages(reader, self.topic.name))
            while block := list(islice(records, _BLOCK)):
                times, raw = zip(*block, strict=True) if self.is_log else ((), block)

                def where(i: int, first: int = row) -> str:
                    return f"{self.source}, {self.where(first + i)}"

                stamps, found = decode(raw, self.message, numbers, not self.bag.is_ros1, where)
                if self.is_log:
                    stamps = np.array(times, np.int64)
                first = first if row else int(stamps[0])
                changes = changes or bool(np.any(stamps != first))
                row += len(block)
                part = dict(zip(wanted, found, strict=True))
                yield {0: (stamps - self.origins[0]).astype(float)} | part if 0 in columns else part
        if 0 in columns and row > 1 and not changes:
            text = f"{self.source}, topic {self.topic.name}: every header has the same stamp"
            raise InputError(text, "no-stamps", 'use the time of recording, clock="log"')


def open_bag(path: Path, wanted: Wanted) -> tuple[BagTable, ...]:
    """A table for each topic of a file, or of the folder of a bag of ROS 2; thermometers last."""
    is_folder = path.is_dir()
    if is_folder and not (path / "metadata.yaml").is_file():
        hint = "name the .db3 or .mcap file in it, or write one with ros2 bag reindex"
        raise InputError(f"{path.name} has no metadata.yaml: {hint}")
    is_ros1 = not is_folder and _is_ros1(path)
    bag = _Bag(path, is_ros1)
    with bag.opened() as reader:
        counts: dict[str, Counter[str]] = defaultdict(Counter)  # by type and topic
        for each in reader.connections:
            if each.msgcount:
                counts[each.msgtype][each.topic] += each.msgcount
        of_imu, warmth = (counts[kind] for kind in _TYPES)
        if not of_imu:
            pairs = [(topic, kind) for kind, own in counts.items() for topic in own]
            others = sorted(f"{topic} ({kind.replace('/msg/', '/')})" for topic, kind in pairs)
            listed = ", ".join(others[:8]) + (", ..." if len(others) > 8 else "")
            held = f"it has {listed}; record the topic of the IMU" if others else "it is empty"
            raise InputError(f"{path.name} has no messages of sensor_msgs/Imu: {held}")
        heads = {topic: list(islice(_messages(reader, topic), _SEEN)) for topic in of_imu}
        found = [
            Topic(topic, count, _sensors(reader, topic, bag, heads[topic]))
            for topic, count in of_imu.items()
        ]
        chosen = choose(path.name, [found], wanted)
        is_log = wanted.clock == "log"
        _, start, message = heads[chosen[0].name][0]
        if not is_log:
            start = int(decode([message], IMU, [], not is_ros1, lambda i: path.name)[0][0])

    def table(topic: Topic, message: Message, names: Iterable[str]) -> BagTable:
        return BagTable(
            source=path.name,
            names=(_STAMPS, *names),
            stamps="times of recording" if is_log else "header stamps",
            origin="sensor_msgs/Imu",
            topic=topic,
            imu=topic.imu,
            rows=topic.count,
            bag=bag,
            message=message,
            is_log=is_log,
            origins={0: start},
        )

    tables = []
    for topic in chosen:
        sensors = topic.sensors or frozenset(SI_UNIT)
        names = [name for name in IMU.columns if name.partition("_")[0] in sensors]
        tables.append(table(topic, IMU, names))
        listed = " and ".join(sorted(sensors))
        tables[-1].notices.append(notice("topic", "", {"topic": topic.name}, sensors=listed))
    for name, count in warmth.items():
        # By the topic if there are several.
        prefix = "" if len(warmth) == 1 else name.strip("/").replace("/", "_") + "_"
        warm = Message(2, {f"{prefix}temperature [degC]": 0})
        tables.append(table(Topic(name, count), warm, warm.columns))
    return tuple(tables)


def _is_ros1(path: Path) -> bool:
    with damage_named(path.name), opened(path) as stream:
        head = stream.read(len(_SQLITE))
    for magic, suffix in ((b"\x89MCAP", ".mcap"), (_SQLITE, ".db3")):
        if head.startswith(magic) and path.suffix.lower() != suffix:
            raise InputError(f"{path.name} is a bag of ROS 2: name it {path.stem}{suffix}")
        if head.startswith(magic):
            return False
    if head.startswith(b"#ROSBAG"):
        return True
    what = "is not a ROS bag" if head else "is empty"
    raise InputError(f"{path.name} {what}: check that it is the right file, and complete")


def _messages(reader: Any, topic: str, start: int | None = None) -> Iterator[_Record]:
    own = [c for c in reader.connections if c.topic == topic and c.msgtype in _TYPES]
    return iter(reader.messages(own, start=start))


def _sensors(reader: Any, topic: str, bag: _Bag, head: Sequence[_Record]) -> frozenset[str]:
    """Sensors whose values in a topic are not all zero, at its start and in its middle."""
    found: set[str] = set()
    middle = (reader.start_time + reader.end_time) // 2
    place = f"{bag.path.name}, a message of {topic}"
    for records in (head, islice(_messages(reader, topic, middle), _SEEN)):
        raw = [message for _, _, message in records]
        for sensor, index in _FIRST.items() if raw else ():
            wanted = range(index, index + 4)  # the fourth is -1 where it is not measured
            _, (*axes, covariance) = decode(raw, IMU, wanted, not bag.is_ros1, lambda row: place)
            if np.any(np.array(axes)) and not np.all(covariance == -1.0):
                found.add(sensor)
        if len(found) == len(_FIRST):
            break
    return frozenset(found)
