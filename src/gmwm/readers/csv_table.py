"""Delimited text (CSV and its relatives), plain or gzip.

Arrow parses block after block. A block that it cannot, or that holds an infinite value, is read
again by plain Python, field by field: that either finds the line and column to complain about, or
reads what Arrow is too strict for (``+1.5``, quotes). Both give the same numbers, NaN where a
field says that there is none.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core import memory
from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.cells import BLANKS, FIELD_OF_DATE, has_zone, number, seconds_of, split_line
from gmwm.readers.dialects import with_dialect
from gmwm.readers.layout import Layout, find_layout
from gmwm.readers.table import damage_notice, label, usable
from gmwm.readers.text_file import blocks, content_size, count_lines

if TYPE_CHECKING:
    import pyarrow

_HEAD = 1 << 18
_ENOUGH_LINES = 16  # before one whose last field is shorter than that of each

# What `number` takes for missing, as it is commonly written; Arrow knows NaN by itself.
_NULLS = ["", "NA", "na", "N/A", "n/a", "#N/A", "null", "NULL", "Null", "None", "none"]


@dataclass(frozen=True)
class CsvTable:
    """A text file of which the layout is known."""

    path: Path
    layout: Layout
    is_taken: bool | None = None
    _damages: list[Notice] = field(default_factory=list, compare=False)

    @classmethod
    def open(cls, path: Path, is_taken: bool | None = None) -> CsvTable:
        """Look at the beginning of a file.

        is_taken: Whether what is there of a damaged file is taken, if that can be asked for.
        Raises InputError if it cannot be read or is not a table.
        """
        damages = list[str]()
        _, head = next(blocks(path, size=_HEAD, say=damages.append), (1, b""))
        if damages and not head:
            damage_notice(path.name, damages[0], is_taken)
        return cls(path, with_dialect(find_layout(path.name, head), path.name, head), is_taken)

    @property
    def source(self) -> str:
        """Name of the file."""
        return self.path.name

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.layout.names

    @property
    def tentative(self) -> bool:
        """Whether the names come from a comment."""
        return self.layout.tentative

    @property
    def rate(self) -> float | None:
        """A text states no rate."""
        return None

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What was noticed in the header, and of damage as far as the file was read."""
        return (*self.layout.notices, *self._damages)

    def _note_damage(self, what: str) -> None:
        self._damages[:] = [damage_notice(self.source, what, self.is_taken)]

    def load(self, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Read some columns; see `Table`.

        Raises InputError at the first line with a wrong number of fields or with text for a number;
            if there is none, for the first number that is infinite; if there is not enough memory.
        """
        import pyarrow

        allowed = memory.budget()
        self._require(self._estimated_samples(len(columns)))
        held = 0
        # They grow where they are: parts to be joined would be in memory twice.
        series = [np.empty(0) for _ in columns]
        for found in self._parsed(columns):
            begin, held = held, held + found[0].size
            for values, part in zip(series, found, strict=True):
                if held > values.size:
                    values.resize(held + values.size // 8, refcheck=False)
                values[begin:held] = part
            samples = held * len(columns)
            if samples * tuning.BYTES_PER_SAMPLE > allowed:
                self._require(max(samples, self._estimated_samples(len(columns))))
        for values in series:
            values.resize(held, refcheck=False)
        # Arrow keeps memory for more columns, where it did any work.
        pyarrow.default_memory_pool().release_unused()
        joined = dict(zip(columns, series, strict=True))
        for column, scale in self.layout.scales.items():
            if column in joined:
                joined[column] *= scale
        return joined

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[dict[int, FloatArray]]:
        """The same, ``rows`` or a little more at a time."""
        parts: list[list[FloatArray]] = []
        held = 0
        for found in self._parsed(columns):
            parts.append(found)
            held += found[0].size
            if held >= rows:
                yield self._joined(columns, parts)
                parts, held = [], 0
        if held:
            yield self._joined(columns, parts)

    def _joined(
        self, columns: Sequence[int], parts: Sequence[Sequence[FloatArray]]
    ) -> dict[int, FloatArray]:
        return {
            column: np.concatenate([part[i] for part in parts])
            * self.layout.scales.get(column, 1.0)
            for i, column in enumerate(columns)
        }

    def _parsed(self, columns: Sequence[int]) -> Iterator[list[FloatArray]]:
        """Columns of one block of text after another."""
        infinite = _Infinite()
        layout, before = self.layout, b""
        for line, block in blocks(self.path, layout.offset, layout.line, say=self._note_damage):
            if _is_cut(block, before, layout):
                self._note_damage(f"is cut off in line {line}")
                break
            before = block
            found = _parse_with_arrow(block, self.layout, columns)
            if found is None:
                found = _parse_by_field(line, block, self, columns, infinite)
            yield found
        infinite.complain(self.source)

    def _require(self, samples: float) -> None:
        memory.require(tuning.BYTES_PER_SAMPLE * samples, self.source)

    def _estimated_samples(self, columns: int) -> float:
        """How many numbers that many columns hold, by the size of the file and its first lines."""
        if self.is_taken:  # what a packed file says of its size is at its end
            return 0.0
        _, head = next(blocks(self.path, self.layout.offset, size=_HEAD), (1, b""))
        lines = max(len(head.splitlines()), 1)
        return content_size(self.path) / max(len(head) / lines, 1.0) * columns

    def where(self, row: int) -> str:
        """The line of a row of data."""
        for line, block in blocks(self.path, self.layout.offset, self.layout.line):
            for i, text in enumerate(block.splitlines(), start=line):
                if text.strip(b" \t"):
                    row -= 1
                if row < 0:
                    return f"line {i}"
        return "the last line"


@dataclass
class _Infinite:
    """Fields with an infinite number, or one too large for use: the first, and how many."""

    first: str = ""
    count: int = 0

    def add(self, place: str, cell: str) -> None:
        """Count one."""
        self.count += 1
        self.first = self.first or f"{place}: {_excerpt(cell)}"

    def complain(self, source: str) -> None:
        """Refuse the file if there are any."""
        if self.count:
            others = f", and {self.count - 1:,} more such" if self.count > 1 else ""
            raise InputError(
                f"{source}, {self.first} is not a usable number{others}: cut the file before "
                "that line, or empty the field if the sample is missing"
            )


def _is_cut(block: bytes, before: bytes, layout: Layout) -> bool:
    """Whether a last line has no end, and lacks fields or digits of its last field.

    block: Such a line is one by itself.
    before: The block before it.
    """
    if block.endswith((b"\n", b"\r")):
        return False
    delimiter = None if layout.delimiter == BLANKS else layout.delimiter.encode()
    *first, last = block.split(delimiter)
    if len(first) + 1 < layout.width:
        return True
    sizes = [len(line.split(delimiter)[-1]) for line in before.splitlines() if line.strip()]
    return len(sizes) >= _ENOUGH_LINES and len(last) < min(sizes)


def _parse_with_arrow(
    block: bytes, layout: Layout, columns: Sequence[int]
) -> list[FloatArray] | None:
    """Read a block the fast way, or return ``None`` if anything in it is unusual."""
    import pyarrow
    from pyarrow import csv

    if b'"' in block or b"(" in block:  # the latter for nan(1), which Arrow takes for NaN
        return None
    if layout.delimiter == BLANKS:
        block = _single_blanks(block)
    names = [str(i) for i in range(layout.width + layout.trailing)]
    wanted = [names[i] for i in columns]
    try:
        table = csv.read_csv(
            pyarrow.BufferReader(block),
            # Blocks of this size gain nothing by threads, and are the same every time without.
            read_options=csv.ReadOptions(column_names=names, use_threads=False),
            parse_options=csv.ParseOptions(
                delimiter=layout.delimiter,
                quote_char=False,
                # In a single column a blank line is a missing sample.
                ignore_empty_lines=layout.width > 1,
            ),
            convert_options=csv.ConvertOptions(
                include_columns=wanted,
                column_types={
                    name: _arrow_type(layout.dates.get(i))
                    for i, name in zip(columns, wanted, strict=True)
                },
                null_values=_NULLS,
                decimal_point=layout.decimal,
            ),
        )
    except pyarrow.ArrowInvalid:
        return None
    found: list[FloatArray] = [
        _since_1970(table.column(name)) if i in layout.dates else _floats(table.column(name))
        for i, name in zip(columns, wanted, strict=True)
    ]
    complete = _is_complete(table.num_rows, block, blank_counts=layout.width == 1)
    return found if complete and all(map(usable, found)) else None


def _is_complete(rows: int, block: bytes, blank_counts: bool) -> bool:
    """Whether there is a row for each line of the block.

    blank_counts: Whether a blank line is a missing sample.
    """
    lines = count_lines(block) + (not block.endswith((b"\n", b"\r")))
    if rows == lines or blank_counts:
        return rows == lines
    return rows == sum(1 for line in block.splitlines() if line.strip(b" \t"))


def _arrow_type(has_zone: bool | None) -> pyarrow.DataType:
    """Of a column of numbers, or of dates with or without a zone."""
    import pyarrow

    if has_zone is None:
        return pyarrow.float64()
    return pyarrow.timestamp("ns", tz="UTC" if has_zone else None)


def _floats(column: pyarrow.ChunkedArray) -> FloatArray:
    """A column of floats, NaN where it has none; what Arrow has for it imports pandas."""
    result = np.empty(len(column))
    at = 0
    for chunk in column.chunks:
        known, values = chunk.buffers()
        part = result[at : at + len(chunk)]
        part[:] = np.frombuffer(values, float, len(chunk), 8 * chunk.offset)
        if chunk.null_count:
            bits = np.unpackbits(np.frombuffer(known, np.uint8), bitorder="little")
            part[bits[chunk.offset : chunk.offset + len(chunk)] == 0] = np.nan
        at += len(chunk)
    return result


def _since_1970(column: pyarrow.ChunkedArray) -> FloatArray:
    """Seconds; the float is good to a quarter of a microsecond."""
    import pyarrow

    whole: FloatArray = column.cast(pyarrow.int64()).to_numpy() * 1e-9
    return whole


def _single_blanks(block: bytes) -> bytes:
    """Turn runs of blanks to single ones, none at the ends of lines."""
    block = block.replace(b"\t", b" ")
    while b"  " in block:
        block = block.replace(b"  ", b" ")
    for end in (b"\n", b"\r"):
        block = block.replace(b" " + end, end).replace(end + b" ", end)
    return block.strip(b" ")


def _parse_by_field(
    first_line: int, block: bytes, table: CsvTable, columns: Sequence[int], infinite: _Infinite
) -> list[FloatArray]:
    """Read a block the careful way."""
    layout = table.layout
    found = [array("d") for _ in columns]
    for line, raw in enumerate(block.splitlines(), start=first_line):
        text = raw.decode(errors="replace")
        if layout.width > 1 and not text.strip(" \t"):
            continue
        place = f"line {line}"
        cells = _cells(table, place, text)
        for values, column in zip(found, columns, strict=True):
            value = number(cells[column], layout.decimal)
            problem = "is not a number"
            if value is None and column in layout.dates:
                value, problem = _date(cells[column], layout.dates[column])
            if value is None:
                raise InputError(
                    f"{table.source}, {place}, column {label(table.names, column)}: "
                    f"{_excerpt(cells[column])} {problem}: correct the line, or choose other "
                    "columns with channels= and time="
                )
            if math.isinf(value):
                infinite.add(f"{place}, column {label(table.names, column)}", cells[column])
            values.append(value)
    return [np.array(values) for values in found]


def _date(cell: str, zoned: bool) -> tuple[float | None, str]:
    """Seconds since 1970, or ``None`` and what is wrong with the field."""
    found = FIELD_OF_DATE.fullmatch(cell)
    if found is not None and has_zone(found) is not zoned:
        return None, f"has {'no' if zoned else 'a'} zone, unlike the dates before it"
    try:
        return (seconds_of(found), "") if found else (None, "is no date")
    except ValueError:
        return None, "is no date that exists"


def _cells(table: CsvTable, place: str, text: str) -> list[str]:
    """Fields of a line; a delimiter after the last one does no harm."""
    width = table.layout.width
    try:
        cells = split_line(text, table.layout.delimiter)
    except ValueError as error:
        raise InputError(
            f"{table.source}, {place}: quotes that do not match: correct the line"
        ) from error
    if len(cells) == width + 1 and not cells[-1]:
        cells.pop()
    if len(cells) != width:
        raise InputError(
            f"{table.source}, {place}: {len(cells)} fields where {width} were expected: correct "
            "the line or remove it"
        )
    return cells


def _excerpt(cell: str) -> str:
    return repr(cell if len(cell) <= 30 else cell[:27] + "...")
