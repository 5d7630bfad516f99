"""How logs end: whole, with padding, or cut off inside a message."""

from __future__ import annotations

import mmap
from pathlib import Path

_PADDING = b"\0\xff"
_BLOCK = 1 << 16


def end_of_content(path: Path) -> int:
    """Byte after the last one that may be something else than padding, zeros or 0xFF."""
    end = path.stat().st_size
    if not end:
        return 0
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        last = data[end - 1 :]
        while end and last in _PADDING:
            start = max(end - _BLOCK, 0)
            kept = len(data[start:end].rstrip(last))
            end = start + kept
            if kept:
                break
    return end


def cut_off(seconds: float) -> str:
    """What is wrong with a log that ends inside a message, some time after its first sample."""
    return f"is cut off or damaged {seconds:.6g} s after its first sample, inside a message"
