"""Delimited text (CSV and its relatives), plain or gzip, as a table.

Arrow parses block after block. A block that it cannot parse, or that holds an infinite value, is
read again by plain Python, field by field: that either finds the line and column to complain about,
or reads what Arrow is too strict for (``+1.5``, quotes). Both give the same numbers, NaN where a
field says that there is none.
"""

from __future__ import annotations

import gzip
import io
import math
import re
import zlib
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, cast

import numpy as np

from gmwm._core.files import opened
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers.layout import (
    BLANKS,
    FIELD_OF_DATE,
    Layout,
    fields_of,
    find_layout,
    number,
    seconds_of,
    with_dialect,
)
from gmwm.readers.registry import Wanted
from gmwm.readers.table import Columns, Table, damage_notice, label, more_such, usable

if TYPE_CHECKING:
    import pyarrow


BLOCK = 1 << 20  # bytes read at once
_LONGEST_LINE = 1 << 20
_GZIP_MAGIC = b"\x1f\x8b"
_SIZE_AT_END = 4  # bytes of a gzip file, RFC 1952
_BLANK = b" \t\r\n"
_LINE_END = re.compile(rb"\r\n|\n|\r")


def blocks(
    path: Path,
    offset: int = 0,
    line: int = 1,
    size: int = BLOCK,
    say: Callable[[str], object] = str,
) -> Iterator[tuple[int, bytes]]:
    r"""Iterate over a file's lines, many at a time.

    Blank lines at the end of the file are left out. A last line without an end is a block by
    itself. If a compression is cut off, the whole lines before that are given.

    offset, line: Bytes (after decompression) that are left out, and the line that begins there.
    say: Called with a message if the compression is cut off; may raise an error.
    Yields: number of the first line, counted from 1; whole lines (``\n``, ``\r\n`` or ``\r``).
    """
    with _open(path) as stream:
        _, damage = _read(stream, offset, path.name)
        text, fresh = b"", b" "
        while fresh and not damage:
            fresh, damage = _read(stream, size, path.name)
            text += fresh
            # Lines may end in a bare \r; the last byte may be half of \r\n.
            last = text.rfind(b"\n") + 1 or text.rfind(b"\r", 0, len(text) - 1) + 1
            end = _end_of_content(text[:last])
            if end:
                yield line, text[:end]
                line += count_lines(text[:end])
                text = text[end:]
            elif len(text) > _LONGEST_LINE:
                raise InputError(
                    f"{path.name}, line {line}: longer than {_LONGEST_LINE >> 20} MB, so this is "
                    "not a table of numbers: check that it is the right file"
                )
        if damage:
            say(damage)
        elif end := _end_of_content(text):
            yield line, text[:end]


def content_size(path: Path) -> int:
    """Bytes after decompression, at least, as far as that is known before reading."""
    size = path.stat().st_size
    with opened(path) as stream:
        if stream.read(len(_GZIP_MAGIC)) == _GZIP_MAGIC:
            stream.seek(-min(_SIZE_AT_END, size), 2)
            # Modulo 4 GB, and of the last part only if there are several.
            size = max(size, int.from_bytes(stream.read(_SIZE_AT_END), "little"))
    return size


def count_lines(text: bytes) -> int:
    """Count line ends of any of the three kinds."""
    lines = text.count(b"\n")
    return lines + text.count(b"\r") - text.count(b"\r\n") if b"\r" in text else lines


def _end_of_content(text: bytes) -> int:
    content = len(text.rstrip(_BLANK))
    if not content:
        return 0
    found = _LINE_END.search(text, content)
    return found.end() if found else len(text)


def _open(path: Path) -> BinaryIO:
    try:
        with opened(path) as stream:
            magic = stream.read(len(_GZIP_MAGIC))
        is_packed = magic == _GZIP_MAGIC
        if magic and not is_packed and path.suffix.lower() == ".gz":
            text = f"{path.name} is not a gzip file although its name ends in .gz"
            raise InputError(f"{text}: compress it with gzip, or remove .gz from its name")
        return cast(BinaryIO, gzip.open(path, "rb")) if is_packed else opened(path)
    except OSError as error:
        raise _unreadable(path.name, error) from error


