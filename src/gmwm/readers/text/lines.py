"""Bytes of a text file, plain or gzip, in blocks of whole lines."""

from __future__ import annotations

import gzip
import io
import re
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, cast

from gmwm._core.files import opened
from gmwm.errors import InputError

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
