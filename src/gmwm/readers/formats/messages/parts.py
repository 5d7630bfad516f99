"""Tables of logs that are read a block of messages at a time, one message a row."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from gmwm._core import memory
from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.formats.arrays import check_usable
from gmwm.readers.formats.messages.topics import Topic
from gmwm.readers.table import label


@dataclass(frozen=True)
class MessageTable(ABC):
    """A topic of a log; memory holds no more than the columns that are asked for.

    names: Of the columns.
    """

    topic: Topic
    names: tuple[str, ...]
    notices: tuple[Notice, ...] = field(default=(), kw_only=True)
    rate: ClassVar[float | None] = None
    tentative: ClassVar[bool] = False

    @property
    @abstractmethod
    def source(self) -> str:
        """Name of the log."""

    @abstractmethod
    def parts(self, columns: Sequence[int]) -> Iterator[dict[int, FloatArray]]:
        """Columns of one block of messages after another."""

    def load(self, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Read some columns; see `Table`.

        Raises InputError if the log is damaged, a number is infinite, or there is not enough
            memory.
        """
        count, done = self.topic.count, 0
        memory.require(tuning.BYTES_PER_SAMPLE * count * len(columns), self.source)
        found = {column: np.empty(count) for column in columns}
        for part in self.parts(columns):
            size = next(iter(part.values())).size
            room = max(count - done, 0)
            for column, values in part.items():
                found[column][done : done + size] = values[:room]
            done += size
        if not 0 < done <= count:
            raise InputError(
                f"{self.source}, topic {self.topic.name}: its messages are not as many as its "
                "index says: get a whole copy, or reindex it"
            )
        return self.checked({column: values[:done] for column, values in found.items()}, 0)

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[dict[int, FloatArray]]:
        """The same, ``rows`` or a little more at a time."""
        held: list[dict[int, FloatArray]] = []
        before = row = 0
        for part in self.parts(columns):
            held.append(part)
            row += next(iter(part.values())).size
            if row - before >= rows:
                yield self._joined(held, before)
                held, before = [], row
        if row > before:
            yield self._joined(held, before)

    def _joined(self, parts: Sequence[dict[int, FloatArray]], before: int) -> dict[int, FloatArray]:
        joined = {column: np.concatenate([part[column] for part in parts]) for column in parts[0]}
        return self.checked(joined, before)

    def checked(self, found: dict[int, FloatArray], before: int) -> dict[int, FloatArray]:
        """Columns that have no number that cannot be used; ``before`` is the row of their first.

        Raises InputError if one has.
        """
        for column, values in found.items():
            place = f"{self.source}, column {label(self.names, column)}"
            check_usable(place, values, lambda row: self.where(before + row))
        return found

    def where(self, row: int) -> str:
        """Say which message."""
        return f"message {row} of {self.topic.name} (counted from 0)"
