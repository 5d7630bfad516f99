"""How much memory may be used; what needs more is rejected before it is begun."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from gmwm.errors import InputError

VARIABLE = "GMWM_MEMORY"
"""Environment variable: gigabytes that may be used."""

OUT_OF_MEMORY = (
    "there is not enough memory: read fewer channels, cut the recording into parts, or use a "
    "machine with more"
)

_SHARE = 0.5  # of what is available: other programs need some, and estimates are rough
_HELD = 1 << 30  # for the columns of a file, with what is made of them: eleven hours at 200 Hz
_WHERE_UNKNOWN = 4 << 30
_LIMIT: ContextVar[int | None] = ContextVar("limit", default=None)
_CGROUP = Path("/sys/fs/cgroup")


def budget() -> int:
    """Bytes that may be used: as `VARIABLE` says, or half of what the machine has to give."""
    limit = _LIMIT.get()
    if limit is not None:
        return limit
    given = os.environ.get(VARIABLE)
    if given is None:
        return int(_SHARE * _available())
    with suppress(ValueError):
        if 0.0 < float(given) < 1e9:
            return int(float(given) * (1 << 30))
    raise InputError(f"{VARIABLE} = {given!r}: give a positive number of gigabytes, e.g. 8")


@contextmanager
def limited(gigabytes: float | None) -> Iterator[None]:
    """Allow this much within the block; None changes nothing."""
    if gigabytes is None:
        yield
        return
    if not 0.0 < gigabytes < 1e9:
        raise InputError(f"memory = {gigabytes!r}: give a positive number of gigabytes, e.g. 8")
    token = _LIMIT.set(int(gigabytes * (1 << 30)))
    try:
        yield
    finally:
        _LIMIT.reset(token)


def held() -> float:
    """Gigabytes that a file may need to be read into memory; a longer one is kept on disk."""
    is_given = _LIMIT.get() is not None or VARIABLE in os.environ
    return (budget() if is_given else min(budget(), _HELD)) / (1 << 30)


def require(needed: float, what: str) -> None:
    """Raise InputError with the code "memory" if a file needs more bytes than the budget."""
    allowed = budget()
    if needed > allowed:
        size, most = (f"{count / (1 << 30):.3g} GB" for count in (needed, allowed))
        raise InputError(
            f"{what} needs about {size} of memory, and {most} may be used",
            "memory",
            "read fewer columns with channels=, cut the file into parts, or set "
            f"{VARIABLE} (GB) if the machine has more memory",
        )


def _available() -> int:
    """Bytes that the system says it can give, of a container no more than its limit."""
    found = _WHERE_UNKNOWN
    with suppress(OSError, ValueError, AttributeError):  # AttributeError: not on Windows
        found = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    with suppress(OSError, ValueError, IndexError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        found = next(int(each.split()[1]) for each in lines if each.startswith("MemAvail")) << 10
    for limit in ("memory.max", "memory/memory.limit_in_bytes"):
        with suppress(OSError, ValueError):  # ValueError: "max"
            found = min(found, int((_CGROUP / limit).read_text()))
    return found