def _read(stream: BinaryIO, size: int, name: str) -> tuple[bytes, str]:
    """Bytes, and what is wrong if the compression ends with them."""
    parts, damage = list[bytes](), ""
    try:
        # A piece at a time: what was unpacked before an error is there.
        while size > 0 and (part := cast(io.BufferedReader, stream).read1(size)):
            parts.append(part)
            size -= len(part)
    except EOFError:
        damage = "ends before its gzip data are complete"
    except (gzip.BadGzipFile, zlib.error) as error:  # any of the numbers may be wrong
        raise InputError(f"{name} is a damaged gzip file ({error}): get a whole copy") from error
    except OSError as error:
        raise _unreadable(name, error) from error
    return b"".join(parts), damage


def _unreadable(name: str, error: OSError) -> InputError:
    return InputError(f"{name} cannot be read ({error.strerror}): check its permissions")


_HEAD = 1 << 18
_CHECKSUM = re.compile(r"\*[0-9A-Fa-f]{2,8}$")
_ENOUGH_LINES = 16  # before one whose last field is shorter than that of each

# What `number` takes for missing, as it is commonly written; Arrow knows NaN by itself.
_NULLS = ["", "NA", "na", "N/A", "n/a", "#N/A", "null", "NULL", "Null", "None", "none"]


@dataclass(frozen=True, eq=False, kw_only=True)
class CsvTable(Table):
    """A text file whose layout is known."""

    path: Path
    layout: Layout
    # Whether the rest of a damaged file is used; None if that cannot be asked for.
    is_taken: bool | None = None

    @classmethod
    def open(cls, path: Path, is_taken: bool | None = None) -> CsvTable:
        """Look at the beginning of a file."""
        damages = list[str]()
        _, head = next(blocks(path, size=_HEAD, say=damages.append), (1, b""))
        if damages and not head:
            damage_notice(path.name, damages[0], is_taken)
        layout = with_dialect(find_layout(path.name, head), path.name, head)
        data = head[layout.offset :]
        # What is left of a packed file may not state its size, which is at its end.
        size = 0 if is_taken else content_size(path)
        return cls(
            source=path.name,
            names=layout.names,
            rows=size / max(len(data) / max(len(data.splitlines()), 1), 1.0),
            tentative=layout.tentative,
            notices=list(layout.notices),
            path=path,
            layout=layout,
            is_taken=is_taken,
        )

    def _note_damage(self, what: str) -> None:
        found = damage_notice(self.source, what, self.is_taken)
        if found not in self.notices:
            self.notices.append(found)

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[Columns]:
        """See `Table`; infinite numbers are reported at the end, after lines that are wrong."""
        import pyarrow

        layout, before = self.layout, b""
        parts, infinite = list[list[FloatArray]](), list[str]()
        for line, block in blocks(self.path, layout.offset, layout.line, say=self._note_damage):
            if not block.endswith((b"\n", b"\r")) and _is_cut(block, before, layout):
                self._note_damage(f"is cut off in line {line}")
                break
            before = block
            found = _parse_with_arrow(block, layout, columns)
            parts.append(found or self._parse_by_field(line, block, columns, infinite))
            if sum(part[0].size for part in parts) >= rows:
                yield self._joined(columns, parts)
                parts = []
        if infinite:
            text = f"{self.source}, {infinite[0]} is not a usable number{more_such(len(infinite))}"
            hint = "cut the file before that line, or empty the field if the sample is missing"
            raise InputError(f"{text}: {hint}")
        if parts:
            yield self._joined(columns, parts)
        pyarrow.default_memory_pool().release_unused()  # Arrow keeps memory for more columns

    def _joined(self, columns: Sequence[int], parts: Sequence[Sequence[FloatArray]]) -> Columns:
        scales, own = self.layout.scales, zip(columns, zip(*parts, strict=True), strict=True)
        return {column: np.concatenate(some) * scales.get(column, 1.0) for column, some in own}

    def where(self, row: int) -> str:
        for line, block in blocks(self.path, self.layout.offset, self.layout.line):
            for i, text in enumerate(block.splitlines(), start=line):
                if text.strip(b" \t"):
                    row -= 1
                if row < 0:
                    return f"line {i}"
        return "the last line"

    def _parse_by_field(
        self, first_line: int, block: bytes, columns: Sequence[int], infinite: list[str]
    ) -> list[FloatArray]:
        """Read a block the careful way; ``infinite`` gets the places of infinite numbers."""
        layout = self.layout
        found = [array("d") for _ in columns]
        for line, raw in enumerate(block.splitlines(), start=first_line):
            text = raw.decode(errors="replace")
            if layout.width > 1 and not text.strip(" \t"):
                continue
            fields = self._fields(line, text)
            for values, column in zip(found, columns, strict=True):
                value = number(fields[column], layout.decimal)
                problem = "is not a number"
                if value is None and column in layout.dates:
                    value, problem = _date(fields[column], layout.dates[column])
                cell = fields[column]
                cell = cell if len(cell) <= 30 else f"{cell[:27]}..."
                place = f"line {line}, column {label(self.names, column)}: {cell!r}"
                if value is None:
                    code, hint = "no-number", "correct the line, or give other channels= and time="
                    if _CHECKSUM.search(fields[column]):
                        code, hint = "", "remove the checksums, *hh, from the ends of the lines"
                    raise InputError(f"{self.source}, {place} {problem}", code, hint)
                if math.isinf(value):
                    infinite.append(place)
                values.append(value)
        return [np.array(values) for values in found]

    def _fields(self, line: int, text: str) -> list[str]:
        """Fields of a line; a delimiter after the last one does no harm."""
        width = self.layout.width
        fields = fields_of(self.source, line, text, self.layout.delimiter)
        if len(fields) == width + 1 and not fields[-1]:
            fields.pop()
        if len(fields) != width:
            text = f"{self.source}, line {line}: {len(fields)} fields where {width} were expected"
            raise InputError(f"{text}: correct the line or remove it")
        return fields


