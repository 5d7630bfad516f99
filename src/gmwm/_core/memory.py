"""How much memory may be used, and a refusal of what needs more before it is begun."""

from __future__ import annotations

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
_SHARE_OF_MACHINE = 0.25  # for the samples of a recording: what is made of them takes as much
_WHERE_UNKNOWN = 4 << 30
_LIMIT: ContextVar[int | None] = ContextVar("limit", default=None)
_CGROUP = Path("/sys/fs/cgroup")


def budget() -> int:
    """Bytes that may be used: as `VARIABLE` says, or half of what the machine has to give.

    Raises InputError if the variable holds something else than a positive number.
    """
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
    """Allow so much, or a quarter of the machine, unless `VARIABLE` says how much.

    Raises InputError if it is not positive.
    """
    if gigabytes is not None and not 0.0 < gigabytes < 1e9:
        raise InputError(f"memory = {gigabytes!r}: give a positive number of gigabytes, e.g. 8")
    allowed = None if gigabytes is None else int(gigabytes * (1 << 30))
    if allowed is None and VARIABLE not in os.environ:
        allowed = min(budget(), int(_SHARE_OF_MACHINE * _installed()))
    token = _LIMIT.set(allowed)
    try:
        yield
    finally:
        _LIMIT.reset(token)


def require(needed: float, what: str) -> None:
    """Refuse what needs more than the budget.

    needed: Bytes.
    what: For the message: the file.
    Raises InputError with the code "memory".
    """
    allowed = budget()
    if needed > allowed:
        raise InputError(
            f"{what} needs about {_gigabytes(needed)} of memory, and {_gigabytes(allowed)} may be "
            "used",
            "memory",
            f"read fewer columns with channels=, cut it into parts, or set {VARIABLE} (GB) if "
            "there is more",
        )


def _gigabytes(count: float) -> str:
    return f"{count / (1 << 30):.3g} GB"


def _installed() -> int:
    """Bytes of the machine."""
    with suppress(OSError, ValueError, AttributeError):  # AttributeError: not on Windows
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return _WHERE_UNKNOWN


def _available() -> int:
    """Bytes that the system says it can give, of a container no more than its limit."""
    found = _installed()
    with suppress(OSError, ValueError, IndexError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        found = next(int(each.split()[1]) for each in lines if each.startswith("MemAvail")) << 10
    for limit in ("memory.max", "memory/memory.limit_in_bytes"):
        with suppress(OSError, ValueError):  # ValueError: "max"
            found = min(found, int((_CGROUP / limit).read_text()))
    return found
