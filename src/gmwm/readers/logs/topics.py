"""Topics of a log: which to read, and tables of their messages."""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gmwm._core.files import opened
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.readers.formats.arrays import AnyArray, ArrayTable, array_of
from gmwm.readers.registry import Wanted
from gmwm.readers.table import Columns, Table

_BLOCK = 1 << 16  # bytes
_MEASURED = {"gyro": "angular rates", "accel": "accelerations"}


@dataclass(frozen=True)
class Topic:
    """A series of messages of one IMU, or of one sensor of it."""

    name: str
    count: int  # number of messages
    # "gyro", "accel" or both, if not zeros all the time.
    sensors: frozenset[str] = frozenset(SI_UNIT)

    @property
    def imu(self) -> str:
        """Its name in a log of several: ``imu 1`` of an instance, else that of the topic."""
        _, _, number = self.name.rstrip("]").partition("[")
        return f"imu {number}" if number else self.name

    def __str__(self) -> str:
        only = f", {next(iter(self.sensors))} only" if len(self.sensors) == 1 else ""
        return f"{self.name} ({self.count:,} messages{only})"


def choose(source: str, ranks: Sequence[Sequence[Topic]], wanted: Wanted) -> tuple[Topic, ...]:
    """The topics to read: those wanted, else of the first rank that has any.

    There it is the only one, or one of gyros with one of forces; of every IMU, all of the first
    rank that has several. Raises InputError if it cannot be
    decided, or the log has one sensor and not the other and no channel is named.
    """
    topics = [t for rank in ranks for t in rank] if wanted.topics else next(filter(None, ranks))
    if wanted.every_imu and not wanted.topics:
        several = (rank for rank in ranks if len({topic.imu for topic in rank}) > 1)
        return tuple(next(several, topics))
    chosen = _chosen(source, topics, wanted)
    there = frozenset[str]().union(*(topic.sensors for topic in chosen))
    absent = frozenset(SI_UNIT) - there
    # One topic of two was chosen where the other has the other sensor.
    is_part = absent in [topic.sensors for topic in topics]
    if there and absent and not (is_part or wanted.by_channel or wanted.every_imu):
        (sensor,), (other,) = there, absent
        text = f"{source} has no {_MEASURED[other]}, or only zeros, in {chosen[0].name}"
        hint = f'record them too, or read the rest alone, channels="{sensor}"'
        raise InputError(text, "sensor-absent", hint, {"sensor": sensor})
    return chosen


def _chosen(source: str, topics: Sequence[Topic], wanted: Wanted) -> tuple[Topic, ...]:
    listed = ", ".join(map(str, topics))
    if not wanted.topics:
        if len(topics) == 1 or _are_parts(topics):
            return tuple(topics)
        text = f"{source} has {len(topics)} topics of an IMU: {listed}"
        raise InputError(text, "topic", f'choose one, topic="{topics[0].name}"')
    by_name = {topic.name.strip("/"): topic for topic in topics}
    for name in wanted.topics:
        if name.strip("/") not in by_name:
            text = f"{source} has no topic {name!r} of an IMU: it has {listed}"
            raise InputError(text, "topic-unknown")
    chosen = tuple(by_name[name.strip("/")] for name in dict.fromkeys(wanted.topics))
    if len(chosen) > 1 and not (wanted.every_imu or _are_parts(chosen)):
        text = f"{source}: {' and '.join(map(str, chosen))} are not one gyro and one accelerometer"
        raise InputError(f"{text}: choose one, or two such", "topic")
    return chosen


def _are_parts(topics: Sequence[Topic]) -> bool:
    """Whether they are one of gyros and one of accelerometers."""
    return len(topics) == 2 and {frozenset(("gyro",)), frozenset(("accel",))} == {
        topic.sensors for topic in topics
    }


def left_out(ranks: Sequence[Sequence[Topic]], chosen: Sequence[Topic]) -> tuple[Notice, ...]:
    """A notice of the topics that are read, where there are others."""
    others = [topic for rank in ranks for topic in rank if topic not in chosen]
    if not others:
        return ()
    values = {"topic": " and ".join(topic.name for topic in chosen), "others": len(others)}
    listed = ", ".join(map(str, others))
    return (notice("topic", "", values, variant="others", listed=listed),)


def end_of_content(path: Path) -> int:
    """Byte after the last one that may be something else than padding, zeros or 0xFF."""
    last, end = b"", path.stat().st_size
    with opened(path) as stream:
        while end:
            start = max(end - _BLOCK, 0)
            stream.seek(start)
            data = stream.read(end - start)
            last = last or data[-1:]
            end = start + len(data.rstrip(last) if last in (b"\0", b"\xff") else data)
            if end > start:
                break
    return end


def topic_table(
    source: str,
    topic: Topic,
    columns: Mapping[str, AnyArray],
    origin: str,
    notices: Sequence[Notice] = (),
) -> ArrayTable:
    """A table of the samples of a topic that are in memory."""
    entries = {name: array_of(values) for name, values in columns.items()}
    about = {"stamps": f"stamps of {topic.name}", "origin": origin, "imu": topic.imu}
    return ArrayTable.of_entries(source, entries, notices, **about)


def cut_off(seconds: float) -> str:
    """What is wrong with a log that ends inside a message, some time after its first sample."""
    return f"is cut off or damaged {seconds:.6g} s after its first sample, inside a message"


@dataclass(frozen=True, eq=False, kw_only=True)
class MessageTable(Table):
    """A topic of a log, one message a row; memory holds only the columns that are asked for."""

    topic: Topic

    @abstractmethod
    def parts(self, columns: Sequence[int]) -> Iterator[Columns]:
        """Columns of one block of messages after another."""

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[Columns]:
        row = 0
        for part in self.parts(columns):
            for column, values in part.items():
                self.check_usable(column, values, row)
            row += next(iter(part.values())).size
            yield part
        if not 0 < row <= self.rows:
            text = f"{self.source}, topic {self.topic.name}: its messages are not as many"
            raise InputError(f"{text} as its index says: get a whole copy, or reindex it")

    def where(self, row: int) -> str:
        return f"message {row} of {self.topic.name} (counted from 0)"