def _is_cut(block: bytes, before: bytes, layout: Layout) -> bool:
    """Whether a last line without an end lacks fields, or digits of its last field."""
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
        block = block.replace(b"\t", b" ")
        while b"  " in block:
            block = block.replace(b"  ", b" ")
        for end in (b"\n", b"\r"):
            block = block.replace(b" " + end, end).replace(end + b" ", end)
        block = block.strip(b" ")
    names = [str(i) for i in range(layout.width + layout.trailing)]
    types = {names[i]: pyarrow.float64() for i in columns}
    for i in set(columns) & set(layout.dates):
        types[names[i]] = pyarrow.timestamp("ns", tz="UTC" if layout.dates[i] else None)
    # Blocks of this size gain nothing by threads, and are the same every time without.
    reading = csv.ReadOptions(column_names=names, use_threads=False)
    parsing = csv.ParseOptions(delimiter=layout.delimiter, quote_char=False)
    parsing.ignore_empty_lines = layout.width > 1  # in a single column one is a missing sample
    converting = csv.ConvertOptions(column_types=types, include_columns=list(types))
    converting.null_values, converting.decimal_point = _NULLS, layout.decimal
    try:
        table = csv.read_csv(pyarrow.BufferReader(block), reading, parsing, converting)
    except pyarrow.ArrowInvalid:
        return None
    found: list[FloatArray] = []
    for i in columns:
        column = table.column(names[i])
        if i in layout.dates:  # seconds since 1970, good to a quarter of a microsecond
            found.append(column.cast(pyarrow.int64()).to_numpy() * 1e-9)
        else:
            found.append(_floats(column))
    lines = count_lines(block) + (not block.endswith((b"\n", b"\r")))
    if table.num_rows != lines and layout.width > 1:
        lines = sum(1 for line in block.splitlines() if line.strip(b" \t"))
    return found if table.num_rows == lines and all(map(usable, found)) else None


def _floats(column: pyarrow.ChunkedArray) -> FloatArray:
    """A column of floats, NaN where it has none; Arrow's own way imports pandas."""
    result, at = np.empty(len(column)), 0
    for chunk in column.chunks:
        known, values = chunk.buffers()
        part = result[at : at + len(chunk)]
        part[:] = np.frombuffer(values, float, len(chunk), 8 * chunk.offset)
        if chunk.null_count:
            bits = np.unpackbits(np.frombuffer(known, np.uint8), bitorder="little")
            part[bits[chunk.offset : chunk.offset + len(chunk)] == 0] = np.nan
        at += len(chunk)
    return result


def _date(cell: str, zoned: bool) -> tuple[float | None, str]:
    """Seconds since 1970, or ``None`` and what is wrong with the field."""
    found = FIELD_OF_DATE.fullmatch(cell)
    if found is not None and (found[9] is not None) is not zoned:
        return None, f"has {'no' if zoned else 'a'} zone, unlike the dates before it"
    try:
        return (seconds_of(found), "") if found else (None, "is not a date")
    except ValueError:
        return None, "is not a date that exists"


def open_text(path: Path, wanted: Wanted) -> tuple[CsvTable, ...]:
    """Open a delimited text."""
    return (CsvTable.open(path, wanted.damaged),)
