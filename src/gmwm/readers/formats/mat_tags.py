"""Types of numbers in a MAT file of version 5 to 7, looked at before scipy reads it.

scipy takes the type of numbers from a table by the tag in the file, without a look whether the
table is as long: a tag that no version of MATLAB writes ends the process. The file is followed here
in the order in which scipy reads it. After The MathWorks' "MAT-File Format", chapter 1.
"""

from __future__ import annotations

import math
import zlib
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np

_HEADER, _ENDIAN = 128, 126
_MATRIX, _COMPRESSED = 14, 15
_NUMBERS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13))
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_FULL = frozenset(range(6, 16))
_DEEPEST = 64
_CHUNK = 1 << 16

ByteOrder = Literal["little", "big"]


class _Bytes:
    """Bytes of a file, or those that are compressed in it, read forwards.

    Raises EOFError where there are no more.
    """

    def __init__(self, stream: BinaryIO, order: ByteOrder, packed: bytes | None = None) -> None:
        self._stream, self._order, self._packed = stream, order, packed
        self._inflate, self._ready = zlib.decompressobj(), b""
        self._before = 0  # bytes that nobody wants, before the next that are taken

    def _some(self, count: int) -> bytes:
        """At least one and at most so many."""
        if self._packed is None:
            found = self._stream.read(count)
        else:
            if not self._ready:
                self._ready = self._inflate.decompress(self._packed, _CHUNK)
                self._packed = self._inflate.unconsumed_tail
            found, self._ready = self._ready[:count], self._ready[count:]
        if not found:
            raise EOFError("cut off inside an array")
        return found

    def taken(self, count: int) -> bytes:
        """As many."""
        while self._before:
            self._before -= len(self._some(min(self._before, _CHUNK)))
        parts = []
        while count:
            parts.append(self._some(min(count, _CHUNK)))
            count -= len(parts[-1])
        return b"".join(parts)

    def left_out(self, count: int) -> None:
        """Go on behind so many; what follows the last array is never unpacked."""
        self._before += count

    def numbers(self, content: bytes) -> list[int]:
        """Unsigned numbers of four bytes."""
        known = content[: len(content) // 4 * 4]
        return np.frombuffer(known, "<u4" if self._order == "little" else ">u4").tolist()

    def tag(self) -> tuple[int, int, bytes | None]:
        """Type, size, and the content of an element that fits into its tag."""
        first = self.taken(4)
        (kind,) = self.numbers(first)
        if kind >> 16:
            return kind & 0xFFFF, kind >> 16, self.taken(4)[: kind >> 16]
        return kind, self.numbers(self.taken(4))[0], None

    def element(self) -> tuple[int, bytes]:
        """Type and content of what is small: sizes, names."""
        kind, size, content = self.tag()
        if content is None:
            if size > _CHUNK:
                raise ValueError("a name or shape of more than 65,536 bytes")
            content = self.taken(8 * -(-size // 8))[:size]
        return kind, content


def check_types(path: Path) -> None:
    """Refuse types of numbers that do not exist, and arrays that end before they should.

    Raises ValueError, EOFError or zlib.error. What else is wrong is left to scipy, which says so.
    """
    with path.open("rb") as stream:
        header = stream.read(_HEADER)
        marks: dict[bytes, ByteOrder] = {b"IM": "little", b"MI": "big"}
        order = marks.get(header[_ENDIAN:])
        if order is None or not all(header[:4]):  # version 4, or none at all
            return
        while len(tag := stream.read(8)) == 8:
            kind, size = _Bytes(stream, order).numbers(tag)
            end = stream.tell() + size
            if kind == _COMPRESSED:
                inside = _Bytes(stream, order, stream.read(size))
                if inside.numbers(inside.taken(8))[0] == _MATRIX:
                    _check_array(inside)
            elif kind == _MATRIX:
                _check_array(_Bytes(stream, order))
            stream.seek(end)


def _check_array(content: _Bytes, depth: int = 0) -> None:
    """One array, and those in its cells or fields."""
    flags = content.numbers(content.taken(16))[2]
    kind, is_complex = flags & 0xFF, flags >> 11 & 1
    if kind == _OPAQUE:
        for _ in range(3):
            content.element()
        _check_arrays(content, 1, depth)
        return
    shape = content.numbers(content.element()[1])
    content.element()  # its name
    if kind in _FULL:
        _check_numbers(content, 1 + is_complex)
    elif kind == _SPARSE:
        _check_numbers(content, 3 + is_complex)
    elif kind == _CHAR:
        _check_numbers(content, 1, of_text=True)
    elif kind == _CELL:
        _check_arrays(content, math.prod(shape), depth)
    elif kind == _FUNCTION:
        _check_arrays(content, 1, depth)
    elif kind in (_STRUCT, _OBJECT):
        if kind == _OBJECT:
            content.element()
        longest, names = content.numbers(content.element()[1]), content.element()[1]
        if not longest or not longest[0]:
            raise ValueError("names of fields without a length")
        _check_arrays(content, math.prod(shape) * (len(names) // longest[0]), depth)


def _check_numbers(content: _Bytes, count: int, *, of_text: bool = False) -> None:
    for _ in range(count):
        kind, size, inside = content.tag()
        if not of_text and kind not in _NUMBERS:
            raise ValueError(f"numbers of type {kind}")
        if inside is None:
            content.left_out(8 * -(-size // 8))


def _check_arrays(content: _Bytes, count: int, depth: int) -> None:
    """Arrays in an array, of which those without content have a tag only."""
    if depth == _DEEPEST:
        raise ValueError(f"arrays in arrays, more than {_DEEPEST} deep")
    for _ in range(count):
        kind, size = content.numbers(content.taken(8))
        if kind != _MATRIX:
            raise ValueError(f"an array of type {kind}")
        if size:
            _check_array(content, depth + 1)
