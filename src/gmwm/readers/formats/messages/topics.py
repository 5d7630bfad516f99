"""Which of several topics of a log to read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gmwm._core.notices import Notice
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError

_MEASURED = {"gyro": "angular rates", "accel": "accelerations"}


@dataclass(frozen=True)
class Wanted:
    """What the caller asks of a log.

    topics: Those to read; by default the only one of an IMU, or one of gyros and one of
        accelerometers.
    clock: {"header", "log"}, which stamps of messages count.
    by_channel: Whether channels are named, of which one sensor may have all.
    damaged: Whether what is there of a damaged file is taken.
    """

    topics: Sequence[str] = ()
    clock: str = "header"
    by_channel: bool = False
    damaged: bool = False


@dataclass(frozen=True)
class Topic:
    """A series of messages of one IMU, or of one sensor of it.

    count: Number of its messages.
    sensors: "gyro", "accel" or both: those that are not zeros all the time.
    """

    name: str
    count: int
    sensors: frozenset[str] = frozenset(SI_UNIT)

    def __str__(self) -> str:
        only = f", {next(iter(self.sensors))} only" if len(self.sensors) == 1 else ""
        return f"{self.name} ({self.count:,} messages{only})"


def choose(source: str, topics: Sequence[Topic], wanted: Wanted) -> tuple[Topic, ...]:
    """The topics to read: those wanted, else the only one, else one of gyros with one of forces.

    source: Name of the file, for messages.
    topics: One at least.
    Raises InputError with the code "topic", if one is not there, or it cannot be decided; with
        "sensor-absent", if the log has one sensor and not the other, and no channel is named.
    """
    chosen = _chosen(source, topics, wanted.topics)
    there = frozenset[str]().union(*(topic.sensors for topic in chosen))
    absent = frozenset(SI_UNIT) - there
    # One topic of two was chosen where the other has the other sensor.
    is_part = absent in [topic.sensors for topic in topics]
    if there and absent and not (is_part or wanted.by_channel):
        (sensor,), (other,) = there, absent
        raise InputError(
            f"{source} has no {_MEASURED[other]}, or only zeros, in {chosen[0].name}",
            "sensor-absent",
            f'record them too, or read the rest alone, channels="{sensor}"',
            {"sensor": sensor},
        )
    return chosen


def _chosen(source: str, topics: Sequence[Topic], wanted: Sequence[str]) -> tuple[Topic, ...]:
    if wanted:
        chosen = tuple(_named(source, topics, name) for name in dict.fromkeys(wanted))
        if len(chosen) > 1 and not _are_parts(chosen):
            raise InputError(
                f"{source}: {' and '.join(map(str, chosen))} are no pair of gyros and "
                "accelerometers: choose one, or two such",
                "topic",
            )
        return chosen
    if len(topics) == 1 or _are_parts(topics):
        return tuple(topics)
    listed = ", ".join(map(str, topics))
    raise InputError(
        f"{source} has {len(topics)} topics of an IMU: {listed}",
        "topic",
        f'choose one, topic="{topics[0].name}"',
    )


def _named(source: str, topics: Sequence[Topic], name: str) -> Topic:
    for topic in topics:
        if topic.name.strip("/") == name.strip("/"):
            return topic
    listed = ", ".join(map(str, topics))
    raise InputError(f"{source} has no topic {name!r} of an IMU: it has {listed}", "topic-unknown")


def _are_parts(topics: Sequence[Topic]) -> bool:
    """Whether they are one of gyros and one of accelerometers."""
    return len(topics) == 2 and {frozenset(("gyro",)), frozenset(("accel",))} == {
        topic.sensors for topic in topics
    }


def choose_first(
    source: str, ranks: Sequence[Sequence[Topic]], wanted: Wanted
) -> tuple[Topic, ...]:
    """As `choose`, of the first rank that has any topic unless others are wanted.

    Raises InputError as `choose` does.
    """
    if wanted.topics:
        return choose(source, [topic for rank in ranks for topic in rank], wanted)
    return choose(source, next(rank for rank in ranks if rank), wanted)


def left_out(ranks: Sequence[Sequence[Topic]], chosen: Sequence[Topic]) -> tuple[Notice, ...]:
    """Which topics are read, where there are others."""
    others = [topic for rank in ranks for topic in rank if topic not in chosen]
    if not others:
        return ()
    names = " and ".join(topic.name for topic in chosen)
    text = f"read from {names}; there are also {', '.join(map(str, others))}"
    return (Notice("topic", "note", "", text, {"topic": names, "others": len(others)}),)
